# Copyright 2026 ahv developers, Apache-2.0
"""Whatever a campaign's folder holds, it is read or named in one sentence: no traceback."""

import json
import shutil
from concurrent.futures import ThreadPoolExecutor
from random import Random

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ahv_analysis.campaign.campaign import (
    Campaign,
    find_run,
    first_causes,
    fly_campaign,
    open_campaign,
)
from ahv_analysis.campaign.store import level_folder, part_files
from ahv_analysis.campaign.summary import summarize_campaign
from ahv_analysis.errors import CampaignError
from ahv_analysis.flight.case import load_case
from ahv_msgs_py.parameters import ParameterError
from test.test_hostile_bags import spoilt_bytes, spoilt_tree

LEVEL = 0.3
CHECKSUM = b"ahv_checksum"


@pytest.fixture(scope="module")
def seed(tmp_path_factory):
    """Folder of a small campaign to begin with."""
    folder = tmp_path_factory.mktemp("seed")
    with ThreadPoolExecutor(1) as pool:
        case = load_case("neuro_adaptive_di", {"duration": 0.05})
        fly_campaign(Campaign(case, LEVEL, 20, 1), folder, pool)
    return folder


def spoilt_description(text, random):
    """The JSON of a part that is spoilt: as a text, or in its content."""
    way = random.randrange(4)
    if way == 0:
        return spoilt_bytes(text, random)
    if way == 1:
        return random.choice((b"", b"[" * 100_000, b"1e999", b"{}", b"null", b'{"case": NaN}'))
    return json.dumps(spoilt_tree(json.loads(text), random), skipkeys=True).encode()


def spoilt_column(column, random):
    """A column of other values, or of another type."""
    values = column.to_pylist()
    way = random.randrange(5)
    if way == 0:
        types = (pa.string(), pa.bool_(), pa.int8(), pa.float32(), pa.list_(pa.int64()))
        return pa.nulls(len(values), random.choice(types))
    if way == 1:
        return pa.array([str(value) for value in values])
    if way == 2:
        return pa.array([[value] for value in values])
    place = random.randrange(len(values))
    odd = random.choice((None, -1, 0, 2**31, 2**62, float("nan"), float("inf"), 1e300))
    values[place] = odd
    try:
        return pa.array(values, column.type)
    except (pa.ArrowException, OverflowError, TypeError):
        return pa.array([str(value) for value in values])


def spoilt_table(table, random):
    """A part whose description, columns or rows are spoilt, its checksum often right for that."""
    metadata = dict(table.schema.metadata)
    text = metadata[b"ahv"]
    for _ in range(random.randrange(1, 3)):
        way = random.randrange(6)
        if way < 3:
            metadata[b"ahv"] = spoilt_description(text, random)
        elif way == 3 and table.num_columns and len(table):
            place = random.randrange(table.num_columns)
            name, column = table.column_names[place], table.column(place)
            table = table.set_column(place, name, spoilt_column(column, random))
        elif way == 4 and table.num_columns:
            place = random.randrange(table.num_columns)
            table = random.choice(
                (
                    table.remove_column(place),
                    table.append_column(table.column_names[place], table.column(place)),
                    table.rename_columns(["x", *table.column_names[1:]]),
                )
            )
        else:
            table = random.choice(
                (table.slice(0, 0), table.slice(3), pa.concat_tables([table] * 2))
            )
    if random.randrange(4):
        metadata.pop(CHECKSUM, None)  # as of an older campaign
    return table.replace_schema_metadata(metadata)


def check_a_spoilt_campaign(folder, seed, random):
    """Read a spoilt campaign; all that may come of it is one sentence."""
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(seed, folder)
    (part,) = part_files(level_folder(folder, LEVEL))
    if random.randrange(3):
        pq.write_table(spoilt_table(pq.read_table(part), random), part)
    if not random.randrange(3):
        part.write_bytes(spoilt_bytes(part.read_bytes(), random))
    if not random.randrange(8):
        name = random.choice(
            ("part-.parquet", "part-x.parquet", "part-000000007.parquet", "part-9")
        )
        part = part.rename(part.with_name(name))
    if not random.randrange(8):
        name = random.choice(("runs-", "runs-nan", "runs-0.30", "runs-x", "runs-1e9"))
        part.parent.rename(folder / name)

    def flown_on():
        with ThreadPoolExecutor(1) as pool:
            found = open_campaign(folder)
            fly_campaign(found, folder, pool, interrupted=lambda: True)

    def summarized():
        found = open_campaign(folder)
        json.dumps(summarize_campaign(found, folder), allow_nan=False)

    readings = (
        flown_on,
        summarized,
        lambda: first_causes(open_campaign(folder), folder, 10),
        lambda: find_run(open_campaign(folder, LEVEL), folder, random.choice((0, 7, 10**9))),
    )
    try:
        random.choice(readings)()
    except (CampaignError, ParameterError) as error:
        assert "\n" not in str(error) and len(str(error)) < 1500


def fuzz(folder, seed, examples):
    @settings(max_examples=examples, deadline=None, suppress_health_check=list(HealthCheck))
    @given(st.randoms(use_true_random=True))
    def check(random: Random):
        check_a_spoilt_campaign(folder, seed, random)

    check()


def test_a_spoilt_campaign_is_read_or_named(tmp_path, seed):
    fuzz(tmp_path / "campaign", seed, 500)


@pytest.mark.slow
def test_fifty_thousand_spoilt_campaigns_are_read_or_named(tmp_path, seed):
    fuzz(tmp_path / "campaign", seed, 50_000)

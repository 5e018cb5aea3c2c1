# Copyright 2026 ahv developers, Apache-2.0
"""What a campaign keeps: a folder a level, of Parquet files with one row a run.

A file holds the runs of one part of the campaign, so that nothing ever needs more memory than a
part, whatever the size of the whole. Together the files are one table, sorted by run:
`pyarrow.parquet.read_table` and `pandas.read_parquet` take the folder.
"""

import json
import os
import zlib
from collections.abc import Iterator, Mapping, Sequence
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from ahv_analysis.bag.notes import json_object, names_a_case
from ahv_analysis.bag.rows import Array
from ahv_analysis.errors import CampaignError
from ahv_analysis.flight.outcome import Cause
from ahv_msgs_py.layout import excerpt
from ahv_plant.dispersion import HIGHEST_LEVEL, Dispersion
from ahv_plant.model.constants import DEGREES

PART_RUNS = 2048  # of a file: some seconds of work and half a megabyte
LONGEST_REASON = 500  # characters that are quoted of a library's
CHECKSUM = b"ahv_checksum"
Columns = dict[str, Array]


def level_name(level: float) -> str:
    """Name of a level: two levels never share one."""
    return np.format_float_positional(level, trim="-")


def level_folder(folder: Path, level: float) -> Path:
    """Folder of one level of a campaign."""
    return folder / f"runs-{level_name(level)}"


def part_file(runs: Path, first: int) -> Path:
    """File of the part that begins with the run `first`; names sort as runs do."""
    return runs / f"part-{first:09d}.parquet"


def part_files(runs: Path) -> list[Path]:
    """Files of all parts that a level's folder holds, sorted by run."""
    return sorted(runs.glob("part-*.parquet"))


# Least and largest that a column may hold; a vehicle that failed at once keeps what it began with.
PLAUSIBLE = {
    **{name: (0.05, 5.0) for name in Dispersion._fields},  # [-]
    "initial_u": (0.0, 8100.0),  # [m/s]
    **{f"initial_{rate}": (-1.7, 1.7) for rate in "PQR"},  # [rad/s]
    "initial_h": (-500.0, 48500.0),  # [m]
    "cause": (min(Cause), max(Cause)),
    "time_s": (0.0, 3600.0),
    "max_abs_alpha_deg": (0.0, 180.0),
    "alpha_margin_deg": (-175.0, 5.0),
    "max_abs_beta_deg": (0.0, 90.0),
    "max_abs_rate_dps": (0.0, inf),
    "max_abs_phi_deg": (0.0, inf),
    "min_surface_deg": (-40.0 - 1e-9, 9.0 * DEGREES),
    "max_surface_deg": (-9.0 * DEGREES, 30.0 + 1e-9),
    "min_throttle": (0.1, 9.0),
    "max_throttle": (-9.0, 0.9),
    "max_altitude_error_m": (0.0, 48500.0),
    "max_observer_error_dps": (0.0, inf),
    "final_altitude_m": (0.0, 48500.0),
    "final_speed_mps": (-inf, inf),
    "rms_altitude_error_m": (0.0, 48500.0),
    "final_altitude_error_m": (-48500.0, 48500.0),
    "rms_speed_error_mps": (0.0, inf),
    "max_speed_error_mps": (0.0, inf),
    "max_heading_error_deg": (0.0, inf),
    "fuel_kg": (-1.0, 2e5),
    "least_mach": (0.0, 99.0),
    "outside_corridor_s": (0.0, 3600.01),
    "nose_down_alpha_deg": (-180.0, 180.0),
    "trim_exists": (False, True),
    "trim_alpha_deg": (-90.0, 90.0),  # where one exists
}
TYPES = dict.fromkeys(("run", *PLAUSIBLE), "double") | {
    "run": "int64",
    "cause": "int64",
    "trim_exists": "bool",
}


def read_part(path: Path, names: Sequence[str] | None = None) -> tuple[Columns, dict[str, Any]]:
    """Columns of a part, all or those of `names`, and the description of its campaign.

    All of the file is looked at, whatever is asked for, so that no damage goes unnoticed.
    """
    try:
        with pq.ParquetFile(path, page_checksum_verification=True) as file:
            _check_size(file)
            table = file.read()
        if any(column.null_count for column in table.columns):
            raise ValueError("it has no value in some places")
        metadata = table.schema.metadata or {}
        text = metadata.get(b"ahv", b"")
        description = _description(text)
        columns = {name: table[name].to_numpy() for name in table.column_names}
        checksum = metadata.get(CHECKSUM)
        if checksum not in (None, _checksum(text, columns["run"])):  # None: of an older campaign
            raise ValueError("its description or its number of runs has changed")
        check_columns(columns, int(path.stem.removeprefix("part-")))
    except (OSError, pa.ArrowException, ValueError) as error:
        reason = " ".join(str(error).split())[:LONGEST_REASON]
        raise CampaignError(
            f"{path} is not the file of a campaign, or is damaged ({reason}): "
            "delete it and run again, and its runs are flown anew"
        ) from error
    return {name: columns[name] for name in names or columns}, description


def _check_size(file: pq.ParquetFile) -> None:
    """Raise ValueError where a file is no part, before it is read: it may claim any size."""
    if not 0 < file.metadata.num_rows <= PART_RUNS:
        raise ValueError(f"it has {file.metadata.num_rows} rows, and not 1 to {PART_RUNS}")
    found = [(field.name, str(field.type)) for field in file.schema_arrow]
    wrong = sorted({*found} ^ {*TYPES.items()})
    if wrong or len(found) != len(TYPES):
        raise ValueError(f"its columns are others, as {excerpt(str((wrong or found)[0]))}")


def _description(text: bytes) -> dict[str, Any]:
    """Description of a campaign; ValueError if the text is none."""
    content = json_object(text.decode())
    level, seed = content.get("level"), content.get("seed")
    if not (
        names_a_case(content)
        and type(level) in (int, float)
        and 0.0 <= level <= HIGHEST_LEVEL
        and type(seed) is int
        and seed >= 0
        and isinstance(content.get("random_starts"), bool)
        and isinstance(content.get("draws"), dict | None)
        and "source" in content
    ):
        raise ValueError("it lacks the description")
    return content


def _checksum(text: bytes, runs: Array) -> bytes:
    """Checksum of what stands outside the pages of a file, which have their own."""
    return str(zlib.crc32(text + runs.tobytes())).encode()


def check_columns(columns: Columns, first: int) -> None:
    """Raise ValueError where the columns of the part from run `first` on are not plausible."""
    if columns.keys() != {"run", *PLAUSIBLE}:
        raise ValueError(f"its columns are {', '.join(columns)}")
    runs = columns["run"]
    if np.any(np.diff(runs) <= 0) or not (first <= runs[0] and runs[-1] < first + PART_RUNS):
        raise ValueError(f"its runs are not of {first} to {first + PART_RUNS - 1}")
    for name, (least, largest) in PLAUSIBLE.items():
        values = columns[name]
        inside = (values >= least) & (values <= largest)
        if name == "trim_alpha_deg":
            inside |= ~columns["trim_exists"]
        if not np.all(inside):
            wrong = np.flatnonzero(~inside)[0]
            raise ValueError(
                f"{name} of run {runs[wrong]} is {values[wrong]}, and not {least:g} to {largest:g}"
            )


def read_parts(
    runs: Path, names: Sequence[str], described: Mapping[str, Any] | None = None
) -> Iterator[Columns]:
    """Columns `names` part by part, sorted by run.

    Raises CampaignError if a part is not of the campaign that is `described`.
    """
    for path in part_files(runs):
        columns, found = read_part(path, names)
        differing = "" if described is None else differences(found, described)
        if differing:
            raise CampaignError(
                f"{runs} holds another campaign, or one of other code ({differing}): "
                "choose another --out"
            )
        yield columns


def differences(there: Mapping[str, Any], here: Mapping[str, Any]) -> str:
    """What two descriptions do not have in common, in words; empty if nothing."""
    return ", ".join(
        name if isinstance(value, Mapping) else f"{name} {found} there and {value} here"
        for name, value in here.items()
        for found in [excerpt(str(there.get(name)))[1:-1]]
        if there.get(name) != value
    )


def write_part(path: Path, parts: Sequence[Columns], described: Mapping[str, Any]) -> None:
    """Write `parts` as one file, sorted by run and each run once, whole or not at all."""
    joined = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    _, order = np.unique(joined["run"], return_index=True)
    table = pa.table({name: column[order] for name, column in joined.items()})
    draft = path.with_name(f".{path.name}.{os.getpid()}")  # no reader sees a name with a dot
    text = json.dumps(described).encode()
    checksum = _checksum(text, table["run"].to_numpy())
    table = table.replace_schema_metadata({b"ahv": text, CHECKSUM: checksum})
    pq.write_table(table, draft, write_page_checksum=True)
    draft.replace(path)

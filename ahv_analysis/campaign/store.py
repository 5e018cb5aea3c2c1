# Copyright 2026 ahv developers, Apache-2.0
"""What a campaign keeps: a folder a level, of Parquet files with one row a run.

A file holds the runs of one part of the campaign, so that nothing ever needs more memory than a
part, whatever the size of the whole. Together the files are one table, sorted by run:
`pyarrow.parquet.read_table` and `pandas.read_parquet` take the folder.
"""

import json
import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from ahv_analysis.bag.record import Array
from ahv_analysis.errors import CampaignError

PART_RUNS = 2048  # of a file: some seconds of work and half a megabyte
DESCRIBED = {"source", "case", "level", "seed", "random_starts", "parameters"}
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


def read_part(path: Path, names: Sequence[str] | None = None) -> tuple[Columns, dict[str, Any]]:
    """Columns of a part, all or those of `names`, and the description of its campaign."""
    try:
        table = pq.read_table(path, columns=None if names is None else list(names))
        description = json.loads(table.schema.metadata[b"ahv"])
        columns = {name: table[name].to_numpy() for name in names or table.column_names}
        if "run" not in columns or not set(description) >= DESCRIBED:
            raise ValueError("it lacks the runs or the description")
    except (OSError, pa.ArrowException, KeyError, TypeError, ValueError) as error:
        reason = " ".join(str(error).split())
        raise CampaignError(f"{path} is not the file of a campaign: {reason}") from error
    return columns, description


def read_parts(
    runs: Path, names: Sequence[str], described: Mapping[str, Any] | None = None
) -> Iterator[Columns]:
    """Columns `names` part by part, sorted by run.

    Raises CampaignError if a part is not of the campaign that is `described`.
    """
    for path in part_files(runs):
        columns, found = read_part(path, names)
        if described is not None and found != json.loads(json.dumps(described)):
            raise CampaignError(
                f"{runs} holds another campaign, or one of other code: choose another --out"
            )
        yield columns


def write_part(path: Path, parts: Sequence[Columns], described: Mapping[str, Any]) -> None:
    """Write `parts` as one file, sorted by run and each run once, whole or not at all."""
    joined = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    _, order = np.unique(joined["run"], return_index=True)
    table = pa.table({name: column[order] for name, column in joined.items()})
    draft = path.with_name(f".{path.name}.{os.getpid()}")  # no reader sees a name with a dot
    pq.write_table(table.replace_schema_metadata({"ahv": json.dumps(described)}), draft)
    draft.replace(path)

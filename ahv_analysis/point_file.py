# Copyright 2026 ahv developers, Apache-2.0
"""Points of a map as files: a table and JSON, each with what describes them."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq


def write_points(
    folder: Path, name: str, rows: Sequence[Mapping[str, Any]], described: Mapping[str, Any]
) -> None:
    """Write `rows`, a point each, to `name`.parquet and `name`.json in `folder`."""
    table = pa.Table.from_pylist(list(rows))
    text = json.dumps(described, allow_nan=False)
    pq.write_table(table.replace_schema_metadata({"ahv": text}), folder / f"{name}.parquet")
    content = json.dumps({**described, "points": rows}, indent=2, allow_nan=False)
    (folder / f"{name}.json").write_text(content + "\n", encoding="utf-8")

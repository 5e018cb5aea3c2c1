# Copyright 2026 ahv developers, Apache-2.0
"""API pages from the docstrings, in build/docs, with the units that stand behind the fields.

`make docs` calls this with NUMBA_DISABLE_JIT=1, so that compiled functions are documented as the
functions that they are.
"""

import inspect
import pkgutil
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from types import ModuleType

import pdoc

PACKAGES = ("ahv_plant", "ahv_control", "ahv_msgs_py", "ahv_analysis")
OUT = Path("build/docs")


def modules() -> Iterator[ModuleType]:
    """Every module of the packages."""
    for name in PACKAGES:
        for found in pkgutil.iter_modules(import_module(name).__path__, f"{name}."):
            yield import_module(found.name)


def document_fields(module: ModuleType) -> None:
    """Make the comment behind each field of a named tuple the documentation of the field."""
    for _, owner in inspect.getmembers(module, inspect.isclass):
        if owner.__module__ != module.__name__ or not hasattr(owner, "_fields"):
            continue
        for line in inspect.getsource(owner).splitlines():
            name, _, rest = line.strip().partition(":")
            if name in owner._fields:
                getattr(owner, name).__doc__ = rest.partition("#")[2].strip()


def main() -> None:
    """Write the pages."""
    for module in modules():
        document_fields(module)
    pdoc.render.configure(docformat="markdown")
    pdoc.pdoc(*PACKAGES, output_directory=OUT)
    print(OUT / "index.html")


if __name__ == "__main__":
    main()

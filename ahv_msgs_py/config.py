# Copyright 2026 ahv developers, Apache-2.0
"""Where the files of `config` are: cases, profiles of the middleware, layouts of viewers."""

import sys
from pathlib import Path


def config_folder() -> Path:
    """Folder `config` of the source tree, or of the installation."""
    source = Path(__file__).resolve().parents[1]
    if (source / "package.xml").exists():
        return source / "config"
    # setuptools installs into <prefix>/lib/pythonX.Y/site-packages, and data into <prefix>/share
    for prefix in (*source.parents, Path(sys.prefix)):
        if (prefix / "share" / "ahv" / "config").is_dir():
            return prefix / "share" / "ahv" / "config"
    raise FileNotFoundError("the configuration of ahv is not installed beside its code")

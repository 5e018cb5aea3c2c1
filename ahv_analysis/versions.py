# Copyright 2026 ahv developers, Apache-2.0
"""What software flies: filed with every bag, so that a flight can be told from another's."""

import platform
from importlib.metadata import PackageNotFoundError, version

from ahv_plant.numerics.elementwise import source_hash

# Distributions of each package: rclpy has one name on PyPI and another in a ROS installation.
DISTRIBUTIONS = {
    "ahv": ("ahv",),
    "rclpy": ("ros-jazzy-rclpy", "rclpy"),
    "numba": ("numba",),
    "numpy": ("numpy",),
    "rosbags": ("rosbags",),
}


def versions() -> dict[str, str]:
    """Versions of Python and of the packages that a flight depends on, and the code's own hash.

    A package that is not installed is left out: the library engine flies without rclpy.
    """
    found = {}
    for package, names in DISTRIBUTIONS.items():
        for name in names:
            try:
                found[package] = version(name)
            except PackageNotFoundError:
                continue
            break
    return found | {"python": platform.python_version(), "source": source_hash()}

# Copyright 2026 ahv developers, Apache-2.0
"""What software flies: filed with every bag, so that a flight can be told from another's."""

import platform
from importlib.metadata import PackageNotFoundError, version

from llvmlite.binding import get_host_cpu_features

from ahv_plant.numerics.identity import HOUSE, Definition, identity

# Distributions of each package: rclpy has one name on PyPI and another in a ROS installation.
DISTRIBUTIONS = {
    "ahv": ("ahv",),
    "rclpy": ("ros-jazzy-rclpy", "rclpy"),
    "numba": ("numba",),
    "numpy": ("numpy",),
    "rosbags": ("rosbags",),
}
# the vehicle and the laws, whatever closes the loop
FLIES = (
    Definition(HOUSE / "ahv_plant" / "vehicle.py"),
    Definition(HOUSE / "ahv_control" / "flight_control.py"),
)


def what_computes(*roots: Definition) -> dict[str, str]:
    """All on which the bits of a result may depend: code, versions, kind of processor.

    Compiled code neither fuses nor reorders operations, so the bits should depend on the first
    alone; but a mix would show it too late if they did not.
    """
    fused = "fma" if get_host_cpu_features().get("fma") else "no fma"
    return {
        "source": identity(*roots),
        "processor": f"{platform.machine()}, {fused}",
        **{package: version(package) for package in ("numba", "llvmlite", "numpy")},
    }


def source_hash() -> str:
    """Hash of what flies: the code that this process runs, for sources are read once."""
    return identity(*FLIES)


def versions() -> dict[str, str]:
    """Versions of Python and of packages that a flight depends on; a hash of what computes it.

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

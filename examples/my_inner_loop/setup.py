# Copyright 2026 ahv developers, Apache-2.0
"""Package `my_inner_loop`, built by colcon."""

from setuptools import setup

NAME = "my_inner_loop"

setup(
    name=NAME,
    version="0.1.0",
    packages=[NAME],
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
    ],
    entry_points={"console_scripts": [f"{NAME} = {NAME}.{NAME}:main"]},
)

# Copyright 2026 ahv developers, Apache-2.0
"""The examples: a controller of one's own flies the same plant; their packages can be built."""

import os
import sys
from pathlib import Path

import numpy as np
import pytest
from catkin_pkg.package import parse_package

from ahv_analysis.bag.reader import read_bag
from ahv_analysis.bag.record import record_of
from ahv_analysis.flight.case import load_case
from ahv_analysis.flight.library import fly
from test.documents import ROOT, run_in_terminals

EXAMPLES = ROOT / "examples"
DURATION = 30.0  # [s]


def test_an_inner_loop_of_ones_own_flies_the_plant_as_well_as_ours(tmp_path, domain):
    case = f"--ros-args --params-file {ROOT / 'config' / 'cases' / 'nominal_di.yaml'}"
    mine = EXAMPLES / "my_inner_loop" / "my_inner_loop" / "my_inner_loop.py"
    terminals = [
        f"ahv-recorder --ros-args -p bag:={tmp_path / 'bag'}",
        f"ahv-outer_intermediate {case}",
        f"ahv-velocity {case}",
        f"python {mine}",
        f"ahv-plant {case} -p listeners:=4 -p duration:={DURATION}",
    ]
    programs = f"{Path(sys.executable).parent}:{os.environ['PATH']}"
    environment = os.environ | {"PATH": programs, "ROS_DOMAIN_ID": str(domain)}
    run_in_terminals(terminals, tmp_path, environment)
    flown = read_bag(tmp_path / "bag")
    assert flown.steps == DURATION * 100
    ours = record_of(fly(load_case("nominal_di", {"duration": DURATION})), False)
    largest, of_ours = (np.degrees(np.max(np.abs(f.air.alpha))) for f in (flown, ours))
    assert largest == pytest.approx(of_ours, abs=0.1)
    assert largest != of_ours, "that was not the example's law"
    assert max(abs(np.degrees(flown.column(name)[-1])) for name in "PQR") < 0.1


@pytest.mark.parametrize("name", ["my_inner_loop", "my_inner_loop_cpp"])
def test_a_package_of_an_example_is_valid(name):
    warnings = []
    package = parse_package(str(EXAMPLES / name / "package.xml"), warnings=warnings)
    package.validate(warnings=warnings)
    assert not warnings
    assert package.name == name
    assert package.get_build_type() == ("ament_cmake" if name.endswith("cpp") else "ament_python")


def test_cmake_finds_what_the_package_depends_on():
    package = parse_package(str(EXAMPLES / "my_inner_loop_cpp" / "package.xml"))
    text = (EXAMPLES / "my_inner_loop_cpp" / "CMakeLists.txt").read_text()
    for dependency in [*package.build_depends, *package.buildtool_depends]:
        assert f"find_package({dependency.name} REQUIRED)" in text
    source = (EXAMPLES / "my_inner_loop_cpp" / "src" / "my_inner_loop.cpp").read_text()
    included = {
        line.split('"')[1].partition("/")[0]
        for line in source.splitlines()
        if line.startswith('#include "')
    }
    assert included == {dependency.name for dependency in package.build_depends}

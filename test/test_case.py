# Copyright 2026 ahv developers, Apache-2.0
"""A case file is a ROS parameter file; what is wrong with it is said in one sentence."""

import math

import pytest

from ahv_analysis.flight.case import case_names, load_case
from ahv_msgs_py.config import config_folder
from ahv_msgs_py.parameters import ParameterError
from ahv_plant.dispersion import NOMINAL
from ahv_plant.model.constants import RADIANS

pytestmark = pytest.mark.unit

TEXT = (config_folder() / "cases" / "nominal_di.yaml").read_text()


def test_nominal_case_is_section_3_5_2():
    case = load_case("nominal_di")
    start = case.plant.initial
    assert (start.u, start.v, start.w, start.h, start.mass) == (
        1836.4,
        0.0,
        91.8,
        24100.0,
        136077.6,
    )
    assert (start.P, start.Q, start.R) == (3 * RADIANS, 2 * RADIANS, -3 * RADIANS)
    assert (start.phi, start.theta, start.psi) == (0.0, 2.94 * RADIANS, 0.0)
    assert case.plant.steps == 15000
    assert case.control.outer == (24000.0, 0.01, math.pi, math.pi / 2, None)
    assert case.control.intermediate == (0.2, 0.2, 0.2)
    assert case.control.inner.tracking.gain == (2.0, 2.0, 2.0)
    assert case.control.inner.tracking.exponent == 1.0
    assert case.control.learner is None
    assert case.plant.truth == NOMINAL
    assert case.control.velocity == (1786.4, 0.01, False)


@pytest.mark.parametrize("name", case_names())
def test_every_case_of_the_package_loads(name):
    assert load_case(name).name == name


def test_duration_replaces_that_of_the_file():
    assert load_case("nominal_di", {"duration": 1.5}).plant.steps == 150


def test_shared_parameters_reach_every_node_that_knows_them(tmp_path):
    path = tmp_path / "geometric.yaml"
    path.write_text(TEXT.replace("geometric_altitude: false", "geometric_altitude: true"))
    case = load_case(str(path))
    assert (
        case.plant.truth.geometric
        and case.control.inner.geometric
        and case.control.velocity.geometric
    )


@pytest.mark.parametrize(
    "change, words",
    [
        (("k_theta: 0.2", "k_theta: -0.2"), ("outer_intermediate", "k_theta", "-0.2", "0 to 50")),
        (("k_theta: 0.2", "k_theta: fast"), ("k_theta", "'fast'", "a number")),
        (("k_theta: 0.2", "k_thta: 0.2"), ("'k_thta'; did you mean 'k_theta'? valid are",)),
        (("k_u: 0.01", "k_u: .nan"), ("velocity", "k_u", "nan", "0 to 50")),
        (("h: 24100.0", "h: 47500.0"), ("plant", "altitude", "47500", "0 to 47000 m")),
        (("u: 1836.4", "u: 800.0"), ("plant", "speed", "800", "Mach 4 to 24")),
        (("mass: 136077.6", "mass: 1.0"), ("initial.mass", "1.0", "60000 to 140000 kg")),
        (("/**/velocity", "/ahv/speed"), ("/ahv/speed", "/**/velocity")),
        (("/**/velocity", "/**/velocty"), ("did you mean '/**/velocity'?",)),
        (("geometric_altitude: false", "use_sim_time: true"), ("/**", "use_sim_time is True")),
        (
            ("geometric_altitude: false", "geometric_altitude: 1"),
            ("geometric_altitude", "true or"),
        ),
        (("  ros__parameters:\n    k_P", "  parameters:\n    k_P"), ("/**/inner_loop", "ros__")),
        (("/**/velocity:", "]["), ("not a readable YAML",)),
        (("k_P: 2.0", "geometric_altitude: true"), ("geometric_altitude", "/**", "once")),
    ],
)
def test_a_wrong_case_is_named(tmp_path, change, words):
    path = tmp_path / "wrong.yaml"
    assert change[0] in TEXT
    path.write_text(TEXT.replace(*change))
    with pytest.raises(ParameterError) as error:
        load_case(str(path))
    sentence = str(error.value)
    assert "wrong" in sentence or "plant" in sentence
    assert all(word in sentence for word in words), sentence
    assert "\n" not in sentence


def test_what_is_for_all_nodes_and_none_knows_is_ignored_with_a_word(tmp_path, caplog):
    path = tmp_path / "shared.yaml"
    more = (
        "geometric_altitude: false\n    altitud: 1.0\n    speed: 1800.0\n    use_sim_time: false"
    )
    path.write_text(TEXT.replace("geometric_altitude: false", more).replace("speed: 1786.4", ""))
    assert load_case(str(path)).control.velocity.speed == 1800.0
    assert caplog.messages == [
        "shared.yaml: /**: there is no parameter 'altitud'; did you mean 'altitude'? "
        "ignored, as it is for all nodes"
    ]


def test_a_number_may_be_written_as_people_do(tmp_path):
    path = tmp_path / "scientific.yaml"
    path.write_text(TEXT.replace("k_h: 0.01", "k_h: 1e-2").replace("k_P: 2.0", "k_P: 2"))
    case = load_case(str(path))
    assert case.control.outer.k_h == 0.01 and case.control.inner.tracking.gain.P == 2.0


def test_an_unknown_case_lists_the_known_ones():
    with pytest.raises(ParameterError, match=r"'nope'.*nominal_di"):
        load_case("nope")


def test_what_a_file_says_goes_before_what_its_base_says(tmp_path):
    file = tmp_path / "mine.yaml"
    file.write_text(
        "/**/velocity:\n  ros__parameters:\n    k_u: 0.2\n"
        "/**:\n  ros__parameters:\n    base: neuro_adaptive_di_protected\n    k_P: 3.0\n"
    )
    mine, base = load_case(str(file)).parameters, load_case("neuro_adaptive_di_protected")
    assert mine["velocity"]["k_u"] == 0.2
    assert mine["inner_loop"]["k_P"] == mine["disturbance_learner"]["k_P"] == 3.0
    assert mine["outer_intermediate"] == base.parameters["outer_intermediate"]


def test_a_base_that_is_none_is_named(tmp_path):
    file = tmp_path / "mine.yaml"
    file.write_text("/**:\n  ros__parameters:\n    base: nominal\n")
    with pytest.raises(
        ParameterError, match=r"base: there is no case 'nominal'; did .* valid are .*di"
    ):
        load_case(str(file))

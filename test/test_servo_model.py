# Copyright 2026 ahv developers, Apache-2.0
"""Hedging: a law that knows its commands alone, and reckons where its servos have the surfaces."""

import numpy as np
import pytest
import rclpy

from ahv_analysis.bag.reader import read_bag
from ahv_analysis.bag.record import record_of
from ahv_analysis.campaign.campaign import Campaign, fly_again, fly_runs
from ahv_analysis.flight.case import load_case, make_case
from ahv_analysis.flight.library import fly
from ahv_analysis.flight.one_process import fly_graph
from ahv_analysis.replay.inputs import read_recording
from ahv_analysis.replay.replay import replay
from ahv_analysis.replay.result import total
from ahv_control.disturbance_learner_node import DisturbanceLearnerNode
from ahv_control.servo_model import ModelledServo, ServoModel, next_servo
from ahv_msgs_py.parameters import ParameterError
from ahv_msgs_py.topics import SURFACES
from ahv_plant.dispersion import Dispersion
from ahv_plant.model.constants import DEGREES, RADIANS, STEP

SEED = 2026


def modelled(name="neuro_adaptive_di", hardware="typical", learner=None, **plant):
    """Case whose observer hears the surfaces of a model, unless `learner` says otherwise."""
    given = load_case(name, plant, hardware=hardware).parameters
    heard = {"observer_surfaces": "modelled"} | (learner or {})
    return make_case(
        "modelled", given | {"disturbance_learner": given["disturbance_learner"] | heard}
    )


def exact(order, heard="modelled", bandwidth=30.0):
    """Servos as the model has them: no delay, and positions that are measured without an error."""
    servo = {"order": order, "bandwidth": 30.0, "damping": 0.7, "rate_limit": 60.0}
    plant = {
        f"actuator.{kind}.{part}": value
        for kind in ("elevons", "rudder")
        for part, value in servo.items()
    }
    learner = {"observer_surfaces": heard, "servo_model.order": order}
    learner["servo_model.bandwidth"] = bandwidth
    return modelled("neuro_adaptive_di_protected", "ideal", learner, duration=4.0, **plant)


def deviation(case):
    """Largest distance [deg] of a modelled surface from the one measured, at each step."""
    drawn = Campaign(case, 0.3, 1, SEED).case_of(0)
    found = []
    for step in fly(drawn):
        positions = [servo.position for servo in step.learner.servos]
        found.append(np.max(np.abs(np.subtract(positions, step.measured.surfaces))) * DEGREES)
    return np.array(found)


@pytest.mark.parametrize("order", [1, 2])
def test_a_model_that_is_right_has_the_surfaces_where_they_are_measured(order):
    """From a start that it does not know, by a trim, and through 33 deg at the rate limit."""
    found = deviation(exact(order))
    assert found[0] < 0.1
    assert np.max(found) < 0.1
    assert np.max(found[200:]) < 1e-9


@pytest.mark.unit
def test_a_model_of_half_the_bandwidth_has_them_elsewhere():
    found = deviation(exact(1, bandwidth=15.0))
    assert np.max(found) > 0.5
    assert np.max(found[50:]) > 0.01


def learned(case):
    """Largest pitch disturbance [deg/s^2] that is learned of a vehicle that has none."""
    return np.max(np.abs(record_of(fly(case), False).estimates[:, 1])) * DEGREES


def test_what_moves_late_is_no_disturbance_to_who_knows_how_late():
    """On the nominal vehicle all that is learned is false; the wrong model learns more of it."""
    nominal = {f"dispersion.{name}": 1.0 for name in Dispersion._fields}

    def of(heard, bandwidth=30.0):
        given = exact(1, heard, bandwidth).parameters
        learner = given["disturbance_learner"] | {"first_estimate": 0.0}
        plant = given["plant"] | nominal | {"initial.Q": 2.0}  # which the surfaces hurry to stop
        return learned(make_case("one", given | {"disturbance_learner": learner, "plant": plant}))

    commanded, measured = of("commanded"), of("measured")
    right, wrong = of("modelled"), of("modelled", 15.0)
    assert commanded > 10.0 * right
    assert right < 0.1 and measured < 0.2
    assert 3.0 * right < wrong < 0.5 * commanded


@pytest.mark.unit
def test_a_servo_of_first_order_follows_an_exponential_and_no_faster_than_its_limit():
    """x = c (1 - exp(-w t)), from the textbook; the limit holds, and so do the stops."""
    model = ServoModel(1, 30.0, 0.7, float("inf"), -40.0 * RADIANS, 30.0 * RADIANS)
    servo, limited = ModelledServo(0.0, 0.0), ModelledServo(0.0, 0.0)
    for step in range(1, 31):
        servo = next_servo(servo, 0.1, model)
        assert servo.position == pytest.approx(0.1 * (1 - np.exp(-30.0 * step * STEP)), rel=1e-3)
        limited = next_servo(limited, -2.0, model._replace(rate_limit=1.0))
        assert limited.position == pytest.approx(-step * STEP)
    for _ in range(200):
        limited = next_servo(limited, -2.0, model)
    assert limited.position == pytest.approx(-40.0 * RADIANS)
    assert next_servo(servo, 1.0, model._replace(order=0)).position == 30.0 * RADIANS


@pytest.mark.parametrize("hardware", ["ideal", "typical"])
def test_the_model_is_the_same_in_a_lane_alone_and_flown_step_by_step(hardware):
    case = modelled("neuro_adaptive_sc_gdi_protected", hardware, duration=6.0)
    campaign = Campaign(case, 0.3, 3, SEED)
    rows = fly_runs(campaign, 0, 3)
    for run in range(3):
        for name, column in fly_again(campaign, run).items():
            assert np.array_equal(column[0], rows[name][run], equal_nan=True), name
        *_, last = fly(campaign.case_of(run))
        assert (last.state.h, last.state.u) == (
            rows["final_altitude_m"][run],
            rows["final_speed_mps"][run],
        )


@pytest.mark.graph
@pytest.mark.parametrize("hardware", ["ideal", "typical"])
def test_graph_library_and_replay_agree_on_the_model_to_the_last_bit(hardware, tmp_path):
    drawn = modelled("neuro_adaptive_sc_gdi_protected", hardware, duration=2.0)
    case = Campaign(drawn, 0.3, 1, SEED).case_of(0)
    assert fly_graph(case, tmp_path / "graph")[0] == ""
    flown, alone = read_bag(tmp_path / "graph"), record_of(fly(case), False)
    for name in ("states", "surfaces", "throttle", "learner", "estimates"):
        one, other = (np.asarray(getattr(record, name)) for record in (flown, alone))
        assert one.tobytes() == other.tobytes(), name
    again = total(replay(read_recording(tmp_path / "graph"), case, case.controllers).comparisons)
    assert (again["differences"], again["missing"]) == (0, 0)
    other = modelled("neuro_adaptive_sc_gdi_protected", hardware, {"servo_model.bandwidth": 15.0})
    wrong = replay(read_recording(tmp_path / "graph"), other, ["disturbance_learner"])
    assert total(wrong.comparisons)["differences"] > 0


@pytest.mark.graph
@pytest.mark.parametrize("heard, listens", [("commanded", 0), ("modelled", 0), ("measured", 1)])
def test_only_who_hears_measured_surfaces_listens_to_them(heard, listens):
    context = rclpy.Context()
    rclpy.init(context=context)
    node = DisturbanceLearnerNode({"observer_surfaces": heard}, context)
    node.trigger_configure()
    node.trigger_activate()
    assert node.count_subscribers(SURFACES.name) == listens
    node.trigger_shutdown()
    node.destroy_node()
    rclpy.shutdown(context=context)


@pytest.mark.unit
def test_a_choice_that_is_none_is_named():
    with pytest.raises(ParameterError) as error:
        modelled(learner={"observer_surfaces": "guessed"})
    told = str(error.value)
    assert "observer_surfaces is 'guessed'" in told
    assert "one of commanded, modelled, measured" in told

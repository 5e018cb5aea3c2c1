# Copyright 2026 ahv developers, Apache-2.0
"""Flights on hardware that is not ideal: the same by every engine, and what becomes of them."""

from itertools import islice

import numpy as np
import pytest
import rclpy
from matplotlib import pyplot

from ahv_analysis.bag.dataset import flight_dataset
from ahv_analysis.bag.reader import load_bag, read_bag
from ahv_analysis.bag.record import record_of
from ahv_analysis.campaign.campaign import Campaign, fly_again, fly_runs
from ahv_analysis.flight.case import load_case, make_case
from ahv_analysis.flight.library import fly, fly_library
from ahv_analysis.flight.one_process import fly_graph
from ahv_analysis.quantities import BY_NAME, of_group
from ahv_analysis.replay.inputs import read_recording
from ahv_analysis.replay.replay import replay
from ahv_analysis.replay.result import total
from ahv_analysis.report.metrics import why_ended_early
from ahv_analysis.report.page_figures import bag_figures
from ahv_control.held_inputs import held_positions
from ahv_msgs_py.node.faults import HOLD, PERIOD
from ahv_msgs_py.topics import HARDWARE_TOPICS, LOOP_TOPICS, REFERENCE
from ahv_plant.model.vectors import Controls, Surfaces
from ahv_plant.plant_node import PlantNode

SEED = 11
TYPICAL = {
    "actuator.elevons.order": 1,
    "actuator.elevons.rate_limit": 60.0,
    "actuator.rudder.order": 2,
    "actuator.rudder.rate_limit": 60.0,
    "actuator.engine.order": 1,
    "actuator.engine.bandwidth": 5.0,
    "latency.delay": 0.02,
    "latency.jitter": 0.2,
    **{f"sensor.{state}.noise": 0.02 for state in ("P", "Q", "R", "phi", "theta", "psi")},
    **{f"sensor.{surface}.noise": 0.05 for surface in ("right_elevon", "left_elevon", "rudder")},
}
# Of a record: all that is not None in an adaptive flight on hardware.
ARRAYS = (
    "stamps",
    "states",
    "attitude_commands",
    "rate_commands",
    "surfaces",
    "throttle",
    "learner",
    "estimates",
    "measured",
    "positions",
)


@pytest.fixture(scope="module")
def case():
    given = load_case("neuro_adaptive_sc_gdi_protected").parameters
    plant = given["plant"] | TYPICAL | {"duration": 12.0}
    learner = given["disturbance_learner"] | {"observer_surfaces": "measured"}
    return make_case("typical", given | {"plant": plant, "disturbance_learner": learner})


@pytest.mark.parametrize("random_starts", [False, True])
def test_a_run_is_the_same_in_a_lane_alone_and_flown_step_by_step(case, random_starts):
    campaign = Campaign(case, 0.3, 3, SEED, random_starts)
    rows = fly_runs(campaign, 0, 3)
    for run in range(3):
        alone = fly_again(campaign, run)
        for name, column in alone.items():
            assert np.array_equal(column[0], rows[name][run], equal_nan=True), name
        *_, last = fly(campaign.case_of(run))
        assert last.state.h == rows["final_altitude_m"][run]
        assert last.state.u == rows["final_speed_mps"][run]


def of_one(case):
    """The flight that a test on the graph has time for: run 0 of the campaign, 4 s of it."""
    drawn = Campaign(case, 0.3, 1, SEED).case_of(0)
    given = drawn.parameters
    short = given["plant"] | {"duration": 4.0}
    return make_case(drawn.name, given | {"plant": short}, drawn.draw)


@pytest.fixture(scope="module")
def bags(case, tmp_path_factory):
    """Bags of one flight: of the library and of the graph."""
    folder = tmp_path_factory.mktemp("typical")
    assert fly_library(of_one(case), folder / "library")[0] == ""
    assert fly_graph(of_one(case), folder / "graph")[0] == ""
    return folder


def test_graph_library_and_lane_agree_to_the_last_bit(case, bags):
    flown, computed = read_bag(bags / "graph"), read_bag(bags / "library")
    alone = record_of(fly(of_one(case)), False)
    for name in ARRAYS:
        bits = np.asarray(getattr(alone, name)).tobytes()
        assert np.asarray(getattr(flown, name)).tobytes() == bits, name
        assert np.asarray(getattr(computed, name)).tobytes() == bits, name
    plant = case.plant._replace(steps=400)
    lane = fly_runs(Campaign(case._replace(plant=plant), 0.3, 2, SEED), 0, 2)
    assert lane["final_altitude_m"][0] == flown.column("h")[-1]
    assert lane["final_speed_mps"][0] == flown.column("u")[-1]


def test_graph_and_library_write_the_same_messages(bags):
    one, other = (load_bag(bags / name) for name in ("graph", "library"))
    assert REFERENCE.name not in {*one, *other}, "nothing guides"
    for topic in (topic for topic in LOOP_TOPICS if topic is not REFERENCE):
        assert sorted(one[topic.name].messages) == sorted(other[topic.name].messages), topic.name
        assert len(one[topic.name].messages) == 401


@pytest.mark.parametrize("engine", ["graph", "library"])
def test_every_command_of_a_flight_on_hardware_is_replayed(case, bags, engine):
    flown = replay(read_recording(bags / engine), of_one(case), case.controllers)
    found = total(flown.comparisons)
    assert (found["compared"], found["differences"], found["missing"]) == (401 * 6, 0, 0)
    assert not any(flown.skipped.values())


def test_what_is_measured_is_near_the_truth_and_not_the_truth(bags):
    flown = read_bag(bags / "graph")
    error = np.degrees(flown.measured - flown.states)
    assert np.std(error[:, 3:9], axis=0) == pytest.approx(0.02, rel=0.15)
    assert np.all(error[:, [0, 1, 2, 9, 10, 11, 12]] == 0.0)  # perfect sensors
    # an actuator is never where it is sent while that moves
    lag = np.degrees(flown.positions - flown.surfaces)
    assert 0.05 < np.std(lag[:, 0]) < 10.0


def test_an_ideal_flight_has_no_topic_of_hardware(tmp_path):
    case = load_case("neuro_adaptive_di", {"duration": 0.2})
    fly_library(case, tmp_path / "library")
    fly_graph(case, tmp_path / "graph")
    for engine in ("library", "graph"):
        assert not {topic.name for topic in HARDWARE_TOPICS} & set(load_bag(tmp_path / engine))
        flown = read_bag(tmp_path / engine)
        assert flown.measured is flown.positions is None


def test_ideal_surfaces_are_measured_by_nobody():
    """A graph would wait for the measurement for ever; the command is the same."""
    given = load_case("neuro_adaptive_di", {"duration": 0.2}).parameters
    learner = given["disturbance_learner"] | {"observer_surfaces": "measured"}
    case = make_case("ideal", given | {"disturbance_learner": learner})
    assert case.parameters == given


@pytest.mark.parametrize("heard", ["commanded", "modelled", "measured"])
def test_the_learner_hears_measured_surfaces_where_it_should(case, bags, heard):
    """Its answers differ from the recorded ones if it is told something else than in flight."""
    given = of_one(case).parameters
    learner = given["disturbance_learner"] | {"observer_surfaces": heard}
    other = make_case("other", given | {"disturbance_learner": learner})
    flown = replay(read_recording(bags / "graph"), other, ["disturbance_learner"])
    assert bool(total(flown.comparisons)["differences"]) is (heard != "measured")


def test_a_plant_that_is_configured_again_has_its_draws_and_its_delay_again(case):
    context = rclpy.Context()
    rclpy.init(context=context)
    node = PlantNode(of_one(case).parameters["plant"], context)
    command = Controls(Surfaces(0.1, 0.1, 0.0), 0.5)
    flights = []
    for _ in range(2):
        node.trigger_configure()
        plants = [node.plant]
        for number in range(20):
            plants.append(node.flown.later(plants[-1], command, number))
        flights.append(plants)
        node.trigger_cleanup()
    node.destroy_node()
    rclpy.shutdown(context=context)
    assert flights[0] == flights[1]
    assert len({plant.measured.state.Q for plant in flights[0]}) == 21


def test_a_measurement_that_stays_away_gives_way_to_the_command():
    """In real time: held as long as a command is, then none, and the command stands in."""
    steps = HOLD // PERIOD
    assert held_positions((0.1, 0.2, 0.3), steps) == (0.1, 0.2, 0.3)
    assert held_positions((0.1, 0.2, 0.3), steps + 1) is None
    assert held_positions(None, 0) is None


def test_why_a_flight_on_hardware_ended_early_is_found_from_its_bag(case, tmp_path):
    given = case.parameters
    dive = {"initial.h": 200.0, "initial.theta": -40.0, "initial.w": 0.0}
    lost = make_case("lost", given | {"plant": given["plant"] | dive})
    said, _ = fly_library(lost, tmp_path / "bag")
    assert "left the atmosphere" in said
    assert why_ended_early(read_bag(tmp_path / "bag"), lost) == said


def test_a_page_shows_truth_and_measurement_commands_and_positions(bags):
    flown = read_bag(bags / "graph")
    for name in ("Q_measured", "theta_measured", "rudder_position"):
        one = BY_NAME[name]
        assert one in of_group("Hardware")
        assert one.drawn_reference(flown, None) == pytest.approx(one.drawn(flown), abs=15.0)
    dataset = flight_dataset(flown, None)
    sources = {name: dataset[name].attrs["source"] for name in ("Q", "Q_measured")}
    assert sources == {"Q": "/ahv/truth", "Q_measured": "/ahv/state"}
    assert dataset["rudder_position"].attrs["source"] == "/ahv/surfaces"
    plates, draw = bag_figures(bags / "graph")
    assert [plate.number for plate in plates[-2:]] == ["H.1", "H.2"]
    pyplot.close(draw(plates[-1]))


def test_a_block_of_draws_ends_where_it_likes(case):
    """The flight is longer than a block, and its steps are no multiple of one."""
    whole = fly_runs(Campaign(case, 0.3, 1, SEED), 0, 1)
    odd = case._replace(plant=case.plant._replace(steps=1003))
    *_, last = islice(fly(Campaign(case, 0.3, 1, SEED).case_of(0)), 1004)
    part = fly_runs(Campaign(odd, 0.3, 1, SEED), 0, 1)
    assert part["final_altitude_m"][0] == last.state.h != whole["final_altitude_m"][0]

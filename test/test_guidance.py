# Copyright 2026 ahv developers, Apache-2.0
"""References by time and by waypoints: what they are, and that the loops follow them."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import StateSpace, lsim

from ahv_analysis.bag.dataset import flight_dataset
from ahv_analysis.bag.reader import read_bag
from ahv_analysis.bag.record import record_of
from ahv_analysis.campaign.campaign import Campaign, fly_again, fly_runs
from ahv_analysis.flight.case import load_case, profile_names
from ahv_analysis.flight.library import fly
from ahv_analysis.flight.one_process import fly_graph
from ahv_analysis.quantities import BY_NAME
from ahv_analysis.replay.inputs import read_recording
from ahv_analysis.replay.replay import replay
from ahv_analysis.report.metrics import measure
from ahv_control.guidance import guidance_step, start_guidance
from ahv_control.guidance_parameters import GUIDANCE_PARAMETERS, guidance
from ahv_msgs_py.parameters import ParameterError, check_parameters
from ahv_plant.dispersion import NOMINAL
from ahv_plant.model.atmosphere import atmosphere
from ahv_plant.model.constants import DEGREES, GRAVITY, STEP
from ahv_plant.trim import trim
from ahv_plant.vehicle import state_rate
from test.flights import CRUISE, between


def guided(**values):
    """Guidance of these parameters; the others are as by default."""
    return guidance(check_parameters("guidance", GUIDANCE_PARAMETERS, values))


def reference_at(time, made):
    """Reference of a guidance by time."""
    return start_guidance(CRUISE, round(time / STEP), made)[1]


@pytest.mark.unit
def test_a_step_is_there_at_its_time_and_a_ramp_is_linear():
    made = guided(altitude_changes="24500 at 10; 24000 at 20 over 50", shape="ramp")
    for time, altitude in ((9.99, 24000.0), (10.0, 24500.0), (20.0, 24500.0), (45.0, 24250.0)):
        assert reference_at(time, made).altitude == pytest.approx(altitude, abs=1e-9)
    assert reference_at(70.0, made).altitude == 24000.0


@pytest.mark.unit
@given(between(10.0, 100.0), between(-3000.0, 3000.0), st.integers(1, 9))
def test_a_smooth_transition_is_the_quintic_of_least_jerk(over, change, tenth):
    """Its coefficients follow from the six conditions at its ends, solved here by numpy."""
    steps = round(over / STEP)
    made = guided(
        altitude_changes=f"{24000.0 + change!r} at 10 over {steps * STEP!r}", feed_forward=True
    )
    powers = np.arange(6)
    at_ends = [[0.0**p for p in powers], [1.0] * 6]
    slopes = [[p * 0.0 ** max(p - 1, 0) for p in powers], powers]
    curves = [[p * (p - 1) * 0.0 ** max(p - 2, 0) for p in powers], powers * (powers - 1)]
    conditions = np.array([*at_ends, *slopes, *curves], float)
    quintic = np.polynomial.Polynomial(np.linalg.solve(conditions, [0, 1, 0, 0, 0, 0]))
    number = steps * tenth // 10
    share = number / steps
    reference = start_guidance(CRUISE, 1000 + number, made)[1]
    assert reference.altitude == pytest.approx(24000.0 + change * quintic(share), abs=1e-6)
    rate = change * quintic.deriv()(share) / (steps * STEP)
    assert reference.altitude_rate == pytest.approx(rate, abs=1e-6)


@pytest.mark.unit
@pytest.mark.parametrize("keeps", ["Mach number", "dynamic pressure"])
def test_a_climb_keeps_what_it_is_to_keep_and_sends_the_rate_of_the_speed(keeps):
    made = guided(altitude_changes="27000 at 0 over 300", keeps=keeps, feed_forward=True)
    kept = []
    for time in (0.0, 100.0, 200.0, 300.0):
        reference = reference_at(time, made)
        air = atmosphere(reference.altitude, False)
        by_mach = reference.speed / air.sound_speed
        by_pressure = math.sqrt(air.density) * reference.speed
        kept.append(by_mach if keeps == "Mach number" else by_pressure)
    assert kept == pytest.approx([kept[0]] * 4, rel=1e-12)
    before, after = (reference_at(time, made).speed for time in (149.5, 150.5))
    assert reference_at(150.0, made).speed_rate == pytest.approx(after - before, rel=1e-3)


@pytest.mark.unit
def test_a_turn_is_banked_as_lift_turns_the_vehicle_and_no_more_than_its_limit():
    """tan phi* = V psi_dot / g."""
    ramp = {"heading_changes": "10 at 0 over 100", "shape": "ramp", "feed_forward": True}
    reference = reference_at(50.0, guided(**ramp))
    turn = 0.1 / DEGREES
    assert reference.psi_rate == pytest.approx(turn)
    assert math.tan(reference.phi) == pytest.approx(1786.4 * turn / GRAVITY)
    assert reference_at(50.0, guided(**ramp, bank_limit=5.0)).phi * DEGREES == pytest.approx(5.0)
    assert reference_at(50.0, guided(**ramp, coordinated=False)).phi == 0.0


@pytest.mark.unit
def test_a_vehicle_is_led_to_its_waypoints_within_the_limits_of_its_rates():
    made = guided(waypoints="x 100e3 y 20e3 h 25000 u 1800; x 200e3 y 20e3 h 24500 u 1800")
    state = CRUISE
    memory, reference = start_guidance(state, 0, made)
    legs, headings, climbs = [], [], []
    for number in range(1, 16000):  # a point that flies as it is told
        x = state.x + 1786.4 * math.cos(reference.psi) * STEP
        y = state.y + 1786.4 * math.sin(reference.psi) * STEP
        state = state._replace(x=x, y=y, h=reference.altitude)
        before = reference
        memory, reference = guidance_step(memory, state, number, made)
        headings.append((reference.psi - before.psi) * DEGREES / STEP)
        climbs.append((reference.altitude - before.altitude) / STEP)
        legs.append(memory.leg)
    assert sorted(set(legs)) == [0.0, 1.0, 2.0], "both are reached, in their order"
    assert max(map(abs, headings)) <= 0.15 + 1e-6 and max(map(abs, climbs)) <= 15.0 + 1e-4
    assert max(climbs) == pytest.approx(15.0, abs=0.01)
    assert reference.altitude == pytest.approx(24500.0, abs=1.0)


@pytest.mark.unit
def test_a_guidance_that_starts_again_in_flight_goes_on_to_the_first_waypoint_ahead():
    made = guided(waypoints="x 100e3 y 0 h 25000 u 1800; x 200e3 y 0 h 24500 u 1800")
    there = CRUISE._replace(x=150e3, h=24800.0)
    memory, reference = start_guidance(there, 9000, made)
    assert memory.leg == 1.0
    assert (reference.altitude, reference.speed) == (24800.0, there.u)


@pytest.mark.unit
@pytest.mark.parametrize(
    "values, words",
    [
        ({"altitude_changes": "up at 10"}, ("altitude_changes", "'up at 10'", "24500 at 10")),
        ({"altitude_changes": "1 at 9; 2 at 3"}, ("change at 3 s", "until 9 s")),
        ({"heading_changes": "1 at -5"}, ("heading_changes", "-5", "0 to 1e+06")),
        ({"speed_changes": "1 at 1e999"}, ("speed_changes", "1 at 1e999")),
        ({"waypoints": "x 1 y 2"}, ("waypoints", "x 1 y 2", "h 25000")),
        ({"waypoints": "x 1e300 y 0 h 2 u 3"}, ("within", "1e+08")),
        ({"heading_changes": "1e300 at 1"}, ("heading_changes", "3600 deg")),
        ({"speed_changes": "9" * 10**5 + "x at 1"}, ("speed_changes", "9999", "24500 at 10")),
        ({"shape": "soft"}, ("shape", "soft", "smooth, ramp")),
        ({"keeps": "calm"}, ("keeps", "calm", "Mach number")),
        ({"altitude_changes": "; ".join(["1 at 1"] * 99)}, ("99 entries", "50")),
        (
            {"waypoints": "x 1 y 2 h 3 u 4", "altitude_changes": "1 at 1"},
            ("altitude_changes", "empty beside waypoints"),
        ),
    ],
)
def test_what_cannot_be_followed_is_refused_in_one_sentence(values, words):
    with pytest.raises(ParameterError) as refused:
        guided(**values)
    assert all(word in str(refused.value) for word in words) and "\n" not in str(refused.value)


@pytest.mark.unit
@pytest.mark.parametrize(
    "change, words",
    [
        ("altitude_changes: '60000 at 10'", ("at 10 s", "60000 m", "atmosphere")),
        ("speed_changes: '900 at 10'", ("at 10 s", "900 m/s", "Mach 4")),
        ("altitude_changes: '35000 at 10'", ("at 10 s", "35000 m", "alpha above 5 deg")),
        ("altitude_changes: '46000 at 1', speed_changes: '7000 at 1'", ("46000 m", "level")),
        ("heading_changes: '90 at 10 over 160', shape: ramp", ("0.562 deg/s", "bank_limit")),
        ("waypoints: 'x 1e5 y 0 h 40000 u 1800'", ("waypoint 1", "40000 m", "alpha above")),
        ("waypoints: 'x 1e5 y 0 h 24000 u 900'", ("waypoint 1", "900 m/s")),
    ],
)
def test_where_no_vehicle_can_follow_no_reference_leads(tmp_path, change, words):
    profile = tmp_path / "profile.yaml"
    profile.write_text(
        "/**: {ros__parameters: {guided: true}}\n"
        f"/**/guidance: {{ros__parameters: {{{change}}}}}\n"
    )
    with pytest.raises(ParameterError) as refused:
        load_case("nominal_di", profile=str(profile))
    assert all(word in str(refused.value) for word in words)


@pytest.mark.unit
@pytest.mark.parametrize(
    "text, words",
    [
        ("/**/guidance: {ros__parameters: {shape: ramp}}", ("guided: true",)),
        (
            "/**: {ros__parameters: {guided: true}}\n/**/plant: {ros__parameters: {seed: 1}}",
            ("seed",),
        ),
        (
            "/**: {ros__parameters: {guided: true}}\n/**/velocity: {ros__parameters: {k_u: 1.0}}",
            ("velocity: k_u", "no place in a profile"),
        ),
    ],
)
def test_a_profile_says_what_is_flown_and_nothing_else(tmp_path, text, words):
    profile = tmp_path / "profile.yaml"
    profile.write_text(text)
    with pytest.raises(ParameterError) as refused:
        load_case("nominal_di", profile=str(profile))
    assert all(word in str(refused.value) for word in words)


def predicted(altitudes, k_Q=2.0, k_theta=0.2, k_h=0.01):
    """Altitudes [m] after a change of h*, row by row `altitudes` [m], by the loops linearised.

    Altitude error to climb angle (k_h), pitch (k_theta), pitch rate (k_Q), and the lift that turns
    the path: its slope is the only number that is the vehicle's.
    """
    level = trim()
    V, step = level.state.u, 1e-4

    def turning(alpha):  # of the path [rad/s], by w alone
        state = level.state._replace(w=V * math.tan(alpha))
        rate = state_rate(state, level.surfaces, level.throttle, 0.0, NOMINAL)
        return -rate.w / V

    lift = (turning(level.alpha + step) - turning(level.alpha - step)) / (2.0 * step)
    # h, climb angle, pitch, pitch rate
    A = np.array(
        [
            [0.0, V, 0.0, 0.0],
            [0.0, -lift, lift, 0.0],
            [0.0, 0.0, 0.0, 1.0],
            [-k_Q * k_theta * k_h / V, -k_Q * k_theta, 0.0, -k_Q],
        ]
    )
    B = np.array([0.0, 0.0, 0.0, k_Q * k_theta * k_h / V])
    system = StateSpace(A, B[:, None], np.array([[1.0, 0.0, 0.0, 0.0]]), 0.0)
    return lsim(system, altitudes, np.arange(len(altitudes)) * STEP)[1]


def flown_from_trim(tmp_path, changes, duration):
    """Altitudes [m] over 24 km, and those asked for, of the nominal vehicle from level flight."""
    level = trim().state
    case = tmp_path / "case.yaml"
    start = f"u: {level.u!r}, w: {level.w!r}, theta: {level.theta * DEGREES!r}, h: 24000.0"
    case.write_text(
        "/**: {ros__parameters: {base: nominal_di, guided: true}}\n"
        f"/**/plant: {{ros__parameters: {{duration: {duration}, initial: {{{start}, "
        "P: 0.0, Q: 0.0, R: 0.0}}}\n"
        f"/**/guidance: {{ros__parameters: {{shape: ramp, {changes}}}}}\n"
    )
    flight = record_of(fly(load_case(str(case))), False)
    assert flight.inlet_started
    return flight.column("h") - 24000.0, flight.references[:, 0] - 24000.0


def test_an_altitude_step_closes_as_the_loops_predict(tmp_path):
    """Within a fortieth of the step, for the air thins and fuel burns; other gains do not fit."""
    h, wanted = flown_from_trim(tmp_path, "altitude_changes: '24500 at 0.01'", 300.0)
    missed = [
        np.max(np.abs(h - predicted(wanted, **gains)))
        for gains in ({}, {"k_h": 0.012}, {"k_theta": 0.1})
    ]
    assert missed[0] < 12.5 < min(missed[1:])


def test_a_ramp_is_followed_with_the_lag_that_the_loops_predict(tmp_path):
    """It grows towards the rate over k_h: 100 m for 1 m/s."""
    ramp = "altitude_changes: '24400 at 0 over 400'"
    h, wanted = flown_from_trim(tmp_path, ramp, 400.0)
    assert np.max(np.abs(h - predicted(wanted))) < 10.0
    assert (wanted - h)[39990] == pytest.approx(100.0, abs=10.0)
    h, wanted = flown_from_trim(tmp_path, f"{ramp}, feed_forward: true", 400.0)
    assert np.max(np.abs(h - wanted)) < 10.0, "none of it where the rate is sent as well"


def same_bits(case, bag, domain):
    """Fly a case on the graph and in the library, and replay it: all of it to the same bits."""
    flown = record_of(fly(case), False)
    fly_graph(case, bag, domain=domain)
    graph = read_bag(bag)
    for name in ("states", "attitude_commands", "surfaces", "throttle", "references"):
        assert np.array_equal(getattr(graph, name), getattr(flown, name)), name
    again = replay(read_recording(bag), case, case.controllers)
    assert "guidance" in {entry.node for entry in again.comparisons}
    steps = case.plant.steps + 1
    assert all(entry.compared == steps and not entry.differences for entry in again.comparisons)
    for name, index in (("h", 0), ("u", 1)):
        drawn = BY_NAME[name].drawn_reference(graph, None)  # the dashed line
        assert np.array_equal(drawn, flown.references[:, index])


# the first changes come at 10 s
BEGUN = [*((one, "typical") for one in profile_names()), ("altitude_step", None)]
BEGUN += [("waypoints", None)]


@pytest.mark.parametrize("profile, hardware", BEGUN)
def test_a_profile_flies_to_the_same_bits_as_nodes_in_lanes_and_again(
    tmp_path, domain, profile, hardware
):
    case = "neuro_adaptive_sc_gdi_protected"
    loaded = load_case(case, {"duration": 12.0}, hardware=hardware, profile=profile)
    same_bits(loaded, tmp_path / "bag", domain)


@pytest.mark.slow
@pytest.mark.parametrize("hardware", [None, "typical"])
@pytest.mark.parametrize("profile", profile_names())
def test_a_whole_profile_flies_to_the_same_bits_and_keeps_its_inlet(
    tmp_path, domain, profile, hardware
):
    case = load_case("neuro_adaptive_sc_gdi_protected", hardware=hardware, profile=profile)
    same_bits(case, tmp_path / "bag", domain)
    assert read_bag(tmp_path / "bag").inlet_started


@pytest.mark.parametrize("keeps", ["climb_mach", "climb_pressure"])
def test_a_climb_keeps_what_its_profile_names(keeps):
    """From where it begins: within a fiftieth of the Mach number, a fortieth of the pressure."""
    case = load_case("nominal_di", {"duration": 560.0}, profile=keeps)
    record = record_of(fly(case), False)
    under_way = slice(6000, None)
    kept = record.air.mach if keeps == "climb_mach" else record.air.dynamic_pressure
    kept = kept[under_way] / np.mean(kept[under_way])
    assert np.max(np.abs(kept - 1.0)) < (0.02 if keeps == "climb_mach" else 0.025)
    assert record.column("h")[-1] == pytest.approx(27000.0, abs=100.0)


def test_a_lane_follows_its_own_waypoints_to_the_bits_of_the_run_alone():
    case = load_case(
        "neuro_adaptive_di", {"duration": 30.0}, hardware="typical", profile="waypoints"
    )
    campaign = Campaign(case, 0.2, 3, 5)
    rows = fly_runs(campaign, 0, 3)
    alone = fly_again(campaign, 2)
    assert all(np.array_equal(alone[name][0], rows[name][2], equal_nan=True) for name in rows)


def test_a_guided_flight_is_measured_and_drawn_against_its_reference():
    case = load_case("nominal_di", {"duration": 2.0}, profile="waypoints")
    record = record_of(fly(case), False)
    moved = replace(record, references=np.asarray(record.references) + 100.0)
    error = [
        measure(one, case.control)["tracking"]["altitude"]["final"] for one in (record, moved)
    ]
    assert error[1] == pytest.approx(error[0] - 100.0)
    dataset = flight_dataset(record, None)
    assert np.array_equal(dataset["altitude_reference"], record.references[:, 0])
    unguided = record_of(fly(load_case("nominal_di", {"duration": 2.0})), False)
    assert "altitude_reference" not in flight_dataset(unguided, None)

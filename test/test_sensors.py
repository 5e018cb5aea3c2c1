# Copyright 2026 ahv developers, Apache-2.0
"""Sensors tell what is true but for the errors they are given, and chance is drawn again alike."""

import math
import os
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ahv_msgs_py.parameters import ParameterError, check_parameters
from ahv_plant.hardware.noise import (
    GUSTS,
    NO_DRAWS,
    Channel,
    NoiseStream,
    draws_of,
    noisy_channels,
)
from ahv_plant.hardware.parameters import (
    NOISE_PARAMETERS,
    SENSOR_PARAMETERS,
    lag,
    sensor_settings,
)
from ahv_plant.hardware.sensors import (
    PERFECT,
    AirVelocity,
    Noise,
    Sensor,
    Sensors,
    first_measurement,
    lagged,
    measure,
    reading,
)
from ahv_plant.model.constants import RADIANS, STEP
from ahv_plant.model.vectors import State, Surfaces
from ahv_plant.numerics.elementwise import kernel
from ahv_plant.numerics.simd import LANES, load, store
from ahv_plant.start import DEFAULT_START

pytestmark = pytest.mark.unit

QUIET = NO_DRAWS.noise
SURFACES = Surfaces(-0.1, 0.05, -0.0)
STATE = DEFAULT_START._replace(v=-0.0, P=-0.0, phi=-0.0, Q=0.01, R=-0.02)
SAMPLES = 100_000


def flat(value):
    if isinstance(value, tuple):
        return [number for part in value for number in flat(part)]
    return [] if value is None else [value]


def same_bits(one, other):
    return np.array(flat(one), float).tobytes() == np.array(flat(other), float).tobytes()


def sensors_of(**channels):
    """Sensors that are perfect but for the named ones; with air data where one of those is."""
    air = [channels.pop(name, None) for name in AirVelocity._fields]
    return Sensors(
        State(*(channels.get(name, PERFECT) for name in State._fields)),
        Surfaces(*(channels.get(name, PERFECT) for name in Surfaces._fields)),
        None if air == [None] * 3 else AirVelocity(*(sensor or PERFECT for sensor in air)),
    )


def drawn_sensors(seed, with_air=True):
    """Sensors with every error at once, each on in three channels of four."""
    draw = np.random.default_rng(seed)

    def sensor():
        noise, bias, scale, quantum, on = draw.uniform(size=5)
        share = float(draw.uniform(0.05, 1.0)) if on > 0.25 else 1.0
        sizes = (1e-3 * noise, bias - 0.5, scale - 0.5, 1e-2 * quantum)
        return Sensor(*(float(size) if draw.uniform() > 0.25 else 0.0 for size in sizes), share)

    return Sensors(
        State(*(sensor() for _ in State._fields)),
        Surfaces(*(sensor() for _ in Surfaces._fields)),
        AirVelocity(sensor(), sensor(), sensor()) if with_air else None,
    )


def draws(channels, run=0, seed=1, steps=SAMPLES):
    """Columns of a block, a row for each channel."""
    block = NoiseStream(seed, run, channels).block(steps)
    return block[:, [list(Channel).index(channel) for channel in channels]].T


# What a sensor does


@pytest.mark.parametrize("value", [0.0, -0.0, 1.0, -3.7e-9, 2.4e4, math.inf, -math.inf])
def test_a_perfect_sensor_tells_the_value_itself_to_the_last_bit(value):
    for normal in (0.0, -0.0, 1.3, -2.1):
        assert same_bits(reading(value, normal, PERFECT), value)
    assert same_bits(lagged(7.0, value, PERFECT), value)


def test_perfect_sensors_tell_the_state_and_the_surfaces_to_the_last_bit():
    normals = Noise(State(*[1.5] * 13), Surfaces(-1.5, 2.0, 0.5), AirVelocity(1.0, -1.0, 0.3))
    memory, first = first_measurement(STATE, STATE, SURFACES, normals, sensors_of())
    assert same_bits(first, (STATE, SURFACES))
    later = STATE._replace(u=1800.0, h=-0.0)
    _, told = measure(memory, later, later, Surfaces(-0.0, 0.1, 0.2), normals, sensors_of())
    assert same_bits(told, (later, Surfaces(-0.0, 0.1, 0.2)))


@pytest.mark.parametrize("name", [*State._fields, *Surfaces._fields])
def test_the_error_of_one_channel_touches_no_other(name):
    sensors = sensors_of(**{name: Sensor(noise=0.5, bias=2.0)})
    normals = Noise(State(*[1.0] * 13), Surfaces(1.0, 1.0, 1.0), QUIET.air)
    _, (state, surfaces) = first_measurement(STATE, STATE, SURFACES, normals, sensors)
    told, true = (a._asdict() | b._asdict() for a, b in ((state, surfaces), (STATE, SURFACES)))
    assert told.pop(name) == true.pop(name) + 2.5
    assert same_bits(tuple(told.values()), tuple(true.values()))


def test_bias_and_scale_factor_are_exact():
    # all of these are short in binary
    assert reading(100.0, 0.0, Sensor(bias=0.25)) == 100.25
    assert reading(100.0, 0.0, Sensor(scale=-0.125)) == 87.5
    assert reading(100.0, 3.0, Sensor(noise=0.5, bias=0.25, scale=0.5)) == 151.75


def test_a_quantised_reading_is_the_nearest_multiple_and_ties_go_to_the_even_one():
    sensor = Sensor(quantum=0.25)
    for value, told in ((0.1, 0.0), (0.13, 0.25), (-0.2, -0.25), (0.125, 0.0), (0.375, 0.5)):
        assert reading(value, 0.0, sensor) == told
    draw = np.random.default_rng(3)
    for value, quantum in zip(draw.normal(0, 1e4, 500), draw.uniform(1e-6, 10, 500), strict=True):
        nearest = round(value / quantum) * quantum  # Python's own, ties to even as well
        assert reading(value, 0.0, Sensor(quantum=quantum)) == nearest


def test_the_error_of_quantisation_is_uniform_over_a_quantum():
    """Its variance is quantum^2 / 12, and it lies in each tenth of the quantum alike."""
    quantum, count = 0.01 * RADIANS, 20_000
    values = np.random.default_rng(4).uniform(-0.3, 0.3, count)
    errors = np.array([reading(value, 0.0, Sensor(quantum=quantum)) for value in values]) - values
    assert np.max(np.abs(errors)) <= quantum / 2 * (1 + 1e-9)
    deviation = quantum / math.sqrt(12)
    assert abs(np.mean(errors)) < 5 * deviation / math.sqrt(count)
    assert abs(np.var(errors) / deviation**2 - 1) < 5 * math.sqrt(0.8 / count)
    tenths, _ = np.histogram(errors, 10, (-quantum / 2, quantum / 2))
    assert np.max(np.abs(tenths - count / 10)) < 5 * math.sqrt(count * 0.09)


@pytest.mark.parametrize("time_constant", [0.002, 0.01, 0.05, 1.0, 10.0])
def test_a_lag_answers_a_step_by_its_closed_form(time_constant):
    """After k samples of a held input of 1 the reading is 1 - exp(-k STEP / tau)."""
    sensors = sensors_of(h=Sensor(lag=lag(time_constant)))
    memory, told = first_measurement(
        STATE._replace(h=0.0), STATE._replace(h=0.0), SURFACES, QUIET, sensors
    )
    assert told.state.h == 0.0
    for samples in range(1, 200):
        memory, told = measure(
            memory, STATE._replace(h=1.0), STATE._replace(h=1.0), SURFACES, QUIET, sensors
        )
        exact = -math.expm1(-samples * STEP / time_constant)
        assert told.state.h == pytest.approx(exact, rel=1e-11), samples


def test_a_lag_has_settled_when_the_flight_starts():
    sensors = drawn_sensors(0)
    memory, first = first_measurement(STATE, STATE, SURFACES, QUIET, sensors)
    for _ in range(3):
        memory, told = measure(memory, STATE, STATE, SURFACES, QUIET, sensors)
        assert told == first


def test_what_follows_the_lag_is_not_lagged():
    """A bias stands in full in the first reading after any step, and so does noise."""
    sensors = sensors_of(h=Sensor(noise=2.0, bias=10.0, lag=0.5))
    start = STATE._replace(h=0.0)
    memory, _ = first_measurement(start, start, SURFACES, QUIET, sensors)
    normals = QUIET._replace(state=QUIET.state._replace(h=1.5))
    _, told = measure(
        memory, STATE._replace(h=8.0), STATE._replace(h=8.0), SURFACES, normals, sensors
    )
    assert told.state.h == 4.0 + 10.0 + 3.0


# Air data


@given(u=st.floats(300.0, 4000.0), v=st.floats(-300.0, 300.0), w=st.floats(-800.0, 800.0))
def test_perfect_air_data_rebuild_the_velocity(u, v, w):
    state = STATE._replace(u=u, v=v, w=w)
    sensors = sensors_of(alpha=PERFECT)
    _, (told, _) = first_measurement(state, state, SURFACES, QUIET, sensors)
    speed = math.hypot(u, v, w)
    assert told[:3] == pytest.approx((u, v, w), rel=1e-12, abs=1e-12 * speed)
    assert same_bits(told[3:], state[3:])


def test_an_error_of_air_data_is_one_of_the_angles_and_the_speed_of_what_is_told():
    state = STATE._replace(u=1800.0, v=30.0, w=90.0)
    off = {"alpha": 0.02, "beta": -0.01, "speed": 25.0}
    sensors = sensors_of(**{name: Sensor(bias=bias) for name, bias in off.items()})
    u, v, w = first_measurement(state, state, SURFACES, QUIET, sensors)[1].state[:3]
    speed, true_speed = math.hypot(u, v, w), math.hypot(1800.0, 30.0, 90.0)
    assert math.atan2(w, u) == pytest.approx(math.atan2(90.0, 1800.0) + 0.02, abs=1e-12)
    assert math.asin(v / speed) == pytest.approx(math.asin(30.0 / true_speed) - 0.01, abs=1e-12)
    assert speed == pytest.approx(true_speed + 25.0, rel=1e-12)


def test_beside_air_data_the_sensors_of_u_v_w_have_no_say():
    loud = Sensor(noise=50.0, bias=100.0)
    normals = Noise(State(*[1.0] * 13), Surfaces(1.0, 1.0, 1.0), AirVelocity(1.0, 1.0, 1.0))
    with_them, without = (
        first_measurement(STATE, STATE, SURFACES, normals, sensors)[1]
        for sensors in (
            sensors_of(u=loud, v=loud, w=loud, beta=PERFECT),
            sensors_of(beta=PERFECT),
        )
    )
    assert same_bits(with_them, without)
    assert noisy_channels(sensors_of(u=loud, P=loud, alpha=loud)) == (Channel.P, Channel.alpha)
    assert noisy_channels(sensors_of(u=loud, P=loud)) == (Channel.u, Channel.P)


# The three ways of one source


@kernel
def tell_alone(truths, block, sensors, told):
    """Measurements (steps, 16) of true values and draws, both (steps, channels)."""
    true = draws_of(truths[0]).noise
    memory, now = first_measurement(
        true.state, true.state, true.surfaces, draws_of(block[0]).noise, sensors
    )
    for step in range(len(truths)):
        if step > 0:
            true, noise = draws_of(truths[step]).noise, draws_of(block[step]).noise
            memory, now = measure(memory, true.state, true.state, true.surfaces, noise, sensors)
        for i, value in enumerate(now.state):
            told[step, i] = value
        for i, value in enumerate(now.surfaces):
            told[step, 13 + i] = value


@kernel
def tell_lanes(like, truths, block, sensors, told):
    """The same with a last axis of LANES runs."""
    true = load(like, truths[0]).noise
    memory, now = first_measurement(
        true.state, true.state, true.surfaces, load(like, block[0]).noise, sensors
    )
    store(told[0], now)
    for step in range(1, len(truths)):
        true, noise = load(like, truths[step]).noise, load(like, block[step]).noise
        memory, now = measure(memory, true.state, true.state, true.surfaces, noise, sensors)
        store(told[step], now)


STEPS = 50


def truths_of(run):
    """A flight (STEPS, channels) to be measured: a walk from the start, signed zeros in it."""
    walk = np.zeros((STEPS, len(Channel)))
    walk[:, :16] = np.random.default_rng((9, run)).normal(0, 1e-2, (STEPS, 16)).cumsum(axis=0)
    walk[:, :16] += [*STATE, *SURFACES]
    walk[10, 3:9] = -0.0
    return walk


def told_in_flight(run, sensors):
    block = NoiseStream(1, run, noisy_channels(sensors)).block(STEPS)
    told = np.empty((STEPS, 16))
    tell_alone(truths_of(run), block, sensors, told)
    return told


@pytest.mark.parametrize("with_air", [False, True])
def test_a_lane_is_told_the_same_bits_as_its_run_alone(with_air):
    sensors = drawn_sensors(2, with_air)
    truths = np.ascontiguousarray(np.stack([truths_of(run) for run in range(LANES)], axis=2))
    block = np.zeros((STEPS, len(Channel), LANES))
    for run in range(LANES):
        NoiseStream(1, run, noisy_channels(sensors)).fill(block[:, :, run])
    told = np.empty((STEPS, 16, LANES))
    tell_lanes(NO_DRAWS, truths, block, sensors, told)
    for run in range(LANES):
        assert told[:, :, run].tobytes() == told_in_flight(run, sensors).tobytes(), run


def told_by_numpy(values, normals, sensor):
    """Readings of one channel, written out once more."""
    kept = [values[0]]
    for value in values[1:]:
        kept.append((1 - sensor.lag) * kept[-1] + sensor.lag * value)
    told = np.array(kept) * (1 + sensor.scale) + sensor.bias + sensor.noise * normals
    return np.round(told / sensor.quantum) * sensor.quantum if sensor.quantum else told


@pytest.mark.parametrize("seed", range(3))
def test_every_channel_has_its_own_truth_normals_and_sensor(seed):
    sensors = drawn_sensors(seed)
    truths = truths_of(seed).T
    normals = NoiseStream(1, seed, noisy_channels(sensors)).block(STEPS).T
    told = told_in_flight(seed, sensors).T
    for column, sensor in [*enumerate((*sensors.state, *sensors.surfaces))][3:]:
        expected = told_by_numpy(truths[column], normals[column], sensor)
        assert told[column] == pytest.approx(expected, abs=1e-9), Channel(100 + column).name
    true, measured = (
        (np.arctan2(w, u), np.arctan2(v, np.hypot(u, w)), np.sqrt(u * u + v * v + w * w))
        for u, v, w in (truths[:3], told[:3])
    )
    for column, (name, sensor) in enumerate(sensors.air._asdict().items()):
        expected = told_by_numpy(true[column], normals[16 + column], sensor)
        assert measured[column] == pytest.approx(expected, abs=1e-9), name


def test_a_flight_is_told_as_it_is_by_perfect_sensors():
    assert told_in_flight(3, sensors_of()).tobytes() == truths_of(3)[:, :16].tobytes()


PLAIN = """
from test.test_sensors import drawn_sensors, told_in_flight

for with_air in (False, True):
    print(told_in_flight(3, drawn_sensors(2, with_air)).tobytes().hex())
"""


def test_plain_python_is_told_the_same_bits_as_compiled_code():
    result = subprocess.run(
        [sys.executable, "-c", PLAIN],
        env=os.environ | {"NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
        check=True,
    )
    for line, with_air in zip(result.stdout.split(), (False, True), strict=True):
        assert line == told_in_flight(3, drawn_sensors(2, with_air)).tobytes().hex()


# Noise


@pytest.mark.parametrize("channel", [Channel.u, Channel.Q, Channel.rudder, Channel.gust_w])
def test_the_noise_is_normal_by_its_moments(channel):
    """Mean, variance, skewness and kurtosis within five standard errors of 0, 1, 0 and 3."""
    (x,) = draws([channel])
    n = len(x)
    assert abs(np.mean(x)) < 5 / math.sqrt(n)
    assert abs(np.mean(x**2) - 1) < 5 * math.sqrt(2 / n)
    assert abs(np.mean(x**3)) < 5 * math.sqrt(15 / n)
    assert abs(np.mean(x**4) - 3) < 5 * math.sqrt(96 / n)


def test_the_noise_that_is_told_has_the_sigma_of_its_sensor():
    sensors = sensors_of(P=Sensor(noise=0.02 * RADIANS))
    block = NoiseStream(5, 0, noisy_channels(sensors)).block(20_000)
    truths = np.zeros((len(block), len(Channel)))
    told = np.empty((len(block), 16))
    tell_alone(truths, block, sensors, told)
    sigma = np.sqrt(np.mean(told[:, 3] ** 2)) / RADIANS
    assert sigma == pytest.approx(0.02, rel=5 / math.sqrt(2 * len(block)))
    assert not np.delete(told, 3, axis=1).any()


def test_the_noise_is_white():
    """No lag up to a second is correlated, and each tenth of the spectrum has a tenth of power."""
    (x,) = draws([Channel.P])
    n = len(x)
    for shift in range(1, 101):
        assert abs(np.mean(x[shift:] * x[:-shift])) < 5 / math.sqrt(n), shift
    power = np.abs(np.fft.rfft(x)[1:-1]) ** 2 / n  # exponential with mean 1, if white
    for band in np.array_split(power, 10):
        assert abs(np.mean(band) - 1) < 5 / math.sqrt(len(band))


def test_channels_and_runs_and_seeds_are_independent_of_each_other():
    rows = draws([*Channel][:-1], steps=20_000)
    rows = np.vstack((rows, draws([Channel.P], run=1, steps=20_000)))
    rows = np.vstack((rows, draws([Channel.P], seed=2, steps=20_000)))
    correlation = rows @ rows.T / rows.shape[1]
    np.fill_diagonal(correlation, 0.0)
    assert np.max(np.abs(correlation)) < 5 / math.sqrt(rows.shape[1])


@given(
    on=st.sets(st.sampled_from([*Channel][:-1])),
    late=st.sampled_from([0.0, 0.3, 1.0]),
    sizes=st.lists(st.integers(0, 40), max_size=6),
    seed=st.integers(0, 2**63 - 1),
    run=st.integers(0, 2**32),
)
@settings(max_examples=60, deadline=None)
def test_blocks_of_any_sizes_are_one_long_block_and_channels_that_are_off_are_zero(
    on, late, sizes, seed, run
):
    stream = NoiseStream(seed, run, on, late)
    whole = NoiseStream(seed, run, [*Channel][:-1], late).block(sum(sizes))
    parts = [np.zeros((0, len(Channel))), *(stream.block(size) for size in sizes)]
    joined = np.concatenate(parts)
    for column, channel in enumerate(Channel):
        if channel in on or channel == Channel.late:
            assert np.array_equal(joined[:, column], whole[:, column])
        else:
            assert not joined[:, column].any()


def test_a_stream_is_that_of_numpy_by_seed_run_and_purpose():
    expected = np.random.default_rng((7, 3, 104)).standard_normal(10)
    assert np.array_equal(draws([Channel.Q], 3, 7, 10)[0], expected)


def test_no_purpose_is_that_of_what_is_drawn_once_a_flight():
    """Of dispersion and start, whose keys are (seed, run) and (seed, run, 1)."""
    assert sorted(Channel) == list(Channel)
    assert all(channel > 99 for channel in Channel)
    assert len(Channel) == len(flat(NO_DRAWS))


def test_a_row_is_read_by_the_names_of_its_channels():
    row = draws_of(np.arange(float(len(Channel))))
    named = row.noise.state._asdict() | row.noise.surfaces._asdict() | row.noise.air._asdict()
    named |= {f"gust_{axis}": value for axis, value in row.gust._asdict().items()}
    named |= {"late": row.late}
    assert named == {channel.name: column for column, channel in enumerate(Channel)}
    assert [channel.name for channel in GUSTS] == ["gust_u", "gust_v", "gust_w"]


def test_commands_are_late_as_often_as_they_are_said_to_be():
    for chance in (0.0, 0.05, 0.5, 1.0):
        late = NoiseStream(1, 0, (), chance).block(SAMPLES)[:, -1]
        assert set(late) <= {0.0, 1.0}
        assert abs(np.mean(late) - chance) <= 5 * math.sqrt(chance * (1 - chance) / SAMPLES)


# Parameters


def settings_of(**values):
    """Sensors by values at the human edge; `__` stands for the dot."""
    named = {name.replace("__", "."): value for name, value in values.items()}
    return sensor_settings(check_parameters("plant", SENSOR_PARAMETERS, named))


def test_sensors_are_perfect_unless_something_is_asked_of_them():
    assert settings_of() is None
    assert settings_of(air_data_sensors=True) is None
    # what is not listened to cannot be imperfect
    assert settings_of(sensor__alpha__noise=1.0) is None
    assert settings_of(air_data_sensors=True, sensor__u__noise=1.0) is None


def test_angles_and_rates_are_in_degrees_at_the_human_edge():
    sensors = settings_of(
        sensor__P__noise=0.02,
        sensor__theta__bias=-0.5,
        sensor__rudder__quantum=0.1,
        sensor__h__noise=5.0,
        sensor__mass__scale=0.01,
        sensor__Q__time_constant=0.05,
    )
    assert sensors.air is None
    assert Sensor(noise=0.02 * RADIANS) == sensors.state.P
    assert sensors.state.theta == Sensor(bias=-0.5 * RADIANS)
    assert sensors.surfaces.rudder == Sensor(quantum=0.1 * RADIANS)
    assert sensors.state.h == Sensor(noise=5.0)
    assert sensors.state.mass == Sensor(scale=0.01)
    assert sensors.state.Q.lag == pytest.approx(1 - math.exp(-0.2), rel=1e-12)
    assert sensors.state.R == PERFECT


def test_air_data_are_used_where_they_are_asked_for():
    sensors = settings_of(air_data_sensors=True, sensor__alpha__noise=0.1, sensor__speed__bias=3.0)
    assert sensors.air == AirVelocity(Sensor(noise=0.1 * RADIANS), PERFECT, Sensor(bias=3.0))
    assert settings_of(sensor__alpha__noise=0.1, sensor__P__bias=1.0).air is None
    # perfect ones are the true u, v, w: nothing is rounded on the way there and back
    assert settings_of(air_data_sensors=True, sensor__P__bias=1.0).air is None


def test_every_channel_has_the_five_errors_and_its_parameters_are_unlike_any_other():
    names = [parameter.name for parameter in SENSOR_PARAMETERS + NOISE_PARAMETERS]
    assert len(set(names)) == len(names) == 19 * 5 + 1 + 2
    for channel in [*Channel][:19]:
        for error in ("noise", "bias", "scale", "quantum", "time_constant"):
            assert f"sensor.{channel.name}.{error}" in names


def test_a_sensor_that_cannot_be_is_refused_by_name():
    with pytest.raises(ParameterError, match=r"sensor\.P\.noise is -1\.0, but must be a number"):
        settings_of(sensor__P__noise=-1.0)
    with pytest.raises(ParameterError, match=r"noise\.seed is 1\.5, but must be an integer"):
        check_parameters("plant", NOISE_PARAMETERS, {"noise.seed": 1.5})

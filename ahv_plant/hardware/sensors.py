# Copyright 2026 ahv developers, Apache-2.0
"""Sensors: what the flight software is told of the state and of the surfaces.

Each channel passes a first-order lag, then scale factor, bias and white noise, then quantisation:
the terms are those of IEEE Std 528-2019. An error that is off changes no bit, so a perfect sensor
tells the true value itself. The unit normals of the noise come from outside, so that every engine
has the same.
"""

from typing import Any, NamedTuple

from ahv_plant.model.aerodynamics import air_data
from ahv_plant.model.vectors import Measurement, State, Surfaces
from ahv_plant.numerics.elementary import ROUNDER, sin_cos
from ahv_plant.numerics.elementwise import elementwise, select
from ahv_plant.numerics.optional import optional


class Sensor(NamedTuple):
    """One channel; in SI units of what it measures. The default is perfect."""

    noise: float = 0.0  # [1 sigma per sample, SI] white
    bias: float = 0.0  # [SI]
    scale: float = 0.0  # [-] error of the scale factor
    quantum: float = 0.0  # [SI] step of the reading; 0 is none
    lag: float = 1.0  # [-] 1 - exp(-STEP / time constant): the way it goes in one sample


PERFECT = Sensor()


class AirVelocity(NamedTuple):
    """The velocity as air data sensors have it."""

    alpha: float  # [rad] angle of attack
    beta: float  # [rad] sideslip angle
    speed: float  # [m/s]


class Sensors(NamedTuple):
    """A Sensor for each channel, in the vectors of what they measure.

    With `air`, the measured u, v, w are those of the measured angles and speed, which are against
    the air, and the sensors of u, v, w, which are over the ground, have no say.
    """

    state: Any  # State of Sensor
    surfaces: Any  # Surfaces of Sensor
    air: Any = None  # AirVelocity of Sensor, or None


class Noise(NamedTuple):
    """Unit normals [-] of one sample, one for each channel."""

    state: State
    surfaces: Surfaces
    air: AirVelocity


class SensorMemory(NamedTuple):
    """Where the lags are: what each channel would read if it had no other error."""

    state: State
    surfaces: Surfaces
    air: AirVelocity | None


@elementwise
def lagged(kept: float, value: float, sensor: Sensor) -> float:
    """Lag one sample later, in any unit; exact for an input that is held from sample to sample."""
    return select(sensor.lag == 1.0, value, kept + sensor.lag * (value - kept))


@elementwise
def reading(value: float, normal: float, sensor: Sensor) -> float:
    """Reading of a lagged `value`, in any unit, with a unit `normal` of noise [-]."""
    scaled = (1.0 + sensor.scale) * value
    offset = sensor.bias + sensor.noise * normal
    told = select(offset == 0.0, scaled, scaled + offset)  # for -0.0 + 0.0 would be 0.0
    # Between 2^52 and 2^53 doubles are the integers: adding 1.5 * 2^52 rounds to one, for either
    # sign and ties to even, by an addition that IEEE 754 defines; lanes have no other rounding.
    coarse = sensor.quantum > 0.0
    quantum = select(coarse, sensor.quantum, 1.0)
    return select(coarse, ((told / quantum + ROUNDER) - ROUNDER) * quantum, told)


@elementwise
def air_velocity(moving: State) -> AirVelocity:
    """True angles [rad] and speed [m/s] of a state with the velocity against the air."""
    air = air_data(moving, False)  # of which altitude has no part in these three
    return AirVelocity(air.alpha, air.beta, air.speed)


@optional
def _settled_air(moving: State, air: Any) -> AirVelocity:
    return air_velocity(moving)


@optional
def _lagged_air(kept: AirVelocity, moving: State, air: Any) -> AirVelocity:
    true = air_velocity(moving)
    return AirVelocity(
        lagged(kept.alpha, true.alpha, air.alpha),
        lagged(kept.beta, true.beta, air.beta),
        lagged(kept.speed, true.speed, air.speed),
    )


@elementwise
def by_air_data(told: State, kept: AirVelocity | None, noise: AirVelocity, air: Any) -> State:
    """The state as told, with u, v, w [m/s] of the air data sensors, if there are any."""
    if kept is None:
        return told
    sin_alpha, cos_alpha = sin_cos(reading(kept.alpha, noise.alpha, air.alpha))
    sin_beta, cos_beta = sin_cos(reading(kept.beta, noise.beta, air.beta))
    speed = reading(kept.speed, noise.speed, air.speed)
    in_plane = speed * cos_beta
    return State(
        in_plane * cos_alpha,
        speed * sin_beta,
        in_plane * sin_alpha,
        told.P,
        told.Q,
        told.R,
        told.phi,
        told.theta,
        told.psi,
        told.x,
        told.y,
        told.h,
        told.mass,
    )


@elementwise
def read_state(kept: State, noise: State, by: Any) -> State:
    """Readings of the 13 states; `by` is a State of Sensor."""
    return State(
        reading(kept.u, noise.u, by.u),
        reading(kept.v, noise.v, by.v),
        reading(kept.w, noise.w, by.w),
        reading(kept.P, noise.P, by.P),
        reading(kept.Q, noise.Q, by.Q),
        reading(kept.R, noise.R, by.R),
        reading(kept.phi, noise.phi, by.phi),
        reading(kept.theta, noise.theta, by.theta),
        reading(kept.psi, noise.psi, by.psi),
        reading(kept.x, noise.x, by.x),
        reading(kept.y, noise.y, by.y),
        reading(kept.h, noise.h, by.h),
        reading(kept.mass, noise.mass, by.mass),
    )


@elementwise
def lagged_state(kept: State, state: State, by: Any) -> State:
    """Lags of the 13 states one sample later; `by` is a State of Sensor."""
    return State(
        lagged(kept.u, state.u, by.u),
        lagged(kept.v, state.v, by.v),
        lagged(kept.w, state.w, by.w),
        lagged(kept.P, state.P, by.P),
        lagged(kept.Q, state.Q, by.Q),
        lagged(kept.R, state.R, by.R),
        lagged(kept.phi, state.phi, by.phi),
        lagged(kept.theta, state.theta, by.theta),
        lagged(kept.psi, state.psi, by.psi),
        lagged(kept.x, state.x, by.x),
        lagged(kept.y, state.y, by.y),
        lagged(kept.h, state.h, by.h),
        lagged(kept.mass, state.mass, by.mass),
    )


@elementwise
def read(memory: SensorMemory, noise: Noise, sensors: Sensors) -> Measurement:
    """Measurement from where the lags are."""
    kept, normal, by = memory.surfaces, noise.surfaces, sensors.surfaces
    return Measurement(
        by_air_data(
            read_state(memory.state, noise.state, sensors.state),
            memory.air,
            noise.air,
            sensors.air,
        ),
        Surfaces(
            reading(kept.right_elevon, normal.right_elevon, by.right_elevon),
            reading(kept.left_elevon, normal.left_elevon, by.left_elevon),
            reading(kept.rudder, normal.rudder, by.rudder),
        ),
    )


@elementwise
def first_measurement(
    state: State, moving: State, surfaces: Surfaces, noise: Noise, sensors: Sensors
) -> tuple[SensorMemory, Measurement]:
    """Memory and measurement at the first state of a flight, where every lag has settled.

    `moving` has the velocity against the air, which is what air data sensors feel.
    """
    memory = SensorMemory(state, surfaces, _settled_air(moving, sensors.air))
    return memory, read(memory, noise, sensors)


@elementwise
def measure(
    memory: SensorMemory,
    state: State,
    moving: State,
    surfaces: Surfaces,
    noise: Noise,
    sensors: Sensors,
) -> tuple[SensorMemory, Measurement]:
    """Memory and measurement one sample later, with all as it is, as in `first_measurement`."""
    kept, by = memory.surfaces, sensors.surfaces
    memory = SensorMemory(
        lagged_state(memory.state, state, sensors.state),
        Surfaces(
            lagged(kept.right_elevon, surfaces.right_elevon, by.right_elevon),
            lagged(kept.left_elevon, surfaces.left_elevon, by.left_elevon),
            lagged(kept.rudder, surfaces.rudder, by.rudder),
        ),
        _lagged_air(memory.air, moving, sensors.air),
    )
    return memory, read(memory, noise, sensors)

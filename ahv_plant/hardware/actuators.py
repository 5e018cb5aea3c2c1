# Copyright 2026 ahv developers, Apache-2.0
"""Actuators: what lies between a commanded position and the one that acts.

A servo of first or second order with limits on rate and position, a dead zone in front of it and
backlash behind it; and what can become of it in flight. The rates of its states go into the
vehicle's Runge-Kutta step. Units are those of what is moved: rad for a surface, the throttle's own
for the engine.
"""

from enum import IntEnum
from typing import NamedTuple

from ahv_plant.model.servo import servo_motion
from ahv_plant.model.vectors import clamp
from ahv_plant.numerics.elementwise import elementwise, select


class Failure(IntEnum):
    """What has become of an actuator; a number, so that all runs of a batch share the code."""

    NONE = 0
    STUCK = 1  # where it is
    FLOATING = 2  # what it moved bears no load: a surface turns with the wind
    HARD_UP = 3  # it runs to its lower stop: trailing edge up, throttle closed
    HARD_DOWN = 4  # it runs to its upper stop: trailing edge down, throttle open
    HALF_EFFECTIVE = 5  # half of what it moved is gone


class Actuator(NamedTuple):
    """One actuator."""

    order: int  # 0 moves at once; 1 or 2 is the order of the servo
    frequency: float  # [rad/s] natural frequency; of first order the bandwidth
    damping: float  # [-] of second order
    rate_limit: float  # units of position a second; infinity is off
    lower: float  # stop, in the units of position
    upper: float  # stop, in the units of position
    dead_zone: float  # units of position, to either side: what the servo does not notice
    backlash: float  # units of position, end to end: play between servo and what it moves
    failure: int = Failure.NONE
    failure_time: float = 0.0  # [s] from when on


class Servo(NamedTuple):
    """State of an actuator; also its rates, by second."""

    position: float  # of the servo, in the units of what it moves
    rate: float  # of second order, units of position a second
    output: float  # of what it moves, in units of position: its own but for the play


@elementwise
def resting(position: float, actuator: Actuator) -> Servo:
    """Servo at rest, with what it moves at `position`, in any unit."""
    held = clamp(position, actuator.lower, actuator.upper)
    return Servo(held, 0.0 * held, held)


@elementwise
def ordered(servo: Servo, command: float, time: float, actuator: Actuator) -> float:
    """Position that the servo is told at `time` [s], as far as it has not failed."""
    failure = select(time >= actuator.failure_time, actuator.failure, 0)
    told = clamp(command, actuator.lower, actuator.upper)
    told = select(failure == 1, servo.output, told)
    told = select(failure == 3, told - told + actuator.lower, told)
    return select(failure == 4, told - told + actuator.upper, told)


@elementwise
def servo_rate(servo: Servo, told: float, time: float, actuator: Actuator) -> Servo:
    """Rates of the servo's states on its way to what it was `told`, at `time` [s].

    Its error is behind the dead zone.
    """
    error = told - servo.position
    noticed = error - clamp(error, -actuator.dead_zone, actuator.dead_zone)
    motion = servo_motion(servo.rate, noticed, actuator)
    none = 0.0 * motion.velocity
    stuck = (time >= actuator.failure_time) & (actuator.failure == 1)
    return Servo(
        select(stuck, none, motion.velocity), select(stuck, none, motion.acceleration), none
    )


@elementwise
def moved(servo: Servo, told: float, actuator: Actuator) -> float:
    """Position of what the servo moves, in any unit: within the play it stays where it was."""
    play = 0.5 * actuator.backlash
    dragged = clamp(servo.output, servo.position - play, servo.position + play)
    return select(actuator.order == 0, told, dragged)


@elementwise
def in_the_wind(position: float, wind: float, time: float, actuator: Actuator) -> float:
    """Where a surface is [rad]: where it was moved to, or, afloat, where the `wind` turns it."""
    afloat = (time >= actuator.failure_time) & (actuator.failure == 2)
    return select(afloat, clamp(wind, actuator.lower, actuator.upper), position)


@elementwise
def effect(position: float, time: float, actuator: Actuator) -> float:
    """Position, in any unit, of a whole one that would have the effect of this at `time` [s]."""
    half = (time >= actuator.failure_time) & (actuator.failure == 5)
    return select(half, 0.5 * position, position)


@elementwise
def along_servo(servo: Servo, rate: Servo, time: float) -> Servo:
    """The servo moved along its rates for `time` [s]; the output is that of the step's start."""
    return Servo(
        servo.position + time * rate.position, servo.rate + time * rate.rate, servo.output
    )


@elementwise
def settled(servo: Servo, told: float, actuator: Actuator) -> Servo:
    """Servo at the end of a step, in any unit: it stands at a stop, and drags what it moves."""
    reached = clamp(servo.position, actuator.lower, actuator.upper)
    reached = select(actuator.order == 0, told, reached)
    rate = select(reached == servo.position, servo.rate, 0.0 * reached)
    return Servo(reached, rate, moved(Servo(reached, rate, servo.output), told, actuator))

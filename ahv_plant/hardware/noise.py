# Copyright 2026 ahv developers, Apache-2.0
"""What chance gives a flight step by step: a stream of numbers of its own for each channel.

A stream is numpy's `default_rng((seed, run, purpose))` (O'Neill's PCG64, 2014), so any run of any
campaign has its numbers again alone, on any engine and in blocks of any size, and switching one
channel on or off changes no other. Nothing is drawn for a channel that is off.
"""

from collections.abc import Iterable
from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ahv_plant.hardware.sensors import PERFECT, AirVelocity, Noise, Sensors
from ahv_plant.model.vectors import State, Surfaces
from ahv_plant.numerics.elementwise import elementwise

Array = NDArray[np.float64]


class Channel(IntEnum):
    """What is drawn at every step, in the order of a row; the number is the stream's purpose.

    No number may ever change, or old flights would not fly again; nor may one be 0 to 99, which
    belong to what is drawn once a flight. (0 would be no purpose: numpy pads a key with zeros.)
    """

    u = 100
    v = 101
    w = 102
    P = 103
    Q = 104
    R = 105
    phi = 106
    theta = 107
    psi = 108
    x = 109
    y = 110
    h = 111
    mass = 112
    right_elevon = 113
    left_elevon = 114
    rudder = 115
    alpha = 116
    beta = 117
    speed = 118
    gust_u = 119
    gust_v = 120
    gust_w = 121
    late = 122


class Driving(NamedTuple):
    """Unit normals [-] that drive the turbulence along the body axes."""

    u: float
    v: float
    w: float


class Draws(NamedTuple):
    """What chance gives one step, in the order of `Channel`."""

    noise: Noise
    gust: Driving
    late: float  # [-] 1 where the commands take a step longer, else 0


GUSTS = (Channel.gust_u, Channel.gust_v, Channel.gust_w)
_COLUMNS = {channel: column for column, channel in enumerate(Channel)}


def noisy_channels(sensors: Sensors | None) -> tuple[Channel, ...]:
    """Channels of which `sensors` have noise."""
    if sensors is None:
        return ()
    heard = sensors.state._asdict() | sensors.surfaces._asdict()
    if sensors.air is not None:
        heard |= dict.fromkeys("uvw", PERFECT) | sensors.air._asdict()
    return tuple(Channel[name] for name, sensor in heard.items() if sensor.noise > 0.0)


class NoiseStream:
    """The draws of one run: of `channels`, and of late commands if their chance [-] is above 0."""

    def __init__(self, seed: int, run: int, channels: Iterable[Channel], late: float = 0.0):
        def stream(channel: Channel) -> np.random.Generator:
            return np.random.default_rng((seed, run, int(channel)))

        self._normals = [(_COLUMNS[channel], stream(channel)) for channel in channels]
        self._late = stream(Channel.late) if late > 0.0 else None
        self._chance = late

    def fill(self, block: Array) -> None:
        """Write the next draws [-] to a block of zeros (steps, channels), of any strides."""
        drawn = np.empty(len(block))
        for column, stream in self._normals:
            stream.standard_normal(out=drawn)
            block[:, column] = drawn
        if self._late is not None:
            self._late.random(out=drawn)
            block[:, _COLUMNS[Channel.late]] = drawn < self._chance

    def block(self, steps: int) -> Array:
        """Return the next draws [-] (steps, channels); zeros where a channel is off."""
        block = np.zeros((steps, len(Channel)))
        self.fill(block)
        return block


# A step without chance; also what a step of a block looks like to `load`, which fills lanes.
NO_DRAWS = Draws(
    Noise(State(*[0.0] * 13), Surfaces(0.0, 0.0, 0.0), AirVelocity(0.0, 0.0, 0.0)),  # [-]
    Driving(0.0, 0.0, 0.0),
    0.0,
)


@elementwise
def draws_of(row: Array) -> Draws:
    """Draws of one step of one run, from its row (channels) of a block."""
    return Draws(
        Noise(
            State(
                row[0],
                row[1],
                row[2],
                row[3],
                row[4],
                row[5],
                row[6],
                row[7],
                row[8],
                row[9],
                row[10],
                row[11],
                row[12],
            ),
            Surfaces(row[13], row[14], row[15]),
            AirVelocity(row[16], row[17], row[18]),
        ),
        Driving(row[19], row[20], row[21]),
        row[22],
    )

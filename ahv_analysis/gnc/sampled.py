# Copyright 2026 ahv developers, Apache-2.0
"""One step of plant and of law at a trim, as linear models: 0.01 s between two measurements.

The functions are those that fly, hardware, delay and memory of the law in them. What has no slope
is left out: noise, jitter, quanta, dead zone and play.
"""

from typing import Any, NamedTuple

import numpy as np

from ahv_analysis.bag.rows import Array
from ahv_analysis.gnc.linear_model import (
    DEPARTURES,
    HELD,
    INPUTS,
    STATES,
    UNITS,
    LinearModel,
)
from ahv_analysis.gnc.numbers_of import jacobian, names_in, numbers_in, with_numbers
from ahv_msgs_py.parameters import ParameterError
from ahv_plant.dispersion import Truth, in_calm
from ahv_plant.hardware.delay import ROWS
from ahv_plant.hardware.noise import NO_DRAWS
from ahv_plant.hardware.sensors import Sensor
from ahv_plant.model.constants import STEP
from ahv_plant.model.vectors import Controls, Measurement, Surfaces
from ahv_plant.plant import Hardware, Plant, plant_step, rig, start_plant
from ahv_plant.trim import Trim

MEASURED = (*STATES, *Surfaces._fields)  # what a law hears and a departure can be in
FIRST = ROWS  # number of the step that is looked at; the line of commands is full then


class PlantAt(NamedTuple):
    """The plant at a trim, and how its numbers stand in a vector."""

    plant: Plant
    line: Array  # (ages, 4) commands under way, the newest first
    truth: Truth
    hardware: Hardware | None

    def names(self) -> list[str]:
        """Names of all its numbers."""
        ages = [f"sent.{name}[{age + 1}]" for age in range(len(self.line)) for name in INPUTS]
        return names_in(self.plant) + ages

    def numbers(self) -> Array:
        """Vector of all its numbers, each in its own unit."""
        return np.array([*numbers_in(self.plant), *self.line.ravel()])

    def with_numbers(self, numbers: Array) -> "PlantAt":
        """The plant with other numbers."""
        count = len(numbers_in(self.plant))
        plant = with_numbers(self.plant, iter(numbers[:count]))
        return self._replace(plant=plant, line=numbers[count:].reshape(self.line.shape))

    def later(self, command: Controls) -> "PlantAt":
        """The plant a step later."""
        equipped = rig(self.hardware)
        if equipped is None:
            plant = plant_step(self.plant, command, FIRST, self.truth, None, None)
            return self._replace(plant=plant)
        for age, sent in enumerate(self.line, 1):
            equipped.line[(FIRST - age) % ROWS] = sent
        plant = plant_step(self.plant, command, FIRST, self.truth, NO_DRAWS, equipped)
        newest = equipped.line[[(FIRST - age) % ROWS for age in range(len(self.line))]]
        return self._replace(plant=plant, line=newest)


def smooth(hardware: Hardware | None, at: Trim) -> Hardware | None:
    """The hardware at rest at a trim, without what has no slope; ParameterError if it fails."""
    if hardware is None:
        return None
    if any(actuator.failure for actuator in hardware.actuators):
        raise ParameterError("an actuator fails in flight: a linear model has no such time")
    actuators = type(hardware.actuators)(
        *(part._replace(dead_zone=0.0, backlash=0.0) for part in hardware.actuators)
    )
    sensors = None if hardware.sensors is None else _without_quanta(hardware.sensors)
    return hardware._replace(
        actuators=actuators,
        jitter=0.0,
        sensors=sensors,
        start=Controls(at.surfaces, at.throttle),
    )


def _without_quanta(by: Any) -> Any:
    if isinstance(by, Sensor):
        return by._replace(quantum=0.0)
    return None if by is None else type(by)(*map(_without_quanta, by))


def plant_at(at: Trim, truth: Truth, hardware: Hardware | None) -> PlantAt:
    """The plant of `truth` in calm air at a trim, with its commands there too.

    Raises ParameterError where an actuator fails in flight.
    """
    calm, resting = in_calm(truth), smooth(hardware, at)
    controls = Controls(at.surfaces, at.throttle)
    if resting is None:
        plant = start_plant(at.state, calm, None, None)
        plant = plant._replace(controls=controls, measured=Measurement(at.state, at.surfaces))
        return PlantAt(plant, np.empty((0, len(INPUTS))), calm, None)
    plant = start_plant(at.state, calm, NO_DRAWS, rig(resting))
    line = np.array([[*at.surfaces, at.throttle]] * resting.delay).reshape(-1, len(INPUTS))
    return PlantAt(plant, line, calm, resting)


def moving(names: list[str]) -> list[int]:
    """Places of numbers of a plant that a departure can be in: not mass, x and y."""
    return [place for place, name in enumerate(names) if name.split(".")[-1] not in HELD]


def departures(names: list[str]) -> Array:
    """How far to depart from each number, by what its name measures."""
    return np.array([_departure(name) for name in names])


def _departure(name: str) -> float:
    parts = name.split("[")[0].split(".")
    kept = UNITS.get(parts[-1]) or next((UNITS[p] for p in parts if p in UNITS), "rad")
    return DEPARTURES[kept]


def plant_model(start: PlantAt, at: Trim) -> LinearModel:
    """One step of the plant, from commands to states; its outputs are what is measured now."""
    names = start.names()
    place = moving(names)
    held = start.numbers()
    count = len(place)
    told = np.array([*at.surfaces, at.throttle])

    def step(numbers: Array) -> Array:
        values = held.copy()
        values[place] = numbers[:count]
        right, left, rudder, throttle = map(float, numbers[count:])
        later = start.with_numbers(values).later(Controls(Surfaces(right, left, rudder), throttle))
        return later.numbers()[place]

    states = [names[i] for i in place]
    slopes = jacobian(step, np.array([*held[place], *told]), departures([*states, *INPUTS]))
    measured = [
        states.index(f"measured.{'surfaces' if name in Surfaces._fields else 'state'}.{name}")
        for name in MEASURED
    ]
    return LinearModel(
        slopes[:, :count],
        slopes[:, count:],
        np.eye(count)[measured],
        np.zeros((len(MEASURED), len(INPUTS))),
        tuple(name.removeprefix("state.") for name in states),
        INPUTS,
        MEASURED,
        STEP,
        at,
    )

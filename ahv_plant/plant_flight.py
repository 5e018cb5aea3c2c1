# Copyright 2026 ahv developers, Apache-2.0
"""The plant of one flight: its hardware, with what is under way in it, and its draws."""

from ahv_plant.model.vectors import Controls, Surfaces
from ahv_plant.parameters import PlantSettings
from ahv_plant.plant import Plant, all_draws, plant_step, rig, start_plant


class PlantFlight:
    """Steps of one flight, each once and in their order: every one takes draws of its own."""

    def __init__(self, settings: PlantSettings):
        """Begin at the first state."""
        self._truth, self._rig = settings.truth, rig(settings.hardware)
        self._draws = all_draws(settings.hardware, self._truth.wind, *settings.noise)
        draws = next(self._draws)
        self.start: Plant = start_plant(settings.initial, self._truth, draws, self._rig)

    def later(self, plant: Plant, command: Controls, number: int) -> Plant:
        """The plant 0.01 s later; `number` counts the steps flown before."""
        flown: Plant = plant_step(
            plant, command, number, self._truth, next(self._draws), self._rig
        )
        return flown


def warm_up_plant(settings: PlantSettings) -> None:
    """Fly a step, so that none of a flight waits for the compiler."""
    flight = PlantFlight(settings)
    flight.later(flight.start, Controls(Surfaces(0.0, 0.0, 0.0), 0.0), 0)

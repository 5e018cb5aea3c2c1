# Copyright 2026 ahv developers, Apache-2.0
"""What the server that node processes are forked off loads once: the nodes and their laws."""

import os

from ahv_analysis.flight.case import load_case
from ahv_analysis.versions import source_hash
from ahv_control.disturbance_learner import disturbance_estimate
from ahv_control.flight_control import NEUTRAL, first_learner, next_learner
from ahv_control.inner_loop import Learned, adaptive_surfaces, nominal_surfaces
from ahv_control.intermediate_loop import rate_command
from ahv_control.outer_loop import attitude_command
from ahv_control.velocity_loop import throttle_command
from ahv_plant.model.vectors import Rates
from ahv_plant.start import DEFAULT_START
from ahv_plant.termination import termination_reason
from ahv_plant.vehicle import vehicle_step

SOURCE = source_hash()  # of the code that every process forked off here runs


def compile_laws() -> None:
    """Call every law once as the nodes call it."""
    case = load_case("neuro_adaptive_di")
    control, truth, start = case.control, case.plant.truth, DEFAULT_START
    still = Rates(0.0, 0.0, 0.0)
    rate_command(start, attitude_command(start, control.outer), control.intermediate)
    nominal_surfaces(start, still, NEUTRAL, control.inner)
    adaptive_surfaces(start, still, Learned(still, still, still), NEUTRAL, control.inner)
    throttle_command(start, NEUTRAL, control.velocity)
    law = control.learner
    learner = next_learner(first_learner(start, law), start, NEUTRAL, still, start, law)
    disturbance_estimate(learner, still)
    vehicle_step(start, NEUTRAL, 0.2, 0.0, truth)
    termination_reason(start, truth.geometric, 0.0)


compile_laws()
os.setpgrp()  # a terminal's signals are for the one who watches the flight, and ends it in order

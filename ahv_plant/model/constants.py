# Copyright 2026 ahv developers, Apache-2.0
"""Table 2.1 of the report, actuator limits of section 3.5.2, and what the simulation fixes."""

from math import pi

WING_AREA = 334.7295  # [m^2] S
WING_SPAN = 18.2880  # [m] b
MEAN_CHORD = 24.384  # [m] c
GRAVITY = 9.8  # [m/s^2] g
MAXIMUM_THRUST = 1467900.0  # [N] T_max
SPECIFIC_IMPULSE = 1000.0  # [s] I_sp; eq 2.6 multiplies it by g (see docs/errata.md)
INITIAL_MASS = 136077.6  # [kg] section 3.5.2

SURFACE_MINIMUM = -40.0 * pi / 180.0  # [rad]
SURFACE_MAXIMUM = 30.0 * pi / 180.0  # [rad]
THROTTLE_MINIMUM = 0.1  # [-]
THROTTLE_MAXIMUM = 0.9  # [-]

UNSTART_ALPHA = 5.0 * pi / 180.0  # [rad] |alpha| above which the inlet unstarts

DEGREES = 180.0 / pi  # [deg/rad]
RADIANS = pi / 180.0  # [rad/deg]

STEP = 0.01  # [s] integration and control period
STEP_NS = 10_000_000  # [ns] the same, exactly

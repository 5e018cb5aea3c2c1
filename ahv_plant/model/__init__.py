# Copyright 2026 ahv developers, Apache-2.0
"""What is known of the vehicle: constants, atmosphere, aerodynamics, mass, rigid body."""

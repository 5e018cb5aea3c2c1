# Copyright 2026 ahv developers, Apache-2.0
"""What stands between the flight software and the vehicle: what it measures with and moves by."""

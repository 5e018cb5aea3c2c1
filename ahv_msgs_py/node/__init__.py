# Copyright 2026 ahv developers, Apache-2.0
"""The shell of a node: lifecycle, process, real time, guards and health."""

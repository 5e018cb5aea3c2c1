# Copyright 2026 ahv developers, Apache-2.0
"""Faults injected into flights."""

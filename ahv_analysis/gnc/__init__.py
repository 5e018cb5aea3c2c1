# Copyright 2026 ahv developers, Apache-2.0
"""Guidance, navigation and control, linearised: models and modes at a trim."""

# Copyright 2026 ahv developers, Apache-2.0
"""Recorded flights fed to the controllers again."""

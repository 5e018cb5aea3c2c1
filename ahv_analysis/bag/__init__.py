# Copyright 2026 ahv developers, Apache-2.0
"""Flights on disk: MCAP bags written, read, recovered, exported."""

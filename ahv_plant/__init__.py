# Copyright 2026 ahv developers, Apache-2.0
"""The vehicle: pure physics, and the node that flies it."""

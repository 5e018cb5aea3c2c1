# Copyright 2026 ahv developers, Apache-2.0
"""The flight software: pure laws, and one node each."""

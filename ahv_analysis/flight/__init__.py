# Copyright 2026 ahv developers, Apache-2.0
"""One flight: its case, the engines that fly it, and what it came to."""

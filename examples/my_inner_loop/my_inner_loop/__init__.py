# Copyright 2026 ahv developers, Apache-2.0
"""An inner loop of one's own in the graph of ahv."""

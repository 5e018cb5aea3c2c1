# Copyright 2026 ahv developers, Apache-2.0
"""What crosses a topic: layouts, names, quality of service, parameters."""

# Copyright 2026 ahv developers, Apache-2.0
"""What happens around a flight: engines, bags, figures, the `ahv` command."""

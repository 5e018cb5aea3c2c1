# Copyright 2026 ahv developers, Apache-2.0
"""What people look at: figures, metrics, pages."""

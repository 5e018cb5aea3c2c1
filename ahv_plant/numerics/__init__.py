# Copyright 2026 ahv developers, Apache-2.0
"""How the laws become numbers: element-wise functions, compiled, and in lanes."""

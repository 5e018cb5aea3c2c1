# Copyright 2026 ahv developers, Apache-2.0
"""Many flights: batches in lanes, files that resume, Table 5.1."""

# Copyright 2026 ahv developers, Apache-2.0
"""What made the numbers of the documents."""

"""The flight software: pure laws, and one node each."""

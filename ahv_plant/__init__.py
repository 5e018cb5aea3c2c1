"""The vehicle: pure physics, and the node that flies it."""

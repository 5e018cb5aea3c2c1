"""What crosses a topic: layouts, names, quality of service, parameters."""

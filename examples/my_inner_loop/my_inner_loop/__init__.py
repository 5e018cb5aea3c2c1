"""An inner loop of one's own in the graph of ahv."""

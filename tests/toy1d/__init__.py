"""Laws of the one-dimensional toys, of the exact tools behind their figures, and of the figures themselves."""

"""Tiny figures, one module each, that worker processes import by name."""

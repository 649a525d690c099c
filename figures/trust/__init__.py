"""Figures that no paper has: what the zoo's bugs do, and what the scenes look like."""

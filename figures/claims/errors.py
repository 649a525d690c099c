"""The one error a user is meant to read."""


class FigureError(Exception):
    """Bad input or an unusable folder: the message names the value and the remedy; exit status 2."""

"""One-dimensional toys: integrals on intervals, where every claim of the theory has an exact answer."""

from toy1d.line import Chart, Line, quotient
from toy1d.toys import TOYS, overlapping_supports, two_pixels

__all__ = ["TOYS", "Chart", "Line", "overlapping_supports", "quotient", "two_pixels"]

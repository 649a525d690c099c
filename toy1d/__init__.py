"""One-dimensional toys: integrals on intervals, where every claim of the theory has an exact answer."""

from toy1d.gradient_toy import bare_peaks, partial_shift, shared_peak, two_pairs
from toy1d.line import Chart, Line, Technique, quotient
from toy1d.neighbours import degrading_neighbours, overlapping_supports, overstating_neighbours
from toy1d.rows import image_of_64, ring_of_8
from toy1d.toys import TOYS, known_densities, three_channels, two_pixels
from toy1d.walking import Walking, walking

__all__ = [
    "TOYS",
    "Chart",
    "Line",
    "Technique",
    "Walking",
    "bare_peaks",
    "degrading_neighbours",
    "image_of_64",
    "known_densities",
    "overlapping_supports",
    "overstating_neighbours",
    "partial_shift",
    "quotient",
    "ring_of_8",
    "shared_peak",
    "three_channels",
    "two_pairs",
    "two_pixels",
    "walking",
]

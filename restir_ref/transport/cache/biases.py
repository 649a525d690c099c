"""Where a query looks: displacements b (d, N) from a surface point, at which visibility would be ill-defined.

[DDGIR 3.4, Fig. 5]
"""

import numpy as np

from restir_ref.batch import Array

ALONG_NORMAL, ALONG_VIEW, REACH = 0.2, 0.8, 0.75
"""Shares of normal and view in the self-shadow bias, and its length in spacings.  [Majercik 2019]"""

KEPT = 1e-6
"""A query on the view path keeps this share of the segment's length from its start: eps of the length."""


def self_shadow(n: Array, o: Array, spacing: Array) -> Array:
    """b = (.2 n + .8 o) .75 min spacing, (d, N).  [Majercik 2019], [DDGIR Fig. 5a]

    n (d, N) unit normal on the viewer's side, o (d, N) unit direction to the viewer, spacing (d,) in scene units.
    Hazard: where something is closer than that, the query is on its other side.
    """
    return (ALONG_NORMAL * n + ALONG_VIEW * o) * (REACH * float(np.min(spacing)))


def view_path(o: Array, distance: Array | float, length: Array) -> Array:
    """b = o min(distance, length - eps), (d, N): back along the segment on which light leaves.  [DDGIR 3.4, Fig. 5b]

    o (d, N) unit direction to the viewer;  distance and length (N,) of the segment, scene units.
    """
    # erratum: moved by a fixed distance, the query is "guaranteed to not penetrate surfaces" only on the segment,
    # hence the minimum; tests/flatland/test_probe_rooms.py shows both.
    return np.asarray(o * np.minimum(distance, length * (1 - KEPT)))

"""Golden vectors of footprints: segments of paths, how each widens them, where a recursion ends.  [DDGIR Eq. 7, 8]"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from restir_ref.batch import Array, take
from restir_ref.transport.cache.footprint import as_wide_as_in_space, footprint, pixel_footprint, widening
from restir_ref.transport.cache.golden_numbers import PATTERNS, lattice, nudged, single, tolerances

SEGMENTS = 4

POOL, KEPT = 128, 24
"""Paths, of which a file keeps those beyond doubt."""

MARGIN = 1 / 64
"""Least distance of a from c a_0, as a share of c a_0, at every vertex."""


@dataclass(frozen=True)
class Paths:
    """Lengths r, densities p of the direction leaving x_i (0 for delta lobes), cosines at x_(i+1): (SEGMENTS, N) each.

    r0, cos0 (N,)  those of the camera's segment, which ends at x_1
    """

    r: Array
    p: Array
    cos: Array
    r0: Array
    cos0: Array


def paths(d: int) -> Paths:
    """Near and far, wide and narrow; every ninth lobe is a delta lobe."""
    r, p, cos = (lattice(SEGMENTS, POOL, k) for k in (0, 2, 4))
    p = np.where(np.arange(p.size).reshape(p.shape) % 9 == 4, 0.0, 2.0 ** np.round(7 * p))
    far, flat = lattice(2, POOL, 7)
    found = Paths(single(0.25 + 2 * r), single(p), single(0.125 + 0.75 * cos), single(2 + 6 * far), 0.25 + 0.5 * flat)
    return take(found, np.flatnonzero(clear(found, d))[:KEPT])


def terms(x: Paths, d: int) -> dict[str, Array]:
    """What every segment adds (SEGMENTS, N), a from x_1 up to its end (SEGMENTS, N), and a_0 (N,)."""
    lengths = np.stack([widening(*each, d) for each in zip(x.r, x.p, x.cos, strict=True)])
    a = np.stack([footprint(lengths[: k + 1], d) for k in range(SEGMENTS)])
    return {"widening": lengths, "footprint": a, "pixel": pixel_footprint(x.r0, x.cos0, d)}


def spread(x: Paths, d: int) -> Array:
    """a / (c a_0) at the end of every segment, (SEGMENTS, N): a recursion ends where it is above 1."""
    found = terms(x, d)
    return np.asarray(found["footprint"] / (as_wide_as_in_space(d) * found["pixel"]))


def clear(x: Paths, d: int) -> Array:
    """Where nobody's rounding decides whether a path ends, (N,)."""
    return np.asarray((np.abs(spread(x, d) - 1) > MARGIN).all(axis=0))


def nudge(x: Paths, k: int) -> Paths:
    """Every number moved by one rounding."""
    return Paths(*(nudged(getattr(x, name), k, salt) for salt, name in enumerate(Paths.__dataclass_fields__)))


def vector(d: int) -> Mapping[str, Any]:
    """Paths, the threshold c, and what follows: `ends` counts the segments that are traced, one more for no end."""
    x = paths(d)
    want = terms(x, d)
    wide = spread(x, d) > 1
    return {
        "c": as_wide_as_in_space(d),
        "inputs": {name: getattr(x, name) for name in Paths.__dataclass_fields__},
        "expected": {**want, "ends": np.where(wide.any(axis=0), wide.argmax(axis=0), SEGMENTS) + 1},
        "tolerance": tolerances(want, (terms(nudge(x, k), d) for k in PATTERNS)),
    }

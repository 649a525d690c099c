"""What comes back of a path that was shifted there and back, and how short connections are."""

from dataclasses import fields

import numpy as np

from restir_ref.batch import take
from restir_ref.transport.paths import Path
from restir_ref.transport.proofs.inversion import traced
from restir_ref.transport.proofs.reading import extended_path
from restir_ref.transport.shifts import replay
from tests.transport.paths import Shifts


def differing(a: object, b: object) -> set[str]:
    """The fields of two batches of paths that are not bitwise equal."""
    return {each.name for each in fields(a) if getattr(a, each.name).tobytes() != getattr(b, each.name).tobytes()}


def differing_by_replay(s: Shifts, back: Path) -> set[str]:
    """What is not bitwise x's: of the record that came back, of the one that its numbers trace, and of all vertices."""
    fresh = traced(s.t, back.u, s.i, back.k, back.nee)
    vertices = (extended_path(s.t, path.u, s.i, path.k, path.nee) for path in (s.x, back))
    return differing(back, s.x) | differing(fresh, s.x) | differing(*vertices)


def nearest_connections(s: Shifts) -> tuple[float, float]:
    """The shortest connection of all base paths, and of all offset paths."""
    connected, found = s.x.c > 0, []
    for path, pixel in ((s.x, s.i), (s.y, s.j)):
        part = take(path, np.flatnonzero(connected))
        v = replay(s.t, part, pixel[connected]).v
        found.append(float(np.linalg.norm(part.z - v.x, axis=0).min(initial=1)))
    return found[0], found[1]

"""Golden vectors of caches: volumes, questions, and all that an answer is made of; and footprints; for shaders.

Numbers are the same in float32.  Every choice of a query (the cell, the texels between which a map is interpolated) is
far from falling the other way; what depends on them is continuous.
"""

import argparse
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from restir_ref.batch import Array, take
from restir_ref.transport.cache import golden_footprints
from restir_ref.transport.cache.golden_numbers import PATTERNS, lattice, nudged, single, tolerances
from restir_ref.transport.cache.grid import Grid
from restir_ref.transport.cache.maps import Maps
from restir_ref.transport.cache.volume import Volume
from restir_ref.transport.vectors import normalize

FORMAT, VERSION = "restir-ref golden probes", 2

MARGIN = 1 / 256
"""Least distance from another cell, in cells, and least weight of a texel between which a map is interpolated."""

POOL, KEPT = 512, 24
"""Questions, of which a file keeps those beyond doubt."""


@dataclass(frozen=True)
class Question:
    """Queries at points x with unit normals n, in directions w, displaced by b; (d, N) each."""

    x: Array
    n: Array
    w: Array
    b: Array


def volume(grid: Grid, maps: Maps, C: int) -> Volume:
    """A volume that no scene has: uneven irradiance, means up to the reach, and one probe inside a wall."""
    P = grid.P
    E = lattice(C, P * maps.irradiance.K, 0).reshape(C, P, -1) + 0.125
    u = lattice(2, P * maps.depth.K, 3).reshape(2, P, -1)
    r1 = single((0.25 + 0.5 * u[0]) * grid.reach)
    return Volume(grid, maps, E, np.stack([r1, single(r1**2 * (1 + 0.5 * u[1]))]), np.arange(P) != P // 2, frames=1)


def questions(v: Volume) -> Question:
    """Around and beyond the grid, all beyond doubt."""
    d, last = v.grid.d, np.array(v.grid.counts)[:, None] - 1
    low, size = np.array(v.grid.origin)[:, None], np.array(v.grid.spacing)[:, None]
    x = low + size * ((last + 2.5) * lattice(d, POOL, 0) - 1.25)
    n, w = (single(normalize(lattice(d, POOL, 3 * k) * 2 - 1)) for k in (1, 2))
    q = Question(single(x), n, w, single(n * 0.25 * size.min()))
    return take(q, np.flatnonzero(clear(v, q))[:KEPT])


def clear(v: Volume, q: Question) -> Array:
    """Whether x + b is MARGIN off every cell's side, and all weights of texels are above it; (N,)."""
    at = (q.x + q.b - np.array(v.grid.origin)[:, None]) / np.array(v.grid.spacing)[:, None]
    far = np.abs(at - np.round(at)).min(axis=0) > MARGIN
    texels = [v.maps.irradiance.fetch(q.w)]
    for probe, _ in v.grid.corners(q.x + q.b):
        texels.append(v.maps.depth.fetch(normalize(q.x + q.b - v.grid.place(probe))))
    sharp = np.all([weight.min(axis=0) > MARGIN for _, weight in texels], axis=0)
    return np.asarray(far & sharp)


def terms(v: Volume, q: Question) -> dict[str, Array]:
    """What an answer is made of, corner by corner: the probe, its multilinear weight, how far it is trusted; E+."""
    corners = list(v.grid.corners(q.x + q.b))
    probe = np.stack([each for each, _ in corners])
    return {
        "probe": probe,
        "near": np.stack([near for _, near in corners]),
        "trust": np.stack([v.trust(each, q.x, q.n, q.b) for each in probe]),
        "irradiance": v.irradiance(q.x, q.n, q.w, q.b),
    }


def moved(v: Volume, q: Question, k: int) -> tuple[Volume, Question]:
    """Every number moved by one rounding."""
    x, n, w, b = (nudged(each, k, salt) for salt, each in enumerate((q.x, q.n, q.w, q.b)))
    return replace(v, E=nudged(v.E, k, 4), r=nudged(v.r, k, 5)), Question(x, n, w, b)


def vectors(volumes: Mapping[str, Volume]) -> dict[str, Any]:
    """What a file holds."""
    (d,) = {v.grid.d for v in volumes.values()}
    answers = [vector(name, v) for name, v in volumes.items()]
    return {"format": FORMAT, "version": VERSION, "volumes": answers, "footprints": golden_footprints.vector(d)}


def vector(name: str, v: Volume) -> dict[str, Any]:
    """One volume, its questions, and the answers."""
    q = questions(v)
    grid = {each: list(getattr(v.grid, each)) for each in ("origin", "spacing", "counts")}
    state = {"reach": v.grid.reach, "E": v.E, "r": v.r, "active": v.active.astype(int)}
    inputs = {each: getattr(q, each) for each in ("x", "n", "w", "b")}
    texels = {"irradiance": v.maps.irradiance.K, "depth": v.maps.depth.K}
    want = terms(v, q)
    inexact = {each: want[each] for each in ("near", "trust", "irradiance")}
    return {
        "name": name,
        "grid": grid,
        "texels": texels,
        "volume": state,
        "inputs": inputs,
        "expected": want,
        "tolerance": tolerances(inexact, (terms(*moved(v, q, k)) for k in PATTERNS)),
    }


def text(volumes: Mapping[str, Volume]) -> str:
    """The file."""

    def plain(value: Any) -> Any:
        return value.tolist() if isinstance(value, np.ndarray) else value

    return json.dumps(vectors(volumes), default=plain, separators=(",", ":")) + "\n"


def main(volumes: Mapping[str, Volume], shipped: Path, arguments: Sequence[str] | None = None) -> int:
    """Write the file, or compare it with what ships; 1 if that differs."""
    parser = argparse.ArgumentParser(description="Golden vectors of probe queries.")
    parser.add_argument("file", nargs="?", type=Path, default=shipped)
    parser.add_argument("--check", action="store_true", help="compare only")
    options = parser.parse_args(arguments)
    if not options.check:
        options.file.write_text(text(volumes), encoding="utf-8")
        return 0
    return int(
        not options.file.exists()
        or not alike(json.loads(options.file.read_text(encoding="utf-8")), json.loads(text(volumes)))
    )


def alike(a: Any, b: Any) -> bool:
    """Whether two things that JSON holds are the same, numbers to ROUNDINGS: other processors add in another order."""
    if isinstance(a, dict) and isinstance(b, dict):
        return a.keys() == b.keys() and all(alike(a[key], b[key]) for key in a)
    if isinstance(a, list) and isinstance(b, list):
        return len(a) == len(b) and all(map(alike, a, b))
    if isinstance(a, float) and isinstance(b, float):
        return math.isclose(a, b, rel_tol=ROUNDINGS, abs_tol=ROUNDINGS)
    return type(a) is type(b) and bool(a == b)


ROUNDINGS = 1e-12
"""Thousands of roundings of 64 bits, and a ten thousandth of the tolerances that go with the vectors."""

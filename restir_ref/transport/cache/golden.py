"""Golden vectors of probe queries: a volume, questions, and all that an answer is made of, for shaders.

Numbers are the same in float32.  Every choice of a query (the cell, the texels between which a map is interpolated) is
far from falling the other way; what depends on them is continuous.  Tolerances are OPERATIONS times what moving all
inputs by one rounding of float32 does.
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
from restir_ref.transport.cache.grid import Grid
from restir_ref.transport.cache.maps import Maps
from restir_ref.transport.cache.volume import Volume
from restir_ref.transport.vectors import normalize

FORMAT, VERSION = "restir-ref golden probes", 1

MARGIN = 1 / 256
"""Least distance from another cell, in cells, and least weight of a texel between which a map is interpolated."""

POOL, KEPT = 512, 24
"""Questions, of which a file keeps those beyond doubt."""

OPERATIONS = 128
"""So many roundings are allowed for."""

UNIT = 2.0**-24
"""Relative error of one operation in float32."""


@dataclass(frozen=True)
class Question:
    """Queries at points x with unit normals n, in directions w, displaced by b; (d, N) each."""

    x: Array
    n: Array
    w: Array
    b: Array


def lattice(rows: int, N: int, first: int) -> Array:
    """Numbers (rows, N) in [0, 1) that fill their cube evenly, multiples of 2^-16; other rows for another `first`."""
    steps = np.sqrt(np.array([2.0, 3.0, 5.0, 7.0, 11.0, 13.0, 17.0, 19.0, 23.0])[first : first + rows])[:, None]
    return np.asarray(np.floor(np.arange(1, N + 1) * steps % 1 * 2**16) / 2**16)


def single(values: Array) -> Array:
    """As float32 has them."""
    return np.asarray(values, dtype=np.float32).astype(float)


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


def tolerances(v: Volume, q: Question) -> dict[str, float]:
    """For |got - want| <= tolerance (|want| + mean |want|), by moving every input by one rounding up or down."""
    want, found = terms(v, q), dict.fromkeys(("near", "trust", "irradiance"), UNIT)
    for k in range(8):
        got = terms(*moved(v, q, k))
        for name in found:
            size = np.abs(want[name]) + np.abs(want[name]).mean()
            found[name] = max(found[name], float((np.abs(got[name] - want[name]) / size).max()))
    return {name: OPERATIONS * each for name, each in found.items()}


def moved(v: Volume, q: Question, k: int) -> tuple[Volume, Question]:
    """Everything times 1 + UNIT or 1 - UNIT, by patterns that differ with k."""

    def by(values: Array, salt: int) -> Array:
        sign = np.where(np.arange(values.size) * (2 * k + 1 + salt) % 7 < 3, 1.0, -1.0)
        return np.asarray(values * (1 + UNIT * sign.reshape(values.shape)))

    moved_q = Question(by(q.x, 0), by(q.n, 1), by(q.w, 2), by(q.b, 3))
    return replace(v, E=by(v.E, 4), r=by(v.r, 5)), moved_q


def vectors(volumes: Mapping[str, Volume]) -> dict[str, Any]:
    """What a file holds."""
    return {"format": FORMAT, "version": VERSION, "volumes": [vector(name, v) for name, v in volumes.items()]}


def vector(name: str, v: Volume) -> dict[str, Any]:
    """One volume, its questions, and the answers."""
    q = questions(v)
    grid = {each: list(getattr(v.grid, each)) for each in ("origin", "spacing", "counts")}
    state = {"reach": v.grid.reach, "E": v.E, "r": v.r, "active": v.active.astype(int)}
    inputs = {each: getattr(q, each) for each in ("x", "n", "w", "b")}
    texels = {"irradiance": v.maps.irradiance.K, "depth": v.maps.depth.K}
    return {
        "name": name,
        "grid": grid,
        "texels": texels,
        "volume": state,
        "inputs": inputs,
        "expected": terms(v, q),
        "tolerance": tolerances(v, q),
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

"""From sketches to files: columns far from every boundary, their terms, and tolerances measured by perturbation."""

import argparse
import json
from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from itertools import permutations
from pathlib import Path
from typing import Any

import numpy as np

from restir_ref.audit.make_golden import text as lines
from restir_ref.batch import Array, entry, take
from restir_ref.chance import Chance, Live
from restir_ref.transport.paths import Path as LightPath
from restir_ref.transport.paths import Tracer, Tree, leaves, trace
from restir_ref.transport.proofs.golden import differences, margins
from restir_ref.transport.proofs.golden.sketch import Sketch, not_float32
from restir_ref.transport.proofs.golden.terms import (
    Chosen,
    first_points,
    moving,
    numbers,
    records,
    terms,
    turned,
)
from restir_ref.transport.rays import arrive
from restir_ref.transport.shifts import replay, shift_path
from restir_ref.transport.space import Space
from restir_ref.transport.vectors import dot

FORMAT, VERSION = "restir-ref golden paths", 2

SEED = 20220701
POOL = 4096
"""Candidates of which a file keeps those far from boundaries."""

PATHS, SHIFTS, PASSES, DARK = 12, 32, 12, 8
"""How many of them it keeps, of each scene."""

MARGIN = 2.0**-8
"""Least margin of what is kept: some thousand times the rounding of float32."""

GRAIN = 2.0**-16
"""Primary numbers are multiples of this, so that they are the same in float32."""

UNIT = {"float32": 2.0**-24, "float64": 2.0**-53}
"""Relative error of one operation."""

OPERATIONS = 64
"""So many roundings of inputs and results are allowed for."""


def vectors(sketches: Sequence[Sketch], space: Space) -> dict[str, Any]:
    """What a file holds.  Raises ValueError for a sketch with numbers that float32 does not have."""
    file = untolerant(sketches, space)
    for sketch, scene in zip(sketches, file["scenes"], strict=True):
        scene["tolerance"] = tolerances(sketch, space, Chosen(**scene["inputs"]), scene["expected"])
    return file


def untolerant(sketches: Sequence[Sketch], space: Space) -> dict[str, Any]:
    """The same without tolerances, which are most of the work."""
    chance = Live(np.random.default_rng(SEED))
    scenes = [vector(sketch, space, chance) for sketch in sketches]
    return {"format": FORMAT, "version": VERSION, "d": space.d, "margin": MARGIN, "scenes": scenes}


def vector(sketch: Sketch, space: Space, chance: Chance) -> dict[str, Any]:
    """One scene with its inputs and expected terms."""
    described = sketch.described()
    if odd := not_float32(described):
        raise ValueError(f"{sketch.name}: float32 has no {', '.join(odd)}; take multiples of a power of two.")
    t = sketch.tracer(space)
    chosen = choose(t, chance)
    return {
        "name": sketch.name,
        "about": sketch.about,
        "scene": described,
        "inputs": {each.name: getattr(chosen, each.name) for each in fields(Chosen)},
        "expected": terms(t, chosen),
    }


# ---------------------------------------------------------------- columns beyond doubt


def choose(t: Tracer, chance: Chance) -> Chosen:
    """Paths that stay in the scene, shifts of theirs, and passes over three of these, all far from every boundary."""
    u = np.floor(chance.uniform((t.D, POOL)) / GRAIN) * GRAIN
    pixel = np.arange(POOL) % t.sensor.n
    lost = np.flatnonzero(margin_of_darkness(t, u, pixel) > MARGIN)[:DARK]
    dark = {"dark_u": u[:, lost], "dark_pixel": pixel[lost]}
    clear = np.flatnonzero(margin_of_paths(t, u, pixel) > MARGIN)
    found = [F.any(axis=0) for _, nee, F in leaves(trace(t, u[:, clear], pixel[clear])) if not nee]
    kept = mixed(clear, np.any(found, axis=0), PATHS)  # half of them meet a light
    u, pixel = u[:, kept], pixel[kept]
    every = every_shift(t, u, pixel)
    signs = differences.margin_of_pairs(t, records(t, every), pixel[every.path], every.to)
    clear = np.flatnonzero(np.minimum(margin_of_shifts(t, every), signs) > MARGIN)
    spread = clear[np.argsort(clear * 0.618034 % 1, kind="stable")]  # over paths, leaves and pixels
    some = by_turns([spread[sort[spread]] for sort in sorts(t, every)], SHIFTS)
    shifts = every.shifted(some, every.to[some])
    passes = clear_passes(t, shifts)
    return replace(
        shifts,
        passes=passes[:, :PASSES],
        differences=clear_differences(t, shifts, passes),
        mutated=clear_mutations(t, shifts),
        **dark,
    )


def mixed(columns: Array, rare: Array, count: int) -> Array:
    """`count` of the columns, half of them rare ones as far as there are so many, in their order."""
    first = columns[rare][: count // 2]
    return np.concatenate([first, columns[~rare][: count - len(first)]])


def sorts(t: Tracer, s: Chosen) -> list[Array]:
    """Masks of what shifts can be, rare ones first: dark, connected early (c = 0, > 0), blocked, onto a light; all."""
    x = records(t, s)
    _, J = shift_path(t, x, s.to)
    dark = ends_dark(trace(t, s.u[:, s.path], s.to), last_replayed(x))
    early = ~replay(t, x, s.to).legal & ~dark
    undefined = J == 0
    blocked = undefined & ~early & ~dark
    return [dark, early & (x.c == 0), early & (x.c > 0), blocked, ~undefined & (s.nee == 0), ~undefined]


def by_turns(lists: Sequence[Array], count: int) -> Array:
    """`count` different columns, one of each list after the other while they last."""
    ranked = sorted(
        (place, turn, column) for turn, each in enumerate(lists) for place, column in enumerate(each.tolist())
    )
    return np.array(list(dict.fromkeys(column for _, _, column in ranked))[:count], dtype=int)


def every_shift(t: Tracer, u: Array, pixel: Array) -> Chosen:
    """Every lit leaf of every path into every other pixel."""
    lit = [(path, k, int(nee)) for k, nee, F in leaves(trace(t, u, pixel)) for path in np.flatnonzero(F.any(axis=0))]
    path, k, nee = (np.array(column) for column in zip(*lit, strict=True))
    turns = [(pixel[path] + 1 + turn) % t.sensor.n for turn in range(t.sensor.n - 1)]
    path, k, nee = (np.tile(part, len(turns)) for part in (path, k, nee))
    return Chosen(u, pixel, path, k, nee, np.concatenate(turns))


def clear_passes(t: Tracer, s: Chosen) -> Array:
    """Three base paths each, of which every shift into the pixel of another is clear: (3, .), mixed."""
    M, n = len(s.to), t.sensor.n
    shift, to = np.divmod(np.arange(M * n), n)
    own = s.pixel[s.path]
    margin = np.where(own[shift] == to, np.inf, margin_of_shifts(t, s.shifted(shift, to))).reshape(M, n)
    triples = np.array(list(permutations(range(M), 3))).T
    pixels = own[triples]
    clear = np.array([margin[triples[i], pixels[j]] > MARGIN for i in range(3) for j in range(3)]).all(axis=0)
    different = (pixels[0] != pixels[1]) & (pixels[0] != pixels[2]) & (pixels[1] != pixels[2])
    found = np.flatnonzero(clear & different)
    return np.asarray(triples[:, found[np.argsort(found * 0.618034 % 1, kind="stable")]])


def clear_differences(t: Tracer, s: Chosen, passes: Array) -> Array:
    """PASSES of clear passes whose differences are of their signs beyond doubt: (3, .)."""
    some = passes[:, : 8 * PASSES]
    margin = differences.margin_of_signs(t, records(t, s), s.pixel[s.path], some)
    return np.asarray(some[:, np.flatnonzero(margin > MARGIN)[:PASSES]])


def clear_mutations(t: Tracer, s: Chosen) -> Array:
    """Shifts whose base paths' mutations are clear: the new ray, sides, and what joins x_(c+1), (.,)."""
    x, still = moving(t, s)
    w, v = turned(t, x, still.at), still.at.v
    exists = w.any(axis=0)
    z, r, met = arrive(t.scene, v.x, np.where(exists, w, v.n))
    rules = abs(r / t.rule.distance - 1) if t.rule.distance > 0 else r
    margin = margins.least([margins.of_rays(t.scene, v.x, z.x), rules, abs(dot(v.n, w)), z.o[-1]])
    lit = (x.nee > 0) & (x.c == x.k)
    joins = (x.c <= x.k) & ~lit
    far = margins.of_connections(t, z, np.where(joins, x.far_z, z.x + w), np.where(joins, x.far_prim, z.prim))
    by_light = margins.of_light(t, z, t.end_numbers(x))
    after = np.where(joins, far, np.where(lit, by_light, np.inf))
    past = margins.of_rays(t.scene, v.x, v.x + margins.BEYOND * t.scene.extent * w)
    margin = np.where(met, np.minimum(margin, after), np.minimum(past, abs(dot(v.n, w))))
    return np.asarray(still.columns[(margin > MARGIN) & exists])


def margin_of_paths(t: Tracer, u: Array, pixel: Array) -> Array:
    """Least margin of a whole tree, 0 where it leaves the scene or goes dark; (N,)."""
    tree = trace(t, u, pixel)
    way, lights = margins.of_trees(t, tree, first_points(t, pixel))
    alive = tree.T[-1].any(axis=0)
    return np.asarray(np.where(alive, np.minimum(way.min(axis=0), lights.min(axis=0)), 0))


def lit(tree: Tree) -> Array:
    """How many vertices light reaches from the eye, (N,)."""
    return np.asarray(np.stack([T.any(axis=0) for T in tree.T]).sum(axis=0))


def last_replayed(x: LightPath) -> Array:
    """The number of the last vertex that a shift of x replays, (M,)."""
    return np.where(x.c > 0, x.c - 1, np.where(x.nee > 0, x.k, x.k + 1))


def ends_dark(there: Tree, last: Array) -> Array:
    """Whether replayed paths go dark before that vertex, (M,)."""
    return lit(there) < last


def margin_of_ends(t: Tracer, tree: Tree, x_0: Array) -> Array:
    """Least margin of a path that goes dark up to there, light sampling left out, 0 where it does not; (N,)."""
    way, _ = margins.of_trees(t, tree, x_0)
    upto, n = np.minimum.accumulate(np.minimum(way, margins.of_pairs(t, tree)), axis=0), lit(tree)
    dark = np.stack([margins.of_darkness(t, tree, i) for i in range(1, t.depth + 1)])
    inside = (n > 0) & (n <= t.depth)
    i = np.clip(n, 1, t.depth) - 1
    return np.where(inside, np.minimum(entry(upto, i), entry(dark, i)), 0)


def margin_of_darkness(t: Tracer, u: Array, pixel: Array) -> Array:
    """Least margin of a whole tree that goes dark, 0 where it does not; (N,)."""
    tree, x_0 = trace(t, u, pixel), first_points(t, pixel)
    _, lights = margins.of_trees(t, tree, x_0)
    found = entry(np.minimum.accumulate(lights, axis=0), np.minimum(lit(tree), t.depth))
    return np.minimum(margin_of_ends(t, tree, x_0), found)


def margin_of_shifts(t: Tracer, s: Chosen) -> Array:
    """Least margin of what shifts decide: the offset path up to its last replayed vertex, and its connection; (M,)."""
    x = records(t, s)
    there = trace(t, s.u[:, s.path], s.to)
    way, lights = margins.of_trees(t, there, first_points(t, s.to))
    last = last_replayed(x)
    upto = np.minimum.accumulate(np.minimum(way, margins.of_pairs(t, there)), axis=0)
    found = [entry(upto, last - 1), np.where(x.nee > 0, entry(lights, np.maximum(x.k, 1)), np.inf)]
    joined = np.full(len(x.c), np.inf)
    for i in range(1, t.depth + 1):
        c = np.flatnonzero(x.c == i + 1)
        joined[c] = margins.of_connections(t, take(there.x[i - 1], c), x.z[:, c], x.prim[c])
    onto = (x.c == 0) & (x.nee == 0) & (lit(there) == last - 1)  # onto a light: dark, or F = 0, as one likes
    dark = np.where(onto, 0, margin_of_ends(t, there, first_points(t, s.to)))
    return np.where(ends_dark(there, last), dark, margins.least([*found, joined]))  # beyond, columns are not their own


# ---------------------------------------------------------------- tolerances


def tolerances(sketch: Sketch, space: Space, chosen: Chosen, expected: Mapping[str, Any]) -> dict[str, Any]:
    """Per kind of arithmetic and term: how much results move when every input moves by one rounding, times OPERATIONS.

    |got - want| <= tolerance * (|want| + mean |want|) is asked, the mean over the whole array.
    """
    step = 2.0**-30
    rng = np.random.default_rng(SEED + 1)
    want: dict[str, Array] = numbers(expected)
    worst: dict[str, float] = {}
    for _ in range(8):
        moved, there = moved_by(sketch, step, rng), chosen.u * (1 + step * rng.uniform(-1, 1, chosen.u.shape))
        got = numbers(terms(moved.tracer(space), replace(chosen, u=np.minimum(there, 1 - step))))
        for name, values in want.items():
            if values.dtype.kind == "f" and values.size:
                size = np.abs(values) + np.abs(values).mean()
                error = np.divide(np.abs(got[name] - values), size, out=np.zeros(values.shape), where=size > 0)
                worst[name] = max(worst.get(name, 0.0), float(error.max(initial=0)))
    return {
        kind: {name: float(f"{OPERATIONS * unit * max(error / step, 1):.1e}") for name, error in worst.items()}
        for kind, unit in UNIT.items()
    }


def moved_by(sketch: Sketch, step: float, rng: np.random.Generator) -> Sketch:
    """The same scene with every coordinate moved by that share of itself."""

    def moved(x: Sequence[float]) -> list[float]:
        return [float(each * (1 + step * sign)) for each, sign in zip(x, rng.uniform(-1, 1, len(x)), strict=True)]

    return replace(
        sketch,
        facets=[replace(each, corners=[moved(corner) for corner in each.corners]) for each in sketch.facets],
        balls=[replace(each, centre=moved(each.centre)) for each in sketch.balls],
        eyes=[(moved(start), moved(at)) for start, at in sketch.eyes],
    )


# ---------------------------------------------------------------- files


def text(file: Mapping[str, Any]) -> str:
    """JSON with a line per field; numbers with 15 digits, or all if float32 has them."""
    return lines(_rounded(file))


def _rounded(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {name: _rounded(each) for name, each in value.items()}
    if isinstance(value, list | tuple | np.ndarray):
        return [_rounded(each) for each in (value.tolist() if isinstance(value, np.ndarray) else value)]
    if isinstance(value, float) and float(np.float32(value)) != value:
        return float(f"{value:.15g}")
    return value


def stale(path: Path, fresh: Mapping[str, Any], rtol: float = 1e-9) -> list[str]:
    """Fields of a file that are not what would be written, up to the last digits of other machines."""
    if not path.is_file():
        return [path.name]
    shipped, wanted = (numbers(_flat(each)) for each in (json.loads(path.read_text("utf-8")), json.loads(text(fresh))))
    odd = {*shipped} ^ {*wanted}
    odd |= {name for name in shipped.keys() & wanted.keys() if not _alike(shipped[name], wanted[name], rtol)}
    return sorted(odd)


def _flat(file: Mapping[str, Any]) -> dict[str, Any]:
    """The scenes by their names."""
    return {scene["name"]: {key: scene[key] for key in ("inputs", "expected")} for scene in file["scenes"]}


def _alike(a: Array, b: Array, rtol: float) -> bool:
    return a.shape == b.shape and bool(np.allclose(a, b, rtol=rtol, atol=rtol * (np.abs(b).mean() if b.size else 0)))


def main(sketches: Sequence[Sketch], space: Space, shipped: Path, arguments: Sequence[str] | None = None) -> int:
    """Write the file of a world, or check the one that ships with it; the exit status."""
    parser = argparse.ArgumentParser(description="Golden vectors of paths: write the file anew, or check it.")
    parser.add_argument("file", nargs="?", default=shipped, type=Path, metavar="FILE", help="default: %(default)s")
    parser.add_argument("--check", action="store_true", help="compare with what is in the file, write nothing")
    options = parser.parse_args(arguments)
    if options.check:
        odd = stale(options.file, untolerant(sketches, space))
        print(f"stale: {', '.join(odd)}" if odd else "the golden paths are up to date")
        return 1 if odd else 0
    options.file.parent.mkdir(parents=True, exist_ok=True)
    options.file.write_bytes((text(vectors(sketches, space)) + "\n").encode())
    return 0

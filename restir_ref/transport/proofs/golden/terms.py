"""What paths, shifts, passes, pairs and mutations are made of, as the files of golden vectors have it.

All arrays are columns: the last axis counts paths, shifts and so on; vectors have their d components in front of it.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from restir_ref.batch import Array, entry, take
from restir_ref.integrals import Pixels, Reservoirs
from restir_ref.resampling import Input
from restir_ref.transport import materials as mat
from restir_ref.transport.mutations import FarPath, Place, Standing, TwoRays, far_record, land
from restir_ref.transport.paths import Path, Tracer, Tree, leaves, trace
from restir_ref.transport.proofs.golden import differences
from restir_ref.transport.proofs.golden.differences import CONFIDENCES, Terms
from restir_ref.transport.proofs.golden.resampled import MIS, landed_in, resampled
from restir_ref.transport.rays import sample_light
from restir_ref.transport.record import first_connectable, record
from restir_ref.transport.restir_pt import PathIntegrals
from restir_ref.transport.shifts import shift_path

TURN = 1 / 16
"""A mutation adds this to the first number of a direction, around the circle."""


@dataclass(frozen=True)
class Chosen:
    """What a file is about: u (D, N) and pixel (N,); of shifts, their base path, leaf (k, nee) and where to, (M,).

    passes (3, P)      the shifts whose base paths a pass resamples, the canonical one first
    differences (3, R) those of a pass of pairs, in whose three pixels they live
    mutated (Q,)       the shifts whose base paths are mutated
    dark_u (D, B), dark_pixel (B,)  paths that go dark
    """

    u: Array
    pixel: Array
    path: Array
    k: Array
    nee: Array
    to: Array
    passes: Array = field(default_factory=lambda: np.zeros((3, 0), dtype=int))
    differences: Array = field(default_factory=lambda: np.zeros((3, 0), dtype=int))
    mutated: Array = field(default_factory=lambda: np.zeros(0, dtype=int))
    dark_u: Array = field(default_factory=lambda: np.zeros((0, 0)))
    dark_pixel: Array = field(default_factory=lambda: np.zeros(0, dtype=int))

    def shifted(self, which: Array, to: Array) -> "Chosen":
        """The same base paths as those shifts, to other pixels."""
        return Chosen(self.u, self.pixel, self.path[which], self.k[which], self.nee[which], to)


def terms(t: Tracer, chosen: Chosen) -> Terms:
    """Everything, by kind: paths, those that go dark, shifts, pass, pairs, their pass, mutations."""
    tree = trace(t, chosen.u, chosen.pixel)
    base = records(t, chosen)
    return {
        "paths": paths(t, tree),
        "dark": dark(t, chosen),
        "shifts": shifts(t, base, chosen),
        "pass": one_pass(t, base, chosen),
        "pairs": differences.pairs(t, base, chosen.pixel[chosen.path], chosen.to),
        "differences": differences.one_pass(t, base, chosen.pixel[chosen.path], chosen.differences),
        "mutations": mutations(t, chosen),
    }


def records(t: Tracer, chosen: Chosen) -> Path:
    """The records of the base paths of all shifts, (M,) columns."""
    tree = trace(t, chosen.u[:, chosen.path], chosen.pixel[chosen.path])
    return record(t, tree, chosen.k, chosen.nee, leaf_value(tree, chosen.k, chosen.nee))


def leaf_value(tree: Tree, k: Array, nee: Array) -> Array:
    """F (C, N) of leaf (k, nee) of each column."""
    F = np.zeros_like(tree.T[0])
    for at, by_light, value in leaves(tree):
        F = np.where((k == at) & (nee == by_light), value, F)
    return F


# ---------------------------------------------------------------- paths


def paths(t: Tracer, tree: Tree) -> Terms:
    """Vertices x_1 .., what is sampled at each, points on lights, and the contribution of every leaf."""
    by_hit, by_light = first_connectable(t, tree)
    found = list(leaves(tree))
    return {
        "vertices": {
            "x": np.stack([v.x for v in tree.x]),
            "n": np.stack([v.n for v in tree.x]),
            "primitive": np.stack([v.prim for v in tree.x]),
            "cos_o": np.stack([v.o[-1] for v in tree.x]),
            "r": np.stack(tree.r),
            "T": np.stack(tree.T),
        },
        "scattering": {
            "lobe": np.stack([at.lobe for at in tree.at]),
            "P": np.stack([at.P for at in tree.at]),
            "w": np.stack([at.w for at in tree.at]),
            "p": np.stack([at.p for at in tree.at]),
            "p_all": np.stack([at.p_all for at in tree.at]),
            "weight": np.stack([at.weight for at in tree.at]),
        },
        "lights": lights(t, tree),
        "leaves": {
            "k": [k for k, _, _ in found],
            "nee": [int(nee) for _, nee, _ in found],
            "F": np.stack([F for _, _, F in found]),
            "c": np.stack([by_light[k] if nee else by_hit[k] for k, nee, _ in found]),
        },
    }


def lights(t: Tracer, tree: Tree) -> Terms:
    """The light point y of every vertex that scatters, and the density of its direction, 0 where nothing arrives."""
    points = [sample_light(t.scene, *t.light_numbers(tree.u, i)).y for i in range(1, t.depth + 1)]
    arrives = np.stack([leaf.bare.any(axis=0) for leaf, _ in tree.lights])
    density = np.stack([leaf.p_light for leaf, _ in tree.lights])
    return {"y": np.stack(points), "arrives": arrives.astype(int), "p": np.where(arrives, density, 0)}


def dark(t: Tracer, chosen: Chosen) -> Terms:
    """How many vertices light reaches from the eye, these, what arrives there, and every leaf, 0 beyond."""
    tree = trace(t, chosen.dark_u, chosen.dark_pixel)
    lit = np.stack([T.any(axis=0) for T in tree.T])
    return {
        "vertices": lit.sum(axis=0),
        "x": np.where(lit[:, None], np.stack([v.x for v in tree.x]), 0),
        "T": np.where(lit[:, None], np.stack(tree.T), 0),
        "F": np.stack([F for _, _, F in leaves(tree)]),
    }


# ---------------------------------------------------------------- shifts


def shifts(t: Tracer, x: Path, chosen: Chosen) -> Terms:
    """Base records, and the offset paths in pixel `to`."""
    y, J = shift_path(t, x, chosen.to)
    connected = x.c > 0
    return {
        "record": {
            "c": x.c,
            "z": np.where(connected, x.z, 0),
            "primitive": np.where(connected, x.prim, 0),
            "lobe_in": np.where(connected, x.lobe_in, 0),
            "lobe_out": np.where(connected, x.lobe_out, 0),
            "out": np.where(connected & ~(x.c > x.k), x.out, 0),
            "S": np.where(connected, x.S, 0),
            "p_light": np.where(connected & (x.c == x.k), x.p_light, 0),
            "A": x.A,
            "F": x.F,
        },
        "defined": (J > 0).astype(int),
        "J": J,
        "A": np.where(J > 0, y.A, 0),
        "F": np.where(J > 0, y.F, 0),
    }


# ---------------------------------------------------------------- a pass


def one_pass(t: Tracer, x: Path, chosen: Chosen) -> Terms:
    """Pairwise resampling of three base paths in the pixel of the first: the fields of a dump, and its terms."""
    inputs = _inputs(t, x, chosen)
    here = inputs[0].at
    return {
        "mis": MIS,
        "canonical": [1, 0, 0],
        "c": np.stack([each.X.c for each in inputs]),
        "J": np.stack([landed_in(each, here)[1] for each in inputs]),
        **resampled(inputs),
    }


def _inputs(t: Tracer, x: Path, chosen: Chosen) -> list[Input]:
    """Three base paths of every pass, each in its own pixel; W = 1/4, 1/2, 3/4."""
    of, P = PathIntegrals(t), chosen.passes.shape[1]
    return [
        Input(
            Reservoirs(take(x, row), np.full(P, (i + 1) / 4), np.full(P, c)), Pixels(of, chosen.pixel[chosen.path[row]])
        )
        for i, (row, c) in enumerate(zip(chosen.passes, CONFIDENCES, strict=True))
    ]


# ---------------------------------------------------------------- mutations


def mutations(t: Tracer, chosen: Chosen) -> Terms:
    """The base paths of the shifts `mutated`: another direction w from x_(c-1), joined to x_(c+1) by the same lobes.

    T (., P) is the ratio of transitions, 0 if the proposal is rejected; F and z = x_c are 0 there.  [MCMC 4.1]
    """
    some = chosen.shifted(chosen.mutated, chosen.to[chosen.mutated])
    x, still = moving(t, some)
    w = turned(t, x, still.at)
    moved, T = land(t, x, still.at, w, x.lobe_in)
    return {"w": w, "T": T, "F": np.where(T > 0, moved["F"], 0), "z": np.where(T > 0, moved["z"], 0)}


def moving(t: Tracer, chosen: Chosen) -> tuple[FarPath, Standing]:
    """Those of the shifts' base paths that reconnect somewhere, and where they stand before."""
    tree = trace(t, chosen.u[:, chosen.path], chosen.pixel[chosen.path])
    x = far_record(t, tree, (chosen.k, chosen.nee), leaf_value(tree, chosen.k, chosen.nee))
    one = np.ones(len(x.k))
    still = TwoRays(t).standing(Reservoirs(x, one, one), chosen.pixel[chosen.path])
    return take(x, still.columns), still


def turned(t: Tracer, x: FarPath, at: Place) -> Array:
    """The direction from x_(c-1) that its lobe samples with a number TURN further, (d, N)."""
    number = np.stack([_number_into(t, x, row) for row in range(t.scene.space.d - 1)])
    number[0] = (number[0] + TURN) % 1
    local = mat.sample_lobe(t.scene.materials, t.scene.space, at.v, x.lobe_in, number)
    return t.scene.space.to_world(at.v.n, local)


def _number_into(t: Tracer, x: Path, row: int) -> Array:
    """One of the numbers of the direction from x_(c-1) to x_c, (N,)."""
    every = np.stack([t.direction_numbers(x.u, i)[row] for i in range(1, t.depth + 1)])
    return np.array(entry(every, x.c - 2))


def numbers(found: Mapping[str, Any], where: str = "") -> dict[str, Array]:
    """All arrays of nested terms by their dotted names."""
    flat: dict[str, Array] = {}
    for name, value in found.items():
        if isinstance(value, Mapping):
            flat |= numbers(value, f"{where}{name}.")
        elif not isinstance(value, str):
            flat[f"{where}{name}"] = np.asarray(value)
    return flat


def first_points(t: Tracer, pixel: Array) -> Array:
    """x_0 of every column, (d, N)."""
    return np.asarray(t.sensor.ray(pixel, np.zeros((0, len(pixel))))[0])

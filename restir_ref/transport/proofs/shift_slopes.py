"""Jacobians of a shift against finite differences of primary samples: the check that only J itself can pass.

A mistake that J J^-1 = 1 hides, such as a clamp both ways, shows where J is extreme, and few paths are.  So half of
the paths are taken evenly from strata of log J, the extremes first.
"""

from dataclasses import replace

import numpy as np

from restir_ref.batch import Array, take
from restir_ref.transport.proofs.inversion import traced
from restir_ref.transport.proofs.shift_checks import (
    DERIVATIVES,
    POSITIONS,
    Case,
    Finding,
    Trial,
    finding,
    relative,
    too_few,
    undecided,
)

STRATA, EXTREMES = 10, 3
"""Strata of log J, and how many of the smallest and of the largest J are always among the paths."""


def finite_differences(case: Case) -> Finding:
    """J = |det du^y / du^x|; where the differences of two steps disagree nothing is decided."""
    if needs := too_few(case, len(case.good.J)):
        return undecided(needs)
    at = take(case.good, spread(case.good, case.effort.jacobians))
    coarse, fine = (stretch(case, at, h) for h in (2 * case.effort.step, case.effort.step))
    decided = np.flatnonzero(np.abs(fine - coarse) <= DERIVATIVES * np.abs(fine))
    if 2 * len(decided) < len(fine):
        return undecided(_unsteady(case, len(decided), len(fine)), f"no J tested; {_range(case.good.J)}")
    at, measured = take(at, decided), ((4 * fine - coarse) / 3)[decided]
    found = finding(case, at, [relative("J", at.J, measured, DERIVATIVES)])
    return replace(found, where=f"J tested from {at.J.min():.3g} to {at.J.max():.3g}; {_range(case.good.J)}")


def _unsteady(case: Case, decided: int, measured: int) -> str:
    """What it takes where differences depend on their step."""
    step = case.effort.step
    return (
        f"differences with steps of {2 * step:g} and {step:g} agree in {decided} of {measured} paths, half of them are "
        f"needed: another step, such as Effort(step={step / 10:g})"
    )


def _range(J: Array) -> str:
    repeated = [
        f", {end:.3g} in {times} of them: a limit?" for end in (J.min(), J.max()) if (times := _times(J, end)) > 1
    ]
    said = f"{len(J)} paths have it from {J.min():.3g} to {J.max():.3g}"
    return f"{said}{''.join(repeated)}; limits beyond show in other scenes only"


def _times(J: Array, end: float) -> int:
    """How often an end of J comes, if it is not 1, which many shifts have everywhere."""
    return int(np.count_nonzero(end == J)) if abs(end - 1) > POSITIONS else 0


def spread(of: Trial, most: int) -> Array:
    """At most so many columns: the extremes of J, then evenly from strata of log J, then evenly from all kinds."""
    order = np.argsort(of.J, kind="stable")
    _, kind = np.unique(np.stack([of.x.k, of.x.nee, of.x.c]), axis=1, return_inverse=True)
    ends = np.concatenate([order[:EXTREMES], order[len(order) - EXTREMES :]])
    columns = np.concatenate([ends, evenly(stratum(of.J), most // 2), evenly(kind, most)])
    _, first = np.unique(columns, return_index=True)
    return np.asarray(columns[np.sort(first)][:most])


def stratum(J: Array) -> Array:
    """The stratum of each J > 0, of STRATA between the smallest and the largest log J; (N,)."""
    z = np.log(J)
    low, high = z.min(initial=np.inf), z.max(initial=-np.inf)
    share = (z - low) / max(high - low, 1e-300)
    return np.asarray(np.minimum(share * STRATA, STRATA - 1).astype(int))


def evenly(kind: Array, most: int) -> Array:
    """At most so many columns, as many of each kind (N,) as there are."""
    order = np.argsort(kind, kind="stable")
    first = np.searchsorted(kind[order], kind[order])
    return np.asarray(order[np.argsort(np.arange(len(order)) - first, kind="stable")][:most])


def stretch(case: Case, at: Trial, h: float) -> Array:
    """|det du^y / du^x| by central differences (N,); NaN where a discrete choice changes within the step."""
    (D, N), t = at.x.u.shape, case.of.tracer
    steps = h * np.stack([np.eye(D), -np.eye(D)])  # sign, number
    u = (at.x.u[:, None, None, :] + np.moveaxis(steps, -1, 0)[..., None]).reshape(D, -1)
    i, j, k, nee, c = (np.tile(each, 2 * D) for each in (at.i, at.j, at.x.k, at.x.nee, at.x.c))
    x = traced(t, np.clip(u, 0, 1 - 2**-53), i, k, nee)
    y, J = case.shift(x, i, j)
    same = np.flatnonzero((J > 0) & (x.c == c) & ((u >= 0) & (u < 1)).all(axis=0))
    u_y = np.full_like(u, np.nan)
    u_y[:, same] = case.u_y(take(x, same), i[same], take(y, same), j[same])
    plus, minus = np.moveaxis(u_y.reshape(D, 2, D, N), 1, 0)  # number of y, number of x, column
    matrix = np.moveaxis(plus - minus, -1, 0) / (2 * h)
    measured = np.abs(np.linalg.det(np.nan_to_num(matrix)))
    return np.where(np.isnan(matrix).any(axis=(1, 2)), np.nan, measured)

"""Offset paths found again by a tracer that knows nothing of shifts, and Jacobians by finite differences.

The primary sample u^y of an offset path is worked out (`inversion`) and traced from scratch: it must give
the same path, with the same reconnection vertex, contribution and density A.  A path that does not is
tried again nearby, as in `roundtrips`: rounding decides single paths, a mistake decides all around.

Finite differences of u^y over u^x are taken with two steps; where both agree to RESOLVED no discrete
choice and no rounding is in the way, and there J must be their determinant.
"""

from collections.abc import Sequence

import numpy as np

from benchmarks.jobs.job import Done, Job, Params, Row, parts
from benchmarks.jobs.roundtrips import AROUND, EXAMINED, NEAR, REACH, film, lit
from figures.claims.figure import Arrays
from flatland2d.scenes import SCENES
from restir_ref.batch import Array, take
from restir_ref.transport.paths import Path, Tracer
from restir_ref.transport.proofs.inversion import traced
from restir_ref.transport.shifts import shift_path
from tests.transport.paths import Shifts, finite_difference_jacobian, retraced, successful

CHUNKS, TRACED, DIFFERENCED = 20, 5000, 100
"""20 chunks: 1e5 re-traced paths and 2000 finite differences per shift and scene."""
SHIFTS = ("hybrid", "reconnection")
SAME = 1e-7
STEPS, RESOLVED = (1e-6, 2.5e-7), 1e-6


def shifted(t: Tracer, x: Path, i: Array, j: Array) -> Shifts:
    """The successful shifts of base paths x."""
    y, J = shift_path(t, x, j)
    return successful(Shifts(t, x, i, y, j, J))


def unlike(s: Shifts) -> Array:
    """Which offset paths re-tracing does not find: other reconnection index, vertex, F or A; (N,)."""
    _, y = retraced(s)
    off = (np.abs(y.F - s.y.F) > SAME * s.y.F).any(axis=0) | (np.abs(y.A - s.y.A) > SAME * s.y.A)
    return np.asarray(off | (y.c != s.y.c) | ((s.y.c > 0) & (y.prim != s.y.prim)))


def is_logic(s: Shifts, n: int, rng: np.random.Generator) -> bool:
    """Whether the paths around column n fail as well."""
    u = np.clip(s.x.u[:, [n]] + NEAR * rng.standard_normal((len(s.x.u), AROUND)), 0, np.nextafter(1, 0))
    i, j, k, nee = (each[[n]].repeat(AROUND) for each in (s.i, s.j, s.x.k, s.x.nee))
    around = shifted(s.t, traced(s.t, u, i, k, nee), i, j)
    return bool(unlike(around).sum() * 2 >= len(around.J))


def differences(s: Shifts) -> tuple[Array, int]:
    """|J_FD / J - 1| of reconnected paths where finite differences are resolved, and of how many paths."""
    few = np.flatnonzero(s.x.c > 0)[:DIFFERENCED]
    part = Shifts(s.t, take(s.x, few), s.i[few], take(s.y, few), s.j[few], s.J[few])
    (coarse, same), (fine, still) = (finite_difference_jacobian(part, h) for h in STEPS)
    resolved = same & still & (np.abs(coarse - fine) <= RESOLVED * np.abs(fine))
    return np.abs(coarse / part.J - 1)[resolved], len(few)


def compute(params: Params, *, rng: np.random.Generator) -> Arrays:
    """Numbers of re-traced paths, edge cases and failures, and errors of J."""
    setting, t = SCENES[params["scene"]](), film(SCENES[params["scene"]](), params["rule"])
    base = lit(setting, TRACED, rng)
    j = base.i + rng.integers(1, REACH + 1, TRACED) * rng.choice([-1, 1], TRACED)
    s = shifted(t, traced(t, base.u, base.i, base.k, base.nee), base.i, j)
    off = np.flatnonzero(unlike(s))
    logic = sum(is_logic(s, int(n), rng) for n in off[:EXAMINED]) + len(off[EXAMINED:])
    errors, tried = differences(s)
    return {"counts": np.array([len(s.J), len(off) - logic, logic, tried]), "errors": errors}


def chunks(share: float) -> Sequence[Params]:
    """Chunk by chunk, all scenes and shifts in each."""
    each = [{"scene": scene, "rule": rule} for scene in SCENES for rule in SHIFTS]
    return [{**one, "part": part} for part in parts(CHUNKS, share) for one in each]


def judge(done: Done) -> Sequence[Row]:
    """Nothing but edge cases; J to 1e-9 in the median and 1e-5 in the worst resolved case."""
    rows: list[Row] = []
    for scene, rule in dict.fromkeys((params["scene"], params["rule"]) for params, _ in done):
        mine = [arrays for params, arrays in done if (params["scene"], params["rule"]) == (scene, rule)]
        counts = np.sum([arrays["counts"] for arrays in mine], axis=0)
        rows += judged(f"{scene}, {rule}", counts.tolist(), np.concatenate([arrays["errors"] for arrays in mine]))
    return rows


def judged(where: str, counts: Sequence[int], errors: Array) -> list[Row]:
    """One shift on one scene."""
    tested, edge, logic, tried = counts
    resolved = f"{len(errors)} of {tried} resolved"
    enough = len(errors) >= 0.3 * tried
    median, worst = float(np.median(errors)) if len(errors) else np.inf, float(errors.max(initial=0))
    return [
        Row(
            "GRIS-A11, GRIS-A17",
            f"{where}: offset paths that re-tracing does not find",
            logic,
            "0",
            logic == 0,
            tested,
            note=f"edge cases {edge}",
        ),
        Row(
            "GRIS-E53, GRIS-E54",
            f"{where}: J against finite differences, median",
            median,
            "<= 1e-9",
            enough and median <= 1e-9,
            len(errors),
            note=resolved,
        ),
        Row(
            "GRIS-E53, GRIS-E54",
            f"{where}: J against finite differences, worst",
            worst,
            "<= 1e-5",
            enough and worst <= 1e-5,
            len(errors),
            note=resolved,
        ),
    ]


JOB = Job("Offset paths re-traced from scratch, and Jacobians against finite differences", chunks, compute, judge)

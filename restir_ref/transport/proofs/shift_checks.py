"""What one can hold against a shift of paths, path by path.  `judge` runs it all.

A shift is right if it returns, if J is the density with which primary samples are stretched, and if the
tracer, given the primary sample of the offset path, finds that path.  Errors are in units of what is tolerated.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from restir_ref.batch import Array, ratio, take
from restir_ref.chance import Chance
from restir_ref.integrals import Pixels, shifted
from restir_ref.transport.paths import Path, Tracer
from restir_ref.transport.proofs.inversion import traced
from restir_ref.transport.restir_pt import PathIntegrals
from restir_ref.transport.vectors import norm

POSITIONS, DENSITIES, DERIVATIVES = 1e-9, 1e-6, 1e-5
"""Tolerances: of primary numbers, directions, and places in units of the scene; relative, of densities and
contributions, which have peaks; relative, of Jacobians by finite differences."""

NOTHING = 1e-9
"""A shift whose p_hat(y) J / p_hat(x) is below may be defined or not: connections within a plane, whose cosines are
rounding errors."""

Numbers = Callable[[Tracer, Path, Array, Tracer, Path, Array], Array]
"""(tx, x, i, ty, y, j) -> u^y (D, N), the primary sample of y = T(x) for a path x traced in pixels i."""


@dataclass(frozen=True)
class Effort:
    """How many base paths are shifted, how many Jacobians measured, in steps of which size, how far pixels are apart.

    edge_cases is the share of paths that floating point may decide differently there and back: grazing
    occlusion, corners, and lobes chosen by a hair.
    """

    paths: int = 20_000
    jacobians: int = 200
    step: float = 1e-5
    reach: int = 200
    edge_cases: float = 2e-4


@dataclass(frozen=True)
class Trial:
    """Base paths x of pixels i with weights W, offset paths y = T_ij(x) in pixels j, and the way back; a batch."""

    x: Path
    i: Array
    W: Array
    y: Path
    j: Array
    J: Array
    back: Path
    J_back: Array


@dataclass(frozen=True, eq=False)
class Case:
    """Whose shift is judged, by which numbers and chance, and trials in which some light arrived in pixel j."""

    of: PathIntegrals
    effort: Effort
    numbers: Numbers
    chance: Chance
    good: Trial

    def shift(self, x: Path, i: Array, j: Array) -> tuple[Path, Array]:
        """T_ij(x), J."""
        y = shifted(x, Pixels(self.of, i), Pixels(self.of, j))
        return y.x, y.J

    def u_y(self, x: Path, i: Array, y: Path, j: Array) -> Array:
        """u^y (D, N)."""
        return self.numbers(self.of.tracer, x, i, self.of.tracer, y, j)

    def p_hat(self, x: Path) -> Array:
        """The target, (N,)."""
        return self.of.target(np.zeros(len(x.k), dtype=int), x)


def trials(of: PathIntegrals, effort: Effort, chance: Chance) -> Trial:
    """Shift random paths of random pixels, drawn as `initial` draws them, to pixels nearby and back.

    Distances are of all orders of magnitude up to the reach.
    """
    u = chance.uniform((effort.paths,))
    i, j = pairs(of.n, np.floor(min(effort.reach, of.n - 1) ** u).astype(int), chance)
    ((x, W),) = of.candidates(i, chance)
    y = shifted(x, Pixels(of, i), Pixels(of, j))
    back = shifted(y.x, Pixels(of, j), Pixels(of, i))
    return Trial(x, i, W, y.x, j, y.J, back.x, back.J)


def pairs(n: int, distance: Array, chance: Chance) -> tuple[Array, Array]:
    """Pixels i, j (N,) at given distances (N,) below n; which one is i is chance, so that they are exchangeable."""
    u, first = chance.uniform((2, len(distance)))
    low = np.floor(u * (n - distance)).astype(int)
    return np.where(first < 0.5, low, low + distance), np.where(first < 0.5, low + distance, low)


@dataclass(frozen=True)
class Offender:
    """A path that breaks a law, in batches of one column: x of pixel i, y = T(x) in pixel j, and what is wrong."""

    x: Path
    i: Array
    y: Path
    j: Array
    J: Array
    what: str
    found: float
    expected: float


GREEN, RED, OPEN = "green", "RED", "undecided"
"""The answers: the law holds as far as it was tested; it is broken; too little was tested to say either."""

FEWEST = 10
"""Fewer paths acquit nobody."""


@dataclass(frozen=True)
class Finding:
    """How many were tested, broke the law, and may; the worst error in units of what is tolerated, and whose it is.

    where  what else there is to say of those that were tested;  needs  what more it takes to decide, "" if decided
    """

    tested: int
    failed: int
    allowed: float
    worst: float
    offender: Offender | None = None
    where: str = ""
    needs: str = ""

    @property
    def answer(self) -> str:
        """GREEN, RED or OPEN: too many that fail are too many, however few were tested."""
        return RED if self.red else OPEN if self.undecided else GREEN

    @property
    def red(self) -> bool:
        """Too many failed."""
        return self.failed > self.allowed

    @property
    def undecided(self) -> bool:
        """Not red, and something is missing: neither an acquittal nor a conviction."""
        return bool(self.needs) and not self.red


def undecided(needs: str, where: str = "", tested: int = 0) -> Finding:
    """Too few paths, or too noisy; needs  what would decide."""
    return Finding(tested, 0, 0, np.inf, None, where, needs)


# What was found and expected, quantity by quantity.


@dataclass(frozen=True)
class Quantity:
    """Values found and expected, (N,) each; the error is in units of what is tolerated."""

    name: str
    found: Array
    expected: Array
    error: Array


def equal(name: str, found: Array, expected: Array) -> Quantity:
    """Discrete: any difference is too much."""
    return Quantity(name, found, expected, np.where(found == expected, 0.0, np.inf))


def relative(name: str, found: Array, expected: Array, tolerance: float) -> Quantity:
    """|found - expected| over the larger one."""
    error = ratio(np.abs(found - expected), np.maximum(np.abs(found), np.abs(expected)))
    return Quantity(name, found, expected, _known(error) / tolerance)


def apart(name: str, found: Array, expected: Array, where: Array, unit: float = 1.0) -> Quantity:
    """|found - expected| of vectors (K, N) in units of `unit`, looked at `where` (N,) or (K, N)."""
    distance = norm(np.where(where, found - expected, 0.0)) / unit
    return Quantity(name, distance, np.zeros_like(distance), _known(distance) / POSITIONS)


def _known(error: Array) -> Array:
    return np.where(np.isnan(error), np.inf, error)


AT_RECONNECTION = ("prim", "lobe_in", "lobe_out")


def same_path(case: Case, found: Path, expected: Path) -> list[Quantity]:
    """All that two records of one path agree in; numbers count up to the reconnection, where they get stale."""
    t, met = case.of.tracer, expected.c > 0
    row = np.arange(t.D)[:, None] - t.sensor.numbers
    fresh = ~met | (row < 2 * t.scene.space.d * (expected.c - 2))
    return [
        *(equal(each, getattr(found, each), getattr(expected, each)) for each in ("k", "nee", "c")),
        *(equal(each, getattr(found, each) * met, getattr(expected, each) * met) for each in AT_RECONNECTION),
        apart("u before the reconnection", found.u, expected.u, fresh),
        apart("x_c", found.z, expected.z, met, t.scene.extent),
        apart("direction leaving x_c", found.out, expected.out, met & (expected.c <= expected.k)),
        relative("A", found.A, expected.A, DENSITIES),
        relative("p_hat", case.p_hat(found), case.p_hat(expected), DENSITIES),
    ]


def finding(case: Case, at: Trial, quantities: list[Quantity]) -> Finding:
    """Count the columns of `at` in which a quantity is off, and name the worst."""
    error = np.stack([each.error for each in quantities])
    failed, tested = int((error > 1).any(axis=0).sum()), error.shape[1]
    allowed, worst = case.effort.edge_cases * tested, float(error.max(initial=0))
    if not failed:
        return Finding(tested, failed, allowed, worst, needs=too_few(case, tested))
    which, n = divmod(int(error.argmax()), tested)
    what = quantities[which]
    return Finding(tested, failed, allowed, worst, offender(at, n, what.name, what.found[n], what.expected[n]))


def too_few(case: Case, tested: int) -> str:
    """What it takes to test FEWEST paths; "" if so many were."""
    if tested >= FEWEST:
        return ""
    return (
        f"{tested} of the {case.effort.paths} paths that were shifted could be tested, at least {FEWEST} are needed: "
        f"{more_paths(case, 2 * FEWEST / max(tested, 1))}, a brighter scene, or pixels that are closer together"
    )


def more_paths(case: Case, times: float) -> str:
    """The effort that has so many times as many paths, to two digits."""
    paths = float(f"{case.effort.paths * max(times, 2):.1e}")
    return f"Effort(paths={paths:_.0f})"


def offender(at: Trial, n: int, what: str, found: float, expected: float) -> Offender:
    """Column n of trials, and what is wrong with it."""
    one = take(at, np.array([n]))
    return Offender(one.x, one.i, one.y, one.j, one.J, what, float(found), float(expected))


# The checks.


def there_and_back(case: Case) -> Finding:
    """T_ji(T_ij(x)) = x.  [GRIS 7.1]"""
    at = take(case.good, np.flatnonzero(case.good.J_back > 0))
    return finding(case, at, same_path(case, at.back, at.x))


def defined_back(case: Case) -> Finding:
    """T_ji is defined wherever T_ij leads: nothing is refused one way only.  [GRIS 7.1]"""
    defined = case.good.J_back > 0
    return finding(case, case.good, [equal("T_ji is defined", defined, np.ones_like(defined))])


def inverse_jacobians(case: Case) -> Finding:
    """J_ij J_ji = 1."""
    at = take(case.good, np.flatnonzero(case.good.J_back > 0))
    return finding(case, at, [relative("J_ji", at.J_back, 1 / at.J, POSITIONS)])


def traced_from_scratch(case: Case) -> Finding:
    """The tracer, given u^y, finds y."""
    at, (u, y) = case.good, retraced(case)
    inside = apart("u^y outside [0, 1]", u, np.clip(u, 0, 1), np.ones(len(at.J), dtype=bool))
    return finding(case, at, [inside, *same_path(case, y, at.y)])


def retraced(case: Case) -> tuple[Array, Path]:
    """u^y, and the path that the tracer finds there in pixels j."""
    at = case.good
    u = case.u_y(at.x, at.i, at.y, at.j)
    return u, traced(case.of.tracer, u, at.j, at.x.k, at.x.nee)


def shifted_again(case: Case) -> Finding:
    """An offset path is a path: shifted on to a third pixel it becomes what the freshly traced one becomes."""
    at, (_, fresh) = case.good, retraced(case)
    on = np.clip(2 * at.j - at.i, 0, case.of.n - 1)
    (z, J), (z_fresh, J_fresh) = case.shift(at.y, at.j, on), case.shift(fresh, at.j, on)
    something = np.maximum(case.p_hat(z) * J, case.p_hat(z_fresh) * J_fresh) > NOTHING * case.p_hat(at.y)
    both = something & (J > 0) & (J_fresh > 0)
    defined = only(something, [equal("T is defined", J > 0, J_fresh > 0)])
    return finding(case, at, defined + only(both, [*same_path(case, z, z_fresh), relative("J", J, J_fresh, DENSITIES)]))


def only(where: Array, quantities: list[Quantity]) -> list[Quantity]:
    """Errors elsewhere do not count."""
    return [replace(each, error=np.where(where, each.error, 0)) for each in quantities]

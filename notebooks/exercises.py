"""What the readers of the notebooks write themselves, held against the truth.

Every check answers "Right: ..." or "Not yet: ...", with the equation that does not hold yet.  Chance has fixed seeds.
Comparisons are written so that what is no number is not right.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from figures.experiments.rendering import path_tracing
from notebooks import frames, in_space, one_dimension, shift_mappings, unbiased
from restir_ref import Live, Pixels, Reservoirs, Weights, initial, shade
from restir_ref.batch import Array, take
from restir_ref.chance import Chance
from restir_ref.integrals import p_hat_from, shifted
from restir_ref.mis import Mis
from restir_ref.oracle.laws import bias_of
from restir_ref.oracle.scenes import offset
from restir_ref.transport.paths import Path, Tracer
from restir_ref.transport.proofs.judge import Shifting, judge
from restir_ref.transport.proofs.reading import ExtendedPath, extended_path, factors, offset_path
from restir_ref.transport.proofs.shift_checks import Effort
from restir_ref.transport.shifts import shift_path
from toy1d import Line, two_pixels
from tracer3d import SCENES, Pinhole
from tracer3d.motion import motion

SEED = 1
ERRORS = 4
"""Standard errors that a mean may be off."""

FAR = 100
"""Pixels between the two pixels of a shift where J is to be large."""

Function = Callable[[Array], Array]


def right(words: str) -> str:
    """The answer to what holds."""
    return f"Right: {words}"


def not_yet(words: str) -> str:
    """The answer to what does not hold yet."""
    return f"Not yet: {words}"


def columns(found: Any, N: int, what: str) -> tuple[Array, Array]:
    """Two arrays (N,), as a function of the reader returned them; raises ValueError for anything else."""
    shapes = [np.shape(each) for each in found] if isinstance(found, tuple) else [np.shape(found)]
    if shapes != [(N,), (N,)]:
        raise ValueError(f"return {what}, two arrays of shape ({N},), not of shapes {shapes}.")
    return np.asarray(found[0]), np.asarray(found[1])


# ---------------------------------------------------------------- 01: RIS, a pass, a weight

Ris = Callable[[Array, Array, Function, Array], tuple[Array, Array]]


def ris(mine: Ris, M: int = 4, N: int = 40_000) -> str:
    """One of M candidates x of weights W by mine(x, W, p_hat, u) -> (Y, W_Y), for the bump.  [GRIS Eq. 1-2]

    Eq. 2 has to hold exactly, and Eq. 1 in the mean of Y, given the candidates.
    """
    rng, line = np.random.default_rng(SEED), two_pixels()
    x = np.sqrt(0.25 + 2 * rng.random((M, N))) - 0.5  # of density p = .5 + x
    W = 1 / (0.5 + x)

    def p_hat(x: Array) -> Array:
        return line.f(np.array(one_dimension.BUMP), x)

    Y, W_Y = columns(mine(x, W, p_hat, rng.random(N)), N, "Y and W_Y")
    w = p_hat(x) * W / M
    if not (x == Y).any(axis=0).all():
        return not_yet("Y is not always one of the candidates.")
    if not np.allclose(W_Y * p_hat(Y), w.sum(axis=0)):
        return not_yet("W_Y is not the sum of all w_j over p_hat(Y), GRIS 2.")
    expected = (w * x).sum(axis=0) / w.sum(axis=0)
    if abs((Y - expected).mean()) > ERRORS * (Y - expected).std() / np.sqrt(N):
        return not_yet(f"the mean of Y is {Y.mean():.3f}, where GRIS 1 selects {expected.mean():.3f} in the mean.")
    return right("GRIS 1 and 2 hold, and whatever f is integrated, f(Y) W_Y is unbiased.")


Pass = Callable[[Array, Array, Array, Function, Callable[[Array], tuple[Array, Array]], Function], tuple[Array, Array]]


def gris_pass(mine: Pass, N: int = 60_000) -> str:
    """Reuse between two pixels by mine(x, W, u, p_hat, T, p_hat_from) -> (Y, W_Y).  [GRIS Eq. 19, 22]

    Both means have to be right, and both estimates less noisy than the own sample alone.
    """
    rng, line = np.random.default_rng(SEED), one_dimension.stretched()
    here = Pixels(line, np.arange(2 * N))
    near, X = offset(line, here.index, 1), initial(here, Live(rng))

    def T(x: Array) -> tuple[Array, Array]:
        y = shifted(x, near, here)
        return y.x, y.J

    def p_hat(y: Array) -> Array:
        return line.target(here.index, y)

    def proxy(y: Array) -> Array:
        return np.stack([p_hat_from(near, row, here) for row in y]) if y.ndim > 1 else p_hat_from(near, y, here)

    x, W = (np.stack([each, each[near.index]]) for each in (X.x, X.W))
    Y, W_Y = columns(mine(x, W, rng.random(2 * N), p_hat, T, proxy), 2 * N, "Y and W_Y")
    own, found = (_relative(line, each, here) for each in (X, Reservoirs(Y, W_Y, X.c)))
    mean, error = found.mean(axis=0), found.std(axis=0) / np.sqrt(N)
    for pixel in np.flatnonzero(~(abs(mean - 1) <= ERRORS * error)):
        return not_yet(f"the mean of pixel {pixel + 1} is {mean[pixel]:.3f} of the truth, +- {error[pixel]:.3f}.")
    spread = found.std() / own.std()
    if spread > 0.95:
        return not_yet(f"unbiased, but as noisy as the own sample: the spread is {spread:.2f} of that.")
    return right(f"both means are right to {error.max():.3f}, and the spread is {spread:.2f} of the own sample's.")


def _relative(line: Line, X: Reservoirs, here: Pixels) -> Array:
    """Estimates of both pixels over their truth, (N, 2)."""
    truth = [one_dimension.true_integral(line, pixel) for pixel in (0, 1)]
    return np.asarray(shade(X, here)[0].reshape(-1, 2) / truth)


def weight(mine: Mis) -> str:
    """Whether weights sum to 1 wherever some of the seven pixels can make y, and none is negative.  [GRIS Eq. 20]"""
    found = one_dimension.shares_of(Weights(mine))
    if not found["c"].min() >= 0:
        return not_yet(f"a weight is {found['c'].min():.3g}.")
    sums = found["c"].sum(axis=0)
    worst = int(abs(sums - 1).argmax())
    if abs(sums[worst] - 1) > 1e-9:
        return not_yet(f"at y = {found['y'][worst]:.2f} the weights of those who can make it sum to {sums[worst]:.3f}.")
    return right("the weights of those who can make y sum to 1, everywhere.")


# ---------------------------------------------------------------- 02: all outcomes

Estimator = Callable[[Array, Chance], tuple[Array, Array]]


def all_outcomes(mine: Estimator) -> str:
    """Definition 4.1 in every cell of the pixel with three, over all outcomes of mine(index, chance) -> (Y, W_Y)."""
    frame = unbiased.one_pixel()

    def program(index: Array, chance: Chance) -> Reservoirs:
        Y, W_Y = columns(mine(index, chance), len(index), "the cells Y and W_Y")
        return Reservoirs(Y, W_Y, np.ones(len(index)))

    bias = bias_of(program, frame.cells.v, frame.cells.p_hat > 0)[0]
    worst = int(abs(bias).argmax())
    if not abs(bias[worst]) <= unbiased.ROUNDING:
        return not_yet(f"the mean of W_Y in cell {worst + 1} is off by {bias[worst]:+.1%}, exactly.")
    return right("unbiased in every cell, and that is no estimate.")


# ---------------------------------------------------------------- 04: a Jacobian, a shift


@dataclass(frozen=True, eq=False)
class Joint:
    """What a path has where it reconnects, (N,) each.

    p       density of the direction from vertex c - 1 to vertex c
    cos, r  cosine with which it arrives at vertex c, and the distance
    p_out   density of the direction that leaves vertex c; 1 where none was sampled
    """

    p: Array
    cos: Array
    r: Array
    p_out: Array


def jacobian(mine: Callable[[Joint, Joint], Array]) -> str:
    """Whether mine(x, y) is the J of reconnections in a glossy room, path by path.  [GRIS Eq. 52, 54]"""
    t, path, pixel = shift_mappings.lit_paths("glossy_cornell", "reconnection")
    path, pixel = take((path, pixel), np.flatnonzero(path.c > 0))
    there = pixel + shift_mappings.NEAR
    _, J = shift_path(t, path, there)
    x = extended_path(t, path.u, pixel, path.k, path.nee)
    y = offset_path(t, x, path.c, there)
    found = np.asarray(mine(_joint(t, x, path.c), _joint(t, y, path.c)))
    wrong = ~(abs(found[J > 0] / J[J > 0] - 1) <= 1e-6)
    if wrong.any():
        return not_yet(f"J differs from that of the shift in {wrong.sum()} of {len(wrong)} paths.")
    return right(f"that is J, in all {len(wrong)} paths.")


def _joint(t: Tracer, x: ExtendedPath, c: Array) -> Joint:
    """The factors at c of paths that reconnect."""
    found, n = factors(t, x), np.arange(len(c))
    sampled = (x.k > c) | ((x.k == c) & ~x.nee)
    return Joint(found.p[c - 1, n], found.cos[c, n], found.r[c, n], np.where(sampled, found.p[c, n], 1))


PathShift = Callable[[Tracer, Path, Array], tuple[Path, Array]]


def careful_shift(mine: PathShift, most: float = 2.0) -> str:
    """Whether mine(t, x, pixel) -> (y, J) never has a larger J, and still is a shift by all laws of shifts."""
    t, x, pixel = shift_mappings.lit_paths("glossy_cornell", "hybrid")
    _, J = mine(t, x, pixel + FAR)
    if not J.max() <= most:
        return not_yet(f"there is a J of {J.max():.3g}.")
    found = judge(Shifting(t, mine), Live(np.random.default_rng(SEED)), Effort(paths=4000, jacobians=40))
    if found.red:
        return not_yet(f"J is never above {most:g}, but this is no shift; laws that fail: {', '.join(found.red)}.")
    if found.undecided:
        return not_yet(f"J is never above {most:g}, but too few paths are left for: {', '.join(found.undecided)}.")
    refused = (J == 0).mean() - (shift_path(t, x, pixel + FAR)[1] == 0).mean()
    return right(
        f"{len(found.findings)} laws hold. Of the paths shifted by {FAR} pixels, {refused:.0%} are now refused."
    )


# ---------------------------------------------------------------- 05: frames

OneFrame = Callable[[Pixels, "Reservoirs | None", "list[Pixels]", Chance], Reservoirs]


def film(mine: OneFrame, T: int = 8) -> str:
    """Confidence and error of the last of T frames by mine(here, history, before, chance), camera still, in `ajar`."""
    of, chance = frames.images("ajar", "still")[0], Live(np.random.default_rng(SEED))
    index = np.arange(frames.REPLICAS * of.n)
    here, X = Pixels(of, index), None
    for _ in range(T):
        X = mine(here, X, [here], chance)
    assert X is not None
    c, expected = X.c.mean(), 4 * (1 + min(20.0, 4.0 ** (T - 1)))
    paths = path_tracing(1)(of, index, chance).std()
    error = shade(X, here)[0].std() / paths
    if not np.allclose(X.c, expected):
        return not_yet(
            f"after {T} frames confidence is {c:g}, not {expected:g}; the error is {error:.2f} of one tree's."
        )
    return right(f"confidence {c:g}; the error is {error:.2f} of that of one path tree.")


# ---------------------------------------------------------------- 06: motion vectors

Places = Callable[[Array, Pinhole], Array]


def motion_vector(mine: Places, steps: int = 4) -> str:
    """Whether mine(x, before) says for points x (3, n) which pixel (n,) of the crop of camera `before` showed them."""
    setting = SCENES["cornell"]()
    now, before = (in_space.inset(setting.at(k)) for k in (0, -steps))
    m = motion(setting.scene, now, before)
    found = np.asarray(mine(m.x, before))
    if found.shape != (now.n,):
        raise ValueError(f"return a pixel for each of the {now.n} points, not an array of shape {found.shape}.")
    wrong = ~(found == m.source)
    if wrong.any():
        return not_yet(f"{wrong.sum()} of {now.n} points were in another pixel, or the nearest one of the crop is.")
    return right(f"those are the motion vectors; of {m.seen.mean():.0%} of the points the history is their own.")


Parts = Callable[[Array], tuple[Array, Array, Array]]


def positivized(mine: Parts, count: int = 1000) -> str:
    """Whether mine(d) says of differences d (3, n) the targets of two reservoirs (n,), and the share of the first."""
    d = np.random.default_rng(SEED).uniform(-1, 1, (3, count))
    d[2, : count // 4] = -(d[0] + d[1])[: count // 4]  # whose mean is 0
    d[:, -1] = 0
    up, down, share = (np.asarray(each) for each in mine(d))
    if any(each.shape != (count,) for each in (up, down, share)):
        raise ValueError(f"return three arrays of shape ({count},), one number for each difference.")
    if not (np.all(up >= 0) and np.all(down >= 0)):
        return not_yet("a target must not be negative, nor NaN.")
    needed = (abs(d) > ROUNDING).any(axis=0)
    lost = needed & ~((share * (up > 0) + (1 - share) * (down > 0)) > 1 - ROUNDING)
    if lost.any():
        return not_yet(
            f"{lost.sum()} of {count} differences are lost: their part has a target of 0 where it is needed."
        )
    return right("every difference is sampled whole, by one reservoir or by both.")


ROUNDING = 1e-12


# ---------------------------------------------------------------- 08: one mutation

Step = Callable[[Array, Array, Array, Array], tuple[Array, Array]]


def mutation(mine: Step, K: int = 6) -> str:
    """Whether mine(p_hat, p_hat_new, T, W) -> (a, W') keeps p_hat on K cells and W unbiased.  [MCMC 3.2]

    T is T(x' -> x) / T(x -> x') of proposals that are not symmetric.
    """
    rng = np.random.default_rng(SEED)
    p, T = 0.1 + rng.random(K), rng.random((K, K))
    x, y = (each.reshape(-1) for each in np.indices((K, K)))
    a, W = columns(mine(p[x], p[y], T[y, x] / T[x, y], np.full(K * K, 2.0)), K * K, "a and W'")
    flow = p[x] * T[x, y] * np.where((a >= 0) & (a <= 1), a, np.nan)
    back = flow.reshape(K, K).T.reshape(-1)
    off = np.abs(flow - back)[x != y].max()
    if not off < 1e-12:
        return not_yet("what goes from x to x' does not come back: p_hat(x) T(x -> x') a(x -> x') must be symmetric.")
    if not a.max() > 0:
        return not_yet("nothing is ever accepted.")
    if not np.allclose(p[y] * W, 2 * p[x], rtol=1e-12):
        return not_yet("p_hat(x') W' is not p_hat(x) W, so that E[f(X') W'] is no longer the integral of f.")
    return right("p_hat is kept, and so is what the pixel itself shows.")


# ---------------------------------------------------------------- 09: what a probe sees

Visibility = Callable[[Array, Array, Array], Array]


def visibility(mine: Visibility, N: int = 400) -> str:
    """Whether mine(v, r1, r2) is the most that two moments allow for P(r >= v), for distances of any law.

    Chebyshev's one-sided bound: var / (var + (v - r1)^2) beyond the mean, which two distances reach.
    """
    rng = np.random.default_rng(SEED)
    near, step, share = rng.random((3, N)) * np.array([[1.0], [1.0], [0.8]]) + np.array([[0.1], [0.1], [0.1]])
    far = near + step
    r1, r2 = share * near + (1 - share) * far, share * near**2 + (1 - share) * far**2
    found = np.asarray(mine(far, r1, r2), dtype=float)
    if found.shape != (N,):
        raise ValueError(f"return visibilities, an array of shape ({N},), not of shape {found.shape}.")
    if not (found >= 1 - share - 1e-9).all():
        return not_yet("a probe sees as far as v in more directions than you say: light would be lost.")
    if not (found <= 1 - share + 1e-9).all():
        return not_yet("two moments allow no more than var / (var + (v - r1)^2) beyond the mean: light leaks.")
    if not (np.asarray(mine(near, r1, r2)) == 1).all():
        return not_yet("what is nearer than the mean distance may be seen for certain.")
    return right("no law of distances with these moments sees farther.")


CHECKS: Mapping[str, Callable[[Any], str]] = {
    check.__name__: check
    for check in (
        ris,
        gris_pass,
        weight,
        all_outcomes,
        jacobian,
        careful_shift,
        film,
        motion_vector,
        positivized,
        mutation,
        visibility,
    )
}
"""All checks by name."""

"""Single passes of a loop with chosen inputs, and its shifts cell by cell: what checks from inside look at."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from restir_ref.batch import Array, ratio, take, total
from restir_ref.chance import Chance
from restir_ref.integrals import Pixels, Reservoirs, target
from restir_ref.mis import Weights
from restir_ref.oracle.cells import Frame
from restir_ref.oracle.enumeration import outcomes
from restir_ref.oracle.scenes import Parts, Scene, offset
from restir_ref.resampling import Input, weigh
from restir_ref.restir import capped

OTHERS = 2.0
"""Confidence of all inputs but the canonical one, which has 1."""


@dataclass(frozen=True, eq=False)
class Stage:
    """A pass that brings samples from the pixels `reach(i)` of `near` to pixel i of `here`."""

    here: Frame
    near: Frame
    mis: Weights
    cap: float
    reach: Callable[[int], Sequence[int]]
    ask: Callable[[Array, Reservoirs, Chance], Sequence[Pixels]]
    merge: Callable[[Reservoirs, Pixels, Reservoirs, Sequence[Pixels], Chance], Reservoirs]


def stages(parts: Parts, scene: Scene) -> list[Stage]:
    """The spatial pass of the current frame, and the temporal one if there is a previous frame."""
    here, near = scene.made_of(parts.here).now, scene.made_of(parts.near)
    return [across(parts, here, near.now), *(along(parts, here, past) for past in near.frames[:-1])]


def across(parts: Parts, here: Frame, near: Frame) -> Stage:
    """The spatial pass."""
    return Stage(
        here,
        near,
        parts.across,
        np.inf,
        reach=lambda i: [j for j in range(near.n) if j != i],
        ask=lambda index, X, chance: parts.neighbours(near, index, X, chance),
        merge=lambda X, at, Y, sources, chance: parts.spatial(X, at, sources, chance, mis=parts.across),
    )


def along(parts: Parts, here: Frame, past: Frame) -> Stage:
    """The temporal pass; pixels move by one."""
    return Stage(
        here,
        past,
        parts.along,
        parts.cap,
        reach=lambda i: [(i + 1) % past.n],
        ask=lambda index, X, chance: [offset(past, index, 1)],
        merge=lambda X, at, Y, sources, chance: parts.temporal(
            X, at, Y, sources, chance, mis=parts.along, cap=parts.cap
        ),
    )


@dataclass(frozen=True)
class Offer:
    """What the pass of pixel i is given: the cell and weight of its own sample, and the others (n,)."""

    i: int
    x: int
    W: float
    Y: Reservoirs


def own(stage: Stage, i: int, x: int, W: float) -> Offer:
    """A sample in the pixel itself, null samples elsewhere."""
    n = stage.near.n
    return Offer(i, x, W, Reservoirs(np.zeros(n, dtype=int), np.zeros(n), np.full(n, OTHERS)))


def and_other(offer: Offer, j: int, x: int, W: float) -> Offer:
    """The same offer with a sample in pixel j of `near`."""
    Y, at_j = offer.Y, np.arange(len(offer.Y.x)) == j
    return replace(offer, Y=replace(Y, x=np.where(at_j, x, Y.x), W=np.where(at_j, W, Y.W)))


@dataclass(frozen=True)
class Outcomes:
    """Outcomes of passes: Z of pixel i, the others' share of sum_j w_j by Eq. 19, probability p, offer number k."""

    Z: Reservoirs
    share: Array
    p: Array
    k: Array


def tried(stage: Stage, offers: Sequence[Offer]) -> Outcomes:
    """The pass with every offer.  Which one is a choice, too: so all of them run in one enumeration."""
    n = stage.here.n
    i, x, W = (np.array([getattr(each, name) for each in offers]) for name in ("i", "x", "W"))
    Y_x, Y_W = (np.stack([getattr(each.Y, name) for each in offers]) for name in ("x", "W"))

    def program(index: Array, chance: Chance) -> tuple[Reservoirs, Array, Array]:
        pixel = index % n
        k = chance.choose((np.arange(len(offers)) == 0)[:, None] | (pixel == 0)).reshape(-1, n)[:, 0].repeat(n)
        here, mine = Pixels(stage.here, index), pixel == i[k]
        Y = Reservoirs(Y_x[k, pixel], Y_W[k, pixel], np.full(len(index), OTHERS))
        X = Reservoirs(np.where(mine, x[k], Y.x), np.where(mine, W[k], Y.W), np.where(mine, 1.0, Y.c))
        sources = stage.ask(index, X, chance)
        others = [Input(capped(take(Y, each.index), stage.cap), each) for each in sources]
        w = [each.p_hat * each.mW for each in weigh([Input(X, here), *others], here, stage.mis)]
        return stage.merge(X, here, Y, sources, chance), ratio(total(w[1:]), total(w)), k

    (outcome,) = outcomes(program, n)
    Z, share, k = outcome.result
    lanes = np.arange(len(outcome.probability)) * n + i[k[::n]]
    return Outcomes(take(Z, lanes), share[lanes], outcome.probability * len(offers), k[lanes])


def p_hat_of(frame: Frame, i: int) -> Array:
    """p_hat of all cells of a pixel, (K,)."""
    K = frame.cells.v.shape[-1]
    return target(Pixels(frame, np.full(K, i)), np.arange(K))


def lit(frame: Frame, pixels: Sequence[int]) -> Iterator[tuple[int, int, float]]:
    """Pixel, cell and target wherever the target is positive."""
    for i in pixels:
        p_hat = p_hat_of(frame, i)
        yield from ((i, int(x), float(p_hat[x])) for x in np.flatnonzero(p_hat))


def moved(source: Frame, j: int, to: Frame, i: int) -> tuple[Array, Array]:
    """T(x) and J of all cells of pixel j of one frame, into pixel i of another; (K,) each."""
    K = source.cells.v.shape[-1]
    y = source.shift(np.arange(K), np.full(K, j), Pixels(to, np.full(K, i)))
    return y.x, y.J


def pairs(stage: Stage) -> Iterator[tuple[int, int]]:
    """Pixels i of `here` with the pixels j of `near` that they reuse from."""
    yield from ((i, j) for i in range(stage.here.n) for j in stage.reach(i))


# ---------------------------------------------------------------- weights


def partition(stage: Stage) -> Array:
    """sum_i m_i(y) for all y: W_Y if everybody who can make y offers it with W_i = 1 / J_i.  [GRIS Eq. 20]"""
    offers = []
    for i, y, _ in lit(stage.here, range(stage.here.n)):
        offer = own(stage, i, y, 1.0)
        for j in stage.reach(i):
            x, J = moved(stage.near, j, stage.here, i)
            for k in np.flatnonzero((J > 0) & (x == y) & (p_hat_of(stage.near, j) > 0)):
                offer = and_other(offer, j, int(k), 1 / J[k])
        offers.append(offer)
    return tried(stage, offers).Z.W


def bounds(stage: Stage) -> Array:
    """w_i C_R / (c_i C_i) of every input alone, with W_i = 1 / p_hat_i(X_i) so that C_i = 1.  [GRIS Eq. 39]"""
    mine = [own(stage, i, x, 1 / p) for i, x, p in lit(stage.here, range(stage.here.n))]
    others = [
        and_other(own(stage, i, 0, 0.0), j, x, 1 / p) for i, j in pairs(stage) for _, x, p in lit(stage.near, [j])
    ]
    found = tried(stage, mine + others)
    i = np.array([offer.i for offer in mine + others])[found.k]
    p_hat = np.stack([p_hat_of(stage.here, pixel) for pixel in range(stage.here.n)])
    c = np.where(found.k < len(mine), 1.0, min(OTHERS, stage.cap))
    return np.asarray(p_hat[i, found.Z.x] * found.Z.W / c)


def frequencies(stage: Stage) -> Array:
    """P(Y is the other's) - w_other / sum w for all pairs of samples that differ after the shift."""
    offers, made = [], []
    for i, j in pairs(stage):
        y, _ = moved(stage.near, j, stage.here, i)
        for (_, a, _), (_, b, _) in product(lit(stage.here, [i]), lit(stage.near, [j])):
            if y[b] != a:
                offers.append(and_other(own(stage, i, a, 1.0), j, b, 1.0))
                made.append(y[b])
    if not offers:
        return np.zeros(1)
    found = tried(stage, offers)
    chosen = (found.Z.x == np.array(made)[found.k]) & (found.Z.W > 0)
    return np.bincount(found.k, found.p * (chosen - found.share))


# ---------------------------------------------------------------- shifts


def round_trips(stage: Stage) -> Array:
    """J J' of all ways forth and back, and back and forth; 0 where the way does not return.  [GRIS Def. 4.2]"""
    found = []
    for i, j in pairs(stage):
        ways = (stage.near, j), (stage.here, i)
        for (a, p), (b, q) in (ways, ways[::-1]):
            (y, J), (back, J_back) = moved(a, p, b, q), moved(b, q, a, p)
            found.append(np.where(back[y] == np.arange(len(y)), J * J_back[y], 0)[J > 0])
    return np.concatenate(found)


def slopes(stage: Stage) -> Array:
    """J over the ratio of volumes, for all ways forth and back.  [GRIS Eq. 7]"""
    found = []
    for i, j in pairs(stage):
        ways = (stage.near, j), (stage.here, i)
        for (a, p), (b, q) in (ways, ways[::-1]):
            y, J = moved(a, p, b, q)
            v_x, v_y = volumes(a, p), volumes(b, q)
            found.append((J * v_x / v_y[y])[J > 0])
    return np.concatenate(found)


def volumes(frame: Frame, i: int) -> Array:
    """Volumes of all cells of a pixel, (K,)."""
    return np.asarray(frame.cells.v[int(frame.ids(np.array(i)))])

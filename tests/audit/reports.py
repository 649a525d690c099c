"""Bug reports as estimators: how renderers really go wrong, each with the words that its answer must begin with.

`needs` are changes after which no bias may be left, `stays` those after which some must be.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from restir_ref.batch import Array, ratio
from restir_ref.integrals import Pixels, Reservoirs
from restir_ref.oracle.cells import Frame, cells
from restir_ref.oracle.scenes import (
    Scene,
    normalised,
    paired,
    reference_scene,
    three_pixel_scene,
    two_technique_scene,
)
from restir_ref.oracle.seeds import Seeds
from restir_ref.restir import initial, spatial

Estimator = Callable[[Array, Any], Reservoirs]

TWO, THREE, TECHNIQUES = reference_scene(), three_pixel_scene(), two_technique_scene()


@dataclass(frozen=True)
class Report:
    """A scene, an estimator, and how the first advice begins; whose samples enter, and what the bias needs."""

    scene: Scene
    estimator: Estimator
    look_first: str
    needs: Sequence[str] = ()
    stays: Sequence[str] = ()


def at(table: Sequence[Array], s: Array) -> Array:
    """Row s[n] of every column."""
    return np.take_along_axis(np.stack(table), s[None], axis=0)[0]


def selected(x: Sequence[Array], w: Sequence[Array], p: Sequence[Array], chance: Any, c: Any = 1.0) -> Reservoirs:
    """x_s with sum w / p_hat_s."""
    s = chance.choose(np.stack(w))
    return Reservoirs(at(x, s), ratio(sum(w), at(p, s)), c * np.ones(len(s)))


def neighbour(F: Frame, index: Array, by: int) -> Pixels:
    return Pixels(F, index - index % F.n + (index + by) % F.n)


# ---------------------------------------------------------------- merging


def below_the_horizon(index: Array, chance: Any) -> Reservoirs:
    """Neighbours whose sample is black here are left out with `continue`, and 1/M counts the others."""
    F = THREE.now
    here = Pixels(F, index)
    X = initial(here, chance)
    x, w, p, M = [X.x], [F.target(index, X.x) * X.W], [F.target(index, X.x)], np.ones(len(index))
    for by in (1, 2):
        near = neighbour(F, index, by)
        y = F.shift(X.x[near.index], near.index, here)
        p_hat = F.target(index, y.x) * (y.J > 0)
        x.append(y.x), p.append(p_hat), w.append(p_hat * X.W[near.index] * y.J)
        M = M + (p_hat > 0)
    return selected(x, [each / M for each in w], p, chance, M)


def unlit_candidates_weigh_nothing(index: Array, chance: Any) -> Reservoirs:
    """A new reservoir is given confidence 1 only if it has found light; history and balance weights otherwise right."""
    before, now = TWO.frames
    there, here = Pixels(before, index), Pixels(now, index)
    old, new = initial(there, chance), initial(here, chance)
    c_old, c_new = 1.0 * (old.W > 0), 1.0 * (new.W > 0)
    y, back = before.shift(old.x, index, here), now.shift(new.x, index, there)
    own, other = now.target(index, new.x), now.target(index, y.x) * (y.J > 0)
    q_own = before.target(index, back.x) * back.J
    q_other = ratio(before.target(index, old.x), y.J)
    w = [
        ratio(c_new * own, c_new * own + c_old * q_own) * own * new.W,
        ratio(c_old * q_other, c_new * other + c_old * q_other) * other * old.W * y.J,
    ]
    return selected([new.x, y.x], w, [own, other], chance, c_old + c_new)


NEIGHBOURS = {0: (1, 2), 1: (), 2: (0,)}


def pairwise(k: Callable[[int], int], taps: Callable[[int], Sequence[int]], base: float) -> Estimator:
    """Pairwise weights made for k(pixel) neighbours, merged with taps(pixel); the canonical one grows from `base`."""

    def reuse(index: Array, chance: Any) -> Reservoirs:
        F = THREE.now
        here, pixel = Pixels(F, index), index % 3
        X = initial(here, chance)
        count = np.array([k(i) for i in range(3)])[pixel]
        p0, m0 = F.target(index, X.x), np.full(len(index), base)
        x, w, p = [X.x], [np.zeros(len(index))], [p0]
        for other in range(3):
            near = neighbour(F, index - pixel, other)
            merged = np.array([other in taps(i) for i in range(3)])[pixel]
            y, back = F.shift(X.x[near.index], near.index, here), F.shift(X.x, index, near)
            p_hat, q = F.target(index, y.x) * (y.J > 0), ratio(F.target(near.index, X.x[near.index]), y.J)
            share = ratio(p0, p0 + count * F.target(near.index, back.x) * back.J)
            m0 = m0 + np.where(merged, share, 0)
            m = ratio(count, count + base) * ratio(q, p_hat + count * q)
            x.append(y.x), p.append(p_hat), w.append(np.where(merged, m * p_hat * X.W[near.index] * y.J, 0))
        w[0] = ratio(m0, count + base) * p0 * X.W
        return selected(x, w, p, chance)

    return reuse


def neighbours_answer(index: Array, chance: Any) -> Reservoirs:
    """Checkerboard: odd pixels take the even pixel's light sample, shadow ray and all."""
    F = SHADOWS.now
    even = index - index % 2
    i = F.ids(even)
    x = chance.choose((F.cells.pdf[0, i] * F.cells.v[i]).T)[even]
    return Reservoirs(x, 3.0 * (F.target(even, x) > 0), np.ones(len(index)))


def shadows() -> Scene:
    """Two pixels of equal sample spaces that see different lights."""
    v, unshadowed, visible = np.ones((2, 3)), [[2.0, 1, 3], [2.5, 1, 2]], [[1, 0, 1], [1, 1, 0]]
    f = np.array(unshadowed) * visible
    return Scene([Frame(cells(v, f, normalised(np.ones((2, 3)), v), paired(2, 3, {(0, 1): (0, 1, 2)})), 2)])


SHADOWS = shadows()


def colliding(index: Array, chance: Any) -> Reservoirs:
    """seed = pixel + pass: the second pass repeats the number that the next pixel had in the first."""
    here, near = Pixels(TWO.now, index), [neighbour(TWO.now, index, 1)]
    dice = Seeds(chance, 2, lambda call, pixel: (pixel + call) % 2)
    X = initial(here, chance)
    for _ in range(2):
        X = spatial(X, here, near, dice)
    return X


def in_steps(index: Array, chance: Any) -> Reservoirs:
    """Selection at a random number of 24 equal steps."""
    F = TWO.now
    u = (chance.choose(np.ones((24, len(index)))) + 0.5) / 24
    drawn = [each for _ in range(2) for each in F.candidates(index, chance)]
    p = [F.target(index, x) for x, _ in drawn]
    w = [p_hat * W / 2 for p_hat, (_, W) in zip(p, drawn, strict=True)]
    s = np.minimum((u * sum(w) >= w[0]).astype(int), 1 * (w[1] > 0))
    return Reservoirs(at([x for x, _ in drawn], s), ratio(sum(w), at(p, s)), np.ones(len(index)))


# ---------------------------------------------------------------- new samples


def densities(F: Frame, index: Array) -> tuple[Array, Array]:
    """Every technique's density and probability of every cell, (T, N, K)."""
    i = F.ids(index)
    return F.cells.pdf[:, i], F.cells.pdf[:, i] * F.cells.v[i]


def techniques(m: Callable[[int, Array, Array], Array], drawn: Sequence[int] = (0, 1)) -> Estimator:
    """One sample per technique with MIS weights m(t, p, x), p (2, N) the densities at x."""

    def direct(index: Array, chance: Any) -> Reservoirs:
        F = TECHNIQUES.now
        pdf, mass = densities(F, index)
        x, w, p = [], [], []
        for t in drawn:
            x.append(chance.choose(mass[t].T))
            at_x = pdf[:, np.arange(len(index)), x[-1]]
            p.append(F.target(index, x[-1]))
            w.append(p[-1] * m(t, at_x, x[-1]) / at_x[t])
        return selected(x, w, p, chance)

    return direct


def balance(t: int, p: Array, x: Array) -> Array:
    return np.asarray(p[t] / p.sum(axis=0))


def one_side_converted(t: int, p: Array, x: Array) -> Array:
    """The second technique's density is converted to the other measure where the first is weighed, and only there."""
    other = p * np.array([np.ones(len(x)), 1 + x])
    return balance(t, other if t == 0 else p, x)


def lamp(t: int, p: Array, x: Array) -> Array:
    """Weighed against a BSDF density that is finite everywhere."""
    return np.asarray(p[0] / (p[0] + np.maximum(p[1], 0.3)))


def streamed(rule: Callable[[Array, Array, Array], Array]) -> Estimator:
    """RIS over three candidates that replaces with probability rule(w, sum with w, first weight)."""

    def ris(index: Array, chance: Any) -> Reservoirs:
        F = TWO.now
        (x, w_sum), *rest = [(x, F.target(index, x) * W / 3) for _ in range(3) for x, W in F.candidates(index, chance)]
        first = w_sum
        for new, w in rest:
            w_sum = w_sum + w
            p = np.clip(rule(w, w_sum, first), 0, 1)
            x = np.where(chance.choose(np.stack([1 - p, p])) == 1, new, x)
        return Reservoirs(x, ratio(w_sum, F.target(index, x)), np.ones(len(index)))

    return ris


def drawn_by(change: Callable[[Array], Array]) -> Estimator:
    """One sample drawn by changed probabilities (K, N), and divided by the unchanged density."""

    def draw(index: Array, chance: Any) -> Reservoirs:
        pdf, mass = densities(TWO.now, index)
        x = chance.choose(change(mass[0].T))
        lit = TWO.now.target(index, x) > 0
        return Reservoirs(x, lit / np.maximum(pdf[0, np.arange(len(x)), x], 1e-3), np.ones(len(x)))

    return draw


def changed(W: Callable[[Array, Array, Array], Array]) -> Estimator:
    """New samples with W' = W(W, cell, a coin)."""

    def traced(index: Array, chance: Any) -> Reservoirs:
        X = initial(Pixels(TWO.now, index), chance)
        coin = chance.choose(np.ones((2, len(index))))
        return Reservoirs(X.x, W(X.W, X.x, coin), X.c)

    return traced


def dim_dropped(index: Array, chance: Any) -> Reservoirs:
    """Two candidates; one whose target is below 0.9 costs no shadow ray, and has the target 0 instead."""
    F = TWO.now
    drawn = [each for _ in range(2) for each in F.candidates(index, chance)]
    p = [F.target(index, x) for x, _ in drawn]
    w = [np.where(p_hat < 0.9, 0, p_hat * W / 2) for p_hat, (_, W) in zip(p, drawn, strict=True)]
    return selected([x for x, _ in drawn], w, p, chance)


def off_by_one(p: Array) -> Array:
    """A search in the table of sums that stops one entry early."""
    return np.roll(p, 1, axis=0)


def last_never(p: Array) -> Array:
    return p * (np.arange(len(p)) < len(p) - 1)[:, None]


REPORTS = {
    "GI is off beside edges with strong normals": Report(
        THREE, below_the_horizon, "the confidence (M)", ["no shifts"], ["all alike", "equal volumes"]
    ),
    "bright where few candidates find light": Report(
        TWO, unlit_candidates_weigh_nothing, "the confidence (M)", ["lit"], ["equal volumes"]
    ),
    "pixels turn black while the camera moves": Report(
        THREE, pairwise(lambda i: len(NEIGHBOURS[i]), NEIGHBOURS.__getitem__, 0.0), "what multiplies the pixel's own"
    ),
    "off by the same factor, more with few taps": Report(
        THREE, pairwise(lambda i: 1, lambda i: [j for j in range(3) if j != i], 1.0), "counts and normalisations"
    ),
    "light leaks next to shadows, on every second pixel": Report(SHADOWS, neighbours_answer, "whose target and vis"),
    "mould that grows with the iterations": Report(TWO, colliding, "the choice, not the weights", ["no shifts"]),
    "a random number in 24 steps": Report(TWO, in_steps, "random numbers in steps"),
    "lamps without area far too dark": Report(TECHNIQUES, techniques(lamp, (0,)), "MIS between techniques"),
    "half of the light is missing": Report(TECHNIQUES, techniques(balance, (0,)), "MIS between techniques"),
    "one density in the other measure": Report(
        TECHNIQUES, techniques(one_side_converted), "MIS between techniques", ["techniques apart"]
    ),
    "the sky twice as bright on rough surfaces": Report(
        TECHNIQUES, techniques(lambda t, p, x: np.ones(len(x))), "MIS between techniques", ["techniques apart"]
    ),
    "always the last light of the list": Report(
        TWO, streamed(lambda w, total, first: np.where(w > 0, 1.0, 0.0)), "the choice, not the weights", ["flat target"]
    ),
    "the first weight is left out of the replacement": Report(
        TWO, streamed(lambda w, total, first: ratio(w, total - first)), "the choice, not the weights", ["flat target"]
    ),
    "the first light too bright, the others too dark": Report(TWO, drawn_by(off_by_one), "how samples are drawn"),
    "a pixel of the environment is never sampled": Report(TWO, drawn_by(last_never), "how samples are drawn"),
    "too dark after the n-th bounce": Report(
        TWO, changed(lambda W, x, coin: np.where((x >= 2) & (coin == 1), 0, W)), "what is done to some samples"
    ),
    "everything a little too dark": Report(TWO, changed(lambda W, x, coin: 0.9 * W), "counts and normalisations"),
    "dim surfaces drift to black": Report(TWO, dim_dropped, "absolute limits", ["bright"]),
    "fireflies are gone, and light with them": Report(
        TWO, changed(lambda W, x, coin: np.minimum(W, 3.0)), "absolute limits", ["small W"]
    ),
}

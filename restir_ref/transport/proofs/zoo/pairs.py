"""Differences of pixels on finite cells, and how they may go wrong; all of it enumerated.  [GPT 3-4]

Three pixels in a row, each darker than the one before, are two pairs; shifts have holes, some cells are dark, and each
pair reuses what the other one has.  What is said of a bias is relative to the difference: -1 is no edge at all.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from restir_ref.batch import Array, ratio
from restir_ref.chance import Chance
from restir_ref.gradient import SIGNS, Paired, Pairs, Part, TossedPairs, gap, one_sided
from restir_ref.gradient_loop import SAME_SIGN, Group, first, in_space, sampled, shaded
from restir_ref.integrals import Image, Pixels, Proxy, Reservoirs, Shifted, held, pdf, shifted, target
from restir_ref.loop import Preset
from restir_ref.mis import WEIGHTS
from restir_ref.oracle.cells import Frame, cells
from restir_ref.oracle.film import RING, film_scene, grey_but_for_hue, light_of
from restir_ref.oracle.laws import expected_sum
from restir_ref.oracle.scenes import Scene, normalised, offset, paired, reference_scene, two_frame_loop
from restir_ref.resampling import Candidate, Input, select, weigh
from restir_ref.restir import initial, shade

ENDS = np.array([[0, 1], [1, 2]])
"""Two pairs of three pixels."""

BOTH = WEIGHTS["defensive"]


def falling() -> Scene:
    """Three pixels of three cells; both differences are positive, so that equal signs meet in reuse."""
    v = [[1.0, 0.5, 2.0], [0.5, 1.0, 1.0], [1.0, 2.0, 0.5]]
    f = np.array([[4.0, 3.0, 1.5], [2.0, 1.0, 0.0], [0.0, 0.25, 0.75]])
    shifts = {(0, 1): (0, 2, -1), (0, 2): (1, -1, 2), (1, 2): (1, -1, 0)}
    tables = cells(np.array(v), f, normalised([[2, 1, 1], [1, 1, 1], [1, 1, 2]], v), paired(3, 3, shifts))
    return Scene([Frame(tables, 3)])


def unequal() -> Scene:
    """Two frames of the scene of two pixels, of which one is three times as bright."""
    tables, bright = reference_scene().now.cells, np.array([[1.0], [3.0], [1.0], [3.0]])
    tables = replace(tables, f=tables.f * bright, p_hat=tables.p_hat * bright)
    return Scene([Frame(tables, 2, t) for t in range(2)])


def means(scene: Scene) -> Array:
    """int f of every pixel of the current frame, (n,)."""
    return np.asarray((scene.now.cells.f * scene.now.cells.v)[scene.now.ids(np.arange(scene.now.n))].sum(axis=-1))


# ---------------------------------------------------------------- reservoirs of pairs

Merge = Callable[[Sequence[Input], Pixels, Chance], Reservoirs]
"""A pass over inputs."""

Sum = Callable[[Array, Array], Array]
"""What is made of the estimates of both parts, which carry their signs."""


def merged(inputs: Sequence[Input], here: Pixels, chance: Chance) -> Reservoirs:
    """[GRIS Eq. 19, 22]."""
    return select(weigh(inputs, here, BOTH), chance, inputs[0].X.c)


def shifted_once_more(inputs: Sequence[Input], here: Pixels, chance: Chance) -> Reservoirs:
    """A mistake: [GPT Eq. 18-20] as printed, W = sum w / p_hat(T* y), with y = T* x shifted already."""
    offered = []
    for each, y in zip(inputs, weigh(inputs, here, BOTH), strict=True):
        again = y.x if each.at is here else here.of.shift(y.x, each.at.index, here).x
        offered.append(Candidate(y.x, y.p_hat, y.mW, ratio(y.p_hat, target(here, again))))
    return select(offered, chance, inputs[0].X.c)


def added(positive: Array, negative: Array) -> Array:
    """w* G of both: the negative part is negative."""
    return positive + negative


def magnitudes_added(positive: Array, negative: Array) -> Array:
    """A mistake: p_hat W of both, added."""
    return positive - negative


def bias_of_pairs(
    kind: type[Pairs] = Pairs, proxy: Proxy = target, merge: Merge = merged, together: Sum = added
) -> Array:
    """Exact relative bias of both pairs' differences, (1, 2), after they have reused each other's samples."""
    scene = falling()

    def of_part(part: Part) -> Array:
        pairs = kind(scene.now, ENDS, part, proxy)

        def estimate(index: Array, chance: Chance) -> Array:
            here, near = Pixels(pairs, index), offset(pairs, index, 1)
            X = initial(here, chance)
            return shade(merge([Input(X, here), Input(held(X, near), near)], here, chance), here)

        return expected_sum(estimate, 2)

    I = means(scene)
    return np.asarray(together(*map(of_part, SIGNS.values())) / (I[ENDS[0]] - I[ENDS[1]]) - 1)


class HalfWeights(Pairs):
    """A mistake: w = 1/2, also where the shift is undefined."""

    def difference(self, index: Array, x: Paired) -> Array:
        """G / 2."""
        base, other = self.end(index, x.k), self.end(index, 1 - x.k)
        return np.where(x.k == 0, 0.5, -0.5) * gap(x.x, base, x.offset, other)


class OneIntegral(Pairs):
    """A mistake: the difference as one integral over pixel i, for a shift that does not reach all of j."""

    def candidates(self, index: Array, chance: Chance) -> Iterator[tuple[Paired, Array]]:
        """Those of i."""
        return self.based(index, np.zeros(len(index), dtype=int), chance)

    def difference(self, index: Array, x: Paired) -> Array:
        """G, with w = 1."""
        return gap(x.x, self.end(index, x.k), x.offset, self.end(index, 1 - x.k))


class Sieved(Pairs):
    """A mistake beside weights of sampling densities: base paths without light are thrown away."""

    def based(self, index: Array, k: Array, chance: Chance) -> Iterator[tuple[Paired, Array]]:
        """Candidates whose base paths carry light."""
        for x, mW in Pairs.based(self, index, k, chance):
            yield x, np.where(target(self.end(index, k), x.x) > 0, mW, 0)


class InnerJacobian(Pairs):
    """A mistake: the offset path's Jacobian multiplied into the outer shift."""

    def shift(self, x: Paired, index: Array, to: Pixels) -> Shifted:
        """J_tau times that of the inner shift."""
        y = Pairs.shift(self, x, index, to)
        return replace(y, J=y.J * np.where(x.offset.J > 0, x.offset.J, 1))


class NotRebuilt(Pairs):
    """A mistake: the offset path of another pair is taken over with the base path."""

    def shift(self, x: Paired, index: Array, to: Pixels) -> Shifted:
        """The base path moves; the offset path, and its J, stay what they were."""
        y = Pairs.shift(self, x, index, to)
        return Shifted(replace(y.x, offset=x.offset), y.J)


class Forgetful(TossedPairs):
    """A mistake: the probability 1/2 of the side is left out of W."""

    def candidates(self, index: Array, chance: Chance) -> Iterator[tuple[Paired, Array]]:
        """Those of one side, as if there were no other."""
        return ((x, mW / 2) for x, mW in TossedPairs.candidates(self, index, chance))


# ---------------------------------------------------------------- gradients after resampling

Estimate = Callable[[Reservoirs, Pixels, Pixels], Array]
"""X, i, j -> an estimate of I_i - I_j, (N,)."""

Side = Callable[[Reservoirs, Pixels, Pixels], Array]
"""The same of one side, (1, N).  [GPT Eq. 11]"""


def side_by_targets(X: Reservoirs, base: Pixels, other: Pixels) -> Array:
    """With weights that compare targets."""
    return one_sided(X, base, other)


def side_by_densities(X: Reservoirs, base: Pixels, other: Pixels) -> Array:
    """With weights that compare sampling densities."""
    return one_sided(X, base, other, pdf)


def side_by_inverse(X: Reservoirs, base: Pixels, other: Pixels) -> Array:
    """With 1/J for J in the weight."""
    y = shifted(X.x, base, other)
    q, there = target(base, X.x), target(other, y.x) * ratio(np.ones(len(y.J)), y.J)
    return ratio(q, q + there) * gap(X.x, base, y, other) * X.W


def nothing(X: Reservoirs, base: Pixels, other: Pixels) -> Array:
    """0."""
    return np.zeros((1, len(X.W)))


def difference_of(own: Side, others: Side) -> Estimate:
    """<Delta'_ij> by the one, minus <Delta'_ji> by the other.  [GPT Eq. 12]"""
    return lambda X, i, j: (own(held(X, i), i, j) - others(held(X, j), j, i))[0]


def bias_of_after(estimate: Estimate) -> Array:
    """Exact relative bias of a difference from own samples after two frames, for both orders of the pixels, (1, 2)."""
    scene = unequal()
    loop = two_frame_loop(scene)

    def program(index: Array, chance: Chance) -> Array:
        return estimate(loop(index, chance), Pixels(scene.now, index), offset(scene.now, index, 1))[None]

    I = means(scene)
    return np.asarray(expected_sum(program, 2) / (I - I[::-1]) - 1)


# ---------------------------------------------------------------- colour


def by_the_mean(sign: int) -> Part:
    """A mistake: a coloured difference belongs to the sign of its mean, so that of mean 0 to none."""

    def one_sign(d: Array) -> Array:
        return np.asarray(np.maximum(sign * d.mean(axis=0), 0))

    return Part(one_sign, lambda d: (one_sign(d) > 0).astype(float))


MEANS_ONLY = {name: by_the_mean(sign) for name, sign in (("positive", 1), ("negative", -1))}


def ring(of: Image, index: Array, count: int, radius: float, chance: Chance) -> Sequence[Pixels]:
    """The next ones."""
    return [offset(of, index, by) for by in range(1, count + 1)]


def bias_of_hues(positive: Part, negative: Part) -> Array:
    """Exact relative bias of differences between pixels that are equally bright, but not of a colour, (3, 2)."""
    frame = grey_but_for_hue(film_scene(0))
    parts = {"positive": Pairs(frame, RING, positive), "negative": Pairs(frame, RING, negative)}
    at = Group(parts, (2,), np.zeros((1, 2)), ring, np.ones(2, dtype=bool))

    def estimate(index: Array, chance: Chance) -> Array:
        X = first(at, index, sampled(frame, chance, 1, len(index) // 2), chance)
        return shaded(at, in_space(at, X, Preset(1, 1, 1, 1, 3.0), SAME_SIGN, chance))

    light = light_of(frame)
    truth = light[:, RING[0]] - light[:, RING[1]]
    return ratio(expected_sum(estimate, 2) - truth, truth)

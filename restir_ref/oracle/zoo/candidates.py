"""Bugs before any reuse: how samples are drawn, counted, weighed and stored.  [GRIS Eq. 1-6; Veach 1997]

They are the most common of all, and reuse spreads them.  Each is another way to draw new samples.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from restir_ref.batch import Array, ratio, where
from restir_ref.chance import Chance
from restir_ref.integrals import Pixels, Reservoirs, target
from restir_ref.mis import Weights
from restir_ref.oracle.cells import Frame
from restir_ref.oracle.scenes import Draw, Parts, one_frame, reference_scene, two_rounds, two_technique_scene
from restir_ref.oracle.seeds import Seeds
from restir_ref.oracle.zoo.bug import Bug
from restir_ref.oracle.zoo.merging import confidence, merging
from restir_ref.oracle.zoo.selection import Labelled, two_candidates
from restir_ref.resampling import Candidate, Input, select, weigh
from restir_ref.restir import initial

FAINT, STRONG = 0.9, 0.5
"""Targets below the first are cut off; the second is what roulette leaves alive."""

# ---------------------------------------------------------------- densities


class Drawing(Frame):
    """A frame that draws by other probabilities than its densities say."""

    def drawn_by(self, p: Array) -> Array:
        """Probabilities (K, N) in place of p (K, N)."""
        return p

    def divided_by(self, p: Array, x: Array) -> Array:
        """What samples are divided by (N,), in place of their density p (N,)."""
        return p

    def candidates(self, index: Array, chance: Chance) -> Iterator[tuple[Array, Array]]:
        """One draw of the first technique, divided by what is taken for its density."""
        i = self.ids(index)
        x = chance.choose(self.drawn_by((self.cells.pdf[0, i] * self.cells.v[i]).T))
        yield x, ratio(np.ones(len(i)), self.divided_by(self.cells.pdf[0, i, x], x))


class OffByOne(Drawing):
    """The search in the table of sums stops one entry early."""

    def drawn_by(self, p: Array) -> Array:
        """Every cell with its neighbour's probability, where both can be drawn."""
        shifted = np.where(np.roll(p, 1, axis=0) > 0, np.roll(p, 1, axis=0), 0)
        return np.asarray(np.where(p > 0, shifted, 0))


class LastNever(Drawing):
    """The last entry of the table is never reached."""

    def drawn_by(self, p: Array) -> Array:
        """All but the last cell."""
        return np.asarray(p * (np.arange(len(p)) < len(p) - 1)[:, None])


class OtherDensity(Drawing):
    """Two functions for one density that disagree: one draws, the other divides."""

    def divided_by(self, p: Array, x: Array) -> Array:
        """A density that was made for something else: larger by half in every second cell."""
        return np.asarray(p * np.where(x % 2 == 1, 1.5, 1.0))


# ---------------------------------------------------------------- techniques


class Shared(Frame):
    """Techniques whose samples are given other MIS weights m(t, p, x), p (T, N) the densities at x."""

    def share(self, t: int, p: Array, x: Array) -> Array:
        """The balance heuristic."""
        return ratio(p[t], p.sum(axis=0))

    def candidates(self, index: Array, chance: Chance) -> Iterator[tuple[Array, Array]]:
        """One draw per technique with m W = m(t) / p_t."""
        i, column = self.ids(index), np.arange(len(index))
        for t, pdf in enumerate(self.cells.pdf[:, i]):
            x = chance.choose((pdf * self.cells.v[i]).T)
            p = self.cells.pdf[:, i, x]
            yield x, np.asarray(self.share(t, p, x)[column] / p[t])


class AddedTwice(Shared):
    """Both techniques are added in full."""

    def share(self, t: int, p: Array, x: Array) -> Array:
        """1."""
        return np.ones(len(x))


class PartnerMissing(Shared):
    """The second technique is weighed, but its samples are not added."""

    def share(self, t: int, p: Array, x: Array) -> Array:
        """The balance heuristic for the first, nothing for the second."""
        return super().share(t, p, x) * (t == 0)


class LampWeighed(Shared):
    """A lamp without area is weighed against a density of directions, which is finite everywhere."""

    def share(self, t: int, p: Array, x: Array) -> Array:
        """p_1 / (p_1 + max(p_2, 0.3)) for the lamp; the rest as it should be."""
        floored = np.maximum(p[1:].sum(axis=0), 0.3)
        return ratio(p[0], p[0] + floored) if t == 0 else super().share(t, p, x)


class OneSideConverted(Shared):
    """One density is converted to the other measure where the first technique is weighed, and only there."""

    def share(self, t: int, p: Array, x: Array) -> Array:
        """The balance heuristic with a density times 1 + x."""
        return ratio(p[0], p[0] + p[1:].sum(axis=0) * (1 + x)) if t == 0 else super().share(t, p, x)


class NeitherConverted(Shared):
    """Densities of two measures are compared as they are, on both sides: the weights still sum to 1."""

    def share(self, t: int, p: Array, x: Array) -> Array:
        """The balance heuristic with a density times 1 + 3 x on both sides."""
        mixed = p * np.where(np.arange(len(p))[:, None] == 0, 1, 1 + 3 * x)
        return ratio(mixed[t], mixed.sum(axis=0))


# ---------------------------------------------------------------- what is done to samples


def changed(W: Callable[[Array, Array, Array], Array]) -> Draw:
    """New samples with W' = W(W, cell, coin) for W."""

    def draw(here: Pixels, chance: Chance) -> Reservoirs:
        X = initial(here, chance)
        coin = chance.choose(np.ones((2, len(here.index))))
        return replace(X, W=W(X.W, X.x, coin))

    return draw


def uncompensated(W: Array, x: Array, coin: Array) -> Array:
    """Paths behind the n-th bounce (the last cells) are killed by a coin, and survivors not divided by 1/2."""
    return np.asarray(np.where((x >= 2) & (coin == 1), 0, W))


def compensated(W: Array, x: Array, coin: Array) -> Array:
    """The same, and survivors divided by 1/2."""
    return np.asarray(np.where(x >= 2, np.where(coin == 1, 0, W / STRONG), W))


def faded(W: Array, x: Array, coin: Array) -> Array:
    """Everything times 0.9, as by a fade-in that was meant for the first frame."""
    return np.asarray(0.9 * W)


def untouched(W: Array, x: Array, coin: Array) -> Array:
    """W."""
    return W


def coarse(W: Array, x: Array, coin: Array) -> Array:
    """W with three binary digits, cut off."""
    mantissa, exponent = np.frexp(W)
    return np.asarray(np.ldexp(np.floor(mantissa * 8) / 8, exponent))


def faint_dropped(here: Pixels, chance: Chance) -> Reservoirs:
    """RIS over two candidates, of which those with a small target are given none."""
    drawn = [each for _ in range(2) for each in here.of.candidates(here.index, chance)]
    offered = [Candidate(x, target(here, x), np.where(target(here, x) < FAINT, 0, W / 2)) for x, W in drawn]
    return select(offered, chance, np.ones(len(here.index), dtype=int))


# ---------------------------------------------------------------- streams


def streamed(kept: Callable[[Array, Array, Array], Array]) -> Draw:
    """RIS over two candidates, the second replacing the first with probability kept(w, sum with w, first w)."""

    def draw(here: Pixels, chance: Chance) -> Reservoirs:
        drawn = [each for _ in range(2) for each in here.of.candidates(here.index, chance)]
        (x, w), (y, new) = [(each, target(here, each) * W / 2) for each, W in drawn]
        p = np.clip(kept(new, w + new, w), 0, 1)
        s = chance.choose(np.stack([1 - p, p]))
        chosen = where(s == 1, y, x)
        return Reservoirs(chosen, ratio(w + new, target(here, chosen)), np.ones(len(here.index), dtype=int))

    return draw


def always(w: Array, upto: Array, first: Array) -> Array:
    """1 wherever the new candidate has any light."""
    return np.asarray(np.where(w > 0, 1.0, 0.0))


def as_it_should(w: Array, upto: Array, first: Array) -> Array:
    """w / sum."""
    return ratio(w, upto)


def without_first(w: Array, upto: Array, first: Array) -> Array:
    """w over the sum without half of the first weight."""
    return ratio(w, upto - first / 2)


def first_group_only(here: Pixels, chance: Chance) -> Reservoirs:
    """Two groups of one candidate each; the chosen group's own W is stored, not that of both."""
    drawn = [each for _ in range(2) for each in here.of.candidates(here.index, chance)]
    offered = [Candidate(Labelled(x, W), target(here, x), W / 2) for x, W in drawn]
    X = select(offered, chance, np.ones(len(here.index), dtype=int))
    return Reservoirs(X.x.x, np.where(X.W > 0, X.x.number / 2, 0), X.c)


def written_on_accept(inputs: Sequence[Input], here: Pixels, mis: Weights, chance: Chance) -> Reservoirs:
    """W_Y is written when a candidate is taken: from the sum so far, which grows on."""
    offered = list(weigh(inputs, here, mis))
    w = [each.p_hat * each.mW for each in offered]
    kept, upto = offered[0], w[0]
    W = ratio(upto, kept.p_hat)
    for new, each in zip(offered[1:], w[1:], strict=True):
        taken = chance.choose(np.stack([upto, each])) == 1
        upto = upto + each
        W = np.where(taken, ratio(upto, new.p_hat), W)
        kept = where(taken, replace(new, c_over_m=None), replace(kept, c_over_m=None))
    return Reservoirs(kept.x, W, confidence(inputs))


# ---------------------------------------------------------------- who is asked


def neighbours_answer(here: Pixels, chance: Chance) -> Reservoirs:
    """Odd pixels take over the even pixel's sample, with its shadow ray's answer."""
    X = initial(here, chance)
    even = here.index - here.index % 2
    return Reservoirs(X.x[even], X.W[even], X.c)


def inert(X: Reservoirs, here: Pixels, neighbours: Sequence[Pixels], chance: Chance, /, *, mis: Weights) -> Reservoirs:
    """Every neighbour is refused."""
    return X


def colliding(chance: Chance) -> Seeds:
    """seed = pixel + pass: the second pass of a pixel repeats the first one of the next pixel."""
    return Seeds(chance, 2, lambda call, pixel: (pixel + call) % 2)


ONE, TWO = Parts(one_frame), Parts(one_frame, draw=two_candidates)

CANDIDATE_BUGS = (
    Bug(
        "sampler one entry off",
        "The search in a table of sums stops one entry early; the density is that of the entry meant.",
        "some lights too bright, others too dark, in the order of a list or along an environment map",
        "[GRIS Eq. 1]",
        reference_scene,
        right=Parts(one_frame, here=Drawing, near=Drawing),
        wrong=Parts(one_frame, here=OffByOne, near=OffByOne),
    ),
    Bug(
        "last entry never drawn",
        "A random number is scaled by n - 1, or cut down to it: the last light, pixel or lobe is never drawn.",
        "dark where only the last light shines, bright beside it",
        "[GRIS Eq. 1]",
        reference_scene,
        right=Parts(one_frame, here=Drawing, near=Drawing),
        wrong=Parts(one_frame, here=LastNever, near=LastNever),
    ),
    Bug(
        "two densities for one sampler",
        "One function draws and another one, copied and changed since, says how likely that was.",
        "dark wherever the second function promises more than the first one draws",
        "[GRIS Eq. 1, 3]",
        reference_scene,
        right=Parts(one_frame, here=Drawing, near=Drawing),
        wrong=Parts(one_frame, here=OtherDensity, near=OtherDensity),
    ),
    Bug(
        "both techniques added in full",
        "Rays that miss add the surroundings, and light sampling adds them once more.",
        "bright to twice where both techniques find the light",
        "[GRIS Eq. 5, 6; Veach 1997]",
        two_technique_scene,
        right=Parts(one_frame, here=Shared, near=Shared),
        wrong=Parts(one_frame, here=AddedTwice, near=AddedTwice),
    ),
    Bug(
        "partner never sampled",
        "The samples of one technique are weighed against another one that was switched off.",
        "dark where the other technique would have found more",
        "[GRIS Eq. 5, 6; Veach 1997]",
        two_technique_scene,
        right=Parts(one_frame, here=Shared, near=Shared),
        wrong=Parts(one_frame, here=PartnerMissing, near=PartnerMissing),
    ),
    Bug(
        "lamp without area weighed against directions",
        "A point or a direction is weighed as if BSDF samples could meet it, by their finite density there.",
        "dark lamps: points, spots, the sun as a direction",
        "[GRIS Eq. 5, 6; Veach 1997]",
        two_technique_scene,
        right=Parts(one_frame, here=Shared, near=Shared),
        wrong=Parts(one_frame, here=LampWeighed, near=LampWeighed),
    ),
    Bug(
        "one density in the other measure",
        "An area density is compared with one of directions, and converted on one side only.",
        "dark where light is close or grazing, as one of two shares is too small",
        "[GRIS Eq. 5, 6; Veach 1997]",
        two_technique_scene,
        right=Parts(one_frame, here=Shared, near=Shared),
        wrong=Parts(one_frame, here=OneSideConverted, near=OneSideConverted),
    ),
    Bug(
        "roulette not compensated",
        "Paths are ended by chance, and those that go on are not divided by their probability to do so.",
        "dark after the n-th bounce, more with every further one",
        "[GRIS Eq. 3]",
        reference_scene,
        right=Parts(one_frame, draw=changed(compensated)),
        wrong=Parts(one_frame, draw=changed(uncompensated)),
    ),
    Bug(
        "small targets cut off",
        "To save shadow rays, candidates below an absolute brightness are dropped.",
        "dark to black on dim surfaces, right where there is much light",
        "[GRIS Eq. 1, 15]",
        reference_scene,
        right=TWO,
        wrong=replace(TWO, draw=faint_dropped),
    ),
    Bug(
        "everything faded",
        "A factor for fading in, or against fireflies, is left on for all samples.",
        "dark by one factor everywhere",
        "[GRIS Eq. 3]",
        reference_scene,
        right=Parts(one_frame, draw=changed(untouched)),
        wrong=Parts(one_frame, draw=changed(faded)),
    ),
    Bug(
        "W stored in too few bits",
        "Contribution weights are packed and cut off instead of rounded.",
        "dark a little nearly everywhere, by another amount per pixel",
        "[GRIS Eq. 22]",
        reference_scene,
        right=Parts(one_frame, draw=changed(untouched)),
        wrong=Parts(one_frame, draw=changed(coarse)),
    ),
    Bug(
        "new candidate always taken",
        "The comparison with the random number is turned round, or missing: the last candidate stays.",
        "bright and dark in the order of a list: the last light is always the one that is picked",
        "[Chao 1982; GRIS 2.1]",
        reference_scene,
        right=replace(TWO, draw=streamed(as_it_should)),
        wrong=replace(TWO, draw=streamed(always)),
    ),
    Bug(
        "replacement by a shorter sum",
        "A part of the sum is left out where a new candidate is compared with it.",
        "bright and dark a little, later candidates are taken too often",
        "[Chao 1982; GRIS 2.1]",
        reference_scene,
        right=replace(TWO, draw=streamed(as_it_should)),
        wrong=replace(TWO, draw=streamed(without_first)),
    ),
    Bug(
        "weight of the chosen group stored",
        "Candidates are resampled in two levels, and the W of the inner level is kept.",
        "dark nearly everywhere, by up to 1/M, more where candidates differ",
        "[GRIS Eq. 22]",
        reference_scene,
        right=TWO,
        wrong=replace(TWO, draw=first_group_only),
    ),
    Bug(
        "W written on accept only",
        "W is computed in the branch that takes a candidate; the sum grows on after it.",
        "dark overall, more with every neighbour that is not taken",
        "[Chao 1982; GRIS Eq. 22]",
        reference_scene,
        right=Parts(),
        wrong=merging(written_on_accept),
    ),
    Bug(
        "neighbour's shadow ray reused",
        "Every second pixel saves its shadow ray, and takes the neighbour's light with the neighbour's answer.",
        "bright leaks and dark dots beside shadows, on every second pixel",
        "[GRIS Eq. 35]",
        reference_scene,
        right=ONE,
        wrong=replace(ONE, draw=neighbours_answer),
    ),
    Bug(
        "seeds of pixels and passes collide",
        "seed = pixel + constant times pass: numbers of one pass are those of other pixels in the pass before.",
        "bright and dark mould that grows with the passes, too little to see in a mean",
        "[GRIS 3.1, 6.3]",
        reference_scene,
        right=Parts(two_rounds),
        wrong=Parts(two_rounds, dice=colliding),
    ),
)

WASTEFUL_CANDIDATES = (
    Bug(
        "densities of two measures compared as they are",
        "An area density meets one of directions in MIS, on both sides alike, so that the weights still sum to one.",
        "noisier where one measure dwarfs the other, no bias",
        "[GRIS Eq. 5, 6; Veach 1997]",
        two_technique_scene,
        right=Parts(one_frame, here=Shared, near=Shared),
        wrong=Parts(one_frame, here=NeitherConverted, near=NeitherConverted),
    ),
    Bug(
        "reuse that does nothing",
        "A clamped depth is compared with one that is not, so every neighbour is refused; or results are not written.",
        "as noisy as without reuse, and no faster, no bias",
        "[GRIS 6.3]",
        reference_scene,
        right=ONE,
        wrong=replace(ONE, spatial=inert),
    ),
)

"""Bugs in what is selected and in the weight that comes out.  [GRIS Eq. 1-6, 16-22; Chao 1982]"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from restir_ref.batch import Array, ratio, total, where
from restir_ref.chance import Chance
from restir_ref.integrals import Pixels, Reservoirs, Sample, target
from restir_ref.mis import Weights
from restir_ref.oracle.cells import Frame
from restir_ref.oracle.scenes import Parts, one_frame, reference_scene, two_technique_scene
from restir_ref.oracle.zoo.bug import Bug
from restir_ref.oracle.zoo.merging import Merge, confidence, jacobians, merging
from restir_ref.resampling import Candidate, Input, select, weigh
from restir_ref.restir import initial, resample
from restir_ref.streaming import Stream

# ---------------------------------------------------------------- the weight that comes out


@dataclass(frozen=True)
class Labelled:
    """A sample that carries a number (N,) along."""

    x: Sample
    number: Array


def carried(offered: Sequence[Candidate], numbers: Sequence[Array], chance: Chance, c: Array) -> Reservoirs:
    """`select`, with the chosen candidate's number beside its sample."""
    labelled = [replace(each, x=Labelled(each.x, number)) for each, number in zip(offered, numbers, strict=True)]
    return select(labelled, chance, c)


def selected_weight(inputs: Sequence[Input], here: Pixels, mis: Weights, chance: Chance) -> Reservoirs:
    """W_Y = W_s."""
    Y = carried(list(weigh(inputs, here, mis)), [source.X.W for source in inputs], chance, confidence(inputs))
    return Reservoirs(Y.x.x, np.where(Y.W > 0, Y.x.number, 0), Y.c)


def selected_weight_shifted(inputs: Sequence[Input], here: Pixels, mis: Weights, chance: Chance) -> Reservoirs:
    """W_Y = W_s J_s."""
    WJ = [source.X.W * J for source, J in zip(inputs, jacobians(inputs, here), strict=True)]
    Y = carried(list(weigh(inputs, here, mis)), WJ, chance, confidence(inputs))
    return Reservoirs(Y.x.x, np.where(Y.W > 0, Y.x.number, 0), Y.c)


def stored_target(inputs: Sequence[Input], here: Pixels, mis: Weights, chance: Chance) -> Reservoirs:
    """W_Y = sum_j w_j / p_hat_s(X_s): divided by the target that the selected sample came with."""
    stored = [target(source.at, source.X.x) for source in inputs]
    Y = carried(list(weigh(inputs, here, mis)), stored, chance, confidence(inputs))
    return Reservoirs(Y.x.x, ratio(Y.W * target(here, Y.x.x), Y.x.number), Y.c)


# ---------------------------------------------------------------- streaming


def streaming(offer: Callable[[Stream, Candidate, Chance], Stream]) -> Merge:
    """One candidate after the other: `streaming.select_streaming` with another `offer`."""

    def merge(inputs: Sequence[Input], here: Pixels, mis: Weights, chance: Chance) -> Reservoirs:
        first, *others = weigh(inputs, here, mis)
        stream = Stream(first, first.p_hat * first.mW)
        for new in others:
            stream = offer(stream, new, chance)
        kept = replace(stream.kept, mW=ratio(stream.w_sum, stream.kept.p_hat))
        return select([kept], chance, confidence(inputs))

    return merge


def offer_against_old_sum(stream: Stream, new: Candidate, chance: Chance) -> Stream:
    """The new candidate is kept with probability w / w_sum, *before* w is added."""
    w = new.p_hat * new.mW
    p = np.where(stream.w_sum > 0, np.minimum(ratio(w, stream.w_sum), 1), np.where(w > 0, 1.0, 0.0))
    replaced = chance.choose(np.stack([1 - p, p])) == 1
    return Stream(where(replaced, new, stream.kept), stream.w_sum + w)


def offer_and_forget(stream: Stream, new: Candidate, chance: Chance) -> Stream:
    """The sum grows only when the new candidate is taken."""
    w = new.p_hat * new.mW
    replaced = chance.choose(np.stack([stream.w_sum, w])) == 1
    return Stream(where(replaced, new, stream.kept), stream.w_sum + np.where(replaced, w, 0))


# ---------------------------------------------------------------- new samples


def two_candidates(here: Pixels, chance: Chance) -> Reservoirs:
    """RIS over M = 2 candidates."""
    return initial(here, chance, M=2)


def divided_again(here: Pixels, chance: Chance) -> Reservoirs:
    """RIS over two candidates whose result is divided by M once more."""
    X = initial(here, chance, M=2)
    return replace(X, W=X.W / 2)


def lit_candidates(here: Pixels, chance: Chance) -> Reservoirs:
    """RIS over two candidates, of which those without light are not counted in M."""
    drawn = [each for _ in range(2) for each in here.of.candidates(here.index, chance)]
    lit = total([np.where(target(here, x) > 0, 1, 0) for x, _ in drawn])
    X = resample([(x, W / 2) for x, W in drawn], here, chance)
    return replace(X, W=ratio(2 * X.W, lit))


def density_of_chosen(here: Pixels, chance: Chance) -> Reservoirs:
    """RIS over two candidates with W = 1/p of the chosen one."""
    drawn = [each for _ in range(2) for each in here.of.candidates(here.index, chance)]
    offered = [Candidate(x, target(here, x), W / 2) for x, W in drawn]
    X = carried(offered, [W for _, W in drawn], chance, np.ones(len(here.index), dtype=int))
    return Reservoirs(X.x.x, np.where(X.W > 0, X.x.number, 0), X.c)


class EqualShares(Frame):
    """Every technique has the MIS weight 1 / T, whatever it can find."""

    def candidates(self, index: Array, chance: Chance) -> Iterator[tuple[Array, Array]]:
        """One draw per technique with m W = 1 / (T p_t(x))."""
        i = self.ids(index)
        for pdf, (x, _) in zip(self.cells.pdf, super().candidates(index, chance), strict=True):
            yield x, ratio(np.ones(len(i)), len(self.cells.pdf) * pdf[i, x])


TWO = Parts(one_frame, draw=two_candidates)

SELECTION_BUGS = (
    Bug(
        "W of the selected sample kept",
        "The selected reservoir is copied whole, and the sum of weights is never divided by the target.",
        "bright, with dark spots, worse with every pass",
        "[GRIS Eq. 21, 22]",
        reference_scene,
        right=Parts(),
        wrong=merging(selected_weight),
    ),
    Bug(
        "W of the selected sample times J",
        "The selected reservoir is copied and its weight moved by the Jacobian, as if nothing had been weighed.",
        "bright, with dark spots, worse with every pass, depth edges right",
        "[GRIS Eq. 21, 22]",
        reference_scene,
        right=Parts(),
        wrong=merging(selected_weight_shifted),
    ),
    Bug(
        "W formed with the stored target",
        "The target is stored with the sample, and not evaluated again after the shift.",
        "too bright or too dark wherever pixels differ: textures, material borders, normal maps",
        "[GRIS Eq. 22]",
        reference_scene,
        right=Parts(),
        wrong=merging(stored_target),
    ),
    Bug(
        "1/p of the chosen candidate",
        "The density of the chosen light sample is used as if no choice had been made.",
        "contrast exaggerated: strong lights too bright, weak ones too dark; right with one candidate",
        "[GRIS Eq. 3, 22]",
        reference_scene,
        right=TWO,
        wrong=replace(TWO, draw=density_of_chosen),
    ),
    Bug(
        "divided by M twice",
        "Weights already contain 1/M, and the old formula W = sum w / (M p_hat) is kept.",
        "dark to 1/M, at every number of candidates",
        "[GRIS Eq. 2, 22]",
        reference_scene,
        right=TWO,
        wrong=replace(TWO, draw=divided_again),
    ),
    Bug(
        "candidates without light not counted",
        "Candidates with zero target are skipped before M is counted.",
        "bright where light is rarely found: penumbras, many hidden lights",
        "[GRIS Eq. 1, 6]",
        reference_scene,
        right=TWO,
        wrong=replace(TWO, draw=lit_candidates),
    ),
    Bug(
        "1/T over unequal samplers",
        "Light and BSDF samples share one reservoir with equal weights, though not each can find every light.",
        "dark where only one technique finds the light: lamps without area, distant surroundings",
        "[GRIS Eq. 5, 6]",
        two_technique_scene,
        right=Parts(one_frame),
        wrong=Parts(one_frame, here=EqualShares, near=EqualShares),
    ),
    Bug(
        "streaming against the old sum",
        "The random number is compared with w / w_sum before w is added to the sum.",
        "slightly too bright and too dark from the second pass on, means of one pass right",
        "[Chao 1982; GRIS 2.1]",
        reference_scene,
        right=Parts(),
        wrong=merging(streaming(offer_against_old_sum)),
    ),
    Bug(
        "sum grown only on accept",
        "The running sum is updated inside the branch that takes the new sample.",
        "dark overall, worse with every neighbour",
        "[Chao 1982; GRIS Eq. 22]",
        reference_scene,
        right=Parts(),
        wrong=merging(streaming(offer_and_forget)),
    ),
)

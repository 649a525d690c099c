"""Resampled importance sampling: weigh the inputs, select one.  [GRIS 4-5]

RIS and GRIS are the same lines: `select` does not know whether its candidates come from a sampler
(initial candidates, W = 1/p) or, shifted, from other pixels and frames (`weigh`).
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from itertools import pairwise

import numpy as np

from restir_ref.batch import Array, pick, ratio, total, wide
from restir_ref.chance import Chance
from restir_ref.guards import aligned, apart, nonnegative, per_column
from restir_ref.integrals import Pixels, Proxy, Reservoirs, Sample, Shifted, kept_apart, shifted_together, target
from restir_ref.mis import ANY, CANONICAL_COVERS, Confidences, Density, Weights

LARGEST_CONFIDENCE = 2.0**100
"""Merged confidences saturate here, so that uncapped ones, which double every frame, stay finite."""

TOO_LARGE = "Scale p_hat: a constant factor changes no estimate, but keeps p_hat, W and their sums in range."

ONE = np.array(1)
"""The Jacobian of the identity."""


@dataclass(frozen=True, eq=False)
class Input:
    """One input of a pass: reservoirs X whose samples live in the domains `at`.

    >>> import numpy as np
    >>> from restir_ref import Input, Live, Pixels, initial
    >>> from toy1d import two_pixels
    >>> at = Pixels(two_pixels(), np.array([1, 0]))
    >>> Input(initial(at, Live(np.random.default_rng(1))), at).X.c
    array([1, 1])
    """

    X: Reservoirs
    at: Pixels


Landed = tuple[Shifted, Array]
"""Y_i = T_i(X_i), and p_hat(Y_i) (N,)."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """A sample y where we select, p_hat(y), m_i W_i J_i, and c_i/m_i, which is 1 where it is None; each (N,)."""

    x: Sample
    p_hat: Array
    mW: Array
    c_over_m: Array | None = None


def weigh(inputs: Sequence[Input], here: Pixels, mis: Weights) -> Iterator[Candidate]:
    """Yield Y_i = T_i(X_i) with m_i(Y_i) W_i J_i for every input.  [GRIS Eq. 19]

    Inputs whose `at` *is* `here` are canonical: same domain, identity shift.
    Raises ValueError for no inputs, unequal batches, bad W or c, or no canonical input where
    the weights need one.

    >>> import numpy as np
    >>> from restir_ref import WEIGHTS, Input, Live, Pixels, initial, weigh
    >>> from toy1d import two_pixels
    >>> line, chance = two_pixels(), Live(np.random.default_rng(1))
    >>> here, near = Pixels(line, np.array([0, 1])), Pixels(line, np.array([1, 0]))
    >>> inputs = [Input(initial(at, chance), at) for at in (here, near)]
    >>> for y in weigh(inputs, here, WEIGHTS["talbot"]):
    ...     print(y.x.round(3), y.mW.round(3))
    [0.512 0.95 ] [0.287 0.227]
    [0.312 0.423] [0.13  0.599]
    """
    c = _confidences(inputs, here, mis)
    landed = _landed(inputs, here)
    for i, (source, (y, p_hat)) in enumerate(zip(inputs, landed, strict=True)):
        q = _densities(i, landed, inputs, here, mis.proxy)
        m = mis.m(i, q, c)
        c_over_m = None if mis.c is None else ratio(mis.c(i, q, c), m)
        if mis.unbiased_for == ANY:
            _check_covered(i, (c[i] == 0) & (source.X.W * y.J * p_hat > 0), q, c)
        yield Candidate(y.x, p_hat, m * source.X.W * y.J, c_over_m)


def contribution_weight(y: Candidate) -> Array:
    """c_i W_i J_i of one candidate, c_i its contribution MIS weight, mostly m_i; (N,).  [GRIS Eq. 16, 18]"""
    return y.mW if y.c_over_m is None else y.c_over_m * y.mW


def correction(y: Candidate) -> Array:
    """c_i/m_i of one candidate, which is 1 unless the weights differ; (N,)."""
    return np.ones_like(y.mW) if y.c_over_m is None else y.c_over_m


def select(candidates: Iterable[Candidate], chance: Chance, c: Array) -> Reservoirs:
    """Choose Y by w_i = p_hat(Y_i) m_i W_i J_i; W_Y = (c_s/m_s) sum_j w_j / p_hat(Y).  [GRIS Eq. 21-22]

    Where all w_i are 0 the result is a null sample: the first candidate with W = 0, and the
    confidence c (N,) all the same.  Raises ValueError for no candidates, for negative, NaN or
    infinite weights, and where their sum or W_Y overflows.

    >>> import numpy as np
    >>> from restir_ref import Live, select
    >>> from restir_ref.resampling import Candidate
    >>> one, other = np.ones(1), np.full(1, 3.0)
    >>> offered = [Candidate(0.2 * one, p_hat=one, mW=one / 2), Candidate(0.8 * one, p_hat=other, mW=one / 2)]
    >>> Y = select(offered, Live(np.random.default_rng(1)), c=one)
    >>> Y.x, Y.W.round(3)  # W = sum w / p_hat(Y) = 2 / 3
    (array([0.8]), array([0.667]))
    """
    offered = list(candidates)
    w = _stacked([resampling_weight(each) for each in offered])
    w_sum = sum_of_weights(w.sum(axis=0))
    s = chance.choose(w)
    W = over_target(w_sum, pick([each.p_hat for each in offered], s))
    if any(each.c_over_m is not None for each in offered):
        W = W * pick([correction(each) for each in offered], s)
    return Reservoirs(pick([each.x for each in offered], s), W, np.broadcast_to(c, W.shape))


def select_any(ys: Sequence[Sample], cW: Sequence[Array], w: Sequence[Array], chance: Chance, c: Array) -> Reservoirs:
    """W_Y = c_s W_s J_s (sum_j w_j / w_s) for *any* w_i > 0: the general form.  [GRIS Eq. 18]

    cW holds c_i W_i J_i, where the contribution weights c_i sum to 1 over the inputs that can realise
    y [GRIS Eq. 17]; w (M, N) must be positive wherever c_i W_i J_i f is not 0.  `select` is the case
    w_i = p_hat m_i W_i J_i.
    """
    stacked = _checked(_stacked(w))
    w_sum = sum_of_weights(total(w))
    s = chance.choose(stacked)
    W = pick(cW, s) * ratio(w_sum, pick(w, s))
    return Reservoirs(pick(ys, s), W, np.broadcast_to(c, W.shape))


def gris(inputs: Sequence[Input], here: Pixels, mis: Weights, chance: Chance) -> Reservoirs:
    """One pass of generalised RIS: weigh, then select; confidences add up.  [GRIS Eq. 19-22]

    [GRIS 6.2] stores min(M_c, sum of confidences); here the sum is stored, and `restir.temporal`
    caps the history when it comes in.  Both are unbiased.

    >>> import numpy as np
    >>> from restir_ref import WEIGHTS, Input, Live, Pixels, gris, initial, shade
    >>> from toy1d import two_pixels
    >>> line, chance, index = two_pixels(), Live(np.random.default_rng(1)), np.arange(20_000)
    >>> here, near = Pixels(line, index), Pixels(line, index ^ 1)
    >>> X, Z = initial(here, chance), initial(near, chance)
    >>> Y = gris([Input(X, here), Input(Z, near)], here, WEIGHTS["talbot"], chance)
    >>> shade(Y, here).reshape(-1, 2).mean(axis=0).round(2)
    array([1.  , 0.98])
    """
    chosen = list(weigh(inputs, here, mis))
    C = Confidences(_counts(inputs), ()).C
    return select(chosen, chance, np.minimum(C, LARGEST_CONFIDENCE))


def resampling_weight(y: Candidate) -> Array:
    """w_i = p_hat(Y_i) m_i W_i J_i, checked: finite and >= 0; (N,).  [GRIS Eq. 22]"""
    return _checked(wide(y.p_hat) * y.mW)


def sum_of_weights(w_sum: Array) -> Array:
    """sum_j w_j (N,), checked: no sum of finite weights may overflow."""
    return nonnegative(w_sum, "the sum of the resampling weights w_i", TOO_LARGE)


def over_target(w_sum: Array, p_hat: Array) -> Array:
    """sum_j w_j / p_hat(Y) (N,), checked: finite."""
    return nonnegative(ratio(w_sum, p_hat), "the weight W_Y = sum_j w_j / p_hat(Y)", TOO_LARGE)


def _checked(w: Array) -> Array:
    what = "a resampling weight w_i = p_hat m_i W_i"
    return nonnegative(w, what, "Check the m W of the candidates and the MIS weights m_i.")


def _stacked(w: Sequence[Array]) -> Array:
    """All w_i, (M, N); at least one."""
    if not w:
        raise ValueError(
            "resampling needs at least one candidate (M = 0): yield one from candidates(), or pass an input."
        )
    return np.stack(np.broadcast_arrays(*w))


def _landed(inputs: Sequence[Input], here: Pixels) -> list[Landed]:
    """Every Y_i and p_hat(Y_i), none of which has overwritten the one before it."""
    away = [source for source in inputs if source.at is not here]
    moved = iter(shifted_together([each.X.x for each in away], [each.at for each in away], [here] * len(away)))
    ys = [Shifted(source.X.x, ONE) if source.at is here else next(moved) for source in inputs]
    p_hats = [target(here, y.x) for y in ys]
    for one, other in pairwise(p_hats):
        apart(one, other, "results of target()")
    return list(zip(ys, p_hats, strict=True))


def _densities(i: int, landed: Sequence[Landed], inputs: Sequence[Input], here: Pixels, proxy: Proxy) -> Density:
    """q(j) = p_hat_from_j(Y_i), computed when the first is asked for.  [GRIS Eq. 35]

    The factor "y in T_j(supp X_j)" is in p_hat_j, whose support lies inside supp X_j.
    The own density needs no shift back: T_i^-1(Y_i) = X_i and |dT_i^-1| = 1 / J_i.
    """
    y, p_hat = landed[i]
    away = [z for (z, _), source in zip(landed, inputs, strict=True) if source.at is not here]

    @cache
    def back() -> Mapping[int, Array]:
        others = [j for j, source in enumerate(inputs) if source.at is not here and j != i]
        ats = [inputs[j].at for j in others]
        xs = shifted_together([y.x] * len(others), [here] * len(others), ats)
        kept_apart([*away[:1], *xs[:1]])  # a buffer that shift() fills again begins where its first results do
        return {j: x.J * proxy(at, x.x) for j, at, x in zip(others, ats, xs, strict=True)}

    @cache
    def q(j: int) -> Array:
        at = inputs[j].at
        if at is here:
            return p_hat if proxy is target else proxy(here, y.x)
        if j == i:
            return ratio(proxy(at, inputs[i].X.x), y.J)
        return back()[j]

    return q


def _confidences(inputs: Sequence[Input], here: Pixels, mis: Weights) -> Confidences:
    """The inputs' confidences, after checking everything about the inputs that can be checked."""
    if not inputs:
        raise ValueError("a pass needs at least one input (M = 0): pass the pixel's own reservoirs.")
    for i, source in enumerate(inputs):
        _check_input(source, len(here.index), f"input {i}")
    canonical = [i for i, source in enumerate(inputs) if source.at is here]
    c = Confidences(_counts(inputs), canonical)
    if mis.unbiased_for == CANONICAL_COVERS and not (canonical and np.all(c.C_R > 0)):
        raise ValueError(
            "pairwise weights need a canonical input of positive confidence in every column (|R| = 0): "
            "pass one whose `at` is the Pixels object of the pass, and keep the confidence of null samples."
        )
    return c


def _counts(inputs: Sequence[Input]) -> list[Array]:
    """All confidences; beside exact numbers they become fractions, since the ratio of two integers is a float."""
    if not any(object in (each.X.W.dtype, each.X.c.dtype) for each in inputs):
        return [each.X.c for each in inputs]
    return [np.vectorize(Fraction, otypes=[object])(each.X.c) for each in inputs]


def _check_covered(i: int, uncounted: Array, q: Density, c: Confidences) -> None:
    """Raise ValueError where Y_i, of confidence 0 and w_i > 0, lies where no input that counts can have a sample."""
    if not np.any(uncounted):
        return
    lost = uncounted & (total([c[j] * q(j) for j in range(len(c))]) == 0)
    if np.any(lost):
        raise ValueError(
            f"input {i} has confidence 0 in column {int(np.argmax(lost))}, but no other can have a sample like it, "
            "which would be lost: give it, or another input that covers supp p_hat, a positive confidence."
        )


def _check_input(source: Input, n: int, name: str) -> None:
    if len(source.at.index) != n:
        raise ValueError(
            f"{name} has {len(source.at.index)} columns, but this pass has {n}: take() the right ones first."
        )
    aligned(source.X.x, n, f"the samples of {name}")
    for what, values in (("weight W", source.X.W), ("confidence c", source.X.c)):
        per_column(values, n, f"the {what} of {name}")
        nonnegative(values, f"the {what} of {name}", "W comes from 1/p or from a pass, c counts samples.")

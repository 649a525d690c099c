"""Classic mistakes, each as another way to compute a recorded pass; what a wrong dump may be explained by.

Everything still goes through `weigh`, `select` and `gris`, with the record edited before, other weights
in between, or the result changed after.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from restir_ref.audit.compare import Compute
from restir_ref.audit.engines import KNOWN
from restir_ref.audit.load import Dump
from restir_ref.audit.recorded import Pass, Terms, recompute, weights_of
from restir_ref.batch import Array, ratio, total
from restir_ref.mis import Confidences, Density, Mis, Weights, constant, talbot
from restir_ref.oracle.zoo.weights import counting_undefined, misrated, swapped_pairwise


@dataclass(frozen=True)
class Mistake:
    """What is done, the bug of the zoo that it is ("" if none), and the terms it leads to."""

    name: str
    bug: str
    compute: Compute


def right(p: Pass) -> Terms:
    """No mistake."""
    return recompute(p, weights_of(p))


def edited(edit: Callable[[Pass], Pass]) -> Compute:
    """The pass of an edited record."""
    return lambda p: right(edit(p))


def ended(change: Callable[[Pass, Terms], Terms]) -> Compute:
    """The right pass with another end."""
    return lambda p: change(p, right(p))


def weighted(make: Callable[[Pass], Weights]) -> Compute:
    """The pass with other weights."""
    return lambda p: recompute(p, make(p))


# ---------------------------------------------------------------- the record


def with_J(change: Callable[[Array], Array]) -> Callable[[Pass], Pass]:
    """Another J in w; the densities of the MIS weights stay right."""
    return lambda p: replace(p, W=p.W * ratio(change(p.J), p.J))


def with_every_J(change: Callable[[Array], Array]) -> Callable[[Pass], Pass]:
    """Another J wherever there is one, forth and back."""
    return lambda p: replace(p, J=change(p.J), J_back=change(p.J_back))


def one(J: Array) -> Array:
    """1 where the shift is defined."""
    return np.where(J > 0, 1.0, 0.0)


def inverse(J: Array) -> Array:
    """1 / J."""
    return ratio(np.ones(J.shape), J)


def squared(J: Array) -> Array:
    """J^2."""
    return np.asarray(J**2)


def own_without_J(p: Pass) -> Pass:
    """p_hat_i(X_i) for p_hat_from_i(y_i): the Jacobian is missing in the own MIS term only."""
    return replace(p, p_hat_own=p.p_hat_own * p.J)


def at_old_target(p: Pass) -> Pass:
    """p_hat_i(X_i) for p_hat(y_i) in w: the target is not evaluated anew."""
    return replace(p, W=ratio(p.W * np.where(p.canonical[:, None], p.p_hat, p.p_hat_own), p.p_hat))


def null_uncounted(p: Pass) -> Pass:
    """Null samples get confidence 0."""
    return replace(p, c=np.where(p.W > 0, p.c, 0))


def confidence_left_out(p: Pass, terms: Terms) -> Terms:
    """Weights as if all confidences were 1; the merged one is their sum all the same."""
    return replace(right(replace(p, c=np.ones(p.c.shape))), c_Y=terms.c_Y)


def no_cap(p: Pass) -> Pass:
    """The cap forgotten."""
    return replace(p, cap=np.inf)


def mirrored(p: Pass) -> Pass:
    """1 - u for u."""
    return replace(p, u=[np.minimum(1 - u, np.nextafter(1, 0)) for u in p.u])


# ---------------------------------------------------------------- the weights


def other(m: Mis, c: Mis | None = None) -> Callable[[Pass], Weights]:
    """These weights, whatever the dump says."""
    return lambda p: Weights(m, c)


def capped_below(p: Pass) -> Weights:
    """Talbot weights with the cap in the denominator only."""

    def m(i: int, q: Density, c: Confidences) -> Array:
        capped = [p.c[j] if p.canonical[j] else np.minimum(p.c[j], p.cap) for j in range(len(c))]
        return ratio(p.c[i] * q(i), total([capped[j] * q(j) for j in range(len(c))]))

    return Weights(m)


def grown_from_zero(p: Pass) -> Weights:
    """Canonical weights that start at 0 and grow with every neighbour: 0 where none has any confidence."""
    mis = weights_of(p)

    def m(i: int, q: Density, c: Confidences) -> Array:
        alone = c.C == c.C_R if i in c.canonical else np.array(False)
        return np.where(alone, 0, mis.m(i, q, c))

    return replace(mis, m=m)


def nothing(i: int, q: Density, c: Confidences) -> Array:
    """m = 1."""
    return np.ones(c[i].shape)


# ---------------------------------------------------------------- the end


def at_s(values: Array, s: Array) -> Array:
    """values[s[n], n], (N,)."""
    return np.asarray(np.take_along_axis(values, s[None], axis=0)[0])


def count(p: Pass) -> Array:
    """C = sum_j c_j with capped confidences."""
    return np.asarray(np.where(p.canonical[:, None], p.c, np.minimum(p.c, p.cap)).sum(axis=0))


def neighbours(p: Pass) -> Array:
    """C_N, the same without the pixel's own samples."""
    return np.asarray(np.where(p.canonical[:, None], 0, np.minimum(p.c, p.cap)).sum(axis=0))


def divided_by_M(p: Pass, terms: Terms) -> Terms:
    """W_Y / M."""
    return replace(terms, W_Y=terms.W_Y / len(p.W))


def divided_by_C(p: Pass, terms: Terms) -> Terms:
    """W_Y / C."""
    return replace(terms, W_Y=ratio(terms.W_Y, count(p)))


def one_over_target(p: Pass, terms: Terms) -> Terms:
    """W_Y = 1 / p_hat(y)."""
    return replace(terms, W_Y=np.where(terms.w_sum > 0, inverse(at_s(p.p_hat, terms.s)), 0))


def not_divided(p: Pass, terms: Terms) -> Terms:
    """W_Y = sum w."""
    return replace(terms, W_Y=terms.w_sum)


def selected_W(p: Pass, terms: Terms) -> Terms:
    """W_Y = W_s."""
    return replace(terms, W_Y=np.where(terms.w_sum > 0, at_s(p.W, terms.s), 0))


def selected_WJ(p: Pass, terms: Terms) -> Terms:
    """W_Y = W_s J_s."""
    return replace(terms, W_Y=np.where(terms.w_sum > 0, at_s(p.W * p.J, terms.s), 0))


def stored_target(p: Pass, terms: Terms) -> Terms:
    """W_Y = sum w / p_hat_s(X_s)."""
    stored = np.where(p.canonical[:, None], p.p_hat, p.p_hat_own)
    return replace(terms, W_Y=ratio(terms.W_Y * at_s(p.p_hat, terms.s), at_s(stored, terms.s)))


def uncorrected(p: Pass, terms: Terms) -> Terms:
    """W_Y = sum w / p_hat(y), without c_s / m_s."""
    return replace(terms, W_Y=ratio(terms.w_sum, at_s(p.p_hat, terms.s)))


def with_sum(w_sum: Callable[[Terms], Array]) -> Compute:
    """Another sum of weights, in W_Y as well."""

    def change(p: Pass, terms: Terms) -> Terms:
        new = w_sum(terms)
        return replace(terms, w_sum=new, W_Y=terms.W_Y * ratio(new, terms.w_sum))

    return ended(change)


def upto_selected(terms: Terms) -> Array:
    """The weights up to the selected one: the sum does not grow when a candidate is not taken."""
    later = np.arange(len(terms.w))[:, None] > terms.s
    return np.asarray(np.where(later, 0, terms.w).sum(axis=0))


def unnormalised(p: Pass, terms: Terms) -> Terms:
    """w_i = c_i p_hat W J, divided by C at the end."""
    return replace(terms, m=terms.m * count(p), w=terms.w * count(p), w_sum=terms.w_sum * count(p))


def own_not_counted(p: Pass, terms: Terms) -> Terms:
    """m_i = c_i / C_N and the like: C without the pixel's own samples, which are merged all the same."""
    C_N = neighbours(p)
    grown = np.where(C_N > 0, ratio(count(p), C_N), 1)
    return replace(terms, m=terms.m * grown, w=terms.w * grown, w_sum=terms.w_sum * grown, W_Y=terms.W_Y * grown)


def own_not_counted_at_the_end(p: Pass, terms: Terms) -> Terms:
    """w_i = c_i p_hat W J, divided by C_N at the end."""
    return replace(unnormalised(p, terms), W_Y=own_not_counted(p, terms).W_Y)


def clamped(limit: float) -> Compute:
    """W_Y <- min(W_Y, limit)."""
    return ended(lambda p, terms: replace(terms, W_Y=np.minimum(terms.W_Y, limit)))


def against_old_sum(p: Pass) -> Terms:
    """Streaming that compares u times the sum *before* the new weight with the new weight."""
    terms = right(replace(p, s=None))
    if len(p.u) <= 1 or p.s is not None:
        return right(p)
    s, before = np.zeros(len(terms.s), dtype=int), np.cumsum(terms.w, axis=0)
    for i in range(1, len(terms.w)):
        s = np.where((p.u[i] * before[i - 1] < terms.w[i]) & (terms.w[i] > 0), i, s)
    return right(replace(p, s=s))


def merged(c: Callable[[Pass], Array]) -> Compute:
    """Another confidence of the result."""
    return ended(lambda p, terms: replace(terms, c_Y=c(p)))


def alive(p: Pass) -> Array:
    """The confidence of inputs that are no null samples."""
    return np.asarray(np.where(p.W > 0, p.c, 0).sum(axis=0))


def inputs_counted(p: Pass) -> Array:
    """M: one per input."""
    return np.full(p.p_hat.shape[-1], float(len(p.W)))


def uncapped(p: Pass) -> Array:
    """The sum of confidences before the cap."""
    return np.asarray(p.c.sum(axis=0))


MISTAKES = (
    Mistake("own MIS term without its Jacobian", "own MIS term without Jacobian", edited(own_without_J)),
    Mistake("J left out of w", "Jacobian left out of w", edited(with_J(one))),
    Mistake("J inverted in w", "inverted Jacobian", edited(with_J(inverse))),
    Mistake("J squared in w", "Jacobian of another dimension", edited(with_J(squared))),
    Mistake("J left out everywhere", "Jacobian left out", edited(with_every_J(one))),
    Mistake("J inverted everywhere", "inverted Jacobian", edited(with_every_J(inverse))),
    Mistake("J squared everywhere", "Jacobian of another dimension", edited(with_every_J(squared))),
    Mistake(
        "p_hat_i(X_i) in w, the target not evaluated anew", "W formed with the stored target", edited(at_old_target)
    ),
    Mistake("null samples have confidence 0", "null confidence 0", edited(null_uncounted)),
    Mistake("confidences not multiplied in", "", ended(confidence_left_out)),
    Mistake("history not capped", "no cap on history", edited(no_cap)),
    Mistake("cap only in the denominator", "cap only in the denominator", weighted(capped_below)),
    Mistake("undefined shifts count in MIS", "undefined shift kept in MIS", weighted(other(counting_undefined))),
    Mistake("pairwise targets swapped", "pairwise targets swapped", weighted(other(swapped_pairwise))),
    Mistake(
        "history left out of the canonical weight",
        "history forgotten in the canonical weight",
        weighted(other(misrated(0))),
    ),
    Mistake("1/M, contribution weight included", "1/M over unequal supports", weighted(other(constant))),
    Mistake(
        "contribution weights over all inputs",
        "contribution weights over all inputs",
        weighted(other(talbot, constant)),
    ),
    Mistake("no m in w", "", weighted(other(nothing))),
    Mistake("canonical weight 0 without neighbours", "", weighted(grown_from_zero)),
    Mistake("own samples not counted in C", "", ended(own_not_counted)),
    Mistake("own samples not counted in C, the sum divided at the end only", "", ended(own_not_counted_at_the_end)),
    Mistake("W_Y divided by M once more", "divided by M twice", ended(divided_by_M)),
    Mistake("W_Y divided by the sum of confidences once more", "divided by M twice", ended(divided_by_C)),
    Mistake("W_Y = 1 / p_hat(y)", "", ended(one_over_target)),
    Mistake("W_Y = sum w, not divided by p_hat(y)", "", ended(not_divided)),
    Mistake("W_Y = W_s", "W of the selected sample kept", ended(selected_W)),
    Mistake("W_Y = W_s J_s", "W of the selected sample times J", ended(selected_WJ)),
    Mistake("W_Y = sum w / p_hat_s(X_s)", "W formed with the stored target", ended(stored_target)),
    Mistake("W_Y without c_s / m_s", "1/M over unequal supports", ended(uncorrected)),
    Mistake("the sum grows only when a candidate is taken", "sum grown only on accept", with_sum(upto_selected)),
    Mistake("the last weight is missing in the sum", "", with_sum(lambda terms: terms.w[:-1].sum(axis=0))),
    Mistake("the first weight is missing in the sum", "", with_sum(lambda terms: terms.w[1:].sum(axis=0))),
    Mistake("u compared with the sum before the new weight", "streaming against the old sum", against_old_sum),
    Mistake("1 - u for u (no mistake by itself)", "", edited(mirrored)),
    Mistake("the sum divided by C at the end only (no mistake by itself: dump w / C)", "", ended(unnormalised)),
    Mistake("c_Y counts samples that are not null", "null confidence 0", merged(alive)),
    Mistake("c_Y counts inputs, not confidences", "", merged(inputs_counted)),
    Mistake("c_Y is not capped (no mistake by itself)", "", merged(uncapped)),
    Mistake(
        "c_Y is capped once more (no mistake by itself)",
        "cap after the merge",
        merged(lambda p: np.minimum(count(p), p.cap)),
    ),
)


def suspects(dump: Dump) -> Iterator[Mistake]:
    """All mistakes, other weights than the dump says, and a limit on W_Y where it shows: twice, as the largest."""
    yield from MISTAKES
    p, W_Y = dump.recorded, dump.found.get("W_Y", np.zeros(1))
    limit = W_Y.max()
    if limit > 0 and np.count_nonzero(limit == W_Y) > 1:
        yield Mistake(f"W_Y clamped at {limit:.7g}", "W clamped", clamped(limit))
    for name, mis in KNOWN.items():
        if name != p.mis:
            yield Mistake(f"the weights are {name!r}, not {p.mis!r}", "", weighted(lambda p, mis=mis: mis))  # type: ignore[misc]

"""Classic mistakes, each as another way to compute a recorded pass; what a wrong dump may be explained by.

Everything still goes through `weigh`, `select` and `gris`, with the record edited before, other weights
in between, or the result changed after.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from restir_ref.audit.compare import Compute
from restir_ref.audit.engines import KNOWN, asked_defensive
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


@lru_cache(maxsize=4)
def right(p: Pass) -> Terms:
    """No mistake; kept, as half of the mistakes differ from it in the end only."""
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


def unlit_uncounted(p: Pass) -> Pass:
    """Inputs whose sample is black here, or cannot be shifted, get confidence 0."""
    return replace(p, c=np.where(p.canonical[:, None] | (p.p_hat * p.J > 0), p.c, 0))


def unshifted_uncounted(p: Pass) -> Pass:
    """Inputs whose shift is undefined get confidence 0."""
    return replace(p, c=np.where(p.J > 0, p.c, 0))


def confidence_left_out(p: Pass, terms: Terms) -> Terms:
    """Weights as if all confidences were 1; the merged one is their sum all the same."""
    return replace(right(replace(p, c=np.ones(p.c.shape))), c_Y=terms.c_Y)


def no_cap(p: Pass) -> Pass:
    """The cap forgotten."""
    return replace(p, cap=np.inf)


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


def never_divided(p: Pass, terms: Terms) -> Terms:
    """W_Y C: the sum of the undivided weights over the target."""
    return replace(terms, W_Y=terms.W_Y * count(p))


def zero_over_zero(p: Pass, terms: Terms) -> Terms:
    """W_Y = sum w / p_hat(y), also where both are 0."""
    undefined = (terms.w_sum == 0) & (at_s(p.p_hat, terms.s) == 0)
    return replace(terms, W_Y=np.where(undefined, np.nan, terms.W_Y))


def undefined_weights(p: Pass, terms: Terms) -> Terms:
    """m = 0/0 where nobody can make a sample, and everything after it."""
    undefined = (terms.m == 0) & (p.p_hat == 0)
    some = undefined.any(axis=0)
    return replace(
        terms,
        m=np.where(undefined, np.nan, terms.m),
        w=np.where(undefined, np.nan, terms.w),
        w_sum=np.where(some, np.nan, terms.w_sum),
        W_Y=np.where(some, np.nan, terms.W_Y),
    )


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


def own_not_counted(p: Pass, terms: Terms) -> Terms:
    """m_i = c_i / C_N and the like: C without the pixel's own samples, which are merged all the same."""
    C_N = neighbours(p)
    grown = np.where(C_N > 0, ratio(count(p), C_N), 1)
    return replace(terms, m=terms.m * grown, w=terms.w * grown, w_sum=terms.w_sum * grown, W_Y=terms.W_Y * grown)


def own_not_counted_at_the_end(p: Pass, terms: Terms) -> Terms:
    """The same in what divides W_Y only."""
    return replace(terms, W_Y=own_not_counted(p, terms).W_Y)


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
    Mistake(
        "inputs that are black here are not counted in M",
        "neighbour skipped if its shifted target is 0",
        edited(unlit_uncounted),
    ),
    Mistake(
        "inputs whose shift fails are not counted in M",
        "neighbour skipped if its sample cannot be shifted",
        edited(unshifted_uncounted),
    ),
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
    Mistake("own samples not counted in the C that divides W_Y", "", ended(own_not_counted_at_the_end)),
    Mistake("W_Y divided by M once more", "divided by M twice", ended(divided_by_M)),
    Mistake("W_Y divided by the sum of confidences once more", "divided by M twice", ended(divided_by_C)),
    Mistake("the sum is never divided by M (the sum of confidences)", "", ended(never_divided)),
    Mistake("W_Y = 0/0 of null samples: test the target before dividing by it", "", ended(zero_over_zero)),
    Mistake("m = 0/0 where nobody can make the sample: test the sum before dividing", "", ended(undefined_weights)),
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
    Mistake("c_Y counts samples that are not null", "null confidence 0", merged(alive)),
    Mistake("c_Y counts inputs, not confidences", "", merged(inputs_counted)),
)


def suspects(dump: Dump) -> Iterator[Mistake]:
    """All mistakes, other weights than the dump says, other numbers of neighbours, and limits where they show."""
    yield from MISTAKES
    p = dump.recorded
    yield from limits(dump)
    for name, mis in KNOWN.items():
        if name != p.mis:
            yield Mistake(f"the weights are {name!r}, not {p.mis!r}", "", weighted(lambda p, mis=mis: mis))  # type: ignore[misc]
    if p.mis == "counted defensive":
        for k in range(1, MOST_ASKED + 1):
            if k != len(p.canonical) - p.canonical.sum():
                said = f"divided by k + 1, k = {k} neighbours asked for, where those accepted count"
                yield Mistake(said, "", weighted(lambda p, k=k: Weights(asked_defensive(k, k + 1.0))))  # type: ignore[misc]


MOST_ASKED = 32
"""As many neighbours asked for are tried."""


def limits(dump: Dump) -> Iterator[Mistake]:
    """Clamps that show: the same largest or smallest value twice, of W_Y, or of a factor of w."""
    p, found = dump.recorded, dump.found
    if (limit := plateau(found.get("W_Y", np.zeros(1)))) is not None:
        yield Mistake(f"W_Y clamped at {limit:.7g}", "W clamped", clamped(limit))
    if "w" not in found or not p.rated:
        return
    try:
        expected = right(replace(p, s=None, u=())).w
    except ValueError:  # overflow
        return
    for name in ("J", "W", "p_hat"):
        factor = getattr(p, name)
        used = np.where(expected > 0, factor * ratio(found["w"], expected), 0)[~p.canonical]
        meant = np.where(expected > 0, factor, 0)[~p.canonical]
        high, low = plateau(used), plateau(-used[used > 0])
        ends = (
            -low if low is not None and meant[used > 0].min() < -low * (1 - ALIKE) else 0.0,
            high if high is not None and meant.max() > high * (1 + ALIKE) else np.inf,
        )
        if ends != (0.0, np.inf) and ends[0] < ends[1] * (1 - ALIKE):
            bug = "Jacobian clamped in w" if name == "J" else ""
            said = " and ".join(
                f"{word} {end:.6g}" for word, end in zip(("at least", "at most"), ends, strict=True) if 0 < end < np.inf
            )
            yield Mistake(f"{name} clamped in w to {said}", bug, edited(clipped(name, *ends)))


def plateau(values: Array) -> float | None:
    """The largest value, if it is not 0 and there twice up to rounding."""
    finite = values[np.isfinite(values)]
    if finite.size == 0 or (top := float(finite.max())) == 0:
        return None
    return top if np.count_nonzero(abs(finite - top) <= ALIKE * abs(top)) > 1 else None


ALIKE = 1e-5
"""Values that differ by less are the same, computed twice."""


def clipped(name: str, low: float, high: float) -> Callable[[Pass], Pass]:
    """Another factor in w, between these ends; the densities of the MIS weights stay right."""

    def edit(p: Pass) -> Pass:
        factor = getattr(p, name)
        ours = p.canonical[:, None] if name == "J" else np.array(False)
        new = np.where(ours | (factor == 0), factor, np.clip(factor, low, high))
        return replace(p, W=p.W * ratio(new, factor))

    return edit

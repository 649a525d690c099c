"""A dump held against what its pass should have computed, term by term, in the order of computation."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from restir_ref.audit.load import WHOLE, Dump, recorded
from restir_ref.audit.recorded import Pass, Terms, densities
from restir_ref.batch import Array, ratio

Compute = Callable[[Pass], Terms]
"""All terms of a recorded pass; the right ones, or those of a classic mistake."""

UNDERFLOW = float(np.finfo(np.float32).tiny)
"""What is smaller may be dumped as 0."""

SMALL_M, SMALL_W = np.array(1e-2), np.array(1e-2)
"""m below the first, and w below the second times its sum, are held to an absolute tolerance: they hardly matter."""

ALL = np.array(True)
"""Compare everywhere."""


@dataclass(frozen=True)
class Wrong:
    """A term that is not what it should be: its worst place [input(s), column], and in how many columns it is wrong."""

    term: str
    where: Sequence[int]
    expected: float
    found: float
    columns: int

    def __str__(self) -> str:
        inputs = "".join(f"[{i}]" for i in self.where[:-1])
        size = "1 column" if self.columns == 1 else f"{self.columns} columns"
        return (
            f"{self.term}{inputs} in column {self.where[-1]}: expected {self.expected:.7g}, found {self.found:.7g} "
            f"(wrong in {size})"
        )


@dataclass(frozen=True, eq=False)
class Check:
    """Expected and found values of a term, which of them to compare, and the tolerance of each; (..., N)."""

    term: str
    expected: Array
    found: Array
    compared: Array
    tolerance: Array

    @property
    def right(self) -> Array:
        """Where found was compared with what is expected, and is it."""
        return np.asarray((self.compared | ~np.isfinite(self.found)) & ~self.wrong)

    @property
    def wrong(self) -> Array:
        """Where found is not expected; what is not finite is compared everywhere."""
        off = ~(abs(self.found - self.expected) <= self.tolerance) | np.isinf(self.expected)
        flushed = (self.found == 0) & (abs(self.expected) < UNDERFLOW)
        undefined = np.isnan(self.found) & np.isnan(self.expected)
        return np.asarray(off & ~flushed & ~undefined & (self.compared | ~np.isfinite(self.found)))

    @property
    def excess(self) -> Array:
        """The error in units of its tolerance where found is wrong, 1e300 where it is not finite, and -1 elsewhere."""
        error = abs(self.found - self.expected) / np.maximum(self.tolerance, UNDERFLOW)
        return np.asarray(np.where(self.wrong, np.nan_to_num(error, nan=1e300, posinf=1e300), -1))

    def worst(self) -> Wrong:
        """The place where the error is largest in units of its tolerance; the first one, if it is not finite."""
        place = tuple(int(k) for k in np.unravel_index(self.excess.argmax(), self.excess.shape))
        expected = np.broadcast_to(self.expected, self.found.shape)[place]
        columns = int(self.wrong.reshape(-1, self.wrong.shape[-1]).any(axis=0).sum())
        return Wrong(self.term, place, float(expected), float(self.found[place]), columns)


@dataclass(frozen=True)
class Tolerance:
    """The relative tolerance of all terms, and what is added for terms that are stored less exactly."""

    rtol: float
    eps: Mapping[str, float]

    def of(self, term: str) -> float:
        """The relative tolerance of one term."""
        return self.rtol + self.eps.get(term, max(self.eps.values(), default=0.0))


def checks(dump: Dump, compute: Compute, tolerance: Tolerance, skipped: Sequence[str] = ()) -> Iterator[Check]:
    """Every dumped term that is not skipped beside the computed one, in the columns that can be compared."""
    for check in _checks(dump, compute, tolerance, skipped):
        yield check if dump.sound.all() else _where_sound(check, dump.sound)


def _where_sound(check: Check, sound: Array) -> Check:
    """Elsewhere, what is found is what is expected."""
    found = np.where(sound, check.found, check.expected)
    return replace(check, found=found, compared=np.asarray(check.compared & sound))


def _checks(dump: Dump, compute: Compute, tolerance: Tolerance, skipped: Sequence[str]) -> Iterator[Check]:
    p, found = blurred(dump.recorded, tolerance.of("u")), dump.found
    terms, chosen, settled = _computed(p, compute)
    for term, compared, follows in _given_twice(p, terms):
        if term in found and term not in skipped:
            due = follows()
            yield Check(term, due, found[term], compared, tolerance.of(term) * due)
    for term, expected, compared, slack in _results(p, terms):
        if term in found:
            yield Check(term, expected, found[term], compared, tolerance.of(term) * (expected + slack))
    if p.s is not None:
        yield Check("s", np.where(settled, p.s, chosen), p.s, ALL, np.zeros(p.s.shape))
    for term, expected, compared in (("W_Y", terms.W_Y, settled), ("c_Y", terms.c_Y, ALL)):
        if term in found:
            yield Check(term, expected, found[term], compared, tolerance.of(term) * expected)


def _results(p: Pass, terms: Terms) -> Iterator[tuple[str, Array, Array, Array]]:
    """m where it matters, that is where w would not be 0 anyway; w and its sum."""
    yield "m", terms.m, (p.J > 0) & (p.W > 0) & (p.p_hat > 0), SMALL_M
    yield "w", terms.w, ALL, SMALL_W * np.nan_to_num(terms.w_sum)
    yield "w_sum", terms.w_sum, ALL, np.zeros(1)


def _given_twice(p: Pass, terms: Terms) -> Iterator[tuple[str, Array, Callable[[], Array]]]:
    """Numbers of the dump that follow from others: a shift and its inverse cancel, canonical inputs are not shifted."""
    M, N = p.p_hat.shape
    ours = np.broadcast_to(p.canonical[:, None], (M, N))
    yield "J", ours, lambda: np.ones((M, N))
    if not p.rated:
        return
    reached, own = np.broadcast_to((p.J > 0)[:, None], (M, M, N)), np.eye(M, dtype=bool)[..., None]
    to_ours = np.broadcast_to(p.canonical[:, None], (M, M, N))
    known = reached & (own | to_ours)
    yield "p_hat_own", ours, lambda: p.p_hat
    yield "p_hat_back", known, lambda: np.where(to_ours, p.p_hat[:, None], p.p_hat_own[:, None])
    yield "J_back", known, lambda: np.where(to_ours, 1, ratio(np.ones((M, N)), p.J)[:, None])
    yield "p_hat_from", reached, lambda: densities(terms.of)


@lru_cache(maxsize=4)
def blurred(p: Pass, blur: float) -> Pass:
    """A pass whose numbers may be off by so much; one object for one pass, so that what is computed of it is kept."""
    return replace(p, blur=blur)


@lru_cache(maxsize=4)
def unselected(p: Pass) -> Pass:
    """A pass without its recorded selection, likewise."""
    return replace(p, s=None)


def _computed(p: Pass, compute: Compute) -> tuple[Terms, Array, Array]:
    """Terms, the inputs that the numbers select, and in which columns a recorded s is one of those allowed.

    Numbers near a boundary may select either side.  Given an allowed s, terms are those of s.
    """
    free = compute(unselected(p))
    if p.s is None:
        return free, free.s, free.clear
    chosen = free.s if p.u else free.w.argmax(axis=0)
    unclear = ~free.clear if p.u else np.ones(len(chosen), dtype=bool)
    possible = np.take_along_axis(free.w, p.s[None], axis=0)[0] > 0
    allowed = (free.w_sum == 0) | np.isnan(free.w_sum) | (possible & ((p.s == chosen) | unclear))
    s = np.where(allowed, p.s, chosen)
    return free if np.array_equal(s, free.s) else compute(replace(p, s=s)), chosen, allowed


def columns(dump: Dump, at: Array) -> Dump:
    """The same dump with these of its columns only."""
    found = {name: values if name in WHOLE else values[..., at] for name, values in dump.found.items()}
    return replace(
        dump, recorded=recorded(found, dump.recorded.mis), found=found, index=dump.index[at], sound=dump.sound[at]
    )


def joined(parts: Sequence[Dump]) -> Dump:
    """Columns of several parts of one dump, side by side."""
    one = parts[0]
    found = {
        name: values if name in WHOLE else np.concatenate([part.found[name] for part in parts], axis=-1)
        for name, values in one.found.items()
    }
    index, sound = (np.concatenate([getattr(part, name) for part in parts]) for name in ("index", "sound"))
    return replace(one, recorded=recorded(found, one.recorded.mis), found=found, index=index, sound=sound)

"""Which term of a dumped pass is wrong first, and which classic mistake explains it."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from restir_ref.audit.compare import Check, Wrong, checks, columns
from restir_ref.audit.fields import LARGEST, RESULTS, BadDump
from restir_ref.audit.load import Dump, load
from restir_ref.audit.mistakes import Mistake, right, suspects
from restir_ref.batch import Array

RTOL = 1e-4
"""Relative tolerance: a few hundred roundings in float32."""

SOME = 2000
"""Wrong columns, and as many others, on which explanations are tried."""


@dataclass(frozen=True)
class Explanation:
    """A mistake that leads to the first wrong term in a share of its columns, and to all other terms or not."""

    mistake: str
    bug: str
    share: float
    complete: bool

    def __str__(self) -> str:
        zoo = f', "{self.bug}" in the bug zoo' if self.bug else ""
        if self.complete:
            return f"{self.mistake}{zoo}: explains every term"
        return f"{self.mistake}{zoo}: explains this term in {self.share:.0%} of its columns, but not all others"


@dataclass(frozen=True)
class DumpReport:
    """The wrong terms of a dump in the order of computation, and explanations of the first."""

    mis: str
    M: int
    N: int
    compared: Sequence[str]
    missing: Sequence[str]
    wrong: Sequence[Wrong]
    explanations: Sequence[Explanation]

    @property
    def right(self) -> bool:
        """Every term that was dumped is what it should be."""
        return not self.wrong

    @property
    def first(self) -> Wrong | None:
        """The first wrong term."""
        return self.wrong[0] if self.wrong else None

    def __str__(self) -> str:
        return "\n".join(_lines(self))


@np.errstate(all="ignore")  # dumps hold any numbers: overflow is a wrong term, or refused
def audit_dump(source: Path | str | Mapping[str, Any], *, rtol: float = RTOL) -> DumpReport:
    """Recompute a dumped pass (.npz, .json, or a mapping of names to arrays) and name the first wrong term.

    The terms follow each other: J, p_hat_own, p_hat_back, J_back, p_hat_from, m, w, w_sum, s, W_Y, c_Y.
    Raises BadDump, a ValueError, for what cannot be read; `docs/audit.md` has the format.
    """
    dump = load(source)
    compared = _compared(dump, rtol)
    wrong = [check for check in compared if check.wrong.any()]
    M, N = dump.recorded.p_hat.shape
    return DumpReport(
        mis=dump.recorded.mis,
        M=M,
        N=N,
        compared=[check.term for check in compared],
        missing=[name for name in RESULTS if name not in dump.found],
        wrong=[check.worst() for check in wrong],
        explanations=_explanations(dump, wrong[0], rtol) if wrong else (),
    )


def _compared(dump: Dump, rtol: float) -> list[Check]:
    """Every dumped term beside the right one, as far as float64 can tell what is right."""
    try:
        return list(checks(dump, right, rtol))
    except ValueError as error:
        raise BadDump(
            f"the numbers of the dump overflow where they meet ({error}) Leave these columns out, or write 0 for what "
            f"is below {1 / LARGEST:.0e}."
        ) from error


def _explanations(dump: Dump, first: Check, rtol: float) -> tuple[Explanation, ...]:
    """Complete ones, or else those that explain most of the first wrong term."""
    marked = in_column(first.wrong)
    some = np.concatenate([np.flatnonzero(mask)[:SOME] for mask in (marked, ~marked)])
    part, was = columns(dump, some), first.wrong[..., some]
    found = [each for mistake in suspects(part) for each in _explained(part, mistake, first.term, was, rtol)]
    complete = tuple(each for each in found if each.complete)
    return complete or tuple(sorted(found, key=lambda each: -each.share)[:3])


def _explained(dump: Dump, mistake: Mistake, term: str, was: Array, rtol: float) -> Iterator[Explanation]:
    """How far a mistake explains a term that was wrong, if it does in at least half of the columns and no others.

    A column explains nothing where the mistake leaves open what to expect.
    """
    skipped = () if term == "p_hat_from" else ("p_hat_from",)  # then it was right, whatever the mistake makes of it
    try:
        left = {check.term: check for check in checks(dump, mistake.compute, rtol, skipped)}
    except ValueError:  # the mistake needs what this pass does not have: densities, a canonical input
        return
    share = 1 - in_column(was & ~left[term].right).sum() / in_column(was).sum()
    complete = not any(check.wrong.any() for check in left.values())
    if share >= 0.5 and not (left[term].wrong & ~was).any():
        yield Explanation(mistake.name, mistake.bug, float(share), complete)


def in_column(wrong: Array) -> Array:
    """In which columns anything is wrong, (N,)."""
    return np.asarray(wrong.reshape(-1, wrong.shape[-1]).any(axis=0))


def _lines(report: DumpReport) -> Iterator[str]:
    size = f"{report.mis!r} weights, M = {report.M} inputs, N = {report.N} columns"
    if report.first is None:
        yield f"right: {', '.join(report.compared)} ({size})"
    else:
        yield f"WRONG: {report.first}"
        yield from (f"  then {each}" for each in report.wrong[1:])
        explained = [f"looks like: {each}" for each in report.explanations]
        yield from explained or ["no classic mistake explains it"]
        yield f"compared: {', '.join(report.compared)} ({size})"
    if report.missing:
        yield f"not dumped: {', '.join(report.missing)}"

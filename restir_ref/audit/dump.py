"""Which term of a dumped pass is wrong first, and which classic mistake explains it.

Conventions are settled on some columns, then all columns are compared, a block at a time, and mistakes are searched for
among those that are wrong, within the readings that fit best.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from restir_ref.audit.compare import Check, Tolerance, Wrong, checks, columns, joined
from restir_ref.audit.conventions import Reading, ending, in_words, read_as, readings
from restir_ref.audit.fields import LARGEST, RESULTS, BadDump, Defect
from restir_ref.audit.load import Dump, Whole, completed, defects, dump_of, opened, rated
from restir_ref.audit.mistakes import Mistake, right, suspects
from restir_ref.audit.plateaus import Plateau, plateaus
from restir_ref.batch import Array

RTOL = 1e-4
"""Relative tolerance: a few hundred roundings in float32."""

SOME = 500
"""Wrong columns, and as many others, on which explanations are tried."""

SAMPLE, BLOCKS = 1600, 8
"""So many columns settle the conventions, in so many places of the dump."""

NUMBERS_AT_ONCE = 2**20
"""Densities of a block of columns: some 200 MB."""

LIKELY, MUCH = 3, 0.12
"""So many readings are searched for mistakes, those that fit best and not much worse; and the plain one."""


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
    """The wrong terms of a dump in the order of computation, and explanations of the first.

    conventions  what had to be taken for granted to read the dump so
    defects      numbers among the inputs that are none, plateaus: inputs that look clamped
    unchecked    what the dump lacks, and so what was not judged
    """

    mis: str
    M: int
    N: int
    compared: Sequence[str]
    missing: Sequence[str]
    wrong: Sequence[Wrong]
    explanations: Sequence[Explanation]
    conventions: Sequence[str] = ()
    defects: Sequence[Defect] = ()
    plateaus: Sequence[Plateau] = ()
    unchecked: Sequence[str] = ()

    @property
    def right(self) -> bool:
        """Every term that was dumped is what it should be, and no input is suspicious."""
        return not (self.wrong or self.defects or self.plateaus)

    @property
    def first(self) -> Wrong | None:
        """The first wrong term."""
        return self.wrong[0] if self.wrong else None

    def __str__(self) -> str:
        return "\n".join(_lines(self))


@np.errstate(all="ignore")  # dumps hold any numbers: overflow is a wrong term, or refused
def audit_dump(source: Path | str | Mapping[str, Any], *, rtol: float = RTOL) -> DumpReport:
    """Recompute a dumped pass (.npz, .json, .csv, or a mapping of names to arrays) and name the first wrong term.

    The terms follow each other: J, p_hat_own, p_hat_back, J_back, p_hat_from, m, w, w_sum, s, W_Y, c_Y.
    Raises BadDump, a ValueError, for what cannot be read; `docs/audit.md` has the format.

    >>> from restir_ref.audit import audit_dump
    >>> dump = {"format": "restir-ref dump", "version": 1, "mis": "constant"}
    >>> dump |= {"p_hat": [[2.0], [1.0]], "W": [[1.0], [1.0]], "c": [[1.0], [1.0]]}
    >>> print(str(audit_dump({**dump, "w": [[1.0], [0.5]], "w_sum": [1.5]})).splitlines()[0])
    right: J, w, w_sum ('constant' weights, M = 2 inputs, N = 1 columns)
    >>> print(str(audit_dump({**dump, "w": [[1.0], [2.5]], "w_sum": [3.5]})).splitlines()[0])
    WRONG: w[1] in column 0: expected 0.5, found 2.5 (wrong in 1 column)
    """
    with TemporaryDirectory(prefix="restir-ref-audit-") as folder:
        return _report(opened(source, Path(folder)), rtol)


def _report(whole: Whole, rtol: float) -> DumpReport:
    """What is wrong with an opened dump."""
    tolerance = Tolerance(rtol, whole.eps)
    likely = settled(whole, tolerance)
    tally = Tally(whole, likely[0], tolerance)
    for start, stop in blocks(whole):
        tally.add(start, stop)
    explained, reading = _explained_by(tally, likely, tolerance)
    if reading != likely[0]:  # a mistake hides under the reading that fits best, and explains every term of another
        tally = Tally(whole, reading, tolerance)
        for start, stop in blocks(whole):
            tally.add(start, stop)
    return DumpReport(
        mis=whole.mis,
        M=whole.M,
        N=whole.N,
        compared=tally.compared,
        missing=[name for name in RESULTS if name not in whole.fields],
        wrong=list(tally.worst.values()),
        explanations=explained,
        conventions=in_words(reading),
        defects=tuple(tally.defects.values()),
        plateaus=tuple(plateaus(tally.kept[0].found)) if tally.kept else (),
        unchecked=tuple(_unchecked(whole)),
    )


def _unchecked(whole: Whole) -> Iterator[str]:
    """Inputs that were not dumped, and what that leaves open."""
    if not rated(whole.fields, whole.mis):
        yield "no p_hat_from: the MIS weights were taken as they are"
    yield from (
        f"no {name}: taken for {default}"
        for name, default in (("J", 1), ("c", 1), ("canonical", "that of the first input which fits"))
        if name not in whole.fields
    )


# ---------------------------------------------------------------- columns


def blocks(whole: Whole) -> Iterator[tuple[int, int]]:
    """Where blocks of columns begin and end."""
    size = max(1, NUMBERS_AT_ONCE // whole.M**2)
    ends = [*range(0, whole.N, size), whole.N]
    yield from pairwise(ends)


def part(whole: Whole, start: int, stop: int, reading: Reading) -> Dump:
    """Some columns in a reading."""
    index = np.arange(start, stop)
    found = read_as(completed(whole.part(start, stop), index), reading)
    return dump_of(found, whole.mis, index, reading.order)


def settled(whole: Whole, tolerance: Tolerance) -> list[Reading]:
    """The readings that fit the dump best, best first: one only if it leaves nothing wrong."""
    found = completed(_sample(whole), np.arange(whole.N))
    impossible: BadDump | None = None
    try:
        score, wrong = _score(found, whole, Reading(), tolerance)
    except BadDump as error:
        impossible, score, wrong = error, -1.0, [*RESULTS]
    if score == 1.0:
        return [Reading()]
    scores = [(score, 0, Reading())]
    for place, reading in enumerate(readings(found, whole.mis, wrong), 1):
        with suppress(BadDump):
            score, _ = _score(found, whole, reading, tolerance)
            if score == 1.0:
                return [reading]
            scores.append((score, place, reading))
    if impossible:
        raise impossible
    return _likely(sorted(scores, key=lambda each: (-round(each[0], 9), each[1])))


LOOSE = ("relative cap", "order")
"""Conventions that fit many a wrong dump in part: they acquit, but no mistake is searched for beside them first."""


def _likely(ordered: Sequence[tuple[float, int, Reading]]) -> list[Reading]:
    """The best ones without loose conventions, the best of all, and the plain one."""
    strict = [(score, reading) for score, _, reading in ordered if not (reading.order or set(LOOSE) & {*reading.names})]
    near = [reading for score, reading in strict if score >= strict[0][0] - MUCH]
    return list(dict.fromkeys([*near[:LIKELY], ordered[0][2], Reading()]))


def _sample(whole: Whole) -> dict[str, Array]:
    """Columns from several places."""
    if whole.N <= SAMPLE:
        return whole.part(0, whole.N)
    size = SAMPLE // BLOCKS
    starts = np.linspace(0, whole.N - size, BLOCKS).astype(int)
    parts = [whole.part(int(start), int(start) + size) for start in starts]
    first = parts[0]
    return {
        name: values if values.ndim == 0 or name == "canonical" else np.concatenate([p[name] for p in parts], axis=-1)
        for name, values in first.items()
    }


def _score(found: Mapping[str, Array], whole: Whole, reading: Reading, tolerance: Tolerance) -> tuple[float, list[str]]:
    """The share of right columns, averaged over the terms, -1 where numbers overflow; and the wrong terms.

    Raises BadDump.
    """
    N = found["p_hat"].shape[1]
    dump = dump_of(read_as(found, reading), whole.mis, np.arange(N), reading.order)
    try:
        done = list(checks(dump, ending(reading, right), tolerance))
    except ValueError:
        return -1.0, [*RESULTS]
    wrong = {check.term: float(in_column(check.wrong).mean()) for check in done}
    return 1 - sum(wrong.values()) / max(1, len(wrong)), [term for term, share in wrong.items() if share]


@dataclass
class Tally:
    """What was found so far, block by block, in one reading."""

    whole: Whole
    reading: Reading
    tolerance: Tolerance
    compared: list[str] = field(default_factory=list)
    worst: dict[str, Wrong] = field(default_factory=dict)
    excess: dict[str, float] = field(default_factory=dict)
    defects: dict[str, Defect] = field(default_factory=dict)
    kept: list[Dump] = field(default_factory=list)

    def add(self, start: int, stop: int) -> None:
        """Compare another block."""
        for each in defects(self.whole.part(start, stop), start):
            before = self.defects.get(each.term, each)
            more = 0 if before is each else each.columns
            self.defects[each.term] = replace(before, columns=before.columns + more)
        dump = part(self.whole, start, stop, self.reading)
        done = _compared(dump, ending(self.reading, right), self.tolerance)
        self.compared = [check.term for check in done]
        wrong = [check for check in done if check.wrong.any()]
        for check in wrong:
            self._note(check, dump)
        marked = in_column(wrong[0].wrong) if wrong else np.zeros(stop - start, dtype=bool)
        enough = sum(len(each.index) for each in self.kept) >= 2 * SOME * BLOCKS
        if not enough or wrong:
            some = np.concatenate([np.flatnonzero(mask)[:SOME] for mask in (marked, ~marked)])
            self.kept = [*self.kept, columns(dump, some)][-2 * BLOCKS :]
        self.worst = {term: self.worst[term] for term in self.compared if term in self.worst}

    def _note(self, check: Check, dump: Dump) -> None:
        """Keep the worst place of a term, in numbers of the dump, and count its columns."""
        found, excess = check.worst(), float(check.excess.max())
        place = [dump.order[i] for i in found.where[:-1]]
        here = replace(found, where=(*place, int(dump.index[found.where[-1]])))
        before = self.worst.get(check.term)
        count = found.columns + (before.columns if before else 0)
        if before is None or excess > self.excess[check.term]:
            self.worst[check.term], self.excess[check.term] = here, excess
        self.worst[check.term] = replace(self.worst[check.term], columns=count)


def _compared(dump: Dump, compute: Any, tolerance: Tolerance) -> list[Check]:
    """Every dumped term beside the right one, as far as float64 can tell what is right."""
    try:
        return list(checks(dump, compute, tolerance))
    except ValueError as error:
        raise BadDump(
            f"the numbers of the dump overflow where they meet ({error}) Leave these columns out, or write 0 for what "
            f"is below {1 / LARGEST:.0e}."
        ) from error


# ---------------------------------------------------------------- explanations


def _explained_by(
    tally: Tally, likely: Sequence[Reading], tolerance: Tolerance
) -> tuple[tuple[Explanation, ...], Reading]:
    """Complete explanations in the first reading that has some, or else partial ones in the reading that fits best."""
    if not tally.worst:
        return (), likely[0]
    places = np.unique(np.concatenate([each.index for each in tally.kept]))[: 4 * SOME]
    partial: list[Explanation] = []
    for reading in likely:
        dump = _columns_of(tally, places, reading)
        found = _explanations(dump, reading, tolerance)
        if complete := tuple(each for each in found if each.complete):
            return complete, reading
        if reading == likely[0]:
            partial = found
    return tuple(sorted(partial, key=lambda each: -each.share)[:3]), likely[0]


def _columns_of(tally: Tally, places: Array, reading: Reading) -> Dump:
    """The columns that were kept, in a reading."""
    if reading == tally.reading:
        return joined(tally.kept)
    whole = tally.whole
    parts = [part(whole, int(run[0]), int(run[-1]) + 1, reading) for run in np.split(places, _jumps(places))]
    return joined(parts)


def _jumps(places: Array) -> Array:
    """Where runs of neighbouring columns end."""
    return np.flatnonzero(np.diff(places) > 1) + 1


def _explanations(dump: Dump, reading: Reading, tolerance: Tolerance) -> list[Explanation]:
    """What explains the first wrong term in some columns, all of them or a part."""
    try:
        wrong = [check for check in checks(dump, ending(reading, right), tolerance) if check.wrong.any()]
    except ValueError:
        return []
    if not wrong:
        return []
    first = wrong[0]
    return [
        each
        for mistake in suspects(dump)
        for each in _explained(dump, replace(mistake, compute=ending(reading, mistake.compute)), first, tolerance)
    ]


def _explained(dump: Dump, mistake: Mistake, first: Check, tolerance: Tolerance) -> Iterator[Explanation]:
    """How far a mistake explains a term that was wrong, if it does in at least half of the columns and no others.

    A column explains nothing where the mistake leaves open what to expect.
    """
    was = first.wrong
    skipped = () if first.term == "p_hat_from" else ("p_hat_from",)  # then it was right, whatever comes of it
    try:
        left = {check.term: check for check in checks(dump, mistake.compute, tolerance, skipped)}
    except ValueError:  # the mistake needs what this pass does not have: densities, a canonical input
        return
    share = 1 - in_column(was & ~left[first.term].right).sum() / in_column(was).sum()
    complete = not any(check.wrong.any() for check in left.values())
    if share >= 0.5 and not (left[first.term].wrong & ~was).any():
        yield Explanation(mistake.name, mistake.bug, float(share), complete)


def in_column(wrong: Array) -> Array:
    """In which columns anything is wrong, (N,)."""
    return np.asarray(wrong.reshape(-1, wrong.shape[-1]).any(axis=0))


# ---------------------------------------------------------------- words


def _lines(report: DumpReport) -> Iterator[str]:
    size = f"{report.mis!r} weights, M = {report.M} inputs, N = {report.N} columns"
    faults = [*report.defects, *report.wrong]
    if report.right:
        yield f"right: {', '.join(report.compared)} ({size})"
    elif faults:
        yield f"WRONG: {faults[0]}"
        yield from (f"  then {each}" for each in faults[1:])
    yield from (f"{'  and ' if faults else ''}SUSPICIOUS: {each}" for each in report.plateaus)
    if report.wrong:
        explained = [f"looks like: {each}" for each in report.explanations]
        yield from explained or ["no classic mistake explains it"]
    if not report.right:
        yield f"compared: {', '.join(report.compared)} ({size})"
    yield from (f"read so: {each}" for each in report.conventions)
    yield from (f"unchecked: {each}" for each in report.unchecked)
    if report.missing:
        yield f"not dumped: {', '.join(report.missing)}"

"""Two dumped passes, one after the other: what the first wrote has to be what the second reads."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from restir_ref.audit.dump import RTOL, blocks
from restir_ref.audit.fields import BadDump
from restir_ref.audit.load import Whole, completed, opened
from restir_ref.batch import Array

READ_AS = {"W_Y": "W", "c_Y": "c"}
"""What one pass calls its result, and the next one its input."""


@dataclass(frozen=True)
class Link:
    """Which input of the second pass holds the first one's results, and what differs: first column, count, values."""

    read_by: int
    differing: Mapping[str, tuple[int, int, float, float]]

    @property
    def right(self) -> bool:
        """Everything that was written was read."""
        return not self.differing

    def __str__(self) -> str:
        if self.right:
            return f"what was written is what input {self.read_by} reads"
        said = [
            f"{term} was {wrote:.7g} in column {column}, but input {self.read_by} reads {READ_AS[term]} = {read:.7g} "
            f"({count} columns)"
            for term, (column, count, wrote, read) in self.differing.items()
        ]
        return "WRONG: " + "; ".join(said)


def chained(
    first: Path | str | Mapping[str, Any], second: Path | str | Mapping[str, Any], *, rtol: float = RTOL
) -> Link:
    """Whether W and c that the first pass wrote are those that an input of the second reads, column by column.

    The input is the one that agrees in most columns.  Raises BadDump, also for passes of other numbers of columns.
    """
    with TemporaryDirectory(prefix="restir-ref-audit-") as folder:
        (one, other) = (Path(folder, name) for name in ("1", "2"))
        one.mkdir()
        other.mkdir()
        return _link(opened(first, one), opened(second, other), rtol)


def _link(wrote: Whole, reads: Whole, rtol: float) -> Link:
    if wrote.N != reads.N:
        raise BadDump(f"the passes have {wrote.N} and {reads.N} columns: dump the same pixels of both.")
    terms = [term for term in READ_AS if term in wrote.fields]
    if not terms:
        raise BadDump("the first pass has no 'W_Y' (contribution weight of the result): write what it stored.")
    off: dict[str, list[Array]] = {term: [] for term in terms}
    values: dict[str, list[tuple[Array, Array]]] = {term: [] for term in terms}
    for start, stop in blocks(reads):
        index = np.arange(start, stop)
        result, inputs = wrote.part(start, stop), completed(reads.part(start, stop), index)
        for term in terms:
            out, read = result[term], inputs[READ_AS[term]]
            off[term].append(~(abs(read - out) <= rtol * abs(out)) & ~(np.isnan(read) & np.isnan(out)))
            values[term].append((out, read))
    wrong = {term: np.concatenate(parts, axis=1) for term, parts in off.items()}
    chosen = int(wrong[terms[0]].sum(axis=1).argmin())
    found = {}
    for term, bad in wrong.items():
        if bad[chosen].any():
            column = int(bad[chosen].argmax())
            out = np.concatenate([o for o, _ in values[term]])[column]
            read = np.concatenate([r[chosen] for _, r in values[term]])[column]
            found[term] = (column, int(bad[chosen].sum()), float(out), float(read))
    return Link(chosen, found)

"""What a figure is, what a claim is, and how a measured claim becomes a verdict.

A figure module holds one constant `FIGURE = Figure(...)` and pure functions, called in this order: `chunks`
declares the work, `compute` does one chunk, `combine` joins the chunks, `check` judges, `draw` paints.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, Protocol, get_args

import numpy as np
from numpy.typing import NDArray

from figures.criteria import Outcome, show

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

Data = Mapping[str, Any]  # plain JSON data: numbers, strings, lists, dicts with string keys
Arrays = dict[str, NDArray[Any]]
Verdict = Literal["reproduced", "reproduced with caveat", "not reproduced", "refuted"]

VERDICTS: tuple[Verdict, ...] = get_args(Verdict)  # best first
PRESETS = ("quick", "paper")


@dataclass(frozen=True)
class Claim:
    """One sentence of a paper made into a number and a criterion that could fail.

    Several claims of a figure may share an `id`: `part` tells them apart, and the id's verdict is the worst.
    `counter` is the opposite stated with certainty: where it holds, a failed claim is refuted.
    `caveat` says in what respect a pass is weaker than the paper's sentence; `reason` explains the outcome to
    the reader of the report; an empty `sentence` means the ledger's.
    """

    id: str
    outcome: Outcome
    part: str = ""
    counter: Outcome | None = None
    caveat: str = ""
    reason: str = ""
    sentence: str = ""


class Compute(Protocol):
    """One chunk: (preset data, chunk parameters, rng) -> named arrays; all randomness comes from `rng`."""

    def __call__(self, preset: Any, chunk: Any, /, *, rng: np.random.Generator) -> Arrays:
        """The arrays of one chunk."""


@dataclass(frozen=True, kw_only=True)
class Figure:
    """A figure of a paper: its name, the claims it checks, and the pure functions that make it.

    `presets` maps "quick" and "paper" to plain JSON data, which the functions receive as dicts and lists.
    Chunks of older code are computed again by themselves; raise `version` to have stored chunks refused instead.
    """

    id: str
    title: str
    world: str
    source: str
    claims: tuple[str, ...]
    presets: Mapping[str, Data]
    chunks: Callable[[Any], Sequence[Data]]
    compute: Compute
    combine: Callable[[Any, Sequence[Arrays]], Arrays]
    draw: Callable[[Arrays], "Picture"]
    check: Callable[[Arrays], Sequence[Claim]]
    version: int = 1


def verdict_of(claim: Claim) -> Verdict:
    """A pass is reproduced (with a caveat if one is declared); a failure is refuted if the counter holds."""
    if claim.outcome.passed:
        return "reproduced with caveat" if claim.caveat else "reproduced"
    return "refuted" if claim.counter is not None and claim.counter.passed else "not reproduced"


def worst(verdicts: Sequence[Verdict]) -> Verdict:
    """The verdict of a claim with several checks."""
    return max(verdicts, key=VERDICTS.index)


def verdict_line(claim: Claim) -> str:
    """The claim as it stands under the picture."""
    part = f"{claim.part} " if claim.part else ""
    found = f"{part}{show(claim.outcome.measured)} (criterion {claim.outcome.criterion})"
    return f"{claim.id} {verdict_of(claim)}: {found}"


def undeclared(figure: Figure, claims: Sequence[Claim]) -> str:
    """How the checked claims differ from the declared ones, in words; empty if they agree."""
    declared, checked = set(figure.claims), {claim.id for claim in claims}
    extra = [f"checks {id_!r} without declaring it" for id_ in sorted(checked - declared)]
    missing = [f"declares {id_!r} without checking it" for id_ in sorted(declared - checked)]
    return "; ".join(extra + missing)

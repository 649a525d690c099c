"""What a figure is, what a claim is, and how a measured claim becomes a verdict.

A figure module holds one constant `FIGURE = Figure(...)` and pure functions, called in this order: `chunks`
declares the work, `compute` does one chunk, `combine` joins the chunks, `check` judges, `draw` paints.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, Protocol, get_args

import numpy as np
from numpy.typing import NDArray

from figures.claims.criteria import Outcome, show

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

Data = Mapping[str, Any]  # plain JSON data: numbers, strings, lists, dicts with string keys
Arrays = dict[str, NDArray[Any]]
Verdict = Literal["reported", "reproduced", "reproduced with caveat", "not judged", "not reproduced", "refuted"]

VERDICTS: tuple[Verdict, ...] = get_args(Verdict)  # best first
PRESETS = ("quick", "paper")

Loop = Literal["offline", "real time", "one pass", "candidates only"]
Camera = Literal["still", "moving"]
Light = Literal["all", "indirect", "direct", "direct by ReSTIR DI"]


@dataclass(frozen=True)
class Setup:
    """What is rendered: the loop's parameters, the camera, the light that counts, and what is seen, in words."""

    loop: Loop
    camera: Camera
    light: Light
    view: str

    @property
    def kind(self) -> tuple[str, str, str]:
        """What must be as in the paper, or explained."""
        return self.loop, self.camera, self.light


@dataclass(frozen=True)
class Conditions:
    """Under which conditions claims are made, by the paper's caption or section, and under which they are judged.

    `source` is where the paper says so; `why` explains a loop, camera or light that is not the paper's, and is
    needed there.  Under other conditions than the paper's nothing is refuted.
    """

    claims: tuple[str, ...]
    source: str
    paper: Setup
    ours: Setup
    why: str = ""

    @property
    def alike(self) -> bool:
        """Whether loop, camera and light are the paper's."""
        return self.paper.kind == self.ours.kind


@dataclass(frozen=True)
class Claim:
    """One sentence of a paper made into a number and a criterion that could fail.

    Several claims of a figure may share an `id`: `part` tells them apart, and the id's verdict is the worst.  Names of
    parts are the same under every preset and seed: a part that a preset cannot judge has no `outcome`, and says why.
    `counter` is the opposite stated with certainty: where it holds, a failed claim is refuted.
    `caveat` says in what respect a pass is weaker than the paper's sentence; `reason` explains the outcome to
    the reader of the report; an empty `sentence` means the ledger's.

    Raises ValueError for a part that is not judged without a reason.
    """

    id: str
    outcome: Outcome | None
    part: str = ""
    counter: Outcome | None = None
    caveat: str = ""
    reason: str = ""
    sentence: str = ""

    def __post_init__(self) -> None:
        if self.outcome is None and not self.reason:
            raise ValueError(f"{self.id} {self.part!r} is not judged: say why in its `reason`.")


class Compute(Protocol):
    """One chunk: (preset data, chunk parameters, rng) -> named arrays; all randomness comes from `rng`."""

    def __call__(self, preset: Any, chunk: Any, /, *, rng: np.random.Generator) -> Arrays:
        """The arrays of one chunk."""


@dataclass(frozen=True, kw_only=True)
class Figure:
    """A figure of a paper: its name, the claims it checks, and the pure functions that make it.

    `presets` maps "quick" and "paper" to plain JSON data, which the functions receive as dicts and lists.
    `conditions` cover every claim of a figure that renders; figures on the line need none.
    `arm` names the chunk parameter that tells the arms of a comparison apart: chunks that differ in nothing else
    get the same random numbers, and if they then give the same bytes nothing is compared, which is an error.
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
    conditions: tuple[Conditions, ...] = ()
    arm: str = ""
    version: int = 1


@dataclass(frozen=True)
class Entry:
    """A figure and the module that holds it."""

    module: str
    figure: Figure


def conditions_of(figure: Figure, id_: str) -> Conditions | None:
    """The conditions of one claim, if any are declared."""
    return next((each for each in figure.conditions if id_ in each.claims), None)


def verdict_of(claim: Claim, conditions: Conditions | None = None) -> Verdict:
    """A pass is reproduced (with a caveat if one is declared); a failure is refuted if the counter holds.

    Nothing is refuted under other conditions than the paper's.
    """
    if claim.outcome is None:
        return "not judged"
    if claim.outcome.passed is None:
        return "reported"
    if claim.outcome.passed:
        return "reproduced with caveat" if claim.caveat else "reproduced"
    alike = conditions is None or conditions.alike
    certain = claim.counter is not None and claim.counter.passed
    return "refuted" if alike and certain else "not reproduced"


def worst(verdicts: Sequence[Verdict]) -> Verdict:
    """The verdict of a claim with several checks."""
    return max(verdicts, key=VERDICTS.index)


def words(verdict: Verdict, where: str, preset: str) -> str:
    """The verdict; a refutation names world and preset, and what is not judged the preset that cannot."""
    if verdict == "refuted" and where:
        return f"{verdict} in {where}, {preset}"
    return f"{verdict} in {preset}" if verdict == "not judged" and preset else verdict


def verdict_line(claim: Claim, conditions: Conditions | None = None) -> str:
    """The claim as it stands under the picture."""
    part = f"{claim.part} " if claim.part else ""
    return f"{claim.id} {verdict_of(claim, conditions)}: {part}{measured(claim)}"


def measured(claim: Claim) -> str:
    """What was found and the rule, or why nothing is judged."""
    if claim.outcome is None:
        return f"({claim.reason})"
    if claim.outcome.passed is None:
        return show(claim.outcome.measured)
    return f"{show(claim.outcome.measured)} (criterion {claim.outcome.criterion})"


def undeclared(figure: Figure, claims: Sequence[Claim]) -> str:
    """How the checked claims differ from the declared ones, in words; empty if they agree."""
    declared, checked = set(figure.claims), {claim.id for claim in claims}
    extra = [f"checks {id_!r} without declaring it" for id_ in sorted(checked - declared)]
    missing = [f"declares {id_!r} without checking it" for id_ in sorted(declared - checked)]
    return "; ".join(extra + missing)

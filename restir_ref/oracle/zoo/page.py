"""The zoo as a page for people who look at a wrong image: from the symptom to the mistake and what catches it."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from inspect import getdoc

import numpy as np

from restir_ref.batch import Array
from restir_ref.oracle.zoo.bug import Bug, exact_bias
from restir_ref.oracle.zoo.checks import CHECKS, OUTSIDE, TOLERANCE, Found, examine

MEAN, VARIANCE = "mean with f = p_hat", "variance against the right loop"

HEAD = """\
# Symptoms

What is wrong with the image, and which mistake does that. Made by `python -m restir_ref.transport.proofs.zoo >
docs/symptoms.md` from the bug zoo; do not edit. Every mistake is planted in a loop of ReSTIR small enough to
enumerate, so its numbers are exact, for one small scene each: in other scenes the sizes differ. Mistakes about paths
and shifts come last. The keys in brackets are explained in [references.md](references.md).

A bias is relative and belongs to a *cell*, a piece of path space: +50 % means that all light through it is counted one
and a half times. *Image* is the relative bias of the pixel that is off most: cells that err in opposite directions
hide each other there.
"""

SECTIONS = {
    "Dark": "Energy is lost and nowhere gained.",
    "Bright": "Energy is gained and nowhere lost.",
    "Bright here, dark there": "Means are off by less than what they hide.",
    "Noisy, smeared or frozen": "No bias: no mean shows these, however long it runs. Where the change of variance is"
    " negative, the mistake happens to help on this scene.",
}

BIASED_HEAD = """
| what it looks like | mistake | how it gets in | breaks | cells | image | pointed at by |
|---|---|---|---|---|---|---|
"""

UNBIASED_HEAD = """
| what it looks like | mistake | how it gets in | breaks | variance | pointed at by |
|---|---|---|---|---|---|
"""

CHECKS_HEAD = """
## The checks

Exact numbers from outside catch nearly everything on these scenes: Definition 4.1 per cell and the mean with f = 1
every biased mistake, the mean with f = p_hat and the variance all but one, two passes that share a seed. What the mean
of a real, noisy image would see is a matter of size: the column *image*, against the noise. The variance needs a right
loop to compare with. The tables above name the other checks, which look inside and say where to search.

| check | what it measures; 0 if all is well |
|---|---|
"""

NOTHING = "nothing inside", "nothing but the variance"


@dataclass(frozen=True)
class Entry:
    """A bug, its exact bias per cell on its scene, and what the checks find."""

    bug: Bug
    bias: Array
    found: Mapping[str, Found]

    @property
    def cells(self) -> Array:
        """The bias of all cells that should have light, or have some."""
        scene = self.bug.scene()
        return np.asarray(self.bias[scene.support | (abs(self.bias) > TOLERANCE)])

    @property
    def section(self) -> str:
        """Which way it errs."""
        darker, brighter = bool(self.cells.min() < -TOLERANCE), bool(self.cells.max() > TOLERANCE)
        dark, bright, both, none = SECTIONS
        return {(True, False): dark, (False, True): bright, (True, True): both}.get((darker, brighter), none)

    @property
    def numbers(self) -> list[str]:
        """The ranges of bias per cell and in the image, or the change of variance where there is no bias."""
        if abs(self.bias).max() <= TOLERANCE:
            return [percent(self.found[VARIANCE].value)]
        ends = dict.fromkeys((percent(self.cells.min()), percent(self.cells.max())))
        return [" to ".join(ends), percent(self.found[MEAN].value)]

    @property
    def pointed_at_by(self) -> str:
        """The checks that look inside and catch it."""
        outside = list(CHECKS)[:OUTSIDE]
        inside = [name for name, each in self.found.items() if each.caught and name not in outside]
        return ", ".join(inside) or NOTHING[len(self.numbers) == 1]


def entry(bug: Bug) -> Entry:
    """All numbers of one bug."""
    scene = bug.scene()
    return Entry(bug, exact_bias(bug.wrong(scene), scene), examine(bug.wrong, bug.right, scene))


def percent(value: float) -> str:
    """A signed percentage; no sign for 0."""
    text = f"{100 * value:+.1f}"
    return "0 %" if float(text) == 0 else f"{text} %"


def row(cells: Iterable[str]) -> str:
    """One line of a table."""
    return f"| {' | '.join(cell.replace('|', '&#124;') for cell in cells)} |\n"


def page(bugs: Iterable[Bug]) -> str:
    """The page, as Markdown."""
    return "".join(pieces([entry(bug) for bug in bugs]))


def pieces(entries: list[Entry]) -> Iterator[str]:
    """The parts of the page in order."""
    yield HEAD
    for title, about in SECTIONS.items():
        members = [each for each in entries if each.section == title]
        yield f"\n## {title}\n\n{about}\n"
        yield UNBIASED_HEAD if title == list(SECTIONS)[-1] else BIASED_HEAD
        for each in sorted(members, key=lambda each: each.bug.symptom):
            words = each.bug.symptom, f"**{each.bug.name}**", each.bug.story, each.bug.breaks
            yield row([*words, *each.numbers, each.pointed_at_by])
    yield CHECKS_HEAD
    yield from (row([name, (getdoc(check) or "").splitlines()[0]]) for name, check in CHECKS.items())

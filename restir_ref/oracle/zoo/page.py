"""The zoo as a page for people who look at a wrong image: from the symptom to the mistake and what catches it."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from inspect import getdoc

import numpy as np

from restir_ref.batch import Array
from restir_ref.oracle.zoo.bug import Bug, exact_bias
from restir_ref.oracle.zoo.checks import CHECKS, OUTSIDE, TOLERANCE, Found, examine
from restir_ref.oracle.zoo.cures import CURES

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

FIRST = """
## First

1. **Switch reuse off**, temporal and spatial, and take one candidate per pixel. If the image is still wrong, so is the
   path tracer, the sampler or its pdf: no table below helps before that is right.
2. **Is it biased at all?** `python -m restir_ref.audit images FRAMES REFERENCE` compares independent frames with a
   reference, says where and by how much, or how many frames are missing. Noise is no bias, however ugly.
3. **Which step?** Then switch on candidates, temporal, spatial reuse, one after the other, and compare each:
   `python -m restir_ref.audit ladder REFERENCE "new samples=DIR" "temporal=DIR" "spatial=DIR"` names the first that is
   wrong.
4. **Which term?** Dump a few columns of that pass, and let them be recomputed; or write the pass down as an estimator:
   [audit.md](audit.md). A shift of your own is for the [judge](audit.md#judge-a-shift).

"""

BEFORE = (
    (
        "black or white blocks that grow from frame to frame and never go",
        "**NaN spread by reuse**",
        "0/0 of a null sample, or infinity from a density of 0; every pixel that reads it has it from then on",
        "test the target and the sum before dividing; W = 0 where either is 0; drop W that is not finite",
    ),
    (
        "fireflies, or dark lamps, that come and go with distance or exposure",
        "**W beyond half floats**",
        "half floats end at 65504 and lose everything below 6e-8",
        "scale p_hat; store W as float, or its logarithm",
    ),
    (
        "boiling: blotches that live for some frames, right in the mean",
        "**history too long**",
        "history of long confidence meets few new samples, and neighbours share it",
        "lower the cap; more candidates; [when reuse pays](when-reuse-pays.md)",
    ),
    (
        "the same with colours that stay for ever",
        "no cap on history, [below](#noisy-smeared-or-frozen)",
        "the confidence of history grows for ever",
        "cap the confidence of history, c <- min(c, M_c)",
    ),
    (
        "dark after some bounces, by a constant factor per bounce",
        "roulette not compensated, [below](#dark)",
        "roulette that is not divided by its probability",
        "W /= q for the survivors",
    ),
    (
        "lamps without area too dark",
        "lamp without area weighed against directions, [below](#dark)",
        "a delta light weighed against a density of directions",
        "weight 1 for what only one technique can find",
    ),
    (
        "as noisy with reuse as without it",
        "reuse that does nothing, [below](#noisy-smeared-or-frozen)",
        "every neighbour is refused, or the result is not written back",
        "count the accepted neighbours; dump a pass",
    ),
)
"""What to think of first: symptom, mistake, how it gets in, cure; with stars what is not in the zoo."""

NOT_IN_THE_ZOO = tuple(name.strip("*") for _, name, _, _ in BEFORE if name.startswith("**"))
"""Mistakes that no finite scene shows: their numbers, or their frames, are beyond it."""

SECTIONS = {
    "Dark": "Energy is lost and nowhere gained.",
    "Bright": "Energy is gained and nowhere lost.",
    "Bright here, dark there": "Means are off by less than what they hide.",
    "Noisy, smeared or frozen": "No bias: no mean shows these, however long it runs. Where the change of variance is"
    " negative, the mistake happens to help on this scene.",
}

BIASED_HEAD = """
| what it looks like | mistake | how it gets in | cure | breaks | cells | image | pointed at by |
|---|---|---|---|---|---|---|---|
"""

UNBIASED_HEAD = """
| what it looks like | mistake | how it gets in | cure | breaks | variance | pointed at by |
|---|---|---|---|---|---|---|
"""

CHECKS_HEAD = """
## The checks

Exact numbers from outside catch nearly everything on these scenes: Definition 4.1 per cell and the mean with f = 1
every biased mistake, the mean with f = p_hat and the variance all but two, whose seeds coincide. What the mean
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
    yield HEAD + FIRST + row(["what it looks like", "mistake", "how it gets in", "cure"]) + row(["---"] * 4)
    yield from map(row, BEFORE)
    for title, about in SECTIONS.items():
        members = [each for each in entries if each.section == title]
        yield f"\n## {title}\n\n{about}\n"
        yield UNBIASED_HEAD if title == list(SECTIONS)[-1] else BIASED_HEAD
        for each in sorted(members, key=lambda each: each.bug.symptom):
            words = each.bug.symptom, f"**{each.bug.name}**", each.bug.story, CURES[each.bug.name], each.bug.breaks
            yield row([*words, *each.numbers, each.pointed_at_by])
    yield CHECKS_HEAD
    yield from (row([name, (getdoc(check) or "").splitlines()[0]]) for name, check in CHECKS.items())

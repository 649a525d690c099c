"""The transport's part of the index of symptoms."""

from collections.abc import Iterator, Mapping, Sequence

from restir_ref.oracle.zoo.page import percent, row
from restir_ref.transport.proofs.zoo.bug import CHECKS, ModelBug, TransportBug
from restir_ref.transport.proofs.zoo.cures import CACHE_CURES, GRADIENT_CURES, PATH_CURES

HEAD = """
## In paths and shifts

These need geometry, and no enumeration: each was planted in the light transport of `restir_ref/transport` and
rendered in a scene of flatland that suits it. Reuse is nearly symmetric, so that what one pixel loses its neighbour
gains: {mean} of {all} show in the mean of the image, though single pixels are off by tens of percent. Look at paths
first, then at pixels, and at means last.

| what it looks like | mistake | how it gets in | cure | breaks | seen by |
|---|---|---|---|---|---|
"""

CACHED = """
## In a cache of light

Mistakes of those who let a cache of probes tell what surfaces send, and resample it: each on a model that is exact,
with the bias of its places and cells.

| what it looks like | mistake | how it gets in | cure | breaks | cells |
|---|---|---|---|---|---|
"""

DIFFERENCES = """
## In differences of pixels

Mistakes of gradient renderers: pairs of pixels on finite cells, history that keeps its place on the film, a row of
pixels seen by a G-buffer; each exact, and each with a table of its own that tells its name
(`restir_ref.transport.proofs.zoo.gradients.named`). The bias of a *difference* is relative to it: +50 % is an edge one
and a half times as strong, -100 % none. What is wrong with history is that of cells. Where there is no bias,
+100 % is a pair of pixels wrongly marked and -100 % one wrongly not.

| what it looks like | mistake | how it gets in | cure | breaks | off by |
|---|---|---|---|---|---|
"""

CHECKS_HEAD = """
| check | what must hold |
|---|---|
"""


def section(bugs: Sequence[TransportBug]) -> Iterator[str]:
    """The section, as Markdown, in parts."""
    yield HEAD.format(mean=sum("mean of the image" in bug.caught_by for bug in bugs), all=len(bugs))
    for bug in sorted(bugs, key=lambda bug: bug.symptom):
        yield row(
            [bug.symptom, f"**{bug.name}**", bug.story, PATH_CURES[bug.name], bug.breaks, ", ".join(bug.caught_by)]
        )
    yield CHECKS_HEAD
    yield from (row([name, law]) for name, law in CHECKS.items())


def cached(bugs: Sequence[ModelBug]) -> Iterator[str]:
    """The section about caches, as Markdown, in parts."""
    yield CACHED
    yield from modelled(bugs, CACHE_CURES)


def differences(bugs: Sequence[ModelBug]) -> Iterator[str]:
    """The section about gradients, as Markdown, in parts."""
    yield DIFFERENCES
    yield from modelled(bugs, GRADIENT_CURES)


def modelled(bugs: Sequence[ModelBug], cures: Mapping[str, str]) -> Iterator[str]:
    """A row for every mistake on a model, by its symptom, with the range of what it is off by."""
    for bug in sorted(bugs, key=lambda bug: bug.symptom):
        wrong = bug.wrong()
        ends = dict.fromkeys((percent(wrong.min()), percent(wrong.max())))
        words = bug.symptom, f"**{bug.name}**", bug.story, cures[bug.name], bug.breaks
        yield row([*words, " to ".join(ends)])

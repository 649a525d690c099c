"""The transport's part of the index of symptoms."""

from collections.abc import Iterator, Sequence

from restir_ref.oracle.zoo.page import percent, row
from restir_ref.transport.proofs.zoo.bug import CHECKS, TransportBug
from restir_ref.transport.proofs.zoo.cached import CacheBug
from restir_ref.transport.proofs.zoo.cures import CACHE_CURES, PATH_CURES

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


def cached(bugs: Sequence[CacheBug]) -> Iterator[str]:
    """The section about caches, as Markdown, in parts."""
    yield CACHED
    for bug in sorted(bugs, key=lambda bug: bug.symptom):
        wrong = bug.wrong()
        ends = dict.fromkeys((percent(wrong.min()), percent(wrong.max())))
        words = bug.symptom, f"**{bug.name}**", bug.story, CACHE_CURES[bug.name], bug.breaks
        yield row([*words, " to ".join(ends)])

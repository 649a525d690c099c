"""Which bugs of the zoo have the same signature: the same table of exact biases per cell, on the same scene.

A bug is compared in its own loop and in simpler ones, as long as they are unbiased without the bug.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cache, partial

import numpy as np

from restir_ref.batch import Array
from restir_ref.mis import WEIGHTS
from restir_ref.oracle.laws import bias_per_cell, expected_weight
from restir_ref.oracle.scenes import Parts, Scene, one_frame
from restir_ref.oracle.zoo import BUGS, Bug

FEW_LEAVES = 100_000
"""Bugs whose enumeration is larger on this scene are not compared."""

ALIKE, MOST_ALIKE = 0.9, 3
"""From which likeness on bugs are named, and how many at most."""


@dataclass(frozen=True, eq=False)
class Signature:
    """The exact bias per cell (n, K) of a bug in one of its loops."""

    bug: str
    loop: str
    bias: Array


@dataclass(frozen=True)
class Lookalike:
    """A bug of the zoo in one of its loops; likeness is the cosine between both tables of biases, 1 if proportional."""

    bug: str
    loop: str
    likeness: float
    same: bool

    def __str__(self) -> str:
        said = "exactly this table" if self.same else f"likeness {self.likeness:.3f}"
        return f'"{self.bug}" ({self.loop}): {said}'


def lookalikes(bias: Array, signatures: Iterable[Signature], tolerance: float) -> tuple[Lookalike, ...]:
    """Bugs with exactly this table of biases (n, K), or else the most similar ones; each in its most similar loop."""
    best: dict[str, Lookalike] = {}
    for each in signatures:
        found = _likeness(bias, each, tolerance)
        best[each.bug] = max(best.get(each.bug, found), found, key=lambda alike: (alike.same, alike.likeness))
    same = tuple(each for each in best.values() if each.same)
    alike = sorted(best.values(), key=lambda each: -each.likeness)[:MOST_ALIKE]
    return same or tuple(each for each in alike if each.likeness >= ALIKE)


def _likeness(bias: Array, known: Signature, tolerance: float) -> Lookalike:
    cosine = (bias * known.bias).sum() / np.sqrt((bias**2).sum() * (known.bias**2).sum())
    return Lookalike(known.bug, known.loop, float(cosine), _largest(bias - known.bias) <= tolerance)


def signatures(scene: Scene, tolerance: float) -> Iterator[Signature]:
    """Those of every bug in every loop that runs on this scene and is biased by nothing but the bug."""
    table = cache(partial(_table, scene=scene))
    for bug in BUGS.values():
        for loop, right, wrong in _loops(bug):
            if _largest(table(right)) <= tolerance < _largest(table(wrong)):
                yield Signature(bug.name, loop, table(wrong))


def _largest(table: Array) -> float:
    return float(abs(table).max())


def _table(parts: Parts, scene: Scene) -> Array:
    """Bias per cell of a loop; 0 everywhere if it cannot run on this scene, or not in time."""
    try:
        return bias_per_cell(expected_weight(parts(scene), scene.v, most_leaves=FEW_LEAVES), scene.v, scene.support)
    except ValueError:  # a loop over two frames on a scene of one, mutations without a table, or too many leaves
        return np.zeros(scene.v.shape)


def _loops(bug: Bug) -> Iterator[tuple[str, Parts, Parts]]:
    """The bug's own loop, and one frame of it with every weight that is not itself the bug: right and wrong."""
    yield "its own loop", bug.right, bug.wrong
    yield "one frame", replace(bug.right, steps=one_frame), replace(bug.wrong, steps=one_frame)
    if bug.wrong.across is not bug.right.across:
        return
    merged_anew = bug.wrong.spatial is not bug.right.spatial  # and then c_i/m_i may be left out
    for name, mis in WEIGHTS.items():
        if mis.c is None or not merged_anew:
            right, wrong = (replace(parts, steps=one_frame, across=mis) for parts in (bug.right, bug.wrong))
            yield f"one frame, {name} weights", right, wrong

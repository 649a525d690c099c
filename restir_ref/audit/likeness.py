"""Which bugs of the zoo have the same signature: exactly the same table of biases per cell, on the same scene.

A bug is compared in its own loop and in simpler ones, as long as they are unbiased without the bug.  Tables that are
only similar say nothing: of random tables without a bright cell every second is similar to that of some bug.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cache, partial

import numpy as np

from restir_ref.batch import Array
from restir_ref.mis import WEIGHTS
from restir_ref.oracle.laws import bias_per_cell, expected_weight
from restir_ref.oracle.scenes import Parts, Scene, new_samples, no_motion, one_frame, temporal_only, two_rounds
from restir_ref.oracle.zoo import BUGS, Bug

FEW_LEAVES = 100_000
"""Bugs whose enumeration is larger on this scene are not compared."""

OTHER_LOOPS = {
    "new samples only": new_samples,
    "one frame": one_frame,
    "temporal only": temporal_only,
    "two rounds": two_rounds,
    "no motion": no_motion,
}
"""Loops that a bug is tried in beside its own."""


@dataclass(frozen=True, eq=False)
class Signature:
    """The exact bias per cell (n, K) of a bug in one of its loops."""

    bug: str
    loop: str
    bias: Array


@dataclass(frozen=True)
class Lookalike:
    """A bug of the zoo, and the loop in which it has the same table."""

    bug: str
    loop: str

    def __str__(self) -> str:
        return f'"{self.bug}" ({self.loop}): exactly this table'


def lookalikes(bias: Array, signatures: Iterable[Signature], tolerance: float) -> tuple[Lookalike, ...]:
    """Bugs with exactly this table of biases (n, K), each in the first loop in which it has it."""
    found: dict[str, Lookalike] = {}
    for each in signatures:
        if each.bug not in found and _largest(bias - each.bias) <= tolerance:
            found[each.bug] = Lookalike(each.bug, each.loop)
    return tuple(found.values())


def signatures(scene: Scene, tolerance: float) -> Iterator[Signature]:
    """Those of every bug in every loop that runs on this scene and is biased by nothing but the bug."""
    table = cache(partial(table_of, scene=scene))
    for bug in BUGS.values():
        for loop, right, wrong in loops(bug):
            if _largest(table(right)) <= tolerance < _largest(table(wrong)):
                yield Signature(bug.name, loop, table(wrong))


def _largest(table: Array) -> float:
    return float(abs(table).max())


def table_of(parts: Parts, scene: Scene) -> Array:
    """Bias per cell of a loop; 0 everywhere if it cannot run on this scene, or not in time."""
    try:
        return bias_per_cell(expected_weight(parts(scene), scene.v, most_leaves=FEW_LEAVES), scene.v, scene.support)
    except ValueError:  # a loop over two frames on a scene of one, mutations without a table, or too many leaves
        return np.zeros(scene.v.shape)


def loops(bug: Bug) -> Iterator[tuple[str, Parts, Parts]]:
    """The bug's own loop, the others, and one frame with every weight that is not itself the bug: right and wrong."""
    yield "its own loop", bug.right, bug.wrong
    for loop, steps in OTHER_LOOPS.items():
        yield loop, replace(bug.right, steps=steps), replace(bug.wrong, steps=steps)
    if bug.wrong.across is not bug.right.across:
        return
    merged_anew = bug.wrong.spatial is not bug.right.spatial  # and then c_i/m_i may be left out
    for name, mis in WEIGHTS.items():
        if mis.c is None or not merged_anew:
            right, wrong = (replace(parts, steps=one_frame, across=mis) for parts in (bug.right, bug.wrong))
            yield f"one frame, {name} weights", right, wrong

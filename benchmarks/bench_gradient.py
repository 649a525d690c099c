"""What gradients cost: primal + dx + dy over primal in rays and CPU time, with and without one tree for all readers.

A map of flatland and a piece of Checker3's floor, which stand still, in their second frame.  There are three ways to
draw candidates for pairs: the pixels' trees are read by all of them (`offered`), as this project has it; every pair
has trees of its own, for both of its signs, as in the paper [GPT 4.4]; every reservoir has (`candidates`).  All else
is the same.  Rays are counted, times are ratios of CPU times of one run, the least of interleaved repeats.
Exits with 1 if a tree for all saves less than half of the rays of initial candidates of dx + dy.  Takes 90 s.
"""

import sys
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from unittest.mock import patch

import numpy as np
from bench_resampling import Row, keep_freed_memory, print_sections
from bench_transport import cpu, rng

from figures.experiments.gradients import ADAPTIVE, DENSE, NONE, SIDE, Spatial, views_of
from figures.experiments.pans import SIZE, floor_views
from restir_ref import gradient_loop
from restir_ref.batch import Array
from restir_ref.chance import Chance, Live
from restir_ref.gradient import Drawn, Pairs
from restir_ref.gradient_loop import GRADIENT, PRIMAL, Group, History, Parts, View, first, sampled, step
from restir_ref.integrals import Pixels
from restir_ref.restir import resample
from restir_ref.transport.counting import rays

REPLICAS, REPEATS = 4, 3
"""Of a frame, and how often times are taken."""

First = Callable[[Group, Array, list[Drawn], Chance], Parts]
"""How a group gets its samples, like `gradient_loop.first`."""


def own_trees_of_pairs(group: Group, index: Array, drawn: list[Drawn], chance: Chance) -> Parts:
    """Trees for every pair, read by both of its signs."""
    some = next(iter(group.of.values()))
    offered = list(some.candidates(index, chance)) if isinstance(some, Pairs) else drawn
    return {part: resample(offered, Pixels(of, index), chance) for part, of in group.of.items()}


def own_trees_of_reservoirs(group: Group, index: Array, drawn: list[Drawn], chance: Chance) -> Parts:
    """Trees for every reservoir."""
    of_pairs = any(isinstance(of, Pairs) for of in group.of.values())
    return {
        part: resample(of.candidates(index, chance) if of_pairs else drawn, Pixels(of, index), chance)
        for part, of in group.of.items()
    }


WAYS: Mapping[str, First] = {
    "one tree for all": first,
    "own trees of pairs": own_trees_of_pairs,
    "own trees of reservoirs": own_trees_of_reservoirs,
}


Stage = Callable[["Scene", tuple[str, ...], First], object]


@dataclass(frozen=True, eq=False)
class Scene:
    """A view of pixels and pairs that follows itself, with its history, and what it has asked for."""

    view: View
    asked: Counter[str]
    last: tuple[View, History]

    def rays(self, work: Callable[[], object]) -> float:
        """Per pixel, of some work on all replicas."""
        before = rays(self.asked)
        work()
        return (rays(self.asked) - before) / (REPLICAS * self.view[PRIMAL].n)


def flat(spatial: Spatial, asked: Counter[str]) -> View:
    """The map around a corner of a post."""
    return views_of("occluders map", GRADIENT, spatial, asked)[0]


def solid(spatial: Spatial, asked: Counter[str]) -> View:
    """The middle of Checker3's floor."""
    return floor_views(1, GRADIENT, spatial, asked)[0]


def scene(make: Callable[[Spatial, Counter[str]], View], spatial: Spatial) -> Scene:
    """The view after its first frame."""
    asked = Counter[str]()
    view = make(spatial, asked)
    return Scene(view, asked, (view, step(view, Live(rng()), GRADIENT, REPLICAS)))


def framed(on: Scene, names: tuple[str, ...], way: First) -> History:
    """The second frame of some groups."""
    some = {name: on.view[name] for name in names}
    with patch.object(gradient_loop, "first", way):
        return step(some, Live(rng()), GRADIENT, REPLICAS, on.last)


def started(on: Scene, names: tuple[str, ...], way: First) -> list[Parts]:
    """The initial stage of some groups, the pixels' trees drawn for all of them."""
    chance = Live(rng())
    drawn = sampled(on.view[PRIMAL].of[PRIMAL], chance, GRADIENT.pixels.trees, REPLICAS)
    return [way(on.view[name], np.arange(REPLICAS * on.view[name].n), drawn, chance) for name in names]


def counts(on: Scene, stage: Stage) -> dict[str, float]:
    """Rays per pixel of primal alone, and of primal + dx + dy by all ways."""
    return {name: on.rays(run) for name, run in runs_of(on, stage).items()}


def runs_of(on: Scene, stage: Stage) -> dict[str, Callable[[], object]]:
    """One stage of the primal alone, and of primal + dx + dy by all ways."""
    everything = {name: partial(stage, on, tuple(on.view), way) for name, way in WAYS.items()}
    return {"primal": partial(stage, on, (PRIMAL,), first), **everything}


def initial(on: Scene) -> Iterator[Row]:
    """Rays of dx + dy alone, before anything is reused."""
    count = counts(on, started)
    yield Row("initial candidates: rays per pixel of the primal", count["primal"], claims="GPT-C09")
    alone = {name: count[name] - count["primal"] for name in WAYS}
    yield from (Row(f"initial candidates: rays per pixel of dx + dy, {name}", each) for name, each in alone.items())
    shared, *apart = alone.values()
    yield Row("initial candidates: those by one tree for all over the next fewest", shared / min(apart), most=0.5)


def compared(what: str, on: Scene) -> Iterator[Row]:
    """Rays and CPU time of a frame of primal + dx + dy by all ways, over those of the primal."""
    count, seconds = counts(on, framed), cpu(runs_of(on, framed), REPEATS)
    yield Row(f"{what}: rays per pixel of the primal", count["primal"])
    for unit, cost in {"rays": count, "CPU time": seconds}.items():
        for name in WAYS:
            dearer = cost[name] / cost["primal"]
            yield Row(f"{what}: primal + dx + dy over primal in {unit}, {name}", dearer, claims="GPT-C09")


def costs(make: Callable[[Spatial, Counter[str]], View]) -> Iterator[Row]:
    """Rows of one scene."""
    yield from initial(scene(make, NONE))
    for name, spatial in SPATIALS.items():
        on = scene(make, spatial)
        active = sum(int(group.active.sum()) for group in on.view.values()) - on.view[PRIMAL].n
        yield from compared(f"a frame, {name} reuse in space ({active})", on)


SPATIALS: Mapping[str, Spatial] = {"no pairs": NONE, "edge pairs": ADAPTIVE, "all pairs": DENSE}

SECTIONS = {
    f"Flatland, {SIDE} x {SIDE} pixels of a map of the occluders": partial(costs, flat),
    f"Space, {SIZE} x {SIZE} pixels of Checker3": partial(costs, solid),
}


def main() -> int:
    """Print all rows, grouped; 1 if a requirement is missed."""
    keep_freed_memory()
    return print_sections(SECTIONS)


if __name__ == "__main__":
    sys.exit(main())

"""Images in two parts: direct light by ReSTIR DI, everything else by another renderer.  [GRIS 9.3, Fig. 15]

Renderers that are compared add the same direct light, so that only the rest differs.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from figures.claims.figure import Arrays
from figures.experiments.realtime import Method, approach, judged, moved
from figures.experiments.rendering import estimates, path_tracing
from figures.experiments.views import HYBRID, Traced, at_random, motion_vectors, view
from restir_ref.batch import Array
from restir_ref.chance import Chance, Live
from restir_ref.integrals import Pixels, Reservoirs, Shifted
from restir_ref.loop import REAL_TIME
from restir_ref.resampling import Candidate, select
from restir_ref.restir import shade
from restir_ref.transport.baselines.restir_di import DEBIASED, direct_light, indirect_light, light_integrals
from restir_ref.transport.paths import Path, Tree, leaves, trace
from restir_ref.transport.record import record
from restir_ref.transport.restir_pt import PathIntegrals
from restir_ref.transport.subtrees import of_leaf


def without_direct(tree: Tree) -> Iterator[tuple[int, bool, Array]]:
    """(k, nee, F) of every leaf, black where ReSTIR DI stands for it: k = 1, but for lights met by delta lobes."""
    by_delta = tree.at[0].p == 0
    for k, nee, F in leaves(tree):
        yield k, nee, F if k != 1 else F * (by_delta & (not nee))


@dataclass(frozen=True, eq=False)
class IndirectIntegrals(PathIntegrals):
    """The path integrals without what ReSTIR DI stands for.

    What is left of k = 1 is not shared: from another pixel the same numbers may choose a lobe that is ReSTIR DI's.
    """

    def candidates(self, index: Array, chance: Chance) -> Iterator[tuple[Path, Array]]:
        """One path tree, resampled to one of its leaves."""
        t, one = self.tracer, np.ones(len(index))
        tree = trace(t, chance.uniform((t.D, len(index))), index % self.n)
        k, nee, F = zip(*without_direct(tree), strict=True)
        offered = [Candidate(np.full(len(one), i), each.mean(axis=0), one) for i, each in enumerate(F)]
        leaf = (chosen := select(offered, chance, one)).x
        yield record(t, tree, np.array(k)[leaf], np.array(nee)[leaf], of_leaf(list(F), leaf)), chosen.W

    def shift(self, x: Path, index: Array, to: Pixels) -> Shifted:
        """As for all paths, but undefined both ways for k = 1."""
        y = super().shift(x, index, to)
        return Shifted(y.x, np.where(x.k == 1, 0.0, y.J))


INDIRECT = Method(HYBRID, IndirectIntegrals)


def direct(scene: str, replicas: int, rng: np.random.Generator) -> Arrays:
    """The last frame of a moving camera, direct light alone, (replicas, n)."""
    asked = Counter[str]()
    views = [view(scene, HYBRID, asked, sensor) for sensor in approach(scene)]
    *_, images = direct_film(views, replicas, Live(rng))
    return {"images": judged(scene, images)}


def direct_film(views: Sequence[Traced], replicas: int, chance: Chance) -> Iterator[Array]:
    """Frames of ReSTIR DI, (replicas, n) each, with the neighbours of the real-time preset."""
    history: Reservoirs | None = None
    last: Pixels | None = None
    for k, of in enumerate(views):
        index, t = np.arange(replicas * of.n), of.tracer
        here = Pixels(light_integrals(t, chance.uniform((t.D, len(index))), index % of.n), index)
        before = []
        if last is not None:
            there = motion_vectors(of, views[k - 1])[index % of.n]
            before = [Pixels(last.of, index - index % of.n + there)]
        near = at_random(of, index, REAL_TIME.neighbours, REAL_TIME.radius, chance)
        around = [Pixels(here.of, each.index) for each in near]
        history = direct_light(here, around, DEBIASED["defensive"], chance, history, before)
        last = here
        yield np.asarray(shade(history, here).mean(axis=0).reshape(replicas, of.n))


def indirect(scene: str, replicas: int, rng: np.random.Generator) -> Arrays:
    """The same of everything else, by ReSTIR PT, with its rays per pixel."""
    return moved(INDIRECT, scene, replicas, rng)


def indirect_trees(scene: str, count: int, rng: np.random.Generator) -> Arrays:
    """Everything else by independent path trees, (count, n), and rays per tree.

    Rays towards lights from x_1, at most one per tree, are not charged: their leaves are black.
    """
    asked = Counter[str]()
    found = estimates(path_tracing(1, indirect_light), view(scene, HYBRID, asked), asked, count, Live(rng))
    return {"images": found.images, "rays": np.array(found.rays - 1)}

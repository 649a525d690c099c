"""What ReSTIR shares between pixels where direct light is left to ReSTIR DI, or out of the picture.  [GRIS 9.3]"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from figures.experiments.realtime import Method
from figures.experiments.split_light import IndirectIntegrals
from figures.experiments.views import HYBRID
from restir_ref.batch import Array
from restir_ref.chance import Chance
from restir_ref.integrals import Pixels, Shifted
from restir_ref.transport.baselines.restir_gi import RadianceIntegrals, Stored, keeps_radiance
from restir_ref.transport.paths import RECONNECTION, Connectability, Leaf, Tree, leaves, trace
from restir_ref.transport.record import record
from restir_ref.transport.restir_pt import ReconnectionAtX2
from restir_ref.transport.subtrees import behind, of_leaf, one_leaf


@dataclass(frozen=True, eq=False)
class IndirectReconnection(IndirectIntegrals, ReconnectionAtX2):
    """Indirect light shared by the reconnection shift, taken literally."""


@dataclass(frozen=True, eq=False)
class IndirectRadiance(RadianceIntegrals):
    """Indirect light as ReSTIR GI shares it."""

    def candidates(self, index: Array, chance: Chance) -> Iterator[tuple[Stored, Array]]:
        """As `RadianceIntegrals` does it, of trees without direct light."""
        t = self.tracer
        tree = darkened(trace(t, chance.uniform((t.D, len(index))), index % self.n))
        leaf, W = one_leaf(tree, chance)
        k, nee, F = zip(*leaves(tree), strict=True)
        x = record(t, tree, np.array(k)[leaf], np.array(nee)[leaf], of_leaf(list(F), leaf))
        none = np.zeros_like(F[0])
        L = of_leaf([none, none, *(L for _, _, L in leaves(behind(tree)))], leaf)
        z, at = tree.x[1], tree.at[0]
        A = np.where(keeps_radiance(x), at.p * z.o[-1] / tree.r[1] ** (t.scene.space.d - 1), x.A)
        yield Stored(replace(x, A=A), z.n, L), W

    def shift(self, x: Stored, index: Array, to: Pixels) -> Shifted:
        """As for all light, but undefined both ways for k = 1, as in `IndirectIntegrals`."""
        y = super().shift(x, index, to)
        return Shifted(y.x, np.where(x.path.k == 1, 0.0, y.J))


def darkened(tree: Tree) -> Tree:
    """The tree without the leaves that ReSTIR DI stands for: k = 1, but for lights met by delta lobes."""
    (light, w), hit = tree.lights[0], tree.hits[0]
    by_delta = tree.at[0].p == 0
    near = Leaf(0 * light.end, light.bare, light.p_light), w
    met = Leaf(hit.end * by_delta, hit.bare, hit.p_light)
    return replace(tree, lights=[near, *tree.lights[1:]], hits=[met, *tree.hits[1:]])


METHODS: Mapping[str, Method] = MappingProxyType(
    {
        "hybrid": Method(HYBRID, IndirectIntegrals),
        "no distance test": Method(Connectability(HYBRID.roughness, 0.0), IndirectIntegrals),
        "reconnection": Method(RECONNECTION, IndirectReconnection),
        "ReSTIR GI": Method(RECONNECTION, IndirectRadiance),
    }
)
"""`realtime.METHODS` of indirect light."""

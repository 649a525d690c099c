"""Counting rays: the same scene, which says how often it was asked; what is compared is equal rays, not equal time.

Together with `restir_ref.counting.Counting` around `PathIntegrals`, over the same `asked`, a whole
renderer's cost is known, whatever the machine.
"""

from collections import Counter
from dataclasses import dataclass, replace

from restir_ref.batch import Array
from restir_ref.transport.intersection import Surfaces
from restir_ref.transport.scene import Scene

CLOSEST = "closest-hit rays"
SHADOW = "shadow rays"


@dataclass(frozen=True, eq=False)
class Counted:
    """The same surfaces; asked[CLOSEST] and asked[SHADOW] count rays, one per column."""

    surfaces: Surfaces
    asked: Counter[str]

    def intersect(self, x: Array, w: Array) -> tuple[Array, Array]:
        """Distance and primitive, counted."""
        self.asked[CLOSEST] += x.shape[-1]
        return self.surfaces.intersect(x, w)

    def visible(self, x: Array, y: Array) -> Array:
        """Whether nothing stands between x and y, counted."""
        self.asked[SHADOW] += x.shape[-1]
        return self.surfaces.visible(x, y)

    def foremost(self, x: Array, prim: Array, w: Array) -> Array:
        """What a ray meets first of what is in one place: no ray of its own."""
        return self.surfaces.foremost(x, prim, w)


def counted(scene: Scene, asked: Counter[str]) -> Scene:
    """`scene`, counting into `asked`, and no longer into what it counted into before."""
    plain = scene.surfaces.surfaces if isinstance(scene.surfaces, Counted) else scene.surfaces
    return replace(scene, surfaces=Counted(plain, asked))


def rays(asked: Counter[str]) -> int:
    """Closest-hit plus shadow rays: the cost at which renderers are compared."""
    return asked[CLOSEST] + asked[SHADOW]

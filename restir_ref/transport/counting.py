"""Counting rays: the same scene, which says how often it was asked; what is compared is equal rays, not equal time.

Together with `restir_ref.counting.Counting` around `PathIntegrals`, over the same `asked`, a whole
renderer's cost is known, whatever the machine.
"""

from collections import Counter
from dataclasses import dataclass, field, fields

from restir_ref.batch import Array
from restir_ref.transport.scene import Scene

CLOSEST = "closest-hit rays"
SHADOW = "shadow rays"


@dataclass(frozen=True, eq=False)
class CountedScene(Scene):
    """The same scene; asked[CLOSEST] and asked[SHADOW] count rays, one per column."""

    asked: Counter[str] = field(default_factory=Counter)

    def intersect(self, x: Array, w: Array) -> tuple[Array, Array]:
        """Distance and primitive, counted."""
        self.asked[CLOSEST] += x.shape[-1]
        return super().intersect(x, w)

    def visible(self, x: Array, y: Array) -> Array:
        """Whether nothing stands between x and y, counted."""
        self.asked[SHADOW] += x.shape[-1]
        return super().visible(x, y)


def counted(scene: Scene, asked: Counter[str]) -> CountedScene:
    """`scene`, counting into `asked`."""
    return CountedScene(**{each.name: getattr(scene, each.name) for each in fields(Scene)}, asked=asked)


def rays(asked: Counter[str]) -> int:
    """Closest-hit plus shadow rays: the cost at which renderers are compared."""
    return asked[CLOSEST] + asked[SHADOW]

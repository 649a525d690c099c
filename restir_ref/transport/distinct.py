"""Rays that are asked for twice in one question are traced once: what the leaves of a tree share costs once.

The paths of a tree are shifted together, one column each.  Up to where they part their offset paths are the same, and
so are their rays, to the last bit.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from restir_ref.batch import Array, take
from restir_ref.transport.intersection import Surfaces
from restir_ref.transport.scene import Scene


@dataclass(frozen=True, eq=False)
class Distinct:
    """The same surfaces, asked once for columns that are equal."""

    surfaces: Surfaces

    def intersect(self, x: Array, w: Array) -> tuple[Array, Array]:
        """Distance and primitive of all rays."""
        found: tuple[Array, Array] = once(self.surfaces.intersect, x, w)
        return found

    def visible(self, x: Array, y: Array) -> Array:
        """Whether nothing stands between x and y."""
        return np.asarray(once(self.surfaces.visible, x, y))

    def foremost(self, x: Array, prim: Array, w: Array) -> Array:
        """What a ray meets first of what is in one place: no ray of its own."""
        return self.surfaces.foremost(x, prim, w)


def distinct(scene: Scene) -> Scene:
    """`scene`, whose equal rays are traced (and counted, if it counts) once in every question.

    >>> from collections import Counter
    >>> import numpy as np
    >>> from flatland2d import setting
    >>> from restir_ref.transport.counting import counted, rays
    >>> from restir_ref.transport.distinct import distinct
    >>> asked = Counter()
    >>> room = distinct(counted(setting("cornell").scene, asked))
    >>> x, w = np.full((2, 5), 0.5), np.repeat([[0.6], [0.8]], 5, axis=1)
    >>> _ = room.intersect(x, w)
    >>> rays(asked)
    1
    """
    return replace(scene, surfaces=Distinct(scene.surfaces))


def once(answers: Callable[[Array, Array], Any], x: Array, y: Array) -> Any:
    """answers(x, y) of columns (d, N), each two that are equal to the last bit answered together."""
    rows = np.ascontiguousarray(np.concatenate([x, y]).T)
    _, first, place = np.unique(
        rows.view(np.dtype((np.void, rows.itemsize * rows.shape[1]))).ravel(), return_index=True, return_inverse=True
    )
    return take(answers(x.take(first, axis=-1), y.take(first, axis=-1)), place)

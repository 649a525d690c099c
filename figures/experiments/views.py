"""What figures look at, in the plane and in space: a scene by its name, its rule of connections, sensor and neighbours.

Scenes of flatland go by their own names, those of space by the names they have in `solid`.
"""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Any, Protocol

import numpy as np

from figures.experiments import solid
from flatland2d import SCENES
from flatland2d.motion import motion
from flatland2d.sensors import Pinhole
from restir_ref.batch import Array
from restir_ref.chance import Chance
from restir_ref.images import Shape, random_in_disk, spread_in_disk, tiles
from restir_ref.integrals import Image, Pixels
from restir_ref.loop import Around, random_in_row, spread_in_row
from restir_ref.transport.baselines.path_reuse import TILE
from restir_ref.transport.counting import counted
from restir_ref.transport.paths import RECONNECTION, Connectability, Sensor, Tracer
from restir_ref.transport.restir_pt import PathIntegrals
from restir_ref.transport.scene import Scene
from tracer3d.motion import mosaic_sources
from tracer3d.sensors import Mosaic

HYBRID = Connectability(0.2, 0.02)
"""Roughness .2, and 2% of the rooms' height, the unit of length: 1% of the width where that is 2.

[GRIS 8.3] has 1% to 5% of the scene's size.
"""

RULES: Mapping[str, Connectability] = MappingProxyType({"reconnection": RECONNECTION, "hybrid": HYBRID})


SIDE = 4
"""Rows and columns of a tile of path reuse in space.  [GRIS 9.3]"""


class Traced(Image, Protocol):
    """An image of traced paths, whatever its shifts keep."""

    @property
    def tracer(self) -> Tracer:
        """Scene, sensor, depth and rule."""


def setting(scene: str) -> Any:
    """A setting of flatland2d or tracer3d: scene, depth and camera."""
    name, _ = solid.INSETS.get(scene, (scene, None))
    return (solid.SCENES if in_space(scene) else SCENES)[name]()


def in_space(scene: str) -> bool:
    """Whether the name is that of a scene of tracer3d."""
    return scene in solid.SCENES or scene in solid.INSETS


def standard(scene: str) -> Any:
    """The sensor unless told otherwise: the inset of flatland, the crops of space, or the inset that the name says."""
    if scene in solid.INSETS:
        return solid.inset(scene)
    return solid.crops(setting(scene)) if in_space(scene) else setting(scene).pinhole()


def view(
    scene: str,
    rule: Connectability,
    asked: Counter[str],
    sensor: Sensor | None = None,
    integrals: Callable[[Tracer], PathIntegrals] = PathIntegrals,
) -> PathIntegrals:
    """The scene as its standard sensor sees it, or another one; it counts its rays."""
    s = setting(scene)
    return integrals(Tracer(counted(s.scene, asked), sensor or standard(scene), s.depth, rule))


# ---------------------------------------------------------------- neighbours, of pixels in a row or in a plane


def at_random(of: Image, index: Array, count: int, radius: float, chance: Chance) -> Sequence[Pixels]:
    """Random neighbours, as real-time frames choose them."""
    return _around(of, random_in_row, random_in_disk)(of, index, count, radius, chance)


def evenly(of: Image, index: Array, count: int, radius: float, chance: Chance) -> Sequence[Pixels]:
    """Neighbours from a low-discrepancy sequence, as offline frames choose them."""
    return _around(of, spread_in_row, spread_in_disk)(of, index, count, radius, chance)


def _around(of: Any, row: Around, disk: Callable[[Shape], Around]) -> Around:
    shape = _shape(of)
    return row if shape is None else disk(shape)


def _shape(of: Any) -> Shape | None:
    """Rows and columns of an image, or of each of its crops; none if its pixels stand in a row."""
    shape: Shape | None = getattr(of.tracer.sensor, "shape", None)
    return shape


def tile_order(of: Traced) -> tuple[Array, int]:
    """Pixels (n,) in an order in which those of each tile of path reuse stand together, and how many these are."""
    shape = _shape(of)
    if shape is None:
        return np.arange(of.n), TILE
    return tiles((of.n // shape[1], shape[1]), SIDE), SIDE**2


def motion_vectors(of: Traced, before: Traced) -> Array:
    """The previous pixel of every pixel, (n,), uncounted: drivers charge `realtime.MOTION_RAYS` for it."""
    t, was = of.tracer, before.tracer.sensor
    find: Callable[[Any, Any, Any], Array] = mosaic_sources if isinstance(was, Mosaic) else _row_sources
    return find(counted(t.scene, Counter()), t.sensor, was)


def _row_sources(scene: Scene, now: Pinhole, before: Pinhole) -> Array:
    return motion(scene, now, before).source

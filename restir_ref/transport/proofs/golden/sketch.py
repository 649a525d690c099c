"""Small scenes with a ray per pixel, all of whose numbers are the same in float32."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from restir_ref.batch import Array
from restir_ref.transport.materials import Material
from restir_ref.transport.paths import Connectability, Tracer
from restir_ref.transport.scene import Ball, Facet, scene
from restir_ref.transport.space import Space
from restir_ref.transport.vectors import normalize

RULE = Connectability(0.1875, 0.0625)
"""Lobes of roughness 1/8 are replayed, and so are connections shorter than 1/16."""


@dataclass(frozen=True, eq=False)
class Eyes:
    """A sensor whose pixels have one ray each, of weight 1: from start (d, n) towards at (d, n)."""

    start: Array
    at: Array

    numbers: int = 0
    film_numbers: int = 0

    @property
    def n(self) -> int:
        """Number of pixels."""
        return int(self.start.shape[-1])

    def ray(self, pixel: Array, u: Array) -> tuple[Array, Array, Array]:
        """Start (d, N), direction (d, N), weight (N,)."""
        start = self.start.take(pixel, axis=-1)
        return start, normalize(self.at.take(pixel, axis=-1) - start), np.ones(len(pixel))


@dataclass(frozen=True)
class Sketch:
    """What a file says of a scene: lists as `scene` takes them, eyes as pairs of points, depth and rule of paths."""

    name: str
    about: str
    materials: Sequence[Material]
    facets: Sequence[Facet]
    eyes: Sequence[tuple[Sequence[float], Sequence[float]]]
    balls: Sequence[Ball] = ()
    depth: int = 3
    rule: Connectability = RULE

    def tracer(self, space: Space) -> Tracer:
        """The tracer of the scene."""
        start, at = np.moveaxis(np.array(self.eyes, dtype=float), 0, -1)
        made = scene(space, self.materials, self.facets, self.balls)
        return Tracer(made, Eyes(start, at), self.depth, self.rule)

    def described(self) -> dict[str, Any]:
        """The scene as the file has it."""
        return {
            "materials": [asdict(each) for each in self.materials],
            "facets": [asdict(each) for each in self.facets],
            "balls": [asdict(each) for each in self.balls],
            "eyes": {"start": [start for start, _ in self.eyes], "at": [at for _, at in self.eyes]},
            "depth": self.depth,
            "rule": asdict(self.rule),
        }


def not_float32(value: Any, where: str = "") -> list[str]:
    """Numbers of a description that float32 does not have, each with its place."""
    if isinstance(value, dict):
        return [odd for key, each in value.items() for odd in not_float32(each, f"{where}.{key}")]
    if isinstance(value, list | tuple):
        return [odd for k, each in enumerate(value) for odd in not_float32(each, f"{where}[{k}]")]
    if isinstance(value, float) and float(np.float32(value)) != value:
        return [f"{where.lstrip('.')} = {value!r}"]
    return []

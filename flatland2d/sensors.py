"""Two sensors: a pinhole row, and a fluence map whose pixels are places in the plane."""

from dataclasses import dataclass

import numpy as np

from restir_ref.batch import Array
from restir_ref.transport.vectors import normalize

FILM = 1920
"""Pixels of the virtual film: the papers' pixel radii mean what they mean there."""


@dataclass(frozen=True)
class Pinhole:
    """A row of n pixels, a crop of a film of `film` pixels that starts at pixel `first`.

    eye and towards are points; `half` is the tangent of half the field of view.
    """

    eye: tuple[float, float]
    towards: tuple[float, float]
    n: int
    half: float = 0.6
    first: int = 0
    film: int = FILM

    numbers: int = 1

    def ray(self, pixel: Array, u: Array) -> tuple[Array, Array, Array]:
        """A ray through the pixel; box filter, weight 1."""
        forward = normalize(np.subtract(self.towards, self.eye)[:, None])
        right = np.stack([forward[1], -forward[0]])
        s = (2 * (self.first + pixel + u[0]) / self.film - 1) * self.half
        w = normalize(forward + s * right)
        return np.broadcast_to(np.array(self.eye)[:, None], w.shape), w, np.ones(len(pixel))


@dataclass(frozen=True)
class FluenceMap:
    """columns x rows pixels over the rectangle low .. high; each integrates radiance from all directions."""

    low: tuple[float, float]
    high: tuple[float, float]
    columns: int
    rows: int

    numbers: int = 3

    @property
    def n(self) -> int:
        """Number of pixels; pixel = row * columns + column, row 0 at the bottom."""
        return self.columns * self.rows

    def ray(self, pixel: Array, u: Array) -> tuple[Array, Array, Array]:
        """A uniform place of the pixel and a uniform direction; weight 2 pi."""
        cell = np.stack([pixel % self.columns, pixel // self.columns]) + u[:2]
        low, high = np.array(self.low)[:, None], np.array(self.high)[:, None]
        x = low + cell / np.array([[self.columns], [self.rows]]) * (high - low)
        angle = 2 * np.pi * u[2]
        return x, np.stack([np.cos(angle), np.sin(angle)]), np.full(len(pixel), 2 * np.pi)

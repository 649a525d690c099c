"""Two sensors: a pinhole row, and a fluence map whose pixels are places in the plane."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from restir_ref.batch import Array
from restir_ref.guards import whole
from restir_ref.transport.paths import Sensor
from restir_ref.transport.rays import arrive
from restir_ref.transport.scene import Scene
from restir_ref.transport.vectors import dot, normalize

FILM = 1920
"""Pixels of the virtual film: the papers' pixel radii mean what they mean there."""


@dataclass(frozen=True)
class Pinhole:
    """A row of n pixels, a crop of a film of `film` pixels that starts at pixel `first`.

    eye and towards are points; `half` is the tangent of half the field of view.
    Raises ValueError for points without 2 coordinates, a crop that is empty, not on the film or not of
    whole pixels, no direction, or no field of view.

    >>> import numpy as np
    >>> from flatland2d import Pinhole
    >>> eye = Pinhole(eye=(0.0, 0.0), towards=(1.0, 0.0), n=3, half=1.0, film=3)
    >>> x, w, weight = eye.ray(np.arange(3), np.full((1, 3), 0.5))
    >>> w.round(2)
    array([[ 0.83,  1.  ,  0.83],
           [ 0.55,  0.  , -0.55]])
    >>> eye.project(x + w).round(2)
    array([0.5, 1.5, 2.5])
    """

    eye: tuple[float, float]
    towards: tuple[float, float]
    n: int
    half: float = 0.6
    first: int = 0
    film: int = FILM

    def __post_init__(self) -> None:
        _check_points(self.eye, self.towards)
        if not (self.n > 0 and 0 <= self.first <= self.film - self.n):
            raise ValueError(
                f"a crop needs pixels on the film, 0 .. {self.film - 1}, but begins at {self.first} and has {self.n}."
            )
        for name, pixels in (("n", self.n), ("first", self.first), ("film", self.film)):
            whole(pixels, 0, f"{name} of a pinhole", "It counts pixels.")
        if not 0 < self.half < np.inf:
            raise ValueError(
                f"half, the tangent of half the field of view, must be positive and finite, but is {self.half}."
            )
        if not 0 < np.linalg.norm(np.subtract(self.towards, self.eye)) < np.inf:
            raise ValueError(f"the pinhole needs a direction to look in: eye {self.eye}, towards {self.towards}.")

    @property
    def numbers(self) -> int:
        """One number: the place on the film."""
        return 1

    @property
    def film_numbers(self) -> int:
        """That number."""
        return 1

    def ray(self, pixel: Array, u: Array) -> tuple[Array, Array, Array]:
        """A ray through the pixel; box filter, weight 1."""
        forward, right = self._axes()
        s = (2 * (self.first + pixel + u[0]) / self.film - 1) * self.half
        w = normalize(forward + s * right)
        return np.broadcast_to(np.array(self.eye, dtype=float)[:, None], w.shape), w, np.ones(len(pixel))

    def project(self, x: Array) -> Array:
        """Where points (2, N) are on the crop, pixel + u, also beyond its ends; inf behind the eye."""
        forward, right = self._axes()
        to = x - np.array(self.eye, dtype=float)[:, None]
        depth = dot(forward, to)
        s = dot(right, to) / np.where(depth > 0, depth, 1)
        return np.where(depth > 0, (s / self.half + 1) * self.film / 2 - self.first, np.inf)

    def _axes(self) -> tuple[Array, Array]:
        """Forward and to the right, (2, 1) each."""
        forward = normalize(np.subtract(self.towards, self.eye)[:, None])
        return forward, np.stack([forward[1], -forward[0]])


@dataclass(frozen=True)
class FluenceMap:
    """columns x rows pixels over the rectangle low .. high; each integrates radiance from all directions.

    Raises ValueError for no whole pixels, points without 2 coordinates, or an empty rectangle.

    >>> import numpy as np
    >>> from flatland2d import FluenceMap
    >>> places = FluenceMap(low=(0.0, 0.0), high=(2.0, 1.0), columns=4, rows=2)
    >>> x, _, weight = places.ray(np.arange(places.n), np.full((3, places.n), 0.5))
    >>> x[:, 5], weight[5].round(3)
    (array([0.75, 0.75]), np.float64(6.283))
    """

    low: tuple[float, float]
    high: tuple[float, float]
    columns: int
    rows: int

    def __post_init__(self) -> None:
        if not (self.columns > 0 and self.rows > 0):
            raise ValueError(f"a fluence map needs pixels, but has {self.columns} columns and {self.rows} rows.")
        for name, pixels in (("columns", self.columns), ("rows", self.rows)):
            whole(pixels, 1, f"{name} of a fluence map", "It counts pixels.")
        _check_points(self.low, self.high)
        size = np.subtract(self.high, self.low)
        if not (np.isfinite(size).all() and (size > 0).all()):
            raise ValueError(f"a fluence map needs low below high, but has {self.low} and {self.high}.")

    @property
    def n(self) -> int:
        """Number of pixels; pixel = row * columns + column, row 0 at the bottom."""
        return self.columns * self.rows

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the image."""
        return self.rows, self.columns

    @property
    def numbers(self) -> int:
        """Three numbers: the place in the pixel, and the direction."""
        return 3

    @property
    def film_numbers(self) -> int:
        """The place, to the right and up; the direction is not."""
        return 2

    def ray(self, pixel: Array, u: Array) -> tuple[Array, Array, Array]:
        """A uniform place of the pixel and a uniform direction; weight 2 pi."""
        cell = np.stack([pixel % self.columns, pixel // self.columns]) + u[:2]
        low, high = np.array(self.low)[:, None], np.array(self.high)[:, None]
        x = low + cell / np.array([[self.columns], [self.rows]]) * (high - low)
        angle = 2 * np.pi * u[2]
        return x, np.stack([np.cos(angle), np.sin(angle)]), np.full(len(pixel), 2 * np.pi)


def _check_points(*points: Sequence[float]) -> None:
    for point in points:
        if np.shape(point) != (2,):
            raise ValueError(f"a point of the plane has 2 coordinates, but this one is {point}.")


def facing(scene: Scene, sensor: Sensor, at: float = 0.5) -> Array:
    """What each pixel sees where all its numbers are `at`: 1 the front of a surface, -1 a back, 0 nothing; (n,)."""
    pixel = np.arange(sensor.n)
    x, w, _ = sensor.ray(pixel, np.full((sensor.numbers, sensor.n), at))
    v, _, met = arrive(scene, x, w)
    return np.asarray(np.where(v.front, 1, -1) * met)


def check_view(scene: Scene, sensor: Sensor) -> None:
    """Raise ValueError if no pixel sees the front of a surface: the sensor is inside a solid, or out of doors.

    >>> from flatland2d import Pinhole, check_view, setting
    >>> check_view(setting("cornell").scene, Pinhole((0.5, 0.5), (1.0, 0.5), 8))
    """
    directions = (np.arange(8) + 0.5) / 8
    if not any((facing(scene, sensor, at) > 0).any() for at in directions):
        raise ValueError(
            f"{sensor} sees only backs of surfaces, or nothing: it stands in a solid or outside the room. "
            f"Move it, or turn the facets round: their fronts are on the left of the way from corner to corner."
        )

"""A pinhole camera, whose images are crops of a film."""

from dataclasses import dataclass, replace

import numpy as np

from restir_ref.batch import Array
from restir_ref.guards import whole
from restir_ref.transport.paths import Sensor
from restir_ref.transport.rays import arrive
from restir_ref.transport.scene import Scene
from restir_ref.transport.vectors import dot, normalize

Point = tuple[float, float, float]

FILM = 1920, 1080
"""Columns and rows of the virtual film: the papers' pixel radii mean what they mean there."""

UP = (0.0, 1.0, 0.0)


@dataclass(frozen=True)
class Pinhole:
    """An image of width x height pixels, a crop of a film whose corner is at column `left` and row `top` of it.

    eye and towards are points, `up` is a direction that the film shows upright; `half` is the tangent of half the
    horizontal field of view, and the film's pixels are square.  Pixels are numbered row by row from the top left.
    Raises ValueError for points without 3 coordinates, a crop that is empty, not on the film or not of
    whole pixels, no direction, one along `up`, or no field of view.

    >>> import numpy as np
    >>> from tracer3d import setting
    >>> eye = setting("cornell").pinhole(8, 4)
    >>> x, w, _ = eye.ray(np.arange(eye.n), np.full((eye.numbers, eye.n), 0.5))
    >>> eye.shape, w.shape
    ((4, 8), (3, 32))
    """

    eye: Point
    towards: Point
    width: int
    height: int
    half: float = 0.6
    left: int = 0
    top: int = 0
    film: tuple[int, int] = FILM
    up: Point = UP

    def __post_init__(self) -> None:
        for point in (self.eye, self.towards, self.up):
            if np.shape(point) != (3,):
                raise ValueError(f"a point of space has 3 coordinates, but this one is {point}.")
        _check_crop("columns", self.left, self.width, self.film[0])
        _check_crop("rows", self.top, self.height, self.film[1])
        if not 0 < self.half < np.inf:
            raise ValueError(
                f"half, the tangent of half the field of view, must be positive and finite, but is {self.half}."
            )
        forward = np.subtract(self.towards, self.eye)
        if not 0 < np.linalg.norm(forward) < np.inf:
            raise ValueError(f"the pinhole needs a direction to look in: eye {self.eye}, towards {self.towards}.")
        if not np.linalg.norm(np.cross(forward, self.up)) > 1e-6 * np.linalg.norm(forward) * np.linalg.norm(self.up):
            raise ValueError(
                f"the pinhole looks along its own up {self.up}, from {self.eye} towards {self.towards}: "
                f"say up=(0, 0, -1), or another direction that the film is to show upright."
            )

    @property
    def n(self) -> int:
        """Number of pixels; pixel = row * width + column."""
        return self.width * self.height

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the image."""
        return self.height, self.width

    @property
    def numbers(self) -> int:
        """Two numbers: the place in the pixel, to the right and down."""
        return 2

    @property
    def film_numbers(self) -> int:
        """Both numbers."""
        return 2

    def ray(self, pixel: Array, u: Array) -> tuple[Array, Array, Array]:
        """A ray through the pixel; box filter, weight 1."""
        return self.through(self.left + pixel % self.width + u[0], self.top + pixel // self.width + u[1])

    def through(self, column: Array, row: Array) -> tuple[Array, Array, Array]:
        """Rays through places of the film (N,), pixels count from its top left corner; weight 1."""
        forward, right, up = self.axes()
        columns, rows = self.film
        s = (2 * column / columns - 1) * self.half
        t = (rows - 2 * row) / columns * self.half
        w = normalize(forward + s * right + t * up)
        return np.broadcast_to(np.array(self.eye, dtype=float)[:, None], w.shape), w, np.ones(len(column))

    def project(self, x: Array) -> Array:
        """Where points (3, N) are on the crop, column and row, also beyond its borders; inf behind the eye; (2, N)."""
        forward, right, up = self.axes()
        columns, rows = self.film
        to = x - np.array(self.eye, dtype=float)[:, None]
        depth = dot(forward, to)
        scale = columns / 2 / self.half / np.where(depth > 0, depth, 1)
        place = np.stack([dot(right, to) * scale + columns / 2 - self.left, rows / 2 - dot(up, to) * scale - self.top])
        return np.where(depth > 0, place, np.inf)

    def axes(self) -> tuple[Array, Array, Array]:
        """Forward, to the right and up, (3, 1) each."""
        forward = normalize(np.subtract(self.towards, self.eye, dtype=float)[:, None])
        right = normalize(np.cross(forward, np.array(self.up, dtype=float)[:, None], axis=0))
        return forward, right, np.cross(right, forward, axis=0)


@dataclass(frozen=True)
class Mosaic:
    """Several crops of one film as one image: equally large, and pixels are numbered crop by crop.

    pinhole  the camera, whose own crop has the size of each;  corners  column and row of the film where each begins
    No pixel has neighbours in another crop.  Raises ValueError for no crop and for one off the film.
    """

    pinhole: Pinhole
    corners: tuple[tuple[int, int], ...]

    def __post_init__(self) -> None:
        if not self.corners:
            raise ValueError("a mosaic needs the corner of at least one crop, but has none.")
        self.crops()

    def crops(self) -> list[Pinhole]:
        """Each crop as a camera of its own."""
        return [replace(self.pinhole, left=left, top=top) for left, top in self.corners]

    @property
    def n(self) -> int:
        """Number of pixels of all crops."""
        return len(self.corners) * self.pinhole.n

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of each crop."""
        return self.pinhole.shape

    @property
    def numbers(self) -> int:
        """Two numbers: the place in the pixel, to the right and down."""
        return self.pinhole.numbers

    @property
    def film_numbers(self) -> int:
        """Both numbers."""
        return 2

    def ray(self, pixel: Array, u: Array) -> tuple[Array, Array, Array]:
        """A ray through the pixel; box filter, weight 1."""
        crop, place = np.divmod(pixel, self.pinhole.n)
        left, top = np.array(self.corners).T[:, crop]
        width = self.pinhole.width
        return self.pinhole.through(left + place % width + u[0], top + place // width + u[1])


def _check_crop(what: str, first: int, count: int, film: int) -> None:
    if not (count > 0 and 0 <= first <= film - count):
        raise ValueError(
            f"a crop needs {what} of the film, 0 .. {film - 1}, but begins at {first} and has {count}: "
            f"move it, or make it smaller."
        )
    for pixels in (first, count, film):
        whole(pixels, 0, f"each number of {what} of a pinhole", "It counts pixels.")


def facing(scene: Scene, sensor: Sensor, at: float = 0.5) -> Array:
    """What each pixel sees where all its numbers are `at`: 1 the front of a surface, -1 a back, 0 nothing; (n,)."""
    pixel = np.arange(sensor.n)
    x, w, _ = sensor.ray(pixel, np.full((sensor.numbers, sensor.n), at))
    v, _, met = arrive(scene, x, w)
    return np.asarray(np.where(v.front, 1, -1) * met)


def check_view(scene: Scene, sensor: Sensor) -> None:
    """Raise ValueError if no pixel sees the front of a surface: the sensor is inside a solid, or looks elsewhere.

    >>> from tracer3d import check_view, setting
    >>> room = setting("cornell")
    >>> check_view(room.scene, room.pinhole(8, 8))
    """
    if not (facing(scene, sensor) > 0).any():
        raise ValueError(
            f"{sensor} sees only backs of surfaces, or nothing: it stands in a solid or looks past everything. "
            f"Move it, or turn the facets round: corners go counterclockwise round the side that is their front."
        )

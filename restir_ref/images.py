"""Images of rows and columns, pixel = row * columns + column: neighbours in a disk, tiles, neighbours that see alike.

What `loop` does in a row of pixels; here distances are those of the plane.  An image may consist of several crops of
the same shape, pixel by pixel one after the other: neighbours are those of the same crop.
"""

from collections.abc import Callable, Sequence

import numpy as np

from restir_ref.batch import Array
from restir_ref.chance import Chance
from restir_ref.integrals import NOWHERE, Image, Pixels
from restir_ref.loop import GOLDEN, Around

Shape = tuple[int, int]

Alike = Callable[[Array, Array], Array]
"""Whether pixels j see like pixels i, all (N,): a comparison of G-buffers, never of samples."""

TRIES = 8
"""Neighbours that are tried until one sees alike."""


def random_in_disk(shape: Shape) -> Around:
    """Neighbours uniform in the disk of a radius around each pixel of rows x columns, mirrored at the borders.

    Near a border a mirrored one can be the pixel itself: unbiased, but its own sample then counts twice.
    The choice raises ValueError for a radius below 1, and for images that are not whole crops of that shape.

    >>> import numpy as np
    >>> from restir_ref import Live
    >>> from restir_ref.images import random_in_disk
    >>> from toy1d import image_of_64
    >>> near = random_in_disk((8, 8))(image_of_64(), np.array([0, 27]), 2, 1.5, Live(np.random.default_rng(1)))
    >>> [each.index for each in near]
    [array([ 9, 36]), array([ 8, 36])]
    """

    def around(of: Image, index: Array, count: int, radius: float, chance: Chance) -> list[Pixels]:
        steps = disk(radius)
        chosen = (chance.uniform((count, len(index))) * steps.shape[1]).astype(int)
        return [_moved(of, shape, index, steps[:, k]) for k in chosen]

    return around


def spread_in_disk(shape: Shape) -> Around:
    """The same, evenly spread: one neighbour in each of `count` rings of equal size, golden angles apart.

    The first angle is random in every column.
    """

    def around(of: Image, index: Array, count: int, radius: float, chance: Chance) -> list[Pixels]:
        rings = _rings(disk(radius), count)
        start, near = chance.uniform((len(index),)), []
        for k in range(count):
            ring = rings[k % len(rings)]
            turn = (start + k * GOLDEN) % 1
            near.append(_moved(of, shape, index, ring[:, (turn * ring.shape[1]).astype(int)]))
        return near

    return around


def alike_among(alike: Alike, around: Around, tries: int = TRIES) -> Around:
    """Neighbours of another choice that see alike: the first of so many tries that does, else `NOWHERE`.

    Never the pixel itself, which would be merged with its own sample and count it twice.  A choice by G-buffers, never
    by samples; memory does not grow with the square of the image.  [Bitterli 2020; GPT 4.3.2]
    """

    def among(of: Image, index: Array, count: int, radius: float, chance: Chance) -> list[Pixels]:
        tried = around(of, index, count * tries, radius, chance)
        return [_first_alike(alike, of, index, tried[k * tries : (k + 1) * tries]) for k in range(count)]

    return among


def tiles(shape: Shape, side: int = 4) -> Array:
    """Pixels (n,) in an order in which those of each side x side tile stand together.  [Bekaert 2002; GRIS 9.3]

    Path reuse for pixels in this order reuses by these tiles; image[:, tiles] = estimates puts them back.
    Raises ValueError unless tiles fill the image.

    >>> from restir_ref.images import tiles
    >>> tiles((2, 4), side=2)
    array([0, 1, 4, 5, 2, 3, 6, 7])
    """
    rows, columns = shape
    if side < 1 or rows % side or columns % side:
        raise ValueError(f"an image of {rows} x {columns} pixels cannot be cut into tiles of {side} x {side}.")
    pixel = np.arange(rows * columns).reshape(rows // side, side, columns // side, side)
    return pixel.swapaxes(1, 2).reshape(-1)


def disk(radius: float) -> Array:
    """Steps (2, K) to all pixels within the radius but the pixel itself, rows first, the nearest ones first.

    Raises ValueError for a radius below 1.

    >>> from restir_ref.images import disk
    >>> disk(1)
    array([[ 0, -1,  1,  0],
           [-1,  0,  0,  1]])
    """
    if not 1 <= radius < np.inf:
        raise ValueError(
            f"neighbours are 1 .. radius pixels away, but the radius is {radius}: take 1, or no neighbours."
        )
    reach = np.arange(-int(radius), int(radius) + 1)
    steps = np.stack(np.meshgrid(reach, reach)).reshape(2, -1)
    far = (steps**2).sum(axis=0)
    order = np.argsort(far, kind="stable")
    return steps[:, order[(far[order] > 0) & (far[order] <= radius**2)]]


def _rings(steps: Array, count: int) -> list[Array]:
    """At most `count` rings of equally many steps, each counterclockwise."""
    rings = np.array_split(steps, min(count, steps.shape[1]), axis=1)
    return [ring[:, np.argsort(np.arctan2(ring[0], ring[1]), kind="stable")] for ring in rings]


def _first_alike(alike: Alike, of: Image, index: Array, tried: Sequence[Pixels]) -> Pixels:
    """The first of the neighbours tried that is another one and sees alike, else `NOWHERE`."""
    found, left = np.full_like(index, NOWHERE), np.arange(len(index))
    for near in tried:
        here, there = index.take(left), near.index.take(left)
        like = (there != here) & alike(here % of.n, there % of.n)
        found[left[like]] = there[like]
        left = left[~like]
        if not len(left):
            break
    return Pixels(of, found)


def _moved(of: Image, shape: Shape, index: Array, step: Array) -> Pixels:
    """Steps (2, N) away, mirrored at the borders: a wave of period 2 (rows - 1) down, 2 (columns - 1) aside."""
    rows, columns = shape
    if of.n % (rows * columns):
        raise ValueError(f"neighbours were asked for in {rows} x {columns} pixels, but the image has {of.n}.")
    pixel = index % (rows * columns)
    row, column = _mirrored(pixel // columns + step[0], rows), _mirrored(pixel % columns + step[1], columns)
    return Pixels(of, index - pixel + row * columns + column)


def _mirrored(place: Array, n: int) -> Array:
    place = place % max(2 * (n - 1), 1)
    return np.asarray(np.minimum(place, 2 * (n - 1) - place))

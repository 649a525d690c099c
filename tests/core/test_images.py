"""Neighbours in a disk, neighbours that see alike, and tiles: exact counts, and mistakes that the counts notice."""

from collections import Counter
from dataclasses import dataclass

import numpy as np
import pytest

from restir_ref import images
from restir_ref.batch import Array
from restir_ref.images import alike_among, disk, random_in_disk, spread_in_disk, tiles
from restir_ref.integrals import NOWHERE, Pixels
from restir_ref.loop import GOLDEN, Around, random_in_row
from tests.core.stubs import live

AROUND = {"random": random_in_disk, "spread": spread_in_disk}
each_choice = pytest.mark.parametrize("choice", AROUND.values(), ids=AROUND)
SHAPE = (40, 60)
MIDDLE = 20 * 60 + 30


@dataclass(frozen=True)
class Image:
    """An image of which only the number of pixels matters."""

    n: int


def near(around: Around, shape: tuple[int, int], count: int, radius: float, pixel: Array) -> Array:
    """The neighbours' columns, (count, N)."""
    found = around(Image(shape[0] * shape[1]), pixel, count, radius, live())  # type: ignore[arg-type]
    return np.stack([each.index for each in found])


def steps(around: Around, shape: tuple[int, int], count: int, radius: float, pixel: Array) -> Array:
    """How far they are away, rows first, (2, count, N)."""
    found = near(around, shape, count, radius, pixel)
    return np.stack([found // shape[1] - pixel // shape[1], found % shape[1] - pixel % shape[1]])


def points_within(radius: float) -> set[tuple[int, int]]:
    """The lattice points of a disk but its centre, one by one."""
    reach = range(-int(radius), int(radius) + 1)
    return {(a, b) for a in reach for b in reach if 0 < a * a + b * b <= radius * radius}


@pytest.mark.parametrize("radius", [1, 1.5, 4, 10, 20])
def test_a_disk_holds_every_pixel_within_its_radius_once_and_the_nearest_first(radius):
    found = disk(radius)
    assert sorted(map(tuple, found.T.tolist())) == sorted(points_within(radius))
    assert (np.diff((found**2).sum(axis=0)) >= 0).all()


@pytest.mark.parametrize("radius", [1.5, 10])
def test_steps_are_whole_numbers(radius):
    assert disk(radius).dtype.kind == "i"


def test_the_papers_radii_hold_316_and_1256_pixels():
    assert (disk(10).shape[1], disk(20).shape[1]) == (316, 1256)


@each_choice
def test_neighbours_are_all_pixels_of_the_disk_but_never_the_pixel_itself(choice):
    found = steps(choice(SHAPE), SHAPE, 6, 5, np.full(5000, MIDDLE))
    assert set(zip(*found.reshape(2, -1).tolist(), strict=True)) == points_within(5)


def unevenness(choice) -> float:
    """Largest |z| of the counts of 80 steps against equally likely ones."""
    counts = Counter(
        zip(*steps(choice(SHAPE), SHAPE, 4, 5, np.full(50_000, MIDDLE)).reshape(2, -1).tolist(), strict=True)
    )
    expected = 200_000 / 80
    return max(abs(counts[each] - expected) for each in points_within(5)) / np.sqrt(expected)


@each_choice
def test_all_pixels_of_the_disk_are_equally_likely(choice):
    assert unevenness(choice) < 4.5


def polar(shape) -> Around:
    """A mistake: the radius uniform, so that the middle is crowded."""

    def around(of, index, count, radius, chance):
        r, turn = chance.uniform((2, count, len(index)))
        r = 1 + r * (radius - 1)
        rows, columns = np.round(r * np.sin(2 * np.pi * turn)), np.round(r * np.cos(2 * np.pi * turn))
        return [
            images._moved(of, shape, index, np.stack([a, b]).astype(int)) for a, b in zip(rows, columns, strict=True)
        ]

    return around


def test_a_crowded_middle_is_noticed():
    assert unevenness(polar) > 20


@each_choice
def test_neighbours_stay_in_their_replica(choice):
    pixel = np.arange(3 * 12)
    found = near(choice((3, 4)), (3, 4), 6, 10, pixel)
    assert (found // 12 == pixel // 12).all()
    assert set((found % 12).ravel()) == set(range(12))


def mirrored(shape: tuple[int, int], radius: int, pixel: tuple[int, int]) -> Counter:
    """Where the steps of the disk lead in an image that goes on in mirrors."""
    number = np.pad(np.arange(shape[0] * shape[1]).reshape(shape), radius, mode="reflect")
    return Counter(number[pixel[0] + radius + a, pixel[1] + radius + b] for a, b in points_within(radius))


@pytest.mark.parametrize("shape", [(5, 5), (3, 7), (8, 2), (1, 7)])
def test_the_image_goes_on_in_mirrors_beyond_its_borders(shape):
    of, step = Image(shape[0] * shape[1]), disk(6)
    for pixel in range(of.n):
        found = images._moved(of, shape, np.full(step.shape[1], pixel), step).index
        assert Counter(found.tolist()) == mirrored(shape, 6, divmod(pixel, shape[1]))


def test_steps_go_down_and_to_the_right():
    found = images._moved(Image(2400), SHAPE, np.array([MIDDLE, 2400 + MIDDLE]), np.array([[1, -2], [3, 4]])).index  # type: ignore[arg-type]
    assert found.tolist() == [MIDDLE + 60 + 3, 2400 + MIDDLE - 120 + 4]


def test_wrapping_instead_of_mirroring_is_noticed(monkeypatch):
    monkeypatch.setattr(images, "_mirrored", lambda place, n: place % n)
    step = disk(6)
    found = images._moved(Image(25), (5, 5), np.zeros(step.shape[1], dtype=int), step).index
    assert Counter(found.tolist()) != mirrored((5, 5), 6, (0, 0))


def clumping(choice) -> float:
    """Mean over pixels of the distance from a neighbour to the next one, in radii; of six within 10 pixels."""
    found = steps(choice(SHAPE), SHAPE, 6, 10, np.full(4000, MIDDLE)).astype(float)
    gaps = np.sqrt(((found[:, :, None] - found[:, None]) ** 2).sum(axis=0))
    gaps[np.arange(6), np.arange(6)] = np.inf
    return float(gaps.min(axis=0).mean() / 10)


@pytest.mark.claims("GRIS-A08", part="neighbours in a disk", world="tracer3d")
def test_spread_neighbours_are_further_from_each_other_than_random_ones():
    assert clumping(spread_in_disk) > 1.25 * clumping(random_in_disk)


def test_spread_neighbours_are_one_in_each_of_rings_of_equal_size_and_golden_angles_apart():
    rows, columns = steps(spread_in_disk(SHAPE), SHAPE, 6, 15, np.full(500, MIDDLE)).astype(float)
    far2, borders = rows**2 + columns**2, np.linspace(0, 15**2, 7)
    for ring, low, high in zip(far2, borders, borders[1:], strict=False):
        assert low - 4 < ring.min() <= ring.max() < high + 4
    turned = np.diff(np.arctan2(rows, columns), axis=0) / (2 * np.pi) % 1
    assert turned == pytest.approx(GOLDEN, abs=0.1)


@each_choice
@pytest.mark.parametrize("radius", [0, 0.5, -3, np.nan, np.inf])
def test_a_radius_that_reaches_no_other_pixel_is_refused_by_name(choice, radius):
    with pytest.raises(ValueError, match=rf"the radius is {radius}: take 1"):
        near(choice(SHAPE), SHAPE, 3, radius, np.arange(10))


@each_choice
def test_an_image_of_another_size_is_refused(choice):
    with pytest.raises(ValueError, match="asked for in 3 x 4 pixels, but the image has 13"):
        choice((3, 4))(Image(13), np.arange(13), 3, 2, live())


@each_choice
def test_more_neighbours_than_pixels_come_again(choice):
    found = steps(choice(SHAPE), SHAPE, 9, 1, np.full(2000, MIDDLE))
    assert set(zip(*found.reshape(2, -1).tolist(), strict=True)) == points_within(1)


# ---------------------------------------------------------------- that see alike


def stripes(width: int):
    """Pixels see alike in the even columns, and in the odd ones."""
    return lambda i, j: i % width % 2 == j % width % 2


@pytest.mark.parametrize(("around", "shape"), [(random_in_disk(SHAPE), SHAPE), (spread_in_disk(SHAPE), SHAPE)])
def test_neighbours_that_see_alike_are_others_that_do_or_nobody(around, shape):
    pixel = np.arange(shape[0] * shape[1])
    found = near(alike_among(stripes(60), around), shape, 3, 6, pixel)
    nobody = found == NOWHERE
    assert (nobody | stripes(60)(pixel, found)).all()
    assert nobody.mean() < 0.01 + 0.5**8
    assert (found != pixel).all()


def test_one_that_is_the_pixel_itself_is_passed_over():
    """Of steps 0 and 1 the second is taken, of 0 alone none."""
    everybody = alike_among(lambda i, j: i >= 0, listed(0, 1, 0, 0), 2)
    first, second = everybody(Image(9), np.array([3, 5]), 2, 9, live())  # type: ignore[arg-type]
    assert first.index.tolist() == [4, 6]
    assert second.index.tolist() == [NOWHERE, NOWHERE]


def listed(*steps_):
    """A choice that tries these steps in their order."""
    return lambda of, index, count, radius, chance: [Pixels(of, index + step) for step in steps_]


def test_it_is_the_first_of_those_tried_that_is_taken_and_replicas_look_at_the_same_g_buffer():
    g_buffer = np.array([1, 0, 1, 1, 0, 0])
    around = alike_among(lambda i, j: g_buffer[i] == g_buffer[j], listed(1, 2, 3, 4), 2)
    first, second = around(Image(6), np.array([0, 6]), 2, 9, live())  # type: ignore[arg-type]
    assert first.index.tolist() == [2, 8]
    assert second.index.tolist() == [3, 9]


def test_eight_are_tried_for_each():
    """Three of four steps lead to the left, or back to the pixel itself."""
    found = near(alike_among(lambda i, j: i < j, random_in_disk((1, 3))), (1, 3), 2, 1, np.ones(200_000, dtype=int))
    assert (found == NOWHERE).mean(axis=1) == pytest.approx(0.75**8, rel=0.05)


def test_in_a_row_they_are_drawn_by_the_same_function():
    pixel = np.full(40_000, 50)
    found = near(alike_among(lambda i, j: j % 3 == 0, random_in_row, 16), (1, 101), 1, 10, pixel)[0]
    counts = np.bincount(found[found != NOWHERE], minlength=101)
    assert set(np.flatnonzero(counts)) <= {*range(42, 61, 3)}
    assert np.abs(counts[42:61:3] / counts[42:61:3].mean() - 1).max() < 0.06


def test_a_pixel_unlike_all_others_has_no_neighbours():
    found = near(alike_among(lambda i, j: i == j, random_in_disk(SHAPE)), SHAPE, 3, 6, np.arange(2400))
    assert (found == NOWHERE).all()


def test_random_neighbours_do_not_see_alike():
    pixel = np.arange(2400)
    assert not stripes(60)(pixel, near(random_in_disk(SHAPE), SHAPE, 3, 6, pixel)).all()


def test_spread_neighbours_that_see_alike_are_about_as_far_away_as_others():
    pixel = np.full(3000, MIDDLE)
    far = [
        np.hypot(*steps(around, SHAPE, 6, 10, pixel)).mean()
        for around in (spread_in_disk(SHAPE), alike_among(stripes(60), spread_in_disk(SHAPE)))
    ]
    assert far[1] == pytest.approx(far[0], rel=0.1)


# ---------------------------------------------------------------- tiles


def test_tiles_stand_together_and_hold_every_pixel_once():
    order = tiles((8, 12))
    assert sorted(order) == list(range(96))
    rows, columns = order.reshape(-1, 16) // 12, order.reshape(-1, 16) % 12
    for place in (rows, columns):
        assert (np.ptp(place, axis=1) == 3).all()
        assert (place.min(axis=1) % 4 == 0).all()


def test_rows_of_sixteen_pixels_are_no_tiles():
    columns = np.arange(96).reshape(-1, 16) % 12
    assert (np.ptp(columns, axis=1) != 3).all()


def test_images_that_tiles_do_not_fill_are_refused():
    with pytest.raises(ValueError, match="8 x 10 pixels cannot be cut into tiles of 4 x 4"):
        tiles((8, 10))
    with pytest.raises(ValueError, match="10 x 8 pixels"):
        tiles((10, 8))
    with pytest.raises(ValueError, match="tiles of 0 x 0"):
        tiles((8, 8), 0)
    assert (tiles((2, 3), 1) == np.arange(6)).all()

"""Presets are the paper's; neighbours stay near, and those of the offline preset are evenly spread."""

from dataclasses import asdict, dataclass, replace

import numpy as np
import pytest

from flatland2d import SCENES
from flatland2d.scenes import Setting
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.integrals import Pixels, Reservoirs
from restir_ref.loop import OFFLINE, REAL_TIME, Around, Preset, _moved, frame, random_in_row, spread_in_row
from restir_ref.mis import WEIGHTS
from restir_ref.restir import initial, spatial, temporal
from tests.core.stubs import live
from toy1d import overlapping_supports

AROUND = {"random": random_in_row, "spread": spread_in_row}
each_choice = pytest.mark.parametrize("around", AROUND.values(), ids=AROUND)


@dataclass(frozen=True)
class Row:
    """An image of which only the number of pixels matters."""

    n: int


def steps(around: Around, n: int, count: int, radius: float, pixel: Array, seed: int = 1) -> Array:
    """How far the neighbours of `pixel` are away, (count, N)."""
    found = around(Row(n), pixel, count, radius, live(seed))  # type: ignore[arg-type]
    return np.stack([each.index for each in found]) - pixel


def star_discrepancy(u: Array) -> Array:
    """D* = max_k max(k / M - u_k, u_k - (k - 1) / M) for u sorted, (M, N) -> (N,)."""
    u, k = np.sort(u, axis=0), np.arange(1, len(u) + 1)[:, None]
    return np.asarray(np.maximum(k / len(u) - u, u - (k - 1) / len(u)).max(axis=0))


def discrepancy_of_neighbours(around: Around) -> float:
    """Mean D* of the offline preset's neighbours, in a row so wide that pixels hardly round them."""
    reach, middle = 500_000, np.full(20_000, 1_000_000)
    u = (steps(around, 2_000_001, OFFLINE.neighbours, reach, middle) + reach) / (2 * reach)
    return float(star_discrepancy(u).mean())


@pytest.mark.claims("GRIS-A07")
def test_the_real_time_preset_is_the_papers():
    reuse = {"rounds": 1, "neighbours": 3, "radius": 20, "cap": 20}
    assert asdict(REAL_TIME) == {"trees": 1, **reuse, "along": "talbot", "across": "defensive"}


def distinct(pool: float, count: int) -> float:
    """Expected number of different neighbours among `count` that are uniform in a pool."""
    return float(pool * (1 - (1 - 1 / pool) ** count))


def distinct_in_row(radius: float) -> float:
    """The same, measured: of the real-time preset's neighbours in the middle of a row, with another radius."""
    found = np.sort(steps(random_in_row, 1920, REAL_TIME.neighbours, radius, np.full(100_000, 960)), axis=0)
    return float(1 + (np.diff(found, axis=0) > 0).sum(axis=0).mean())


def radius_scaled_to(setting: Setting) -> float:
    """The real-time radius in pixels for a film of the setting's sensor, the paper's having 1920 pixels."""
    return REAL_TIME.radius * setting.pinhole().film / 1920


@pytest.mark.claims("GRIS-A07", part="the radius in images of one dimension", world="flatland2d")
@pytest.mark.parametrize("scene", SCENES)
def test_in_rows_of_pixels_the_radius_is_the_papers_share_of_the_film_and_finds_as_many_neighbours(scene):
    """20 pixels of 1920; a row has 40 pixels that near and a disc 1256, so that 2% of the three are met twice."""
    radius = radius_scaled_to(SCENES[scene]())
    assert radius == REAL_TIME.radius
    assert distinct_in_row(radius) == pytest.approx(distinct(2 * radius, 3), abs=0.005)
    assert distinct(2 * radius, 3) > 0.97 * distinct(np.pi * radius**2, 3)


@pytest.mark.claims("GRIS-A07", part="the radius in images of one dimension", world="flatland2d")
def test_a_radius_scaled_to_an_inset_taken_for_the_film_meets_the_same_neighbours_again_and_again():
    inset = SCENES["cornell"]()
    alone = replace(inset.pinhole(), film=inset.pinhole().n, first=0)
    radius = REAL_TIME.radius * alone.film / 1920
    assert distinct_in_row(radius) < 0.6 * distinct(np.pi * REAL_TIME.radius**2, 3)


@pytest.mark.claims("GRIS-A08")
def test_the_offline_preset_is_the_papers():
    values = asdict(OFFLINE)
    assert np.isnan(values.pop("cap"))  # there is no temporal reuse to be capped
    reuse = {"rounds": 3, "neighbours": 6, "radius": 10}
    assert values == {"trees": 32, **reuse, "along": "talbot", "across": "defensive"}


@pytest.mark.claims("GRIS-A08")
def test_spread_neighbours_have_less_discrepancy_than_random_ones():
    random, spread = (discrepancy_of_neighbours(around) for around in (random_in_row, spread_in_row))
    assert spread / random < 0.7
    exact = star_discrepancy(live(2).uniform((OFFLINE.neighbours, 20_000))).mean()
    assert abs(random / exact - 1) < 0.02  # so the random ones are what they are compared with


def test_the_discrepancy_of_midpoints_is_the_least_and_that_of_one_corner_the_most():
    midpoints = (np.arange(6)[:, None] + 0.5) / 6
    assert star_discrepancy(midpoints) == pytest.approx(1 / 12)
    assert star_discrepancy(np.zeros((6, 1))) == 1


@each_choice
def test_neighbours_are_all_pixels_within_the_radius_but_never_the_pixel_itself(around):
    found = steps(around, 100, 6, 10, np.full(5000, 50))
    assert set(found.ravel()) == set(range(-10, 11)) - {0}


@each_choice
def test_neighbours_stay_in_their_row_and_replica(around):
    pixel = np.arange(4 * 30)
    found = steps(around, 30, 6, 10, pixel) + pixel
    assert (found // 30 == pixel // 30).all()


@each_choice
def test_at_the_ends_of_a_row_neighbours_are_mirrored(around):
    for pixel in (0, 1, 98, 99):
        found = steps(around, 100, 6, 10, np.full(5000, pixel)) + pixel
        wanted = {min(abs(pixel + k), 198 - abs(pixel + k)) for k in range(-10, 11) if k}
        assert set(found.ravel()) == wanted


@each_choice
@pytest.mark.parametrize("n", [1, 2, 3, 10])
def test_neighbours_of_a_radius_beyond_the_row_are_pixels_of_it(around, n):
    pixel = np.arange(3 * n * 50)
    found = steps(around, n, 6, 20, pixel) + pixel
    assert (found // n == pixel // n).all()
    assert set(found.ravel() % n) == set(range(n))


def mirrored_to(pixel: int, n: int, radius: int) -> Array:
    """Where the steps -radius .. radius but 0 lead in a row that goes on in mirrors, sorted; (2 radius,)."""
    row = np.pad(np.arange(n), radius, mode="reflect")[pixel : pixel + 2 * radius + 1]
    return np.sort(np.delete(row, radius))


def every_step(n: int, radius: int, pixel: int) -> Array:
    """The neighbours that all equally likely numbers choose, sorted; (2 radius,)."""
    u = (np.arange(2 * radius) + 0.5) / (2 * radius)
    return np.sort(_moved(Row(n), np.full(2 * radius, pixel), u, radius).index)  # type: ignore[arg-type]


ROWS = [(2, 1), (2, 5), (5, 20), (8, 7), (8, 14), (8, 20), (64, 20)]


@pytest.mark.parametrize(("n", "radius"), ROWS)
def test_a_row_goes_on_in_mirrors_however_far_the_radius_reaches(n, radius):
    for pixel in range(n):
        assert (every_step(n, radius, pixel) == mirrored_to(pixel, n, radius)).all()


def test_mirroring_once_and_staying_at_the_end_draws_one_pixel_of_eight_with_a_share_of_38_percent():
    steps = np.delete(np.arange(-20, 21), 20)
    once = np.clip(7 - abs(7 - abs(7 + steps)), 0, 7)
    assert np.bincount(once).max() / 40 == pytest.approx(0.375)
    assert max(np.bincount(every_step(8, 20, pixel)).max() for pixel in range(8)) / 40 <= 0.15


@each_choice
@pytest.mark.parametrize("radius", [0, 0.5, -3, np.nan, np.inf])
def test_a_radius_that_reaches_no_other_pixel_is_refused_by_name(around, radius):
    with pytest.raises(ValueError, match=rf"the radius is {radius}: take 1"):
        steps(around, 100, 3, radius, np.arange(100))


@each_choice
def test_a_radius_of_one_reaches_the_next_pixels(around):
    assert set(steps(around, 100, 3, 1.5, np.full(50, 50)).ravel()) == {-1, 1}


PRESET = Preset(trees=3, rounds=2, neighbours=2, radius=3, cap=1.5, along="1/Z", across="talbot")


def right_of(here: Pixels) -> Pixels:
    """The pixels that the image has moved from."""
    return Pixels(here.of, here.index // 7 * 7 + (here.index + 1) % 7)


def by_hand(here: Pixels, chance: Live, history: Reservoirs) -> Reservoirs:
    """The passes of PRESET, one after the other."""
    X = initial(here, chance, 3)
    X = temporal(X, here, history, [right_of(here)], chance, mis=WEIGHTS["1/Z"], cap=1.5)
    for _ in range(2):
        near = random_in_row(here.of, here.index, 2, 3, chance)  # type: ignore[arg-type]
        X = spatial(X, here, near, chance, mis=WEIGHTS["talbot"])
    return X


def frames_agree(**changes: object) -> bool:
    """Whether a frame of the (changed) preset is what its passes give with the same numbers, to the last bit."""
    here = Pixels(overlapping_supports(), np.arange(7 * 200))
    history = replace(initial(here, live(3)), c=np.full(len(here.index), 4))
    one = frame(here, live(4), replace(PRESET, **changes), random_in_row, history, [right_of(here)])  # type: ignore[arg-type]
    two = by_hand(here, live(4), history)
    return all(np.array_equal(getattr(one, name), getattr(two, name)) for name in ("x", "W", "c"))


def test_a_frame_is_its_passes_in_their_order():
    assert frames_agree()


@pytest.mark.parametrize(
    "changes",
    [
        {"trees": 1},
        {"rounds": 1},
        {"neighbours": 3},
        {"radius": 2},
        {"cap": np.inf},
        {"along": "talbot"},
        {"across": "defensive"},
    ],
    ids=lambda changes: next(iter(changes)),
)
def test_no_parameter_of_a_preset_is_idle(changes):
    assert not frames_agree(**changes)


def test_a_frame_without_history_draws_no_temporal_pass():
    here = Pixels(overlapping_supports(), np.arange(7 * 200))
    one = frame(here, live(4), replace(PRESET, rounds=0), random_in_row)
    two = initial(here, live(4), 3)
    assert np.array_equal(one.W, two.W)
    assert np.array_equal(one.x, two.x)

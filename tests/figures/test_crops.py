"""Laws of crop against radius: what is compared, at which price, and that radius 0 is reuse in time alone."""

import numpy as np
import pytest

from figures.trust import crops_2d
from figures.trust.crops_2d import CROPS, RADII, SIDE, compute, differences_cost, image_cost, over_none, over_the_best

SHAPES = {"primal": SIDE * SIDE, "dx": SIDE * (SIDE - 1), "dy": SIDE * (SIDE - 1)}


def arrays(scale=lambda crop, radius: 1.0, prices=(6.0, 2.0)) -> dict[str, np.ndarray]:
    """Noise of known variance everywhere, and rays of image and differences, and of the image alone."""
    rng, found = np.random.default_rng(1), {}
    noise = {name: rng.normal(size=(8, n)) for name, n in SHAPES.items()}
    for crop in CROPS:
        for radius in RADII:
            at = f"{crop}.{radius}"
            found |= {f"{at}.{name}": each * scale(crop, radius) for name, each in noise.items()}
            found |= {f"{at}.rays": np.array(prices[0]), f"{at}.rays of the image": np.array(prices[1])}
    return found


def test_a_ratio_of_variances_is_that_of_squares_by_crop_and_radius() -> None:
    a = arrays(lambda crop, radius: 1 + crop * radius)
    expected = [[(1 + crop * radius) ** 2 for crop in CROPS] for radius in RADII[1:]]
    assert over_none(image_cost, a) == pytest.approx(np.array(expected))
    assert over_none(differences_cost, a) == pytest.approx(np.array(expected))


def test_an_image_pays_for_itself_and_differences_for_both() -> None:
    cheap, dear = arrays(prices=(6.0, 2.0)), arrays(prices=(12.0, 2.0))
    crop, radius = CROPS[0], RADII[1]
    assert image_cost(dear, crop, radius) == image_cost(cheap, crop, radius)
    assert differences_cost(dear, crop, radius) == pytest.approx(2 * differences_cost(cheap, crop, radius))
    assert over_the_best(dear) == pytest.approx(2 * over_the_best(cheap))


def test_the_best_image_is_that_of_the_best_radius() -> None:
    """One radius with a tenth of the noise makes every other one's reconstruction look poor, and not its own only."""
    even, one = over_the_best(arrays()), over_the_best(arrays(lambda crop, radius: 0.1 if radius == 4 else 1.0))
    assert one[RADII.index(0)] == pytest.approx(100 * even[RADII.index(0)])
    assert one[RADII.index(4)] == pytest.approx(even[RADII.index(4)])


def test_the_last_crop_is_the_whole_scene_and_the_others_have_their_widths() -> None:
    widths = [np.subtract(film.high, film.low) for film in map(crops_2d.sensor, CROPS)]
    room = crops_2d.setting(crops_2d.SCENE)
    assert np.array_equal(widths[-1], np.subtract(room.high, room.low))
    assert np.array(widths[:-1]) == pytest.approx(np.stack([CROPS[:-1]] * 2, axis=1))


def test_reuse_in_space_costs_rays_of_the_image_and_of_pairs_and_radius_0_has_none() -> None:
    found = {
        radius: compute({"replicas": 1, "frames": 2}, {"crop": 0.05, "radius": radius}, rng=np.random.default_rng(1))
        for radius in (0, 2)
    }
    image, both = ({r: float(each[name]) for r, each in found.items()} for name in ("rays of the image", "rays"))
    assert image[2] > 1.2 * image[0]
    assert both[2] - image[2] > 1.2 * (both[0] - image[0])
    assert {name: each.shape for name, each in found[0].items() if each.ndim} == {
        name: (1, n) for name, n in SHAPES.items()
    }

"""The gallery of space: every scene by every method that is fit, and an error with little of the reference's noise."""

import numpy as np
import pytest

from figures.report import legible, style
from figures.trust import space_scenes as gallery
from restir_ref.metrics import MAP, rel_mse
from tracer3d import SCENES
from tracer3d.methods import METHODS

PRESET = {"frames": 1, "trees": 2 * gallery.AT_ONCE}
FIRST = "crease"


@pytest.fixture(scope="module")
def computed():
    """One scene's arrays."""
    return gallery.compute(PRESET, {"scene": FIRST}, rng=np.random.default_rng(1))


def test_all_methods_but_replay_alone_are_shown():
    assert set(METHODS) - set(gallery.SHOWN) == {"restir-pt-replay"}
    assert [chunk["scene"] for chunk in gallery.chunks(PRESET)] == list(SCENES)


def test_every_method_sees_the_scene_of_the_reference(computed):
    assert computed["images"].shape == (len(gallery.SHOWN), 3, *gallery.SHAPE)
    reference = computed["halves"].mean()
    means = computed["images"].mean(axis=(1, 2, 3)) / reference
    np.testing.assert_allclose(means, 1, atol=0.05)
    assert (computed["rays"][1:] > computed["rays"][0]).all()


def test_the_sheet_can_be_read(computed):
    arrays = {f"{scene} {name}": array for scene in SCENES for name, array in computed.items()}
    with style.context():
        picture = gallery.draw(arrays)
        picture.draw_without_rendering()
    assert legible.troubles(picture) == []
    assert len(picture.axes) == len(SCENES)


def noisy(sigma: float, R: int = 2000):
    """An exact image from 1 to 2, and R pairs of halves with noise of their own; images (1, rows, columns)."""
    truth = 1 + np.random.default_rng(1).random((1, 6, 8))
    return truth, truth + sigma * np.random.default_rng(2).normal(size=(R, 2, *truth.shape))


@pytest.mark.parametrize("sigma", [0.1, 0.2])
def test_an_exact_image_has_an_error_of_fourth_order_in_the_noise_of_the_reference(sigma):
    truth, halves = noisy(sigma)
    found = np.array([gallery.rel_mse(truth, each) for each in halves])
    s2 = (sigma / truth) ** 2
    expected = (1.5 * s2**2 + 7.5 * s2**3).mean()
    assert abs(found.mean() - expected) < 4 * found.std() / np.sqrt(len(found)) < 0.02 * s2.mean()


def test_the_plain_error_counts_the_noise_of_the_reference_in_its_square():
    truth, halves = noisy(0.2)
    plain = np.array([rel_mse(truth[0], each.mean(axis=0)[0], MAP) for each in halves])
    assert plain.mean() > 0.5 * ((0.2 / truth) ** 2).mean()


def test_an_error_of_a_tenth_everywhere_is_a_hundredth():
    truth, _ = noisy(0.1)
    assert gallery.rel_mse(1.1 * truth, np.stack([truth, truth])) == pytest.approx(0.01, rel=1e-3)


def test_large_errors_have_no_powers_of_ten():
    assert [gallery.short(error) for error in (0.0123, 17.2, 220.4)] == ["0.012", "17", "220"]

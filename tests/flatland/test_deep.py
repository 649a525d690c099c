"""Truths of rooms in which light bounces until it is gone, and what methods are compared in."""

import numpy as np
import pytest

from figures.experiments import deep
from figures.experiments.cached import BASELINES, METHODS, Place, compared, frozen, scenery
from figures.experiments.references import reference
from flatland2d.radiosity import render
from restir_ref.chance import Live

PANELS = 12


@pytest.fixture
def coarse(monkeypatch):
    """Few panels, and nothing kept."""
    monkeypatch.setattr(deep, "PANELS", PANELS)
    deep.radiosities.cache_clear()
    yield
    deep.radiosities.cache_clear()


@pytest.mark.parametrize("room", ["crease", "sunlit"])
def test_radiosity_by_its_matrix_is_radiosity_bounce_by_bounce(coarse, room) -> None:
    setting = deep.ROOMS[room]()
    all_bounces, one, some = deep.radiosities(room)

    def after(bounces: int):
        return render(setting.scene, setting.pinhole(), bounces, PANELS, deep.FILM)

    np.testing.assert_allclose(one, after(1), rtol=1e-12)
    np.testing.assert_allclose(some, after(deep.DEPTH), rtol=1e-12)
    np.testing.assert_allclose(all_bounces, after(120), rtol=1e-4)
    assert (all_bounces > some).all()


def test_the_stored_truth_of_the_glossy_room_has_more_light_than_three_bounces() -> None:
    shallow, whole = reference("glossy_cornell").mean, deep.truth("glossy_cornell")
    assert (whole > shallow).all()
    assert 0 < deep.direct("glossy_cornell").mean() < shallow.mean()


def test_all_methods_of_a_frame_see_the_same_x_1_and_the_printed_one_traces_a_ray_before_it_looks() -> None:
    found = compared(scenery(frozen(Place("open_room", 3.0), 0.2)), 2, 3, Live(np.random.default_rng(1)))
    assert found["images"].shape == (2, len(METHODS), 2, 128)
    assert np.isfinite(found["images"]).all()
    rays, queries = found["drawn"][1]
    assert rays == 1
    assert queries <= 5
    primary, trees = (METHODS.index(name) for name in ("primary DDGI", "path tracing"))
    assert set(BASELINES) < set(METHODS)
    assert (found["spent"][:, trees, 0] > found["spent"][:, primary, 0]).all()

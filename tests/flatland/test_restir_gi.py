"""ReSTIR GI is ReSTIR PT where all is Lambertian, to the last digits; on glossy surfaces it moves light about."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from figures.claims.criteria import all_unbiased, biased, mean_and_blocks, unbiased
from flatland2d import SCENES
from restir_ref.batch import Array, take
from restir_ref.chance import Live
from restir_ref.integrals import Pixels, Reservoirs
from restir_ref.loop import random_in_row
from restir_ref.mis import WEIGHTS
from restir_ref.restir import initial, shade, spatial, temporal
from restir_ref.transport.baselines import restir_gi
from restir_ref.transport.baselines.restir_gi import RadianceIntegrals, keeps_radiance
from restir_ref.transport.paths import RECONNECTION, Tracer, first_hit
from restir_ref.transport.restir_pt import PathIntegrals
from restir_ref.transport.vectors import norm
from tests.flatland.truths import radiosity
from tests.transport.paths import HYBRID

PIXELS, REPLICAS, ROUNDS = 32, 128, 3
SYSTEMS = {"GI": RadianceIntegrals, "PT": PathIntegrals}
MATTE = ["matte_cornell", "ajar", "crease", "occluders", "many_lights"]


def pixels(system: str, scene: str, replicas: int = REPLICAS) -> Pixels:
    """All pixels of all replicas."""
    setting = SCENES[scene]()
    of = SYSTEMS[system](Tracer(setting.scene, setting.pinhole(PIXELS), setting.depth, RECONNECTION))
    return Pixels(of, np.arange(PIXELS * replicas))


def spatially(X: Reservoirs, here: Pixels, mis: str, chance: Live) -> Reservoirs:
    """Rounds of three neighbours within 20 pixels."""
    for _ in range(ROUNDS):
        X = spatial(X, here, random_in_row(here.of, here.index, 3, 20, chance), chance, mis=WEIGHTS[mis])
    return X


def two_frames(system: str, scene: str, mis: str) -> Array:
    """An image after temporal and spatial reuse."""
    here, chance = pixels(system, scene, 16), Live(np.random.default_rng(1))
    history = spatially(initial(here, chance), here, mis, chance)
    X = temporal(initial(here, chance), here, history, [here], chance, mis=WEIGHTS[mis])
    return shade(spatially(X, here, mis, chance), here)


def difference(scene: str, mis: str) -> float:
    """Largest difference of a pixel between both systems, relative to the image's mean."""
    gi, pt = (two_frames(system, scene, mis) for system in SYSTEMS)
    return float(np.abs(gi - pt).max() / pt.mean())


@pytest.mark.claims("GRIS-C11", "COM-B03", part="equality on Lambert")
@pytest.mark.parametrize("mis", ["defensive", "1/Z"])
@pytest.mark.parametrize("scene", MATTE)
def test_where_all_is_lambert_restir_gi_is_restir_pt_for_the_same_random_numbers(scene, mis) -> None:
    assert difference(scene, mis) < 1e-12


@pytest.mark.parametrize("scene", ["cornell", "glossy_cornell"])
def test_it_is_not_where_surfaces_are_glossy(scene) -> None:
    assert difference(scene, "defensive") > 1e-3


@pytest.mark.parametrize("scene", ["matte_cornell", "glossy_cornell", "distant_caustic"])
def test_a_shift_there_and_back_keeps_the_path_and_its_radiance(scene) -> None:
    here = pixels("GI", scene)
    there = replace(here, index=here.index ^ 1)
    X = initial(here, Live(np.random.default_rng(2)))
    y = here.of.shift(X.x, here.index, there)
    back = here.of.shift(y.x, there.index, here)
    there_and_back = (y.J > 0) & (X.W > 0)
    assert np.abs(y.J * back.J - 1)[there_and_back].max() < 1e-9
    F, again, L, kept = (take(a, np.flatnonzero(there_and_back)) for a in (X.x.path.F, back.x.path.F, X.x.L, y.x.L))
    assert np.abs(again - F).max() < 1e-9 * F.max()
    assert (kept == L).all()


def images(system: str, scene: str, mis: str, batches: int) -> Iterator[tuple[Array, Array]]:
    """(replicas, pixels) after reuse, and of the samples it began with."""
    here, chance = pixels(system, scene), Live(np.random.default_rng(3))
    for _ in range(batches):
        X = initial(here, chance)
        Y = spatially(X, here, mis, chance)
        yield shade(Y, here)[0].reshape(REPLICAS, PIXELS), shade(X, here)[0].reshape(REPLICAS, PIXELS)


@pytest.mark.claims("GRIS-C11", "COM-B03", part="ReSTIR GI on Lambert, to 2 %")
def test_restir_gi_agrees_with_radiosity_where_all_is_lambert() -> None:
    truth = radiosity("matte_cornell", PIXELS, (44, 52, 60, 68))
    ours = np.concatenate([reused.mean(axis=1) for reused, _ in images("GI", "matte_cornell", "1/Z", 2)])
    assert unbiased(ours, truth, eps=0.02).passed


def glossy(system: str, batches: int) -> tuple[Array, Array]:
    """Means of the image and of eight blocks, (replicas, 9), less what their first samples deviate; truth (9,)."""
    reused, first = map(np.concatenate, zip(*images(system, "glossy_cornell", "defensive", batches), strict=True))
    truth = mean_and_blocks(first).mean(axis=0)
    return mean_and_blocks(reused - first) + truth, truth


@pytest.mark.claims("GRIS-C11", "COM-B03", part="ReSTIR GI on glossy surfaces")
def test_restir_gi_is_biased_on_glossy_surfaces() -> None:
    """It smears what they reflect, too bright here and too dark there; the mean of the image hardly shows it."""
    estimates, truth = glossy("GI", 40)
    bounds = [(-0.2, -0.01), (0.01, 0.2)]
    assert any(biased(estimates[:, b], truth[b], *each).passed for b in range(1, 9) for each in bounds)
    assert abs(estimates[:, 0].mean() / truth[0] - 1) < 0.01


@pytest.mark.claims("GRIS-C11", part="ReSTIR PT on glossy surfaces, to 2 %")
def test_restir_pt_is_not() -> None:
    estimates, truth = glossy("PT", 20)
    assert all_unbiased(estimates, truth, eps=0.02).passed


def within_a_wall() -> tuple[Array, Array]:
    """J of shifts that would connect points of one slanted wall, .01 apart or more, and of all others."""
    setting, rng, slope = SCENES["crease"](), np.random.default_rng(4), 4
    t = Tracer(setting.scene, setting.pinhole(1920, 0), setting.depth, RECONNECTION)
    here, there = (Pixels(RadianceIntegrals(t), each) for each in rng.integers(0, 1920, (2, 40_000)))
    X = initial(here, Live(rng))
    J, (v, _, _) = here.of.shift(X.x, here.index, there).J, first_hit(t, X.x.path.u, there.index)
    asked, same = keeps_radiance(X.x.path) & (X.W > 0) & (v.prim == slope), X.x.path.prim == slope
    return J[asked & same & (norm(X.x.path.z - v.x) > 0.01)], J[asked & ~same]


def test_points_of_one_wall_are_not_connected() -> None:
    """Their cosines are rounding errors, and so would J be."""
    within, across = within_a_wall()
    assert len(within) > 500
    assert not within.any()
    assert (across > 0).mean() > 0.3


def test_without_a_least_cosine_some_are(monkeypatch) -> None:
    monkeypatch.setattr(restir_gi, "GRAZING", 0.0)
    assert within_a_wall()[0].any()


def test_restir_gi_connects_at_x_2_only() -> None:
    setting = SCENES["cornell"]()
    with pytest.raises(ValueError, match="connects at x_2"):
        RadianceIntegrals(Tracer(setting.scene, setting.pinhole(4), setting.depth, HYBRID))

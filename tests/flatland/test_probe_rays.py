"""What probes' last rays brought: cells around rays, the control variate that they make, and rays that they guide."""

from dataclasses import replace

import numpy as np
import pytest

from figures.claims.criteria import biased
from flatland2d import SCENES
from flatland2d.probe_cells import Sectors
from restir_ref.batch import Array, take
from restir_ref.chance import Live
from restir_ref.integrals import Pixels
from restir_ref.loop import random_in_row
from restir_ref.restir import resample, shade, spatial
from restir_ref.transport import materials as mat
from restir_ref.transport.cache import control, guiding
from restir_ref.transport.cache.control import ControlledIntegrals, residual_difference, variate
from restir_ref.transport.cache.guiding import guided
from restir_ref.transport.cache.integrals import asked, by_ray, kept, on_lights, ray
from restir_ref.transport.cache.leaving import Cache
from restir_ref.transport.cache.probe_rays import ProbeRays, arriving, brought, irradiance
from restir_ref.transport.cache.shading import met, plain, sent
from restir_ref.transport.paths import RECONNECTION, Tracer
from tests.flatland.cached import agrees, lighted, replicated, truth
from tests.transport.cache.fields import Smooth
from tests.transport.cache.gathered import at_centres

CELLS = Sectors(16, 0.3)


def turned(turns: Array) -> Array:
    return np.stack([np.cos(2 * np.pi * turns), np.sin(2 * np.pi * turns)])


def rays_of(here: Pixels) -> ProbeRays:
    """Nine probes in the room's middle and corners."""
    x, y = np.meshgrid([0.12, 0.5, 0.93], [0.06, 0.55, 0.93])
    return brought(here.of.cache, np.stack([x.reshape(-1), y.reshape(-1)]), CELLS, Live(np.random.default_rng(1)))


# ---------------------------------------------------------------- cells


def test_sectors_fill_the_circle_and_a_direction_drawn_in_one_is_in_it() -> None:
    cell, u = np.arange(16).repeat(50), np.random.default_rng(1).random((1, 800))
    np.testing.assert_array_equal(CELLS.cell(CELLS.within(cell, u)), cell)
    np.testing.assert_array_equal(CELLS.cell(CELLS.w), np.arange(16))
    assert CELLS.size.sum() == pytest.approx(2 * np.pi)


def test_cosines_over_sectors_are_those_of_quadrature() -> None:
    n, w = turned(np.random.default_rng(2).random(40)), turned((np.arange(200_000) + 0.5) / 200_000)
    cell = CELLS.cell(w)
    found = CELLS.cosines(n)
    for k in range(40):
        by_hand = np.bincount(cell, np.maximum(n[:, k] @ w, 0), 16) * 2 * np.pi / 200_000
        np.testing.assert_allclose(found[:, k], by_hand, atol=1e-4)
    np.testing.assert_allclose(found.sum(axis=0), 2)


def test_the_irradiance_of_what_is_constant_around_rays_is_exact() -> None:
    here = lighted("crease", 1)
    rays, n = rays_of(here), 4000
    x, w = here.of.v.x[:, :1], turned((np.arange(n) + 0.5) / n)
    normal = here.of.v.n[:, :1]
    g = arriving(rays, np.repeat(x, n, axis=1), w)
    assert np.unique(g).size > 8
    by_hand = (g[0] * np.maximum(normal[:, 0] @ w, 0)).mean() * 2 * np.pi
    assert irradiance(rays, x, normal)[0, 0] == pytest.approx(by_hand, rel=5e-3)


def test_rays_bring_what_lamps_emit_and_nothing_from_where_nothing_is() -> None:
    """Below the lamp a ray meets it; outside of the room most meet nothing, where the field would have an answer."""
    here = lighted("crease", 1)
    s, place = here.of.scene, np.array([[0.5, 9.0], [0.5, 9.0]])
    L = brought(here.of.cache, place, Sectors(64), Live(np.random.default_rng(1))).L[0]
    met = np.isfinite(s.intersect(np.repeat(place, 64, axis=1), np.tile(Sectors(64).w, 2))[0]).reshape(2, 64)
    assert met[0].all()
    assert 0 < met[1].sum() < 32
    assert (L[1][~met[1]] == 0).all()
    assert L[0].max() > s.emission.max()
    assert np.median(L[0]) < s.emission.max() / 2


def test_fewer_than_two_sectors_are_refused() -> None:
    with pytest.raises(ValueError, match=r"number of sectors .* 1"):
        Sectors(1)


# ---------------------------------------------------------------- control variate


def controlled_image(scene: str, G_max: float, replicas: int = 1024) -> Array:
    """Spatial reuse of the difference, the control variate's own integral beside it."""
    here, chance = lighted(scene, replicas, G_max, value=asked), Live(np.random.default_rng(3))
    of = ControlledIntegrals(here.of, rays_of(here))
    there, found = Pixels(of, here.index), by_ray(here.of, here.index, chance)
    X = resample([*on_lights(here.of, here.index, chance), (found.x, found.mW)], there, chance)
    X = spatial(X, there, random_in_row(of, here.index, 3, 10, chance), chance)
    difference = shade(X, there) + residual_difference(of, here.index, found, plain, chance)
    return replicated(variate(of, here.index) + difference)


@pytest.mark.claims("DDGIR-A11", part="the same mean, to 2 %")
@pytest.mark.claims("COM-B11", part="the same mean, to 2 %")
@pytest.mark.parametrize("G_max", [np.inf, 4.0])
@pytest.mark.parametrize("scene", ["crease", "glossy_cornell"])
def test_with_a_control_variate_the_mean_is_that_without(scene, G_max) -> None:
    found = controlled_image(scene, G_max)
    assert agrees(scene, found)


@pytest.mark.claims("DDGIR-A11", part="negative pixels")
def test_with_a_control_variate_single_estimates_are_negative() -> None:
    assert (controlled_image("crease", np.inf, 64) < 0).any()
    here, chance = lighted("crease", 64), Live(np.random.default_rng(3))
    found = by_ray(here.of, here.index, chance)
    assert (shade(resample([(found.x, found.mW)], here, chance), here) >= 0).all()


@pytest.mark.claims("DDGIR-A11", part="control")
def test_an_integral_of_another_probe_than_the_variates_is_noticed(monkeypatch) -> None:
    """A mistake: the irradiance that the volume interpolates is not the integral of one probe's rays."""
    monkeypatch.setattr(control, "irradiance", lambda rays, x, n: irradiance(rays, np.full_like(x, 0.5), n))
    found = controlled_image("crease", np.inf)
    assert abs(found.mean() / truth("crease").mean() - 1) > 0.02
    assert not agrees("crease", found)


def test_a_control_variate_refuses_kept_values() -> None:
    here = lighted("crease", 1, value=kept)
    with pytest.raises(ValueError, match="value=kept"):
        ControlledIntegrals(here.of, rays_of(here))


def test_the_difference_counts_in_every_channel() -> None:
    """|+1|, |-1| and 0 are 2/3 in the mean, whose own absolute value is 0: a target must not be, where light is."""
    here, chance = lighted("crease", 4, value=asked), Live(np.random.default_rng(3))
    of, x = ControlledIntegrals(here.of, rays_of(here)), by_ray(here.of, here.index, chance).x
    apart = np.array([[1.0], [-1.0], [0.0]])
    x = replace(x, f=np.ones((3, len(here.index))), L=np.zeros((3, len(here.index))))
    x = replace(x, L=of.controlled(here.index, x) + apart)
    np.testing.assert_allclose(of.target(here.index, x), 2 / 3)


def test_rays_that_carry_nothing_leave_no_difference() -> None:
    """A lobe without a direction has a density where another stands in for it, and the variate a value there."""
    here, chance = lighted("crease", 4, 4.0, value=asked), Live(np.random.default_rng(3))
    of, found = ControlledIntegrals(here.of, rays_of(here)), by_ray(here.of, here.index, chance)
    nothing = replace(found, ray=replace(found.ray, weight=0 * found.ray.weight), rest=0 * found.rest)
    left = residual_difference(of, here.index, nothing, plain, chance)
    assert (left == 0).all()
    assert (residual_difference(of, here.index, found, plain, chance) != 0).any()


# ---------------------------------------------------------------- guiding


def by_one_ray(scene: str, replicas: int, how) -> Array:
    """Secondary queries by one ray alone, light sources met by it too."""
    here, chance = lighted(scene, replicas), Live(np.random.default_rng(4))
    found = how(here, chance)
    return replicated(found.weight * sent(here.of.cache, met(here.of, here.index, found, found.weight), plain, chance))


def guided_by_probes(here: Pixels, chance: Live):
    return guided(here.of, rays_of(here), here.index, chance)


def by_bsdf(here: Pixels, chance: Live):
    return ray(here.of, here.index, chance)


@pytest.mark.claims("DDGIR-A12", part="to 2 %")
@pytest.mark.claims("COM-B12", part="to 2 %")
@pytest.mark.parametrize("scene", ["crease", "glossy_cornell", "ajar"])
def test_guided_rays_are_secondary_queries_in_expectation(scene) -> None:
    assert agrees(scene, by_one_ray(scene, 4096, guided_by_probes))


@pytest.mark.claims("DDGIR-A12", part="control")
def test_guided_rays_weighed_by_the_bsdf_alone_are_biased(monkeypatch) -> None:
    monkeypatch.setattr(guiding, "pdf", lambda rays, powers, w: 0 * w[0])
    found = by_one_ray("crease", 512, guided_by_probes).mean(axis=1)
    assert biased(found, truth("crease").mean(), 0.01, 10).passed


def test_where_probes_saw_nothing_the_bsdf_alone_is_asked() -> None:
    here, chance = lighted("crease", 4), Live(np.random.default_rng(5))
    dark = replace(rays_of(here), L=np.zeros((1, 9, 16)))
    found = guided(here.of, dark, here.index, chance)
    assert (found.weight >= 0).all()
    assert found.weight.mean() == pytest.approx(by_bsdf(here, chance).weight.mean(), rel=1e-6)


def test_a_guided_ray_carries_f_over_p_whatever_became_of_the_bsdfs_own_sample() -> None:
    """Nearly all rays are the probes'; those of which the lobe had no direction are worth as much."""
    here, rng = lighted("glossy_cornell", 512), np.random.default_rng(6)
    found = guided(here.of, rays_of(here), here.index, Live(rng), 1 - 1e-9)
    s, (v, T) = here.of.scene, take((here.of.v, here.of.T), here.index)
    local = s.space.to_local(v.n, found.w)
    f, _ = mat.evaluate_all(s.materials, s.space, v, mat.lobe_shares(s.materials, v), local)
    np.testing.assert_allclose(found.weight, T * f / found.p, rtol=1e-9)
    lost = mat.sample_lobe(s.materials, s.space, v, lobes_of(s, v), rng.random((1, len(here.index))))[-1] == 0
    assert (lost & (found.weight > 0).any(axis=0)).any()


def lobes_of(s, v) -> Array:
    """The last lobe of every vertex, which is the glossy one where there are two."""
    P = mat.lobe_shares(s.materials, v)
    return np.where(P[-1] > 0, len(P) - 1, 0)


def test_delta_lobes_are_weighed_by_the_share_that_is_left_to_them() -> None:
    """Where x_1 is glass all light is by the BSDF, and guiding must not change what it carries in the mean."""
    setting = SCENES["glass_disc"]()
    t = Tracer(setting.scene, setting.pinhole(8, setting.crop - 100), 1, RECONNECTION)
    here = at_centres(t, Cache(t.scene, Smooth(2)), 4096)
    glass, place = here.of.v.prim == t.scene.S, np.array([[0.2, 0.8], [0.8, 0.9]])
    rays = brought(here.of.cache, place, CELLS, Live(np.random.default_rng(1)))
    with_probes, without = (
        how.weight[0, glass].reshape(-1)
        for how in (
            guided(here.of, rays, here.index, Live(np.random.default_rng(2))),
            ray(here.of, here.index, Live(np.random.default_rng(3))),
        )
    )
    error = np.hypot(with_probes.std(), without.std()) / np.sqrt(glass.sum())
    assert abs(with_probes.mean() - without.mean()) < 4 * error
    assert error < 0.02 * without.mean()


def test_a_share_of_1_is_refused() -> None:
    here = lighted("crease", 1)
    with pytest.raises(ValueError, match="share of guided rays"):
        guided(here.of, rays_of(here), here.index, Live(np.random.default_rng(1)), 1.0)

"""Path reuse in tiles: an exact law of Lambert surfaces, and no bias against radiosity and its own trees."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from figures.claims.criteria import sidak, unbiased
from flatland2d import PLANE, SCENES, Pinhole
from flatland2d.scenes import LAMP, chain, matte, room
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.transport.baselines import path_reuse as module
from restir_ref.transport.baselines.path_reuse import TILE, Shared, TileIntegrals, not_shared, path_reuse, shareable
from restir_ref.transport.counting import SHADOW, counted
from restir_ref.transport.materials import Layer, Material
from restir_ref.transport.paths import RECONNECTION, Tracer, radiance, trace
from restir_ref.transport.proofs.inversion import traced
from restir_ref.transport.scene import Facet
from restir_ref.transport.scene import scene as compiled
from restir_ref.transport.shifts import shift_path
from tests.flatland.truths import radiosity


def tracer(scene: str, tiles: int = 1) -> Tracer:
    """The scene's first tiles."""
    setting = SCENES[scene]()
    return Tracer(setting.scene, setting.pinhole(tiles * TILE), setting.depth, RECONNECTION)


def with_and_without(t: Tracer, replicas: int, seed: int) -> tuple[Array, Array]:
    """Images with path reuse, and of the same trees without, (replicas, n) each."""
    n, pixel = t.sensor.n, np.arange(replicas * t.sensor.n) % t.sensor.n
    reused = path_reuse(t, pixel, Live(np.random.default_rng(seed)))
    alone = radiance(trace(t, np.random.default_rng(seed).random((t.D, len(pixel))), pixel))
    return reused[0].reshape(replicas, n), alone[0].reshape(replicas, n)


def change_of_tiles(scene: str) -> float:
    """Largest change of a tile's sum, relative to the mean of such sums."""
    reused, alone = (images.reshape(64, -1, TILE).sum(axis=2) for images in with_and_without(tracer(scene, 4), 64, 1))
    return float(np.abs(reused - alone).max() / alone.mean())


ONE_ALBEDO = ["ajar", "nearly_closed", "crease", "furnace"]


@pytest.mark.claims("COM-B02", part="inside tiles")
@pytest.mark.parametrize("scene", ONE_ALBEDO)
def test_where_all_is_lambert_of_one_albedo_light_only_moves_inside_tiles(scene) -> None:
    """f_j / p_j is the same for all pixels, so that sum_j f_j / sum_k p_k = f_i / p_i: samples are handed out whole."""
    assert change_of_tiles(scene) < 1e-12


class Blind(TileIntegrals):
    """A mistake: densities count pixels that do not see x_2."""

    def candidates(self, index, chance):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(module, "_clear", lambda t, v, z, p: p > 0)
            unoccluded = list(super().candidates(index, chance))
        for (x, W), (y, _) in zip(super().candidates(index, chance), unoccluded, strict=True):
            yield Shared(y.p, x.f), W


def test_densities_that_count_pixels_behind_an_obstacle_lose_light(monkeypatch) -> None:
    monkeypatch.setattr(module, "TileIntegrals", Blind)
    assert change_of_tiles("crease") > 1e-3


@pytest.mark.claims("COM-B02", part="a pixel's sum")
@pytest.mark.parametrize("scene", ["cornell", "clear_coat", "occluders"])
def test_a_pixel_sums_f_over_the_densities_of_its_whole_tile(scene) -> None:
    t = tracer(scene)
    tree = trace(t, np.random.default_rng(2).random((t.D, TILE)), np.arange(TILE))
    image = not_shared(tree)[0]
    of = TileIntegrals(t, tree)
    for (x, _), shared in zip(
        of.candidates(np.arange(TILE), Live(np.random.default_rng(0))), shareable(tree), strict=True
    ):
        image = image + (x.f[:, 0] / x.p.sum(axis=0))[:, shared].sum(axis=1)
    assert path_reuse(t, np.arange(TILE), Live(np.random.default_rng(2)))[0] == pytest.approx(image, rel=1e-12)


@pytest.mark.claims("COM-B02", part="to 2 %, through a door")
def test_path_reuse_agrees_with_radiosity_through_a_door() -> None:
    truth = radiosity("ajar", TILE, (104, 120, 136, 152))
    images = np.concatenate([with_and_without(tracer("ajar"), 1024, seed)[0] for seed in range(4)])
    assert unbiased(images.reshape(64, -1).mean(axis=1), truth, eps=0.02).passed


def largest_z(scene: str, replicas: int, seed: int) -> tuple[float, float]:
    """Largest |z| over pixels of the change by reuse, and its limit."""
    reused, alone = with_and_without(tracer(scene), replicas, seed)
    change = (reused - alone).reshape(64, -1, TILE).mean(axis=1)
    error = change.std(axis=0, ddof=1) / 8
    assert (error < 0.02 * alone.mean()).all()
    return float(np.abs(change.mean(axis=0) / error).max()), sidak(TILE, 64)


@pytest.mark.claims("COM-B02", part="to 2 %, pixel by pixel")
@pytest.mark.parametrize("scene", ["cornell", "glossy_cornell", "clear_coat", "occluders"])
def test_path_reuse_changes_no_pixel_s_mean(scene) -> None:
    z, limit = largest_z(scene, 2048, seed=4)
    assert z < limit


# ---------------------------------------------------------------- one tile in rooms made for it


def one_tile(walls: Material, facets: list[Facet], eye: tuple[float, float] = (0.4, 0.6)) -> Tracer:
    """Sixteen pixels that look down."""
    return Tracer(compiled(PLANE, [walls], facets), Pinhole(eye, (0.5, 0.0), TILE, film=TILE), 3, RECONNECTION)


@pytest.mark.claims("COM-B02", part="thin walls")
def test_a_tile_that_sees_both_sides_of_a_thin_wall_hands_its_light_out_whole() -> None:
    thin = [*room(0), *chain([(0.5, 0.0), (0.5, 0.5)], 0), *chain(LAMP, 0, 8.0)]
    reused, alone = with_and_without(one_tile(matte(0.5), thin, (0.5, 0.9)), 64, 1)
    assert np.abs((reused - alone).sum(axis=1)).max() < 1e-12 * alone.sum(axis=1).mean()


def test_pixels_of_a_tile_see_of_a_sample_the_f_over_p_that_shifts_to_them_find() -> None:
    t, columns = one_tile(Material([Layer("ggx", (0.9,), 0.6)]), room(0, emission=1.0)), np.arange(TILE)
    t = replace(t, depth=2)
    tree = trace(t, np.random.default_rng(2).random((t.D, TILE)), columns)
    _, (seen, _) = TileIntegrals(t, tree).candidates(columns, Live(np.random.default_rng(0)))
    x, found = traced(t, tree.u, columns, np.full(TILE, 2), np.zeros(TILE, dtype=bool)), 0
    for j in columns:
        of_pixel_j = np.concatenate([np.full((1, TILE), tree.u[0, j]), x.u[1:]])
        y, J = shift_path(t, replace(x, u=of_pixel_j), np.full(TILE, j))
        both = (J > 0) & (seen.p[j] > 0) & (y.F[0] > 0)
        assert seen.f[j, 0, both] / seen.p[j, both] == pytest.approx(y.F[0, both], rel=1e-9)
        found += both.sum()
    assert found > TILE


@pytest.mark.claims("COM-B02", part="black lobes")
def test_black_lobes_take_no_part() -> None:
    """A furnace of albedo .5, half of whose samples would go to a black lobe."""
    black = Material([Layer("lambert", (0.5,), weight=0.5), Layer("lambert", (0.0,), weight=0.5)])
    images, _ = with_and_without(one_tile(black, room(0, emission=1.0)), 2500, 1)
    means = images.mean(axis=1)
    error = means.std(ddof=1) / np.sqrt(len(means))
    truth = 1 + 0.5 + 0.5**2 + 0.5**3
    assert error < 0.003 * truth
    assert abs(means.mean() - truth) < 4 * error


# ---------------------------------------------------------------- cost, and what cannot be tiled


def test_a_tile_is_connected_once() -> None:
    t, asked = tracer("cornell"), Counter[str]()
    counting = Tracer(counted(t.scene, asked), t.sensor, t.depth, t.rule)
    trace(counting, np.random.default_rng(5).random((t.D, TILE)), np.arange(TILE))
    of_trees = asked[SHADOW]
    path_reuse(counting, np.arange(TILE), Live(np.random.default_rng(5)))
    assert asked[SHADOW] - 2 * of_trees <= TILE * (TILE - 1)


def test_tiles_must_fill_the_image_and_trees_reach_x_2() -> None:
    t = tracer("cornell")
    tree = trace(t, np.zeros((t.D, 16)), np.arange(16))
    with pytest.raises(ValueError, match="cannot be cut into tiles of 5"):
        TileIntegrals(t, tree, 5)
    with pytest.raises(ValueError, match="at least two"):
        TileIntegrals(Tracer(t.scene, t.sensor, 1, t.rule), tree)

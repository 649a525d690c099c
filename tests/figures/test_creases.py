"""Crops that look into creases, and who reuses whose samples there."""

import numpy as np

from figures.experiments.creases import ALIKE, CROPS, NEAR, SIDE, flat, on_one_surface
from restir_ref.chance import Live
from restir_ref.integrals import NOWHERE
from restir_ref.transport.cache.integrals import cache_integrals
from restir_ref.transport.paths import RECONNECTION, Tracer, first_hit
from restir_ref.transport.vectors import dot, norm
from tracer3d.scenes import crease
from tracer3d.sensors import Mosaic


def spread(corner: tuple[int, int]) -> tuple[float, float, float]:
    """Distances of a crop's pixels to the crease, nearest and farthest; and the share that is floor."""
    setting = crease()
    t = Tracer(setting.scene, Mosaic(setting.pinhole(SIDE, SIDE), (corner,)), 1, RECONNECTION)
    v, _, _ = first_hit(t, np.full((t.D, t.sensor.n), 0.5), np.arange(t.sensor.n))
    d = norm(v.x[:2])
    return float(d.min()), float(d.max()), float((v.n[1] > 0.5).mean())


def test_the_crop_of_space_holds_the_crease_and_the_one_before_it_did_not():
    nearest, farthest, floor = spread(CROPS["crease"])
    assert farthest < NEAR
    assert farthest > 20 * nearest
    assert 0.3 < floor < 0.7
    nearest, farthest, floor = spread((943, 523))
    assert farthest < 3 * nearest
    assert floor == 0


def test_only_x_1_with_like_normals_are_reused_and_without_that_some_are_not():
    view, chance = flat()["crease"], Live(np.random.default_rng(5))
    t = Tracer(view.cache.scene, view.sensor, 1, RECONNECTION)
    index = np.arange(view.sensor.n)
    of = cache_integrals(t, view.cache, chance.uniform((t.D, len(index))), index, np.inf)

    def cosines(around) -> list[np.ndarray]:
        near = around(of, index, 3, 20.0, Live(np.random.default_rng(6)))
        kept = [each.index != NOWHERE for each in near]
        assert all(k.any() for k in kept)
        return [dot(of.v.n[:, index[k]], of.v.n[:, each.index[k]]) for each, k in zip(near, kept, strict=True)]

    assert all((cos > ALIKE).all() for cos in cosines(on_one_surface(view.around)))
    assert any((cos < ALIKE).any() for cos in cosines(view.around))

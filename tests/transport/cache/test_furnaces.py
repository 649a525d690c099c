"""Furnaces: in a closed room that is evenly bright, a volume keeps what its surfaces scatter, whatever their lobes.

[DDGIR Eq. 5, 6]
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from restir_ref.transport.cache.leaving import telling, undisplaced
from restir_ref.transport.cache.update import Updating, update
from restir_ref.transport.materials import Layer, Material, Vertex, evaluate_lobe
from restir_ref.transport.rays import arrive
from restir_ref.transport.scene import scene
from restir_ref.transport.space import ball_volume
from tests.transport.cache.worlds import WORLDS, live, volume
from tests.transport.lobe_cases import integral, tilted
from tests.transport.rooms import walls
from tests.transport.spaces import SEEING

EMITTED, COLOUR, ROUGHNESS = 1.0, 0.6, 0.6
MATERIALS = {
    "lambert": ("lambert",),
    "ggx": ("ggx",),
    "rough dielectric": ("rough reflection", "rough transmission"),
    "mirror": ("mirror",),
    "glass": ("glass reflection", "glass transmission"),
}
EVEN = ("lambert", "mirror", "glass")
"""Materials that scatter the same share of light whatever its direction; all worlds can sample them."""
CASES = [(world, name) for name in MATERIALS for world in (WORLDS if name in EVEN else SEEING)]


def furnished(world, name):
    """A room whose walls shine and are of one of the materials."""
    layers = [Layer(kind, (COLOUR,), ROUGHNESS) for kind in MATERIALS[name]]
    return scene(WORLDS[world][0], [Material(layers)], walls(WORLDS[world][0].d, 0, (EMITTED,)))


def scattered_share(s, cos):
    """int f |cos_i| dw_i of material 0, seen at cosines (N,), by quadrature over the whole sphere."""
    space, t, found = s.space, s.materials, []
    for c in cos:
        o = tilted(space.d, float(c))

        def f(i, o=o):
            n = i.shape[1]
            v = Vertex(
                o, o, np.repeat(o, n, axis=1), np.zeros(n, dtype=int), np.zeros(n, dtype=int), np.ones(n, dtype=bool)
            )
            return sum(evaluate_lobe(t, space, v, np.full(n, l), i)[0][0] for l in range(t.L))

        mirror = np.concatenate([-o[:-1], o[-1:]])
        found.append(integral(space, f, mirror, 200))
    return np.array(found)


@cache
def kept(world, name):
    """E / C_d of a probe in a furnace of radiance 1, less what is emitted; its mean over texels and frames."""
    s, times = furnished(world, name), 60 if name == "ggx" else 10
    v = volume(world, s)
    v = replace(v, E=v.E + ball_volume(v.grid.d))
    how = Updating(telling(undisplaced), rays=200, hysteresis=0.0, attenuation=0.0)
    chance = live(1)
    E = np.stack([update(v, s, how, chance).E for _ in range(times)]) / ball_volume(v.grid.d) - EMITTED
    return E.mean(), E.mean(axis=(1, 2, 3)).std() / np.sqrt(times)


@cache
def expected(world, name):
    """The mean over a probe's directions of what walls scatter back along them."""
    s = furnished(world, name)
    if name in EVEN:
        return COLOUR
    v = volume(world, s)
    x = np.repeat(v.grid.place(np.arange(v.grid.P)), 2000, axis=1)
    w = np.tile(v.maps.rays(2000, live(3)), v.grid.P)
    cos = arrive(s, x, w)[0].o[-1]
    at = 0.5 + 0.5 * np.cos((np.arange(20) + 0.5) / 20 * np.pi)
    return np.polynomial.Chebyshev.fit(at, scattered_share(s, at), 16, [0, 1])(cos).mean()


@pytest.mark.claims("DDGIR-E06", part="what a volume keeps", world="flatland2d")
@pytest.mark.claims("DDGIR-E06", part="what a volume keeps", world="tracer3d")
@pytest.mark.parametrize(("world", "name"), CASES)
def test_a_volume_keeps_what_surfaces_scatter_in_a_furnace(world, name):
    """Within half a percent: with 1 / C_d for the glossy term as for the diffuse one."""
    mean, error = kept(world, name)
    assert error < 0.0007
    assert abs(mean / expected(world, name) - 1) < 0.005


@pytest.mark.parametrize(("world", "factor"), [("plane", 1 / np.pi), ("solid", 1 / 2)])
def test_the_printed_constant_of_the_glossy_term_is_noticed(world, factor):
    """1 / (2 pi) instead of 1 / C_d."""
    assert abs(factor * kept(world, "ggx")[0] / expected(world, "ggx") - 1) > 0.4

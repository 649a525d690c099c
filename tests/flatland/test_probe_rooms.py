"""Laws of volumes in flatland's rooms for probes, with radiosity as a witness of its own.  [DDGIR 3.2, 3.4]"""

from dataclasses import replace

import numpy as np
import pytest

from flatland2d import radiosity
from flatland2d.directions import MAPS
from flatland2d.probe_rooms import PROBE_ROOMS, lamp_beside_probe, open_room, probes, sunlit
from flatland2d.scenes import Setting, crease
from restir_ref.batch import Array
from restir_ref.transport.cache.biases import self_shadow, view_path
from restir_ref.transport.cache.converge import converge
from restir_ref.transport.cache.rules import ORIGINAL
from restir_ref.transport.cache.update import Updating
from restir_ref.transport.cache.volume import Volume, Weighting, unlit
from restir_ref.transport.lobes import LOBES
from restir_ref.transport.materials import Vertex
from restir_ref.transport.rays import arrive
from restir_ref.transport.scene import Scene
from tests.transport.cache.worlds import live

PLAIN = Updating(attenuation=0)


def light(setting: Setting, per_unit: float, how: Updating = PLAIN, tolerance: float = 0.01, **weights) -> Volume:
    """A volume of the room at convergence."""
    v = replace(unlit(setting.scene, probes(setting, per_unit), MAPS), weighting=Weighting(**weights))
    return converge(v, setting.scene, how, live(1), tolerance=tolerance)


def seen(s: Scene, n: int, seed: int = 2) -> tuple[Vertex, Array, Array]:
    """Surface points that random rays in the room meet, the directions they came from, and how far away."""
    rng = np.random.default_rng(seed)
    v, r, met = arrive(s, rng.uniform(0.02, 0.98, (2, n)), s.space.sphere(rng.random((1, n))))
    assert met.all()
    return v, s.space.to_world(v.n, v.o), r


def irradiance(s: Scene, B: Array, p: radiosity.Panels, x: Array, n: Array) -> Array:
    """E (N,) from panels of radiance B, by exact visibility."""
    return 2 * radiosity.shares(s, p, x, n) @ B


def relative_bias(setting: Setting, v: Volume, radiance) -> float:
    """Mean E at every seventh probe in all its directions over the truth, less 1; radiance(B, p) of the panels."""
    s, n = setting.scene, v.maps.irradiance.centres()
    p = radiosity.cut(s, 30)
    probe = np.flatnonzero(v.active)[::7]
    x, w = np.repeat(v.grid.place(probe), n.shape[1], axis=1), np.tile(n, len(probe))
    truth = irradiance(s, radiance(radiosity.radiance(s, p, 40), p), p, x, w)
    return float(v.irradiance(x, w, w, 0 * x)[0].mean() / truth.mean() - 1)


@pytest.mark.claims("DDGIR-A01", part="all light, by radiosity")
def test_probes_are_too_bright_by_a_share_that_falls_with_their_spacing():
    """E at probes: +7 % at 8 per unit, +3.4 % at 16, for light bounces off what a probe before the wall knows."""
    biases = [relative_bias(open_room(), light(open_room(), each), lambda B, p: B) for each in (8, 16)]
    assert 0.05 < biases[0] < 0.09
    assert 0.02 < biases[1] < 0.6 * biases[0]


def test_original_probes_lack_the_light_that_comes_directly():
    """E_DDGI is that of all light but L_e; radiosity without the lamps' own radiance."""
    v = light(open_room(), 8, replace(PLAIN, rule=ORIGINAL), 0.02)
    assert abs(relative_bias(open_room(), v, lambda B, p: B - p.emission)) < 0.12
    assert relative_bias(open_room(), v, lambda B, p: B) < -0.2


def leaked(**weights) -> float:
    """Mean E on the walls of a room in which there is no light."""
    setting = sunlit(lamp=0.0)
    v, o, _ = seen(setting.scene, 4000)
    volume = light(setting, 8, replace(PLAIN, rays=128), **weights)
    return float(volume.irradiance(v.x, v.n, v.n, self_shadow(v.n, o, volume.spacing)).mean())


@pytest.mark.claims("DDGIR-A01", part="leak through a thin wall")
def test_visibility_keeps_all_but_a_tenth_of_the_light_that_leaks():
    """3 % of it are left at 8 probes per unit."""
    leaking = leaked(visibility=lambda v, r1, r2: np.ones_like(v))
    assert leaking > 0.5
    assert 0 < leaked() / leaking < 0.1


def test_the_wrap_weight_halves_what_leaks_without_visibility():
    free = {"visibility": lambda v, r1, r2: np.ones_like(v)}
    assert leaked(**free) < 0.6 * leaked(wrap=np.ones_like, **free)


def separated(setting: Setting, per_unit: float) -> dict[str, float]:
    """Of 1e5 second vertices, seen from first ones along cosine directions, how many each bias moves through a surface."""
    s, far = setting.scene, 0.75 / per_unit
    first, _, _ = seen(s, 100_000)
    local = LOBES["lambert"].sample(s.space, None, first.o, np.random.default_rng(3).random((1, 100_000)))
    v, r, _ = arrive(s, first.x, s.space.to_world(first.n, local))
    o = s.space.to_world(v.n, v.o)
    moved = {
        "self-shadow": self_shadow(v.n, o, np.full(2, 1 / per_unit)),
        "view path": view_path(o, far, r),
        "unclamped": far * o,
    }
    return {name: float((~s.visible(v.x, v.x + b)).mean()) for name, b in moved.items()}


@pytest.mark.claims("DDGIR-A07")
@pytest.mark.parametrize("make", [crease, sunlit])
def test_the_view_path_bias_never_moves_a_query_through_a_surface(make):
    """Near corners the default moves more than half a percent of them through one, and so does the fixed distance."""
    for per_unit in (8, 16):
        through = separated(make(), per_unit)
        assert through["view path"] == 0
        assert through["self-shadow"] > 0.005
        assert through["unclamped"] > 0.005


@pytest.mark.claims("DDGIR-C02", part="E on what is seen")
def test_attenuation_takes_back_what_probes_near_a_lamp_know_too_well():
    """Naive +116 %, attenuated -6 %: it underestimates slightly, as the paper says."""
    setting = lamp_beside_probe()
    s, p = setting.scene, radiosity.cut(setting.scene, 30)
    v, o, _ = seen(s, 800, 5)
    truth = irradiance(s, radiosity.radiance(s, p, 30), p, v.x, v.n).mean()
    found = []
    for attenuation in (0, 1):
        volume = light(setting, 4, Updating(attenuation=attenuation, rays=1024), 0.04)
        found.append(volume.irradiance(v.x, v.n, v.n, self_shadow(v.n, o, volume.spacing)).mean() / truth - 1)
    naive, attenuated = found
    assert naive > 0.1
    assert -0.1 <= attenuated <= 0.02
    assert abs(attenuated) < naive / 2


@pytest.mark.parametrize("name", PROBE_ROOMS)
def test_a_room_for_probes_has_a_grid_over_its_map_with_probes_inside(name):
    setting = PROBE_ROOMS[name]()
    g = probes(setting)
    assert g.counts == tuple(round(16 * (b - a)) for a, b in zip(setting.low, setting.high, strict=True))
    assert g.spacing == pytest.approx((1 / 16, 1 / 16))
    assert unlit(setting.scene, g, MAPS).active.mean() > 0.7


def test_the_sun_stays_outside():
    """From anywhere in the room, no ray meets anything but its walls and its lamp."""
    s = sunlit().scene
    v, _, _ = seen(s, 5000)
    assert (np.abs(v.x - 0.5).max(axis=0) <= 0.5 + 1e-9).all()
    assert len(s.lights.upto) == 2

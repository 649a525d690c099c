"""Laws of volumes that are updated to a tolerance: what is missing and what is noise is below it, or it is said."""

from dataclasses import replace

import numpy as np
import pytest

from flatland2d.directions import MAPS
from flatland2d.probe_rooms import open_room, probes
from restir_ref.transport.cache import converge as module
from restir_ref.transport.cache.converge import converge, noise_of
from restir_ref.transport.cache.update import Updating, update
from restir_ref.transport.cache.volume import unlit
from restir_ref.transport.materials import albedo
from restir_ref.transport.space import ball_volume
from tests.transport.cache.worlds import WORLDS, live, volume
from tests.transport.rooms import room

FURNACE = Updating(attenuation=0.0)


@pytest.mark.parametrize(("albedo", "tolerance"), [(0.0, 0.01), (0.5, 0.002), (0.9, 0.05)])
@pytest.mark.parametrize("name", WORLDS)
def test_a_furnace_lacks_less_than_the_tolerance(name, albedo, tolerance):
    s = room(WORLDS[name][0], albedo)
    v = converge(volume(name, s), s, FURNACE, live(1), tolerance=tolerance)
    missing = 1 - v.E * (1 - albedo) / ball_volume(v.grid.d)
    assert missing.max() <= tolerance
    assert missing.min() > -1e-12


def test_a_fixed_count_of_updates_at_a_fixed_hysteresis_leaves_a_sixth_of_a_furnace():
    """rho (1 - .03 (1 - rho))^199 = .168 at rho = .75."""
    s = room(WORLDS["plane"][0], 0.75)
    v = volume("plane", s)
    for t in range(200):
        v = update(v, s, FURNACE, live(t))
    np.testing.assert_allclose(1 - v.E / 8, 0.75 * (1 - 0.03 * 0.25) ** 199, rtol=1e-9)
    assert v.E.max() / 8 < 0.84


def test_volumes_that_are_made_anew_differ_by_the_tolerance():
    """Standard deviation over texels of two volumes' difference, sqrt 2 tolerances at most; twice that is refused."""
    setting, tolerance = open_room(), 0.004
    s, empty = setting.scene, unlit(setting.scene, probes(setting, 6), MAPS)
    one, other = (converge(empty, s, FURNACE, live(seed), tolerance=tolerance).E for seed in (1, 2))
    assert 0.25 < (one - other).std() / one.mean() / (np.sqrt(2) * tolerance) < 2


def test_the_hysteresis_rises_like_s_over_s_plus_g(monkeypatch):
    """a = 0 for as many updates as light needs bounces, rho^n <= tolerance; a_s = s / (s + g), g = 1 / (1 - rho)."""
    seen = []
    monkeypatch.setattr(
        module, "update", lambda v, s, how, chance: seen.append(how.hysteresis) or update(v, s, how, chance)
    )
    s, tolerance = open_room().scene, 0.02
    rho = float(albedo(s.materials).max())
    converge(unlit(s, probes(open_room(), 3), MAPS), s, replace(FURNACE, rays=16), live(1), tolerance=tolerance)
    bounces = int(np.ceil(np.log(tolerance) / np.log(rho)))
    later = np.maximum(np.arange(1, len(seen) + 1) - bounces, 0)
    np.testing.assert_allclose(seen, later / (later + 1 / (1 - rho)))
    assert later.max() > 3


@pytest.mark.parametrize("a", [0.2, 0.8])
def test_noise_is_that_of_a_blend_of_independent_frames_and_of_what_it_differs_from(a):
    """a E + (1 - a) E_new, iterated, has the variance (1 - a) / (1 + a) of E_new's, E_new - E that of both."""
    rng, E = np.random.default_rng(1), np.ones(20_000)
    for _ in range(60):
        before, E = E, a * E + (1 - a) * rng.normal(1, 0.3, E.size)
    assert noise_of(before, E, a) == pytest.approx(E.std() * np.sqrt(2 / (1 + a)), rel=0.03)
    assert noise_of(0 * E, 0 * E, a) == 0


def test_too_few_updates_are_said_with_the_noise_that_is_left():
    s = open_room().scene
    with pytest.raises(
        ValueError, match=r"after 30 updates the noise of E is \S+ of its mean, above 0.001: give probes"
    ):
        converge(
            unlit(s, probes(open_room(), 4), MAPS), s, replace(FURNACE, rays=16), live(1), tolerance=0.001, most=30
        )


@pytest.mark.parametrize("tolerance", [0.0, -1.0, 1.0, np.nan])
def test_a_tolerance_that_is_no_share_is_refused(tolerance):
    s = room(WORLDS["plane"][0])
    with pytest.raises(ValueError, match=f"a tolerance must be in .0, 1., but is {tolerance}"):
        converge(volume("plane", s), s, FURNACE, live(1), tolerance=tolerance)

"""Laws of volumes in space: the furnace, and the lamp beside a probe.  [DDGIR 3.2]"""

from dataclasses import replace

import numpy as np
import pytest

from restir_ref.transport.cache.biases import self_shadow
from restir_ref.transport.cache.converge import converge
from restir_ref.transport.cache.update import Updating, scattered_once, update
from restir_ref.transport.cache.volume import unlit
from restir_ref.transport.rays import arrive
from tests.transport.cache.worlds import live
from tracer3d.directions import MAPS
from tracer3d.probe_rooms import PROBE_ROOMS, lamp_beside_probe, probes
from tracer3d.scenes import FURNACE_ALBEDO, furnace


@pytest.mark.parametrize("name", PROBE_ROOMS)
def test_a_room_for_probes_has_a_grid_over_it_with_probes_inside(name):
    setting = PROBE_ROOMS[name]()
    g = probes(setting, 4)
    assert (g.counts, g.spacing) == ((4, 4, 4), (0.25, 0.25, 0.25))
    assert unlit(setting.scene, g, MAPS).active.mean() > 0.9
    assert probes(setting).P == 512


@pytest.mark.claims("DDGIR-E01", part="volume in a furnace", world="tracer3d")
def test_a_furnace_s_probes_hold_pi_times_its_radiance():
    s = furnace().scene
    v = converge(unlit(s, probes(furnace(), 2), MAPS), s, Updating(attenuation=0), live(1), tolerance=0.001)
    np.testing.assert_allclose(v.E, np.pi / (1 - FURNACE_ALBEDO), rtol=0.001)


def test_a_lamp_near_probes_lights_too_much_unless_its_light_is_attenuated():
    """Direct light on surfaces, by probes over by the lamp's points: 4.8 naive, .65 attenuated.

    The nearest probe is a third of a spacing from the lamp: both are far from 1, on either side.
    """
    s = lamp_beside_probe().scene
    rng = np.random.default_rng(2)
    x = rng.uniform(0.25, 0.55, (3, 2000)) + np.array([[0], [0.1], [0]])
    v, _, _ = arrive(s, x, s.space.sphere(rng.random((2, 2000))))
    o = s.space.to_world(v.n, v.o)
    found = {}
    for scale in (0.0, 1.0):
        how = Updating(lambda s, f, v, r, chance: np.zeros((3, len(r))), rays=1000, attenuation=scale, hysteresis=0)
        empty, chance = unlit(s, probes(lamp_beside_probe(), 4), MAPS), live(3)
        E = np.mean([update(empty, s, how, chance).E for _ in range(4)], axis=0)
        filled = replace(update(empty, s, how, chance), E=E)
        found[scale] = filled.irradiance(v.x, v.n, v.n, self_shadow(v.n, o, filled.spacing))[0].mean()
    truth = scattered_once(s, v, live(4))[0].mean() * np.pi / 0.5
    assert found[0.0] / truth > 3
    assert 0.5 < found[1.0] / truth < 0.8

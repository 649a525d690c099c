"""What original DDGI leaves out, with exact irradiance in place of its probes: gloss behind a diffuse vertex.

[DDGIR Eq. 2]
"""

from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from figures.experiments.deep import ROOMS, truth
from flatland2d import radiosity
from flatland2d.scenes import Setting, matte
from restir_ref.batch import Array, take
from restir_ref.chance import Live
from restir_ref.transport import materials as mat
from restir_ref.transport.cache.leaving import Cache, diffuse_albedo, is_glossy
from restir_ref.transport.cache.shading import Arrival, recursive
from restir_ref.transport.materials import Vertex
from restir_ref.transport.paths import RECONNECTION, Tracer, first_hit
from restir_ref.transport.rays import arrive, emitted
from restir_ref.transport.scene import Scene

PANELS, DEPTH, SAMPLES = 48, 24, 1024


@dataclass(frozen=True, eq=False)
class DiffuseWorld:
    """Irradiance of lights, and of light that Lambert lobes alone have scattered, by radiosity; a `Field`.

    Surfaces of `white` are white: what is gathered on them is irradiance over 2.
    """

    white: Scene
    p: radiosity.Panels
    B: Array
    C: int = 1
    spacing: Array = field(default_factory=lambda: np.full(2, 0.1))

    def irradiance(self, x: Array, n: Array, w: Array, b: Array) -> Array:
        _, prim = self.white.intersect(x + 1e-4 * n, -n)
        return 2 * radiosity.gather(self.white, self.p, self.B, x, prim, n)[None]


def diffuse_world(s: Scene) -> DiffuseWorld:
    """B = (1 - T_fd)^-1 L_e."""
    M = int(s.material.max()) + 1
    zero, one = np.zeros((2, M)), np.ones(M, dtype=bool)
    rho = diffuse_albedo(s.materials, Vertex(zero, zero, zero, np.arange(M), np.arange(M), one))[0]
    white = replace(s, materials=mat.table([matte(1.0)] * M, 1))
    p = radiosity.cut(white, PANELS)
    T = rho[s.material[p.prim]][:, None] * radiosity.shares(s, p, (p.a + p.b) / 2, p.n)
    return DiffuseWorld(white, p, np.linalg.solve(np.eye(len(T)) - T, p.emission))


def first(setting: Setting, samples: int, chance: Live) -> tuple[Tracer, tuple[Vertex, Array]]:
    """Vertices on the inset's pixels, pixel by pixel again and again, and their distances."""
    t = Tracer(setting.scene, setting.pinhole(), 1, RECONNECTION)
    v, r, _ = first_hit(t, chance.uniform((1, samples * t.sensor.n)), np.arange(samples * t.sensor.n) % t.sensor.n)
    return t, (v, r)


def original(setting: Setting, samples: int, chance: Live) -> Array:
    """L_e + T_fd L_e + L_DDGI + T_fg (the same): what DDGI tells where its probes are exact, (samples n,)."""
    t, (v, r) = first(setting, samples, chance)
    one = np.ones(len(r))
    c = Cache(t.scene, diffuse_world(t.scene))
    return (emitted(t.scene, v) + recursive(np.inf, DEPTH)(c, Arrival(v, r, one, one, one > 0), chance))[0]


def walked(setting: Setting, samples: int, chance: Live) -> tuple[Array, Array, Array]:
    """Emitted light by paths that choose lobes one by one: all, with gloss behind a diffuse vertex, with gloss."""
    t, (v, _) = first(setting, samples, chance)
    s, N = t.scene, len(v.prim)
    index, T, found = np.arange(N), np.ones((1, N)), np.stack([emitted(s, v)[0], np.zeros(N), np.zeros(N)])
    diffuse, behind, gloss = np.zeros((3, N), dtype=bool)
    for _ in range(DEPTH):
        P, u = mat.lobe_shares(s.materials, v), chance.uniform((2, len(index)))
        lobe = mat.choose_lobe(P, u[0])
        i = mat.sample_lobe(s.materials, s.space, v, lobe, u[1:])
        glossy = np.take_along_axis(is_glossy(s.materials, v), lobe[None], axis=0)[0]
        diffuse, behind, gloss = diffuse | ~glossy, behind | (diffuse & glossy), gloss | glossy
        T = T * mat.scatter_lobe(s.materials, s.space, v, P, lobe, i)[0]
        on = np.flatnonzero(T[0] > 0)
        index, T, diffuse, behind, gloss = take((index, T, diffuse, behind, gloss), on)
        v, _, hit = arrive(s, v.x.take(on, axis=-1), s.space.to_world(v.n, i).take(on, axis=-1))
        T = T * hit
        found[:, index] += (T * emitted(s, v))[0] * np.stack([hit, behind, gloss])
    return found[0], found[1], found[2]


@pytest.mark.claims("DDGIR-E02", part="Lambert lobes only")
def test_with_exact_probes_and_lambert_lobes_original_ddgi_lacks_nothing() -> None:
    room = ROOMS["open_room"]()
    told = original(room, 64, Live(np.random.default_rng(1)))
    assert told.mean() == pytest.approx(truth("open_room").mean(), rel=0.005)


@pytest.mark.claims("DDGIR-E02", part="glossy boxes")
def test_original_ddgi_lacks_gloss_behind_diffuse_vertices_and_no_more() -> None:
    """Two fifths of the light in the inset of FS2.  Its twin takes all paths with gloss, wherever that is."""
    room, at = ROOMS["glossy_cornell"](), truth("glossy_cornell").mean()
    lacking = at - original(room, SAMPLES // 2, Live(np.random.default_rng(1))).mean()
    every, missing, gloss = (each.mean() for each in walked(room, SAMPLES, Live(np.random.default_rng(2))))
    assert every == pytest.approx(at, rel=0.015)
    assert lacking > 0.3 * at
    assert lacking == pytest.approx(missing, rel=0.03)
    assert lacking != pytest.approx(gloss, rel=0.03)

"""Light from frozen volumes of probes in flatland, without the noise of frames: what queries at x_1 and at x_2 tell.

Points are drawn on pixels, and each has its truth, by radiosity at that very point; rays to x_2 are even in the
cosine's measure, turned at random.  So what differs from the truth is what the probes do not know.  Direct light of x_1
is left to ReSTIR DI by primary and secondary queries alike, and left out here unless told otherwise.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache as once
from functools import partial
from types import MappingProxyType

import numpy as np

from flatland2d import SCENES, radiosity
from flatland2d.directions import MAPS
from flatland2d.probe_rooms import lamp_beside_probe, probes, sunlit
from flatland2d.scenes import LAMP, Setting, block, chain, matte, room
from flatland2d.sensors import Pinhole
from flatland2d.space import PLANE
from restir_ref.batch import Array, take
from restir_ref.chance import Chance, Live
from restir_ref.transport.baselines.restir_di import indirect_light
from restir_ref.transport.cache.biases import REACH, self_shadow, view_path
from restir_ref.transport.cache.converge import converge
from restir_ref.transport.cache.footprint import as_wide_as_in_space, pixel_footprint
from restir_ref.transport.cache.leaks import leaked
from restir_ref.transport.cache.leaving import Cache, Displacement, diffuse, diffuse_albedo, displacement, telling
from restir_ref.transport.cache.rules import AUGMENTED, Rule
from restir_ref.transport.cache.shading import Arrival, recursive
from restir_ref.transport.cache.update import Updating
from restir_ref.transport.cache.volume import Volume, unlit
from restir_ref.transport.materials import Vertex
from restir_ref.transport.paths import RECONNECTION, Tracer, trace
from restir_ref.transport.rays import arrive
from restir_ref.transport.scene import Scene, scene

STREAM = 0x960BE
"""Of the rays of volumes: the same in all chunks, so that methods share them."""

TOLERANCE = 0.01
"""Of missing light and of noise in a volume, as a share of its mean."""

PANELS = 30
"""Per segment, of the truth: errors of .1 %."""


@dataclass(frozen=True, eq=False)
class View:
    """A room, the eye that looks at it, and the region (N,) of surface points x (d, N) where probes have it hard."""

    setting: Setting
    sensor: Callable[[int], Pinhole]
    region: Callable[[Array], Array]


def film(eye: tuple[float, float], towards: tuple[float, float], n: int, half: float = 0.6) -> Pinhole:
    """A film of n pixels."""
    return Pinhole(eye, towards, n, half, film=n)


def of_scene(setting: Setting, region: Callable[[Array], Array]) -> View:
    """The whole film of a scene's own eye, with fewer pixels."""
    return View(setting, partial(film, setting.eye, setting.towards), region)


def wedge(degrees: float = 30.0) -> Setting:
    """FS4 with a wedge of that many degrees."""
    slope = [(0.0, 0.0), (0.45, 0.45 * float(np.tan(np.radians(degrees))))]
    facets = [*room(0), *chain(slope, 0), *block((0.6, 0.03), (0.9, 0.3), 0), *chain(LAMP, 0, 8.0)]
    return Setting(scene(PLANE, [matte(0.7)], facets), (0.55, 0.6), (0.45, 0.0), crop=512)


def on_floor(low: float, high: float) -> Callable[[Array], Array]:
    """Whether points are on the floor between two places."""
    return lambda x: np.asarray((x[1] < 1e-6) & (x[0] > low) & (x[0] < high))


@once
def view(name: str) -> View:
    """A view by its name."""
    return VIEWS[name]()


VIEWS: Mapping[str, Callable[[], View]] = MappingProxyType(
    {
        "FS11": lambda: View(sunlit(), partial(film, (0.8, 0.5), (0.0, 0.0), half=0.3), on_floor(0.0, 1 / 16)),
        "FS4": lambda: View(SCENES["crease"](), partial(film, (0.5, 0.1), (0.75, 0.0)), on_floor(0.6, 0.9)),
        "FS4, 30 degrees": lambda: View(wedge(), partial(film, (0.55, 0.1), (0.15, 0.0)), on_floor(0.0, 0.45)),
        "FS8": lambda: of_scene(SCENES["glass_disc"](), on_floor(0.35, 0.65)),
        "FS3": lambda: of_scene(SCENES["ajar"](), on_floor(0.0, 1.0)),
        "FS12": lambda: of_scene(lamp_beside_probe(), on_floor(0.6, 1.0)),
    }
)
"""Rooms by their names in the ledger: FS4 below its furniture, its wedge from before it, the others by their own eye.

FS11's own eye looks at the sunny wall, on which nothing leaks: light leaks into the corners beside it, onto points for
which the nearest probes are beyond the wall and as far away as the wall is from them.
"""


# ---------------------------------------------------------------- volumes


def along_view(spacing: float) -> Displacement:
    """Back along the path, as far as the self-shadow bias goes.  [DDGIR 3.4]"""
    return lambda n, o, r: view_path(o, REACH * spacing, r)


def off_surface(spacing: float) -> Displacement:
    """The self-shadow bias.  [Majercik 2019]"""
    return lambda n, o, r: self_shadow(n, o, np.array([spacing]))


@once
def volume(
    name: str,
    per_unit: float,
    rule: Rule = AUGMENTED,
    attenuation: float = 1.0,
    tolerance: float = TOLERANCE,
    rays: int = 64,
) -> Volume:
    """The converged volume of a view's room: always the same.  Updates look back along their rays."""
    setting = view(name).setting
    empty = unlit(setting.scene, probes(setting, per_unit), MAPS)
    how = Updating(telling(along_view(1 / per_unit)), rule, rays, attenuation=attenuation)
    return converge(empty, setting.scene, how, Live(np.random.default_rng(STREAM)), tolerance=tolerance)


# ---------------------------------------------------------------- what is seen


@dataclass(frozen=True, eq=False)
class Seen:
    """First vertices x_1 of all pixels, at distances r (N,), and which are in the view's region."""

    v: Vertex
    r: Array
    inside: Array


def seen(name: str, u: Array) -> Seen:
    """One point on each pixel of a film, from places u (n,) in [0, 1) on them."""
    of, n = view(name), len(u)
    x, w, _ = of.sensor(n).ray(np.arange(n), u[None])
    v, r, _ = arrive(of.setting.scene, x, w)
    return Seen(v, r, of.region(v.x))


def met(name: str, N: int, chance: Chance) -> Seen:
    """N surface points that rays meet which go anywhere from anywhere on the room's map."""
    of = view(name)
    low, high = (np.array(each)[:, None] for each in (of.setting.low, of.setting.high))
    s, u = of.setting.scene, chance.uniform((3, N))
    v, r, hit = arrive(s, low + u[:2] * (high - low), s.space.sphere(u[2:]))
    v, r = take((v, r), np.flatnonzero(hit))
    return Seen(v, r, of.region(v.x))


@dataclass(frozen=True, eq=False)
class Truth:
    """A room of Lambert surfaces in panels: their radiance B, and that of light sources alone."""

    s: Scene
    p: radiosity.Panels
    B: Array

    def scattered(self, v: Vertex, B: Array) -> Array:
        """Radiance that vertices send on of light from panels of radiance B, (N,)."""
        return radiosity.gather(self.s, self.p, B, v.x, v.prim, v.n)


@once
def truth(name: str) -> Truth:
    """Radiosity, solved."""
    s = view(name).setting.scene
    p = radiosity.cut(s, PANELS)
    T = diffuse_colours(s, p.prim)[:, None] * radiosity.shares(s, p, (p.a + p.b) / 2, p.n)
    return Truth(s, p, np.linalg.solve(np.eye(len(T)) - T, p.emission))


def diffuse_colours(s: Scene, prim: Array) -> Array:
    """Albedos (N,) of primitives of a room of Lambert surfaces."""
    return np.asarray(s.materials.colour[0].reshape(-1, s.materials.L).sum(axis=1)[s.material[prim]])


def direct(name: str, v: Vertex) -> Array:
    """What is scattered at x_1 of light that comes straight from a source, (N,)."""
    t = truth(name)
    return t.scattered(v, t.p.emission)


def traced(name: str, n: int, samples: int, chance: Chance, depth: int = 16, at_once: int = 256) -> Array:
    """The same in any room, (n,), at the middles of pixels: path tracing, noisy."""
    t = Tracer(view(name).setting.scene, view(name).sensor(n), depth, RECONNECTION)
    found = np.zeros(n)
    for _ in range(max(samples // at_once, 1)):
        u = chance.uniform((t.D, n * at_once))
        u[0] = 0.5
        found += indirect_light(trace(t, u, np.tile(np.arange(n), at_once)))[0].reshape(at_once, n).mean(axis=0)
    return found / max(samples // at_once, 1)


def indirect(name: str, v: Vertex) -> Array:
    """What is scattered at x_1 of light that was scattered before, (N,)."""
    t = truth(name)
    return t.scattered(v, t.B - t.p.emission)


# ---------------------------------------------------------------- what probes tell


def at_first(c: Cache, x: Seen) -> Array:
    """rho / C_d E(x_1, n), (N,): a primary query, of Lambert lobes."""
    return np.asarray(diffuse(c, x.v, x.r)[0])


SHADING = recursive(as_wide_as_in_space(2))


@dataclass(frozen=True, eq=False)
class Arriving:
    """Second vertices of R even rays from each of N first ones, ray by ray in columns (R N): albedo * mean is shown."""

    at: Arrival
    albedo: Array
    R: int

    def shown(self, L: Array) -> Array:
        """What x_1 sends on of radiance L (C, R N) from all its x_2, (N,); Lambert lobes."""
        return np.asarray(self.albedo * L[0].reshape(self.R, -1).mean(axis=0))


def arriving(s: Scene, x: Seen, R: int, chance: Chance) -> Arriving:
    """R rays from each x_1, even in the sine of their angle, turned together by one number per x_1."""
    N = len(x.r)
    u = (np.arange(R)[:, None] + chance.uniform((N,))) / R
    sine = 2 * u.reshape(-1) - 1
    local = np.stack([sine, np.sqrt(np.maximum(1 - sine**2, 0))])
    v = take(x.v, np.tile(np.arange(N), R))
    z, r, met = arrive(s, v.x, s.space.to_world(v.n, local))
    a0 = np.tile(pixel_footprint(x.r, x.v.o[-1], s.space.d), R)
    return Arriving(Arrival(z, r, local[-1] / 2, a0, met), diffuse_albedo(s.materials, x.v)[0], R)


def at_second(c: Cache, rays: Arriving, chance: Chance) -> Array:
    """L+(x_2) by all rays, (N,): secondary queries, with specular recursion."""
    return rays.shown(SHADING(c, rays.at, chance) * rays.at.wanted)


def leaking(c: Cache, v: Volume, rays: Arriving) -> Array:
    """The part of it, (N,), that probes tell that do not see x_2; diffuse terms."""
    z, s = rays.at.z, c.scene
    b = displacement(c, z, rays.at.r)
    E = leaked(v, s, z.x, z.n, b)
    return rays.shown(diffuse_albedo(s.materials, z) / 2 * E * rays.at.wanted)

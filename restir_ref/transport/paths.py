"""Path tracing as a pure function of primary samples: trees, their leaves, and the path record.  [GRIS 7.6, 8]

x_0 is on the sensor, x_1 the first hit; a path scatters at x_1 .. x_k and ends on a light x_(k+1),
found by light sampling (NEE) or by a BSDF sample.  Each end of a tree is a leaf (k, nee), a part of
its own of the disjoint union of primary sample spaces, so the candidate density is 1.  The
integrand is F = omega f / p.

Primary numbers: the sensor's, then 2 d per vertex: lobe 1, direction d-1, light 1, light point d-1.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol

import numpy as np

from restir_ref.batch import Array, Block, entries, ratio, take
from restir_ref.guards import whole
from restir_ref.transport import materials as mat
from restir_ref.transport.materials import Vertex
from restir_ref.transport.rays import GRAZING, arrive, emitted, light_pdf, sample_light
from restir_ref.transport.scene import Scene
from restir_ref.transport.vectors import dot, norm

CROWDED = 0.9
"""Share of paths alive above which it costs more to leave out the others than to trace them."""


class Sensor(Protocol):
    """n pixels; pixel and `numbers` primary numbers give a ray and its weight."""

    @property
    def n(self) -> int:
        """Number of pixels."""

    @property
    def numbers(self) -> int:
        """Primary numbers per ray."""

    @property
    def film_numbers(self) -> int:
        """How many of them, the first ones, are the place in the pixel, along the last axis of the image first."""

    def ray(self, pixel: Array, u: Array) -> tuple[Array, Array, Array]:
        """Start (d, N), direction (d, N), weight (N,)."""


@dataclass(frozen=True)
class Connectability:
    """When two vertices may be connected: both lobes this rough, and this far apart.  [GRIS 7.5]

    Roughness is perceptual, distance in scene units.  Delta lobes never connect.
    Raises ValueError for thresholds that are negative or NaN; infinite ones are never met.

    >>> from restir_ref.transport.paths import RECONNECTION, Connectability
    >>> Connectability(roughness=0.2, distance=0.02), RECONNECTION
    (Connectability(roughness=0.2, distance=0.02), Connectability(roughness=0.0, distance=0.0))
    """

    roughness: float
    distance: float

    def __post_init__(self) -> None:
        if not (self.roughness >= 0 and self.distance >= 0):
            raise ValueError(
                f"thresholds of connectability must be >= 0, but are roughness {self.roughness} and distance "
                f"{self.distance}: 0 connects whatever can be, inf nothing."
            )


RECONNECTION = Connectability(0.0, 0.0)
REPLAY = Connectability(np.inf, 0.0)


def connectable(rule: Connectability, r_x: Array, r_z: Array, distance: Array) -> Array:
    """The one predicate for base path, offset path and inverse; r are roughnesses, (N,)."""
    rough = (np.minimum(r_x, r_z) >= rule.roughness) & (r_x > 0) & (r_z > 0)
    return rough & (distance >= rule.distance)


@dataclass(frozen=True, eq=False)
class Tracer:
    """A scene seen by a sensor, up to `depth` scattering vertices, with a rule for connections.

    Raises ValueError for a depth that is no whole number >= 1, or a sensor of another dimension than the scene.

    >>> from flatland2d import setting
    >>> from restir_ref.transport.paths import Connectability, Tracer
    >>> room = setting("cornell")
    >>> t = Tracer(room.scene, room.pinhole(128), depth=3, rule=Connectability(roughness=0.2, distance=0.02))
    >>> t.D  # random numbers of a path: one for the film, four for each of three vertices
    13
    """

    scene: Scene
    sensor: Sensor
    depth: int
    rule: Connectability

    LEAST: ClassVar[int] = 1
    """The smallest depth."""

    def __post_init__(self) -> None:
        whole(self.depth, self.LEAST, "the path depth", "It counts scattering vertices; 1 is direct light.")
        x, _, _ = self.sensor.ray(np.zeros(1, dtype=int), np.full((self.sensor.numbers, 1), 0.5))
        if x.shape[:1] != (self.scene.space.d,):
            raise ValueError(
                f"{self.sensor} has rays in {len(x)} dimensions, but the scene has {self.scene.space.d}: "
                f"take a sensor of the scene's own world."
            )

    @property
    def D(self) -> int:
        """Primary numbers of a path."""
        return self.sensor.numbers + 2 * self.scene.space.d * self.depth

    def lobe_number(self, u: Array, i: int) -> Array:
        """The number that chooses the lobe at x_i, (N,)."""
        return np.asarray(u[self._start(i)])

    def direction_numbers(self, u: Array, i: int) -> Array:
        """The numbers of the direction leaving x_i, (d-1, N)."""
        start, d = self._start(i), self.scene.space.d
        return u[start + 1 : start + d]

    def scatter_numbers(self, i: int) -> slice:
        """Which rows of u choose the lobe and the direction at x_i."""
        start = self._start(i)
        return slice(start, start + self.scene.space.d)

    def light_numbers(self, u: Array, i: int) -> tuple[Array, Array]:
        """The numbers of light sampling at x_i: pick (N,), point (d-1, N)."""
        start, d = self._start(i), self.scene.space.d
        return u[start + d], u[start + d + 1 : start + 2 * d]

    def end_numbers(self, x: "Path") -> tuple[Array, Array]:
        """The same at each path's own last vertex x_k."""
        start, d = self._start(x.k), self.scene.space.d
        pick, *point = (entries(x, "u", start + row) for row in range(d, 2 * d))
        return pick, np.stack(point)

    def _start(self, i: Any) -> Any:
        return self.sensor.numbers + 2 * self.scene.space.d * (i - 1)


@dataclass(frozen=True, eq=False)
class Suffix(Tracer):
    """What is left of a path behind one of its vertices: it may meet a light without scattering."""

    LEAST = 0


@dataclass(frozen=True)
class Path(Block):
    """A path, evaluated, with what its shift needs.  [GRIS 8.2]

    u (D, N)  primary sample; stale from the reconnection on
    k, nee    scattering vertices, and whether the end was found by light sampling
    c         index of the reconnection vertex x_c, 0 for pure replay
    z, prim   x_c (d, N) and its primitive;  lobe_in, lobe_out  lobes at x_(c-1) and x_c
    out       direction (d, N) leaving x_c;  S (C, N)  what the suffix beyond it carries
    p_light   density (directions) of sampling the light from x_k, kept while c = k
    A         density of x_c (area) and of `out`, as primary samples produce them; 1 for replay
    F         omega f / p, (C, N)
    """

    u: Array
    k: Array
    nee: Array
    c: Array
    z: Array
    prim: Array
    lobe_in: Array
    lobe_out: Array
    out: Array
    S: Array
    p_light: Array
    A: Array
    F: Array


@dataclass(frozen=True)
class Scatter:
    """What happens at one vertex: lobe l and shares P, direction w (d, N), f cos / p (C, N), densities (N,)."""

    lobe: Array
    P: Array
    w: Array
    weight: Array
    p: Array
    p_all: Array


@dataclass(frozen=True)
class Leaf:
    """An end of a tree: F = T end, where bare = end without what depends on the direction arriving at x_k."""

    end: Array
    bare: Array
    p_light: Array


def scatter(t: Tracer, v: Vertex, u: Array, i: int) -> Scatter:
    """Sample one lobe and a direction at x_i; densities include the lobe's probability."""
    return scatter_by(t, v, u[t.scatter_numbers(i)])


def scatter_by(t: Tracer, v: Vertex, numbers: Array) -> Scatter:
    """The same by the vertex's own numbers: of the lobe and of the direction, (d, N) together."""
    table, space = t.scene.materials, t.scene.space
    P = mat.lobe_shares(table, v)
    lobe = mat.choose_lobe(P, numbers[0])
    local = mat.sample_lobe(table, space, v, lobe, numbers[1:])
    lost = local[-1] == 0
    local[-1] = np.where(lost, 1.0, local[-1])
    weight, p, p_all = mat.scatter_lobe(table, space, v, P, lobe, local)
    return Scatter(lobe, P, space.to_world(v.n, local), np.where(lost, 0.0, weight), p, p_all)


def light_leaf(t: Tracer, v: Vertex, P: Array, numbers: tuple[Array, Array]) -> tuple[Leaf, Array]:
    """Light sampling at x_i with its `light_numbers`: the leaf (i, NEE), the direction to the light.  [GRIS Eq. 49]"""
    s = t.scene
    light = sample_light(s, *numbers)
    to = light.y - v.x
    r = np.maximum(norm(to), 1e-300)
    w = to / r
    cos_y = -dot(light.n, w)
    f, p_all = mat.evaluate_all(s.materials, s.space, v, P, s.space.to_local(v.n, w))
    seen = (cos_y > GRAZING) & (f > 0).any(axis=0)
    p_light = light.pdf_area * r ** (s.space.d - 1) / np.where(seen, cos_y, 1)
    facing = np.flatnonzero(seen)
    seen[facing] = s.visible(v.x.take(facing, axis=-1), light.y.take(facing, axis=-1))
    bare = np.where(seen, light.emission / p_light, 0)
    return Leaf(f * bare * ratio(p_light, p_light + p_all), bare, p_light), w


def hit_leaf(t: Tracer, v: Vertex, r: Array, p_all: Array) -> Leaf:
    """A BSDF sample of density p_all has met v at distance r: the leaf (i, BSDF), zero unless v emits."""
    bare = emitted(t.scene, v)
    p_light = light_pdf(t.scene, v, r)
    omega = np.where(p_all > 0, ratio(p_all, p_all + p_light), 1.0)  # delta lobes, and sensors, have no rival
    return Leaf(bare * omega, bare, p_light)


@dataclass(frozen=True)
class Tree:
    """A traced path tree: vertices x_1 .., scattering at each, distances, leaves by kind, throughput T_i."""

    u: Array
    x: Sequence[Vertex]
    at: Sequence[Scatter]
    r: Sequence[Array]
    seen: Leaf
    lights: Sequence[tuple[Leaf, Array]]
    hits: Sequence[Leaf]
    T: Sequence[Array]


def trace(t: Tracer, u: Array, pixel: Array) -> Tree:
    """The whole tree of a primary sample u (D, N).

    Raises ValueError for u of another shape.

    >>> import numpy as np
    >>> from flatland2d import setting
    >>> from restir_ref.transport.paths import RECONNECTION, Tracer, radiance, trace
    >>> room = setting("cornell")
    >>> t = Tracer(room.scene, room.pinhole(16), room.depth, RECONNECTION)
    >>> pixel = np.arange(16 * 100) % 16
    >>> L = radiance(trace(t, np.random.default_rng(1).random((t.D, len(pixel))), pixel))
    >>> L.shape, bool((L >= 0).all())
    ((1, 1600), True)
    """
    if u.shape != (t.D, len(pixel)):
        raise ValueError(
            f"a primary sample of this tracer has {t.D} numbers for each of {len(pixel)} pixels, but u has shape "
            f"{u.shape}: draw chance.uniform((tracer.D, len(pixel)))."
        )
    v, r, T = first_hit(t, u, pixel)
    bare = emitted(t.scene, v)
    seen = Leaf(bare, bare, np.zeros(len(pixel)))
    vertices, scatters, distances, lights, hits, throughputs = [v], [], [r], [], [], [T]
    for i in range(1, t.depth + 1):
        at, light, v, r, hit = _bounce_alive(t, v, u, i, T)
        T = T * at.weight
        vertices.append(v)
        scatters.append(at)
        distances.append(r)
        lights.append(light)
        hits.append(hit)
        throughputs.append(T)
    return Tree(u, vertices, scatters, distances, seen, lights, hits, throughputs)


Bounce = tuple[Scatter, tuple[Leaf, Array], Vertex, Array, Leaf]
"""What happens at x_i, its light sample, x_(i+1) and its distance, and what is emitted there."""


def _bounce(t: Tracer, v: Vertex, u: Array, i: int) -> Bounce:
    """Scatter at x_i, sample a light from it, and meet x_(i+1)."""
    at = scatter(t, v, u, i)
    light = light_leaf(t, v, at.P, t.light_numbers(u, i))
    v, r, met = arrive(t.scene, v.x, at.w)
    at = Scatter(at.lobe, at.P, at.w, at.weight * met, at.p, at.p_all)
    return at, light, v, r, hit_leaf(t, v, r, at.p_all)


def _bounce_alive(t: Tracer, v: Vertex, u: Array, i: int, T: Array) -> Bounce:
    """The same, for no rays of paths that carry nothing any more: their columns repeat another's, times T = 0."""
    alive = np.flatnonzero(T.any(axis=0))
    n = T.shape[-1]
    if len(alive) > CROWDED * n:
        return _bounce(t, v, u, i)
    alive = alive if len(alive) else np.arange(min(n, 1))
    found: Bounce = _bounce(t, *take((v, u), alive), i)
    column = np.zeros(n, dtype=int)
    column[alive] = np.arange(len(alive))
    return take(found, column)


def first_hit(t: Tracer, u: Array, pixel: Array) -> tuple[Vertex, Array, Array]:
    """x_1, its distance, and the throughput (C, N) that arrives there."""
    x, w, weight = t.sensor.ray(pixel, u[: t.sensor.numbers])
    v, r, met = arrive(t.scene, x, w)
    return v, r, np.broadcast_to(weight * met, (t.scene.C, len(pixel)))


def leaves(tree: Tree) -> Iterator[tuple[int, bool, Array]]:
    """(k, nee, F) of every leaf, F (C, N)."""
    yield 0, False, tree.T[0] * tree.seen.end
    for i, ((light, _), hit) in enumerate(zip(tree.lights, tree.hits, strict=True), start=1):
        yield i, True, tree.T[i - 1] * light.end
        yield i, False, tree.T[i] * hit.end


def radiance(tree: Tree) -> Array:
    """Sum of all leaves, (C, N): plain path tracing.

    >>> import numpy as np
    >>> from flatland2d import setting
    >>> from restir_ref.transport.paths import RECONNECTION, Tracer, radiance, trace
    >>> room = setting("furnace")
    >>> t = Tracer(room.scene, room.pinhole(4), room.depth, RECONNECTION)
    >>> tree = trace(t, np.random.default_rng(1).random((t.D, 4000)), np.arange(4000) % 4)
    >>> radiance(tree).mean().round(1)
    np.float64(2.0)
    """
    return np.asarray(sum(F for _, _, F in leaves(tree)))

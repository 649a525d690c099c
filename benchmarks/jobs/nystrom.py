"""Radiosity with exact visibility, Nystrom's method: deterministic images of Lambert scenes, good to about 1e-5.

Seen from a point, the plane falls into angles between ends of segments, and in each of them one segment
is seen: L(x) = albedo/2 sum over these of the integral of B ds, s the sine of the angle to the normal, by
Gauss's rule on these angles cut further.  B lives on pieces of segments, which end where other segments
begin or come near, at nodes that crowd towards both ends, and is interpolated in between.  Everything is
refined once, and the change is the error.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from flatland2d.scenes import Setting
from flatland2d.sensors import Pinhole
from restir_ref.batch import Array
from restir_ref.transport.lobes import KINDS
from restir_ref.transport.scene import Scene
from restir_ref.transport.vectors import dot

NEARBY = 0.1
"""Ends of other segments closer than this share of a segment's length cut it in pieces."""
SLIVER = 1e-9
POINTS_AT_ONCE = 512
GAUSS = 2


def is_lambert(scene: Scene) -> bool:
    """Whether radiosity applies: one channel, segments only, Lambert only."""
    table = scene.materials
    others = (table.kind != KINDS.index("lambert")) & (table.colour.max(axis=0) > 0)
    return scene.C == 1 and not scene.radii.size and not others.any()


@dataclass(frozen=True, eq=False)
class Pieces:
    """P pieces of segments: primitive (P,), from `start` to `stop` (P,) as shares of it; in order."""

    prim: Array
    start: Array
    stop: Array


@dataclass(frozen=True, eq=False)
class Sight:
    """What points see: for each interval's nodes, weight ds (N, I Q), primitive, place on it, and whether its front."""

    ds: Array
    prim: Array
    place: Array
    front: Array


@dataclass(frozen=True)
class Fineness:
    """Nodes on all pieces, further cuts of the sines seen from a point, and Gauss nodes per part of a pixel."""

    nodes: int
    cuts: int
    film: int


COARSE, FINE = Fineness(6000, 384, 24), Fineness(12000, 768, 48)


@dataclass(frozen=True, eq=False)
class Field:
    """Light leaving a scene's surfaces: B (2, P, nodes), from backs and fronts."""

    scene: Scene
    p: Pieces
    B: Array


def pieces(scene: Scene) -> Pieces:
    """Cut every segment at the feet of ends nearby."""
    a, b = scene.corners
    ends = np.concatenate([a, b], axis=1)
    found: list[tuple[int, float, float]] = []
    for k in range(scene.S):
        edge, to = (b - a)[:, k], ends - a[:, [k]]
        length = np.hypot(*edge)
        place, height = edge @ to / length**2, np.abs(scene.normals[:, k] @ to)
        cuts = place[(height < NEARBY * length) & (place > SLIVER) & (place < 1 - SLIVER)]
        at = np.unique(np.round(np.concatenate([[0.0, 1.0], cuts]), 9))
        found += [(k, start, stop) for start, stop in pairwise(at)]
    return Pieces(*(np.array(column) for column in zip(*found, strict=True)))


def places(p: Pieces, nodes: int) -> Array:
    """Shares of the segment at the nodes of every piece, (P, nodes)."""
    at = (1 - np.cos(np.pi * (np.arange(nodes) + 0.5) / nodes)) / 2
    return np.asarray(p.start[:, None] + (p.stop - p.start)[:, None] * at)


def leaving(f: Field, prim: Array, place: Array, front: Array) -> Array:
    """B at places on primitives, interpolated linearly in the angle of the nodes' cosine."""
    p, nodes = f.p, f.B.shape[-1]
    piece = np.searchsorted(p.prim + p.start, prim + np.clip(place, 0, 1 - SLIVER), side="right") - 1
    share = np.clip((place - p.start[piece]) / (p.stop - p.start)[piece], 0, 1)
    index = np.clip(np.arccos(1 - 2 * share) / np.pi * nodes - 0.5, 0, nodes - 1)
    low = np.minimum(index.astype(int), nodes - 2)
    side, part = front.astype(int), index - low
    return np.asarray(f.B[side, piece, low] * (1 - part) + f.B[side, piece, low + 1] * part)


def sight(scene: Scene, x: Array, n: Array, cuts: int) -> Sight:
    """What points x (2, N) on surfaces see on the side of n (2, N)."""
    tangent = np.stack([-n[1], n[0]])
    ends = np.concatenate([*scene.corners], axis=1)
    to = ends[:, None] - x[:, :, None]
    along, up = (np.einsum("dn,dne->ne", axis, to) for axis in (tangent, n))
    length = np.maximum(np.hypot(along, up), 1e-300)
    s = np.where(up > 0, along / length, np.sign(along))
    even = np.broadcast_to(np.linspace(-1, 1, cuts + 2), (len(s), cuts + 2))
    s = np.sort(np.concatenate([s, even], axis=1), axis=1)
    node, weight = np.polynomial.legendre.leggauss(GAUSS)
    middle, half = (s[:, 1:] + s[:, :-1]) / 2, np.diff(s) / 2
    prim = seen(scene, x, n, tangent, middle)
    at = (middle[..., None] + half[..., None] * node).reshape(len(s), -1)
    prim = prim.repeat(GAUSS, axis=1)
    place, front = met(scene, x, n, tangent, at, prim)
    return Sight((half[..., None] * weight).reshape(at.shape), prim, place, front)


def direction(n: Array, tangent: Array, s: Array) -> Array:
    """The direction with sine s (N, K) from the normal, (2, N, K)."""
    return np.asarray(tangent[:, :, None] * s + n[:, :, None] * np.sqrt(np.maximum(1 - s**2, 0)))


def seen(scene: Scene, x: Array, n: Array, tangent: Array, s: Array) -> Array:
    """The primitive met first in directions s (N, K)."""
    w = direction(n, tangent, s).reshape(2, -1)
    return scene.intersect(x.repeat(s.shape[1], axis=1), w)[1].reshape(s.shape)


def met(scene: Scene, x: Array, n: Array, tangent: Array, s: Array, prim: Array) -> tuple[Array, Array]:
    """Where the lines from x with sines s (N, K) meet the lines of primitives: share of it, and whether its front."""
    w = direction(n, tangent, s)
    a, b = (corner.take(prim, axis=-1) for corner in scene.corners)
    m = scene.normals.take(prim, axis=-1)
    towards = dot(m, w)
    t = dot(m, a - x[:, :, None]) / np.where(towards == 0, 1, towards)
    y = x[:, :, None] + t * w
    return np.asarray(dot(y - a, b - a) / dot(b - a, b - a)), np.asarray(towards < 0)


def gathered(f: Field, x: Array, prim: Array, n: Array, cuts: int) -> Array:
    """albedo/2 times the integral of B ds at points x (2, N) of primitives, on the side of n; (N,)."""
    scene, parts = f.scene, []
    for at in range(0, x.shape[-1], POINTS_AT_ONCE):
        part = slice(at, at + POINTS_AT_ONCE)
        view = sight(scene, x[:, part], n[:, part], cuts)
        parts.append((view.ds * leaving(f, view.prim, view.place, view.front)).sum(axis=1))
    albedo = scene.materials.colour[0].reshape(-1, scene.materials.L).sum(axis=1)
    return np.asarray(np.concatenate(parts) / 2 * albedo[scene.material[prim]])


def radiosity(scene: Scene, bounces: int, fine: Fineness) -> Field:
    """B after so many scattering events."""
    p = pieces(scene)
    nodes = max(8, fine.nodes // len(p.prim))
    a, b = (corner.take(p.prim, axis=-1)[:, :, None] for corner in scene.corners)
    x = (a + places(p, nodes) * (b - a)).reshape(2, -1)
    prim, shape = p.prim.repeat(nodes), (len(p.prim), nodes)
    E = np.stack([np.zeros(shape), scene.emission[0].take(prim).reshape(shape)])
    f, n = Field(scene, p, E), scene.normals.take(prim, axis=-1)
    for _ in range(bounces):
        reflected = [gathered(f, x, prim, side * n, fine.cuts).reshape(shape) for side in (-1, 1)]
        f = Field(scene, p, E + reflected)
    return f


def render(setting: Setting, sensor: Pinhole, fine: Fineness) -> Array:
    """The image of a pinhole after setting.depth scattering events, (n,)."""
    scene = setting.scene
    f = radiosity(scene, setting.depth - 1, fine)
    pixel, u, weight = film(scene, sensor, fine.film)
    x, w, _ = sensor.ray(pixel, u[None])
    t, prim = scene.intersect(x, w)
    normal = scene.normals.take(prim, axis=-1)
    front = dot(normal, w) < 0
    L = gathered(f, x + t * w, prim, np.where(front, normal, -normal), fine.cuts)
    return np.bincount(pixel, weight * (L + scene.emission[0].take(prim) * front), sensor.n)


def film(scene: Scene, sensor: Pinhole, count: int) -> tuple[Array, Array, Array]:
    """Gauss nodes on the parts of pixels between which ends of segments are seen: pixel, u, weight, (K,) each."""
    seen_at = sensor.project(np.concatenate([*scene.corners], axis=1))
    inside = seen_at[(seen_at > 0) & (seen_at < sensor.n)]
    cuts = np.unique(np.concatenate([np.arange(sensor.n + 1.0), inside]))
    node, weight = np.polynomial.legendre.leggauss(count)
    middle, half = (cuts[1:] + cuts[:-1]) / 2, np.diff(cuts) / 2
    at = (middle[:, None] + half[:, None] * node).reshape(-1)
    pixel = np.floor(middle).astype(int).repeat(count)
    return pixel, at - pixel, (half[:, None] * weight).reshape(-1)

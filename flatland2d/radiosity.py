"""Radiosity: a deterministic reference for Lambert scenes of segments, with exact visibility.

Segments are cut into panels of constant radiance B.  Seen from a point, the plane falls into angles between ends of
segments, in each of which one segment is seen; of a panel, B (sin a - sin b) / 2 arrives over those where it is.  All
that errs is B, constant on a panel and known at its middle only: panels end where light is not smooth, and shrink
towards these places.  Errors fall like 1 / panels^2; at 60 per segment they are about .01% of the image.
"""

from dataclasses import dataclass

import numpy as np

from flatland2d.sensors import Pinhole
from restir_ref.batch import Array, take
from restir_ref.transport.lobes import LOBES
from restir_ref.transport.scene import Scene
from restir_ref.transport.vectors import dot, norm

NEARBY = 0.1
"""What is closer to a segment than this share of its length makes its light change as fast as its own ends do."""

DIGITS = 9
"""Places on a segment that agree in so many digits are one."""

POINTS_AT_ONCE = 256


@dataclass(frozen=True, eq=False)
class Panels:
    """P panels, each one side of a piece of segment: ends, a on the right of who looks at it, normal n (2, P).

    prim, emission (P,)  primitive, and radiance of its own
    """

    a: Array
    b: Array
    n: Array
    prim: Array
    emission: Array


@dataclass(frozen=True, eq=False)
class View:
    """What N points see in I intervals of s, the sine of the angle to their normals, positive on the right.

    s (N, I + 1), prim (N, I)  ends of the intervals from -1 to 1, and the primitive seen, -1 for none
    V (N, I + 1, S)            V_k(s), the measure of the sines below s at which primitive k is seen
    """

    s: Array
    prim: Array
    V: Array


def cut(scene: Scene, per_segment: int) -> Panels:
    """`per_segment` panels on either side of every segment.

    Raises ValueError for circles, colours or lobes other than Lambert.
    """
    table = scene.materials
    others = (table.kind != list(LOBES).index("lambert")) & (table.colour.max(axis=0) > 0)
    if scene.radii.size or scene.C != 1 or others.any():
        raise ValueError("radiosity needs a monochrome scene of segments with Lambert lobes only.")
    at = np.stack([graded(each, per_segment) for each in edges(scene)])
    start, end = (corner[:, :, None] for corner in scene.corners)
    ends = start * (1 - at) + end * at
    a, b = ends[..., :-1].reshape(2, -1), ends[..., 1:].reshape(2, -1)
    prim = np.repeat(np.arange(scene.S), per_segment)
    n, E = scene.normals.take(prim, axis=-1), scene.emission[0].take(prim)
    return Panels(np.hstack([a, b]), np.hstack([b, a]), np.hstack([n, -n]), np.tile(prim, 2), np.append(E, 0 * E))


def graded(at: Array, count: int) -> Array:
    """count + 1 places from at[0] to at[-1], more of them next to each of `at` (Chebyshev).

    Every piece between two of `at` has one panel, if there are so many, and of the rest a share like its length's root.
    """
    pieces, roots = np.arange(len(at)), np.append(0, np.cumsum(np.sqrt(np.diff(at))))
    upto = pieces + max(count - pieces[-1], 0) * (roots / roots[-1])
    piece = np.interp(np.arange(count + 1), np.ceil(upto * count / upto[-1]), pieces)
    part = piece % 1
    return np.interp(piece - part + (1 - np.cos(np.pi * part)) / 2, pieces, at)


def edges(scene: Scene) -> list[Array]:
    """Places of every segment between which its light is smooth, in order, 0 and 1 among them."""
    found = [np.concatenate(parts) for parts in zip(feet(scene), shadows(scene), strict=True)]
    prim, place = found[0], np.clip(np.round(found[1], DIGITS), 0, 1)
    return [np.unique(np.append(place[prim == k], [0, 1])) for k in range(scene.S)]


def feet(scene: Scene) -> tuple[Array, Array]:
    """Feet of ends of segments on others nearby: primitive and place on it, (K,) each."""
    ends, prim = np.hstack([*scene.corners]), np.arange(scene.S)[:, None]
    place, height = _on_line(scene, prim, ends[:, None])
    k, i = np.nonzero((np.abs(height) < NEARBY) & (place > 0) & (place < 1))
    return k, place[k, i]


def shadows(scene: Scene) -> tuple[Array, Array]:
    """Where shadows end that segments throw in the light of ends of lights: primitive and place on it, (K,) each."""
    lights, ends = np.hstack([*scene.lights.corners]), np.hstack([*scene.corners])
    x, y = np.repeat(lights, ends.shape[1], axis=1), np.tile(ends, lights.shape[1])
    lit = np.flatnonzero((norm(y - x) > 0) & scene.visible(x, y))
    y, w = y[:, lit], (y - x)[:, lit]
    t, prim = scene.intersect(y, w)
    met = np.flatnonzero(np.isfinite(t))
    return prim[met], _on_line(scene, prim[met], y[:, met] + t[met] * w[:, met])[0]


def _on_line(scene: Scene, prim: Array, y: Array) -> tuple[Array, Array]:
    """Place of y's foot on the line of a segment, and y's height above it, both as shares of its length."""
    a, b = (corner.take(prim, axis=-1) for corner in scene.corners)
    length = norm(b - a)
    return dot(y - a, b - a) / length**2, dot(y - a, scene.normals.take(prim, axis=-1)) / length


def view(scene: Scene, x: Array, n: Array) -> View:
    """What points x (2, N) see on the side of n (2, N): one ray in each interval between ends of segments.

    Hazard: segments may touch, but not cross.
    """
    ends = _seen_from(scene, x, n, np.hstack([*scene.corners]))
    one = np.ones((x.shape[-1], 1))
    s = np.sort(np.hstack([-one, _sine(ends, np.sign(ends[0])), one]), axis=1)
    middle, ds = (s[:, 1:] + s[:, :-1]) / 2, np.diff(s)
    w = scene.space.to_world(n[:, :, None], np.stack([middle, np.sqrt(np.maximum(1 - middle**2, 0))]))
    t, prim = scene.intersect(np.repeat(x, ds.shape[1], axis=1), w.reshape(2, -1))
    prim = np.where(np.isfinite(t), prim, -1).reshape(ds.shape)
    V = np.zeros((*s.shape, scene.S))
    np.cumsum(ds[..., None] * (prim[..., None] == np.arange(scene.S)), axis=1, out=V[:, 1:])
    return View(s, prim, V)


def shares(scene: Scene, p: Panels, x: Array, n: Array) -> Array:
    """(V(s_a) - V(s_b)) / 2: what arrives at x on the side of n from each panel, as a share of its B; (N, P)."""
    v = view(scene, x, n)
    a, b = _seen_from(scene, x, n, p.a), _seen_from(scene, x, n, p.b)
    i, j = np.nonzero((a[0] * b[1] > b[0] * a[1]) & (np.maximum(a[1], b[1]) > 0))
    found = np.zeros(a.shape[1:])
    found[i, j] = seen_below(v, i, p.prim[j], _sine(a[:, i, j], 1)) - seen_below(v, i, p.prim[j], _sine(b[:, i, j], -1))
    return found / 2


def seen_below(v: View, i: Array, prim: Array, s: Array) -> Array:
    """V_k(s) of points i and primitives k, linear in each interval; (Q,)."""
    N, I = v.prim.shape
    rows = v.s[:, :-1] + 4 * np.arange(N)[:, None]  # one after the other, they ascend all along
    at = np.searchsorted(rows.reshape(-1), s + 4 * i, side="right") - 1 - i * I
    return np.asarray(v.V[i, at, prim] + (s - v.s[i, at]) * (v.prim[i, at] == prim))


def _seen_from(scene: Scene, x: Array, n: Array, q: Array) -> Array:
    """To the right and up, from points x (2, N) with normals n to points q (2, P); (2, N, P)."""
    return scene.space.to_local(n[:, :, None], q[:, None] - x[:, :, None])


def _sine(q: Array, below: Array | int) -> Array:
    """Sine of the angle of q = (right, up) to the normal; `below` where q is below the horizon."""
    return np.where(q[1] > 0, q[0] / np.maximum(norm(q), 1e-300), below)


def radiance(scene: Scene, p: Panels, bounces: int) -> Array:
    """B after so many scattering events: B <- E + albedo F B, starting from E; (P,)."""
    B = p.emission
    for _ in range(bounces):
        B = np.asarray(p.emission + gather(scene, p, B, (p.a + p.b) / 2, p.prim, p.n))
    return B


def gather(scene: Scene, p: Panels, B: Array, x: Array, prim: Array, n: Array) -> Array:
    """albedo sum_j B_j (sin a - sin b) / 2 at points x (2, N) of primitives, on the side of n (2, N); (N,)."""
    lit, blocks = np.flatnonzero(B), np.split(np.arange(len(prim)), range(POINTS_AT_ONCE, len(prim), POINTS_AT_ONCE))
    p = take(p, lit)
    arriving = [shares(scene, p, x.take(k, axis=-1), n.take(k, axis=-1)) @ B[lit] for k in blocks]
    albedo = scene.materials.colour[0].reshape(-1, scene.materials.L).sum(axis=1)
    return np.asarray(np.concatenate(arriving) * albedo[scene.material[prim]])


def render(scene: Scene, sensor: Pinhole, bounces: int, per_segment: int = 60, film: int = 16) -> Array:
    """The image of a pinhole after `bounces` scattering events, `film` points in each part of a pixel; (n,)."""
    p = cut(scene, per_segment)
    B = radiance(scene, p, bounces - 1)
    pixel, u, weight = film_points(scene, sensor, film)
    x, w, _ = sensor.ray(pixel, u[None])
    t, prim = scene.intersect(x, w)
    normal = scene.normals.take(prim, axis=-1)
    front = dot(normal, w) < 0
    L = gather(scene, p, B, x + t * w, prim, np.where(front, normal, -normal)) + scene.emission[0, prim] * front
    return np.bincount(pixel, weight * L, sensor.n)


def film_points(scene: Scene, sensor: Pinhole, count: int) -> tuple[Array, Array, Array]:
    """Gauss points on the parts of pixels between which ends of segments are seen: pixel, u, weight, (K,) each."""
    seen_at = sensor.project(np.hstack([*scene.corners]))
    cuts = np.unique(np.append(seen_at[(seen_at > 0) & (seen_at < sensor.n)], np.arange(sensor.n + 1)))
    node, weight = np.polynomial.legendre.leggauss(count)
    middle, half = (cuts[1:] + cuts[:-1]) / 2, np.diff(cuts) / 2
    pixel = np.floor(middle).astype(int).repeat(count)
    return pixel, (middle[:, None] + half[:, None] * node).reshape(-1) - pixel, np.outer(half, weight).reshape(-1)

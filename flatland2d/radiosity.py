"""Radiosity: a deterministic reference for Lambert scenes of segments, from form factors in closed form.

Segments are cut into panels of constant radiance B.  In the plane the form factor of two panels
that see each other wholly is exact (crossed strings), and so is the light a point gets from a panel,
(sin b - sin a) / 2; visibility is tested between quarter points, and panels shrink towards the ends
of segments, where light changes fastest.
"""

from dataclasses import dataclass

import numpy as np

from restir_ref.batch import Array
from restir_ref.transport.lobes import LOBES
from restir_ref.transport.scene import Scene
from restir_ref.transport.vectors import norm

PAIRS_AT_ONCE = 200_000


@dataclass(frozen=True, eq=False)
class Panels:
    """P panels, each one side of a piece of segment: ends a, b, middle, normal (2, P); prim, albedo, emission (P,)."""

    a: Array
    b: Array
    middle: Array
    n: Array
    prim: Array
    albedo: Array
    emission: Array


def cut(scene: Scene, per_segment: int) -> Panels:
    """`per_segment` panels on every segment, graded towards its ends (Chebyshev).

    Raises ValueError for circles, colours or lobes other than Lambert.
    """
    table = scene.materials
    others = (table.kind != list(LOBES).index("lambert")) & (table.colour.max(axis=0) > 0)
    if scene.radii.size or scene.C != 1 or others.any():
        raise ValueError("radiosity needs a monochrome scene of segments with Lambert lobes only.")
    at = (1 - np.cos(np.pi * np.arange(per_segment + 1) / per_segment)) / 2
    start, end = corners(scene)
    ends = start[:, :, None] * (1 - at) + end[:, :, None] * at
    a, b = (np.tile(part.reshape(2, -1), 2) for part in (ends[..., :-1], ends[..., 1:]))
    prim = np.tile(np.repeat(np.arange(scene.S), per_segment), 2)
    side = np.repeat([1.0, -1.0], len(prim) // 2)
    n = scene.normals.take(prim, axis=-1) * side
    return Panels(a, b, (a + b) / 2, n, prim, _albedo(scene, prim), scene.emission[0, prim] * (side > 0))


def corners(scene: Scene) -> tuple[Array, Array]:
    """Both ends of every segment, (2, S) each, from its affine map."""
    frames = np.linalg.inv(scene.maps.reshape(2, scene.S, 2).swapaxes(0, 1))  # columns: edge, normal
    start = -np.einsum("sij,js->is", frames, scene.offsets.reshape(2, scene.S))
    return start, start + frames[:, :, 0].T


def crossed_strings(a: Array, b: Array, c: Array, d: Array) -> Array:
    """F_ab->cd |ab| = (|ad| + |bc| - |ac| - |bd|) / 2 where the panels see each other wholly; (..., P)."""

    def length(p: Array, q: Array) -> Array:
        return np.asarray(np.sqrt(((p - q) ** 2).sum(axis=0)))

    return np.asarray(np.abs(length(a, c) + length(b, d) - length(a, d) - length(b, c)) / 2)


def form_factors(scene: Scene, p: Panels) -> Array:
    """F_ij: share of what leaves panel i that arrives at panel j, one row per panel, (P, P)."""
    F = crossed_strings(p.a[:, :, None], p.b[:, :, None], p.a[:, None], p.b[:, None]) / norm(p.b - p.a)[:, None]
    F *= in_front(p.middle, p.n, p.middle) & in_front(p.middle, p.n, p.middle).T
    F *= p.prim[:, None] != p.prim[None]
    i, j = np.nonzero(F)
    for start in range(0, len(i), PAIRS_AT_ONCE):
        part = slice(start, start + PAIRS_AT_ONCE)
        F[i[part], j[part]] *= seen_share(scene, p, i[part], j[part])
    return F


def seen_share(scene: Scene, p: Panels, i: Array, j: Array) -> Array:
    """How much of panel j panel i sees: the mean over four pairs of their quarter points, (Q,)."""
    quarters = [(s, t) for s in (0.25, 0.75) for t in (0.25, 0.75)]
    pairs = [(p.a[:, i] * (1 - s) + p.b[:, i] * s, p.a[:, j] * (1 - t) + p.b[:, j] * t) for s, t in quarters]
    return np.asarray(np.mean([scene.visible(x, y) for x, y in pairs], axis=0))


def in_front(x: Array, n: Array, y: Array) -> Array:
    """Whether y_j is on the side of n_i as seen from x_i, (P, Q)."""
    return np.asarray(np.einsum("di,dij->ij", n, y[:, None] - x[:, :, None]) > 0)


def radiance(scene: Scene, p: Panels, bounces: int) -> Array:
    """B after so many scattering events: B <- E + albedo F B, starting from E; (P,)."""
    F, B = form_factors(scene, p), p.emission
    for _ in range(bounces):
        B = np.asarray(p.emission + p.albedo * (F @ B))
    return B


def gather(scene: Scene, p: Panels, B: Array, x: Array, prim: Array, n: Array) -> Array:
    """albedo sum_j B_j (sin b - sin a) / 2 at points x (2, N) of primitives, on the side of n (2, N); (N,)."""
    facing = in_front(x, n, p.middle) & in_front(p.middle, p.n, x).T & (prim[:, None] != p.prim[None])
    out = np.zeros(x.shape[-1])
    for k in range(x.shape[-1]):
        j = np.flatnonzero(facing[k])
        seen = scene.visible(np.repeat(x[:, k : k + 1], len(j), axis=1), p.middle[:, j])
        share = np.abs(_sine(p.b[:, j], x[:, k], n[:, k]) - _sine(p.a[:, j], x[:, k], n[:, k])) / 2
        out[k] = (share * B[j] * seen).sum()
    return out * _albedo(scene, prim)


def _albedo(scene: Scene, prim: Array) -> Array:
    by_material = scene.materials.colour[0].reshape(-1, scene.materials.L).sum(axis=1)
    return np.asarray(by_material[scene.material[prim]])


def _sine(q: Array, x: Array, n: Array) -> Array:
    """Sine of the angle of q seen from x, measured from the normal."""
    to = q - x[:, None]
    return np.asarray((n[1] * to[0] - n[0] * to[1]) / np.maximum(norm(to), 1e-300))


def render(scene: Scene, sensor: object, bounces: int, per_segment: int = 60, film: int = 16) -> Array:
    """The image of a pinhole after `bounces` scattering events, `film` points per pixel; (n,)."""
    p = cut(scene, per_segment)
    B = radiance(scene, p, bounces - 1)
    n = sensor.n  # type: ignore[attr-defined]
    u = np.tile((np.arange(film) + 0.5) / film, n)[None]
    x, w, _ = sensor.ray(np.repeat(np.arange(n), film), u)  # type: ignore[attr-defined]
    t, prim = scene.intersect(x, w)
    normal = scene.normals.take(prim, axis=-1)
    facing = np.where((normal * w).sum(axis=0) < 0, normal, -normal)
    front = (normal * w).sum(axis=0) < 0
    L = gather(scene, p, B, x + t * w, prim, facing) + scene.emission[0, prim] * front
    return np.asarray(L.reshape(n, film).mean(axis=1))

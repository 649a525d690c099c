"""Surfaces in d dimensions: simplices and spheres, rays against them, and lights.

A simplex with corners v_0 .. v_(d-1) has an affine map to the unit simplex and a height along its
normal, a (d, d+1) matrix; a ray crosses it at t = -h / h' if the coordinates there are >= 0 and sum
to at most 1.  Segments and triangles are the same code, and the maps are matrix products.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from restir_ref.batch import Array
from restir_ref.transport.materials import Material, Table, Vertex, table
from restir_ref.transport.space import Space
from restir_ref.transport.vectors import dot, normalize

CLEARANCE = 1e-9
"""Hits nearer than this share of the scene's extent are the surface that the ray starts on."""


@dataclass(frozen=True)
class Facet:
    """A simplex with d corners, row by row; its front, where det(edges, normal) > 0, may emit."""

    corners: Sequence[Sequence[float]]
    material: int = 0
    emission: Sequence[float] = ()


@dataclass(frozen=True)
class Ball:
    """A sphere (circle in flatland); its front is outside."""

    centre: Sequence[float]
    radius: float
    material: int = 0


@dataclass(frozen=True, eq=False)
class Lights:
    """Emitting simplices (E,), the running sum of their probabilities (E,), density per area by primitive."""

    prims: Array
    upto: Array
    pdf_area: Array


@dataclass(frozen=True, eq=False)
class Scene:
    """Everything a path can meet, as arrays; primitives are the S facets, then the balls."""

    space: Space
    materials: Table
    corners: Array  # (S, d, d)
    maps: Array  # (d * S, d), coordinates first, heights last
    offsets: Array  # (d * S, 1)
    normals: Array  # (d, S)
    centres: Array  # (d, B)
    radii: Array  # (B, 1)
    material: Array  # (S + B,)
    emission: Array  # (C, S + B)
    lights: Lights
    extent: float

    @property
    def C(self) -> int:
        """Number of channels."""
        return len(self.emission)


@dataclass(frozen=True)
class LightPoint:
    """A point y on a light with its normal (d, N), emitted radiance (C, N), and density per area (N,)."""

    y: Array
    n: Array
    emission: Array
    pdf_area: Array


def scene(space: Space, materials: Sequence[Material], facets: Sequence[Facet], balls: Sequence[Ball] = ()) -> Scene:
    """Compile a scene.

    Raises ValueError for a scene without light, degenerate facets, balls without radius, unknown
    materials, or emission that is negative or of unequal channels.
    """
    emitting = [facet for facet in facets if any(facet.emission)]
    if not emitting:
        raise ValueError("the scene has no light: give at least one facet a positive emission.")
    C, d = len(emitting[0].emission), space.d
    corners = np.array([facet.corners for facet in facets], dtype=float)
    if corners.shape[1:] != (d, d):
        raise ValueError(
            f"facets need {d} corners of {d} coordinates, but their corners have shape {corners.shape[1:]}."
        )
    normals, sizes = _normals_and_sizes(corners)
    emission = np.array([facet.emission or (0.0,) * C for facet in facets] + [(0.0,) * C] * len(balls), dtype=float).T
    _check_scene(materials, facets, balls, emission)
    inverse = np.linalg.inv(np.concatenate([corners[:, 1:] - corners[:, :1], normals[:, None]], axis=1).swapaxes(1, 2))
    maps = inverse.swapaxes(0, 1)  # (d, S, d)
    offsets = -np.einsum("ksd,sd->ks", maps, corners[:, 0])
    spread = corners.reshape(-1, d)
    return Scene(
        space,
        table(materials, C),
        corners,
        np.ascontiguousarray(maps.reshape(-1, d)),
        offsets.reshape(-1, 1),
        np.ascontiguousarray(normals.T),
        np.array([ball.centre for ball in balls], dtype=float).reshape(-1, d).T,
        np.array([ball.radius for ball in balls], dtype=float).reshape(-1, 1),
        np.array([each.material for each in [*facets, *balls]]),
        emission,
        _lights(emission, sizes, len(balls)),
        float(np.ptp(spread, axis=0).max()),
    )


def _normals_and_sizes(corners: Array) -> tuple[Array, Array]:
    """Unit normals (S, d) with det(edges, normal) > 0, and d-1 dimensional sizes (S,)."""
    edges = corners[:, 1:] - corners[:, :1]
    d = corners.shape[-1]
    minors = [np.linalg.det(np.delete(edges, k, axis=2)) * (-1) ** (d - 1 + k) for k in range(d)]
    normals = np.stack(minors, axis=-1)
    length = np.linalg.norm(normals, axis=-1)
    if not np.all(length > 1e-14):
        raise ValueError(
            f"facet {int(np.argmin(length))} is degenerate: its corners are {corners[np.argmin(length)].tolist()}."
        )
    return normals / length[:, None], length / np.prod(np.arange(1, d))


def _check_scene(
    materials: Sequence[Material], facets: Sequence[Facet], balls: Sequence[Ball], emission: Array
) -> None:
    if not (np.isfinite(emission).all() and (emission >= 0).all()):
        raise ValueError(f"emission must be finite and non-negative, but one is {emission.min()}.")
    for each in (*facets, *balls):
        if not 0 <= each.material < len(materials):
            raise ValueError(f"{each} has material {each.material}, but there are only {len(materials)}.")
    for ball in balls:
        if not ball.radius > 0:
            raise ValueError(f"{ball} needs a positive radius.")


def _lights(emission: Array, sizes: Array, balls: int) -> Lights:
    """Lights are picked by power."""
    power = emission.mean(axis=0)
    power[: len(sizes)] *= sizes
    prims = np.flatnonzero(power)
    share = power / power.sum()
    return Lights(prims, np.cumsum(share[prims]), share / np.append(sizes, np.ones(balls)))


def intersect(s: Scene, x: Array, w: Array) -> tuple[Array, Array]:
    """Distance t (N,) to the nearest surface along x + t w, and its primitive (N,); inf and 0 if there is none."""
    d, S = s.space.d, s.corners.shape[0]
    start, step = (s.maps @ x + s.offsets).reshape(d, S, -1), (s.maps @ w).reshape(d, S, -1)
    with np.errstate(divide="ignore", invalid="ignore"):
        t = -start[-1] / step[-1]
        at = start[:-1] + t * step[:-1]
        hit = (t > CLEARANCE * s.extent) & (at >= 0).all(axis=0) & (at.sum(axis=0) <= 1)
    t = np.where(hit, t, np.inf)
    if s.radii.size:
        t = np.concatenate([t, _ball_distances(s, x, w)])
    prim = t.argmin(axis=0)
    return t[prim, np.arange(x.shape[-1])], prim


def _ball_distances(s: Scene, x: Array, w: Array) -> Array:
    """Distance to each ball (B, N); inf if it is missed."""
    to = s.centres[:, :, None] - x[:, None]
    along = np.einsum("dbn,dn->bn", to, w)
    off = np.einsum("dbn,dbn->bn", to, to) - along**2
    half = np.sqrt(np.maximum(s.radii**2 - off, 0))
    near, far, clear = along - half, along + half, 1e3 * CLEARANCE * s.extent
    t = np.where(near > clear, near, np.where(far > clear, far, np.inf))
    return np.where(off < s.radii**2, t, np.inf)


def visible(s: Scene, x: Array, y: Array) -> Array:
    """Whether nothing stands between x and y, (N,)."""
    to = y - x
    r = np.sqrt(dot(to, to))
    t, _ = intersect(s, x, to / np.maximum(r, 1e-300))
    return t >= r - 1e3 * CLEARANCE * s.extent


def arrive(s: Scene, x: Array, w: Array) -> tuple[Vertex, Array, Array]:
    """The vertex that the ray from x along w meets, the distance t (N,), and whether it meets any (N,)."""
    t, prim = intersect(s, x, w)
    met = np.isfinite(t)
    t = np.where(met, t, s.extent)
    return vertex(s, x + t * w, prim, -w), t, met


def vertex(s: Scene, x: Array, prim: Array, o: Array) -> Vertex:
    """The vertex at x on a primitive, seen from direction o (d, N), world."""
    n = normal(s, x, prim)
    front = dot(n, o) > 0
    n = np.where(front, n, -n)
    return Vertex(x, n, s.space.to_local(n, o), s.material.take(prim), prim, front)


def normal(s: Scene, x: Array, prim: Array) -> Array:
    """Outward geometric normal (d, N) at x on a primitive."""
    S = s.normals.shape[-1]
    if not s.radii.size:
        return s.normals.take(prim, axis=-1)
    ball = np.maximum(prim - S, 0)
    outward = normalize(x - s.centres.take(ball, axis=-1) + np.where(prim < S, 1.0, 0.0))
    return np.where(prim < S, s.normals.take(np.minimum(prim, S - 1), axis=-1), outward)


def sample_light(s: Scene, pick: Array, u: Array) -> LightPoint:
    """A point on a light from pick (N,) and u (d-1, N); independent of any receiving vertex."""
    which = np.minimum(np.searchsorted(s.lights.upto, pick, side="right"), len(s.lights.prims) - 1)
    prim = s.lights.prims[which]
    b = s.space.simplex(u)
    corners = s.corners[prim]  # (N, d, d)
    weights = np.concatenate([1 - b.sum(axis=0, keepdims=True), b])
    y = np.einsum("kn,nkd->dn", weights, corners)
    return LightPoint(y, s.normals.take(prim, axis=-1), s.emission.take(prim, axis=-1), s.lights.pdf_area[prim])


def emitted(s: Scene, v: Vertex) -> Array:
    """L_e of a vertex towards o: from front sides only; (C, N)."""
    return s.emission.take(v.prim, axis=-1) * v.front


def light_pdf(s: Scene, v: Vertex, r: Array) -> Array:
    """Density, in directions at distance r, of sampling the light vertex v: p_A r^(d-1) / cos; 0 off lights."""
    p_A = s.lights.pdf_area[v.prim] * v.front
    return np.where(p_A > 0, p_A * r ** (s.space.d - 1) / np.maximum(v.o[-1], 1e-300), 0)

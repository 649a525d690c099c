"""From points and directions to vertices: what a ray meets, and points on lights."""

from dataclasses import dataclass

import numpy as np

from restir_ref.batch import Array, total
from restir_ref.transport.materials import Vertex
from restir_ref.transport.scene import Scene
from restir_ref.transport.vectors import dot, normalize, power

GRAZING = 1e-12
"""Least cosine of a direction that has met a surface."""


@dataclass(frozen=True)
class LightPoint:
    """A point y on a light with its normal (d, N), emitted radiance (C, N), and density per area (N,)."""

    y: Array
    n: Array
    emission: Array
    pdf_area: Array


def arrive(s: Scene, x: Array, w: Array) -> tuple[Vertex, Array, Array]:
    """The vertex that the ray from x along w meets, the distance t (N,), and whether it meets any (N,)."""
    t, prim = s.intersect(x, w)
    met = np.isfinite(t)
    t = np.where(met, t, s.extent)
    return vertex(s, x + t * w, prim, -w), t, met


def vertex(s: Scene, x: Array, prim: Array, o: Array) -> Vertex:
    """The vertex at x on a primitive, seen from direction o (d, N), world."""
    n = normal(s, x, prim)
    front = dot(n, o) > 0
    n = np.where(front, n, -n)
    local = s.space.to_local(n, o)
    local[-1] = np.maximum(local[-1], GRAZING)
    return Vertex(x, n, local, s.material.take(prim), prim, front)


def normal(s: Scene, x: Array, prim: Array) -> Array:
    """Outward geometric normal (d, N) at x on a primitive."""
    n = s.normals.take(prim, axis=-1, mode="clip")
    if s.radii.size:
        on_ball = np.flatnonzero(prim >= s.S)
        n[:, on_ball] = normalize(x.take(on_ball, axis=-1) - s.centres.take(prim[on_ball] - s.S, axis=-1))
    return n


def sample_light(s: Scene, pick: Array, u: Array) -> LightPoint:
    """A point on a light from pick (N,) and u (d-1, N); independent of any receiving vertex."""
    light, b = s.lights, s.space.simplex(u)
    which = np.searchsorted(light.upto[:-1], pick, side="right")
    y = light.corners[0].take(which, axis=-1) * (1 - total([*b]))
    for b_k, corner in zip(b, light.corners[1:], strict=True):
        y = y + b_k * corner.take(which, axis=-1)
    return LightPoint(
        y, light.normals.take(which, axis=-1), light.emission.take(which, axis=-1), light.pdf_area.take(which)
    )


def emitted(s: Scene, v: Vertex) -> Array:
    """L_e of a vertex towards o: from front sides only; (C, N)."""
    return s.emission.take(v.prim, axis=-1) * v.front


def light_pdf(s: Scene, v: Vertex, r: Array) -> Array:
    """Density, in directions at distance r, of sampling the light vertex v: p_A r^(d-1) / cos; 0 off lights."""
    return np.asarray(s.pdf_area.take(v.prim) * v.front * power(r, s.space.d - 1) / v.o[-1])

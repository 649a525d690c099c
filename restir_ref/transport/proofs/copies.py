"""Two more local decisions for offset paths: copy the half vector, or copy the direction.  [GRIS 7.2]

Worked examples of a new shift.  Up to the reconnection any local decision is random replay with *other*
numbers u^y, those with which the tracer would have drawn the decision by itself.  So a decision says what it
keeps of a base vertex, z, and how to scatter by z elsewhere; the numbers, their Jacobian and the sample's
validity follow from the lobes' own sampling and inversion, and everything behind (earlier connections, the
reconnection, lights, MIS weights) is `shift_path`.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from restir_ref.batch import Array, pick, ratio, take
from restir_ref.integrals import Pixels, Shifted
from restir_ref.transport import materials as mat
from restir_ref.transport.lobes import refract
from restir_ref.transport.materials import LobeSurface, Vertex
from restir_ref.transport.paths import Path, Scatter, Tracer, first_hit, scatter
from restir_ref.transport.rays import arrive
from restir_ref.transport.restir_pt import PathIntegrals
from restir_ref.transport.shifts import shift_path
from restir_ref.transport.space import Space
from restir_ref.transport.vectors import dot, norm, normalize, power, reflect


@dataclass(frozen=True)
class Copy:
    """What an offset vertex copies from its base vertex: a quantity z (d, N) in place of the direction i.

    read(space, s, v, i)     z of the local direction i (d, N) at vertex v, for the surface s of its lobe
    follow(space, s, v, z)   i, 0 where there is none: the inverse of `read`
    stretch(space, s, v, i)  |dz / d omega_i|, (N,)

    Lobe and light numbers are copied besides.  A delta lobe has one direction, whose half vector is the
    normal: nothing is left to copy.
    """

    read: Callable[[Space, LobeSurface, Vertex, Array], Array]
    follow: Callable[[Space, LobeSurface, Vertex, Array], Array]
    stretch: Callable[[Space, LobeSurface, Vertex, Array], Array]


def half_vector(space: Space, s: LobeSurface, v: Vertex, i: Array) -> Array:
    """m = h / |h|, h = o + eta i turned to the side of o; -m if i is on the other side.  [Walter 2007]

    Reflection has eta = 1.  The sign makes what is copied say whether light is reflected or refracted.
    """
    h = _unnormalised(s, v, i)
    return np.asarray(np.sign(i[-1]) * np.sign(h[-1]) * normalize(h))


def mirrored_or_refracted(space: Space, s: LobeSurface, v: Vertex, z: Array) -> Array:
    """o mirrored at m, or refracted at it; 0 in total internal reflection, and where i or o is on the wrong side."""
    reflects, m = z[-1] > 0, np.sign(z[-1]) * z
    i = np.where(reflects, reflect(v.o, m), refract(v.o, m, s.eta))
    return np.asarray(i * ((dot(v.o, m) > 0) & np.where(reflects, i[-1] > 0, i[-1] < 0)))


def half_vector_stretch(space: Space, s: LobeSurface, v: Vertex, i: Array) -> Array:
    """d omega_m / d omega_i = eta^(d-1) |i.h| / |h|^d; 1 / (2^(d-1) |o.m|^(d-2)) for reflection.

    In flatland that is 1/2, d omega = 2 dm: the factor cancels, and copying preserves angles.
    """
    h = _unnormalised(s, v, i)
    eta = np.where(i[-1] > 0, 1.0, s.eta)
    return np.asarray(power(eta, space.d - 1) * np.abs(dot(i, h)) / power(norm(h), space.d))


def _unnormalised(s: LobeSurface, v: Vertex, i: Array) -> Array:
    """h = o + eta i."""
    return np.asarray(v.o + np.where(i[-1] > 0, 1.0, s.eta) * i)


def world_direction(space: Space, s: LobeSurface, v: Vertex, i: Array) -> Array:
    """w in global coordinates."""
    return space.to_world(v.n, i)


def same_direction(space: Space, s: LobeSurface, v: Vertex, z: Array) -> Array:
    """i = z in the offset vertex's own frame."""
    return space.to_local(v.n, z)


def unit_stretch(space: Space, s: LobeSurface, v: Vertex, i: Array) -> Array:
    """|dw / d omega_i| = 1."""
    return np.ones(i.shape[-1])


COPIES: Mapping[str, Copy] = MappingProxyType(
    {
        "half vector": Copy(half_vector, mirrored_or_refracted, half_vector_stretch),
        "direction": Copy(world_direction, same_direction, unit_stretch),
    }
)


@dataclass(frozen=True, eq=False)
class Copying(PathIntegrals):
    """Path integrals whose shift copies z up to the reconnection, where `PathIntegrals` replays numbers."""

    copy: Copy

    def shift(self, x: Path, index: Array, to: Pixels) -> Shifted:
        """T = shift_path with the copied numbers, J = |du^y / du^x| of both steps."""
        there: PathIntegrals = to.of  # type: ignore[assignment]
        j = to.index % there.n
        u, J_copy = copied_numbers(self.copy, self.tracer, x, index % self.n, there.tracer, j)
        y, J_rest = shift_path(there.tracer, replace(x, u=u), j)
        J = J_copy * J_rest
        return Shifted(replace(y, F=np.where(J > 0, y.F, 0.0), A=np.where(J > 0, y.A, 1.0)), J)


@dataclass(frozen=True)
class Pair:
    """Base and offset path side by side: vertices x_k and y_k, what happened at x_k, and the base path's numbers."""

    x: Vertex
    y: Vertex
    at: Scatter
    u: Array


def copied_numbers(copy: Copy, tx: Tracer, x: Path, i: Array, ty: Tracer, j: Array) -> tuple[Array, Array]:
    """u^y (D, N) of the path in pixels j that copies the free prefix of x from pixels i, and |du^y / du^x| (N,).

    The Jacobian is 0 where a copy is undefined.  Free are the BSDF samples at x_1 .. x_(c-2), or all of them
    where nothing reconnects; light samples keep their numbers.
    """
    last = np.where(x.c > 0, x.c - 2, x.k - x.nee)
    u, J, columns = np.array(x.u), np.ones(len(last)), np.arange(len(last))
    v_x, v_y = first_hit(tx, x.u, i)[0], first_hit(ty, x.u, j)[0]
    for k in range(1, int(last.max(initial=0)) + 1):
        columns, v_x, v_y = take((columns, v_x, v_y), np.flatnonzero(last[columns] >= k))
        if not len(columns):
            break
        u_x = x.u.take(columns, axis=-1)
        pair = Pair(v_x, v_y, scatter(tx, v_x, u_x, k), u_x)
        local, stretch = _copied(copy, tx, ty, pair, k)
        J[columns] *= stretch
        columns, pair, local = take((columns, pair, local), np.flatnonzero(stretch))
        ty.lobe_number(u, k)[columns], ty.direction_numbers(u, k)[:, columns] = _drawn(ty, pair, local, k)
        w_y = scatter(ty, pair.y, u.take(columns, axis=-1), k).w
        v_x, v_y = arrive(tx.scene, pair.x.x, pair.at.w)[0], arrive(ty.scene, pair.y.x, w_y)[0]
    return u, J


def _copied(copy: Copy, tx: Tracer, ty: Tracer, at: Pair, k: int) -> tuple[Array, Array]:
    """The local direction leaving y_k (d, N), and |du^y / du^x| = p_y(z) / p_x(z), lobe probabilities included."""
    space, lobe = ty.scene.space, at.at.lobe
    local_x = space.to_local(at.x.n, at.at.w)
    z = copy.read(space, _surface(tx, at.x, lobe), at.x, local_x)
    only = mat.sample_lobe(ty.scene.materials, space, at.y, lobe, ty.direction_numbers(at.u, k))
    delta_x, delta_y = _is_delta(tx, at.x, lobe), _is_delta(ty, at.y, lobe)
    local_y = np.where(delta_y, only, copy.follow(space, _surface(ty, at.y, lobe), at.y, z))
    lost = local_y[-1] == 0
    local_y = np.where(lost, at.y.o, local_y)
    p_x, p_y = _density(copy, tx, at.x, lobe, local_x), _density(copy, ty, at.y, lobe, local_y)
    return local_y, ratio(p_y, p_x) * ((delta_x == delta_y) & ~lost)


def _density(copy: Copy, t: Tracer, v: Vertex, lobe: Array, i: Array) -> Array:
    """Density with which primary samples produce the lobe and z: P p / |dz / d omega|, P for a delta lobe; (N,)."""
    table, space = t.scene.materials, t.scene.space
    P = mat.lobe_shares(table, v)
    _, p, _ = mat.scatter_lobe(table, space, v, P, lobe, i)
    return np.where(_is_delta(t, v, lobe), pick([*P], lobe), ratio(p, copy.stretch(space, _surface(t, v, lobe), v, i)))


def _drawn(t: Tracer, at: Pair, i: Array, k: int) -> tuple[Array, Array]:
    """The numbers that draw the base path's lobe and local direction i at y_k; delta lobes read none for directions."""
    table, lobe = t.scene.materials, at.at.lobe
    chooses = mat.choose_number(at.at.P, mat.lobe_shares(table, at.y), lobe, t.lobe_number(at.u, k))
    draws = mat.invert_lobe(table, t.scene.space, at.y, lobe, i)
    return chooses, np.where(_is_delta(t, at.y, lobe), t.direction_numbers(at.u, k), draws)


def _is_delta(t: Tracer, v: Vertex, lobe: Array) -> Array:
    return np.equal(mat.lobe_roughness(t.scene.materials, v, lobe), 0)


def _surface(t: Tracer, v: Vertex, lobe: Array) -> LobeSurface:
    """What a lobe sees of its surface."""
    return LobeSurface(t.scene.materials, v.material * t.scene.materials.L + lobe, v.front)

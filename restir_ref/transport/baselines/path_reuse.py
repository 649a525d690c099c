"""Path reuse in tiles: every pixel connects its x_1 to every x_2 of its tile, and sums.  [Bekaert 2002; GRIS 9.3]

Nothing is selected: the integrals are plugged into `reuse_all`.  They are over what lies behind a given x_1:
over x_2 (area) with a point on a light, and over x_2 with the direction that a BSDF sample leaves it in
(area times angle), each with its density p.  The target is p itself, so that Talbot's weights are the
balance heuristic over the tile's densities, and a pixel sums f_j / sum_k p_k over the samples of its tile.

A sample holds f and p as all pixels of its tile see them, so each x_2 is connected once to each x_1, and
shifts are the identity.  Light that needs no x_2, or reaches it only through a delta lobe, stays each pixel's own.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from restir_ref.batch import Array, entry, ratio, take, total
from restir_ref.chance import Chance
from restir_ref.integrals import Pixels, Reservoirs, Shifted
from restir_ref.restir import reuse_all
from restir_ref.transport import materials as mat
from restir_ref.transport.materials import Vertex
from restir_ref.transport.paths import Tracer, Tree, leaves, trace
from restir_ref.transport.rays import vertex
from restir_ref.transport.subtrees import behind
from restir_ref.transport.vectors import dot, norm

TILE = 16
"""Pixels of a tile.  [GRIS 9.3]"""


@dataclass(frozen=True)
class Shared:
    """A sample as the pixels of its tile see it: densities p (size, N), integrands f (size, C, N)."""

    p: Array
    f: Array


@dataclass(frozen=True, eq=False)
class TileIntegrals:
    """I_j = what reaches the x_1 of column j after scattering elsewhere; the columns are those of `tree`.

    Raises ValueError for trees that scatter once, and images that tiles do not fill.
    """

    tracer: Tracer
    tree: Tree
    size: int = TILE

    def __post_init__(self) -> None:
        if self.tracer.depth < 2:
            raise ValueError("path reuse connects to x_2: trace at least two scattering events.")
        if self.n % self.size:
            raise ValueError(f"an image of {self.n} pixels cannot be cut into tiles of {self.size}.")

    @property
    def n(self) -> int:
        """Number of pixels."""
        return self.tracer.sensor.n

    def candidates(self, index: Array, chance: Chance) -> Iterator[tuple[Shared, Array]]:
        """What x_2 gives by light sampling, then by its BSDF sample, each with W = 1 / p; both are to be kept."""
        columns = np.arange(len(self.tree.x[0].prim))
        slot = columns % self.size
        seen = [_seen_from(self.tracer, self.tree, columns - slot + j, slot == j) for j in range(self.size)]
        for end, shared in enumerate(shareable(self.tree)):
            p, f = (np.stack(parts) for parts in zip(*(each[end] for each in seen), strict=True))
            W = ratio(shared, p[slot, columns])
            yield take(Shared(p, f), index), W.take(index)

    def target(self, index: Array, x: Shared) -> Array:
        """p_hat = p."""
        return entry(x.p, index % self.size)

    def contribution(self, index: Array, x: Shared) -> Array:
        """f, (C, N)."""
        return entry(x.f, index % self.size)

    def shift(self, x: Shared, index: Array, to: Pixels) -> Shifted:
        """The identity: the pixels of a tile share their domains."""
        return Shifted(x, np.ones(len(index)))


def path_reuse(t: Tracer, pixel: Array, chance: Chance, size: int = TILE) -> Array:
    """One tree per pixel, reused by its whole tile; columns are whole images, replica * n + pixel; (C, N)."""
    tree = trace(t, chance.uniform((t.D, len(pixel))), pixel)
    of = TileIntegrals(t, tree, size)
    here = Pixels(of, np.arange(len(pixel)))
    kept = [Reservoirs(x, W, np.ones(len(W))) for x, W in of.candidates(here.index, chance)]
    return total([not_shared(tree), *(reuse_all(X, here, rest_of_tile(here, size)) for X in kept)])


def rest_of_tile(here: Pixels, size: int) -> list[Pixels]:
    """The other pixels of every pixel's tile."""
    slot = here.index % size
    return [Pixels(here.of, here.index - slot + (slot + k) % size) for k in range(1, size)]


def shareable(tree: Tree) -> tuple[Array, Array]:
    """Whether the x_2 of a tree can be connected to others (N,), and so can the direction that leaves it (N,)."""
    found, left = (at.weight.any(axis=0) & (at.p > 0) for at in tree.at[:2])
    return found, found & left


def not_shared(tree: Tree) -> Array:
    """What scatters less than twice, or at x_1, or onwards from x_2, by a delta lobe; (C, N)."""
    at_x_1, at_x_2 = (at.p == 0 for at in tree.at[:2])
    by_delta = {(2, True): at_x_1}
    own = [F if k < 2 else F * by_delta.get((k, nee), at_x_1 | at_x_2) for k, nee, F in leaves(tree)]
    return total(own)


def _seen_from(t: Tracer, tree: Tree, columns: Array, own: Array) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """(p, f) of both samples of every tree as the x_1 of `columns` (N,) sees them; `own` (N,): it has found x_2."""
    v, T, x_2 = *take((tree.x[0], tree.T[0]), columns), tree.x[1]
    to = x_2.x - v.x
    r = np.maximum(norm(to), 1e-300)
    w = to / r
    f, p = _scattered(t, v, w)
    G = np.maximum(-dot(x_2.n, w), 0) / r ** (t.scene.space.d - 1)
    G = G * (own | _clear(t, v, x_2, G * p * (shareable(tree)[0] & ~own)))
    by_light, (p_out, by_bsdf) = _leaving(t, tree, vertex(t.scene, x_2.x, x_2.prim, -w))
    return (p * G, T * f * G * by_light), (p * G * p_out, T * f * G * by_bsdf)


def _leaving(t: Tracer, tree: Tree, z: Vertex) -> tuple[Array, tuple[Array, Array]]:
    """Integrands beyond x_2 = z, seen from anywhere: by light sampling, and p_out with the one by the BSDF sample."""
    (light, w_light), at, hit = tree.lights[1], tree.at[1], tree.hits[1]
    f_light, p_light = _scattered(t, z, w_light)
    f_out, p_out = _scattered(t, z, at.w)
    far = sum((F for k, _, F in leaves(behind(behind(tree))) if k), np.zeros_like(f_out))
    met = hit.bare * ratio(p_out, p_out + hit.p_light) + far
    return f_light * light.bare * ratio(light.p_light, light.p_light + p_light), (p_out, f_out * met)


def _scattered(t: Tracer, v: Vertex, w: Array) -> tuple[Array, Array]:
    """f |cos| (C, N) towards w (d, N), and the density with which lobes that are not black sample w (N,).

    Black lobes find no x_2, so they must not be counted.
    """
    table, space = t.scene.materials, t.scene.space
    colour = table.colour.max(axis=0)
    P = mat.lobe_shares(table, v)
    P = P * np.stack([colour.take(v.material * table.L + l) > 0 for l in range(table.L)])
    return mat.evaluate_all(table, space, v, P, space.to_local(v.n, w))


def _clear(t: Tracer, v: Vertex, z: Vertex, p: Array) -> Array:
    """Whether nothing stands between v and z, asked where p > 0; (N,)."""
    clear = np.asarray(p > 0)
    asked = np.flatnonzero(clear)
    clear[asked] = t.scene.visible(v.x.take(asked, axis=-1), z.x.take(asked, axis=-1))
    return clear

"""Materials are sums of lobes; one lobe is sampled at a time, all are evaluated for light sampling.  [GRIS 7.6]"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from restir_ref.batch import Array, ratio, take
from restir_ref.transport.lobes import KINDS, LOBES, Lobe, Surface
from restir_ref.transport.space import Space


@dataclass(frozen=True)
class Layer:
    """One lobe of a material: its kind, colour (C,), perceptual roughness r (alpha = r^2), and weight in choosing."""

    kind: str
    colour: Sequence[float] = (1.0,)
    roughness: float = 1.0
    weight: float = 1.0


@dataclass(frozen=True)
class Material:
    """A sum of lobes over one index of refraction inside."""

    layers: Sequence[Layer]
    eta: float = 1.5


@dataclass(frozen=True, eq=False)
class Table:
    """All materials of a scene as arrays over (material, lobe); absent lobes have weight 0."""

    kind: Array
    colour: Array
    roughness: Array
    weight: Array
    eta: Array
    present: tuple[int, ...]

    @property
    def L(self) -> int:
        """Most lobes of a material."""
        return int(self.kind.shape[1])


@dataclass(frozen=True)
class Vertex:
    """A path's scattering vertex, seen along `-o`.

    x, n (d, N)  position and geometric normal on the side of o; o (d, N) towards the previous vertex, local
    material, prim (N,), front (N,) whether o is on the front side
    """

    x: Array
    n: Array
    o: Array
    material: Array
    prim: Array
    front: Array


def table(materials: Sequence[Material], channels: int) -> Table:
    """Compile materials; raises ValueError for unknown kinds, bad roughness or colours that are no reflectance."""
    L = max(len(material.layers) for material in materials)
    absent = Layer(KINDS[0], (0.0,) * channels, 1.0, 0.0)
    rows = [[*material.layers, *[absent] * (L - len(material.layers))] for material in materials]
    for row in rows:
        for layer in row:
            _check(layer, channels)
    kind = np.array([[KINDS.index(layer.kind) for layer in row] for row in rows])
    return Table(
        kind,
        np.array([[layer.colour for layer in row] for row in rows], dtype=float),
        np.array([[layer.roughness for layer in row] for row in rows], dtype=float),
        np.array([[layer.weight for layer in row] for row in rows], dtype=float),
        np.array([material.eta for material in materials], dtype=float),
        tuple(sorted({KINDS.index(layer.kind) for row in rows for layer in row if layer.weight > 0})),
    )


def _check(layer: Layer, channels: int) -> None:
    if layer.kind not in KINDS:
        raise ValueError(f"there is no lobe {layer.kind!r}; the kinds are {', '.join(KINDS)}.")
    if not 0 <= layer.roughness <= 1 or (layer.roughness == 0 and not LOBES[layer.kind].delta):
        raise ValueError(
            f"the roughness of {layer.kind} must be in (0, 1], but is {layer.roughness}; 0 needs a delta lobe."
        )
    if len(layer.colour) != channels or not all(0 <= c <= 1 for c in layer.colour):
        raise ValueError(f"the colour of {layer.kind} must be {channels} numbers in [0, 1], but is {layer.colour}.")


def lobe_shares(t: Table, v: Vertex) -> Array:
    """P_l, the probability of choosing each lobe at v; (L, N), columns sum to 1."""
    if t.L == 1:
        return np.ones((1, len(v.material)))
    shares = np.stack([t.weight[v.material, l] * _share(t, v, np.full(len(v.material), l)) for l in range(t.L)])
    return ratio(shares, shares.sum(axis=0))


def choose_lobe(P: Array, u: Array) -> Array:
    """The lobe whose interval of the running sum of P (L, N) holds u (N,)."""
    index = np.zeros(u.shape, dtype=int)
    upto = np.zeros(u.shape)
    for share in P[:-1]:
        upto = upto + share
        index += u >= upto
    return index


def choose_number(P_x: Array, P_y: Array, lobe: Array, u: Array) -> Array:
    """The number that chooses `lobe` at y as far into its interval as u does at x: for inverting a copied lobe."""
    columns = np.arange(len(u))
    start_x, start_y = (np.cumsum(P, axis=0)[lobe, columns] - P[lobe, columns] for P in (P_x, P_y))
    return start_y + ratio((u - start_x) * P_y[lobe, columns], P_x[lobe, columns])


def lobe_roughness(t: Table, v: Vertex, lobe: Array) -> Array:
    """Perceptual roughness of a lobe (N,); 0 for delta lobes."""
    delta = np.array([LOBES[kind].delta for kind in KINDS])
    return np.where(delta[t.kind[v.material, lobe]], 0.0, t.roughness[v.material, lobe])


def roughest(t: Table, v: Vertex) -> Array:
    """Roughness of the roughest lobe: how vertices that end in light sampling are judged.  [GRIS 7.6]"""
    rough = [lobe_roughness(t, v, np.full(len(v.material), l)) for l in range(t.L)]
    return np.asarray(np.max([np.where(t.weight[v.material, l] > 0, r, 0) for l, r in enumerate(rough)], axis=0))


def sample_lobe(t: Table, space: Space, v: Vertex, lobe: Array, u: Array) -> Array:
    """Local direction i (d, N) from u (d-1, N) by one lobe; 0 where there is none."""
    return _by_kind(t, v, lobe, (u,), lambda kind, s, w, numbers: kind.sample(space, s, w.o, numbers))


def invert_lobe(t: Table, space: Space, v: Vertex, lobe: Array, i: Array) -> Array:
    """The u (d-1, N) of `sample_lobe`."""
    return _by_kind(t, v, lobe, (i,), lambda kind, s, w, to: kind.invert(space, s, w.o, to))


def evaluate_lobe(t: Table, space: Space, v: Vertex, lobe: Array, i: Array) -> tuple[Array, Array]:
    """f |cos| (C, N) and pdf (N,) of one lobe; for delta lobes the weight f |cos| / p and 0."""

    def both(kind: Lobe, s: Surface, w: Vertex, to: Array) -> Array:
        return np.stack([kind.evaluate(space, s, w.o, to), kind.pdf(space, s, w.o, to)])

    value, pdf = _by_kind(t, v, lobe, (i,), both)
    return t.colour[v.material, lobe].T * value, pdf


def evaluate_all(t: Table, space: Space, v: Vertex, P: Array, i: Array) -> tuple[Array, Array]:
    """f |cos| (C, N) and pdf (N,) of all lobes together, delta lobes left out: what light sampling sees."""
    f: Array = np.zeros((t.colour.shape[-1], len(v.material)))
    p: Array = np.zeros(len(v.material))
    for l in range(t.L):
        lobe = np.full(len(v.material), l)
        value, pdf = evaluate_lobe(t, space, v, lobe, i)
        seen = (t.weight[v.material, l] > 0) & (lobe_roughness(t, v, lobe) > 0)
        f, p = f + np.where(seen, value, 0), p + np.where(seen, P[l] * pdf, 0)
    return f, p


def _share(t: Table, v: Vertex, lobe: Array) -> Array:
    return _by_kind(t, v, lobe, (), lambda kind, s, w: kind.share(s, w.o))


def _by_kind(t: Table, v: Vertex, lobe: Array, args: tuple[Array, ...], call: Callable[..., Array]) -> Array:
    """Call the right lobe for every column: columns of one kind together."""
    kinds = t.kind[v.material, lobe]
    out: Array | None = None
    for k in t.present:
        columns = slice(None) if len(t.present) == 1 else np.flatnonzero(kinds == k)
        if not isinstance(columns, slice) and not len(columns):
            continue
        part, rest = (v, args) if isinstance(columns, slice) else (take(v, columns), take(args, columns))
        found = call(LOBES[KINDS[k]], _surface(t, part, lobe[columns]), part, *rest)
        if isinstance(columns, slice):
            return found
        out = np.zeros((*found.shape[:-1], len(kinds))) if out is None else out
        out[..., columns] = found
    if out is None:
        raise ValueError("there is no material to evaluate: the batch is empty.")
    return out


def _surface(t: Table, v: Vertex, lobe: Array) -> Surface:
    """alpha = r^2, and eta seen from the side of o."""
    eta = t.eta[v.material]
    return Surface(t.roughness[v.material, lobe] ** 2, np.where(v.front, eta, 1 / eta))

"""Materials are sums of lobes; one lobe is sampled at a time, all are evaluated for light sampling.  [GRIS 7.6]"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import accumulate

import numpy as np

from restir_ref.batch import Array, pick, ratio, take, total
from restir_ref.transport.lobes import KINDS, LOBES, Lobe
from restir_ref.transport.space import Space

ROUNDING = 1e-9
"""By so much colours may sum to more than 1."""


@dataclass(frozen=True)
class Layer:
    """One lobe of a material: its kind, colour (C,), perceptual roughness r (alpha = r^2), and weight in choosing.

    Delta lobes have no roughness; their own is ignored.
    """

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
    """All materials of a scene as arrays; rows are (material, lobe), row = material * L + lobe.

    kind, alpha, roughness (M L,), colour (C, M L), weight (L, M)
    eta (2 M L,)  by side, 2 row + front
    roughest (M,)  roughness of each material's roughest lobe
    kinds  which kinds there are among the l-th lobes, for every l; absent lobes are black and have weight 0
    """

    L: int
    kind: Array
    alpha: Array
    roughness: Array
    colour: Array
    weight: Array
    eta: Array
    roughest: Array
    kinds: tuple[tuple[int, ...], ...]


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


@dataclass(frozen=True)
class LobeSurface:
    """The surface that one lobe sees in every column, looked up only when it asks."""

    t: Table
    row: Array
    front: Array

    @property
    def alpha(self) -> Array:
        """alpha = r^2."""
        return self.t.alpha.take(self.row)

    @property
    def eta(self) -> Array:
        """Index of refraction as seen from the side of o."""
        return self.t.eta.take(2 * self.row + self.front)


def table(materials: Sequence[Material], channels: int) -> Table:
    """Compile materials; raises ValueError for none, or what is no material (see `check`)."""
    if not materials:
        raise ValueError("a scene needs at least one material; a black one is Material([Layer('lambert', (0.0,))]).")
    for material in materials:
        check(material, channels)
    L = max(len(material.layers) for material in materials)
    absent = [Layer(_usual_kind(materials, l), (0.0,) * channels, 1.0, 0.0) for l in range(L)]
    rows = [layer for material in materials for layer in [*material.layers, *absent[len(material.layers) :]]]
    kind = np.array([KINDS.index(layer.kind) for layer in rows])
    given = np.array([layer.roughness for layer in rows], dtype=float)
    roughness = np.where([LOBES[layer.kind].delta for layer in rows], 0.0, given)
    weight = np.array([layer.weight for layer in rows], dtype=float).reshape(-1, L)
    eta = np.array([material.eta for material in materials], dtype=float)
    return Table(
        L,
        kind,
        given**2,
        roughness,
        np.array([layer.colour for layer in rows], dtype=float).T.copy(),
        (weight / weight.sum(axis=1, keepdims=True)).T.copy(),
        np.stack([1 / eta, eta], axis=1).repeat(L, axis=0).reshape(-1),
        np.max(np.where(weight > 0, roughness.reshape(-1, L), 0), axis=1),
        tuple(tuple(sorted(set(kind[l::L].tolist()))) for l in range(L)),
    )


def _usual_kind(materials: Sequence[Material], l: int) -> str:
    """A kind that some l-th lobe has: absent lobes take it, so that fewer kinds are told apart."""
    return next(material.layers[l].kind for material in materials if len(material.layers) > l)


def check(material: Material, channels: int) -> None:
    """Raise ValueError for unknown kinds, impossible roughness, weight or index, and colours or sums beyond [0, 1]."""
    if not any(layer.weight > 0 for layer in material.layers):
        raise ValueError(f"{material} needs a lobe of positive weight; a black one is Layer('lambert', (0.0,)).")
    if not 0 < material.eta < np.inf:
        raise ValueError(f"the index of refraction must be positive and finite, but is {material.eta}.")
    for layer in material.layers:
        _check_layer(layer, channels)
        if layer.kind == "rough transmission" and abs(material.eta - 1) < 1e-3:
            raise ValueError(f"rough transmission needs an index of refraction unlike 1, but it is {material.eta}.")
    most = float(np.max(_albedo(material)))
    if most > 1 + ROUNDING:
        raise ValueError(
            f"the colours of {material} sum to {most:.6g}, more light than arrives: scale them to at most 1. What is "
            f"transmitted is not reflected, so of these two the larger one counts."
        )


def _albedo(material: Material) -> Array:
    """Upper bound of what leaves over what arrives, (C,): reflection and transmission share it, F to 1 - F."""
    colours = [np.array(layer.colour, dtype=float) for layer in material.layers]
    ways = [layer.kind.rpartition(" ")[2] for layer in material.layers]
    reflected, transmitted = (
        total([colour * (way == each) for colour, way in zip(colours, ways, strict=True)])
        for each in ("reflection", "transmission")
    )
    return np.asarray(total(colours) - np.minimum(reflected, transmitted))


def _check_layer(layer: Layer, channels: int) -> None:
    if layer.kind not in KINDS:
        raise ValueError(f"there is no lobe {layer.kind!r}; the kinds are {', '.join(KINDS)}.")
    if not (LOBES[layer.kind].delta or 0 < layer.roughness <= 1):
        raise ValueError(
            f"the roughness of {layer.kind} must be in (0, 1], but is {layer.roughness}; 0 needs a delta lobe."
        )
    if np.shape(layer.colour) != (channels,) or not all(0 <= c <= 1 for c in layer.colour):
        raise ValueError(
            f"the colour of {layer.kind} must have one number in [0, 1] per channel of the lights' emission, "
            f"here {channels}, but is {layer.colour}."
        )
    if not 0 <= layer.weight < np.inf or (layer.weight == 0 and any(layer.colour)):
        raise ValueError(
            f"the weight of {layer.kind} must be finite and, unless it is black, positive, but is {layer.weight}."
        )


def lobe_shares(t: Table, v: Vertex) -> Array:
    """P_l, the probability of choosing each lobe at v; (L, N), columns sum to 1."""
    weight = t.weight.take(v.material, axis=-1)
    if all(LOBES[KINDS[k]].share is None for kinds in t.kinds for k in kinds):
        return weight
    shares = np.stack([weight[l] * _each_kind(t, v, l, t.kinds[l], _share)[0] for l in range(t.L)])
    return ratio(shares, shares.sum(axis=0))


def choose_lobe(P: Array, u: Array) -> Array:
    """The lobe whose interval of the running sum of P (L, N) holds u (N,)."""
    index = np.zeros(u.shape, dtype=int)
    for upto in accumulate(P[:-1]):
        index += u >= upto
    return index


def choose_number(P_x: Array, P_y: Array, lobe: Array, u: Array) -> Array:
    """The number that chooses `lobe` at y as far into its interval as u does at x: for inverting a copied lobe."""
    start_x, start_y = (pick([np.zeros(len(u)), *accumulate(P[:-1])], lobe) for P in (P_x, P_y))
    return np.asarray(start_y + ratio((u - start_x) * pick([*P_y], lobe), pick([*P_x], lobe)))


def albedo(t: Table) -> Array:
    """The colours of each material's lobes together, (C, M): how much of the light it scatters at most."""
    return np.asarray(t.colour.reshape(len(t.colour), -1, t.L).sum(axis=-1))


def lobe_roughness(t: Table, v: Vertex, lobe: Array) -> Array:
    """Perceptual roughness of a lobe (N,); 0 for delta lobes."""
    return t.roughness.take(v.material * t.L + lobe)


def roughest(t: Table, v: Vertex) -> Array:
    """Roughness of the roughest lobe: how vertices that end in light sampling are judged.  [GRIS 7.6]"""
    return t.roughest.take(v.material)


def sample_lobe(t: Table, space: Space, v: Vertex, lobe: Array, u: Array) -> Array:
    """Local direction i (d, N) from u (d-1, N) by one lobe; 0 where there is none."""
    (i,) = _by_lobe(t, v, lobe, lambda kind, s, o, u: (kind.sample(space, s, o, u),), u)
    return i


def invert_lobe(t: Table, space: Space, v: Vertex, lobe: Array, i: Array) -> Array:
    """The u (d-1, N) of `sample_lobe`."""
    (u,) = _by_lobe(t, v, lobe, lambda kind, s, o, i: (kind.invert(space, s, o, i),), i)
    return u


def evaluate_lobe(t: Table, space: Space, v: Vertex, lobe: Array, i: Array) -> tuple[Array, Array]:
    """f |cos| (C, N) and pdf (N,) of one lobe; for delta lobes the weight f |cos| / p and 0."""

    def both(kind: Lobe, s: LobeSurface, o: Array, i: Array) -> tuple[Array, ...]:
        pdf, weight = kind.pdf(space, s, o, i), kind.weight(space, s, o, i)
        return weight if kind.delta else pdf * weight, pdf

    value, pdf = _by_lobe(t, v, lobe, both, i)
    return t.colour.take(v.material * t.L + lobe, axis=-1) * value, pdf


def evaluate_all(t: Table, space: Space, v: Vertex, P: Array, i: Array) -> tuple[Array, Array]:
    """f |cos| (C, N) and pdf (N,) of all lobes together, delta lobes left out: what light sampling sees."""
    f, p = evaluate_each(t, space, v, i)
    return total(f), total([share * pdf for share, pdf in zip(P, p, strict=True)])


def evaluate_each(t: Table, space: Space, v: Vertex, i: Array) -> tuple[list[Array], list[Array]]:
    """f |cos| (C, N) and pdf (N,), without its probability, of each lobe; both are 0 for delta lobes."""

    def both(kind: Lobe, s: LobeSurface, o: Array, i: Array) -> tuple[Array, ...]:
        pdf = kind.pdf(space, s, o, i)
        return pdf * kind.weight(space, s, o, i), pdf

    found = [_each_kind(t, v, l, t.kinds[l], both, i) for l in range(t.L)]
    f = [t.colour.take(v.material * t.L + l, axis=-1) * value for l, (value, _) in enumerate(found)]
    return f, [pdf for _, pdf in found]


def scatter_lobe(t: Table, space: Space, v: Vertex, P: Array, lobe: Array, i: Array) -> tuple[Array, Array, Array]:
    """What a sample i (d, N) of one lobe carries, and how dense it is: f |cos| / p (C, N), p and p_all (N,).

    p = P_l p_l is the lobe's own density with its probability, p_all that of all lobes together.  Both are
    0 for delta lobes, whose f |cos| / p is that of their one direction.
    """
    pdfs = [_each_kind(t, v, l, t.kinds[l], _pdf(space), i)[0] for l in range(t.L)]
    p_l, P_l = pick(pdfs, lobe), pick([*P], lobe)
    (weight,) = _by_lobe(t, v, lobe, lambda kind, s, o, i: (kind.weight(space, s, o, i),), i)
    p_all = total([share * pdf for share, pdf in zip(P, pdfs, strict=True)])
    colour = t.colour.take(v.material * t.L + lobe, axis=-1)
    return colour * ratio(weight, P_l), P_l * p_l, p_all * (p_l > 0)


def _share(kind: Lobe, s: LobeSurface, o: Array) -> tuple[Array]:
    return (np.ones(o.shape[-1]) if kind.share is None else kind.share(s, o),)


def _pdf(space: Space) -> Callable[..., tuple[Array]]:
    return lambda kind, s, o, i: (kind.pdf(space, s, o, i),)


Call = Callable[..., tuple[Array, ...]]


def _by_lobe(t: Table, v: Vertex, lobe: Array, call: Call, *args: Array) -> tuple[Array, ...]:
    """`_each_kind` where any lobe may occur."""
    return _each_kind(t, v, lobe, tuple({k for kinds in t.kinds for k in kinds}), call, *args)


def _each_kind(
    t: Table, v: Vertex, lobe: Array | int, kinds: tuple[int, ...], call: Call, *args: Array
) -> tuple[Array, ...]:
    """Call the right lobe for every column, columns of one kind together."""
    row: Array = v.material * t.L + lobe
    if len(kinds) == 1:
        return call(LOBES[KINDS[kinds[0]]], LobeSurface(t, row, v.front), v.o, *args)
    kind = t.kind.take(row)
    groups = [np.flatnonzero(kind == k) for k in kinds]
    parts = []
    for k, columns in zip(kinds, groups, strict=True):
        row_k, front, o, *rest = take((row, v.front, v.o, *args), columns)
        parts.append(call(LOBES[KINDS[k]], LobeSurface(t, row_k, front), o, *rest))
    position = np.empty(len(row), dtype=int)
    position[np.concatenate(groups)] = np.arange(len(row))
    return tuple(np.concatenate(leaves, axis=-1).take(position, axis=-1) for leaves in zip(*parts, strict=True))

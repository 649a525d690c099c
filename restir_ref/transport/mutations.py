"""Mutations of paths: what `decorrelation` needs to move a reservoir's path within its own pixel.  [MCMC 3.2, 4.1, 5.2]

Two forms, both in primary sample space, where p_hat is C = p_hat / q of [MCMC 3.2.3]:

    Retraced   recover the primary sample, step any of its numbers, trace again: the reference, a whole path of rays
    TwoRays    turn the direction that leaves x_(c-1), so that x_c moves, and join x_c to x_(c+1) as it is

In the second form the numbers of x_c follow from x_(c+1), which stays: the mutation is a shift into one's own pixel
with one changed number, which reconnects one vertex later.  So T(x' -> x) / T(x -> x') is the J = A(y) / A(x) of that
shift, with A from x_c to x_(c+1): written out it is the ratio of [MCMC 4.1], whose distances are squared for d = 3.
Where x_c is the light, or light sampling joins it to the light, no number follows from another, and the ratio is 1.

A reservoir keeps for it what reconnecting at x_(c+1) needs, `FarPath`; where the path stands before it reconnects,
x_(c-1) and the throughput that arrives there, is found once per pass (`Standing`), as shifts know it anyway.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, fields, replace
from itertools import pairwise
from types import MappingProxyType
from typing import Any

import numpy as np

from restir_ref.batch import Array, changed, ratio, take
from restir_ref.chance import Chance
from restir_ref.decorrelation import Step, gaussian, wrapped
from restir_ref.guards import positive
from restir_ref.integrals import Pixels, Reservoirs, Shifted
from restir_ref.transport import materials as mat
from restir_ref.transport.materials import Vertex
from restir_ref.transport.paths import REPLAY, Path, Tracer, Tree, connectable, hit_leaf, light_leaf, trace
from restir_ref.transport.rays import GRAZING, arrive, emitted, light_pdf, vertex
from restir_ref.transport.record import record, record_from
from restir_ref.transport.restir_pt import PathIntegrals
from restir_ref.transport.retracing import direction_number, own_numbers, traced
from restir_ref.transport.shifts import beyond, replay, roughness_of_z
from restir_ref.transport.subtrees import of_leaf, one_of
from restir_ref.transport.vectors import norm, normalize

SIGMA = 0.02
"""Standard deviation of a step of a primary number, which [MCMC 5.2.2] does not print."""

REMEDY = "it is the standard deviation of a step: leave mutations out by k = 0 instead."


@dataclass(frozen=True)
class Among:
    """Chance for the columns `at` of N: draws for all of them, so that how many numbers are drawn tells nothing."""

    chance: Chance
    at: Array
    N: int

    def choose(self, weights: Array) -> Array:
        """Index of each of the columns, from weights (K, len(at))."""
        every = np.zeros((len(weights), self.N))
        every[:, self.at] = weights
        return self.chance.choose(every).take(self.at)

    def uniform(self, shape: tuple[int, ...]) -> Array:
        """Numbers of the columns, (.., len(at))."""
        return self.chance.uniform((*shape[:-1], self.N)).take(self.at, axis=-1)


# ---------------------------------------------------------------- by all rays of a path

Numbers = Callable[[Tracer, Path], Array]
"""Which primary numbers of a path are stepped: (D, N) bool."""


def every_number(t: Tracer, x: Path) -> Array:
    """All of them, read or not; the path may reconnect elsewhere, or nowhere."""
    return np.ones((t.D, len(x.k)), dtype=bool)


def number_into_x_c(t: Tracer, x: Path) -> Array:
    """Those of the direction from x_(c-1) to x_c; what is behind x_c moves as well."""
    stepped = np.zeros((t.D, len(x.k)), dtype=bool)
    for c in np.unique(x.c[x.c > 0]):
        t.direction_numbers(stepped, int(c) - 1)[:] |= x.c == c
    return stepped


NUMBERS: Mapping[str, Numbers] = MappingProxyType({"every": every_number, "into x_c": number_into_x_c})


@dataclass(frozen=True, eq=False)
class Retraced(PathIntegrals):
    """Path integrals whose samples are mutated by steps of their own primary numbers, and traced again.

    A step of numbers that the new path would not step is no step back: it is rejected.
    Raises ValueError for sigma <= 0.
    """

    sigma: float = SIGMA
    step: Step = wrapped
    numbers: Numbers = every_number

    def __post_init__(self) -> None:
        positive(self.sigma, "sigma", REMEDY)

    def propose(self, index: Array, x: Path, chance: Chance) -> tuple[Path, Array]:
        """x' by tracing u', and T(x' -> x) / T(x -> x') (N,), that of the steps."""
        lit = np.flatnonzero(x.F.any(axis=0))
        some, base, pixel = Among(chance, lit, len(index)), take(x, lit), index.take(lit) % self.n
        u, stepped = own_numbers(self.tracer, base, pixel, some), self.numbers(self.tracer, base)
        rows = [self.step(row[None], self.sigma, some) for row in u]
        u_new = np.where(stepped, np.concatenate([row for row, _ in rows]), u)
        T = np.where(stepped, np.stack([each for _, each in rows]), 1.0).prod(axis=0)
        y = traced(self.tracer, u_new, pixel, base.k, base.nee)
        same = (self.numbers(self.tracer, y) == stepped).all(axis=0)
        return _with_columns(x, lit, {each.name: getattr(y, each.name) for each in fields(Path)}), _at(
            lit, T * same, len(index)
        )


# ---------------------------------------------------------------- by two rays


@dataclass(frozen=True)
class FarPath(Path):
    """A path that may also be joined at x_(c+1): position, primitive, and of what leaves it lobe, direction and S.

    They are those fields of `Path` as they would be if x_(c+1) were the reconnection vertex; a shift keeps them.
    """

    far_z: Array
    far_prim: Array
    far_lobe: Array
    far_out: Array
    far_S: Array


def far_record(t: Tracer, tree: Tree, leaf: tuple[Array, Array], F: Array) -> FarPath:
    """The path record of leaf (k, nee) of each column with its far part, of F (C, N)."""
    near = record(t, tree, *leaf, F)
    far = record_from(t, tree, leaf, np.clip(near.c + 1, 2, t.depth + 1), F)
    own = {each.name: getattr(near, each.name) for each in fields(Path)}
    return FarPath(**own, far_z=far.z, far_prim=far.prim, far_lobe=far.lobe_out, far_out=far.out, far_S=far.S)


@dataclass(frozen=True)
class Place:
    """Where a path stands before it reconnects: v = x_(c-1), lobe shares P, throughput T that arrives there."""

    v: Vertex
    P: Array
    T: Array


Turn = Callable[[Tracer, Vertex, Array, Array, Chance], tuple[Array, Array]]
"""turn(tracer, v, lobe, w, chance) -> (w' (d, N) that a lobe at v samples instead of w, ratio of transitions (N,))."""


@dataclass(frozen=True)
class ByNumbers:
    """Steps of the primary numbers with which the lobe samples the direction.  [MCMC 5.2.2]"""

    sigma: float = SIGMA
    step: Step = wrapped

    def __post_init__(self) -> None:
        positive(self.sigma, "sigma", REMEDY)

    def __call__(self, t: Tracer, v: Vertex, lobe: Array, w: Array, chance: Chance) -> tuple[Array, Array]:
        """Invert, step, sample again; the ratio is the step's, 0 where the lobe samples nothing."""
        u, T = self.step(direction_number(t, v, lobe, w), self.sigma, chance)
        local = mat.sample_lobe(t.scene.materials, t.scene.space, v, lobe, u)
        exists = local[-1] != 0
        return t.scene.space.to_world(v.n, np.where(exists, local, v.o)), T * exists


@dataclass(frozen=True)
class ByDirections:
    """Steps of the direction itself, w' = w + sigma n up to its length: what [MCMC 3.2.3] compares with.

    As likely forth as back in directions, so that in primary numbers, of density 1 / p, the ratio is p(w') / p(w).
    """

    sigma: float = SIGMA

    def __post_init__(self) -> None:
        positive(self.sigma, "sigma", REMEDY)

    def __call__(self, t: Tracer, v: Vertex, lobe: Array, w: Array, chance: Chance) -> tuple[Array, Array]:
        """The direction that is a normal step away."""
        table, space = t.scene.materials, t.scene.space
        w_new = normalize(gaussian(w, self.sigma, chance))
        _, p = mat.evaluate_lobe(table, space, v, lobe, space.to_local(v.n, w))
        _, p_new = mat.evaluate_lobe(table, space, v, lobe, space.to_local(v.n, w_new))
        return w_new, ratio(p_new, p)


Choice = Callable[[Tracer, Place, Array, Array, Chance], Array]
"""choice(tracer, place, lobe, w, chance) -> the lobe that is to have sampled w, (N,)."""


def kept(t: Tracer, at: Place, lobe: Array, w: Array, chance: Chance) -> Array:
    """The lobe that did.  [MCMC 4.1]"""
    return lobe


def jumped(t: Tracer, at: Place, lobe: Array, w: Array, chance: Chance) -> Array:
    """One that could have, in proportion to its density P_l p_l(w).  [MCMC 4.1; Bitterli 2017]

    Before and after the step, this is as likely forth as back: with q(l | w) = P_l p_l(w) / p_all(w) and the ratio
    P_l p_l / (P_k p_k) by which primary numbers of lobe l are denser than those of k, all factors cancel.
    """
    _, p = mat.evaluate_each(t.scene.materials, t.scene.space, at.v, t.scene.space.to_local(at.v.n, w))
    return chance.choose(np.stack([P * each for P, each in zip(at.P, p, strict=True)]))


LOBE_CHOICES: Mapping[str, Choice] = MappingProxyType({"kept": kept, "jumped": jumped})


@dataclass(frozen=True, eq=False)
class TwoRays(PathIntegrals):
    """Path integrals whose samples are mutated by moving x_c, by two rays: from x_(c-1) to x_c, to x_(c+1).

    Paths that reconnect nowhere stay.  A proposal after which another pair of vertices would be the first that
    connects is rejected: it would be no sample that a shift can take back.  [MCMC 3.2.4, 5.2]
    """

    turn: Turn = ByNumbers()
    choice: Choice = kept

    def candidates(self, index: Array, chance: Chance) -> Iterator[tuple[FarPath, Array]]:
        """Those of `PathIntegrals`, with their far part."""
        tree = trace(self.tracer, chance.uniform((self.tracer.D, len(index))), index % self.n)
        k, nee, F = zip(*self.leaves(tree), strict=True)
        leaf, W = one_of(F, chance)
        yield far_record(self.tracer, tree, (np.array(k)[leaf], np.array(nee)[leaf]), of_leaf(F, leaf)), W

    def standing(self, X: Reservoirs, index: Array) -> "Standing":
        """What k mutations of X need but once: where the paths stand that can move at all."""
        x, t = X.x, self.tracer
        columns = np.flatnonzero((x.c > 0) & (X.W > 0) & x.F.any(axis=0))
        base = take(x, columns)
        y = replay(replace(t, rule=REPLAY), base, index.take(columns) % self.n)
        return Standing(self, columns, Place(y.v, mat.lobe_shares(t.scene.materials, y.v), y.T))

    def propose(self, index: Array, x: FarPath, chance: Chance) -> tuple[FarPath, Array]:
        """x' and T(x' -> x) / T(x -> x') (N,), from any place: it is found anew."""
        one = np.ones(len(index))
        return self.standing(Reservoirs(x, one, one), index).propose(index, x, chance)


@dataclass(frozen=True, eq=False)
class Standing:
    """The same integrals for the mutations of one pass: `columns` (n,) of its N paths move, from places `at`."""

    of: TwoRays
    columns: Array
    at: Place

    @property
    def n(self) -> int:
        """Number of pixels."""
        return self.of.n

    def candidates(self, index: Array, chance: Chance) -> Iterator[tuple[Path, Array]]:
        """The same candidates."""
        return self.of.candidates(index, chance)

    def target(self, index: Array, x: Path) -> Array:
        """The same p_hat."""
        return self.of.target(index, x)

    def contribution(self, index: Array, x: Path) -> Array:
        """The same F."""
        return self.of.contribution(index, x)

    def shift(self, x: Path, index: Array, to: Pixels) -> Shifted:
        """The same shift."""
        return self.of.shift(x, index, to)

    def propose(self, index: Array, x: FarPath, chance: Chance) -> tuple[FarPath, Array]:
        """x' with x_c moved, and T(x' -> x) / T(x -> x') (N,); at most two rays for each of the columns."""
        t, base, some = self.of.tracer, take(x, self.columns), Among(chance, self.columns, len(index))
        w, lobe, T = self._turned(base, some)
        asked = np.flatnonzero(T > 0)
        moved, J = land(t, take(base, asked), take(self.at, asked), w.take(asked, axis=-1), lobe.take(asked))
        columns = self.columns.take(asked)
        return _with_columns(x, columns, moved), _at(columns, T.take(asked) * J, len(index))

    def _turned(self, x: Path, chance: Chance) -> tuple[Array, Array, Array]:
        """Another direction from x_(c-1), the lobe that samples it, and the ratio of the step."""
        t, at, w = self.of.tracer, self.at, normalize(x.z - self.at.v.x)
        through = self.of.choice(t, at, x.lobe_in, w, chance)
        w_new, T = self.of.turn(t, at.v, through, w, chance)
        return w_new, self.of.choice(t, at, through, w_new, chance), T


Moved = dict[str, Any]
"""The fields of a path that a mutation changes."""


@dataclass(frozen=True)
class Landing:
    """x_c as a direction from x_(c-1) meets it: the vertex z, and its distance r (N,).

    p_all, A  density of the direction over all lobes, and of x_c per area by the lobe that samples it, (N,)
    T (C, N)  the throughput that arrives there
    """

    z: Vertex
    r: Array
    p_all: Array
    T: Array
    A: Array


def land(t: Tracer, x: FarPath, at: Place, w: Array, lobe: Array) -> tuple[Moved, Array]:
    """What x becomes if x_(c-1) sends it along w by `lobe`, and J (N,), 0 where that is no mutation of x."""
    s, table, space = t.scene, t.scene.materials, t.scene.space
    weight, p, p_all = mat.scatter_lobe(table, space, at.v, at.P, lobe, space.to_local(at.v.n, w))
    z, r, met = arrive(s, at.v.x, w)
    y = changed(x, z=z.x, prim=z.prim, lobe_in=lobe)
    rough = mat.lobe_roughness(table, at.v, lobe)
    legal = met & (p > 0) & connectable(t.rule, rough, roughness_of_z(t, y, z), r)
    to = Landing(z, r, p_all, at.T * weight, p * z.o[-1] / r ** (space.d - 1))
    z_x = vertex(s, x.z, x.prim, -normalize(x.z - at.v.x))
    at_light, by_light = x.c > x.k, x.nee & (x.c == x.k)
    kinds = [np.flatnonzero(legal & kind) for kind in (at_light, by_light, ~at_light & ~by_light)]
    order, ends = np.concatenate(kinds), np.cumsum([0, *map(len, kinds)])
    moved = {name: np.array(getattr(y, name)) for name in MOVED}
    J = np.zeros(len(r))
    for finish, (start, stop) in zip((_met, _lit, _joined), pairwise(ends), strict=True):
        if start < stop:
            columns = order[start:stop]
            found, J[columns] = finish(t, *take((y, to, z_x), columns))
            for name, values in found.items():
                moved[name][..., columns] = values
    return moved, J


MOVED = ("u", "z", "prim", "lobe_in", "out", "S", "p_light", "A", "F")


def _met(t: Tracer, y: FarPath, to: Landing, z_x: Vertex) -> tuple[Moved, Array]:
    """x_c is on the light: F, and no number follows from another."""
    leaf = hit_leaf(t, to.z, to.r, to.p_all)
    return {"F": to.T * leaf.end, "A": to.A, "p_light": leaf.p_light}, np.ones_like(to.r)


def _lit(t: Tracer, y: FarPath, to: Landing, z_x: Vertex) -> tuple[Moved, Array]:
    """Light sampling joins x_c to the light with the numbers that it has."""
    shares = mat.lobe_shares(t.scene.materials, to.z)
    leaf, out = light_leaf(t, to.z, shares, t.end_numbers(y))
    moved = {"F": to.T * leaf.end, "A": to.A, "p_light": leaf.p_light, "S": leaf.bare, "out": out}
    return moved, np.ones_like(to.r)


def _joined(t: Tracer, y: FarPath, to: Landing, z_x: Vertex) -> tuple[Moved, Array]:
    """x_c is joined to x_(c+1), where the path goes on as it did; J is what that does to the numbers of x_c."""
    s = t.scene
    before, after = join(t, y, z_x), join(t, y, to.z)
    J = ratio(after.A, before.A)
    asked = np.flatnonzero(J > 0)
    J[asked] = np.where(s.meets(*take((to.z.x, y.far_z, y.far_prim), asked)), J[asked], 0)
    last = y.c == y.k
    moved = {
        "u": _numbers_behind(t, y, before, after),
        "F": to.T * after.weight * after.E,
        "A": to.A * after.p,
        "S": np.where(last, emitted(s, after.far), after.E),
        "p_light": np.where(last, light_pdf(s, after.far, after.r), y.p_light),
        "out": after.w,
    }
    return moved, J


def _numbers_behind(t: Tracer, y: FarPath, before: "Join", after: "Join") -> Array:
    """u with the numbers of what leaves x_(c+1), which is seen from elsewhere now; the others know nothing of it."""
    u, through = np.array(y.u), (y.c < y.k) & ~(y.nee & (y.c + 1 == y.k))
    for c in np.unique(y.c[through]).tolist():
        columns = np.flatnonzero(through & (y.c == c))
        v, P_x, P_y, lobe, out = take((after.far, before.P, after.P, y.far_lobe, y.far_out), columns)
        number = t.lobe_number(u, c + 1)
        number[columns] = mat.choose_number(P_x, P_y, lobe, number.take(columns))
        t.direction_numbers(u, c + 1)[:, columns] = direction_number(t, v, lobe, out)
    return u


@dataclass(frozen=True)
class Join:
    """x_c joined to x_(c+1): direction w, distance r, f |cos| / p (C, N) and density p of it at x_c.

    far, P  the vertex x_(c+1) and its lobe shares
    A, E    density of x_(c+1) and of the direction leaving it, 0 at grazing angles, and what arrives from there, as in
            `shifts.reconnect`
    """

    w: Array
    r: Array
    weight: Array
    p: Array
    far: Vertex
    P: Array
    A: Array
    E: Array


def join(t: Tracer, x: FarPath, z: Vertex) -> Join:
    """Connect z = x_c to the path's x_(c+1), whatever stands between."""
    s, space = t.scene, t.scene.space
    to = x.far_z - z.x
    r = np.maximum(norm(to), 1e-300)
    w = to / r
    far = vertex(s, x.far_z, x.far_prim, -w)
    shares, local = mat.lobe_shares(s.materials, z), space.to_local(z.n, w)
    weight, p, p_all = mat.scatter_lobe(s.materials, space, z, shares, x.lobe_out, local)
    steep = np.minimum(np.abs(local[-1]), far.o[-1]) > GRAZING
    onward = changed(x, c=x.c + 1, lobe_out=x.far_lobe, out=x.far_out, S=x.far_S)
    p_out, E = beyond(t, onward, far, p_all, r)
    A = p * far.o[-1] / r ** (space.d - 1) * p_out * steep
    return Join(w, r, weight, p, far, mat.lobe_shares(s.materials, far), A, E)


# ---------------------------------------------------------------- columns


def _with_columns(x: Any, columns: Array, fresh: Mapping[str, Array]) -> Any:
    """x with these fields of some of its columns replaced."""

    def put(name: str, values: Array) -> Array:
        leaf = np.array(getattr(x, name))
        leaf[..., columns] = values
        return leaf

    return changed(x, **{name: put(name, values) for name, values in fresh.items()})


def _at(columns: Array, values: Array, N: int) -> Array:
    """values (n,) in columns of N, 0 elsewhere."""
    whole = np.zeros(N)
    whole[columns] = values
    return whole

"""A second reader of the golden paths, written from `docs/golden.md` alone, as one would write it for a GPU.

Scalar Python without NumPy, which shares no code with what wrote the files. `real` is the type of number that every
result is rounded to: `float`, or `numpy.float32`, which stays in single precision beside Python's own numbers. Vectors
are tuples; directions called o or i are local, w is one in the world. Comments name the page's sections.
"""

import math
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

Real = Any
Vector = tuple[Real, ...]


def dot(a: Vector, b: Vector) -> Real:
    return sum(x * y for x, y in zip(a, b, strict=True))


def along(x: Vector, t: Real, w: Vector) -> Vector:
    """x + t w."""
    return tuple(p + t * q for p, q in zip(x, w, strict=True))


def times(t: Real, a: Vector) -> Vector:
    return tuple(t * x for x in a)


def product(a: Vector, b: Vector) -> Vector:
    return tuple(x * y for x, y in zip(a, b, strict=True))


def across(*edges: Vector) -> Vector:
    """n with det(edges, n) > 0, not normalised."""
    if len(edges) == 1:
        ((x, y),) = edges
        return (-y, x)
    (a, b, c), (x, y, z) = edges
    return (b * z - c * y, c * x - a * z, a * y - b * x)


class Layer(NamedTuple):
    kind: str
    colour: Vector
    roughness: Real
    P: Real

    @property
    def alpha(self) -> Real:
        return self.roughness**2


class Facet(NamedTuple):
    corner: Vector
    edges: list[Vector]
    n: Vector
    size: Real


class Leaving(NamedTuple):
    """By which lobe and where to a path leaves a vertex, and `weight` = colour f_l cos / p."""

    lobe: int
    w: Vector
    p: Real
    p_all: Real
    weight: Vector


class Light(NamedTuple):
    """The light point y sampled at a vertex, its density (0: nothing arrives), its emission, and F / T of its leaf."""

    y: Vector
    p: Real
    emission: Vector
    value: Vector


@dataclass(frozen=True)
class Vertex:
    """A point x of a primitive; n, o, r and emission as seen from the vertex before; T; the numbers used here."""

    primitive: int
    x: Vector
    n: Vector
    o: Vector
    r: Real
    emission: Vector
    T: Vector = ()
    u: Vector = ()
    light: Light | None = None
    leaving: Leaving | None = None


class Leaf(NamedTuple):
    k: int
    nee: int

    @property
    def end(self) -> int:
        """The number of the last vertex, the light point of light sampling not counted."""
        return self.k + 1 - self.nee


Path = list[Vertex]


class Reader:
    """One scene of the file."""

    def __init__(self, d: int, scene: Any, real: Any):
        self.d, self.real, self.depth = d, real, scene["depth"]
        self.rule = [real(scene["rule"][key]) for key in ("roughness", "distance")]
        self.eyes = [
            [self.vector(scene["eyes"][key][i]) for key in ("start", "at")] for i in range(len(scene["eyes"]["at"]))
        ]
        materials = [self.material(x["layers"]) for x in scene["materials"]]
        self.black = times(real(0), materials[0][0].colour)
        self.one = tuple(1 + x for x in self.black)
        self.facets = [self.facet(*map(self.vector, x["corners"])) for x in scene["facets"]]
        self.balls = [(self.vector(x["centre"]), real(x["radius"])) for x in scene["balls"]]
        things = scene["facets"] + scene["balls"]
        self.layers = [materials[x["material"]] for x in things]
        self.emission = [self.vector(x.get("emission") or self.black) for x in things]
        self.walked: dict[tuple[int, Vector], Path] = {}
        self.share = self.shares([self.mean(e) * x.size for e, x in zip(self.emission, self.facets, strict=False)])

    def vector(self, a: Any) -> Vector:
        return tuple(map(self.real, a))

    def sqrt(self, x: Real) -> Real:
        return self.real(math.sqrt(max(x, 0)))

    def unit(self, a: Vector) -> Vector:
        return times(1 / self.sqrt(dot(a, a)), a)

    def mean(self, a: Vector) -> Real:
        return sum(a) / self.real(len(a))

    def shares(self, a: list[Real]) -> list[Real]:
        return [x / sum(a) for x in a]

    def choose(self, shares: list[Real], u: Real) -> int:
        below = self.real(0)
        for i, share in enumerate(shares):
            below = below + share
            if share and u < below:
                return i
        return max(i for i, share in enumerate(shares) if share)

    def material(self, layers: Any) -> list[Layer]:
        P = self.shares([self.real(x["weight"]) for x in layers])
        return [
            Layer(x["kind"], self.vector(x["colour"]), self.real(x["roughness"]), p)
            for x, p in zip(layers, P, strict=True)
        ]

    def facet(self, first: Vector, *others: Vector) -> Facet:
        edges = [along(x, -1, first) for x in others]
        n = across(*edges)
        size = self.sqrt(dot(n, n))
        return Facet(first, edges, times(1 / size, n), size / (self.d - 1))

    # Directions

    def tangents(self, n: Vector) -> list[Vector]:
        if self.d == 2:
            return [(n[1], -n[0])]
        s = self.real(math.copysign(1, n[2]))
        a = -1 / (s + n[2])
        b = n[0] * n[1] * a
        return [(1 + s * n[0] ** 2 * a, s * b, -s * n[0]), (b, s + n[1] ** 2 * a, -n[1])]

    def local(self, n: Vector, w: Vector) -> Vector:
        return tuple(dot(t, w) for t in [*self.tangents(n), n])

    def world(self, n: Vector, i: Vector) -> Vector:
        return tuple(dot(i, row) for row in zip(*self.tangents(n), n, strict=True))

    # Lobes

    def ball(self, u: Vector) -> Vector:
        a = tuple(2 * x - 1 for x in u)
        if self.d == 2:
            return a
        quarter = self.real(math.pi / 4)
        if abs(a[0]) > abs(a[1]):
            r, angle = a[0], quarter * a[1] / a[0]
        else:
            r, angle = a[1], 2 * quarter - quarter * a[0] / a[1]
        return r * self.real(math.cos(angle)), r * self.real(math.sin(angle))

    def visible(self, v: Vector, u: Vector) -> Vector:
        """m, a normal of the hemisphere seen from v."""
        if self.d == 2:
            a, b = (-1, v[1]) if v[0] >= 0 else (-v[1], 1)
            t = a + (b - a) * u[0]
            return along(times(t, (v[1], -v[0])), self.sqrt(1 - t**2), v)
        s = self.unit((-v[1], v[0], self.real(0)))
        q, (x, y) = (1 + v[2]) / 2, self.ball(u)
        y = (1 - q) * self.sqrt(1 - x**2) + q * y
        return along(along(times(x, s), y, across(v, s)), self.sqrt(1 - x**2 - y**2), v)

    def sample(self, l: Layer, o: Vector, u: Vector) -> Vector:
        if l.kind == "mirror":
            return (*times(-1, o[:-1]), o[-1])
        if l.kind == "lambert":
            return (*self.ball(u), self.sqrt(1 - dot(self.ball(u), self.ball(u))))
        m = self.visible(self.unit((*times(l.alpha, o[:-1]), o[-1])), u)
        h = self.unit((*times(l.alpha, m[:-1]), m[-1]))
        return along(times(-1, o), 2 * dot(o, h), h)

    def a(self, l: Layer, w: Vector) -> Real:
        return (w[-1] + self.sqrt(w[-1] ** 2 + l.alpha**2 * dot(w[:-1], w[:-1]))) / 2

    def density(self, l: Layer, o: Vector, i: Vector) -> Real:
        """p(i), 0 below the surface and for mirrors."""
        C = self.real(2 if self.d == 2 else math.pi)
        if l.kind == "mirror" or i[-1] <= 0:
            return self.real(0)
        if l.kind == "lambert":
            return i[-1] / C
        h = along(o, 1, i)
        b = l.alpha**2 * h[-1] ** 2 + dot(h[:-1], h[:-1])
        return l.alpha**2 * abs(dot(o, h) * dot(i, h)) / (C * self.a(l, o) * b * (b if self.d == 3 else self.sqrt(b)))

    def albedo(self, l: Layer, o: Vector, i: Vector) -> Vector:
        """colour f cos / p."""
        if l.kind != "ggx":
            return l.colour
        seen = self.a(l, o) * i[-1]
        return times(seen / (seen + (self.a(l, i) - i[-1]) * o[-1]), l.colour)

    def p_all(self, v: Vertex, i: Vector) -> Real:
        return sum(l.P * self.density(l, v.o, i) for l in self.layers[v.primitive])

    def leave(self, v: Vertex, lobe: int, w: Vector) -> Vertex:
        """v, left by that lobe in direction w; not at all if it has no such lobe, or w is below the surface."""
        layers, i = self.layers[v.primitive], self.local(v.n, w)
        if lobe >= len(layers) or i[-1] <= 0:
            return replace(v, leaving=None)
        l = layers[lobe]
        p_all = self.real(0) if l.kind == "mirror" else self.p_all(v, i)
        weight = times(1 / l.P, self.albedo(l, v.o, i))
        return replace(v, leaving=Leaving(lobe, w, l.P * self.density(l, v.o, i), p_all, weight))

    def scatter(self, v: Vertex, lobe: int, u: Vector) -> Vertex:
        return self.leave(v, lobe, self.world(v.n, self.sample(self.layers[v.primitive][lobe], v.o, u)))

    # Light sampling

    def p_light(self, x: Vertex) -> Real:
        """Density of light sampling for x, on the front of a light, in directions from the vertex before."""
        return self.share[x.primitive] / self.facets[x.primitive].size / self.geometry(x)

    def sample_light(self, v: Vertex) -> Vertex:
        u = v.u[self.d :]
        primitive = self.choose(self.share, u[0])
        y, edges, *_ = self.facets[primitive]
        for b, edge in zip(u[1:] if self.d == 2 else times(self.sqrt(u[1]), (1 - u[2], u[2])), edges, strict=True):
            y = along(y, b, edge)
        x, w = self.seen(v, primitive, y)
        i = self.local(v.n, w)
        q = self.p_all(v, i)
        if not any(x.emission) or not q or not self.reaches(v, x, w):
            return replace(v, light=Light(y, self.real(0), self.black, self.black))
        p, f = self.p_light(x), self.black
        for l in self.layers[v.primitive]:
            f = along(f, self.density(l, v.o, i), self.albedo(l, v.o, i))
        return replace(v, light=Light(y, p, x.emission, times(self.mis(p, q) / p, product(f, x.emission))))

    def mis(self, p: Real, q: Real) -> Real:
        return p / (p + q)

    # Rays

    def meets_facet(self, x: Vector, w: Vector, facet: Facet) -> Real:
        """The distance of what a ray meets, 0 for nothing."""
        if not (slope := dot(facet.n, w)):
            return self.real(0)
        t = dot(facet.n, along(facet.corner, -1, x)) / slope
        if t <= 0:
            return t
        at = along(along(x, t, w), -1, facet.corner)
        if self.d == 2:
            b = [dot(at, facet.edges[0]) / facet.size**2]
        else:
            b = [
                dot(across(*pair), facet.n) / (2 * facet.size) for pair in ((at, facet.edges[1]), (facet.edges[0], at))
            ]
        return t if min(b) >= 0 and sum(b) <= 1 else self.real(0)

    def meets_ball(self, x: Vector, w: Vector, ball: tuple[Vector, Real]) -> Real:
        towards = along(ball[0], -1, x)
        b = dot(towards, w)
        off = along(towards, -b, w)
        D = ball[1] ** 2 - dot(off, off)
        return b - self.sqrt(D) if D > 0 else D

    def meets(self, x: Vector, w: Vector, skip: tuple[int, ...]) -> list[tuple[Real, int]]:
        """Distances of what a ray meets, and primitives, but for those that it starts from or goes to."""
        each = [(self.meets_facet, facet) for facet in self.facets] + [(self.meets_ball, ball) for ball in self.balls]
        found = [(meets(x, w, shape), i) for i, (meets, shape) in enumerate(each) if i not in skip]
        return [(t, i) for t, i in found if t > 0]

    def reaches(self, v: Vertex, x: Vertex, w: Vector) -> bool:
        return all(t > x.r for t, _ in self.meets(v.x, w, (v.primitive, x.primitive)))

    def arrive(self, primitive: int, x: Vector, w: Vector, r: Real) -> Vertex:
        if primitive < len(self.facets):
            n = self.facets[primitive].n
        else:
            n = self.unit(along(x, -1, self.balls[primitive - len(self.facets)][0]))
        front = dot(n, w) < 0
        n = n if front else times(-1, n)
        return Vertex(
            primitive, x, n, self.local(n, times(-1, w)), r, self.emission[primitive] if front else self.black
        )

    def seen(self, v: Vertex, primitive: int, x: Vector) -> tuple[Vertex, Vector]:
        """The point x of a primitive as v sees it, and its direction."""
        w = along(x, -1, v.x)
        r = self.sqrt(dot(w, w))
        return self.arrive(primitive, x, times(1 / r, w), r), times(1 / r, w)

    def cast(self, x: Vector, w: Vector, skip: tuple[int, ...], T: Vector, u: Vector) -> Path:
        """The vertex that a ray from x arrives at, which will use the numbers u; none if it meets nothing."""
        return [replace(self.arrive(i, along(x, t, w), w, t), T=T, u=u) for t, i in sorted(self.meets(x, w, skip))[:1]]

    def onward(self, v: Vertex, u: Vector) -> Path:
        """The vertex after v."""
        if v.leaving is None:
            return []
        return self.cast(v.x, v.leaving.w, (v.primitive,), product(v.T, v.leaving.weight), u)

    def walk(self, pixel: int, numbers: Vector) -> Path:
        """The path of these numbers; it has less than depth + 1 vertices if it goes dark."""
        if (pixel, numbers) not in self.walked:
            self.walked[pixel, numbers] = self.trace(pixel, numbers)
        return self.walked[pixel, numbers]

    def trace(self, pixel: int, numbers: Vector) -> Path:
        start, at = self.eyes[pixel]
        u = [numbers[i : i + 2 * self.d] for i in range(0, len(numbers), 2 * self.d)]
        path, x = [], self.cast(start, self.unit(along(at, -1, start)), (), self.one, u[0])
        for i in range(self.depth):
            for v in x:
                lobe = self.choose([l.P for l in self.layers[v.primitive]], v.u[0])
                path.append(self.scatter(self.sample_light(v), lobe, v.u[1 : self.d]))
            x = self.onward(path[-1], u[i + 1] if i + 1 < len(u) else ()) if x else []
        return path + x

    # Leaves

    def F(self, path: Path, leaf: Leaf) -> Vector:
        if len(path) < leaf.end:
            return self.black
        x = path[leaf.end - 1]
        if leaf.nee:
            return product(x.T, x.light.value)
        factor = self.real(1)
        if leaf.k and path[leaf.k - 1].leaving.p and any(x.emission):
            factor = self.mis(self.p_bsdf(path[leaf.k - 1]), self.p_light(x))
        return times(factor, product(x.T, x.emission))

    def p_bsdf(self, v: Vertex) -> Real:
        return v.leaving.p_all

    # Connections

    def roughness(self, path: Path, i: int, leaf: Leaf) -> Real:
        """Of what leaves x_i."""
        if i == leaf.k + 1:
            return self.real(1)
        layers = self.layers[path[i - 1].primitive]
        if i < leaf.end:
            layers = [layers[path[i - 1].leaving.lobe]]
        return max(self.real(0) if l.kind == "mirror" else l.roughness for l in layers)

    def connect(self, path: Path, i: int, leaf: Leaf) -> bool:
        """Do x_i and x_(i+1)?"""
        rough = min(self.roughness(path, j, leaf) for j in (i, i + 1))
        return rough >= self.rule[0] and path[i].r >= self.rule[1]

    def c(self, path: Path, leaf: Leaf) -> int:
        pairs = range(1, leaf.end) if len(path) >= leaf.end else ()
        return next((i + 1 for i in pairs if self.connect(path, i, leaf)), 0)

    # Shifts

    def geometry(self, x: Vertex) -> Real:
        return x.o[-1] / x.r ** (self.d - 1)

    def A(self, path: Path, c: int, leaf: Leaf) -> Real:
        if c == 0:
            return self.real(1)
        p_out = path[c - 1].leaving.p if c < leaf.end else self.real(1)
        return path[c - 2].leaving.p * self.geometry(path[c - 1]) * p_out

    def carry(self, path: Path, T: Vector) -> Path:
        """The same vertices where T arrives at the first."""
        carried = []
        for x in path:
            carried.append(replace(x, T=T))
            T = product(T, x.leaving.weight) if x.leaving else T
        return carried

    def join(self, head: Path, path: Path, leaf: Leaf) -> Path:
        """`head`, and after it what `path` has there, joined by the lobes of `path`; [] if that cannot be."""
        c = len(head) + 1
        old = path[c - 1]
        y, w = self.seen(head[-1], old.primitive, old.x)
        v = self.leave(head[-1], path[c - 2].leaving.lobe, w)
        if v.leaving is None or not v.leaving.p or not self.reaches(v, y, w):
            return []
        y = replace(y, u=old.u)
        if c < leaf.end:
            y = self.leave(y, old.leaving.lobe, old.leaving.w)
            if y.leaving is None:
                return []
        elif leaf.nee:
            y = self.sample_light(y)
        return [*head[:-1], v, *self.carry([y, *path[c : leaf.end]], product(v.T, v.leaving.weight))]

    def shift(self, path: Path, leaf: Leaf, pixel: int) -> Path:
        """T x up to the leaf, [] if it is undefined."""
        c = self.c(path, leaf)
        y = self.walk(pixel, tuple(u for x in path for u in x.u))
        if c:
            y = self.join(y[: c - 1], path, leaf) if len(y) >= c - 1 else []
        return y[: leaf.end] if len(y) >= leaf.end and self.c(y, leaf) == c else []

    # Passes

    def m(self, i: int, p_hat: list[Real], whole: list[list[Real]], c: Vector) -> Real:
        """Pairwise MIS with confidences [GRIS Eq. 37], input 0 canonical; whole[i][j] = p_hat of y_i from j."""
        C = sum(c[1:])

        def ours(i: int, j: int) -> Real:
            return c[0] * p_hat[i] / (c[0] * p_hat[i] + C * whole[i][j])

        if i == 0:
            return sum(c[j] / C * ours(0, j) for j in range(1, len(c)))
        return c[i] / C * (1 - ours(i, i))

    # Differences

    def parts(self, d: Vector) -> list[tuple[Real, Real, Vector]]:
        """p_hat, share and contribution of the positive and of the negative part of d."""
        slack = self.mean(tuple(map(abs, d))) * self.real(0.1) if len(d) > 1 else self.real(0)
        both = [max(sign * self.mean(d), self.real(0)) + slack for sign in (1, -1)]
        shares = [x / sum(both) if x else self.real(0) for x in both]
        return [(x, share, times(share, d)) for x, share in zip(both, shares, strict=True)]

    def omega(self, here: Real, there: Real) -> Real:
        """w of p_hat of the base path, and of the offset path times J; 0/0 = 0."""
        return here / (here + there) if here else here

    def signed(self, omega: Real, gap: Vector, side: int) -> Vector:
        return times(omega if side == 0 else -omega, gap)

    def outer(self, A: Real, A_there: Real, J: Real, J_there: Real) -> Real:
        """J* of a pair from A of its base path and J of its offset path, here and there."""
        return A_there / A

    def both(self, positive: Vector, negative: Vector) -> Vector:
        """The difference, of the estimates of both parts."""
        return along(positive, 1, negative)

    # Mutations

    def mutate(self, path: Path, leaf: Leaf) -> tuple[Path, Real]:
        """The new path and T; T = 0 and a path up to x_c at most if it is rejected."""
        c = self.c(path, leaf)
        v = path[c - 2]
        u = v.u[1] + self.real(1 / 16)
        v = self.scatter(v, v.leaving.lobe, (u - 1 if u >= 1 else u, *v.u[2 : self.d]))
        new = [*path[: c - 2], v, *self.onward(v, path[c - 1].u)]
        if len(new) < c:
            return new, self.real(0)
        ratio = self.real(1)
        if c < leaf.end:
            joined = self.join(new, path, leaf)
            if not joined:
                return new, self.real(0)
            new = joined
            onward = self.A(new, c + 1, leaf)
            ratio = onward / self.A(path, c + 1, leaf) if onward else onward
        elif leaf.nee:
            new[-1] = self.sample_light(new[-1])
        return new, ratio if self.connect(new, c - 1, leaf) else self.real(0)

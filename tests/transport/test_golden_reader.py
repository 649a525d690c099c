"""The golden paths as one who has the page and the files only would port them: a second reader, and mistakes of his."""

import json
import math
from copy import copy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.transport.golden_reader import Reader, Vertex, across, along, dot, times
from tests.transport.golden_terms import terms

ROOT = Path(__file__).parents[2]
FILES = [json.loads((ROOT / world / "data" / "golden_paths.json").read_text()) for world in ("flatland2d", "tracer3d")]
SCENES = {f"{file['d']}d {scene['name']}": (file["d"], scene) for file in FILES for scene in file["scenes"]}
PRECISION = {"float64": float, "float32": np.float32}
GIVEN = {f"{place}.{field}" for place in ("pass", "differences") for field in ("mis", "canonical")}
GIVEN |= {"paths.leaves.k", "paths.leaves.nee"}


def flat(tree, name=""):
    """Leaves of nested mappings by their dotted names, in the order of the file."""
    if not isinstance(tree, dict):
        return {name: tree}
    return {key: x for k, sub in tree.items() for key, x in flat(sub, f"{name}.{k}" if name else k).items()}


def wanted(scene):
    """The terms of a file that are to be found; what holds no columns needs none."""
    return {name: want for name, want in flat(scene["expected"]).items() if name not in GIVEN and np.size(want)}


def wrong(reader, scene, precision):
    """Names of the terms that are out of tolerance, one after the other, and at last of those that were not read."""
    want, tolerance = wanted(scene), scene["tolerance"][precision]
    for name, got in terms(reader, scene):
        if not agrees(got, want.pop(name), tolerance.get(name, 0)):
            yield name
    yield from want


def agrees(got, want, tolerance):
    """|got - want| <= tolerance (|want| + mean |want|); exactly where there is no tolerance."""
    got, want = np.asarray(got, dtype=float), np.asarray(want, dtype=float)
    return got.shape == want.shape and bool(
        (np.abs(got - want) <= tolerance * (np.abs(want) + np.abs(want).mean())).all()
    )


@pytest.mark.parametrize("precision", PRECISION)
@pytest.mark.parametrize("scene", SCENES)
def test_a_reader_of_the_page_finds_what_the_files_say(scene, precision):
    d, golden = SCENES[scene]
    assert list(wrong(Reader(d, golden["scene"], PRECISION[precision]), golden, precision)) == []


@pytest.mark.parametrize("scene", SCENES)
def test_one_precision_less_is_noticed(scene):
    d, golden = SCENES[scene]
    assert any(wrong(Reader(d, golden["scene"], np.float32), golden, "float64"))
    with np.errstate(all="ignore"):
        assert any(wrong(Reader(d, golden["scene"], np.float16), golden, "float32"))


class Offsets(Reader):
    """Rays that start and end a little apart from primitives, and know none of them."""

    def meets(self, x, w, skip):
        return [(t, i) for t, i in super().meets(x, w, ()) if t > 1e-3]

    def reaches(self, v, x, w):
        return all(t > 0.999 * x.r for t, _ in self.meets(v.x, w, ()))


class Determinants(Reader):
    """[Möller, Trumbore 1997], Cramer's rule in the plane, and b² - 4 a c for balls."""

    def meets_facet(self, x, w, facet):
        (e, *others), a = facet.edges, along(x, -1, facet.corner)
        p = across(w, others[0]) if others else across(w)
        if not (det := dot(e, p)):
            return self.real(0)
        b = [dot(a, p) / det]
        if others:
            b.append(dot(w, across(a, e)) / det)
            t = dot(others[0], across(a, e)) / det
        else:
            t = dot(a, across(e)) / dot(w, across(times(-1, e)))
        return t if min(b) >= 0 and sum(b) <= 1 else self.real(0)

    def meets_ball(self, x, w, ball):
        a = along(x, -1, ball[0])
        b, c = 2 * dot(a, w), dot(a, a) - ball[1] ** 2
        D = b * b - 4 * dot(w, w) * c
        return (-b - self.sqrt(D)) / (2 * dot(w, w)) if D > 0 else D


IDIOMS = [Offsets, Determinants]


@pytest.mark.parametrize("idiom", IDIOMS)
@pytest.mark.parametrize("scene", [name for name, (_, golden) in SCENES.items() if golden["scene"]["balls"]])
def test_other_ways_to_meet_a_primitive_are_within_float32(scene, idiom):
    d, golden = SCENES[scene]
    assert list(wrong(idiom(d, golden["scene"], np.float32), golden, "float32")) == []


def but(**methods):
    """A reader with other methods."""
    return type("Mistaken", (Reader,), methods)


def jacobian(geometry):
    """Another cosine over distance in A; densities of lights stay right."""
    return but(
        geometry=geometry,
        p_light=lambda r, x: r.share[x.primitive] / r.facets[x.primitive].size / Reader.geometry(r, x),
    )


def in_A(factor):
    """A times `factor(reader, path, c, leaf)`, for c > 0."""

    def A(r, path, c, leaf):
        return Reader.A(r, path, c, leaf) * (factor(r, path, c, leaf) if c else 1)

    return but(A=A)


def p_out_by_all_lobes(r, path, c, leaf):
    return path[c - 1].leaving.p_all / path[c - 1].leaving.p if c < leaf.end else 1


def p_out(r, path, c, leaf):
    return path[c - 1].leaving.p if c < leaf.end else 1


def swapped(r, layers):
    right = Reader.material(r, layers)
    return [l._replace(P=other.P) for l, other in zip(right, right[::-1], strict=True)]


def polar(r, u):
    radius, angle = r.sqrt(u[0]), 2 * math.pi * u[-1]
    return Reader.ball(r, u) if r.d == 2 else (radius * r.real(math.cos(angle)), radius * r.real(math.sin(angle)))


def rough_enough_here(r, path, i, leaf):
    return r.roughness(path, i, leaf) >= r.rule[0] and path[i].r >= r.rule[1]


def ends_counted(r, path, i, leaf):
    """The roughness of the lobe that the sample chose, where light sampling leaves x_k."""
    return Reader.roughness(r, path, i, leaf._replace(k=leaf.k + 1) if leaf.nee else leaf)


def mirrors_rough(r, path, i, leaf):
    right = Reader.roughness(r, path, i, leaf)
    return right if right else r.real(1)


def talbot(r, i, p_hat, whole, c):
    q = [c[0] * p_hat[i], *(c[j] * whole[i][j] for j in range(1, len(c)))]
    return q[i] / sum(q)


def defensive(r, i, p_hat, whole, c):
    own = c[0] if i == 0 else 0
    return (own + sum(c[1:]) * Reader.m(r, i, p_hat, whole, c)) / sum(c)


def mutation(T):
    """Another T where the proposal is not rejected."""

    def mutate(r, path, leaf):
        new, right = Reader.mutate(r, path, leaf)
        return new, T(r, path, new, leaf, right) if right else right

    return but(mutate=mutate)


def one_vertex_early(r, path, new, leaf, T):
    c = r.c(path, leaf)
    return r.A(new, c, leaf) / r.A(path, c, leaf)


def as_it_was(r, head, path, leaf):
    """What leaves x_c is not evaluated again."""
    joined, c = Reader.join(r, head, path, leaf), len(head) + 1
    if not joined:
        return joined
    y = replace(joined[c - 1], leaving=path[c - 1].leaving, light=path[c - 1].light)
    return [*joined[: c - 1], *r.carry([y, *joined[c:]], y.T)]


def lobe_of_the_replay(r, head, path, leaf):
    was, now = path[len(head) - 1], head[-1].leaving
    was = replace(was, leaving=was.leaving._replace(lobe=now.lobe if now else was.leaving.lobe))
    return Reader.join(r, head, [*path[: len(head) - 1], was, *path[len(head) :]], leaf)


def through_walls(r, head, path, leaf):
    blind = copy(r)
    blind.__class__ = but(reaches=lambda r, v, x, w: True)
    return Reader.join(blind, head, path, leaf)


def both_sides(r, primitive, *ray):
    return replace(Reader.arrive(r, primitive, *ray), emission=r.emission[primitive])


def below_goes_up(r, l, o, u):
    """Directions below the surface are turned to its other side."""
    *t, up = Reader.sample(r, l, o, u)
    return (*t, abs(up))


def a_sky(r, x, w, skip, T, u):
    """What meets nothing meets something black far away."""
    far = [Vertex(0, along(x, 9, w), times(-1, w), r.local(times(-1, w), times(-1, w)), r.real(9), r.black, T, u)]
    return Reader.cast(r, x, w, skip, T, u) or far


def joined_to_a_light(r, path, new, leaf, T):
    """T of light sampling, as if the light point's numbers followed from another place."""
    c = r.c(path, leaf)
    before, after = (x[c - 1].light for x in (path, new))
    return before.p / after.p if leaf.nee and c == leaf.k and after.p else T


def dark_is_refused(r, path, new, leaf, T):
    return T if any(r.F(new, leaf)) else r.real(0)


def light_kept(r, path, leaf):
    """F of light sampling is not evaluated again at the new x_c."""
    new, T = Reader.mutate(r, path, leaf)
    if T and leaf.nee and r.c(path, leaf) == leaf.k:
        new = [*new[:-1], replace(new[-1], light=path[leaf.k - 1].light)]
    return new, T


def by_the_mean_alone(r, d):
    """A coloured difference belongs to the sign of its mean, all of it."""
    both = [max(sign * r.mean(d), r.real(0)) for sign in (1, -1)]
    return [(x, r.real(int(x > 0)), times(r.real(int(x > 0)), d)) for x in both]


# A mistake, a scene, and the first term there that it spoils.
MISTAKES = {
    "tangents turned": (
        but(tangents=lambda r, n: [times(-1, t) for t in Reader.tangents(r, n)]),
        "3d glossy",
        "paths.vertices.x",
    ),
    "discs by radius and angle": (but(ball=polar), "3d glossy", "paths.vertices.x"),
    "weights of lobes swapped": (but(material=swapped), "3d glossy", "paths.vertices.x"),
    "no masking": (but(albedo=lambda r, l, o, i: l.colour), "3d glossy", "paths.vertices.T"),
    "lights chosen by size": (but(mean=lambda r, a: r.real(int(any(a)))), "3d glossy", "paths.lights.y"),
    "backs that emit": (but(arrive=both_sides), "3d glossy", "paths.lights.arrives"),
    "light density without cosine": (
        but(p_light=lambda r, x: Reader.p_light(r, x) * x.o[-1]),
        "3d glossy",
        "paths.lights.p",
    ),
    "MIS with the chosen lobe": (but(p_bsdf=lambda r, v: v.leaving.p), "2d glossy", "paths.leaves.F"),
    "power heuristic": (but(mis=lambda r, p, q: p * p / (p * p + q * q)), "3d glossy", "paths.leaves.F"),
    "roughness of one end": (but(connect=rough_enough_here), "3d glossy", "paths.leaves.c"),
    "roughness of the sampled lobe": (but(roughness=ends_counted), "2d glossy", "paths.leaves.c"),
    "mirrors connect": (but(roughness=mirrors_rough), "3d mirror ball", "paths.leaves.c"),
    "cosine left out of J": (jacobian(lambda r, x: 1 / x.r ** (r.d - 1)), "3d glossy", "shifts.record.A"),
    "distance to the power d": (jacobian(lambda r, x: x.o[-1] / x.r**r.d), "3d glossy", "shifts.record.A"),
    "p_out left out of J": (in_A(lambda r, *x: 1 / p_out(r, *x)), "3d glossy", "shifts.record.A"),
    "p_out of all lobes in J": (in_A(p_out_by_all_lobes), "3d glossy", "shifts.record.A"),
    "joined through walls": (but(join=through_walls), "2d matte", "shifts.defined"),
    "joined by the lobe of the replay": (but(join=lobe_of_the_replay), "2d mirror ball", "shifts.defined"),
    "x_c not evaluated again": (but(join=as_it_was), "3d mirror ball", "shifts.J"),
    "Talbot MIS": (but(m=talbot), "3d glossy", "pass.w"),
    "defensive MIS": (but(m=defensive), "3d glossy", "pass.w"),
    "no confidences": (but(m=lambda r, i, p, q, c: Reader.m(r, i, p, q, r.vector((1, 1, 1)))), "3d glossy", "pass.w"),
    "T left out": (mutation(lambda r, *x: r.real(1)), "3d glossy", "mutations.T"),
    "T upside down": (mutation(lambda r, path, new, leaf, T: 1 / T), "3d glossy", "mutations.T"),
    "T of the vertex before": (mutation(one_vertex_early), "3d glossy", "mutations.T"),
    "T of light sampling": (mutation(joined_to_a_light), "3d glossy", "mutations.T"),
    "mutations into shadow refused": (mutation(dark_is_refused), "2d open", "mutations.T"),
    "light of the old x_c kept": (but(mutate=light_kept), "3d glossy", "mutations.F"),
    "directions below the surface turned up": (but(sample=below_goes_up), "3d glossy", "dark.vertices"),
    "a vertex where a ray meets nothing": (but(cast=a_sky), "2d open", "dark.vertices"),
    "half weights": (but(omega=lambda r, here, there: r.real(0.5)), "2d mirror ball", "pairs.omega"),
    "weight of the offset path": (
        but(omega=lambda r, here, there: Reader.omega(r, there, here)),
        "3d glossy",
        "pairs.omega",
    ),
    "colour by the sign of its mean": (but(parts=by_the_mean_alone), "3d glossy", "pairs.p_hat"),
    "parts of the other sign": (but(parts=lambda r, d: Reader.parts(r, d)[::-1]), "2d glossy", "pairs.p_hat"),
    "whole differences in both parts": (
        but(parts=lambda r, d: [(x, share, d) for x, share, _ in Reader.parts(r, d)]),
        "2d glossy",
        "pairs.contribution",
    ),
    "no sign for the second pixel's base paths": (
        but(signed=lambda r, omega, gap, side: times(omega, gap)),
        "2d glossy",
        "differences.signed",
    ),
    "inner Jacobian in J*": (
        but(outer=lambda r, A, A_there, J, J_there: A_there / A * (J or 1)),
        "3d glossy",
        "differences.J",
    ),
    "J* upside down": (but(outer=lambda r, A, A_there, J, J_there: A / A_there), "3d glossy", "differences.J"),
    "parts subtracted once more": (
        but(both=lambda r, positive, negative: along(positive, -1, negative)),
        "3d glossy",
        "differences.difference",
    ),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_mistakes_of_a_port_are_found_where_they_are_made(mistake):
    reader, scene, first = MISTAKES[mistake]
    d, golden = SCENES[scene]
    assert next(wrong(reader(d, golden["scene"], float), golden, "float32"), None) == first

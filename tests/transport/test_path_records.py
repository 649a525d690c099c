"""Records of paths: their factors, their lobes, where they reconnect, and what a shift keeps of them."""

from collections.abc import Callable
from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from flatland2d import PLANE, SCENES, Pinhole
from flatland2d.scenes import chain, matte
from restir_ref import Pixels
from restir_ref.batch import Array, ratio, take
from restir_ref.transport.materials import Layer, Material
from restir_ref.transport.paths import RECONNECTION, Connectability, Path, Tracer, first_hit, leaves, trace
from restir_ref.transport.proofs.copies import COPIES, Copying
from restir_ref.transport.proofs.inversion import traced
from restir_ref.transport.proofs.reading import (
    ALL,
    ExtendedPath,
    Factors,
    contribution,
    density,
    extended_path,
    factors,
    leaf_path,
    offset_path,
    throughput,
)
from restir_ref.transport.rays import GRAZING
from restir_ref.transport.restir_pt import PathIntegrals, ReconnectionAtX2
from restir_ref.transport.scene import Scene
from restir_ref.transport.scene import scene as compiled
from restir_ref.transport.shifts import shift_path
from restir_ref.transport.vectors import normalize
from tests.tracer3d.views import film_shifts
from tests.transport.furnished import FURNISHED, furnished_shifts
from tests.transport.paths import HYBRID, RULES, Shifts, retraced, shifts, successful
from tracer3d.scenes import Setting, cornell_box
from tracer3d.scenes import matte as solid_matte

every_scene = pytest.mark.parametrize("scene", SCENES)
every_rule = pytest.mark.parametrize("rule", RULES)

# ---------------------------------------------------------------- factors


def tracer(scene: str) -> Tracer:
    setting = SCENES[scene]()
    return Tracer(setting.scene, setting.pinhole(1920, 0), setting.depth, HYBRID)


def product_errors(t: Tracer, N: int, seed: int, evaluate: Callable[[Tracer, ExtendedPath], Factors]) -> Array:
    """|product of the recorded factors / F - 1| over all leaves of N trees that carry light, not at grazing angles."""
    rng = np.random.default_rng(seed)
    pixel, found = rng.integers(t.sensor.n, size=N), []
    tree = trace(t, rng.random((t.D, N)), pixel)
    for k, nee, F in leaves(tree):
        x = leaf_path(t, tree, pixel, np.full(N, k), np.full(N, nee))
        of = evaluate(t, x)
        lit = F.all(axis=0) & (of.cos[k + 1] > 10 * GRAZING)
        found.append(np.abs(ratio(ratio(contribution(x, of), density(of)), F) - 1)[:, lit].max(axis=0))
    return np.concatenate(found)


@pytest.mark.claims("COM-A05")
@every_scene
def test_the_recorded_factors_multiply_to_the_contribution_of_every_leaf(scene) -> None:
    errors = product_errors(tracer(scene), 1000, 41, factors)
    assert len(errors) > 30
    assert errors.max() < 1e-12


@pytest.mark.claims("COM-A05")
@pytest.mark.parametrize("name", FURNISHED)
def test_recorded_factors_know_no_dimension(name) -> None:
    assert product_errors(furnished_shifts(name, HYBRID, 1, 0).t, 1000, 42, factors).max() < 1e-12


@pytest.mark.claims("COM-A05")
def test_factors_whose_density_lacks_the_lobe_s_probability_do_not_multiply_to_it() -> None:
    def forgetful(t: Tracer, x: ExtendedPath) -> Factors:
        right = factors(t, x)
        return replace(right, p=right.p / right.P)

    assert np.quantile(product_errors(tracer("clear_coat"), 500, 41, forgetful), 0.75) > 0.1


@pytest.mark.claims("COM-A05")
@every_scene
def test_the_recorded_throughput_is_that_of_the_tree(scene) -> None:
    t, rng = tracer(scene), np.random.default_rng(43)
    pixel = rng.integers(1920, size=500)
    tree = trace(t, rng.random((t.D, 500)), pixel)
    x = leaf_path(t, tree, pixel, np.full(500, t.depth), np.full(500, False))
    whole = np.flatnonzero(x.seen.all(axis=0))
    T = throughput(factors(t, x))[..., whole]
    assert all(np.abs(T[i] / tree.T[i][:, whole] - 1).max(initial=0) < 1e-12 for i in range(t.depth + 1))


# ---------------------------------------------------------------- sums over lobes


def scattered_geometry(scene: str, k: int) -> tuple[Tracer, ExtendedPath]:
    """Traced paths over k scattering vertices that see each other; where they end does not matter here."""
    t, rng, N = tracer(scene), np.random.default_rng(44), 1000
    x = extended_path(t, rng.random((t.D, N)), rng.integers(1920, size=N), np.full(N, k), np.full(N, False))
    return t, take(x, np.flatnonzero(x.seen.all(axis=0)))


def scattering(t: Tracer, x: ExtendedPath, lobes: tuple[int, ...]) -> Array:
    """f_1 .. f_k with the given lobes at x_1 .. x_k, not weighted by any omega or p."""
    lobe = x.lobe.copy()
    for i, l in enumerate(lobes, start=1):
        lobe[i] = l
    return np.asarray(factors(t, replace(x, lobe=lobe)).f[: len(lobes) + 1].prod(axis=0))


def lobe_sum_errors(scene: str, k: int, last: tuple[int, ...], lobes: range) -> Array:
    """|sum of f_l over all sequences of lobes / f - 1|, where f evaluates all lobes at every vertex.

    `last` are the lobes of x_k that the sequences take, none or ALL for light sampling.
    """
    t, x = scattered_geometry(scene, k)
    f = scattering(t, x, (ALL,) * k)
    found = sum(scattering(t, x, (*l, *last)) for l in product(lobes, repeat=k - len(last)))
    return np.abs(ratio(found, f) - 1)[f > 0]


@pytest.mark.claims("GRIS-E50")
@pytest.mark.parametrize("last", [(), (ALL,)], ids=["BSDF", "NEE"])
@pytest.mark.parametrize("k", [1, 2, 3])
@pytest.mark.parametrize("scene", ["clear_coat", "glossy_cornell"])
def test_contributions_of_all_lobe_sequences_sum_to_the_contribution(scene, k, last) -> None:
    errors = lobe_sum_errors(scene, k, last, range(2))
    assert len(errors) > 500
    assert errors.max() < 1e-12


@pytest.mark.claims("GRIS-E50")
def test_a_sum_that_misses_a_lobe_is_noticed() -> None:
    assert np.quantile(lobe_sum_errors("clear_coat", 3, (), range(1)), 0.75) > 0.01


# ---------------------------------------------------------------- where an offset path begins and ends

SHIFTS = {
    "hybrid": lambda t: PathIntegrals(replace(t, rule=HYBRID)),
    "reconnection": lambda t: PathIntegrals(replace(t, rule=RECONNECTION)),
    "replay": lambda t: PathIntegrals(replace(t, rule=RULES["replay"])),
    "reconnection at x_2": lambda t: ReconnectionAtX2(replace(t, rule=RECONNECTION)),
    **{name: lambda t, copy=copy: Copying(replace(t, rule=HYBRID), copy) for name, copy in COPIES.items()},
}
every_shift = pytest.mark.parametrize("shift", SHIFTS)


def offsets(scene: str, shift: str) -> tuple[Tracer, Path, Array, Path, Array]:
    """Base paths x of random pixels, and their offset paths y in pixels j: only those defined."""
    t, rng, N = tracer(scene), np.random.default_rng(45), 1500
    of = SHIFTS[shift](t)
    i, k = rng.integers(20, 1900, N), rng.integers(1, t.depth + 1, N)
    j = i + rng.integers(1, 20, N)
    x = traced(of.tracer, rng.random((t.D, N)), i, k, rng.random(N) < 0.5)
    y = of.shift(x, i, Pixels(of, j))
    return of.tracer, *take((x, i, y.x, j), np.flatnonzero((y.J > 0) & x.F.any(axis=0)))


def seen_by(view: Pinhole, x: Array) -> Array:
    """The pixel of the film onto which a point projects: the inverse of `Pinhole.ray`."""
    forward = normalize(np.subtract(view.towards, view.eye)[:, None])[:, 0]
    to = x - np.array(view.eye)[:, None]
    slope = (forward[1] * to[0] - forward[0] * to[1]) / (forward @ to)
    return np.floor((slope / view.half + 1) / 2 * view.film).astype(int) - view.first


@pytest.mark.claims("GRIS-E48")
@every_shift
@every_scene
def test_an_offset_path_s_first_vertex_lies_in_its_pixel(scene, shift) -> None:
    t, _, _, y, j = offsets(scene, shift)
    v, _, _ = first_hit(t, y.u, j)
    assert len(j) > 10
    assert (seen_by(t.sensor, v.x) == j).all()
    assert t.scene.visible(np.repeat(np.array(t.sensor.eye)[:, None], len(j), axis=1), v.x).all()


@pytest.mark.claims("GRIS-E48")
@every_shift
@every_scene
def test_the_suffix_after_a_reconnection_is_bitwise_that_of_the_base_path(scene, shift) -> None:
    _, x, _, y, _ = offsets(scene, shift)
    connected = np.flatnonzero(x.c > 0)
    for name in ("k", "nee", "c", "z", "prim", "lobe_out", "out", "S", "p_light"):
        a, b = (getattr(path, name).take(connected, axis=-1) for path in (x, y))
        assert a.tobytes() == b.tobytes(), name


@pytest.mark.claims("GRIS-E48")
@pytest.mark.parametrize("rule", ["hybrid", "reconnection"])
@every_scene
def test_an_offset_path_traced_from_scratch_meets_the_base_path_again(scene, rule) -> None:
    """Its own numbers lead it from its pixel to x_c, and then over the base path's vertices."""
    s = successful(shifts(SCENES[scene](), RULES[rule], 1000, seed=46))
    u, _ = retraced(s)
    base, again = (extended_path(s.t, n, at, s.x.k, s.x.nee) for n, at in ((s.x.u, s.i), (u, s.j)))
    assert (seen_by(s.t.sensor, again.x[1]) == s.j).all()
    behind = (np.arange(len(base.x))[:, None] >= s.x.c) & (s.x.c > 0) & (np.arange(len(base.x))[:, None] <= s.x.k + 1)
    apart = np.abs(base.x - again.x).max(axis=1)[behind]
    assert (apart > 1e-6).mean() <= 1e-3
    told = offset_path(s.t, base, s.x.c, s.j)
    assert (np.nan_to_num(told.x[1]) == np.nan_to_num(again.x[1])).all()


@pytest.mark.claims("GRIS-E48")
def test_a_shift_that_stays_in_its_pixel_is_noticed() -> None:
    t, x, i, _, j = offsets("cornell", "hybrid")
    y, _ = shift_path(t, x, i)
    assert (seen_by(t.sensor, first_hit(t, y.u, j)[0].x) == j).all()
    assert not (seen_by(t.sensor, first_hit(t, y.u, i)[0].x) == j).any()


# ---------------------------------------------------------------- lobes judge

COAT, BASE = 0.1, 1.0
"""Roughness of the clear coat and of Lambert lobes, from the scene's definition."""


def coated_box() -> Setting:
    """The Cornell box in space whose left wall is like the floor of `clear_coat`; all else has one lobe."""
    coat = Material([Layer("lambert", (0.5,) * 3, weight=0.6), Layer("ggx", (0.3,) * 3, COAT, weight=0.4)])
    return cornell_box([solid_matte((0.5,) * 3), coat, solid_matte((0.1, 0.4, 0.1)), solid_matte((0.6,) * 3)])


Judge = Callable[[Scene, Path, ExtendedPath, int, int], float]
"""Roughness of x_i of column n."""


def lobe_at(t: Tracer, x: Path, on: ExtendedPath, n: int, i: int) -> int:
    """The floor, or the wall, (material 1) has a base of share .6 and a coat; all else has one lobe."""
    coated = t.scene.material[on.prim[i, n]] == 1
    return int(coated and t.lobe_number(x.u, i)[n] >= 0.6)


def by_the_rules(t: Tracer, x: Path, on: ExtendedPath, n: int, i: int) -> float:
    """The sampled lobe's roughness, the roughest one before light sampling, 1 on lights.  [GRIS 7.6]"""
    if i == x.k[n] + 1 or (x.nee[n] and i == x.k[n]):
        return BASE
    return (BASE, COAT)[lobe_at(t, x, on, n, i)]


def light_sampling_by_its_lobe(t: Tracer, x: Path, on: ExtendedPath, n: int, i: int) -> float:
    """A mistake: the last vertex before light sampling is judged by a lobe that it never sampled."""
    return BASE if i == x.k[n] + 1 else (BASE, COAT)[lobe_at(t, x, on, n, i)]


def by_the_roughest(t: Tracer, x: Path, on: ExtendedPath, n: int, i: int) -> float:
    """A mistake: every vertex is judged by its roughest lobe."""
    return BASE


def by_the_smoothest(t: Tracer, x: Path, on: ExtendedPath, n: int, i: int) -> float:
    """A mistake: every vertex of the floor is judged by its coat."""
    return (BASE, COAT)[int(i <= x.k[n] and t.scene.material[on.prim[i, n]] == 1)]


def verdicts(t: Tracer, x: Path, on: ExtendedPath, judge: Judge) -> list[tuple[int, int, int]]:
    """c, and the lobes at x_(c-1) and x_c, path by path."""
    found = []
    for n in range(len(x.k)):
        k, ends_by_light = int(x.k[n]), bool(x.nee[n])
        rough = [0.0] + [judge(t, x, on, n, i) for i in range(1, k + 2)]
        far = [np.linalg.norm(on.x[i, :, n] - on.x[i - 1, :, n]) >= t.rule.distance for i in range(1, k + 2)]
        pairs = [i for i in range(2, k + 2 - ends_by_light) if far[i - 1]]
        c = next((i for i in pairs if min(rough[i - 1], rough[i]) >= t.rule.roughness), 0)
        onward = 0 < c <= k and not (ends_by_light and c == k)
        found.append((c, lobe_at(t, x, on, n, c - 1) if c else 0, lobe_at(t, x, on, n, c) if onward else 0))
    return found


COATED: dict[str, Callable[[str, int, int], Shifts]] = {
    "floor": lambda rule, N, seed: shifts(SCENES["clear_coat"](), RULES[rule], N, seed, reach=400),
    "wall in space": lambda rule, N, seed: film_shifts(coated_box(), RULES[rule], N, seed),
}
"""Shifts that often lead to another material."""
every_coat = pytest.mark.parametrize("where", COATED)


def clear_coat(rule: str, where: str) -> tuple[Shifts, ExtendedPath]:
    s = COATED[where](rule, 1500, 47)
    return s, extended_path(s.t, s.x.u, s.i, s.x.k, s.x.nee)


def recorded(x: Path) -> list[tuple[int, int, int]]:
    """The same of the record; where nothing reconnects no lobe is kept."""
    lobe_in = np.where(x.c > 0, x.lobe_in, 0)
    return list(zip(x.c.tolist(), lobe_in.tolist(), x.lobe_out.tolist(), strict=True))


@pytest.mark.claims("GRIS-A13")
@pytest.mark.claims("GRIS-A13", world="tracer3d")
@every_coat
@pytest.mark.parametrize("rule", ["hybrid", "reconnection"])
def test_lobes_and_the_reconnection_index_follow_the_rules(rule, where) -> None:
    s, on = clear_coat(rule, where)
    assert recorded(s.x) == verdicts(s.t, s.x, on, by_the_rules)
    assert {c for c, _, _ in recorded(s.x)} >= {"hybrid": {0, 2, 3}, "reconnection": {0, 2}}[rule]


@pytest.mark.claims("GRIS-A13")
@pytest.mark.claims("GRIS-A13", world="tracer3d")
@every_coat
@pytest.mark.parametrize("wrong", [light_sampling_by_its_lobe, by_the_roughest, by_the_smoothest])
def test_other_rules_are_noticed(wrong, where) -> None:
    s, on = clear_coat("hybrid", where)
    differ = [a != b for a, b in zip(recorded(s.x), verdicts(s.t, s.x, on, wrong), strict=True)]
    assert np.mean(differ) > 0.02


@pytest.mark.claims("GRIS-A13")
@pytest.mark.claims("GRIS-A13", world="tracer3d")
@every_coat
@pytest.mark.parametrize("rule", ["hybrid", "reconnection"])
def test_a_reconnection_takes_over_the_base_path_s_lobe(rule, where) -> None:
    """Also where the offset vertex, on another material, would have chosen another lobe by its number."""
    s = successful(COATED[where](rule, 3000, 49))
    c = np.flatnonzero(s.x.c > 0)
    assert (s.y.lobe_in[c] == s.x.lobe_in[c]).all()
    assert (s.y.lobe_out[c] == s.x.lobe_out[c]).all()
    _, again = retraced(s)
    assert (again.lobe_in[c] == s.x.lobe_in[c]).all()
    own = extended_path(s.t, s.x.u, s.j, s.x.k, s.x.nee).lobe[np.maximum(s.x.c - 1, 0), np.arange(len(s.J))]
    assert (own[c] != s.x.lobe_in[c]).any()


# ---------------------------------------------------------------- the path of Fig. 5

GLOSSY = Material([Layer("ggx", (0.9,), 0.1)])


def two_mirrors() -> Tracer:
    """A long room: what the eye sees on the floor mirrors the ceiling, which mirrors a rough part of the floor."""
    floor = [*chain([(0.0, 0), (1.5, 0)], 1), *chain([(1.5, 0), (4, 0)], 0)]
    ceiling = [*chain([(4, 1), (2.5, 1)], 0), *chain([(2.5, 1), (0.0, 1)], 1)]
    walls = [*chain([(4, 0), (4, 1)], 0), *chain([(0.0, 1), (0.0, 0)], 0)]
    lamp = chain([(3.9, 0.99), (3.5, 0.99)], 0, 10.0)
    s = compiled(PLANE, [matte(0.7), GLOSSY], [*floor, *ceiling, *walls, *lamp])
    return Tracer(s, Pinhole((0.1, 0.9), (1.0, 0.0), 1920, 0.1, 0), 5, HYBRID)


def glossy_glossy_rough_rough(t: Tracer) -> tuple[Path, Array, ExtendedPath]:
    """Paths whose x_1 and x_2 are glossy and whose x_3 and x_4 are not, pixels, and their vertices."""
    rng, N = np.random.default_rng(48), 3000
    pixel, k = rng.integers(100, 1820, N), rng.integers(4, 6, N)
    x = traced(t, rng.random((t.D, N)), pixel, k, rng.random(N) < 0.7)
    on = extended_path(t, x.u, pixel, x.k, x.nee)
    glossy = t.scene.material[on.prim[1:5]] == 1
    wanted = glossy[0] & glossy[1] & ~glossy[2] & ~glossy[3] & x.F.any(axis=0)
    far = np.linalg.norm(on.x[4] - on.x[3], axis=0) >= t.rule.distance
    return take((x, pixel, on), np.flatnonzero(wanted & far))


@pytest.mark.claims("GRIS-F05")
def test_two_glossy_and_two_rough_vertices_reconnect_at_the_fourth() -> None:
    t = two_mirrors()
    x, pixel, on = glossy_glossy_rough_rough(t)
    assert len(pixel) > 100
    assert (x.c == 4).all()
    y, J = shift_path(t, x, pixel + 10)
    moved = offset_path(t, on, x.c, pixel + 10)
    defined = J > 0
    assert defined.mean() > 0.3
    assert (np.abs(moved.x[1:4] - on.x[1:4]).max(axis=1)[:, defined] > 0).all()
    assert (moved.x[4] == on.x[4]).all()
    assert (y.z == on.x[4]).all()


@pytest.mark.claims("GRIS-F05")
@pytest.mark.parametrize("rule", [RECONNECTION, Connectability(0.05, 0.02)])
def test_without_a_condition_on_roughness_the_second_vertex_reconnects(rule) -> None:
    x, _, _ = glossy_glossy_rough_rough(replace(two_mirrors(), rule=rule))
    assert (x.c == 2).all()

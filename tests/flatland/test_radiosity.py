"""Radiosity against closed forms, against rays, against itself refined, and path tracing against it."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from figures.experiments.references import reference
from flatland2d import PLANE, SCENES, Pinhole, radiosity
from flatland2d.radiosity import cut, gather, render, shares
from flatland2d.scenes import FURNACE_ALBEDO, INSET, LAMP, Setting, chain, matte, room
from restir_ref.batch import Array
from restir_ref.transport import paths
from restir_ref.transport.materials import Layer, Material
from restir_ref.transport.paths import RECONNECTION, Tracer, trace
from restir_ref.transport.scene import Facet, Scene
from restir_ref.transport.scene import scene as compiled
from restir_ref.transport.vectors import dot, norm

LAMBERT = ("matte_cornell", "ajar", "crease", "occluders", "checker", "rack")
every_scene = pytest.mark.parametrize("scene", LAMBERT)


def truncated_furnace(bounces: int) -> float:
    """L_e (1 + a + .. + a^bounces)."""
    return (1 - FURNACE_ALBEDO ** (bounces + 1)) / (1 - FURNACE_ALBEDO)


def points(scene: Scene, count: int, seed: int = 1) -> tuple[Array, Array]:
    """Points at random on fronts of segments, and their normals."""
    rng = np.random.default_rng(seed)
    prim, t = rng.integers(scene.S, size=count), rng.random(count)
    a, b = (corner.take(prim, axis=-1) for corner in scene.corners)
    return a + t * (b - a), scene.normals.take(prim, axis=-1)


# ---------------------------------------------------------------- what is seen


@every_scene
def test_what_points_see_of_all_panels_is_everything(scene) -> None:
    """The rooms are closed."""
    s = SCENES[scene]().scene
    assert shares(s, cut(s, 12), *points(s, 200)).sum(axis=1) == pytest.approx(1, abs=1e-9)


RAYS = 20_000


def met_share(scene: Scene, prims: Array, x: Array, n: Array) -> Array:
    """Share of RAYS evenly spread sines from the point x that meet the front of each primitive."""
    s = (np.arange(RAYS) + 0.5) / RAYS * 2 - 1
    w = scene.space.to_world(n, np.stack([s, np.sqrt(1 - s**2)]))
    _, prim = scene.intersect(np.repeat(x, RAYS, axis=1), w)
    front = dot(scene.normals.take(prim, axis=-1), w) < 0
    return np.bincount(prim[front], minlength=scene.S)[prims] / RAYS


@every_scene
def test_what_is_seen_of_a_segment_is_what_rays_meet(scene) -> None:
    s, count = SCENES[scene]().scene, 5
    x, n = points(s, 20, seed=2)
    fronts = shares(s, cut(s, count), x, n)[:, : s.S * count].reshape(-1, s.S, count).sum(axis=2)
    by_rays = [met_share(s, np.arange(s.S), x[:, [k]], n[:, [k]]) for k in range(20)]
    assert np.abs(fronts - by_rays).max() < 2 * s.S / RAYS


def crossed_strings(a: Array, b: Array, c: Array, d: Array) -> Array:
    """F |ab| = (|ac| + |bd| - |ad| - |bc|) / 2 for panels that see each other wholly, a and c being on the right."""
    return np.asarray(norm(a - c) + norm(b - d) - norm(a - d) - norm(b - c)) / 2


def test_shares_averaged_over_a_panel_are_its_form_factors_by_crossed_strings() -> None:
    s = SCENES["furnace"]().scene
    p = cut(s, 6)
    node, weight = np.polynomial.legendre.leggauss(40)
    i, j = 3, np.flatnonzero((p.emission > 0) & (p.prim > 0))
    x = (p.a + p.b)[:, [i]] / 2 + node * (p.b - p.a)[:, [i]] / 2
    mean = weight @ shares(s, p, x, np.repeat(p.n[:, [i]], 40, axis=1))[:, j] / 2
    by_strings = crossed_strings(p.a[:, [i]], p.b[:, [i]], p.a[:, j], p.b[:, j]) / norm(p.b - p.a)[i]
    assert mean == pytest.approx(by_strings, abs=1e-6)


def test_a_furnace_has_its_closed_form() -> None:
    setting = SCENES["furnace"]()
    image = render(setting.scene, setting.pinhole(4), setting.depth, per_segment=16, film=4)
    assert image == pytest.approx(truncated_furnace(setting.depth), rel=1e-12)


def inside(sensor: Pinhole, materials: list[Material], *facets: Facet) -> Array:
    """A room of the first material with these facets, seen by `sensor`."""
    return render(compiled(PLANE, materials, [*room(0), *facets]), sensor, 3, per_segment=8, film=2)


ABOVE = Pinhole((0.5, 0.9), (0.5, 0.0), 8, 0.1, film=8)


def test_the_back_of_a_lamp_is_dark() -> None:
    black = [matte(0.5), matte(0.0)]
    back, front = chain([(0.6, 0.5), (0.4, 0.5)], 1, 8.0), chain([(0.4, 0.5), (0.6, 0.5)], 1, 8.0)
    assert not inside(ABOVE, black, *back).any()
    assert inside(ABOVE, black, *front) == pytest.approx(8.0)


def test_lambert_lobes_together_have_the_sum_of_their_albedos() -> None:
    wide, lamp = replace(ABOVE, half=0.6), chain(LAMP, 0, 8.0)
    parts = Material([Layer("lambert", (albedo,), weight=albedo) for albedo in (0.1, 0.2, 0.3)])
    whole, summed, first = (inside(wide, [each], *lamp) for each in (matte(0.6), parts, matte(0.1)))
    assert summed == pytest.approx(whole, rel=1e-12)
    assert (first < 0.9 * whole).all()


def test_backs_of_walls_are_lit_like_fronts() -> None:
    ends = [(0.2, 0.3), (0.8, 0.3)]
    wide, lamp = replace(ABOVE, half=0.6), chain(LAMP, 0, 8.0)
    a, b = (inside(wide, [matte(0.5)], *lamp, *chain(shelf, 0)) for shelf in (ends, ends[::-1]))
    assert a.all()
    assert a == pytest.approx(b, rel=1e-9)


@pytest.mark.parametrize("count", [1, 2, 3, 5, 8, 13, 21, 60])
def test_cuts_grow_from_end_to_end_and_leave_out_places_only_where_they_are_fewer(count) -> None:
    for scene in LAMBERT:
        for places in radiosity.edges(SCENES[scene]().scene):
            at = radiosity.graded(places, count)
            assert len(at) == count + 1
            assert (at[0], at[-1]) == (0, 1)
            assert (np.diff(at) > 0).all()
            assert np.isin(places, at).all() or count < len(places) - 1


@every_scene
def test_direct_light_needs_no_fine_panels(scene) -> None:
    s = SCENES[scene]().scene
    x, n = points(s, 50)
    coarse, fine = (gather(s, p, p.emission, x, np.zeros(50, dtype=int), n) for p in (cut(s, 1), cut(s, 7)))
    assert coarse == pytest.approx(fine, abs=1e-12)


# ---------------------------------------------------------------- refined

PANELS, BOUND = 60, 5e-4


@cache
def image(scene: str, per_segment: int) -> Array:
    """The inset, (128,)."""
    return rendered(SCENES[scene](), per_segment)


def rendered(setting: Setting, per_segment: int) -> Array:
    return render(setting.scene, setting.pinhole(), setting.depth, per_segment)


def error_of(coarse: float, fine: float) -> float:
    """Relative error of `fine`, found with twice the panels, if errors fall like 1 / panels^2."""
    return abs(fine - coarse) / 3 / fine


@every_scene
def test_sixty_panels_per_segment_err_by_less_than_a_twentieth_of_a_per_cent(scene) -> None:
    coarse, fine = image(scene, PANELS // 2), image(scene, PANELS)
    assert error_of(coarse.mean(), fine.mean()) < BOUND
    assert fine.mean() == pytest.approx(reference(scene).mean.mean(), rel=BOUND)


@every_scene
def test_twice_the_panels_have_a_quarter_of_the_errors_or_less(scene) -> None:
    """Pixel by pixel, so that nothing cancels, against the far more panels of `figures/experiments/references.npz`."""
    truth = reference(scene)
    floor = np.sqrt((truth.error**2).mean())
    coarse, fine = (np.sqrt(((image(scene, n) - truth.mean) ** 2).mean()) for n in (PANELS // 3, PANELS))
    assert fine < coarse / 4 + 2 * floor


def by_middles(scene: Scene, p: radiosity.Panels, x: Array, n: Array) -> Array:
    """A mistake: a panel is seen wholly where its middle is seen."""
    middle = (p.a + p.b) / 2
    i, j = (each.reshape(-1) for each in np.indices((x.shape[1], len(p.prim))))
    seen = scene.visible(x[:, i], middle[:, j]) & (dot(p.n[:, j], x[:, i] - middle[:, j]) > 1e-12)
    s_a, s_b = (radiosity._sine(radiosity._seen_from(scene, x, n, q), s) for q, s in ((p.a, 1), (p.b, -1)))
    return np.asarray((s_a - s_b) / 2 * seen.reshape(s_a.shape))


def test_visibility_judged_by_middles_is_noticed(monkeypatch) -> None:
    monkeypatch.setattr(radiosity, "shares", by_middles)
    wrong = [rendered(SCENES["crease"](), n).mean() for n in (PANELS // 2, PANELS)]
    assert error_of(*wrong) > 2 * BOUND
    assert abs(wrong[1] / image("crease", PANELS).mean() - 1) > 4 * BOUND


def test_panels_that_ignore_where_light_is_not_smooth_are_noticed(monkeypatch) -> None:
    monkeypatch.setattr(radiosity, "edges", lambda scene: [np.array([0.0, 1.0])] * scene.S)
    wrong = rendered(SCENES["matte_cornell"](), PANELS).mean()
    assert abs(wrong / image("matte_cornell", PANELS).mean() - 1) > 4 * BOUND


# ---------------------------------------------------------------- path tracing

BATCHES = {"matte_cornell": 64, "crease": 64, "ajar": 448}
BATCH, EPS = INSET * 64, 0.003


def traced(scene: str, batches: int, seed: int) -> Array:
    """Means of independent batches of path tracing over the inset, (batches,)."""
    setting, rng = SCENES[scene](), np.random.default_rng(seed)
    t, pixel = Tracer(setting.scene, setting.pinhole(), setting.depth, RECONNECTION), np.arange(BATCH) % INSET
    return np.array([paths.radiance(trace(t, rng.random((t.D, BATCH)), pixel)).mean() for _ in range(batches)])


def z_score(samples: Array, truth: float, eps: float) -> float:
    """(mean - truth) / SE, with a power clause: SE <= eps truth."""
    error = samples.std(ddof=1) / np.sqrt(len(samples))
    assert error <= eps * truth
    return float((samples.mean() - truth) / error)


@cache
def path_traced(scene: str) -> Array:
    """As many batches as a standard error of .3% takes."""
    return traced(scene, BATCHES[scene], seed=2)


@pytest.mark.claims("GRIS-E49", part="all-Lambert scenes against radiosity")
@pytest.mark.claims("COM-A01", "COM-B01", "MCMC-E01")
@pytest.mark.parametrize("scene", BATCHES)
def test_path_tracing_agrees_with_radiosity(scene) -> None:
    assert SCENES[scene]().depth == 3
    assert abs(z_score(path_traced(scene), image(scene, PANELS).mean(), EPS)) < 4


def test_path_tracing_tells_radiosity_by_middles_apart(monkeypatch) -> None:
    monkeypatch.setattr(radiosity, "shares", by_middles)
    assert abs(z_score(path_traced("crease"), rendered(SCENES["crease"](), PANELS).mean(), EPS)) > 8


@pytest.mark.claims("GRIS-E49", part="furnace")
@pytest.mark.claims("COM-A01", "COM-B01")
def test_a_furnace_traces_its_closed_form() -> None:
    truth = truncated_furnace(SCENES["furnace"]().depth)
    assert abs(z_score(traced("furnace", 16, seed=1), truth, EPS)) < 4


def test_double_counting_light_is_caught(monkeypatch) -> None:
    """A mistake: light sampling and BSDF samples both with full weight."""
    right = paths.ratio
    monkeypatch.setattr(paths, "ratio", lambda a, b: np.minimum(right(a, b) + 1, 1) if a.ndim == 1 else right(a, b))
    assert z_score(traced("matte_cornell", 16, seed=3), image("matte_cornell", PANELS).mean(), 0.02) > 8


@pytest.mark.parametrize("scene", ["glass_disc", "glossy_cornell", "clear_coat"])
def test_radiosity_refuses_what_is_not_grey_segments_of_lambert_lobes(scene) -> None:
    with pytest.raises(ValueError, match="a monochrome scene of segments with Lambert lobes only"):
        cut(SCENES[scene]().scene, 4)


def test_a_point_without_walls_around_it_sees_from_horizon_to_horizon() -> None:
    alone = compiled(PLANE, [matte(0.5)], chain([(0.1, 1.0), (-0.1, 1.0)], 0, 1.0))
    seen = radiosity.view(alone, np.zeros((2, 1)), np.array([[0.0], [1.0]]))
    assert (seen.s[0, 0], seen.s[0, -1]) == (-1, 1)
    assert seen.V[0, -1].sum() == pytest.approx(0.2 / np.sqrt(1.01))


def test_an_end_of_a_segment_where_the_point_is_itself_has_a_sine() -> None:
    assert radiosity._sine(np.zeros((2, 1)), 1).tolist() == [1]

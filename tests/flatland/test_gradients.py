"""Gradient renderers on paths: film places that move, frames under a camera that pans by fractions of a pixel."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.jobs.gradients import METHODS, MISTAKES
from figures.experiments import gradients
from figures.experiments.flatland import displaced, moving
from figures.experiments.following import in_place
from figures.experiments.gradients import ADAPTIVE, DENSE, MAPS, NONE, gradient_view, sensors_of, with_restir
from figures.experiments.references import reference
from figures.experiments.views import HYBRID, setting
from figures.gradient import gpt_f10
from flatland2d import SCENES
from flatland2d.gbuffer import gbuffer
from flatland2d.sensors import FluenceMap
from restir_ref.area import Displaced
from restir_ref.batch import take
from restir_ref.chance import Live
from restir_ref.gradient import Pairs
from restir_ref.gradient_loop import GRADIENT, PRIMAL, View, forward, step
from restir_ref.images import alike_among
from restir_ref.integrals import NOWHERE, Pixels, Shifted, target
from restir_ref.loop import random_in_row
from restir_ref.restir import initial
from restir_ref.transport.edges import TRIES, Seen, edges, like_pairs, seen
from restir_ref.transport.paths import Tracer
from restir_ref.transport.restir_pt import PathIntegrals, ScatteredIntegrals


def two_frames(scene: str = "glossy_cornell", n: int = 64):
    """The same pixels before and after a step aside of the camera, and where these were."""
    s = setting(scene)
    now = s.pinhole(n)
    before = replace(now, eye=(now.eye[0] + 0.0003, now.eye[1]), towards=(now.towards[0] + 0.0003, now.towards[1]))
    by, _ = gradients.displacement(s.scene, now, before)
    last, here = (PathIntegrals(Tracer(s.scene, each, s.depth, HYBRID)) for each in (before, now))
    return Displaced(last, 0 * by), Displaced(here, by)


def shifted_pair(kind=lambda each: each):
    """Initial samples of the frame before, shifted to the overlapped pixel on the right, and back."""
    last, here = map(kind, two_frames())
    index = np.tile(np.arange(1, 63), 400)
    X = initial(Pixels(last.of, index), Live(np.random.default_rng(1)))
    there = Pixels(here, index + 1)
    y = last.shift(X.x, index, there)
    back = here.shift(y.x, there.index, Pixels(last, index))
    return last, here, X, y, back


@pytest.mark.claims("GPT-A05", "COM-B05")
def test_a_displaced_path_returns_to_its_place_with_the_inverse_jacobian() -> None:
    _, here, X, y, back = shifted_pair()
    whole = (y.J > 0) & (X.W > 0) & (X.x.F > 0).any(axis=0)
    assert whole.mean() > 0.4
    moved = (y.x.u[0] - X.x.u[0] + here.by[0, np.tile(np.arange(2, 64), 400)]) % 1
    assert np.minimum(moved, 1 - moved).max() < 1e-12
    assert (back.J[whole] > 0).all()
    assert (y.J * back.J)[whole] == pytest.approx(1, rel=1e-6)
    assert abs(back.x.u[0] - X.x.u[0])[whole].max() < 1e-12
    assert back.x.F[:, whole] == pytest.approx(X.x.F[:, whole], rel=1e-6)


def test_the_place_of_a_path_is_where_its_own_ray_meets_the_film() -> None:
    last, _, X, y, _ = shifted_pair()
    assert np.array_equal(last.of.place(X.x), X.x.u[:1])
    of_a_few = take(y.x, np.array([3, 1]))
    assert np.array_equal(last.of.place(of_a_few), y.x.u[:1, [3, 1]])


class Kept(Displaced):
    """A mistake: the place is reused as it is, whatever the camera did, but only on the way there."""

    def shift(self, x, index, to):
        return self.of.shift(x, index, Pixels(to.of.of, to.index)) if not self.by.any() else super().shift(x, index, to)


def identity_z(kind) -> float:
    """E_x[p_hat(Tx) J W h(Tx)] = E_y[p_hat(y) W 1{T^-1 y defined} h(y)]: the z of the difference.

    h is the place of the one times that of the other.
    """
    last, here = (kind(each.of, each.by) for each in two_frames())
    index = np.tile(np.arange(2, 62), 1000)
    there, before = Pixels(here, index + 1), Pixels(last, index)
    X = initial(Pixels(last.of, index), Live(np.random.default_rng(1)))
    Y = initial(Pixels(here.of, there.index), Live(np.random.default_rng(2)))
    y, x = last.shift(X.x, index, there), here.shift(Y.x, there.index, before)
    forth = target(there, y.x) * y.J * X.W * y.x.u[0] * X.x.u[0]
    own = target(there, Y.x) * Y.W * (x.J > 0) * Y.x.u[0] * x.x.u[0]
    groups = (forth - own).reshape(300, -1).mean(axis=1)
    return float(groups.mean() / groups.std(ddof=1) * np.sqrt(300))


@pytest.mark.claims("GPT-A05")
def test_displaced_shifts_keep_integrals_that_depend_on_the_place() -> None:
    assert abs(identity_z(Displaced)) < 4
    assert abs(identity_z(Kept)) > 6


# ---------------------------------------------------------------- leaves, sensors


def test_integrals_without_light_that_the_sensor_meets_have_no_leaf_zero() -> None:
    s = SCENES["cornell"]()
    t = Tracer(s.scene, s.fluence(8, 8), s.depth, HYBRID)
    index, samples = np.tile(np.arange(64), 50), {}
    for kind in (PathIntegrals, ScatteredIntegrals):
        samples[kind] = initial(Pixels(kind(t), index), Live(np.random.default_rng(1))).x.k
    assert (samples[PathIntegrals] == 0).any()
    assert (samples[ScatteredIntegrals] > 0).all()


def test_the_first_numbers_of_a_sensor_are_its_place_on_the_film() -> None:
    s = SCENES["cornell"]()
    pinhole, fluence = s.pinhole(8), s.fluence(4, 4)
    assert (pinhole.film_numbers, fluence.film_numbers) == (1, 2)
    u = np.full((3, 2), 0.5)
    u[2] = 0.1, 0.9
    start, _, _ = fluence.ray(np.zeros(2, dtype=int), u)
    assert np.array_equal(start[:, 0], start[:, 1])  # the third number is the direction


# ---------------------------------------------------------------- edges


@pytest.mark.claims("GPT-A06")
def test_edge_pairs_of_a_checker_floor_are_its_borders() -> None:
    s = SCENES["checker"]()
    sensor = replace(s.pinhole(256), first=0, n=1920)
    g, ends = seen(s.scene, sensor), forward((1920,))["dx"][0]
    x = gbuffer(s.scene, sensor).x
    floor = x[1] < 1e-6
    border = (np.floor(x[0, 1:] * 16) != np.floor(x[0, :-1] * 16)) & floor[1:] & floor[:-1]
    found = edges(g, ends)[floor[1:] & floor[:-1]]
    assert np.array_equal(found, border[floor[1:] & floor[:-1]])
    assert 10 < border.sum() < 20
    printed = np.einsum("dn,dn->n", g.n[:, 1:], g.n[:, :-1]) > 0.9  # as the paper has it
    assert printed.mean() > 0.95


@pytest.mark.claims("GPT-A07")
def test_aligned_neighbours_of_edge_pairs_are_edge_pairs_of_the_same_kind() -> None:
    """Nine of ten find one by 256 tries, in the whole row of the figure about them."""
    s, preset = SCENES["checker"](), gpt_f10.preset_of(ADAPTIVE)
    sensor = replace(s.pinhole(), first=0, n=gpt_f10.FILM, film=gpt_f10.FILM)
    view = gradient_view("checker", (sensor, sensor), Counter(), preset, ADAPTIVE)["dx"]
    ends = forward((gpt_f10.FILM,))["dx"][0]
    g, pairs = seen(s.scene, sensor), np.flatnonzero(view.active)
    columns = np.tile(pairs, 200)
    found = {}
    for tries in (TRIES, TRIES // 8):
        around = alike_among(like_pairs(g, ends), random_in_row, tries)
        (near,) = around(view.of["positive"], columns, 1, preset.pairs.radius, Live(np.random.default_rng(1)))
        there = near.index != NOWHERE
        assert like_pairs(g, ends)(columns[there], near.index[there]).all()
        assert view.active[near.index[there]].all()
        assert (near.index != columns).all()
        found[tries] = there.mean()
    assert len(pairs) > 10
    assert found[TRIES] > 0.9 > found[TRIES // 8]


@pytest.mark.claims("GPT-A07", part="and nobody who is not there")
def test_an_edge_pair_that_finds_nobody_alike_keeps_what_it_has() -> None:
    """No two edges of the posts' row are alike: reuse in space changes no bit, and no confidence."""
    s = SCENES["occluders"]()
    sensor = replace(s.pinhole(), first=0, n=gpt_f10.FILM, film=gpt_f10.FILM)
    view, kept = (
        gradient_view("occluders", (sensor, sensor), Counter(), GRADIENT, spatial) for spatial in (ADAPTIVE, NONE)
    )
    found, as_it_was = (step(each, Live(np.random.default_rng(1)), GRADIENT, 4)["dx"] for each in (view, kept))
    assert view["dx"].active.sum() == 9
    for part, X in found.items():
        assert np.array_equal(X.W, as_it_was[part].W)
        assert np.array_equal(X.c, as_it_was[part].c)


@pytest.mark.claims("GPT-A08")
def test_interior_pairs_are_not_shifted_in_space(monkeypatch) -> None:
    """As many shifts as there are edge pairs, times what a pair costs that reuses."""
    s = SCENES["checker"]()
    sensor, spent, original = replace(s.pinhole(64), first=900), {}, Pairs.shift
    shifts: list[int] = []

    def counted(self, x, index, to):
        shifts.append(len(index))
        return original(self, x, index, to)

    monkeypatch.setattr(Pairs, "shift", counted)
    for name, spatial in {"none": NONE, "adaptive": ADAPTIVE, "dense": DENSE}.items():
        shifts.clear()
        view = gradient_view("checker", (sensor, sensor), Counter(), GRADIENT, spatial)
        step(view, Live(np.random.default_rng(1)), GRADIENT, 4)
        spent[name] = sum(shifts), int(view["dx"].active.sum())
    (none, nobody), (adaptive, active), (dense, everybody) = spent.values()
    assert 0 == none == nobody < active < everybody == 63
    assert adaptive * everybody == dense * active


def test_an_edge_is_a_difference_of_albedo_of_normals_or_of_depth_and_nothing_else() -> None:
    g = Seen(np.array([0.5, 0.55, 0.7, 0.5]), np.array([[0, 0, 0, 0.6], [1, 1, 1, 0.8]]), np.array([1, 1.05, 1, 1.0]))
    pair = lambda i, j: bool(edges(g, np.array([[i], [j]]))[0])  # noqa: E731
    assert not pair(0, 1)
    assert pair(0, 2)
    assert pair(0, 3)
    far = Seen(g.albedo[:2], g.n[:, :2], np.array([1, 1.2]))
    nothing = replace(far, t=np.array([np.inf, np.inf]))
    assert edges(far, np.array([[0], [1]]))[0]
    assert not edges(nothing, np.array([[0], [1]]))[0]
    assert edges(replace(far, t=np.array([np.inf, 1.0])), np.array([[0], [1]]))[0]


# ---------------------------------------------------------------- frames


@pytest.mark.claims("GPT-A02", "GPT-A05")
@pytest.mark.claims("GPT-A13", part="the image, to 2%")
@pytest.mark.parametrize("history", [dict, in_place], ids=["moved", "in place"])
def test_a_camera_that_pans_by_fractions_leaves_image_and_differences_unbiased(history) -> None:
    """Eight frames, 96 pixels of a checker floor with three borders; errors over the mean of |dx|."""
    last = sensors_of("checker row")[-1]
    sensors = [displaced(last, (0.00035 * (k - 7), 0.0)) for k in range(8)]
    asked, views = Counter(), []
    for sensor, before in zip(sensors, [sensors[0], *sensors], strict=False):
        views.append(history(gradient_view("checker", (sensor, before), asked, GRADIENT, ADAPTIVE)))
    by = views[-1][PRIMAL].by
    assert (abs(by % 1 - 0.5) < 0.45).all()
    found = with_restir(views, asked, 12, Live(np.random.default_rng(4)))
    truth = reference("checker").mean
    image, dx = found[PRIMAL][:, 64:-64], found["dx"][:, 64:-64]
    mean = image.mean(axis=1) / truth.mean() - 1
    assert abs(mean.mean()) < 4 * mean.std(ddof=1) / np.sqrt(12) + 1e-9
    assert mean.std(ddof=1) / np.sqrt(12) < 0.02
    probe = (dx * np.sign(np.diff(truth))).sum(axis=1) / abs(np.diff(truth)).sum() - 1
    assert abs(probe.mean()) < 4 * probe.std(ddof=1) / np.sqrt(12)
    assert probe.std(ddof=1) / np.sqrt(12) < 0.1


POSTS = slice(24, 66)
"""Pixels of the row of occluders that show both posts and what is beside them."""


def behind_posts(frames: int) -> list[View]:
    """Frames that pan by fractions of a pixel."""
    sensors = [replace(each, first=each.first + 24, n=42) for each in moving("occluders", frames, 0.00035)]
    moves = zip(sensors, [sensors[0], *sensors], strict=False)
    return [gradient_view("occluders", each, Counter(), GRADIENT, ADAPTIVE) for each in moves]


def relative_bias(method: gradients.Method, frames: int, images: int = 2400) -> tuple[float, float]:
    """Of dx with the signs of the true one, over the mean of |dx|; and the standard error."""
    true = np.diff(reference("occluders").mean[POSTS])
    dx = method(behind_posts(frames), Counter(), images, Live(np.random.default_rng(5)))["dx"]
    probe = (dx * np.sign(true)).sum(axis=1) / abs(true).sum() - 1
    return float(probe.mean()), float(probe.std(ddof=1) / np.sqrt(images))


@pytest.mark.claims("GPT-A12")
def test_differences_by_path_tracing_are_unbiased_behind_posts() -> None:
    bias, error = relative_bias(gradients.path_traced, 1, images=7000)
    assert abs(bias) < 4 * error
    assert error < 0.01


@pytest.mark.claims("GPT-A01", "GPT-F02", part="to 2%")
def test_differences_after_restir_are_unbiased_behind_posts_that_pan_by_fractions() -> None:
    bias, error = relative_bias(gradients.after_restir, 3)
    assert abs(bias) < 4 * error
    assert error < 0.02


class Dimmer(PathIntegrals):
    """A mistake: J is too small by a tenth, to the right."""

    def shift(self, x, index, to):
        y = super().shift(x, index, to)
        return Shifted(y.x, np.where(to.index % self.n > index % self.n, 0.9, 1.0) * y.J)


@pytest.mark.parametrize(("method", "frames"), [(gradients.after_restir, 3), (gradients.path_traced, 1)])
def test_a_jacobian_too_small_to_the_right_makes_differences_wrong(monkeypatch, method, frames) -> None:
    monkeypatch.setattr(gradients, "PathIntegrals", Dimmer)
    bias, error = relative_bias(method, frames)
    assert abs(bias) > 8 * error


@pytest.mark.parametrize("name", MISTAKES)
def test_samples_of_one_pixel_and_halves_where_shifts_fail_make_differences_wrong(name) -> None:
    bias, error = relative_bias(METHODS[name], 1)
    assert abs(bias) > 8 * error


def test_crops_of_maps_are_inside_of_their_rooms() -> None:
    for scene in MAPS:
        (sensor, *_), s = sensors_of(f"{scene} map"), setting(scene)
        assert isinstance(sensor, FluenceMap)
        assert np.all(np.array(sensor.low) >= s.low)
        assert np.all(np.array(sensor.high) <= s.high)


def test_taking_columns_of_a_displaced_path_takes_its_new_place() -> None:
    _, _, _, y, _ = shifted_pair()
    assert np.array_equal(take(y.x, np.array([3, 1])).u[0], y.x.u[0, [3, 1]])

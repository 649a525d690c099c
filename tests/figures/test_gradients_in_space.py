"""Laws of GPT-F07-3D: cameras that slide by whole pixels, what a pixel does to a sample, bias and a filter."""

from collections import Counter
from dataclasses import dataclass

import numpy as np
import pytest

from figures.experiments.by_metrics import METRICS, MSE, RELATIVE
from figures.experiments.following import followed, views_of
from figures.experiments.gradients import ADAPTIVE
from figures.experiments.scenewise import CONTRARY, MET
from figures.experiments.views import setting, standard
from figures.gradient import gpt_f01 as row
from figures.gradient import gpt_f07_3d as space
from restir_ref.gathering import gathering
from restir_ref.gradient_loop import GRADIENT, PRIMAL, Group
from restir_ref.integrals import Reservoirs, Shifted
from restir_ref.squares import keeping
from restir_ref.transport.edges import seen, unlike
from tracer3d.scenes import checker

SIDE = 8


def fractions(camera):
    """The largest distance of a motion vector from whole pixels, over all frames but the first."""
    s = checker()
    views = views_of(s, space.CAMERAS[camera].sensors(s, SIDE, 3), GRADIENT, ADAPTIVE, Counter())
    return max(float(abs(view[PRIMAL].by - np.rint(view[PRIMAL].by)).max()) for view in views[1:])


@pytest.mark.parametrize("camera", [space.STILL, space.WHOLE])
def test_a_camera_that_stands_and_one_that_slides_move_by_whole_pixels(camera):
    assert fractions(camera) < 1e-6


HALVES, FIFTHS = (space.moving(pace, space.KEPT) for pace in space.PACES)


def test_a_camera_that_follows_what_it_sees_moves_by_fractions():
    assert fractions(HALVES) > 0.3
    assert fractions(FIFTHS) > 0.15


@pytest.mark.parametrize(("camera", "pixels"), [(HALVES, 3.8), (FIFTHS, 2.46)])
def test_squares_lie_in_about_four_pixels_at_halves_and_in_two_and_a_half_at_fifths(camera, pixels):
    """1 over the mean of sum b^2, b the shares of the area, over 8 frames of 32 x 32 pixels of the floor."""
    s = checker()
    views = views_of(s, space.CAMERAS[camera].sensors(s, 32, 8), GRADIENT, ADAPTIVE, Counter())
    f = np.stack([view[PRIMAL].by for view in views[1:]]) % 1
    assert 1 / (f**2 + (1 - f) ** 2).prod(axis=1).mean() == pytest.approx(pixels, abs=0.1)


def test_the_fraction_of_fifths_has_the_shares_of_the_average_fraction():
    f = (np.arange(1000) + 0.5) / 1000
    mine = space.FIFTH**2 + (1 - space.FIFTH) ** 2
    assert mine == pytest.approx((f**2 + (1 - f) ** 2).mean(), abs=1e-5)


def test_moving_cameras_keep_history_in_place_or_gather_it_and_one_asks_blindly():
    s = checker()
    (view,) = views_of(s, followed(s, SIDE, 1), GRADIENT, ADAPTIVE, Counter())
    follow = {name: camera.history(view)["dx"].follow for name, camera in space.CAMERAS.items()}
    assert {name for name, each in follow.items() if each is gathering} == {
        space.moving(pace, space.GATHERED) for pace in space.PACES
    }
    assert {name for name, each in follow.items() if each is keeping} == {HALVES, FIFTHS, space.STILL, space.WHOLE}


def test_both_options_are_seen_by_the_same_cameras():
    s = checker()
    for pace in space.PACES:
        kept, gathered = (space.CAMERAS[space.moving(pace, each)].sensors(s, SIDE, 3) for each in space.OPTIONS)
        assert kept == gathered


def test_all_cameras_arrive_at_the_same_crop():
    s = checker()
    assert len({camera.sensors(s, SIDE, 3)[-1] for camera in space.CAMERAS.values()}) == 1
    assert len(set(space.sliding(s, SIDE, 3))) == 3


# ---------------------------------------------------------------- what a pixel does to a sample


@dataclass(frozen=True)
class Levels:
    """Constant targets, pixel by pixel; samples move as they are."""

    levels: np.ndarray

    @property
    def n(self):
        return len(self.levels)

    def target(self, index, x):
        return self.levels[index % self.n]

    def contribution(self, index, x):
        return self.target(index, x)[None]

    def shift(self, x, index, to):
        return Shifted(x, np.ones(len(index)))


def share_lost(levels):
    """What `lost` finds in two replicas of a row of pixels with these targets."""
    n = len(levels)
    group = Group({PRIMAL: Levels(np.array(levels))}, (1, n), np.zeros((2, n)), lambda *_: [], np.ones(n, dtype=bool))
    X = Reservoirs(np.zeros(2 * n), np.ones(2 * n), np.ones(2 * n))
    return space.lost(group, {PRIMAL: X}, 2)


def test_what_loses_nine_tenths_of_its_target_by_a_pixel_is_lost():
    assert share_lost([1, 1, 0.05, 0.2]) == pytest.approx(1 / 2.05)  # the second of three; the last has no neighbour


def test_what_keeps_a_tenth_of_its_target_is_not_lost():
    assert share_lost([1, 1, 0.11, 0.2]) == 0


def test_a_pixel_takes_more_from_pairs_than_from_pixels():
    found = space.lost_by_a_pixel(checker(), {"side": SIDE, "replicas": 2}, np.random.default_rng(1))
    assert min(found["dx"], found["dy"]) > 3 * found[PRIMAL]


# ---------------------------------------------------------------- errors


VIEW = f"{HALVES}.CB3"


def arrays(bias, cost):
    """Eight L1 and L2 images of 4 x 4 pixels about 1, the first ones off by `bias`, at `cost` times the rays."""
    images = 1 + np.random.default_rng(1).normal(size=(8, 4, 4))
    images -= images.mean(axis=0) - 1
    cameras = (*space.MOVING, space.STILL)
    found = {f"{camera}.CB3.{method}.L2": images for camera in cameras for method in space.METHODS}
    rays = {f"{VIEW}.{method}.rays": np.array(1.0) for method in space.METHODS}
    return found | rays | {f"{VIEW}.after.L1": images + bias, f"{VIEW}.after.rays": np.array(cost)}


@pytest.mark.parametrize(("image", "expected"), [("L1", 0.25), ("L2", 0.0)])
def test_errors_are_the_variance_at_equal_rays_and_the_bias_of_what_has_one(image, expected):
    a = arrays(bias=0.5, cost=2.0)
    variance = a[f"{VIEW}.with.L2"].var(axis=0, ddof=1).mean()
    found = space.power(a, VIEW, "after", image)["total"][MSE].mean()
    assert found == pytest.approx(2 * variance + expected)
    counted = space.power(a, VIEW, "path tracing", "L2", space.as_averaged)["total"]
    assert counted[MSE].mean() == pytest.approx(variance)
    assert counted[RELATIVE].mean() == pytest.approx(variance / 1.0001)  # the truth is 1 everywhere


GATHERED = space.moving(space.HALVES, space.GATHERED)


def images_alone(noisier, rays=1.0):
    """The arrays above, and images alone by (camera, method) whose variance is 1, or what is given."""
    a = arrays(bias=0.0, cost=1.0)
    image = (a[f"{VIEW}.with.L2"] - 1).reshape(8, -1) / a[f"{VIEW}.with.L2"].std(axis=0, ddof=1).reshape(-1)
    for camera in (*space.MOVING, space.STILL):
        for method in ("after", "temporal"):
            variance = noisier.get((camera, method), 1.0)
            a |= {f"{camera}.CB3.{method}.{PRIMAL}": 1 + image * np.sqrt(variance)}
            a |= {f"{camera}.CB3.{method}.rays": np.array(rays if camera == GATHERED else 1.0)}
        a |= {f"{camera}.CB3.with.rays": np.array(1.0)}
    return a


RIVALS = [(camera, method) for camera in (HALVES, GATHERED) for method in ("after", "temporal")]


@pytest.mark.parametrize("best", RIVALS)
def test_in_motion_the_image_to_beat_is_the_best_of_both_methods_by_both_options(best):
    a = images_alone(dict.fromkeys(RIVALS, 9.0) | {best: 2.0})
    for view in (VIEW, f"{GATHERED}.CB3"):
        assert space.alone(a, view)["total"][MSE].mean() == pytest.approx(2)
        counted = 2 * space.SHARES[best[1]] / space.AREA
        others = 9 * min(space.SHARES[method] / space.AREA for _, method in RIVALS)
        assert space.area(a, view)["total"][MSE].mean() == pytest.approx(min(counted, others))


def test_the_other_option_pays_its_own_rays():
    dear = images_alone({(GATHERED, "after"): 0.5}, rays=4.0)
    assert space.alone(dear, VIEW)["total"][MSE].mean() == pytest.approx(1)
    assert space.alone(images_alone({(GATHERED, "after"): 0.5}), VIEW)["total"][MSE].mean() == pytest.approx(0.5)


def test_another_pace_or_a_camera_at_rest_is_no_rival():
    other = {(camera, "after"): 0.1 for camera in (*space.MOVING, space.STILL) if camera not in (HALVES, GATHERED)}
    assert space.alone(images_alone(other), VIEW)["total"][MSE].mean() == pytest.approx(1)
    still = images_alone({(camera, "after"): 0.1 for camera in space.MOVING})
    assert space.alone(still, f"{space.STILL}.CB3")["total"][MSE].mean() == pytest.approx(1)


def test_as_many_images_are_averaged_as_the_paper_averages():
    """1 of ours, 2 of gradient after ReSTIR, 3 paths of gradient-domain path tracing, and 4 of Area ReSTIR."""
    assert (space.SHARES["with"], space.SHARES["after"], space.SHARES["path tracing"], space.AREA) == (1, 2, 3, 4)


@pytest.mark.claims("COM-B15", part="the filter", world="tracer3d")
def test_the_filter_averages_like_pixels_only():
    s, w = checker(), space.like("Checker3", 32)
    apart = unlike_pixels(s.scene, followed(s, 32, 1)[0])
    assert np.allclose(w.sum(axis=1), 1)
    assert apart.any()
    assert not w[apart].any()
    assert w[~apart].all()


@pytest.mark.claims("COM-B15", part="the filter", world="flatland2d")
def test_the_filter_of_a_row_averages_like_pixels_only():
    s, sensor = setting("checker"), standard("checker")
    w = row.filtered(np.eye(sensor.n)).T  # a filter of what is 1 in one pixel has its column of weights
    apart = unlike_pixels(s.scene, sensor)
    assert np.allclose(w.sum(axis=1), 1)
    assert apart.any()
    assert not w[apart].any()


def unlike_pixels(scene, sensor):
    """Which pixels see different things, (n, n)."""
    i, j = np.indices((sensor.n, sensor.n))
    return unlike(seen(scene, sensor), i.ravel(), j.ravel()).reshape(i.shape)


# ---------------------------------------------------------------- two of three scenes, by one of two options


SIZES = {"m": 0.5, "x": 2.0, "?": 0.97}
"""Errors of pair reuse over all others' where a scene meets the claim, where it misses it, and where nobody can say."""


def judged(monkeypatch, scenes: dict[str, str]):
    """The verdict where CB3, Ajar3 and Checker3 are of these kinds by each option, a letter each."""
    noise = 1 + 0.3 * np.random.default_rng(1).normal(size=(2, 64))
    names = {"with": 0, "after": 1, "path tracing": 1}

    def error(a, view, method, cost):
        camera, scene = view.split(".")
        kind = scenes[camera.rsplit(", ")[-1]][SCENES.index(scene)]
        return (SIZES[kind] if method == "with" else 1.0) * noise[names[method]]

    monkeypatch.setattr(space, "gradient_error", error)
    monkeypatch.setattr(space, "scenes_of", lambda a: SCENES)
    a = {f"{HALVES}.{SCENES[0]}.with.dx": np.zeros((64, 4))}
    return space.on_most(a, space.HALVES, *DIFFERENCES)


SCENES = ["CB3", "Ajar3", "Checker3"]
DIFFERENCES = "GPT-F07", "dx and dy", lambda a, view: space.of_differences(a, view)[1:]
CASES = {
    "both options": ({"kept": "mmm", "gathered": "mmx"}, True, ""),
    "one of them": ({"kept": "mxx", "gathered": "mm?"}, True, "gathered"),
    "neither": ({"kept": "mxx", "gathered": "xxm"}, False, ""),
}


@pytest.mark.parametrize(("scenes", "passed", "caveat"), CASES.values(), ids=CASES)
def test_a_claim_holds_that_holds_in_two_of_three_scenes_by_one_option(monkeypatch, scenes, passed, caveat):
    found = judged(monkeypatch, scenes)
    assert found.outcome.passed is passed
    assert caveat in found.caveat
    assert bool(found.caveat) == bool(caveat)
    assert all(f"{option}: " in found.outcome.measured for option in space.OPTIONS)


@pytest.mark.parametrize(("kept", "gathered"), [("m?x", "xxx"), ("xxx", "???"), ("m??", "mxx")])
def test_it_fails_only_where_replicas_tell_that_it_does(monkeypatch, kept, gathered):
    found = judged(monkeypatch, {"kept": kept, "gathered": gathered})
    assert found.outcome is None
    assert "Undecided. kept: " in found.reason


def test_a_scene_counts_only_where_all_of_its_comparisons_are_met(monkeypatch):
    low, high = (size * (1 + 0.01 * np.random.default_rng(1).normal(size=64)) for size in (0.9, 1.1))
    monkeypatch.setattr(space, "scenes_of", lambda a: SCENES)
    half = [space.Comparison("a", low, high, 1.0), space.Comparison("b", low, high, 0.8)]
    for compared, kind in ((half, CONTRARY), (half[:1], MET)):
        assert space.by_standing({}, HALVES, lambda a, view, of=compared: of)[kind] == SCENES


def by_both_metrics(monkeypatch, kinds):
    """The verdict on images where CB3, Ajar3 and Checker3 are of these kinds, by metric and option."""
    noise = 1 + 0.3 * np.random.default_rng(1).normal(size=(2, 64))

    def of(metric):
        def compared(a, view):
            camera, scene = view.split(".")
            kind = kinds[metric][camera.rsplit(", ")[-1]][SCENES.index(scene)]
            return [space.Comparison("x", SIZES[kind] * noise[0], noise[1], 1.0)]

        return compared

    monkeypatch.setattr(space, "scenes_of", lambda a: SCENES)
    what = space.Judged("GPT-F08", "L2", {metric: of(metric) for metric in METRICS})
    return space.judged({f"{HALVES}.{SCENES[0]}.with.dx": np.zeros((64, 4))}, space.HALVES, what)


HOLDS, FAILS, OPEN = ({"kept": kinds, "gathered": "xxx"} for kinds in ("mmx", "mxx", "m?x"))


@pytest.mark.parametrize(
    ("squared", "relative", "passed"),
    [
        (HOLDS, HOLDS, True),
        (FAILS, FAILS, False),
        (HOLDS, FAILS, None),
        (FAILS, HOLDS, None),
        (HOLDS, OPEN, None),
        (FAILS, OPEN, None),
    ],
)
def test_images_hold_by_both_metrics_or_fail_by_both_or_are_open(monkeypatch, squared, relative, passed):
    found = by_both_metrics(monkeypatch, {MSE: squared, RELATIVE: relative})
    assert (found.outcome.passed if found.outcome else None) is passed
    said = found.outcome.measured if found.outcome else found.reason
    assert all(f"{metric}, {option}: " in said for metric in METRICS for option in space.OPTIONS)


def test_scenes_count_that_hold_by_both_metrics_by_the_same_option(monkeypatch):
    other = {"kept": "xxx", "gathered": "mmx"}
    crossed = by_both_metrics(monkeypatch, {MSE: {"kept": "mmx", "gathered": "xxx"}, RELATIVE: other})
    assert crossed.outcome is None
    apart = by_both_metrics(monkeypatch, {MSE: {"kept": "mmx", "gathered": "xxx"}, RELATIVE: HOLDS | {"kept": "xmm"}})
    assert apart.outcome is None
    assert by_both_metrics(monkeypatch, {MSE: HOLDS, RELATIVE: HOLDS}).caveat == "Only where history is kept."


def powers(sizes):
    """A stand-in for `power`: by (method, image), in total 1 and above alpha what is given, twice that by relMSE."""
    noise = 1 + 0.01 * np.random.default_rng(1).normal(size=(8, 64))

    def power(a, view, method, image, cost=space.dearer):
        size, wave = sizes[method, image], noise[[*space.METHODS].index(method) + 4 * (image == "L1")]
        return {band: {MSE: k * size * wave, RELATIVE: 2 * k * size * wave} for band, k in (("total", 1), ("high", 3))}

    return power


def test_rebuilt_images_are_compared_in_total_with_gradients_and_above_alpha_with_the_best_image(monkeypatch):
    sizes = {"with": 0.5, "after": 1.0, "path tracing": 2.0}
    monkeypatch.setattr(space, "power", powers({(method, "L2"): size for method, size in sizes.items()}))
    monkeypatch.setattr(space, "area", lambda a, view: {"high": {MSE: np.ones(64), RELATIVE: np.full(64, 8.0)}})
    for metric, best in ((MSE, 1.5), (RELATIVE, 3 / 8)):
        found = [each.ours.mean() / each.theirs.mean() for each in space.of_rebuilt("L2", metric)({}, VIEW)]
        assert found == pytest.approx([0.5, 0.25, best], rel=0.01)
        found = [each.ours.mean() / each.theirs.mean() for each in space.of_noise("L2", metric)({}, VIEW)]
        assert found == pytest.approx([0.25, best], rel=0.01)


def test_images_are_judged_by_every_metric_and_differences_by_their_variance_alone():
    assert space.by_both(lambda norm, metric: (norm, metric), "L1") == {metric: ("L1", metric) for metric in METRICS}
    assert {each.id: tuple(each.by) for each in space.JUDGED} == {
        "GPT-F07": ("",),
        "GPT-F08": METRICS,
        "GPT-F01": METRICS,
    }


@pytest.mark.parametrize(("lower", "passed"), [(0.5, True), (2.0, False)])
def test_l1_over_l2_counts_all_scenes_and_methods(monkeypatch, lower, passed):
    sizes = {(method, norm): lower if norm == "L1" else 1.0 for method in space.METHODS for norm in space.NORMS}
    monkeypatch.setattr(space, "power", powers(sizes))
    monkeypatch.setattr(space, "scenes_of", lambda a: SCENES)
    outcome = space.lower({}).outcome
    assert outcome.passed is passed
    assert all(f"{scene} {method}" in outcome.measured for scene in SCENES for method in space.METHODS)


@pytest.mark.parametrize(("ours", "passed"), [(0.2, True), (0.3, False)])
def test_images_at_rest_are_judged_above_alpha_against_the_best_image_at_equal_rays(monkeypatch, ours, passed):
    """3 x .2 of 1 is below .8, 3 x .3 is not; in total either is."""
    best = {MSE: np.ones(64), RELATIVE: np.full(64, 2.0)}
    monkeypatch.setattr(space, "power", powers({("with", norm): ours for norm in space.NORMS}))
    monkeypatch.setattr(space, "scenes_of", lambda a: SCENES)
    monkeypatch.setattr(space, "alone", lambda a, view: {"high": best, "total": best})
    assert {space.rest_images({}, norm).outcome.passed for norm in space.NORMS} == {passed}


def test_all_cameras_help_to_tell_a_bias_of_l2():
    left, of = space.eighths(l2_images(0.0, 0.1), "CB3")
    assert left.shape == (5 * 64, 8)
    assert of == pytest.approx(1, abs=0.01)


def l2_images(shift, noise):
    """Path tracing of 8 x 8 pixels by all cameras, whose L2 differs from its image by this, with so much noise."""
    rng, found = np.random.default_rng(1), {}
    for camera in (*space.MOVING, space.STILL):
        image = 1 + 0.5 * rng.normal(size=(64, 64))
        left = noise * rng.normal(size=(64, 64)) + shift * np.repeat(np.sin(np.arange(8)), 8)
        found |= {f"{camera}.CB3.path tracing.{PRIMAL}": image}
        found |= {f"{camera}.CB3.path tracing.L2": (image + left).reshape(64, 8, 8)}
    return found


@pytest.mark.parametrize(
    ("shift", "noise", "passed"), [(0.0, 0.1, True), (0.05, 0.1, False), (0.0, 1.0, None), (0.5, 1.0, False)]
)
def test_l2_is_unbiased_in_all_eighths_or_a_bias_is_seen_or_it_is_too_noisy(shift, noise, passed):
    claim = space.exact(l2_images(shift, noise), "CB3")
    assert (claim.outcome.passed if claim.outcome else None) is passed
    assert claim.outcome or "too noisy to tell" in claim.reason


def test_variance_is_that_of_the_pairs_that_are_asked_and_nothing_where_there_are_none():
    noise = np.random.default_rng(1).normal(size=(8, 6))
    a = {f"{VIEW}.with.dx": noise, f"{VIEW}.with.dy": 2 * noise}
    some, none = np.arange(6) < 2, np.zeros(6, dtype=bool)
    found = space.among(a, VIEW, "with", {"dx": some, "dy": none}).mean()
    assert found == pytest.approx(noise[:, :2].var(axis=0, ddof=1).mean())
    assert not space.among(a, VIEW, "with", {"dx": none, "dy": none}).any()


def test_the_mean_size_of_errors_is_told_of_dx_and_dy_together():
    a = {f"{VIEW}.with.dx": np.array([[1.0, 2], [3, 2]]), f"{VIEW}.with.dy": np.array([[0.0], [6]])}
    assert np.allclose(space.sizes(a, VIEW, "with"), [0.5 + 3, 0.5 + 3])


def test_sizes_are_sorted_scene_by_scene_against_both_others(monkeypatch):
    noise = 1 + 0.01 * np.random.default_rng(1).normal(size=(3, 64))
    small = {"CB3": {"with": 0.5}, "Ajar3": {"with": 0.9, "after": 0.5}, "Checker3": {"with": 1.0}}

    def sizes(a, view, method):
        return small[view.split(".")[1]].get(method, 1.0) * noise[list(space.METHODS).index(method)]

    monkeypatch.setattr(space, "sizes", sizes)
    monkeypatch.setattr(space, "scenes_of", lambda a: SCENES)
    told = space.smallest({f"{HALVES}.CB3.with.dx": np.zeros((64, 4))}, space.HALVES).outcome
    assert told.passed is None
    assert told.measured == ". ".join(f"{o}: met: CB3; contrary: Ajar3; undecided: Checker3" for o in space.OPTIONS)


def test_a_camera_at_rest_is_judged_at_equal_rays_against_both_others_alone(monkeypatch):
    noise = 1 + 0.01 * np.random.default_rng(1).normal(size=(3, 64))
    rays = {"with": 0.5, "after": 1.0, "path tracing": 0.7}  # after / path tracing is above the limit

    def error(a, view, method, cost=space.dearer):
        return (rays[method] if cost is space.dearer else 1.0) * noise[list(space.METHODS).index(method)]

    monkeypatch.setattr(space, "gradient_error", error)
    monkeypatch.setattr(space, "scenes_of", lambda a: SCENES)
    assert space.at_rest({}).outcome.passed is True
    monkeypatch.setitem(rays, "path tracing", 0.55)
    assert space.at_rest({}).outcome.passed is False


def test_too_few_replicas_judge_nothing():
    a = {f"{HALVES}.CB3.with.dx": np.zeros((8, 4)), f"{space.STILL}.CB3.with.dx": np.zeros((8, 4))}
    for each in space.JUDGED:
        assert space.judged(a, space.HALVES, each).outcome is None


def test_one_image_is_as_noisy_as_all_that_are_averaged_together_are_quiet():
    found = {method: space.one_image({}, "", method) for method in ("after", "path tracing")}
    assert found == {"after": 2.0, "path tracing": 3.0}

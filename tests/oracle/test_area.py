"""Area reservoirs and gradient frames, exactly: cells that have a place on the film.  [GPT 4.3.1, Fig. 2b]"""

import re
from dataclasses import replace

import numpy as np
import pytest

from restir_ref.area import Displaced, area_temporal, one_by_area, overlapped, still
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.gradient import SIGNS
from restir_ref.gradient_loop import (
    ACROSS_SIGNS,
    GRADIENT,
    SAME_SIGN,
    UNSIGNED,
    GradientPreset,
    Group,
    first,
    forward,
    in_space,
    in_time,
    nearer,
    pairs_of,
    sampled,
    shaded,
    step,
)
from restir_ref.integrals import NOWHERE, Pixels, Shifted
from restir_ref.loop import Preset
from restir_ref.oracle.cells import Frame
from restir_ref.oracle.film import (
    CELLS,
    HALVES,
    RING,
    SUFFIXES,
    Coloured,
    film_scene,
    grey_but_for_hue,
    light_of,
    tinted,
)
from restir_ref.oracle.laws import bias_of, expected_sum
from restir_ref.oracle.scenes import Scene, offset
from restir_ref.restir import capped, initial, resample, spatial
from tests.oracle.pairs import labelled, largest_bias
from tests.oracle.places import placed_scene


def area_frames(scene: Scene, by: Array, kind=Displaced):
    before, now = scene.frames

    def loop(index, chance):
        history = initial(Pixels(before, index), chance)
        here = Pixels(kind(now, by), index)
        there = kind(before, np.zeros((1, before.n)))
        sources = [(Pixels(there, columns), share) for columns, share in overlapped((before.n,), by, index)]
        X = area_temporal(initial(Pixels(now, index), chance), here, history, sources, chance)
        return spatial(X, plain := Pixels(now, index), [offset(plain.of, index, 1)], chance)

    return loop


each_seed = pytest.mark.parametrize("seed", range(6))


@pytest.mark.claims("GPT-A05", "COM-B05")
@each_seed
def test_area_reservoirs_are_unbiased_in_every_cell(seed) -> None:
    scene = film_scene(seed)
    assert abs(bias_of(area_frames(scene, HALVES), scene.v, scene.support)).max() < 1e-13


class Ignored(Displaced):
    """A mistake: on the way there the square is ignored, on the way back it is not."""

    def shift(self, x, index, to):
        if self.by.any():
            return Displaced.shift(self, x, index, to)
        return self.of.shift(x, index, Pixels(to.of.of, to.index))


class Jittered(Displaced):
    """A mistake: the place is drawn anew, here always the first one, with no density for it."""

    def shift(self, x, index, to):
        y = Displaced.shift(self, x, index, to)
        return y if self.by.any() else Shifted(y.x % SUFFIXES, y.J)


@pytest.mark.claims("GPT-A05")
@pytest.mark.parametrize("kind", [Ignored, Jittered])
def test_a_square_that_is_ignored_one_way_and_a_place_drawn_anew_are_noticed(kind) -> None:
    bias = [abs(bias_of(area_frames(s, HALVES, kind), s.v, s.support)).max() for s in map(film_scene, range(3))]
    assert max(bias) > 0.02


def chosen_frames(scene: Scene, choice):
    """Two frames of area reuse, where the choice says which of the overlapped pixels are asked."""
    before, now = scene.frames

    def loop(index, chance):
        history = initial(Pixels(before, index), chance)
        here, there = Pixels(Displaced(now, HALVES), index), still(before, HALVES)
        sources = choice(overlapped((before.n,), HALVES, index), chance, history)
        at = [(Pixels(there, columns), share) for columns, share in sources]
        return area_temporal(initial(Pixels(now, index), chance), here, history, at, chance)

    return loop


def the_bright_one(sources, chance, history):
    """A mistake: the overlapped pixel whose sample weighs more."""
    (one, share), (other, _) = sources
    W = history.W
    return [(np.where(W.take(one) >= W.take(other), one, other), np.ones(len(share)))]


@pytest.mark.claims("GPT-A05")
@each_seed
def test_one_of_the_overlapped_pixels_chosen_by_area_is_unbiased_in_every_cell(seed) -> None:
    scene = film_scene(seed)
    loop = chosen_frames(scene, lambda sources, chance, _: one_by_area(sources, chance))
    assert abs(bias_of(loop, scene.v, scene.support)).max() < 1e-13


def test_a_choice_among_overlapped_pixels_by_their_samples_is_noticed() -> None:
    bias = [abs(bias_of(chosen_frames(s, the_bright_one), s.v, s.support)).max() for s in map(film_scene, range(3))]
    assert min(bias) > 0.02


def test_one_pixel_is_chosen_as_often_as_its_share_of_the_area_and_never_one_that_is_not_there() -> None:
    index, by = np.arange(40000), np.array([[-0.3, 0.7, 0.2, 0.7]])
    sources = overlapped((4,), by, index)
    ((columns, shares),) = one_by_area(sources, Live(np.random.default_rng(1)))
    assert (shares == 1).all()
    assert (columns[index % 4 == 0] == index[index % 4 == 0]).all()
    assert (columns[index % 4 == 1] % 4 == 2).mean() == pytest.approx(0.7, abs=0.02)
    assert (columns[index % 4 == 3] == index[index % 4 == 3]).all()
    alone = overlapped((4,), np.zeros((1, 4)), np.arange(4))
    ((same, whole),) = one_by_area(alone, Live(np.random.default_rng(1)))
    assert np.array_equal(same, np.arange(4))
    assert (whole == 1).all()
    assert one_by_area([], Live(np.random.default_rng(1))) == []


# ---------------------------------------------------------------- which pixels a square overlaps


def sources(shape, by, n=None) -> dict:
    index = np.arange(int(np.prod(shape)) if n is None else n)
    return [dict(zip(("columns", "share"), each, strict=True)) for each in overlapped(shape, np.array(by), index)]


def test_a_whole_displacement_has_one_source() -> None:
    (only,) = sources((4,), [[1.0, 1.0, -1.0, -2.0]])
    assert only["columns"].tolist() == [1, 2, 1, 1]
    assert (only["share"] == 1).all()


def test_shares_of_a_square_are_areas_that_sum_to_one() -> None:
    by = np.random.default_rng(1).uniform(-3, 3, (2, 20))
    found = sources((4, 5), by)
    assert len(found) == 4
    assert sum(each["share"] for each in found) == pytest.approx(1, rel=1e-12)
    corner = np.floor(by)
    assert found[0]["share"] == pytest.approx((1 - (by - corner)).prod(axis=0), rel=1e-12)


def test_columns_of_a_square_count_along_the_rows_of_each_replica() -> None:
    by = np.array([[0.25], [1.5]]) * np.ones(6)
    index = np.array([0, 6, 1])  # pixel (0, 0) of two replicas, and (0, 1)
    columns = [each.tolist() for each, _ in overlapped((3, 2), by, index)]
    assert columns == [[2, 8, 3], [4, 10, 5], [3, 9, NOWHERE], [5, 11, NOWHERE]]


def test_what_the_previous_frame_did_not_show_has_no_source() -> None:
    assert sources((3,), [[np.inf, 5.0, -5.0]]) == []
    (only,) = sources((3,), [[np.inf, -1.0, 5.0]])
    assert only["columns"].tolist() == [NOWHERE, 0, NOWHERE]


def test_where_motion_is_known_along_one_axis_only_there_is_no_source() -> None:
    known = np.zeros((2, 4))
    for axis in (0, 1):
        by = known.copy()
        by[axis, 1] = np.inf
        (only,) = sources((2, 2), by)
        assert only["columns"].tolist() == [0, NOWHERE, 2, 3]


def test_a_displacement_of_another_number_of_axes_is_refused() -> None:
    with pytest.raises(ValueError, match=r"a film of shape \(3, 4\) has 2 axes, but displacements have 1"):
        overlapped((3, 4), np.zeros((1, 12)), np.arange(12))


def test_there_and_back_is_the_same_place() -> None:
    before, now = film_scene(0).frames
    here, there = Displaced(now, HALVES), still(before, HALVES)
    index, x = np.repeat([0, 1], CELLS), np.tile(np.arange(CELLS), 2)
    y = there.shift(x, index, Pixels(here, index))
    back = here.shift(y.x, index, Pixels(there, index))
    assert (y.J > 0).any()
    assert np.array_equal(back.x[y.J > 0], x[y.J > 0])
    assert (y.J * back.J)[y.J > 0] == pytest.approx(1, rel=1e-12)


def test_all_of_a_displaced_image_but_its_shifts_is_that_of_the_image() -> None:
    frame = film_scene(0).now
    here, index, x = Displaced(frame, HALVES), np.repeat([0, 1], CELLS), np.tile(np.arange(CELLS), 2)
    assert here.n == frame.n
    (own,), (drawn,) = (list(of.candidates(index, Live(np.random.default_rng(1)))) for of in (frame, here))
    assert np.array_equal(own, drawn)
    assert np.array_equal(here.target(index, x), frame.target(index, x))
    assert np.array_equal(here.contribution(index, x), frame.contribution(index, x))
    assert len(np.unique(frame.contribution(index, x))) > CELLS


# ---------------------------------------------------------------- gradient frames


def ring(of, index, count, radius, chance):
    return [offset(of, index, by) for by in range(1, count + 1)]


PRESET = GradientPreset(Preset(1, 1, 1, 1, 3.0), Preset(1, 1, 1, 1, 3.0))


def group(of: dict, by: Array = HALVES) -> Group:
    return Group(of, (2,), by, ring, np.ones(2, dtype=bool))


def pair_group(frame: Frame, *parts: str) -> Group:
    return group(pairs_of(frame, RING, dict.fromkeys(parts, parts)))


def pair_frames(scene: Scene, *parts: str, partners=SAME_SIGN):
    """The first part of all frames, each after area reuse in time and reuse in space; candidates once per pixel."""
    groups = [pair_group(frame, *parts) for frame in scene.frames]

    def loop(index, chance):
        last = None
        for frame, now in zip(scene.frames, groups, strict=True):
            X = first(now, index, sampled(frame, chance, 1, len(index) // 2), chance)
            if last is not None:
                X = in_space(now, in_time(now, X, last, PRESET.pairs, partners, chance), PRESET.pairs, partners, chance)
            last = now, X
        return labelled(X[parts[0]], scene.v.shape[-1])

    return loop


@pytest.mark.claims("GPT-A02", "GPT-E24")
@pytest.mark.parametrize("part", SIGNS)
@pytest.mark.parametrize("seed", range(2))
def test_pairs_are_unbiased_over_two_frames_of_area_reuse_from_trees_that_all_pairs_share(part, seed) -> None:
    scene = film_scene(seed)
    assert largest_bias(pair_frames(scene, part), pair_group(scene.now, part).of[part], scene) < 1e-12


@pytest.mark.claims("GPT-A02", "GPT-E24", part="three frames")
@pytest.mark.parametrize("part", SIGNS)
@pytest.mark.parametrize("seed", range(3))
def test_pairs_are_unbiased_over_three_frames_of_reuse_in_time_and_in_space(part, seed) -> None:
    scene = placed_scene(seed, suffixes=1, frames=3)
    assert largest_bias(pair_frames(scene, part), pair_group(scene.now, part).of[part], scene) < 1e-12


def clamped(X, cap):
    """A mistake: weights of history are clamped against fireflies."""
    return replace(capped(X, cap), W=np.minimum(X.W, 1.0))


def test_clamped_history_is_noticed_over_three_frames_of_reuse_in_time_and_in_space(monkeypatch) -> None:
    monkeypatch.setattr("restir_ref.gradient_loop.capped", clamped)
    scenes = [placed_scene(seed, suffixes=1, frames=3) for seed in range(3)]
    of = [pair_group(scene.now, "positive").of["positive"] for scene in scenes]
    assert max(map(largest_bias, [pair_frames(scene, "positive") for scene in scenes], of, scenes)) > 0.02


def test_a_frame_of_pixels_alone_is_a_frame_of_area_reservoirs() -> None:
    scene = film_scene(3)
    views = [{"primal": group({"primal": frame})} for frame in scene.frames]

    def loop(index, chance):
        at = len(index) // 2
        history = step(views[0], chance, GradientPreset(Preset(1, 0, 1, 1, 3.0), PRESET.pairs), at)
        return step(views[1], chance, PRESET, at, (views[0], history))["primal"]["primal"]

    assert abs(bias_of(loop, scene.v, scene.support)).max() < 1e-13


@pytest.mark.claims("GPT-A09")
@pytest.mark.parametrize("seed", range(2))
def test_pairs_that_reuse_across_signs_are_unbiased_over_two_frames(seed) -> None:
    scene = film_scene(seed)
    loop = pair_frames(scene, *SIGNS, partners=ACROSS_SIGNS)
    assert largest_bias(loop, pair_group(scene.now, *SIGNS).of["positive"], scene) < 1e-12


def test_pairs_with_one_reservoir_for_both_signs_are_unbiased_over_two_frames() -> None:
    scene = film_scene(1)
    loop = pair_frames(scene, "magnitude", partners=UNSIGNED)
    assert largest_bias(loop, pair_group(scene.now, "magnitude").of["magnitude"], scene) < 1e-12


# ---------------------------------------------------------------- colour


def coloured_bias(frame: Coloured) -> Array:
    """Of both signs after spatial reuse, (3, pairs), over the sum of all light."""
    at = pair_group(frame, *SIGNS)

    def estimate(index, chance):
        X = first(at, index, sampled(frame, chance, 1, len(index) // 2), chance)
        return shaded(at, in_space(at, X, PRESET.pairs, SAME_SIGN, chance))

    light = light_of(frame)
    return (expected_sum(estimate, 2) - (light[:, RING[0]] - light[:, RING[1]])) / light.sum()


@pytest.mark.parametrize("seed", range(3))
def test_differences_of_colours_are_unbiased_in_every_channel(seed) -> None:
    assert abs(coloured_bias(tinted(film_scene(seed).now))).max() < 1e-13


def test_a_difference_of_hue_alone_is_seen(monkeypatch) -> None:
    frame = grey_but_for_hue(film_scene(0))
    assert abs(coloured_bias(frame)).max() < 1e-13
    monkeypatch.setattr("restir_ref.gradient.COLOURED", 0.0)
    assert abs(coloured_bias(frame)).max() > 0.01


# ---------------------------------------------------------------- who reuses in space


def test_pairs_that_are_not_active_keep_what_they_have_and_draw_nothing() -> None:
    frame = film_scene(1, n=4).now
    active = np.array([True, False, False, True])
    at = Group({"primal": frame}, (4,), np.zeros((1, 4)), ring, active)
    index, chance = np.arange(4 * 50), Live(np.random.default_rng(1))
    X = first(at, index, sampled(frame, chance, 1, 50), chance)
    Y = in_space(at, X, PRESET.pixels, {"primal": ("primal",)}, chance)["primal"]
    idle = ~np.tile(active, 50)
    assert np.array_equal(Y.x[idle], X["primal"].x[idle])
    assert np.array_equal(Y.W[idle], X["primal"].W[idle])
    assert (Y.c[~idle] == 2).all()
    assert (Y.c[idle] == 1).all()


def test_groups_of_unequal_sizes_are_refused() -> None:
    frame = film_scene(0).now
    with pytest.raises(ValueError, match="`by` has 3 columns, `active` 2"):
        group({"primal": frame}, np.zeros((1, 3)))
    with pytest.raises(ValueError, match=r"its shape is \(3,\)"):
        Group({"primal": frame}, (3,), HALVES, ring, np.ones(2, dtype=bool))


@pytest.mark.parametrize("shape", [(1,), (1, 1)], ids=str)
def test_a_single_pixel_may_be_rendered_without_pairs(shape) -> None:
    alone = Group({"primal": film_scene(0, 1).now}, shape, np.zeros((len(shape), 1)), ring, np.ones(1, dtype=bool))
    X = step({"primal": alone}, Live(np.random.default_rng(1)), PRESET)["primal"]["primal"]
    assert len(X.W) == 1


@pytest.mark.parametrize("shape", [(0,), (0, 4), (4,)], ids=str)
def test_a_group_of_nobody_is_refused(shape) -> None:
    nobody = replace(film_scene(0).now, n=0)
    with pytest.raises(ValueError, match="needs motion and activity of as many"):
        Group({"primal": nobody}, shape, np.zeros((1, 0)), ring, np.ones(0, dtype=bool))
    with pytest.raises(ValueError, match="needs motion and activity of as many"):
        Group({"primal": film_scene(0).now}, (0,), HALVES, ring, np.ones(2, dtype=bool))


def test_history_of_another_size_is_refused() -> None:
    small, large = (film_scene(0, n).now for n in (2, 4))
    there = Group({"primal": large}, (4,), np.zeros((1, 4)), ring, np.ones(4, dtype=bool))
    X = {"primal": initial(Pixels(small, np.arange(2)), Live(np.random.default_rng(1)))}
    with pytest.raises(ValueError, match=r"history of 4 pixels or pairs, shape \(4,\), has no places for 2"):
        in_time(group({"primal": small}), X, (there, X), PRESET.pixels, {"primal": ("primal",)}, Live(None))


@pytest.mark.parametrize("shape", [(2, 2), (2, 3), (3, 2), (4, 5)])
def test_ends_of_forward_pairs_are_the_next_pixel_and_this_one(shape) -> None:
    (dx, shape_x), (dy, shape_y) = forward(shape).values()
    assert [*forward(shape)] == ["dx", "dy"]
    image = np.arange(np.prod(shape)).reshape(shape) ** 2
    assert np.array_equal(np.subtract(*image.ravel()[dx]).reshape(shape_x), np.diff(image, axis=1))
    assert np.array_equal(np.subtract(*image.ravel()[dy]).reshape(shape_y), np.diff(image, axis=0))


def test_pairs_of_rows_and_of_several_crops_stay_inside_of_each() -> None:
    assert forward((4,))["dx"][0].tolist() == [[1, 2, 3], [0, 1, 2]]
    assert forward((2,), crops=2)["dx"][0].tolist() == [[1, 3], [0, 2]]


@pytest.mark.parametrize("shape", [(1, 1), (1, 4), (4, 1), (0, 3), (1,), (0,), ()], ids=str)
def test_an_image_without_neighbours_in_some_direction_has_no_pairs_and_is_refused(shape) -> None:
    """A user who asks for gradients of one pixel would else get empty arrays, or a division by zero frames later."""
    with pytest.raises(ValueError, match=rf"1 images of shape {re.escape(str(shape))} have a direction without"):
        forward(shape)


def test_pairs_of_no_images_are_refused() -> None:
    with pytest.raises(ValueError, match="0 images of shape"):
        forward((2, 2), crops=0)


@pytest.mark.claims("GPT-A04")
def test_a_pair_moves_with_its_nearer_pixel() -> None:
    by, depth = np.array([[0.0, 1.0, 2.0]]), np.array([3.0, 1.0, 2.0])
    assert nearer(by, depth, forward((3,))["dx"][0]).tolist() == [[1.0, 1.0]]


# ---------------------------------------------------------------- parameters


@pytest.mark.claims("GPT-A05", part="confidences of the overlapped pixels")
def test_overlapped_pixels_bring_their_shares_of_a_capped_confidence() -> None:
    """A cap of 2 and shares of a half on either side: 1 + 2 / 2 + 2 / 2 in a row of two, that overlaps itself."""
    before, now = film_scene(1).frames
    index, chance = np.arange(2), Live(np.random.default_rng(1))
    X, Y = ({"primal": replace(initial(Pixels(of, index), chance), c=c)} for of, c in ((now, ONE), (before, 9 * ONE)))
    preset, partners = Preset(1, 0, 1, 1, 2.0), {"primal": ("primal",)}
    found = in_time(group({"primal": now}), X, (group({"primal": before}), Y), preset, partners, chance)["primal"]
    assert found.c.tolist() == [3.0, 3.0]
    third = in_time(group({"primal": now}, HALVES / 2), X, (group({"primal": before}), Y), preset, partners, chance)[
        "primal"
    ]
    assert third.c.tolist() == [3.0, 3.0]
    edge = in_time(group({"primal": now}, -HALVES / 2), X, (group({"primal": before}), Y), preset, partners, chance)
    assert edge["primal"].c.tolist() == [2.5, 2.5]  # a quarter of either square lies outside of the row


@pytest.mark.claims("GPT-A05", part="confidences of the overlapped pixels")
@pytest.mark.parametrize(("by", "found"), [(HALVES, 3.0), (HALVES / 2, 3.0), (-HALVES / 2, 2.5)])
def test_area_reservoirs_have_the_confidence_of_the_area_that_the_previous_frame_showed(by, found) -> None:
    before, now = film_scene(1).frames
    index, chance = np.arange(2), Live(np.random.default_rng(1))
    X, Y = (replace(initial(Pixels(of, index), chance), c=c) for of, c in ((now, ONE), (before, 9 * ONE)))
    shown = [(Pixels(still(before, by), columns), share) for columns, share in overlapped((2,), by, index)]
    assert area_temporal(X, Pixels(Displaced(now, by), index), Y, shown, chance, cap=2.0).c.tolist() == [found] * 2


ONE = np.ones(2)


def test_several_trees_are_averaged() -> None:
    frame = film_scene(0).now

    def loop(index, chance):
        return resample(sampled(frame, chance, 2, len(index) // 2), Pixels(frame, index), chance)

    scene = film_scene(0)
    assert abs(bias_of(loop, scene.v, scene.support)).max() < 1e-13


@pytest.mark.claims("GPT-A10", part="numbers of candidates and neighbours; one tree is shared, which is ours")
def test_the_preset_has_the_numbers_of_the_paper() -> None:
    pixels, pairs = GRADIENT.pixels, GRADIENT.pairs
    assert (pixels.trees, pixels.rounds, pixels.neighbours) == (1, 1, 2)
    assert (pairs.trees, pairs.rounds, pairs.neighbours) == (1, 1, 1)
    assert (pixels.cap, pixels.radius, pairs.cap, pairs.radius) == (20, 20, 20, 20)
    assert GRADIENT.partners is SAME_SIGN


def test_a_displaced_cell_lies_at_its_place_and_by_around_the_pixel():
    frame = film_scene(0).now
    x = np.arange(4)
    np.testing.assert_array_equal(frame.place(x), [[0.25, 0.25, 0.75, 0.75]])
    for by in (0.5, -0.5, 1.0):
        moved = frame.displaced(x, np.full((1, 4), by))
        np.testing.assert_array_equal(frame.place(moved), (frame.place(x) + by) % 1)

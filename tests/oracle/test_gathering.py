"""History that gathers in the square, exactly: what lies in it stays, and what lies elsewhere moves in.  [GPT 4.3.1]"""

from collections import Counter
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import pytest

from restir_ref import gathering as module
from restir_ref.area import overlapped, shared_by
from restir_ref.batch import Array, ratio, take, total
from restir_ref.chance import Live
from restir_ref.gathering import area_gathering, gathering, images, into_squares
from restir_ref.gradient import SIGNS
from restir_ref.gradient_loop import ACROSS_SIGNS, PRIMAL, pairs_of, step
from restir_ref.integrals import Pixels, Reservoirs, Shifted, target
from restir_ref.mis import WEIGHTS
from restir_ref.oracle.scenes import Scene
from restir_ref.resampling import gris
from restir_ref.restir import entering, initial
from restir_ref.squares import Carried, Held, Squares
from tests.oracle.pairs import largest_bias
from tests.oracle.places import PlacedFrame, placed_scene
from tests.oracle.test_area import PRESET, RING
from tests.oracle.test_squares import (
    HALF,
    INTO_THE_MIDDLE,
    MAPS,
    MOTIONS,
    QUARTERS,
    bias_of_three,
    each_seed,
    four_pixels,
    group,
    kept,
    largest,
    one_step,
    pair_frames,
    sheet,
    without_sign,
)

frames_of = partial(kept, reuse=area_gathering)
"""All frames of a scene, each after the one before it, whose history gathers."""


@pytest.mark.claims("GPT-A05", "COM-B05")
@pytest.mark.parametrize("by", MOTIONS.values(), ids=MOTIONS)
@each_seed
def test_what_is_gathered_is_unbiased_in_every_cell_of_a_row(seed, by) -> None:
    scene = placed_scene(seed)
    assert largest(frames_of(scene, by), scene) < 1e-13


@pytest.mark.claims("GPT-A05")
@pytest.mark.parametrize("seed", range(2))
def test_what_is_gathered_is_unbiased_over_three_frames(seed) -> None:
    scene = placed_scene(seed, suffixes=1, frames=3)
    assert largest(frames_of(scene, HALF), scene) < 1e-13


@pytest.mark.claims("GPT-A05")
@pytest.mark.parametrize(("shape", "by"), MAPS.values(), ids=MAPS)
@pytest.mark.parametrize("seed", range(2))
def test_what_is_gathered_is_unbiased_in_every_cell_of_a_map(seed, shape, by) -> None:
    scene = placed_scene(seed, axes=2, suffixes=1)
    assert largest(frames_of(scene, by, shape), scene) < 1e-13


@pytest.mark.claims("GPT-A05")
@pytest.mark.parametrize("seed", range(3))
def test_what_is_gathered_is_unbiased_where_squares_overlap_four_pixels(seed) -> None:
    scene = four_pixels(seed)
    assert largest(frames_of(scene, INTO_THE_MIDDLE, (2, 2)), scene) < 1e-13


# ---------------------------------------------------------------- mistakes


def without_shares(i, found, c):
    """A mistake: b is in the numerator of m and not in its sum; confidences are 1 here."""
    density = (found.p_hat * found.J)[found.at[i]]
    return ratio(c[i] * density[i], total([(each > 0) * q for each, q in zip(c, density, strict=True)]))


balance, landed = module.balance, module.landed


def all_in_full(i, found, c):
    """A mistake: m = 1, as when samples elsewhere are rejected."""
    return np.ones(len(c[i]))


def unstretched(i, inside, found, sources):
    """A mistake: J left out of what enters, not of m."""
    y = landed(i, inside, found, sources)
    return replace(y, mW=y.mW / np.where(y.mW > 0, found.J[_landing(i, inside, found)], 1))


def unmoved(i, inside, found, sources):
    """A mistake: what lies elsewhere enters as it is."""
    y, at = landed(i, inside, found, sources), found.at[i, i]
    column = sources[i].at.index
    return replace(y, x=Held(take(found.x, at), column), p_hat=found.p_hat[at])


def _landing(i, inside, found):
    return found.at[i, inside.argmax(axis=0), np.arange(inside.shape[-1])]


MISTAKES = {
    "area shares left out of the sum": ("balance", without_shares),
    "all in full": ("balance", all_in_full),
    "J left out of what enters": ("landed", unstretched),
    "what lies elsewhere is not moved": ("landed", unmoved),
}


@pytest.mark.claims("GPT-A05")
@pytest.mark.parametrize(("name", "wrong"), MISTAKES.values(), ids=MISTAKES)
def test_mistakes_in_what_is_gathered_are_noticed(monkeypatch, name, wrong) -> None:
    monkeypatch.setattr(module, name, wrong)
    assert max(largest(frames_of(scene, HALF), scene) for scene in map(placed_scene, range(3))) > 0.02


def test_a_sum_over_the_new_frame_s_targets_is_noticed(monkeypatch) -> None:
    def worst(scene: Scene) -> float:
        def anew(i, inside, found, sources):
            """A mistake: its own target is the stored one of the old frame, the others' are those of the new one."""
            y, c = landed(i, inside, found, sources), [each.X.c for each in sources]
            p_hat = [scene.now.target(each.at.index, found.x[found.at[i, j]]) for j, each in enumerate(sources)]
            p_hat[i] = found.p_hat[found.at[i, i]]
            q = p_hat * found.J[found.at[i]]
            return replace(y, mW=ratio(y.mW, balance(i, found, c)) * ratio(c[i] * q[i], total(list(c * q))))

        monkeypatch.setattr(module, "landed", anew)
        return largest(frames_of(scene, HALF), scene)

    assert max(map(worst, map(placed_scene, range(3)))) > 0.02


def test_weights_by_targets_alone_sum_to_1_as_well(monkeypatch) -> None:
    """Without J in m all images of a sample still have one sum: no bias, and other weights."""
    monkeypatch.setattr(module, "balance", lambda i, found, c: balance(i, replace(found, J=1.0 * (found.J > 0)), c))
    assert max(largest(frames_of(scene, HALF), scene) for scene in map(placed_scene, range(3))) < 1e-13


@dataclass(frozen=True, eq=False)
class Choosy(PlacedFrame):
    """Shifts that do not compose: some of three may be defined both ways round, and not the third."""

    def shift(self, x: Array, index: Array, to: Pixels) -> Shifted:
        """Undefined where the volumes of both ends differ by more than a factor 2."""
        y = super().shift(x, index, to)
        return Shifted(y.x, np.where((y.J >= 0.5) & (y.J <= 2), y.J, 0))


def sums_of_weights(kind: type[PlacedFrame]) -> Array:
    """sum_q m_q(y) over all samples that move to y, for every place of four pixels that has any, in some scenes."""
    h, sums = np.arange(4), []
    for seed in range(6):
        of = placed_scene(seed, n=4, axes=2, suffixes=1).frames[0]
        frame = kind(of.cells, of.n, of.t, of.labels)
        for place in range(of.count):
            Y = Reservoirs(np.full(4, place), np.ones(4), 1.0 + h)
            sources = [entering(Y, Pixels(frame, np.full(4, q))) for q in h]
            found = images(Y, frame, sources)
            m = [balance(i, found, [each.X.c for each in sources]) * (found.J[found.at[i, h, h]] > 0) for i in h]
            sums.append(total(m))
    return np.concatenate(sums)


def test_weights_of_all_that_moves_to_one_place_sum_to_1() -> None:
    assert sums_of_weights(PlacedFrame) == pytest.approx(1, rel=1e-12)


def test_shifts_that_do_not_compose_are_noticed() -> None:
    """m compares q and r directly: T_qr must be T_hr T_qh, or some are counted that cannot come, and others not."""
    found = sums_of_weights(Choosy)
    assert found.max() > 1.1
    assert found[found > 0].min() < 0.9


# ---------------------------------------------------------------- what it is short for


@dataclass(frozen=True, eq=False)
class Overlapped(Carried):
    """The previous frame's pixels as sources of `Squares`: the same place, in the pixel where the square has it."""

    def motion(self, index: Array) -> Array:
        """None: the square is of this frame."""
        return 0 * super().motion(index)

    def shift(self, x, index: Array, to: Pixels) -> Shifted:
        squares: Squares = to.of
        place = (self.of.place(x) - Carried.motion(self, to.index)) % 1
        column = squares.holder(to.index, place)
        y = self.of.shift(x, index, Pixels(squares.of, np.maximum(column, 0)))
        return Shifted(Held(y.x, np.maximum(column, 0)), np.where(column >= 0, y.J, 0))


GATHERED = {"a row": ((2,), HALF, 1), "a map": ((2, 2), INTO_THE_MIDDLE, 2), "three rows": ((3, 1), None, 2)}


@pytest.mark.claims("GPT-A05", "GRIS-E36")
@pytest.mark.parametrize(("shape", "by", "axes"), GATHERED.values(), ids=GATHERED)
def test_gathering_is_ris_of_the_overlapped_pixels_by_their_shares_of_confidence(shape, by, axes) -> None:
    """Word for word: shift every sample into the square, and for m back to every other pixel."""
    n = int(np.prod(shape))
    by = np.array([[0.5, 0.0, -0.5], [0.5, -0.5, 0.5]]) if by is None else by
    frame, index = placed_scene(4, n=n, axes=axes).frames[0], np.arange(n * 300)
    Y = initial(Pixels(frame, index), Live(np.random.default_rng(1)))
    Y = replace(Y, c=1.0 + index % 3)
    at = Pixels(Squares(frame, shape, by), index)
    (found,) = into_squares(Y, at, Live(np.random.default_rng(2)))
    old = Overlapped(frame, by)
    sources = [shared_by(entering(Y, Pixels(old, q)), b) for q, b in overlapped(shape, by, index)]
    slow = gris(sources, at, WEIGHTS["talbot"], Live(np.random.default_rng(2)))
    there = slow.W > 0
    assert there.mean() > 0.4
    assert pytest.approx(slow.W, rel=1e-12) == found.X.W
    assert found.X.c == pytest.approx(slow.c, rel=1e-12)
    assert np.array_equal(found.X.x.x[there], slow.x.x[there])
    assert np.array_equal(found.X.x.column[there], slow.x.column[there])


def test_every_sample_is_moved_into_each_pixel_around_it_once() -> None:
    """Of 3 x 3 pixels 40 ordered pairs share a square; the new samples have one shift back, and what is chosen one."""
    c, asked = one_step(gathering, QUARTERS)
    assert asked["shifts"] == (40 + 2 * 9) * 200
    assert (c == 1 + 4 * np.outer([1, 1, 0.25], [1, 1, 0.75]).ravel()).all()


def test_what_has_no_weight_is_not_moved() -> None:
    of, index = sheet(3, 3), np.arange(9)
    Y = initial(Pixels(of, index), Live(np.random.default_rng(1)))
    squares = Squares(of, (3, 3), QUARTERS * np.ones((2, 9)))
    into_squares(replace(Y, W=np.where(index == 4, Y.W, 0)), Pixels(squares, index), Live(np.random.default_rng(1)))
    assert of.asked == Counter({"shifts": 8})


def test_whole_pixels_move_nothing_and_keep_everything() -> None:
    of, index = sheet(3, 3), np.arange(9)
    Y = initial(Pixels(of, index), Live(np.random.default_rng(1)))
    at = Pixels(Squares(of, (3, 3), np.array([[1.0], [0.0]]) * np.ones(9)), index)
    (found,) = into_squares(Y, at, Live(np.random.default_rng(1)))
    assert not of.asked["shifts"]
    assert np.array_equal(found.X.W > 0, index % 3 < 2)
    assert np.array_equal(found.X.x.x[:, index % 3 < 2], Y.x[:, index[index % 3 > 0]])


def test_pixels_that_are_alike_have_one_sample_each_without_variance() -> None:
    """Where rejection keeps none or several, sum m W = sum b = 1."""
    of, index = sheet(5, 5), np.arange(25 * 200)
    Y = initial(Pixels(of, index), Live(np.random.default_rng(1)))
    inner = np.isin(index % 25, [6, 7, 8, 11, 12, 13, 16, 17, 18])
    (found,) = into_squares(
        Y, Pixels(Squares(of, (5, 5), np.full((2, 25), 0.5)), index), Live(np.random.default_rng(2))
    )
    assert found.X.W[inner] == pytest.approx(1, rel=1e-12)


def test_images_are_the_samples_themselves_and_what_shifts_make_of_them() -> None:
    frame, index = placed_scene(3).frames[0], np.arange(2 * 40)
    Y = initial(Pixels(frame, index), Live(np.random.default_rng(1)))
    sources = [shared_by(entering(Y, Pixels(frame, q)), b) for q, b in overlapped((2,), HALF, index)]
    found = images(Y, frame, sources)
    for i, source in enumerate(sources):
        for j, other in enumerate(sources):
            y = frame.shift(source.X.x, source.at.index, other.at)
            there = (source.X.W > 0) & (y.J > 0)
            assert np.array_equal(found.x[found.at[i, j]][there], y.x[there])
            assert found.J[found.at[i, j]][source.X.W > 0] == pytest.approx(y.J[source.X.W > 0])
            assert found.p_hat[found.at[i, j]][there] == pytest.approx(target(other.at, y.x)[there])


def test_where_nothing_was_seen_nothing_is_gathered() -> None:
    of, index = sheet(1, 3), np.arange(3)
    gone = Pixels(Squares(of, (1, 3), np.full((2, 3), 7.0)), index)
    assert into_squares(initial(Pixels(of, index), Live(np.random.default_rng(1))), gone, Live(None)) == []


def test_history_that_gathers_is_capped_when_it_comes_in() -> None:
    scene, index, chance = placed_scene(1), np.arange(2), Live(np.random.default_rng(1))
    X, Y = (initial(Pixels(frame, index), chance) for frame in (scene.now, scene.frames[0]))
    here, at = Pixels(Carried(scene.now, HALF), index), Pixels(Squares(scene.frames[0], (2,), HALF), index)
    assert area_gathering(X, here, replace(Y, c=9.0 * Y.c), at, chance, cap=2.0).c.tolist() == [3.0, 3.0]


# ---------------------------------------------------------------- gradient frames


@pytest.mark.claims("GPT-A02", "GPT-A05", "GPT-E24")
@pytest.mark.parametrize("part", SIGNS)
@pytest.mark.parametrize("seed", range(2))
def test_pairs_that_gather_are_unbiased_in_every_cell(part, seed) -> None:
    scene = placed_scene(seed)
    pairs = pairs_of(scene.now, RING, {part: (part,)})[part]
    assert largest_bias(pair_frames(scene, part, follow=gathering), pairs, scene) < 1e-12


@pytest.mark.claims("GPT-A02", "GPT-A05", "GPT-E24", part="three frames")
@pytest.mark.parametrize("part", SIGNS)
def test_pairs_that_gather_are_unbiased_over_three_frames(part) -> None:
    assert bias_of_three(placed_scene(0, frames=3), part, gathering) < 1e-12


def test_a_second_frame_that_gathers_without_its_sign_is_noticed_in_the_third() -> None:
    scenes = [placed_scene(seed, suffixes=1, frames=3) for seed in range(3)]
    assert max(bias_of_three(scene, "positive", gathering, without_sign) for scene in scenes) > 0.02


@pytest.mark.claims("GPT-A09")
def test_pairs_that_gather_are_unbiased_across_signs() -> None:
    scene = placed_scene(1, suffixes=1)
    pairs = pairs_of(scene.now, RING, ACROSS_SIGNS)["positive"]
    loop = pair_frames(scene, *SIGNS, partners=ACROSS_SIGNS, follow=gathering)
    assert largest_bias(loop, pairs, scene) < 1e-12


@pytest.mark.parametrize("name", ["area shares left out of the sum", "what lies elsewhere is not moved"])
def test_mistakes_in_pairs_that_gather_are_noticed(monkeypatch, name) -> None:
    monkeypatch.setattr(module, *MISTAKES[name])
    scene = placed_scene(0)
    pairs = pairs_of(scene.now, RING, {"positive": ("positive",)})["positive"]
    assert largest_bias(pair_frames(scene, "positive", follow=gathering), pairs, scene) > 0.02


def test_a_frame_of_pixels_alone_is_a_frame_of_reservoirs_that_gather() -> None:
    scene = placed_scene(2)
    views = [{PRIMAL: group({PRIMAL: frame}, gathering)} for frame in scene.frames]
    alone = replace(PRESET, pixels=replace(PRESET.pixels, rounds=0))

    def loop(index, chance):
        at = len(index) // 2
        history = step(views[0], chance, alone, at)
        return step(views[1], chance, PRESET, at, (views[0], history))[PRIMAL][PRIMAL]

    assert largest(loop, scene) < 1e-13

"""Laws of the exact tools behind the figures, against enumeration and against each other; and of chains."""

from itertools import islice

import numpy as np
import pytest

from figures.experiments.chains import chain, images, nobody, random_neighbour, three_of_radius_5
from figures.experiments.exact import (
    Loop,
    accumulated,
    copied,
    integral,
    shaded,
    shaded_beside,
    start,
    step,
    sum_of_weights,
)
from restir_ref.batch import Array
from restir_ref.integrals import Pixels
from restir_ref.mis import WEIGHTS
from restir_ref.oracle.laws import expected_sum
from restir_ref.oracle.moments import copies, drawn, mapped, resampled, reused, variance
from restir_ref.oracle.scenes import offset, three_pixel_scene
from restir_ref.restir import initial, shade, spatial, temporal
from tests.core.stubs import live
from toy1d import image_of_64, overlapping_supports, quotient, two_pixels

CAP = 1


def moments_by_enumeration(frames: int) -> Array:
    """E[I_i] and E[I_i I_j] after two or three frames, every random choice enumerated; (4, 3)."""
    frame = three_pixel_scene().now

    def program(index, chance):
        here = Pixels(frame, index)
        Y = initial(here, chance)
        Y = spatial(Y, here, [offset(frame, index, 1)], chance)
        for _ in range(frames - 1):
            X = temporal(initial(here, chance), here, Y, [Pixels(frame, index)], chance, cap=CAP)
            Y = spatial(X, here, [offset(frame, index, 1)], chance)
        light = shade(Y, here)[0].reshape(-1, 3)
        second = light[:, :, None] * light[:, None, :]
        return np.concatenate([light[:, None], second], axis=1).transpose(1, 0, 2).reshape(4, -1)

    return expected_sum(program, 3)


def moments_by_steps(frames: int, cap: float) -> Array:
    """The same from the loop of moments."""
    loop = Loop(three_pixel_scene().now, cap, (1,))
    Z, c = start(loop, 0), 0.0
    for _ in range(frames):
        Z, c = step(loop, Z, c)
    light = shaded(loop, Z)
    return np.concatenate([light.mean[None], light.second])


def test_the_loop_of_moments_agrees_with_enumeration_and_another_cap_does_not():
    enumerated = moments_by_enumeration(2)
    assert moments_by_steps(2, CAP) == pytest.approx(enumerated, rel=1e-12)
    assert abs(moments_by_steps(2, 2 * CAP) - enumerated).max() > 1e-3


def test_accumulated_and_copied_entries_are_sums_and_copies_of_shaded_frames():
    loop = Loop(quotient(two_pixels(), 8), 5, (1,))
    Z, _ = step(loop, start(loop, 2), 0.0)
    light = shaded(loop, Z)
    for kept in (accumulated(loop, Z), copied(loop, Z)):
        assert shaded_beside(loop, kept).second == pytest.approx(np.tile(light.second, (2, 2)))
    twice = accumulated(loop, accumulated(loop, Z))
    assert variance(twice)[-2:] == pytest.approx(4 * variance(light))


@pytest.mark.parametrize("mis", ["talbot", "pairwise", "defensive"])
def test_quadrature_of_one_pass_agrees_with_moments_on_fine_cells(mis):
    line, counts = overlapping_supports(), np.array([2, 2, 2, 3, 2, 2, 2])
    frame = quotient(line, 336)
    average = copies(drawn(frame), np.repeat(counts, 336))
    on_cells = mapped(resampled(average, [reused(frame, 3, counts, WEIGHTS[mis])]), frame.cells.f[3][None])
    by_nodes = sum_of_weights(line, [(i, counts[i]) for i in (3, 0, 1, 2, 4, 5, 6)], WEIGHTS[mis])
    assert by_nodes == pytest.approx([on_cells.mean[0], variance(on_cells)[0]], rel=1e-3)
    fewer = sum_of_weights(line, [(i, 2) for i in (3, 0, 1, 2, 4, 5, 6)], WEIGHTS[mis])
    assert fewer[1] != pytest.approx(by_nodes[1], rel=1e-2)


def test_random_neighbours_are_others_of_the_same_row_within_the_radius_and_cover_it():
    here = Pixels(image_of_64(), np.arange(64 * 400))
    near = random_neighbour(here, live(), radius=5)
    step = near.index - here.index
    assert (near.index // 64 == here.index // 64).all()
    assert set(np.unique(step)) == {-5, -4, -3, -2, -1, 1, 2, 3, 4, 5}
    inner = step[(here.index % 64 >= 5) & (here.index % 64 < 59)]
    counts = np.bincount(inner + 5)[[0, 1, 2, 3, 4, 6, 7, 8, 9, 10]]
    assert abs(counts / len(inner) - 0.1).max() < 5 * np.sqrt(0.09 / len(inner))


@pytest.mark.parametrize("near", [nobody, three_of_radius_5])
def test_chains_are_unbiased_in_every_frame(near):
    line = image_of_64()
    here, truth = Pixels(line, np.arange(64 * 4000)), np.array([integral(line, i) for i in range(64)])
    for Y in islice(chain(here, 5, near, live()), 4):
        light = images(Y, here).mean(axis=1) / truth.mean()
        assert light.mean() == pytest.approx(1, abs=4 * light.std() / np.sqrt(4000))
        assert light.std() / np.sqrt(4000) < 0.005


def test_cap_0_leaves_out_history_and_a_cap_brings_it_in():
    here = Pixels(image_of_64(), np.arange(64 * 500))
    still = [np.mean(b.x == a.x) for a, b in _pairs(here, 0) + _pairs(here, 20)]
    assert still[0] == 0
    assert still[1] > 0.2


def _pairs(here, cap):
    first, second = islice(chain(here, cap, nobody, live()), 2)
    return [(first, second)]

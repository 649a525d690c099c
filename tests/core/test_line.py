"""A line's columns, holes and mutations, where other laws look at means only."""

from dataclasses import replace

import numpy as np
import pytest

from restir_ref.batch import Array
from restir_ref.decorrelation import wrapped
from tests.core.lines import bent
from tests.core.stubs import live
from toy1d import Line, quotient, two_pixels, walking


@pytest.mark.parametrize("N", range(6))
@pytest.mark.parametrize("start", range(5))
def test_columns_are_replicas_of_the_pixels_from_wherever_they_start(start, N) -> None:
    index = np.arange(start, start + N)
    assert two_pixels().pixel(index).tolist() == [k % 2 for k in index]


def everywhere(i: Array, j: Array, z: Array) -> Array:
    return np.ones(np.broadcast_shapes(i.shape, j.shape, z.shape), dtype=bool)


def shifted_cells(line: Line) -> Array:
    """Whether cells are shifted, by pairs of pixels."""
    return (quotient(line, 6).cells.shifts >= 0).any(axis=-1)


def test_holes_everywhere_leave_a_pixel_its_own_samples_and_nothing_else() -> None:
    assert shifted_cells(replace(bent(), holes=everywhere)).tolist() == np.eye(7, dtype=bool).tolist()
    assert shifted_cells(bent()).all()


# ---------------------------------------------------------------- mutations


def recorded(asked: list, u_new: float):
    """A step that always proposes the same, with a ratio of 3, and keeps what it is asked."""

    def step(u, sigma, chance):
        asked.append((u, sigma))
        return np.full(u.shape, u_new), np.full(u.shape, 3.0)

    return step


def uneven() -> Line:
    return replace(two_pixels(), low=np.array([1.0, -2.0]), high=np.array([5.0, -1.0]))


def test_a_mutation_steps_the_place_within_the_pixel_s_own_domain() -> None:
    asked: list = []
    line = walking(uneven(), 0.125, recorded(asked, 0.25))
    x_new, T_ratio = line.propose(np.arange(4), np.array([2.0, -1.5, 5.0, -2.0]), live())
    ((u, sigma),) = asked
    assert u.tolist() == [0.25, 0.5, 1.0, 0.0]
    assert sigma == 0.125
    assert x_new.tolist() == [2.0, -1.75, 2.0, -1.75]
    assert T_ratio.tolist() == [3.0] * 4


def test_a_sample_that_rounding_put_outside_of_its_domain_steps_from_the_end() -> None:
    asked: list = []
    walking(uneven(), step=recorded(asked, 0.5)).propose(np.arange(2), np.array([5 + 1e-9, -2 - 1e-9]), live())
    assert asked[0][0].tolist() == [1.0, 0.0]


def test_mutations_are_wrapped_steps_of_a_fiftieth_of_the_domain_unless_others_are_asked_for() -> None:
    line, index = walking(uneven()), np.zeros(20_000, dtype=int)
    assert (line.sigma, line.step) == (0.02, wrapped)
    assert type(line)(line.f, line.low, line.high).sigma == 0.02
    x_new, _ = line.propose(index, np.full(20_000, 3.0), live())
    assert (x_new - 3).std() == pytest.approx(0.02 * 4, rel=0.02)


def test_a_line_that_walks_is_the_line_in_all_else() -> None:
    line = bent()
    assert all(getattr(walking(line), name) is getattr(line, name) for name in ("f", "low", "high", "chart", "holes"))

"""Laws of the continuous toys: shifts and their Jacobians, supports, integrals, and quotients with finite cells."""

import numpy as np
import pytest
from scipy.special import erf

from restir_ref.batch import Array
from restir_ref.integrals import Pixels
from tests.core.lines import LINES, Inverted, Rounding, Slack, Spilling, bent, made, truth
from tests.core.stubs import live
from toy1d import Line, overlapping_supports, quotient

every_line = pytest.mark.parametrize("line", [make() for make in LINES.values()], ids=LINES)

# ---------------------------------------------------------------- shifts


def pairs(line: Line) -> tuple[Pixels, Pixels]:
    """All ordered pairs of pixels, as many columns for each."""
    i, j = np.repeat(np.indices((line.n, line.n)).reshape(2, -1), -(-9800 // line.n**2), axis=1)
    return Pixels(line, i), Pixels(line, j)


def positions(line: Line, at: Pixels) -> Array:
    (x, _), *_ = line.candidates(at.index, live())
    return x


def shift_error(line) -> float:
    """Largest of |T_ji(T_ij(x)) - x| and |J_ij J_ji - 1| where T_ij is defined."""
    here, there = pairs(line)
    x = positions(line, here)
    y = line.shift(x, here.index, there)
    back = line.shift(y.x, there.index, here)
    return float(max(abs(back.x - x)[y.J > 0].max(), abs(back.J * y.J - 1)[y.J > 0].max()))


def jacobian_error(line, h=1e-5) -> float:
    """Largest relative distance of J from the central difference of T_ij, where T_ij is defined around x."""
    here, there = pairs(line)
    x = positions(line, here)
    below, y, above = (line.shift(x + by, here.index, there) for by in (-h, 0, h))
    inside = (below.J > 0) & (y.J > 0) & (above.J > 0)
    return float(abs((above.x - below.x) / (2 * h) / np.where(inside, y.J, 1) - 1)[inside].max())


def support_faults(line) -> list[str]:
    """What is wrong with where the shifts of a line are defined, and where they lead."""
    here, there = pairs(line)
    x = positions(line, here)
    y = line.shift(x, here.index, there)
    z = line.chart.to(here.index, x)
    image = line.chart.back(there.index, z)
    hole = line.holes(here.index, there.index, z)
    reached = (image >= line.low[there.index]) & (image < line.high[there.index]) & ~hole
    within = (y.x >= line.low[there.index]) & (y.x < line.high[there.index])
    answers = {
        "defined elsewhere": (y.J > 0) != reached,
        "outside": ~within,
        "dark": line.target(there.index, y.x) != line.f(there.index, y.x),
    }
    return [fault for fault, wrong in answers.items() if wrong.any()]


@pytest.mark.claims("GRIS-E35")
@every_line
def test_shifts_return_and_their_jacobians_are_reciprocal(line):
    assert shift_error(line) < 1e-12


@pytest.mark.claims("GRIS-E35")
@every_line
def test_jacobians_are_the_derivatives_of_the_shifts(line):
    assert jacobian_error(line) < 1e-6


@every_line
def test_a_shift_is_defined_where_its_image_lies_in_the_domain_and_in_no_hole(line):
    assert support_faults(line) == []


@pytest.mark.parametrize("kind", [Slack, Inverted])
def test_a_wrong_jacobian_is_noticed(kind):
    assert jacobian_error(made(kind, bent())) > 0.1


def test_a_shift_that_does_not_quite_return_is_noticed():
    assert shift_error(made(Rounding, bent())) > 1e-9


@pytest.mark.parametrize("line", [bent(), overlapping_supports()], ids=["bent", "overlapping_supports"])
def test_shifts_beyond_the_domains_or_into_holes_are_noticed(line):
    assert "defined elsewhere" in support_faults(made(Spilling, line))


def test_the_bent_line_has_what_makes_these_laws_bite():
    line = bent()
    here, there = pairs(line)
    J = line.shift(positions(line, here), here.index, there).J
    assert 0.01 < (J == 0).mean() < 0.2
    assert J.max() / J[J > 0].min() > 2


# ---------------------------------------------------------------- truth


def closed_form(low, high, centre, sd, floor, height):
    """int over [low, high] of floor + height exp(-(x - centre)^2 / (2 sd^2))."""
    gauss = erf((high - centre) / (sd * np.sqrt(2))) - erf((low - centre) / (sd * np.sqrt(2)))
    return floor * (high - low) + height * sd * np.sqrt(np.pi / 2) * gauss


def test_the_toys_have_the_integrals_that_their_docstrings_say():
    d = np.arange(-3, 4)
    seven = closed_form(0.2 + 0.08 * abs(d), 0.8 + 0.08 * d, 0.5 + 0.08 * d, 0.12, 0.1, 1)
    assert truth("overlapping_supports") == pytest.approx(seven, rel=1e-10)
    assert truth("two_pixels") == pytest.approx([1, closed_form(0, 1, 0.6, 0.15 / np.sqrt(2), 0.2, 3)], rel=1e-10)


def quotient_error(name: str, K: int) -> float:
    """Largest relative error of sum f v over the cells that the sampler covers."""
    tables = quotient(LINES[name](), K).cells
    return float(abs((tables.f * tables.v * (tables.pdf[0] > 0)).sum(axis=-1) / truth(name) - 1).max())


@pytest.mark.parametrize("name", LINES)
def test_quotients_converge_to_the_integrals_at_least_with_the_square_of_the_cell(name):
    """Multiples of 21 put the ends of all domains on ends of cells."""
    errors = np.array([quotient_error(name, 21 * k) for k in (4, 8, 16)])
    assert errors[2] < 1e-3
    assert (errors[1:] < np.maximum(errors[:2] / 2**1.9, 1e-6)).all()  # whole waves are exact at once


def test_a_quotient_whose_cells_miss_the_ends_of_the_domains_is_noticed():
    assert quotient_error("overlapping_supports", 20) > 10 * quotient_error("overlapping_supports", 21)


def cell_middles(line: Line, K: int) -> tuple[Array, Array]:
    """The middles of K cells, even in z, as positions x in every pixel, and whether they are in its domain; (n, K)."""
    pixel = np.arange(line.n)[:, None]
    ends = line.chart.to(pixel, np.stack([line.low, line.high], axis=-1))
    z = ends.min() + np.ptp(ends) * (np.arange(K) + 0.5) / K
    x = line.chart.back(pixel, np.broadcast_to(z, (line.n, K)))
    return x, (x >= line.low[:, None]) & (x < line.high[:, None])


@every_line
def test_cells_have_the_volumes_densities_and_shifts_of_the_line(line):
    cells = quotient(line, 42).cells
    x, inside = cell_middles(line, 42)
    assert (cells.v * inside).sum(axis=-1) == pytest.approx(line.high - line.low, rel=1e-12)
    pixel, low, size = np.arange(line.n)[:, None], line.low[:, None], (line.high - line.low)[:, None]
    s = np.where(inside, (x - low) / size, 0)
    for each, pdf in zip(line.techniques, cells.pdf, strict=True):
        p = inside * each.pdf(pixel, s)
        assert ((pdf > 0) == (p > 0)).all()
        factor = np.where(p > 0, pdf / np.where(p > 0, p, 1), np.nan)
        assert (np.nanmax(factor, axis=-1) / np.nanmin(factor, axis=-1)).max() == pytest.approx(1, abs=1e-11)
    i, j, cell = np.indices(cells.shifts.shape).reshape(3, -1)
    defined = inside[i, cell] & (line.shift(x[i, cell], i, Pixels(line, j)).J > 0)
    assert (cells.shifts[i, j, cell] == np.where(defined, cell, -1)).all()


@every_line
def test_targets_and_integrands_vanish_outside_the_domains(line):
    index = np.arange(line.n)
    for x in (line.high, line.low - 1e-9):
        assert not line.target(index, x).any()
        assert not line.pdf(index, x).any()
        assert not line.contribution(index, x).any()
    for x in (line.low, line.high - 1e-9):
        assert (line.target(index, x) == line.f(index, x)).all()

"""The toys are what their docstrings say: integrals in closed form, samplers against their densities, colours."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import erf

from figures.claims.criteria import biased, unbiased
from figures.experiments.exact import integral
from restir_ref.batch import Array
from restir_ref.integrals import Pixels
from restir_ref.restir import initial, resample, shade
from tests.core.stubs import live
from toy1d import TOYS, Line, Technique, known_densities, three_channels
from toy1d.pictures import PICTURES, noisy, speckled

# ---------------------------------------------------------------- integrals


def bump(centre, width) -> Array:
    """int_0^1 exp(-((x - centre) / width)^2) dx."""
    return width * np.sqrt(np.pi) / 2 * (erf((1 - centre) / width) - erf(-centre / width))


I64 = np.arange(64)
CLOSED = {
    "known_densities": [1, 0.1 + bump(0.3, 0.08) + bump(0.75, 0.05) / 2],
    "three_channels": [1],
    "degrading_neighbours": np.full(65, 0.1 * 16 / 15),
    "overstating_neighbours": np.full(7, 0.1 + bump(0.5, 0.12 * np.sqrt(2))),
    "image_of_64": (1 + 0.6 * np.sin(4 * np.pi * I64 / 63)) * (0.05 + bump(0.15 + 0.7 * I64 / 63, 0.04)),
    "ring_of_8": 0.02 + bump(0.5 + 0.2 * np.sin(np.pi * np.arange(8) / 4), 0.12 * np.sqrt(2)),
}


def largest_error(line: Line, truth) -> float:
    return float(abs(np.array([integral(line, i) for i in range(line.n)]) / truth - 1).max())


@pytest.mark.parametrize("name", CLOSED)
def test_integrals_have_the_closed_form_of_the_docstring(name):
    assert largest_error(TOYS[name](), CLOSED[name]) < 1e-7


@pytest.mark.parametrize("name", CLOSED)
def test_an_integrand_that_is_off_in_one_pixel_is_noticed(name):
    line = TOYS[name]()
    off = replace(line, f=lambda pixel, x: line.f(pixel, x) * np.where(pixel == line.n - 1, 1.001, 1))
    assert largest_error(off, CLOSED[name]) > 1e-4


# ---------------------------------------------------------------- samplers


def distribution_error(technique: Technique, pixel: int, n: int = 20_000) -> float:
    """Largest |P(S <= s) - int_0^s p|, both by the midpoint rule."""
    middles = (np.arange(n) + 0.5) / n
    index = np.full(n, pixel)
    upto = np.cumsum(technique.pdf(index, middles)) / n
    found = np.searchsorted(np.sort(technique.sample(index, middles)), middles + 0.5 / n, side="right") / n
    return float(max(abs(found - upto).max(), abs(upto[-1] - 1)))


TECHNIQUES = [(name, t, pixel) for name in TOYS for t, _ in enumerate(TOYS[name]().techniques) for pixel in (0, -1)]


@pytest.mark.parametrize(("name", "t", "pixel"), TECHNIQUES)
def test_samplers_have_the_density_they_claim(name, t, pixel):
    line = TOYS[name]()
    assert distribution_error(line.techniques[t], pixel % line.n) < 1e-3


@pytest.mark.parametrize("name", ["degrading_neighbours", "overstating_neighbours"])
def test_the_centre_samples_otherwise_than_its_neighbours(name):
    line = TOYS[name]()
    centre, x = line.n // 2, np.linspace(0.01, 0.99, 99)
    assert distribution_error(line.techniques[0], centre) < 1e-3
    assert abs(line.pdf(np.full(99, centre), x) - line.pdf(np.full(99, centre + 1), x)).max() > 0.5


def test_a_sampler_of_another_density_is_noticed():
    assert distribution_error(Technique(lambda pixel, u: u**2, lambda pixel, s: 2 * s), 0) > 0.1


def test_neighbours_that_degrade_have_a_constant_ratio_of_integrand_and_density():
    line, x = TOYS["degrading_neighbours"](), np.linspace(0.15, 0.24, 50)
    ratio = line.f(np.full(50, 8), x) / line.pdf(np.full(50, 8), x)
    assert ratio == pytest.approx(np.full(50, integral(line, 8)), rel=1e-6)


# ---------------------------------------------------------------- RIS with known densities


def groups_of_means(values: Array) -> Array:
    return values.reshape(64, -1).mean(axis=1)


def balanced(here: Pixels) -> Array:
    """RIS with m_i = p_i / sum_j p_j."""
    return shade(initial(here, live()), here)[0]


def evenly(here: Pixels) -> Array:
    """The mistake: RIS with m_i = 1/M, though one density misses half the domain."""
    line = here.of
    alone = [replace(line, techniques=(each,)) for each in line.techniques]
    drawn = [(x, W / 3) for each in alone for x, W in each.candidates(here.index, live(2))]
    return shade(resample(drawn, here, live(3)), here)[0]


@pytest.mark.claims("GRIS-E05", "GPT-E05")
@pytest.mark.parametrize("pixel", [0, 1])
def test_ris_with_three_densities_is_unbiased_and_with_even_weights_is_not(pixel):
    line = known_densities()
    here, truth = Pixels(line, np.full(64_000, pixel)), integral(line, pixel)
    assert unbiased(groups_of_means(balanced(here)), truth).passed
    assert biased(groups_of_means(evenly(here)), truth, -1, -0.01).passed


COLUMNS = 64 * 4000
FUNCTIONS = {
    "p_hat": lambda line, pixel, x: line.f(pixel, x),
    "left half": lambda line, pixel, x: np.where(x < 0.5, 1.0, 0.0),
    "another bump": lambda line, pixel, x: np.exp(-(((x - 0.6) / 0.2) ** 2)),
}
"""Of them only the first is the target."""


def integrated(pixel: int, name: str) -> float:
    """int f by the midpoint rule."""
    x = (np.arange(20_000) + 0.5) / 20_000
    return float(FUNCTIONS[name](known_densities(), np.full(len(x), pixel), x).mean())


def selected_by_ris(pixel: int, name: str) -> tuple[Array, Array, Array]:
    """f(Y), W_Y and 1 / p(Y) of RIS over one candidate of each technique, all as likely: p = (p_1 + p_2 + p_3) / 3."""
    line = known_densities()
    here = Pixels(line, np.full(COLUMNS, pixel))
    Y = initial(here, live(4))
    p = sum(each.pdf(here.index, Y.x) for each in line.techniques) / 3
    return FUNCTIONS[name](line, here.index, Y.x), Y.W, 1 / p


every_function = pytest.mark.parametrize(("pixel", "name"), [(pixel, name) for pixel in (0, 1) for name in FUNCTIONS])


@pytest.mark.claims("GRIS-E03", part="continuous, T1")
@every_function
def test_ris_integrates_functions_that_are_not_its_target(pixel, name):
    f, W, _ = selected_by_ris(pixel, name)
    assert unbiased(groups_of_means(f * W), integrated(pixel, name)).passed


@pytest.mark.claims("GRIS-E03", part="continuous, T1")
@every_function
def test_the_reciprocal_density_of_the_chosen_candidate_integrates_nothing(pixel, name):
    f, _, one_over_p = selected_by_ris(pixel, name)
    found, truth = groups_of_means(f * one_over_p), integrated(pixel, name)
    assert biased(found, truth, -1, -0.01).passed or biased(found, truth, 0.01, np.inf).passed


# ---------------------------------------------------------------- colours and pictures


def test_the_colour_toy_has_three_channels_that_integrate_to_1_and_a_chroma_of_mean_1():
    line, x = three_channels(), (np.arange(1000) + 0.5) / 1000
    colour = line.contribution(np.zeros(1000, dtype=int), x)
    assert colour.mean(axis=1) == pytest.approx([1, 1, 1])
    assert colour.mean(axis=0) == pytest.approx(line.target(np.zeros(1000, dtype=int), x))
    assert np.ptp(colour / colour.mean(axis=0), axis=1).min() > 0.5


@pytest.mark.parametrize("name", PICTURES)
def test_noise_has_the_mean_and_the_spread_that_was_asked_for(name):
    many = np.broadcast_to(PICTURES[name](), (400, *PICTURES[name]().shape))
    plain, outliers = noisy(many, 0.3, live()) - many, speckled(many, 0.05, 2.0, live(2)) - many
    n = np.sqrt(many.size)
    assert abs(plain.mean()) < 4 * 0.3 / n
    assert plain.std() == pytest.approx(0.3, rel=4 / n)
    assert abs(outliers.mean()) < 4 * 2 * np.sqrt(0.05) / n
    assert (outliers != 0).mean() == pytest.approx(0.05, abs=4 * np.sqrt(0.05) / n)

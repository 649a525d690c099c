"""Values that travel with samples are unbiased under three conditions, each exact over all outcomes, each necessary.

A finite model of what is resampled: a sample is a cell with a value in two channels that its own pixel has looked up;
pixels disagree about the values.  Selection may use the values, weights may only see the cell.  [DDGIR 3.6]
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
import pytest

from restir_ref.batch import Array, ratio
from restir_ref.chance import Chance
from restir_ref.integrals import Pixels, Reservoirs, Shifted
from restir_ref.mis import WEIGHTS
from restir_ref.oracle.laws import bias_of, expected_sum
from restir_ref.restir import initial, spatial, temporal

PIXELS, CELLS = 2, 4


@dataclass(frozen=True)
class Valued:
    """A cell (N,) and the value (2, N) that was looked up for it."""

    cell: Array
    value: Array


def mean_times_mean(f: Array, value: Array) -> Array:
    return np.asarray(f.mean(axis=0) * value.mean(axis=0))


def mean_of_products(f: Array, value: Array) -> Array:
    """A mistake: MIS weights then depend on the value, about which pixels disagree."""
    return np.asarray((f * value).mean(axis=0))


@dataclass(frozen=True, eq=False)
class Cells:
    """f (2, n, K) from each pixel, values (2, n, K) as each pixel knows them, densities pdf (n, K); volumes are 1."""

    f: Array
    values: Array
    pdf: Array
    rule: Callable[[Array, Array], Array] = mean_times_mean
    n: int = PIXELS

    def candidates(self, index: Array, chance: Chance) -> Iterator[tuple[Valued, Array]]:
        pixel = index % self.n
        cell = chance.choose(self.pdf[pixel].T)
        yield Valued(cell, self.values[:, pixel, cell]), ratio(np.ones(len(index)), self.pdf[pixel, cell])

    def target(self, index: Array, x: Valued) -> Array:
        return self.rule(self.f[:, index % self.n, x.cell], x.value)

    def contribution(self, index: Array, x: Valued) -> Array:
        return self.target(index, x)[None]

    def shift(self, x: Valued, index: Array, to: Pixels) -> Shifted:
        return Shifted(x, np.ones(len(to.index)))


def cells(rule=mean_times_mean) -> Cells:
    """Each pixel sees nothing of one cell, and its candidates do not cover that one."""
    hidden = np.arange(CELLS) != np.arange(PIXELS)[:, None]
    pdf = np.random.default_rng(1).uniform(0.2, 1, (PIXELS, CELLS)) * hidden
    f, values = (np.exp(np.random.default_rng(k).normal(size=(2, PIXELS, CELLS))) for k in (2, 3))
    return Cells(f * hidden, values, pdf / pdf.sum(axis=1, keepdims=True), rule)


def untouched(of: Cells, here: Pixels, X: Reservoirs) -> Reservoirs:
    return X


def looked_up_again(of: Cells, here: Pixels, X: Reservoirs) -> Reservoirs:
    """A mistake: W is divided by what this pixel looks up, not by what the sample was selected with."""
    anew = Valued(X.x.cell, of.values[:, here.index % of.n, X.x.cell])
    return replace(X, W=X.W * ratio(of.target(here.index, X.x), of.target(here.index, anew)))


Shown = Callable[[Cells, Array, Valued], Array]
"""The value (2, N) that a pixel shades with."""


def own(of: Cells, index: Array, x: Valued) -> Array:
    return of.values[:, index % of.n, x.cell]


def as_kept(of: Cells, index: Array, x: Valued) -> Array:
    """A mistake: what was looked up for another pixel."""
    return x.value


def shaded(of: Cells, value: Shown) -> Array:
    """Exact mean image over its truth, (2, n), after reuse between the pixels."""

    def program(index: Array, chance: Chance) -> Array:
        here, near = Pixels(of, index), [Pixels(of, index - index % PIXELS + (index + 1) % PIXELS)]
        X = spatial(initial(here, chance), here, near, chance)
        return np.asarray(of.f[:, index % of.n, X.x.cell] * value(of, index, X.x) * X.W)

    return expected_sum(program, PIXELS) / (of.f * of.values).sum(axis=-1)


def largest_bias(of: Cells, mis: str, after=untouched) -> float:
    """Exact, over two frames with a neighbour."""

    def program(index: Array, chance: Chance) -> Reservoirs:
        here, near = Pixels(of, index), [Pixels(of, index - index % PIXELS + (index + 1) % PIXELS)]
        X = after(of, here, spatial(initial(here, chance), here, near, chance, mis=WEIGHTS[mis]))
        X = after(of, here, temporal(initial(here, chance), here, X, near, chance, mis=WEIGHTS[mis]))
        return replace(X, x=X.x.cell)

    return float(np.abs(bias_of(program, np.ones((PIXELS, CELLS)), of.f.mean(axis=0) > 0)).max())


@pytest.mark.claims("DDGIR-C03", part="finite cells")
@pytest.mark.claims("DDGIR-A08", part="finite cells")
@pytest.mark.parametrize("mis", ["talbot", "defensive", "1/Z"])
def test_kept_values_are_unbiased_in_every_cell(mis) -> None:
    assert largest_bias(cells(), mis) < 1e-12


@pytest.mark.claims("DDGIR-C03", part="controls on finite cells")
def test_weights_that_see_the_value_are_biased() -> None:
    assert largest_bias(cells(mean_of_products), "talbot") > 0.01


@pytest.mark.claims("DDGIR-A08", part="controls on finite cells")
def test_dividing_by_another_value_than_the_one_selected_with_is_biased() -> None:
    assert largest_bias(cells(), "talbot", looked_up_again) > 0.05


@pytest.mark.claims("DDGIR-C03", part="controls on finite cells")
def test_a_value_of_0_where_another_pixel_sees_light_is_biased() -> None:
    right = cells()
    values = right.values.copy()
    values[:, 0, 2] = 0
    assert largest_bias(replace(right, values=values), "talbot") > 0.05


@pytest.mark.claims("DDGIR-C03", part="finite cells")
def test_shading_with_what_the_pixel_itself_looks_up_is_unbiased() -> None:
    np.testing.assert_allclose(shaded(cells(), own), 1, rtol=1e-12)


@pytest.mark.claims("DDGIR-C03", part="control on finite cells")
def test_shading_with_the_kept_value_is_biased() -> None:
    assert np.abs(shaded(cells(), as_kept) - 1).max() > 0.05

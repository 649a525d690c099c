"""The skeletons of CONTRIBUTING.md work as they stand, and each keeps the law it is meant for."""

import re
import sys
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from figures.claims.figure import verdict_of
from figures.engine.registry import faults
from restir_ref import Live, Pixels, initial, shade
from restir_ref.oracle.zoo import exact_bias
from restir_ref.transport.proofs.judge import judge
from restir_ref.transport.proofs.shift_checks import Effort
from tests.checkout import ROOT
from toy1d import Line


@pytest.fixture(scope="module")
def skeletons() -> Any:
    """The page's code blocks, run in order in one module."""
    page = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    module = ModuleType("skeletons")
    sys.modules[module.__name__] = module
    for block in re.findall(r"```python\n(.*?)```", page, re.DOTALL):
        exec(block, vars(module))
    yield module
    del sys.modules[module.__name__]


def test_every_skeleton_is_announced_by_a_marker():
    page = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    assert page.count("```python\n") == len(re.findall(r"<!-- skeleton: .+ -->\n```python\n", page)) == 7


def test_the_weight_passes_its_law_and_the_twin_fails_it(skeletons):
    for name in skeletons.UNBIASED:
        skeletons.test_spatial_reuse_is_unbiased_in_every_cell(name)
    skeletons.test_constant_weights_over_unequal_supports_are_noticed()


def test_the_integrals_integrate(skeletons):
    here = Pixels(skeletons.Ramps(np.array([0.0, 2.0])), np.arange(20_000))
    estimates = shade(initial(here, Live(np.random.default_rng(1))), here).reshape(-1, 2)
    error = estimates.std(axis=0) / np.sqrt(len(estimates))
    assert np.all(error < 0.01)
    assert np.all(abs(estimates.mean(axis=0) - [0.5, 2.5]) < 4 * error)


def test_the_shift_returns_and_its_jacobian_is_its_derivative(skeletons):
    line = Line(lambda pixel, x: x, np.full(2, 0.1), np.full(2, 9.0), skeletons.SCALING)
    x, h = np.linspace(0.2, 3.0, 50), 1e-6
    here, there = (Pixels(line, np.full(x.shape, pixel)) for pixel in (0, 1))
    y = line.shift(x, here.index, there)
    back = line.shift(y.x, there.index, here)
    difference = line.shift(x + h, here.index, there).x - line.shift(x - h, here.index, there).x
    np.testing.assert_allclose(back.x, x)
    np.testing.assert_allclose(back.J * y.J, 1)
    np.testing.assert_allclose(difference / (2 * h), y.J, rtol=1e-6)


def test_the_path_shifts_are_acquitted_and_a_refusal_one_way_is_not(skeletons):
    def careless(t, x, pixel):
        y, J = skeletons.shift_path(t, x, pixel)
        return y, np.where(J <= 2, J, 0.0)

    def judged(of):
        return judge(of, Live(np.random.default_rng(1)), Effort(paths=5000, jacobians=60))

    assert judged(skeletons.TURNED).green
    assert judged(skeletons.CAREFUL).green
    assert "defined back" in judged(skeletons.Shifting(skeletons.tracer, careless)).red


def test_the_bug_is_biased_where_the_right_loop_is_not(skeletons):
    bug = skeletons.UNIT_JACOBIAN
    right, wrong = (exact_bias(loop(bug.scene()), bug.scene()) for loop in (bug.right, bug.wrong))
    assert abs(right).max() < 1e-12
    assert abs(wrong).max() > 0.1


def test_the_figure_reproduces_its_claim(skeletons):
    figure = skeletons.FIGURE
    quick = figure.presets["quick"]
    rngs = map(np.random.default_rng, range(quick["groups"]))
    parts = [figure.compute(quick, chunk, rng=rng) for chunk, rng in zip(figure.chunks(quick), rngs, strict=True)]
    arrays = figure.combine(quick, parts)
    assert list(faults(figure)) == []
    assert {verdict_of(claim) for claim in figure.check(arrays)} == {"reproduced"}
    assert {verdict_of(claim) for claim in figure.check({"estimate": 1.1 * arrays["estimate"]})} != {"reproduced"}
    assert figure.draw(arrays).axes

"""What ends a path, exact: the control of recursion, and of what a query's cosine filters."""

import numpy as np
import pytest

from figures.claims.criteria import biased, unbiased
from figures.experiments.deep import direct, truth
from figures.experiments.traced import Traced, filtered, narrow
from flatland2d.scenes import glossy_cornell
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.transport.baselines import probes as baselines
from restir_ref.transport.cache import shading as module
from restir_ref.transport.cache.footprint import as_wide_as_in_space
from restir_ref.transport.cache.integrals import cache_integrals
from restir_ref.transport.cache.leaving import Cache
from restir_ref.transport.cache.shading import Shading, plain, recursive
from restir_ref.transport.paths import RECONNECTION, Tracer

REPLICAS, SAMPLES = 64, 1600
ROOM = "glossy_cornell"


def mean_images(shading: Shading, towards) -> Array:
    """Means of the inset by secondary queries, replica by replica, over the truth."""
    setting, chance = glossy_cornell(), Live(np.random.default_rng(4))
    cache = Cache(setting.scene, Traced(setting.scene, np.full(2, 0.1), chance, towards))
    t = Tracer(setting.scene, setting.pinhole(), 1, RECONNECTION)
    index = np.arange(REPLICAS * SAMPLES)
    first = cache_integrals(t, cache, chance.uniform((1, len(index))), index % t.sensor.n, np.inf)
    L = baselines.secondary(first, index, shading, chance)[0]
    expected = (truth(ROOM) - direct(ROOM))[index % t.sensor.n]
    return L.reshape(SAMPLES, REPLICAS).mean(axis=0) / expected.reshape(SAMPLES, REPLICAS).mean(axis=0)


@pytest.mark.claims("DDGIR-A05", part="exact light at the end")
@pytest.mark.parametrize("shading", [plain, recursive(as_wide_as_in_space(2)), recursive(np.inf, 3)])
def test_where_what_ends_a_path_is_exact_secondary_queries_have_the_mean_of_all_light(shading) -> None:
    assert unbiased(mean_images(shading, narrow), 1.0, eps=0.01).passed


def test_a_query_about_a_narrow_lobe_filters_and_errs() -> None:
    """-7.4 % at x_2: the error that specular recursion is there to lower, without a probe."""
    assert biased(mean_images(plain, filtered), 1.0, -0.2, -0.01).passed


def test_a_recursion_that_forgets_lamps_on_its_way_errs(monkeypatch) -> None:
    monkeypatch.setattr(module, "emitted", lambda s, v: np.zeros((s.C, v.x.shape[-1])))
    assert not unbiased(mean_images(recursive(as_wide_as_in_space(2)), narrow), 1.0, eps=0.01).passed

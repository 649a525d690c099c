"""What sharing trees saves, counted exactly where a tree costs 5 rays and a shift 3: as `bench_gradient` counts it."""

from collections import Counter
from dataclasses import dataclass, field

import numpy as np
import pytest

from restir_ref.chance import Live
from restir_ref.gradient_loop import GRADIENT, PRIMAL, SAME_SIGN, Group, forward, pairs_of, step
from restir_ref.images import random_in_disk
from restir_ref.oracle.film import FilmFrame, film_scene
from restir_ref.transport.counting import CLOSEST, SHADOW
from tests.checkout import ROOT

TREE, SHIFT, SHAPE = 5, 3, (3, 4)
PAIRS = sum(ends.shape[1] for ends, _ in forward(SHAPE).values()) / 12
"""Per pixel: 9 along rows and 8 along columns."""


@dataclass(frozen=True, eq=False)
class Priced(FilmFrame):
    """A frame that asks for as many rays per tree and per shift."""

    asked: Counter = field(default_factory=Counter)

    def candidates(self, index, chance):
        self.asked[CLOSEST] += TREE * len(index)
        return super().candidates(index, chance)

    def shift(self, x, index, to):
        self.asked[SHADOW] += SHIFT * len(index)
        return super().shift(x, index, to)


@pytest.fixture
def bench(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "benchmarks"))
    import bench_gradient  # noqa: PLC0415  (found by the line before)

    return bench_gradient


def priced(bench):
    """Three by four pixels that stand still, with the pairs of both directions, after their first frame."""
    asked, n = Counter(), int(np.prod(SHAPE))
    frame = film_scene(0, n).now
    image = Priced(frame.cells, n, frame.t, frame.labels, asked)

    def group(of, shape, count):
        return Group(of, shape, np.zeros((2, count)), random_in_disk(shape), np.zeros(count, dtype=bool))

    view = {PRIMAL: group({PRIMAL: image}, SHAPE, n)}
    for name, (ends, shape) in forward(SHAPE).items():
        view[name] = group(pairs_of(image, ends, SAME_SIGN), shape, ends.shape[1])
    return bench.Scene(view, asked, (view, step(view, Live(bench.rng()), GRADIENT, bench.REPLICAS)))


def of_pairs(pixels: float, pairs: float) -> float:
    """Rays per pixel from those of every pixel and of every pair."""
    return pixels + PAIRS * pairs


def test_trees_that_all_share_cost_as_many_rays_as_their_shifts_alone(bench) -> None:
    """A pair shifts the trees of both its pixels, once for both signs; who draws anew pays for the trees as well."""
    pair, drawn = 2 * SHIFT, 2 * (TREE + SHIFT)
    expected = {"primal": TREE, "one tree for all": of_pairs(TREE, pair)}
    expected |= {"own trees of pairs": of_pairs(TREE, drawn), "own trees of reservoirs": of_pairs(TREE, 2 * drawn)}
    assert bench.counts(priced(bench), bench.started) == pytest.approx(expected, rel=1e-12)


def test_reuse_in_time_costs_the_same_however_trees_are_drawn(bench) -> None:
    """There and back: 2 shifts of every pixel, and for both signs of every pair 2 of 2 paths each."""
    pixel, pair = 2 * SHIFT, 2 * 2 * 2 * SHIFT
    on = priced(bench)
    fresh, whole = bench.counts(on, bench.started), bench.counts(on, bench.framed)
    assert whole["primal"] - fresh["primal"] == pixel
    for name in bench.WAYS:
        assert whole[name] - fresh[name] == pytest.approx(of_pairs(pixel, pair), rel=1e-12)


def test_trees_drawn_twice_for_one_reader_are_noticed(bench, monkeypatch) -> None:
    """A mistake: `first` that draws what it has been given."""
    monkeypatch.setitem(bench.WAYS, "one tree for all", bench.own_trees_of_pairs)
    count = bench.counts(priced(bench), bench.started)
    assert count["one tree for all"] > 1.5 * of_pairs(TREE, 2 * SHIFT)

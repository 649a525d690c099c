"""Pairs of pixels on paths: their weights, their inner and outer shifts, and whose motion they follow.  [GPT 3-4]"""

from collections import Counter
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from figures.experiments.gradients import ADAPTIVE, displacement, gradient_view
from figures.experiments.realtime import approach
from figures.experiments.references import reference
from figures.experiments.views import HYBRID, setting, standard
from restir_ref.area import Displaced, overlapped, still
from restir_ref.batch import Array, take
from restir_ref.chance import Live
from restir_ref.gradient import MAGNITUDE, Pairs, gap, gradient_after, one_sided
from restir_ref.gradient_loop import GRADIENT, PRIMAL, forward, nearer
from restir_ref.integrals import NOWHERE, Pixels, Reservoirs, Shifted, held, shifted, target, times
from restir_ref.restir import initial
from restir_ref.transport.edges import edges, seen
from restir_ref.transport.paths import Tracer
from restir_ref.transport.restir_pt import PathIntegrals
from tracer3d.gbuffer import gbuffer
from tracer3d.scenes import checker


def image(scene: str) -> PathIntegrals:
    s = setting(scene)
    return PathIntegrals(Tracer(s.scene, standard(scene), s.depth, HYBRID))


def columns(of: PathIntegrals, replicas: int) -> Pixels:
    return Pixels(of, np.arange(replicas * of.n))


# ---------------------------------------------------------------- the symmetric form


def halves(X: Reservoirs, base: Pixels, offset: Pixels) -> Array:
    """A mistake: w = 1/2 everywhere, also where the shift is undefined."""
    y = shifted(X.x, base, offset)
    return times(gap(X.x, base, y, offset), X.W) / 2


def probe(term: Callable[[Reservoirs, Pixels, Pixels], Array]) -> Array:
    """sum of estimated differences, signed as they should be, over what it should be: groups of replicas of a row."""
    of, truth = image("occluders"), np.diff(reference("occluders").mean)
    X = initial(columns(of, 1600), Live(np.random.default_rng(1)))
    j, i = (Pixels(of, np.arange(1600 * of.n).reshape(1600, of.n)[:, part].ravel()) for part in (np.s_[:-1], np.s_[1:]))
    found = (term(held(X, i), i, j) - term(held(X, j), j, i)).mean(axis=0).reshape(40, -1, len(truth))
    return np.asarray((found.mean(axis=1) * np.sign(truth)).sum(axis=-1) / abs(truth).sum())


def z(values: Array, truth: float) -> float:
    return float((values.mean() - truth) / values.std(ddof=1) * len(values) ** 0.5)


@pytest.mark.claims("GPT-E03", part="flatland, to 2%")
def test_differences_of_a_row_by_shifts_with_holes_are_unbiased() -> None:
    right, wrong = probe(one_sided), probe(halves)
    assert abs(z(right, 1)) < 4
    assert right.std(ddof=1) / 40**0.5 < 0.02
    assert abs(z(wrong, 1)) > 8


def test_differences_after_restir_are_the_two_one_sided_ones() -> None:
    of = image("occluders")
    X = initial(columns(of, 4), Live(np.random.default_rng(1)))
    i, j = (Pixels(of, np.arange(3) + k) for k in (1, 0))
    expected = one_sided(held(X, i), i, j) - one_sided(held(X, j), j, i)
    assert np.array_equal(gradient_after(X, i, j), expected)


# ---------------------------------------------------------------- inner and outer shifts


@pytest.mark.claims("GPT-A03")
def test_the_inner_shift_correlates_the_pixels_of_interior_pairs_and_fresh_paths_do_not() -> None:
    of = image("glossy_cornell")
    g, ends = seen(of.tracer.scene, of.tracer.sensor), forward((of.n,))["dx"][0]
    j = np.flatnonzero(~edges(g, ends))
    base, offset = (Pixels(of, np.tile(j + k, 400)) for k in (0, 1))
    X, other = (initial(at, Live(np.random.default_rng(k))) for k, at in enumerate((base, offset)))
    y = shifted(X.x, base, offset)
    f, moved = target(base, X.x) * X.W, target(offset, y.x) * y.J * X.W
    fresh = target(offset, other.x) * other.W
    kept, none = (np.array([np.corrcoef(*pair)[0, 1] for pair in each]) for each in (rows(f, moved), rows(f, fresh)))
    assert np.median(kept) > 0.8
    assert abs(np.median(none)) < 0.1


def rows(f: Array, g: Array) -> Array:
    """(pairs, 2, replicas)."""
    return np.stack([f.reshape(400, -1), g.reshape(400, -1)]).transpose(2, 0, 1)


def moved_pairs() -> tuple[Pairs, Pixels, Reservoirs, Pixels, Shifted]:
    """Pairs of the occluder row, their fresh samples, and these moved by the outer shift to the pair two pixels on."""
    of = image("occluders")
    pairs = Pairs(of, forward((of.n,))["dx"][0], MAGNITUDE)
    at = Pixels(pairs, np.tile(np.arange(pairs.n - 2), 60))
    X, to = initial(at, Live(np.random.default_rng(1))), Pixels(pairs, at.index + 2)
    return pairs, at, X, to, shifted(X.x, at, to)


@pytest.mark.claims("GPT-E21", "GPT-F04")
def test_the_outer_shift_moves_the_base_path_on_its_own_side_and_rebuilds_the_offset_path() -> None:
    pairs, at, X, to, y = moved_pairs()
    assert set(np.unique(X.x.k)) == {0, 1}
    assert np.array_equal(y.x.k, X.x.k)
    base = shifted(X.x.x, pairs.end(at.index, X.x.k), pairs.end(to.index, X.x.k))
    ends = pairs.ends[X.x.k, to.index % pairs.n]
    assert np.array_equal(pairs.end(to.index, X.x.k).index % pairs.of.n, ends)
    assert np.array_equal(base.x.F, y.x.x.F)
    offset = shifted(base.x, pairs.end(to.index, X.x.k), pairs.end(to.index, 1 - X.x.k))
    assert np.array_equal(offset.x.F, y.x.offset.x.F)
    assert np.array_equal(offset.J, y.x.offset.J)
    assert np.array_equal(base.J, y.J)
    back = shifted(y.x, to, at)
    there = (y.J > 0) & (back.J > 0)
    assert there.mean() > 0.5
    assert (back.J * y.J)[there] == pytest.approx(1, rel=1e-9)
    assert back.x.x.F[:, there] == pytest.approx(X.x.x.F[:, there], rel=1e-6)


class InnerToo(Pairs):
    """A mistake: the outer Jacobian takes that of the inner shift with it."""

    def shift(self, x, index, to):
        y = super().shift(x, index, to)
        return Shifted(y.x, y.J * np.where(y.x.offset.J > 0, y.x.offset.J, 1))


def identity(kind: type[Pairs]) -> float:
    """E_x[p_hat(T* x) J* W] = E_y[p_hat(y) W 1{T*^-1 y in supp X}]: the z of the difference."""
    of = image("crease")
    pairs = kind(of, np.stack([np.arange(48, of.n), np.arange(of.n - 48)]), MAGNITUDE)  # far ends: inner J unlike 1
    at = Pixels(pairs, np.tile(np.arange(pairs.n - 8), 800))
    to = Pixels(pairs, at.index + 8)
    X, Y = (initial(each, Live(np.random.default_rng(k))) for k, each in enumerate((at, to)))
    y, x = pairs.shift(X.x, at.index, to), pairs.shift(Y.x, to.index, at)
    forth, own = target(to, y.x) * y.J * X.W, target(to, Y.x) * Y.W * (x.J > 0) * (target(at, x.x) > 0)
    return z((forth - own).reshape(400, -1).mean(axis=1), 0)


@pytest.mark.claims("GPT-E22")
def test_the_jacobian_of_the_outer_shift_on_paths_is_that_of_the_base_path_alone() -> None:
    assert abs(identity(Pairs)) < 4
    assert abs(identity(InnerToo)) > 6


# ---------------------------------------------------------------- motion and edges


@pytest.mark.claims("GPT-A04", "GPT-C06")
def test_pairs_at_depth_edges_that_follow_the_nearer_pixel_keep_more_of_their_history() -> None:
    near, far = (kept_history(sign) for sign in (1, -1))
    difference = near - far
    assert difference.mean() > 4 * difference.std(ddof=1) / len(difference) ** 0.5
    assert near.mean() > far.mean() + 0.05


def kept_history(sign: int) -> Array:
    """Share of what a moving camera's depth edges carried before that lands with p_hat > 0, in groups of replicas.

    sign 1: pairs follow the nearer pixel, -1: the farther one.
    """
    before, now = (replace(each, eye=(each.eye[0], each.eye[1])) for each in approach("occluders")[-2:])
    s, R = setting("occluders"), 400
    by, depth = displacement(s.scene, now, before)
    views = [gradient_view("occluders", (each, each), Counter(), GRADIENT, ADAPTIVE) for each in (before, now)]
    ends, shape = forward(views[1][PRIMAL].shape)["dx"]
    deep = np.flatnonzero(abs(depth[ends[0]] / depth[ends[1]] - 1) > 0.1)
    then, here = (Pairs(view[PRIMAL].of[PRIMAL], ends, MAGNITUDE) for view in views)
    follow, index = nearer(by, sign * depth, ends), (np.arange(R)[:, None] * here.n + deep).ravel()
    X = initial(Pixels(then, np.arange(R * then.n)), Live(np.random.default_rng(1)))
    kept, all_of_it = np.zeros(len(index)), np.zeros(len(index))
    for source, share in overlapped(shape, follow, index):
        known = np.flatnonzero(source != NOWHERE)
        at, to = (Pixels(still(then, follow), source[known]), Pixels(Displaced(here, follow), index[known]))
        Y = take(X, at.index)
        y = at.of.shift(Y.x, at.index, to)
        had = share[known] * (Y.W > 0)
        kept[known] += had * (y.J > 0) * (target(Pixels(here, to.index), y.x) > 0)
        all_of_it[known] += had
    return np.asarray(kept.reshape(40, -1).sum(axis=1) / all_of_it.reshape(40, -1).sum(axis=1))


@pytest.mark.claims("GPT-A06", world="tracer3d")
def test_edge_pairs_of_a_floor_in_space_are_the_borders_of_its_squares() -> None:
    s = checker()
    sensor = s.view(192, 108)
    g, v = seen(s.scene, sensor), gbuffer(s.scene, sensor)
    floor = (abs(v.n[1]) > 0.99) & (v.x[1] < 0.11) & v.met
    tile = np.floor(v.x[0] * 8).astype(int) + np.floor(v.x[2] * 8).astype(int)
    for name, (ends, _) in forward(sensor.shape).items():
        both = floor[ends].all(axis=0) & (np.diff(v.x[1][ends], axis=0)[0] == 0)
        border = (tile[ends[0]] - tile[ends[1]]) % 2 == 1
        assert both.sum() > 2000, name
        assert 100 < border[both].sum() < 0.2 * both.sum()
        assert np.array_equal(edges(g, ends)[both], border[both]), name
        printed = (g.n[:, ends[0]] * g.n[:, ends[1]]).sum(axis=0) > 0.9  # as the paper has it
        assert printed[both].mean() > 0.95

"""Laws of differences: the proxy of both sides, reuse without selection over both signs, and pairs end by end."""

import re
from dataclasses import replace

import numpy as np
import pytest

from restir_ref.batch import Array, take
from restir_ref.gradient import MAGNITUDE, SIGNS, Pairs, TossedPairs, gap, gradient_after, omega, one_sided
from restir_ref.integrals import Pixels, Proxy, Reservoirs, pdf, shifted, target
from restir_ref.mis import WEIGHTS
from restir_ref.oracle.cells import Frame
from restir_ref.oracle.laws import expected_sum
from restir_ref.oracle.scenes import Scene, offset, reference_scene, three_pixel_scene
from restir_ref.restir import initial, reuse_all, shade
from tests.core.stubs import live
from tests.oracle.pairs import ENDS, ONE_PAIR, labelled, largest_bias, shared, true_means

pytestmark = pytest.mark.kernel

PROXIES = {"target": target, "sampling density": pdf}
every_proxy = pytest.mark.parametrize("proxy", PROXIES.values(), ids=PROXIES)
TALBOT = WEIGHTS["talbot"]


def bias_of_difference(scene: Scene, estimate) -> Array:
    """E of estimate(X, i, j) over fresh samples of two pixels minus I_i - I_j, for both orders, over I_0 + I_1."""

    def program(index, chance) -> Array:
        i = Pixels(scene.now, index)
        return estimate(initial(i, chance), i, offset(scene.now, index, 1))[None]

    I = true_means(scene)
    return (expected_sum(program, 2)[0] - [I[0] - I[1], I[1] - I[0]]) / I.sum()


def with_proxies(own: Proxy, others: Proxy):
    """A gradient with one proxy per side."""

    def estimate(X: Reservoirs, i: Pixels, j: Pixels) -> Array:
        return one_sided(take(X, i.index), i, j, own) - one_sided(take(X, j.index), j, i, others)

    return estimate


@every_proxy
def test_gradients_after_resampling_use_the_same_proxy_on_both_sides(proxy):
    here = Pixels(reference_scene().now, np.arange(2 * 40))
    X, there = initial(here, live()), offset(here.of, here.index, 1)
    assert np.array_equal(gradient_after(X, here, there, proxy), with_proxies(proxy, proxy)(X, here, there))
    assert not np.array_equal(gradient_after(X, here, there, proxy), with_proxies(pdf, target)(X, here, there))
    assert not np.array_equal(gradient_after(X, here, there, proxy), with_proxies(target, pdf)(X, here, there))


def test_gradients_compare_targets_unless_told():
    here = Pixels(reference_scene().now, np.arange(2 * 40))
    X, there = initial(here, live()), offset(here.of, here.index, 1)
    assert np.array_equal(gradient_after(X, here, there), gradient_after(X, here, there, target))
    assert np.array_equal(one_sided(X, here, there), one_sided(X, here, there, target))


def covered_scene() -> Scene:
    """Two pixels of the reference scene whose samplers reach all light, f > 0 everywhere, the second one brighter."""
    tables = reference_scene().now.cells
    f, even = np.maximum(tables.f, 0.25) * [[1], [3], [1], [3]], 1 / tables.v.sum(axis=-1, keepdims=True)
    pdf_ = np.broadcast_to(even, tables.v.shape)[None].copy()
    return Scene([Frame(replace(tables, f=f, p_hat=f, pdf=pdf_), 2)])


@every_proxy
def test_gradients_of_fresh_samples_are_unbiased_whatever_the_proxy(proxy):
    bias = bias_of_difference(covered_scene(), lambda X, i, j: gradient_after(X, i, j, proxy))
    assert bias == pytest.approx(0, abs=1e-13)


@pytest.mark.parametrize("proxies", [(pdf, target), (target, pdf)])
def test_another_proxy_on_one_side_is_noticed(proxies):
    assert abs(bias_of_difference(covered_scene(), with_proxies(*proxies))).max() > 0.01


@pytest.mark.parametrize("columns", [[0, 2, 7], [5, 4], [3]])
def test_gradients_of_some_pixels_are_those_of_all_there(columns):
    here = Pixels(reference_scene().now, np.arange(2 * 40))
    X, there, k = initial(here, live()), offset(here.of, here.index, 1), np.array(columns)
    some = gradient_after(X, Pixels(here.of, k), Pixels(here.of, there.index[k]))
    assert np.array_equal(some, gradient_after(X, here, there)[:, k])


def test_a_gap_between_two_images_takes_either_side_from_its_own():
    frame = covered_scene().now
    bright = Frame(replace(frame.cells, f=5 * frame.cells.f), 2)
    x, zeros = np.arange(4), np.zeros(4, dtype=int)
    here, there = Pixels(frame, zeros), Pixels(bright, zeros + 1)
    y = shifted(x, here, there)
    right = frame.cells.f[0] - 5 * frame.cells.f[1, y.x] * y.J
    assert gap(x, here, y, there)[0] == pytest.approx(right, rel=1e-12)


def test_pair_weights_compare_targets_unless_told():
    here, there = (Pixels(covered_scene().now, np.full(4, k)) for k in (0, 1))
    y = shifted(np.arange(4), here, there)
    default, compared, other = (omega(np.arange(4), here, y, there, *proxy) for proxy in ([], [target], [pdf]))
    assert np.array_equal(default, compared)
    assert not np.allclose(default, other)


# ---------------------------------------------------------------- pairs


def test_pairs_are_as_many_as_they_have_ends():
    ends = [np.repeat([[0], [1]], E, axis=1) for E in (1, 3, 4)]
    assert [Pairs(three_pixel_scene().now, each, MAGNITUDE).n for each in ends] == [1, 3, 4]


@pytest.mark.parametrize(
    ("ends", "said"),
    [
        ([[0, 2], [1, 2]], "pair 1 is of the pixels 2 and 2, but a pair has two different ones of the 3"),
        ([[0, 1], [1, 3]], "pair 1 is of the pixels 1 and 3"),
        ([[-1, 0], [0, 1]], "pair 0 is of the pixels -1 and 0"),
        ([[0, 1], [1, 2], [0, 2]], "have shape (3, 2)"),
        ([0, 1], "have shape (2,)"),
        ([[0.0], [1.0]], "type float64"),
    ],
)
def test_ends_that_are_no_pairs_of_pixels_are_refused(ends, said):
    with pytest.raises(ValueError, match=re.escape(said)):
        Pairs(three_pixel_scene().now, np.array(ends), MAGNITUDE)


class Unmasked(Pairs):
    """A mistake: contributions of either sign, whatever the part that is sampled."""

    def contribution(self, index, x):
        return self.difference(index, x)[None]


def sum_over_signs(scene: Scene, kind: type[Pairs], proxy: Proxy = target) -> Array:
    """E of the shifted and unselected estimates of both signs, over I_i - I_j of two pairs."""
    signs = [kind(scene.now, ENDS, part, proxy) for part in SIGNS.values()]

    def program(index, chance) -> Array:
        drawn = shared(signs, index, chance)
        found = zip(drawn, [Pixels(sign, index) for sign in signs], strict=True)
        return sum(reuse_all(X, here, [offset(here.of, index, 1)]) for X, here in found)

    I = true_means(scene)
    return expected_sum(program, 2)[0] / (I[ENDS[0]] - I[ENDS[1]])


@every_proxy
def test_all_samples_of_both_signs_of_pairs_shifted_and_none_selected_are_unbiased(proxy):
    assert sum_over_signs(three_pixel_scene(), Pairs, proxy) == pytest.approx(1, rel=1e-12)


def test_contributions_of_the_other_sign_are_noticed():
    assert abs(sum_over_signs(three_pixel_scene(), Unmasked) - 1).max() > 0.1


@every_proxy
@pytest.mark.parametrize("part", SIGNS.values(), ids=SIGNS)
def test_pairs_of_either_proxy_are_unbiased_in_every_cell(part, proxy):
    scene = three_pixel_scene()
    pairs = TossedPairs(scene.now, ENDS, part, proxy)
    loop = lambda index, chance: labelled(initial(Pixels(pairs, index), chance), 3)  # noqa: E731
    assert largest_bias(loop, pairs, scene) < 1e-13


@every_proxy
def test_a_difference_of_a_pair_is_omega_times_the_gap_with_the_sign_of_its_side(proxy):
    frame, K = three_pixel_scene().now, 3
    pairs = Pairs(frame, ONE_PAIR, MAGNITUDE, proxy)
    column, k = np.zeros(2 * K, dtype=int), np.repeat([0, 1], K)
    x = pairs.paired(column, np.tile(np.arange(K), 2), k)
    base, other = Pixels(frame, k), Pixels(frame, 1 - k)
    y = shifted(x.x, base, other)
    right = np.where(k == 0, 1, -1) * omega(x.x, base, y, other, proxy) * gap(x.x, base, y, other)
    assert np.array_equal(pairs.difference(column, x), right)
    assert np.array_equal(pairs.target(column, x), abs(right[0]))
    assert np.array_equal(pairs.contribution(column, x), right)


def test_proxies_of_a_pair_are_not_idle():
    frame, x = three_pixel_scene().now, np.arange(3)
    zeros = np.zeros(3, dtype=int)
    found = []
    for proxy in PROXIES.values():
        pairs = Pairs(frame, ONE_PAIR, MAGNITUDE, proxy)
        found.append(pairs.difference(zeros, pairs.paired(zeros, x, zeros)))
    assert not np.allclose(*found)
    default = Pairs(frame, ONE_PAIR, MAGNITUDE)
    assert np.array_equal(default.difference(zeros, default.paired(zeros, x, zeros)), found[0])


@pytest.mark.parametrize("kind", [Pairs, TossedPairs])
def test_parts_without_their_sign_contribute_nothing(kind):
    frame = three_pixel_scene().now
    for part in SIGNS.values():
        pairs = kind(frame, ENDS, part)
        here = Pixels(pairs, np.arange(2 * 40))
        X = initial(here, live())
        f = shade(X, here)
        assert (part.target(f) == abs(f[0])).all()
        assert ((f[0] != 0) == (X.W > 0)).all()

"""Laws of whole passes: the scale of the target, samples of any structure, shapes, and no side effects."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from restir_ref.batch import Array, map_leaves
from restir_ref.chance import Live
from restir_ref.integrals import Pixels, Reservoirs, Shifted
from restir_ref.mis import WEIGHTS
from restir_ref.oracle.scenes import offset
from restir_ref.restir import initial, reuse_all, shade, spatial, temporal
from tests.core.stubs import Wrapped, live, same_bits
from toy1d import overlapping_supports

pytestmark = pytest.mark.kernel

every_weight = pytest.mark.parametrize("mis", WEIGHTS.values(), ids=WEIGHTS)


def two_frames(of, mis, chance=None) -> Reservoirs:
    """Initial samples, temporal reuse from the pixel to the right and from the own, spatial reuse from the left."""
    index, chance = np.arange(7 * 40), chance or live()
    before, here = Pixels(of, index), Pixels(of, index)
    Y, X = initial(before, chance), initial(here, chance)
    X = temporal(X, here, Y, [offset(of, index, 1), before], chance, mis=mis)
    return spatial(X, here, [offset(of, index, -1)], chance, mis=mis)


# ---------------------------------------------------------------- scale of the target


@dataclass(frozen=True, eq=False)
class Scaled(Wrapped):
    """The same integrals with k p_hat for a target."""

    k: float

    def target(self, index, x):
        return self.k * self.of.target(index, x)


@dataclass(frozen=True, eq=False)
class Lifted(Wrapped):
    """The same integrals with p_hat + 1 for a target."""

    def target(self, index, x):
        return 1 + self.of.target(index, x)


@every_weight
@pytest.mark.parametrize("k", [2.0**-99, 0.5, 1024.0])
def test_scaling_the_target_by_a_power_of_two_changes_no_bit(mis, k):
    toy = overlapping_supports()
    assert same_bits(two_frames(Scaled(toy, k), mis), two_frames(toy, mis))


@every_weight
@pytest.mark.parametrize("k", [1e-30, 0.1, 3.0, 1e30])
def test_scaling_the_target_changes_neither_the_selection_nor_the_estimate(mis, k):
    toy = overlapping_supports()
    X, Y = two_frames(toy, mis), two_frames(Scaled(toy, k), mis)
    assert (X.x == Y.x).all()
    assert pytest.approx(X.W, rel=1e-12) == Y.W


def test_a_target_changed_otherwise_is_noticed():
    toy, mis = overlapping_supports(), WEIGHTS["talbot"]
    X, Y = two_frames(toy, mis), two_frames(Lifted(toy), mis)
    assert (X.x != Y.x).any()
    assert pytest.approx(X.W, rel=0.1) != Y.W


# ---------------------------------------------------------------- samples are opaque


@dataclass(frozen=True)
class Path:
    """A sample with a leaf of every kind, all made from x."""

    x: Array
    points: Array
    flags: tuple[Array, None]


@dataclass(frozen=True, eq=False)
class Paths(Wrapped):
    """Integrals whose samples are structs."""

    def path(self, x) -> Path:
        return Path(x, np.stack([x, -x, x**2]), (x > 0.5, None))

    def candidates(self, index, chance):
        yield from ((self.path(x), mW) for x, mW in self.of.candidates(index, chance))

    def target(self, index, x):
        return self.of.target(index, x.x)

    def contribution(self, index, x):
        return self.of.contribution(index, x.x)

    def shift(self, x, index, to):
        y = super().shift(x.x, index, to)
        return Shifted(self.path(y.x), y.J)


@every_weight
def test_structs_are_resampled_like_numbers_with_all_their_leaves(mis):
    paths = Paths(overlapping_supports())
    X, Y = two_frames(paths.of, mis), two_frames(paths, mis)
    assert same_bits(X, replace(Y, x=Y.x.x))
    assert repr(Y.x) == repr(paths.path(X.x))


# ---------------------------------------------------------------- shapes and kinds


@every_weight
@pytest.mark.parametrize("pixels", [0, 1, 7, 70])
def test_passes_return_one_number_per_column(mis, pixels):
    index = np.arange(pixels)
    here = Pixels(overlapping_supports(), index)
    X = initial(here, live())
    Y = spatial(X, here, [Pixels(here.of, index[::-1])], live(), mis=mis)
    for leaf in (X.x, X.W, X.c, Y.x, Y.W, Y.c):
        assert leaf.shape == (pixels,)
    assert X.W.dtype == Y.W.dtype == Y.x.dtype == float
    both = shade(Y, here), reuse_all(X, here, [Pixels(here.of, index[::-1])], mis=mis)
    assert [each.shape for each in both] == [(1, pixels)] * 2


@dataclass(frozen=True)
class Guarded:
    """A chance that lets nobody write into the arrays it was asked with."""

    live: Live

    def choose(self, weights):
        weights.flags.writeable = False
        return read_only(self.live.choose(weights))

    def uniform(self, shape):
        return read_only(self.live.uniform(shape))


def read_only(X):
    def frozen(leaf: Array) -> Array:
        leaf.flags.writeable = False
        return leaf

    return map_leaves(frozen, X)


@every_weight
def test_passes_write_into_none_of_their_arguments(mis):
    here = Pixels(overlapping_supports(), read_only(np.arange(70)))
    X = read_only(initial(here, Guarded(live())))
    Y = read_only(temporal(X, here, X, [Pixels(here.of, here.index)], Guarded(live()), mis=mis))
    spatial(Y, here, [offset(here.of, here.index, 1)], Guarded(live()), mis=mis)
    reuse_all(Y, here, [offset(here.of, here.index, 1)], mis=mis)


def test_writing_into_an_argument_is_noticed():
    X = read_only(initial(Pixels(overlapping_supports(), np.arange(7)), live()))
    with pytest.raises(ValueError, match="read-only"):
        X.W[:] = 1

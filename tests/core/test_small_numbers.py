"""Laws of numbers as engines store them: bytes do not wrap, float32 does not underflow, and exact ones stay exact."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from restir_ref import resampling
from restir_ref.batch import Array, wide
from restir_ref.integrals import Pixels, Reservoirs
from restir_ref.mis import ALL_CANONICAL, WEIGHTS, Confidences
from restir_ref.oracle.cells import Frame, cells
from restir_ref.oracle.laws import bias_of
from restir_ref.oracle.scenes import Scene, offset, paired, spatial_loop, three_pixel_scene
from restir_ref.resampling import Candidate, Input, select, weigh
from restir_ref.restir import around, capped, initial, reuse_all, spatial, temporal
from restir_ref.streaming import select_streaming
from tests.core.inputs import drawn, weights
from tests.core.stubs import Wrapped, live, same_bits
from toy1d import overlapping_supports

pytestmark = pytest.mark.kernel

HERE = Pixels(overlapping_supports(), np.arange(7 * 40))
N = len(HERE.index)
NEAR = [offset(HERE.of, HERE.index, by) for by in (1, 2, 3, 4, 5)]
X = initial(HERE, live())

every_weight = pytest.mark.parametrize("mis", WEIGHTS.values(), ids=WEIGHTS)

# ---------------------------------------------------------------- confidences

COUNTS = {"uint8": 20, "int8": 20, "uint16": 300, "int32": 65536, "int64": 2**40, "float32": 2**80}
"""How many samples count, by what holds the number."""

every_count = pytest.mark.parametrize(("kind", "count"), COUNTS.items(), ids=COUNTS)


def spatially(X: Reservoirs, mis) -> Reservoirs:
    return spatial(X, HERE, NEAR, live(2), mis=mis)


def temporally(X: Reservoirs, mis) -> Reservoirs:
    return temporal(X, HERE, X, NEAR, live(2), mis=mis, cap=1e9)


def streamed(X: Reservoirs, mis) -> Reservoirs:
    return select_streaming(weigh([Input(X, HERE), *around(X, NEAR)], HERE, mis), live(2), np.ones(N))


def summed(X: Reservoirs, mis) -> Reservoirs:
    """As if the sums were weights."""
    return replace(X, W=reuse_all(X, HERE, NEAR, mis=mis)[0], c=np.ones(N))


PASSES = {"spatial": spatially, "temporal": temporally, "streaming": streamed, "without selecting": summed}


def stored(kind: str, count: float) -> Reservoirs:
    return replace(X, c=np.full(N, count).astype(kind))


@every_weight
@every_count
@pytest.mark.parametrize("a_pass", PASSES.values(), ids=PASSES)
def test_every_pass_counts_in_small_numbers_as_it_does_in_floats(mis, kind, count, a_pass):
    assert same_bits(a_pass(stored(kind, count), mis), a_pass(stored("float64", count), mis))


@every_weight
def test_weights_by_themselves_count_in_bytes_as_they_do_in_floats(mis):
    case = drawn(5, 2, seed=0, columns=9)
    c = np.full(case.c.shape, 60)
    for m in (mis.m, mis.c or mis.m):
        assert (weights(m, case._replace(c=c.astype(np.uint8))) == weights(m, case._replace(c=c.astype(float)))).all()


def test_confidences_beyond_a_byte_add_up():
    assert (spatially(stored("uint8", 250), WEIGHTS["talbot"]).c == 6 * 250).all()
    assert (capped(stored("uint8", 250), 1000).c == 250).all()


def equal_pixels(n: int) -> Scene:
    """n equal pixels of two cells, of which one has no light."""
    f = np.repeat([[1.0, 0.0]], n, axis=0)
    same = {(i, j): (0, 1) for j in range(n) for i in range(j)}
    return Scene([Frame(cells(np.full((n, 2), 0.5), f, np.ones((1, n, 2)), paired(n, 2, same)), n)])


def bias_with(kind: str, count: int, n: int, name: str = "defensive") -> float:
    """The bias of pixel 0's lit cell after a pass over n pixels of these confidences, enumerated.

    Two bytes of 20 make 20 * 20 mod 256 = 144 instead of 400 in the neighbour's defensive weight: 1/4 becomes .09.
    """
    scene = equal_pixels(n)

    def counted(X: Reservoirs, here: Pixels) -> Reservoirs:
        return replace(X, c=np.full(len(X.W), count).astype(kind))

    return float(bias_of(spatial_loop(scene, WEIGHTS[name], 1, counted), scene.v, scene.support)[0, 0])


def as_stored(monkeypatch) -> None:
    """A mistake: sums and products of confidences in the type they are stored in."""
    monkeypatch.setattr(Confidences, "_numbers", property(lambda self: self.c))


@pytest.mark.parametrize(("kind", "count"), [("uint8", 20), ("int32", 65536)])
@pytest.mark.parametrize("n", [2, 4])
def test_a_pass_over_byte_sized_confidences_is_unbiased(kind, count, n):
    assert abs(bias_with(kind, count, n)) < 1e-13


def test_confidences_that_wrap_are_biased(monkeypatch):
    as_stored(monkeypatch)
    assert [1 + bias_with("uint8", 20, n) for n in (2, 4)] == pytest.approx([0.84, 0.52])
    whole, wrapped = (spatially(stored(kind, 250), WEIGHTS["talbot"]) for kind in ("float64", "uint8"))
    assert not same_bits(whole, wrapped)


# ---------------------------------------------------------------- targets and weights


class Single(Wrapped):
    """Integrals whose target is tiny, and held in float32."""

    def target(self, index, x):
        return (1e-30 * self.of.target(index, x)).astype(np.float32)


def tiny(n: int = N) -> tuple[Array, Array]:
    """p_hat and m W whose product is below all of float32."""
    return np.full(n, 1e-30, np.float32), np.full(n, 1e-20, np.float32)


SELECTORS = {"select": select, "select_streaming": select_streaming}
every_selector = pytest.mark.parametrize("selector", SELECTORS.values(), ids=SELECTORS)


@every_selector
def test_weights_that_float32_cannot_hold_are_held_all_the_same(selector):
    p_hat, mW = tiny()
    chosen = selector([Candidate(X.x, p_hat, mW)] * 2, live(), X.c)
    assert pytest.approx(2 * mW.astype(float), rel=1e-12) == chosen.W
    assert (p_hat * mW == 0).all()


@every_selector
def test_weights_beyond_a_byte_do_not_wrap(selector):
    two = np.full(N, 200, np.uint8)
    assert (selector([Candidate(X.x, two, two)], live(), X.c).W == 200).all()


def test_a_target_in_float32_is_compared_in_float64():
    here = Pixels(Single(HERE.of), HERE.index)
    near = [Pixels(here.of, each.index) for each in NEAR]
    light = replace(X, W=(1e-10 * X.W).astype(np.float32))
    found = reuse_all(light, here, near)
    assert found == pytest.approx(1e-10 * reuse_all(X, HERE, NEAR), rel=1e-6)


@pytest.mark.parametrize("kind", ["int64", "float64", "longdouble", "object"])
def test_what_has_64_bits_or_is_exact_stays_as_it_is(kind):
    values = np.arange(3).astype(kind)
    assert wide(values) is values


# ---------------------------------------------------------------- exact numbers


rational = np.vectorize(lambda x: Fraction(x).limit_denominator(1000), otypes=[object])


def exact_scene() -> Scene:
    """Two of three pixels in rational numbers."""
    tables = three_pixel_scene().now.cells
    v, f, pdf = (rational(each) for each in (tables.v[:2], tables.f[:2], tables.pdf[:, :2]))
    return Scene([Frame(cells(v, f, pdf / (pdf * v).sum(axis=-1)[..., None], tables.shifts[:2, :2]), 2)])


def inexact(mis) -> list[str]:
    """Which numbers are no fractions after two passes over rational samples, whose confidences are whole at first."""
    scene, kinds = exact_scene(), set()

    def watched(X: Reservoirs, here: Pixels) -> Reservoirs:
        kinds.update(f"{name} {type(each).__name__}" for name in ("W", "c") for each in getattr(X, name).tolist())
        return X

    bias = bias_of(spatial_loop(scene, mis, 2, watched), scene.v, scene.support)
    exact = mis.unbiased_for == ALL_CANONICAL or (bias == 0).all()
    return sorted(kinds - {"W Fraction", "c Fraction", "W int", "c int"}) + ([] if exact else ["bias"])


@every_weight
def test_chained_passes_over_fractions_hold_nothing_but_fractions(mis):
    assert inexact(mis) == []


def test_whole_confidences_taken_as_they_are_turn_fractions_into_floats(monkeypatch):
    monkeypatch.setattr(resampling, "_counts", lambda inputs: [each.X.c for each in inputs])
    assert inexact(WEIGHTS["talbot"]) == ["W float", "c float", "bias"]

"""Laws of places: column k is at place k, sources may be nowhere, and history that is elsewhere is refused."""

from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np
import pytest

from restir_ref.batch import Array, take
from restir_ref.gradient import gradient_after
from restir_ref.integrals import NOWHERE, Pixels, Reservoirs
from restir_ref.mis import WEIGHTS
from restir_ref.oracle.laws import bias_of, expected_sum
from restir_ref.oracle.scenes import Scene, offset, reference_scene, three_pixel_scene
from restir_ref.resampling import Input, gris
from restir_ref.restir import around, entering, initial, reuse_all, shade, spatial, temporal
from tests.core.stubs import Always, live, same_bits
from tests.oracle.pairs import true_means
from toy1d import overlapping_supports, two_pixels

pytestmark = pytest.mark.kernel

TALBOT = WEIGHTS["talbot"]
every_weight = pytest.mark.parametrize("mis", WEIGHTS.values(), ids=WEIGHTS)

HERE = Pixels(overlapping_supports(), np.arange(7 * 40))
X, Y = initial(HERE, live()), replace(initial(HERE, live(2)), c=1 + np.arange(7 * 40) % 9)
NEAR = offset(HERE.of, HERE.index, 1)
SOME = np.arange(7 * 40) % 3 == 0
UNSEEN = Pixels(HERE.of, np.full(7 * 40, NOWHERE))
HALF_SEEN = Pixels(HERE.of, np.where(SOME, NOWHERE, NEAR.index))

# ---------------------------------------------------------------- no history here


def wrapped(Y: Reservoirs, source: Pixels) -> Input:
    """A mistake: an engine's -1 for "none" is read as Python reads it, the last column."""
    return Input(Reservoirs(*(leaf.take(source.index) for leaf in (Y.x, Y.W, Y.c))), source)


def merged(source: Input | None, mis) -> Reservoirs:
    """New samples with one more input, or without it, by the same random numbers."""
    return gris([Input(X, HERE), *([] if source is None else [source])], HERE, mis, live(3))


@every_weight
def test_a_pass_whose_source_is_nowhere_is_the_pass_without_that_input(mis):
    alone, near = merged(None, mis), [NEAR, UNSEEN]
    assert same_bits(temporal(X, HERE, Y, [UNSEEN], live(3), mis=mis), alone)
    assert same_bits(spatial(X, HERE, near, live(3), mis=mis), spatial(X, HERE, [NEAR], live(3), mis=mis))
    assert np.array_equal(reuse_all(X, HERE, near, mis=mis), reuse_all(X, HERE, [NEAR], mis=mis))


@every_weight
def test_reading_minus_one_as_the_last_column_is_noticed(mis):
    assert not same_bits(merged(wrapped(Y, UNSEEN), mis), merged(None, mis))


@every_weight
def test_some_columns_without_history_are_as_if_none_had_any_and_the_others_as_if_all_had(mis):
    mixed, alone, both = (temporal(X, HERE, Y, before, live(3), mis=mis) for before in ([HALF_SEEN], [UNSEEN], [NEAR]))
    for name in ("x", "W", "c"):
        values = [getattr(each, name) for each in (mixed, alone, both)]
        assert np.array_equal(values[0], np.where(SOME, values[1], values[2]))
    assert not same_bits(alone, both)


def with_history_of_one_pixel(scene: Scene, cut=around):
    """Two frames, where the first pixel has come into sight only now."""
    before, now = scene.frames

    def loop(index, chance):
        there, here = Pixels(before, index), Pixels(now, index)
        past = Pixels(before, np.where(index % 2, offset(before, index, 1).index, NOWHERE))
        return gris([Input(initial(here, chance), here), *cut(initial(there, chance), [past])], here, TALBOT, chance)

    return loop


def uncounted(Y: Reservoirs, sources) -> list[Input]:
    """A mistake: no W, but the confidence of whatever is there."""
    return [replace(each, X=replace(each.X, c=np.ones(len(each.X.c)))) for each in around(Y, sources)]


def test_history_of_some_pixels_only_is_unbiased_in_every_cell():
    scene = reference_scene()
    assert abs(bias_of(with_history_of_one_pixel(scene), scene.v, scene.support)).max() < 1e-13


def test_history_that_is_nowhere_but_counts_is_noticed():
    scene = reference_scene()
    assert abs(bias_of(with_history_of_one_pixel(scene, uncounted), scene.v, scene.support)).max() > 0.1


def test_exact_numbers_stay_exact_nowhere():
    halves = np.array([Fraction(1, 2)] * 2, dtype=object)
    cut = entering(Reservoirs(np.zeros(2), halves, 3 * halves), Pixels(two_pixels(), np.array([NOWHERE, 1]))).X
    assert (cut.W.tolist(), cut.c.tolist()) == ([0, Fraction(1, 2)], [0, Fraction(3, 2)])


# ---------------------------------------------------------------- column k at place k


@dataclass(frozen=True)
class Part:
    """Columns of a whole pass that somebody wants alone."""

    columns: Array

    def source(self, near: Pixels) -> Input:
        """Their sources, found in the whole image as the error tells."""
        index = near.index[self.columns]
        return Input(take(X, index), Pixels(near.of, index))


@every_weight
@pytest.mark.parametrize("s", [0, 1])
def test_a_part_of_an_image_whose_inputs_are_taken_first_is_that_part_of_the_whole_pass(mis, s):
    part = Part(np.array([5, 3, 100]))
    here = Pixels(HERE.of, part.columns)
    alone = gris([Input(take(X, part.columns), here), part.source(NEAR)], here, mis, Always(s))
    assert same_bits(alone, take(spatial(X, HERE, [NEAR], Always(s), mis=mis), part.columns))


def mean_of_mirrored_pixels(gather) -> Array:
    """E[f W] over the truth, when the columns of three pixels are handed over in reverse."""
    scene = three_pixel_scene()

    def program(index, chance) -> Array:
        mirror = index - index % 3 + 2 - index % 3
        here, near = Pixels(scene.now, mirror), offset(scene.now, mirror, 1)
        X = initial(here, chance)
        return shade(gris([Input(X, here), Input(take(X, gather(near.index)), near)], here, TALBOT, chance), here)

    return expected_sum(program, 3)[0] / true_means(scene)[::-1]


def test_permuted_columns_are_unbiased_where_each_is_sought_at_its_own_place():
    assert mean_of_mirrored_pixels(lambda k: k - k % 3 + 2 - k % 3) == pytest.approx(1, rel=1e-12)


def test_permuted_columns_that_are_sought_by_their_numbers_are_biased():
    assert abs(mean_of_mirrored_pixels(lambda k: k) - 1).max() > 0.05


def test_one_history_may_serve_all_replicas():
    shared = temporal(X, HERE, take(Y, np.arange(7)), [Pixels(HERE.of, NEAR.index % 7)], live(3))
    own = temporal(X, HERE, take(Y, np.arange(7 * 40) % 7), [NEAR], live(3))
    assert same_bits(shared, own)


# ---------------------------------------------------------------- refusals

THREE, TOY = three_pixel_scene().now, two_pixels()
MIRROR, FIRST = Pixels(HERE.of, HERE.index[::-1]), Pixels(HERE.of, np.arange(3))
IN_ORDER, ONLY_ARRAYS = (
    "take\\(\\) the sources and pass Inputs",
    "array \\(N,\\) of integers, but the index is .*flatnonzero",
)

REFUSED = {
    "permuted columns": (
        lambda: spatial(X, MIRROR, [NEAR], live()),
        ValueError,
        f"279 in order, but has 279 at place 0.*{IN_ORDER}",
    ),
    "permuted columns, none selected": (
        lambda: reuse_all(X, MIRROR, [NEAR]),
        ValueError,
        f"279 in order, but has 279 at place 0.*{IN_ORDER}",
    ),
    "permuted columns with history": (lambda: temporal(X, MIRROR, Y, [NEAR], live()), ValueError, IN_ORDER),
    "a column twice": (
        lambda: spatial(take(X, np.array([0, 0, 2])), Pixels(HERE.of, np.array([0, 0, 2])), [FIRST], live()),
        ValueError,
        f"has 0 at place 1.*{IN_ORDER}",
    ),
    "a part of the columns": (
        lambda: spatial(take(X, np.arange(1, 4)), Pixels(HERE.of, np.arange(1, 4)), [FIRST], live()),
        ValueError,
        f"0 to 2 in order, but has 1 at place 0.*{IN_ORDER}",
    ),
    "a part that does not begin at 0, of one column": (
        lambda: spatial(
            take(X, np.array([4])), Pixels(HERE.of, np.array([4])), [Pixels(HERE.of, np.array([0]))], live()
        ),
        ValueError,
        IN_ORDER,
    ),
    "a short history": (
        lambda: temporal(X, HERE, take(Y, np.arange(273)), [NEAR], live()),
        ValueError,
        "7 pixels and the pass is for 40 images, but there are 273 reservoirs: hand over 280, or 7 for all",
    ),
    "history of another image": (
        lambda: temporal(X, HERE, Y, [Pixels(THREE, HERE.index)], live()),
        ValueError,
        "image has 3 pixels and the pass is for 40 images, but there are 280 reservoirs: hand over 120, or 3 for all",
    ),
    "an odd number of columns": (
        lambda: spatial(take(X, np.arange(5)), Pixels(TOY, np.arange(5)), [offset(TOY, np.arange(5), 1)], live()),
        IndexError,
        "column 5 is asked of reservoirs that hold 5, of images of 2 pixels.*whole images",
    ),
    "a column before the first": (lambda: Pixels(TOY, np.array([0, -2])), IndexError, "holds -2 in place 1"),
    "a difference with a pixel that is nowhere": (lambda: gradient_after(X, HERE, UNSEEN), IndexError, "-1 in place 0"),
    "a difference with a pixel beyond": (
        lambda: gradient_after(take(X, np.arange(5)), Pixels(TOY, np.arange(2)), Pixels(TOY, np.arange(5, 7))),
        IndexError,
        "column 6 is asked of reservoirs that hold 5",
    ),
    "taking the last column by -1": (lambda: take(X, np.array([-1])), IndexError, "count from 0.*-1 in place 0"),
    "taking by a mask": (lambda: take(X, SOME), TypeError, f"type bool.*{'flatnonzero'}"),
    "a mask for columns": (lambda: Pixels(TOY, SOME), TypeError, "type bool.*flatnonzero"),
    "a list for columns": (lambda: Pixels(TOY, [0, 1]), TypeError, f"{ONLY_ARRAYS}"),  # type: ignore[arg-type]
    "floats for columns": (lambda: Pixels(TOY, np.arange(2.0)), TypeError, "type float64"),
    "unsigned columns": (lambda: Pixels(TOY, np.arange(2, dtype=np.uint32)), TypeError, "type uint32.*dtype=int"),
    "a matrix of columns": (lambda: Pixels(TOY, np.zeros((2, 1), dtype=int)), TypeError, "shape \\(2, 1\\)"),
}


@pytest.mark.parametrize(("act", "error", "said"), REFUSED.values(), ids=REFUSED)
def test_columns_that_are_elsewhere_are_refused_with_their_place_and_a_remedy(act, error, said):
    with pytest.raises(error, match=said):
        act()


@pytest.mark.parametrize("kind", [np.int8, np.int32])
def test_columns_are_counted_by_integers_of_any_size(kind):
    here, near = (Pixels(HERE.of, np.arange(14).astype(kind)) for _ in range(2))
    fresh = initial(here, live())
    assert same_bits(
        spatial(fresh, here, [near], live(2)), spatial(fresh, here, [Pixels(HERE.of, np.arange(14))], live(2))
    )


def test_columns_in_order_of_a_part_of_an_image_and_passes_alone_are_no_mistakes():
    spatial(take(X, np.arange(5)), Pixels(HERE.of, np.arange(5)), [Pixels(HERE.of, np.arange(5)[::-1])], live())
    spatial(X, MIRROR, [], live())
    spatial(take(X, np.arange(0)), Pixels(HERE.of, np.arange(0)), [Pixels(HERE.of, np.arange(0))], live())

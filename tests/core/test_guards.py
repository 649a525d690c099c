"""Laws of the guards: what they let through as it is, what they refuse, and which value they name."""

from fractions import Fraction

import numpy as np
import pytest

from restir_ref.batch import columns
from restir_ref.guards import aligned, apart, named, nonnegative, per_column, positive, read_only, whole
from restir_ref.integrals import Pixels
from restir_ref.loop import Preset, frame, random_in_row
from restir_ref.mis import WEIGHTS
from restir_ref.restir import capped, initial
from tests.core.stubs import live, same_bits
from toy1d import two_pixels

pytestmark = pytest.mark.kernel

HERE = Pixels(two_pixels(), np.arange(4))
X = initial(HERE, live())

# ---------------------------------------------------------------- numbers


def test_the_first_of_several_bad_values_is_named_and_all_are_counted():
    with pytest.raises(ValueError, match=r"W must be .*, but is -2.0 in column 1 \(3 of 6 values are bad\). Pray."):
        nonnegative(np.array([1.0, -2, np.nan, 0, 3, np.inf]), "W", "Pray.")


def test_the_column_of_a_bad_value_in_a_matrix_is_its_last_index():
    with pytest.raises(ValueError, match=r"is -3\.0 in column 2"):
        nonnegative(np.array([[1.0, 1, 1], [1, 1, -3]]), "W", "")


@pytest.mark.parametrize("values", [np.zeros(3), np.array([0, 1e300]), np.array([]), np.array([Fraction(1, 3)])])
def test_good_values_come_back_as_they_are(values):
    assert nonnegative(values, "W", "") is values


def test_values_per_column_are_one_each_or_one_number_for_all():
    for values in (np.ones(4), np.array(2.0)):
        assert per_column(values, 4, "q") is values
    assert per_column(np.ones(1), 1, "q").shape == (1,)


@pytest.mark.parametrize("shape", [(3,), (1,), (4, 1), (1, 4), (4, 4), (0,)])
def test_values_of_other_shapes_are_no_values_per_column(shape):
    with pytest.raises(ValueError, match=r"q has shape \(.*\), but this batch has 4 columns: the last axis must be 4"):
        per_column(np.ones(shape), 4, "q")


# ---------------------------------------------------------------- whole numbers, caps, names

COUNTS = {"a half": 2.5, "a whole float": 2.0, "none": 0, "a negative one": -1, "a word": "2", "an array": np.ones(2)}


@pytest.mark.parametrize("M", COUNTS.values(), ids=COUNTS)
def test_a_number_of_candidate_sets_that_is_no_positive_integer_is_named(M):
    with pytest.raises(ValueError, match="the number M of candidate sets must be a whole number >= 1, but is ") as said:
        initial(HERE, live(), M)
    assert f"but is {M!r}." in str(said.value)


@pytest.mark.parametrize("value", [1, 2, np.int8(1), np.uint64(2**63)])
def test_the_least_whole_number_and_those_above_are_accepted(value):
    whole(value, 1, "k", "")


def test_a_whole_number_one_below_the_least_is_refused():
    with pytest.raises(ValueError, match=r"k must be a whole number >= 3, but is 2\. Take three\."):
        whole(2, 3, "k", "Take three.")


CAPS = {"zero": 0, "negative": -1e-9, "NaN": np.nan, "one per column": np.full(4, 20.0), "a word": "20", "none": None}


@pytest.mark.parametrize("cap", CAPS.values(), ids=CAPS)
def test_a_cap_that_is_no_positive_number_is_named(cap):
    with pytest.raises(
        ValueError, match=r"the cap M_c must be one positive number, but is .*; leave temporal reuse out"
    ):
        capped(X, cap)


@pytest.mark.parametrize("cap", [1e-9, 1, np.float32(0.5), np.int64(3), Fraction(1, 3), np.inf])
def test_positive_numbers_of_any_kind_are_caps(cap):
    positive(cap, "M_c", "")
    assert (capped(X, cap).c == min(1, cap)).all()


@pytest.mark.parametrize("which", ["along", "across"])
def test_a_preset_with_an_unknown_weight_is_refused_with_the_names_there_are(which):
    preset = Preset(trees=1, rounds=1, neighbours=1, radius=1, cap=1, **{which: "talbott"})
    with pytest.raises(
        ValueError, match="no MIS weight 'talbott', only 'talbot', 'pairwise', 'defensive', '1/Z', 'const"
    ):
        frame(HERE, live(), preset, random_in_row, X, [HERE])


def test_a_known_name_gives_its_member():
    assert named(WEIGHTS, "talbot", "weight") is WEIGHTS["talbot"]


# ---------------------------------------------------------------- columns and memory


def test_columns_count_from_the_least_there_is():
    columns(np.array([0, 5]))
    columns(np.array([-1, 5]), -1)
    columns(np.arange(0))
    with pytest.raises(IndexError, match=r"the index holds -1 in place 2\."):
        columns(np.array([0, 1, -1, -1]))


def test_a_batch_is_aligned_if_all_its_leaves_are():
    parts = (np.ones((2, 4)), (np.ones(4), None))
    assert aligned(parts, 4, "x") is parts
    with pytest.raises(ValueError, match=r"x have a part of shape \(4, 1\), but this batch has 4 columns"):
        aligned((np.ones(4), np.ones((4, 1))), 4, "x")
    with pytest.raises(ValueError, match=r"shape \(\)"):
        aligned(np.array(1.0), 4, "x")


def test_read_only_views_share_their_memory_and_leave_the_original_writeable():
    x = (np.ones(3), np.ones((2, 3)))
    for view, own in zip(read_only(x), x, strict=True):
        assert np.shares_memory(view, own)
        assert own.flags.writeable
        assert not view.flags.writeable


def test_results_are_apart_unless_all_their_arrays_are_the_same_writeable_memory():
    a, b, locked, none = np.ones(3), np.ones(3), read_only(np.ones(3)), np.ones(0)
    for one, other in ((a, b), ((a, b), (a, b.copy())), (locked, locked), (none, none)):
        apart(one, other, "x")
    for one, other in ((a, a), (a, a[:]), ((a, b), (a, b))):
        with pytest.raises(ValueError, match="two x are the same memory"):
            apart(one, other, "x")


def test_whatever_the_guards_let_through_changes_no_bit():
    assert same_bits(capped(X, 1), X)

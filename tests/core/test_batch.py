"""Laws of structs of arrays: gathering and merging columns reaches every leaf, in C order."""

from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from restir_ref.batch import Array, map_leaves, pick, ratio, take, total, where


@dataclass(frozen=True)
class Inner:
    number: Array
    nothing: None = None


@dataclass(frozen=True)
class Outer:
    point: Array
    inner: Inner
    pair: tuple[Array, tuple[Array, None]]


def batch(*columns):
    """A nested batch whose leaves, of shapes (N,), (3, N), (2, 3, N) and of several kinds, all say which column."""
    n = np.array(columns, dtype=int)
    point = np.stack([n, n + 0.25, n + 0.5])
    return Outer(point, Inner(n), (np.stack([point, -point]), (n % 2 == 1, None)))


def leaves(of) -> list[Array]:
    found: list[Array] = []
    map_leaves(found.append, of)
    return found


def same(a, b) -> bool:
    """Whether two batches have the same structure, kinds and numbers."""
    pairs = list(zip(leaves(a), leaves(b), strict=True))
    return repr(a) == repr(b) and all((x == y).all() and x.dtype == y.dtype for x, y in pairs)


def out_of_order(of) -> list[Array]:
    """Leaves that are not laid out in C order."""
    return [leaf for leaf in leaves(of) if not leaf.flags.c_contiguous]


columns = st.lists(st.integers(-9, 9), min_size=1, max_size=6)

# ---------------------------------------------------------------- columns


@given(columns, st.data())
def test_take_gathers_the_same_columns_of_every_leaf(n, data):
    index = data.draw(st.lists(st.integers(0, len(n) - 1), max_size=6))
    assert same(take(batch(*n), np.array(index, dtype=int)), batch(*np.array(n)[index]))


@given(columns, st.data())
def test_where_chooses_whole_columns(n, data):
    mask = np.array(data.draw(st.lists(st.booleans(), min_size=len(n), max_size=len(n))))
    other = np.array(n) + 100
    assert same(where(mask, batch(*n), batch(*other)), batch(*np.where(mask, n, other)))


@given(columns, st.integers(1, 4), st.data())
def test_pick_chooses_whole_columns_among_many_batches(n, M, data):
    s = np.array(data.draw(st.lists(st.integers(0, M - 1), min_size=len(n), max_size=len(n))))
    batches = [batch(*(np.array(n) + 100 * k)) for k in range(M)]
    assert same(pick(batches, s), batch(*(np.array(n) + 100 * s)))


def test_a_leaf_left_behind_is_noticed():
    right = take(batch(1, 2, 3), np.array([2, 0, 1]))
    forgotten = Outer(right.point, Inner(np.array([1, 2, 3])), right.pair)
    assert same(right, batch(3, 1, 2))
    assert not same(forgotten, right)


def test_choices_may_be_bytes_however_many_columns_there_are():
    s = np.arange(300, dtype=np.uint8) % 3
    assert (
        pick([np.arange(300) + 1000 * k for k in range(3)], s).tolist()
        == (np.arange(300) + 1000 * s.astype(int)).tolist()
    )


def test_pick_spreads_leaves_that_all_columns_share():
    assert same(pick([np.array(2.0), np.array([3.0])], np.array([0, 1, 0])), np.array([2.0, 3.0, 2.0]))


@pytest.mark.parametrize("M", [1, 2, 3])
@pytest.mark.parametrize("shape", [(), (1,), (3, 1), (2, 3, 1)])
def test_pick_spreads_leaves_of_one_column_over_the_batch_axis_alone(shape, M):
    s = np.array([0, 1, 2, 0]) % M
    picked = pick([np.full(shape, 10.0 * k) for k in range(M)], s)
    assert np.array_equal(picked, np.broadcast_to(10.0 * s, (*shape[:-1], 4)))


def test_nothing_is_changed_in_place():
    before, s = batch(1, 2, 3), np.array([0, 1, 1])
    picked = pick([before, batch(4, 5, 6)], s)
    picked.point[:] = take(before, s).point[:] = -1
    assert same(before, batch(1, 2, 3))


# ---------------------------------------------------------------- layout

GATHERS = {
    "take": take,
    "where": lambda X, index: where(index > 1, X, X),
    "pick": lambda X, index: pick([X, X], index % 2),
}


@pytest.mark.parametrize("gather", GATHERS.values(), ids=GATHERS)
def test_gathered_leaves_keep_C_order(gather):
    assert out_of_order(gather(batch(1, 2, 3), np.array([2, 0, 1]))) == []


def test_fancy_indexing_returns_Fortran_order_and_is_noticed():
    fancy = map_leaves(lambda leaf: leaf[..., np.array([2, 0, 1])], batch(1, 2, 3))
    assert len(out_of_order(fancy)) == 2


# ---------------------------------------------------------------- mistakes

MISTAKES = {
    "a list": ([1.0], "list: [1.0]"),
    "a number": (1.0, "float: 1.0"),
    "a word": ("x", "str: 'x'"),
    "a dict": ({"x": np.ones(1)}, "dict: {'x'"),
    "a class": (Inner, "type: <class"),
    "deep down": (Inner((np.ones(1), 2)), "int: 2"),
}


@pytest.mark.parametrize(("wrong", "said"), MISTAKES.values(), ids=MISTAKES)
@pytest.mark.parametrize("use", [take, lambda X, s: where(s == 0, X, X), lambda X, s: pick([X, X], s)])
def test_a_leaf_that_is_no_array_is_named_with_what_is_allowed(use, wrong, said):
    with pytest.raises(TypeError) as complaint:
        use(wrong, np.array([0]))
    assert said in str(complaint.value)
    assert "arrays, tuples or dataclasses of arrays" in str(complaint.value)


ODD = {"the first": (0, "tuple, ndarray, ndarray"), "the last": (2, "ndarray, ndarray, tuple")}


@pytest.mark.parametrize(("odd", "kinds"), ODD.values(), ids=ODD)
def test_a_batch_of_another_structure_is_refused_wherever_it_is(odd, kinds):
    batches = [np.ones(1)] * 3
    batches[odd] = (np.ones(1),)  # type: ignore[call-overload]
    with pytest.raises(TypeError, match=f"must have one structure, but corresponding parts are {kinds}"):
        map_leaves(lambda *leaves: leaves[0], *batches)


def test_a_missing_leaf_and_an_array_do_not_merge():
    with pytest.raises(TypeError, match="corresponding parts are NoneType, ndarray"):
        where(np.ones(1) == 1, Inner(np.ones(1)), Inner(np.ones(1), np.ones(1)))  # type: ignore[arg-type]


def test_tuples_of_unequal_length_do_not_merge():
    one = np.ones(1)
    with pytest.raises(ValueError, match="argument 2 is shorter"):
        where(one == 1, (one, one), (one,))


def test_a_column_that_is_not_there_is_refused():
    with pytest.raises(IndexError, match="index 3 is out of bounds"):
        take(batch(1, 2, 3), np.array([3]))


# ---------------------------------------------------------------- arithmetic


@pytest.mark.parametrize("zero", [0, 0.0, -0.0])
def test_anything_over_zero_is_zero(zero):
    assert (ratio(np.array([0.0, 1.0, 3.0]), np.array([zero, zero, 2.0])) == [0, 0, 1.5]).all()


def test_what_is_over_zero_is_a_plain_zero_without_a_sign():
    assert not np.signbit(ratio(np.array([0.0, 1.0, 3.0]), np.array([0.0, 0.0, 2.0]))).any()


def test_plain_division_by_zero_is_noticed():
    with pytest.raises(RuntimeWarning, match="divide by zero"):
        np.array([1.0]) / np.array([0.0])


@given(st.lists(st.lists(st.floats(-1e9, 1e9), min_size=2, max_size=2), min_size=1, max_size=6))
def test_totals_add_from_left_to_right_without_a_zero(rows):
    expected = np.array(rows[0])
    for row in rows[1:]:
        expected = expected + row
    assert total([np.array(row) for row in rows]).tolist() == expected.tolist()

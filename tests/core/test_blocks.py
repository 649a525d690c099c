"""Laws of samples that are named and not gathered: a reference is, field by field, what gathering would have given."""

import pickle
from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from restir_ref.batch import (
    Array,
    Block,
    changed,
    entries,
    gathered,
    is_reference,
    joined,
    map_leaves,
    part,
    pick,
    put,
    reference,
    rows,
    take,
    where,
)
from restir_ref.guards import aligned, apart, read_only
from restir_ref.integrals import Pixels, Shifted, shifted_together


@dataclass(frozen=True)
class Wide(Block):
    """A sample of many numbers, of which a shift decides f."""

    u: Array
    k: Array
    f: Array
    pair: tuple[Array, Array | None]


@dataclass(frozen=True)
class Plain:
    """The same, gathered at once."""

    u: Array
    k: Array
    f: Array
    pair: tuple[Array, Array | None]


def wide(*columns: int) -> Wide:
    """Leaves that all say which column."""
    n = np.array(columns, dtype=int)
    return Wide(np.stack([n, n + 0.25, n + 0.5]), n, n / 2, (n * 10, None))


def plain(x: Wide) -> Plain:
    """Everything, read."""
    return Plain(x.u, x.k, x.f, x.pair)


def same(a: Wide, b: Wide) -> bool:
    """Whether two batches have the same numbers everywhere."""
    return repr(plain(a)) == repr(plain(b))


rising = st.lists(st.integers(-9, 9), min_size=1, max_size=6)


def drawn(data: st.DataObject, n: int, most: int = 6) -> Array:
    """Columns, some of them often."""
    return np.array(data.draw(st.lists(st.integers(0, n - 1), min_size=1, max_size=most)), dtype=int)


@given(rising, st.data())
def test_a_reference_reads_as_what_it_names(n, data):
    index = drawn(data, len(n))
    x = take(wide(*n), index)
    assert is_reference(x)
    assert isinstance(x, Wide)
    assert same(x, wide(*np.array(n)[index]))


@given(rising, st.data())
def test_a_reference_to_a_reference_names_the_first_block(n, data):
    block = wide(*n)
    one = drawn(data, len(n))
    two = drawn(data, len(one))
    of, index, own = reference(take(take(block, one), two))
    assert of is block
    assert index.tolist() == one[two].tolist()
    assert own == {}


@given(rising, st.data())
def test_what_is_changed_stays_changed_however_often_columns_are_taken(n, data):
    one = drawn(data, len(n))
    f = np.arange(len(one)) + 0.125
    x = changed(take(wide(*n), one), f=f)
    two = drawn(data, len(one))
    assert is_reference(take(x, two))
    assert same(take(x, two), replace(wide(*np.array(n)[one[two]]), f=f[two]))


def test_two_changes_of_different_fields_both_stay():
    x = changed(changed(take(wide(1, 2, 3), np.array([2, 0])), f=np.array([7.0, 8.0])), k=np.array([5, 6]))
    assert is_reference(x)
    assert same(x, replace(wide(3, 1), f=np.array([7.0, 8.0]), k=np.array([5, 6])))


def test_a_reference_that_forgot_what_was_changed_would_be_noticed():
    x = changed(take(wide(1, 2, 3), np.array([2, 0])), f=np.array([7.0, 8.0]))
    of, index, _ = reference(x)
    assert not same(x, take(of, index))


def test_a_block_itself_is_changed_without_a_copy_of_the_rest():
    block = wide(1, 2)
    y = changed(block, f=np.zeros(2))
    assert not is_reference(y)
    assert y.u is block.u


def test_only_what_is_read_is_gathered():
    x = take(wide(1, 2, 3), np.array([2, 0]))
    x.k  # noqa: B018
    assert set(x.__dict__) & {"u", "k", "f", "pair"} == {"k"}
    assert x.k is x.k


@pytest.mark.parametrize("which", [slice(0), slice(1), slice(1, 3), slice(3)])
@pytest.mark.parametrize("read", [False, True])
def test_some_rows_can_be_read_alone(which, read):
    x = take(wide(1, 2, 3), np.array([2, 0]))
    if read:
        x.u  # noqa: B018
    assert rows(x, "u", which).tolist() == wide(3, 1).u[which].tolist()
    assert ("u" in x.__dict__) == read
    assert rows(wide(3, 1), "u", which).tolist() == wide(3, 1).u[which].tolist()
    assert rows(changed(x, u=x.u + 1), "u", which).tolist() == (wide(3, 1).u[which] + 1).tolist()


@pytest.mark.parametrize("read", [False, True])
def test_a_row_of_its_own_can_be_read_for_every_column(read):
    x, i = take(wide(1, 2, 3), np.array([2, 0])), np.array([2, 1])
    if read:
        x.u  # noqa: B018
    expected = wide(3, 1).u[i, [0, 1]]
    assert entries(x, "u", i).tolist() == expected.tolist()
    assert ("u" in x.__dict__) == read
    assert entries(wide(3, 1), "u", i).tolist() == expected.tolist()
    assert entries(changed(x, u=x.u + 1), "u", i).tolist() == (expected + 1).tolist()


@pytest.mark.parametrize("name", ["v", "_of_", "__array__"])
@pytest.mark.parametrize("x", [wide(1), take(wide(1), np.array([0]))], ids=["block", "reference"])
def test_a_field_that_is_not_there_is_an_attribute_error(x, name):
    with pytest.raises(AttributeError, match=f"'Wide' object has no attribute '{name}'"):
        getattr(x, name)


@given(rising, st.data())
def test_parts_are_columns_in_the_same_memory(n, data):
    start = data.draw(st.integers(0, len(n)))
    here = slice(start, data.draw(st.integers(start, len(n))))
    block = wide(*n)
    for x in (block, take(block, np.arange(len(n)))):
        assert x.k.shape == (len(n),)
        some = part(x, here)
        assert same(some, wide(*n[here]))
        assert not some.k.size or np.shares_memory(some.k, x.k)


@given(rising, rising, st.booleans())
def test_joined_batches_lie_one_behind_the_other(n, m, one_block):
    block = wide(*n, *m)
    first, second = take(block, np.arange(len(n))), take(block, len(n) + np.arange(len(m)))
    x = joined([first, second if one_block else wide(*m)])
    assert is_reference(x) == one_block
    assert same(x, block)
    assert joined([first]) is first


def test_references_with_unlike_changes_are_joined_all_the_same():
    block = wide(1, 2, 3)
    x, y = take(block, np.array([0])), changed(take(block, np.array([2])), f=np.array([9.0]))
    assert same(joined([x, y]), replace(wide(1, 3), f=np.array([0.5, 9.0])))


@given(rising, st.integers(1, 4), st.data())
def test_a_pick_among_references_is_that_among_what_they_name(n, M, data):
    N = len(n)
    block, s = wide(*n), np.array(data.draw(st.lists(st.integers(0, M - 1), min_size=N, max_size=N)))
    near = [take(block, (np.arange(N) + k) % N) for k in range(M)]
    batches = [block, *(changed(x, f=x.f + k) for k, x in enumerate(near[1:], start=1))]
    chosen = pick(batches, s)
    expected = pick([plain(gathered(x)) for x in batches], s)
    assert not is_reference(chosen)
    assert repr(plain(chosen)) == repr(expected)


def test_a_pick_among_references_to_several_blocks_reads_them():
    here, there = wide(1, 2, 3), wide(4, 5, 6)
    found = pick([here, take(there, np.array([2, 1, 0]))], np.array([0, 1, 1]))
    assert same(found, wide(1, 5, 4))
    assert not is_reference(found)


def test_a_pick_that_took_the_wrong_columns_would_be_noticed():
    block, s = wide(1, 2, 3), np.array([0, 1, 0])
    assert not same(pick([block, take(block, np.array([0, 2, 1]))], s), take(block, s))


def test_references_can_be_replaced_pickled_and_merged_like_blocks():
    x = take(wide(1, 2, 3), np.array([2, 0]))
    assert same(replace(x, k=np.array([7, 8])), replace(wide(3, 1), k=np.array([7, 8])))
    assert same(pickle.loads(pickle.dumps(x)), x)
    assert same(where(np.array([True, False]), x, wide(8, 9)), wide(3, 9))
    assert same(map_leaves(lambda leaf: leaf + 1, x).__class__(*plain(wide(4, 2)).__dict__.values()), wide(4, 2))


def test_a_column_that_is_not_there_is_refused_before_it_is_read():
    with pytest.raises(IndexError, match="index 2 is out of bounds"):
        take(wide(1, 2), np.array([2]))


def test_values_are_put_into_columns_of_every_leaf():
    x = wide(1, 2, 3)
    put(x, np.array([2, 0]), wide(8, 9))
    assert same(x, wide(9, 2, 8))


def test_guards_look_at_what_there_is_and_gather_nothing():
    x = changed(take(wide(1, 2, 3), np.array([2, 0])), f=np.array([7.0, 8.0]))
    locked = read_only(x)
    for each in (aligned(x, 2, "samples"), locked):
        assert set(each.__dict__) & {"u", "k", "f", "pair"} == {"f"}
    with pytest.raises(ValueError, match="read-only"):
        locked.f[0] = 1
    with pytest.raises(ValueError, match="same memory"):
        apart(x, changed(x, f=x.f), "samples")
    apart(x, changed(x, f=x.f.copy()), "samples")
    with pytest.raises(ValueError, match=r"have a part of shape \(2,\), but this batch has 3 columns"):
        aligned(x, 3, "samples")


# ---------------------------------------------------------------- shifts of many inputs


@dataclass(frozen=True, eq=False)
class Moving:
    """Shifts that add where they come from and go to; every call is noted."""

    calls: list[int]

    def shift(self, x, index, to):
        self.calls.append(len(index))
        return Shifted(changed(x, f=x.f + 10 * index + 100 * to.index), 1.0 + to.index)


def test_shifts_from_one_image_to_one_other_are_one_call_and_what_several_would_be():
    one, other = Moving([]), Moving([])
    block = wide(1, 2, 3)
    xs = [take(block, np.array(index)) for index in ([0, 1], [2, 2], [1, 0])]
    ats = [Pixels(of, np.array(index)) for of, index in ((one, [0, 1]), (other, [2, 2]), (one, [1, 0]))]
    tos = [Pixels(one, np.array(index)) for index in ([3, 4], [5, 6], [7, 8])]
    together = shifted_together(xs, ats, tos)
    assert (one.calls, other.calls) == ([4], [2])
    shifted_together([block] * 3, [Pixels(other, np.array([2, 1, 0]))] * 3, [Pixels(one, np.arange(3))] * 3)
    assert other.calls == [2, 9]
    for y, x, at, to in zip(together, xs, ats, tos, strict=True):
        alone = at.of.shift(x, at.index, to)
        assert same(y.x, alone.x)
        assert y.J.tolist() == alone.J.tolist()


@dataclass(frozen=True, eq=False)
class Rigid:
    """A shift with one Jacobian for all columns."""

    J: float

    def shift(self, x, index, to):
        return Shifted(x, np.asarray(self.J))


@pytest.mark.parametrize("J", [2.0, 0.5, 0.0])
def test_one_jacobian_for_all_columns_is_that_of_every_column(J):
    of, index = Rigid(J), np.array([0, 1])
    here = [Pixels(of, index)] * 2
    for y in shifted_together([wide(1, 2), wide(3, 4)], here, here):
        assert y.J.tolist() == [J, J]


def test_nothing_to_shift_is_no_call():
    assert list(shifted_together([], [], [])) == []

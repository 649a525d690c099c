"""Laws of windows: passes over a few columns at a time give the same bytes, and end where the whole pass ends."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from restir_ref import chance as chances
from restir_ref import windows
from restir_ref.batch import Array
from restir_ref.chance import ROWS, Chance, Columns, Live
from restir_ref.integrals import NOWHERE, Pixels, Reservoirs
from restir_ref.loop import OFFLINE, REAL_TIME, WHOLE, Passes, Preset, frame, random_in_row
from restir_ref.oracle.enumeration import outcomes
from restir_ref.windows import over_windows, windowed
from tests.core.lines import bent

KINDS = (np.random.PCG64, np.random.PCG64DXSM, np.random.MT19937, np.random.Philox)
GENERATORS = {kind.__name__: kind for kind in KINDS}
PRESETS = {"real time": REAL_TIME, "offline": replace(OFFLINE, trees=4)}
REPLICAS = 12


def rng(kind: str = "PCG64", seed: int = 3) -> np.random.Generator:
    return np.random.Generator(GENERATORS[kind](seed))


def two_frames(preset: Preset, passes: Passes, generator: np.random.Generator, moved: int = 0) -> list[Array]:
    """Everything that two frames hold, and what the generator draws next; history is `moved` pixels away."""
    of, chance = bent(), Live(generator)
    here = Pixels(of, np.arange(REPLICAS * of.n))
    X = frame(here, chance, preset, random_in_row, passes=passes)
    if not np.isnan(preset.cap):
        there = here.index % of.n + moved
        before = [Pixels(of, np.where(there < of.n, here.index + moved, NOWHERE))]
        X = frame(here, chance, preset, random_in_row, X, before, passes=passes)
    return [X.x, X.W, X.c, generator.random(3), generator.integers(9, size=5, dtype=np.uint32)]


def same(ours: list[Array], theirs: list[Array]) -> bool:
    return all(a.dtype == b.dtype and a.tobytes() == b.tobytes() for a, b in zip(ours, theirs, strict=True))


@pytest.mark.parametrize("moved", [0, 1])
@pytest.mark.parametrize("size", [2, 40, 1000])
@pytest.mark.parametrize("preset", PRESETS)
def test_frames_give_the_same_bytes_in_windows_of_any_size(preset, size, moved):
    whole, cut = (two_frames(PRESETS[preset], passes, rng(), moved) for passes in (WHOLE, windowed(size)))
    assert same(cut, whole)


@pytest.mark.parametrize("kind", GENERATORS)
def test_so_does_every_generator_whether_it_can_jump_or_not(kind, monkeypatch):
    monkeypatch.setattr(chances, "AT_ONCE", 50)
    whole, cut = (two_frames(REAL_TIME, passes, rng(kind)) for passes in (WHOLE, windowed(30)))
    assert same(cut, whole)


def test_half_a_number_that_is_left_over_stays_for_who_asks_for_it():
    whole, cut = rng(), rng()
    for generator in (whole, cut):
        generator.integers(9, dtype=np.uint32)
    assert same(two_frames(REAL_TIME, windowed(50), cut), two_frames(REAL_TIME, WHOLE, whole))
    assert whole.bit_generator.state == cut.bit_generator.state


class OfItsOwn(Columns):
    """A mistake: a window draws the next numbers of the generator, as a pass on these columns alone would."""

    def random(self, shape: int | tuple[int, ...]) -> Array:
        self.drawn[ROWS] += int(np.prod(shape)) // (self.at.stop - self.at.start)
        return self.rng.random(shape)


class OneTooFar(Columns):
    """A mistake: of every row, the columns beside the window's."""

    def random(self, shape: int | tuple[int, ...]) -> Array:
        beside = Columns(self.rng, slice(self.at.start + 1, self.at.stop + 1), self.n, self.drawn)
        return beside.random(shape)


@pytest.mark.parametrize("wrong", [OfItsOwn, OneTooFar])
@pytest.mark.parametrize("preset", PRESETS)
def test_a_window_that_draws_other_numbers_is_noticed(preset, wrong, monkeypatch):
    whole = two_frames(PRESETS[preset], WHOLE, rng())
    monkeypatch.setattr(windows, "Columns", wrong)
    assert not same(two_frames(PRESETS[preset], windowed(30), rng()), whole)


# ---------------------------------------------------------------- windows


@given(st.integers(1, 300), st.integers(2, 40), st.integers(1, 5))
@example(tiles=4, size=2, step=5)
def test_windows_cover_all_columns_in_order_and_none_is_narrow_or_lone(tiles, size, step):
    n = tiles * step
    cuts = list(windows.windows(n, size, step))
    assert [at.start for at in cuts] == [0, *(at.stop for at in cuts[:-1])]
    assert cuts[-1].stop == n
    assert all(at.start % step == 0 for at in cuts)
    wide = [at.stop - at.start for at in cuts]
    assert len(cuts) == 1 or min(wide) > max(size, step) - step
    assert max(wide) < 2 * max(size, step) + step


def uniform(at: slice, chance: Chance, rows: int = 2) -> Array:
    return chance.uniform((rows, at.stop - at.start))


def test_windows_of_arrays_are_columns_of_the_whole_array():
    whole, cut = rng(), rng()
    found = over_windows(uniform, 50, Live(cut), 8)
    assert (found == whole.random((2, 50))).all()
    assert cut.random() == whole.random()


def test_windows_that_draw_unlike_numbers_of_rows_are_refused():
    with pytest.raises(ValueError, match=r"windows drew \[1, 2, 3\] rows of numbers"):
        over_windows(lambda at, chance: uniform(at, chance, 1 + at.start // 10)[:1], 30, Live(rng()), 10)


@pytest.mark.parametrize("shape", [(3, 9), (11,), ()])
def test_rows_of_another_width_than_the_windows_are_refused(shape):
    with pytest.raises(ValueError, match="a window of 10 columns was asked for"):
        over_windows(lambda at, chance: chance.uniform(shape), 20, Live(rng()), 10)


def test_what_cannot_jump_is_no_chance_for_windows():
    with pytest.raises(TypeError, match="their chance is a Live one"):
        list(outcomes(lambda _, chance: over_windows(uniform, 20, chance, 10), 20))


@pytest.mark.parametrize("size", [1, 0, 2.5])
def test_a_window_of_less_than_two_columns_is_refused(size):
    with pytest.raises(ValueError, match=r"the size of a window must be a whole number >= 2"):
        windowed(size)


def test_complaints_say_from_where_columns_are_counted():
    of = bent()
    here = Pixels(of, np.arange(10 * of.n))
    X = windowed(35).initial(here, Live(rng()))
    bad = Reservoirs(X.x, np.where(here.index == 40, np.nan, X.W), X.c)
    with pytest.raises(ValueError, match="nan in column 5") as caught:
        windowed(35).spatial(bad, here, [], Live(rng()))
    assert caught.value.__notes__ == ["Columns are counted from 35, where a window of the pass begins."]


def test_a_window_of_all_columns_is_the_pass_itself():
    chance, seen = Live(rng()), []
    over_windows(lambda at, chance: seen.append(chance) or np.zeros(at.stop - at.start), 15, chance, 10)
    assert seen == [chance]
    assert len([*pairwise(windows.windows(15, 5))]) == 2

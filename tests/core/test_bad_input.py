"""Laws of complaints: bad input raises the right error, which names the value, its place and the remedy."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import NamedTuple

import numpy as np
import pytest

from restir_ref.batch import Array
from restir_ref.guards import nonnegative, per_column
from restir_ref.integrals import Pixels
from restir_ref.mis import ANY, CANONICAL_COVERS, WEIGHTS
from restir_ref.oracle.cells import cells
from restir_ref.oracle.enumeration import outcomes
from restir_ref.oracle.scenes import offset, paired
from restir_ref.resampling import Candidate, Input, gris, select
from restir_ref.restir import initial, resample, reuse_all, spatial, temporal
from tests.core.stubs import Wrapped, live
from toy1d import two_pixels

pytestmark = pytest.mark.kernel

TOY, INDEX = two_pixels(), np.arange(4)
HERE, RIGHT = Pixels(TOY, INDEX), offset(TOY, INDEX, 1)
X = initial(HERE, live())
TALBOT = WEIGHTS["talbot"]
NAN, INF = np.nan, np.inf


class Mistake(NamedTuple):
    """What somebody does, the error they get, and the words in it: the value or place, and the remedy."""

    act: Callable[[], object]
    error: type[Exception]
    place: str
    remedy: str


def faults(mistake: Mistake) -> list[str]:
    """What the complaint about a mistake lacks."""
    try:
        mistake.act()
    except mistake.error as complaint:
        wanted = {"place": mistake.place, "remedy": mistake.remedy}
        return [f"no {what}" for what, words in wanted.items() if words not in str(complaint)]
    except Exception as complaint:
        return [f"{type(complaint).__name__} instead of {mistake.error.__name__}"]
    return ["no complaint"]


def at(column: int, value: float) -> Array:
    """Ones, with one value replaced."""
    ones = np.ones(len(INDEX))
    ones[column] = value
    return ones


@dataclass(frozen=True, eq=False)
class Answering(Wrapped):
    """Integrals whose target is `p_hat`, whatever the sample."""

    p_hat: Array

    def target(self, index, x):
        return self.p_hat.copy()


def with_target(p_hat: Array) -> Pixels:
    return Pixels(Answering(TOY, p_hat), INDEX)


# ---------------------------------------------------------------- numbers

BAD_NUMBERS = {"negative": (-0.5, "is -0.5 in"), "NaN": (NAN, "is nan in"), "infinite": (INF, "is inf in")}
SOURCES = "W comes from 1/p or from a pass, c counts samples."

NUMBERS = {
    "target": (lambda bad: initial(with_target(bad), live()), "the target p_hat", "Return |f|"),
    "target of a neighbour": (
        lambda bad: spatial(X, with_target(np.ones(4)), [with_target(bad)], live(), mis=TALBOT),
        "the target p_hat",
        "Return |f|",
    ),
    "m W of a candidate": (
        lambda bad: select([Candidate(X.x, np.ones(4), bad)], live(), X.c),
        "a resampling weight w_i = p_hat m_i W_i",
        "Check the m W of the candidates",
    ),
    "own weight": (lambda bad: spatial(replace(X, W=bad), HERE, [], live()), "weight W of input 0", SOURCES),
    "weight of history": (
        lambda bad: temporal(X, HERE, replace(X, W=bad[RIGHT.index]), [RIGHT], live()),
        "weight W of input 1",
        SOURCES,
    ),
    "own confidence": (lambda bad: reuse_all(replace(X, c=bad), HERE, [RIGHT]), "confidence c of input 0", SOURCES),
    "confidence of an input": (
        lambda bad: gris([Input(X, HERE), Input(replace(X, c=bad), RIGHT)], HERE, TALBOT, live()),
        "confidence c of input 1",
        SOURCES,
    ),
}


@pytest.mark.parametrize(("value", "said"), BAD_NUMBERS.values(), ids=BAD_NUMBERS)
@pytest.mark.parametrize(("act", "what", "remedy"), NUMBERS.values(), ids=NUMBERS)
def test_a_bad_number_is_named_with_its_column_and_a_remedy(act, what, remedy, value, said):
    def bad():
        act(at(2, value))

    assert faults(Mistake(bad, ValueError, what, remedy)) == []
    assert faults(Mistake(bad, ValueError, f"{said} column 2 (1 of", remedy)) == []


@pytest.mark.parametrize(("act", "what", "remedy"), NUMBERS.values(), ids=NUMBERS)
def test_zeros_and_large_numbers_are_no_mistakes(act, what, remedy):
    for fine in (0.0, 5e-324, 1e150):
        act(at(2, fine))


EXACT = {"negative": Fraction(-1, 2), "NaN": NAN, "infinite": INF}


@pytest.mark.parametrize("value", EXACT.values(), ids=EXACT)
@pytest.mark.parametrize(("act", "what", "remedy"), NUMBERS.values(), ids=NUMBERS)
def test_a_bad_number_among_fractions_is_named_too(act, what, remedy, value):
    def with_third(third):
        act(np.array([Fraction(1), Fraction(1, 3), third, Fraction(2)], dtype=object))

    assert faults(Mistake(lambda: with_third(value), ValueError, "in column 2 (1 of", f". {remedy}")) == []
    with_third(Fraction(1, 2))


def test_a_bad_number_that_all_columns_share_is_named():
    assert (
        faults(Mistake(lambda: nonnegative(np.array(-0.5), "J", "Return |J|."), ValueError, "J must", "Return")) == []
    )


# ---------------------------------------------------------------- shapes and numbers of things

THREE = np.ones(3)
SHAPES = {
    "a target of the wrong length": Mistake(
        lambda: initial(with_target(THREE), live()), ValueError, "p_hat has shape (3,)", "the last axis must be 4"
    ),
    "weights of the wrong length": Mistake(
        lambda: gris([Input(replace(X, W=THREE), HERE)], HERE, TALBOT, live()),
        ValueError,
        "weight W of input 0 has shape (3,)",
        "the last axis must be 4",
    ),
    "confidences of the wrong length": Mistake(
        lambda: gris([Input(replace(X, c=THREE), HERE)], HERE, TALBOT, live()),
        ValueError,
        "confidence c of input 0 has shape (3,)",
        "the last axis must be 4",
    ),
    "fewer neighbours than pixels": Mistake(
        lambda: spatial(X, HERE, [Pixels(TOY, INDEX[:3])], live()),
        ValueError,
        "input 1 has 3 columns, but this pass has 4",
        "take() the right ones first",
    ),
    "a source pixel beyond the frame": Mistake(
        lambda: temporal(X, HERE, X, [Pixels(TOY, INDEX + 1)], live()),
        IndexError,
        "column 4 is asked of reservoirs that hold 4,",
        "they must hold whole images",
    ),
    "no inputs": Mistake(
        lambda: gris([], HERE, TALBOT, live()), ValueError, "(M = 0)", "pass the pixel's own reservoirs"
    ),
    "no candidates": Mistake(
        lambda: select([], live(), np.ones(4)), ValueError, "(M = 0)", "yield one from candidates(), or pass an input"
    ),
    "no candidates from a sampler": Mistake(
        lambda: resample([], HERE, live()), ValueError, "(M = 0)", "yield one from candidates(), or pass an input"
    ),
    "a cap of 0": Mistake(
        lambda: temporal(X, HERE, X, [RIGHT], live(), cap=0), ValueError, "but is 0;", "leave temporal reuse out"
    ),
    "a negative cap": Mistake(
        lambda: temporal(X, HERE, X, [RIGHT], live(), cap=-1.5), ValueError, "but is -1.5;", "leave temporal reuse out"
    ),
    "a cap of NaN": Mistake(
        lambda: temporal(X, HERE, X, [RIGHT], live(), cap=NAN), ValueError, "but is nan;", "leave temporal reuse out"
    ),
}

# ---------------------------------------------------------------- canonical inputs

STRANGERS = {
    "no canonical input": Input(X, Pixels(TOY, INDEX)),
    "a canonical input of confidence 0": Input(replace(X, c=at(1, 0)), HERE),
}
CANONICAL = {
    f"{what} for {name} weights": Mistake(
        lambda only=only, mis=mis: gris([only], HERE, mis, live()),
        ValueError,
        "(|R| = 0)",
        "`at` is the Pixels object of the pass, and keep the confidence of null samples",
    )
    for name, mis in WEIGHTS.items()
    if mis.unbiased_for == CANONICAL_COVERS
    for what, only in STRANGERS.items()
}


@pytest.mark.parametrize("name", [name for name, mis in WEIGHTS.items() if mis.unbiased_for == ANY])
def test_weights_for_any_inputs_need_no_canonical_one(name):
    gris([Input(X, Pixels(TOY, INDEX))], HERE, WEIGHTS[name], live())


# ---------------------------------------------------------------- the oracle

V, F = np.ones((2, 2)), np.ones((2, 2))
UNIFORM = np.full((1, 2, 2), 0.5)
SWAP = paired(2, 2, {(0, 1): (1, 0)})


def with_shift(i: int, j: int, x: int, y: int) -> Array:
    """The swap of two cells with T_ij(x) = y."""
    shifts = SWAP.copy()
    shifts[i, j, x] = y
    return shifts


def chooses_ten_times(index, chance):
    for _ in range(10):
        chance.choose(np.ones((2, len(index))))


ORACLE = {
    "two cells shifted to one": Mistake(
        lambda: cells(V, F, UNIFORM, with_shift(0, 1, 1, 1)),
        ValueError,
        "from integral 0 to 1 maps cell 1 to 1",
        "partial injections with T_ji = T_ij^-1",
    ),
    "a shift without a way back": Mistake(
        lambda: cells(V, F, UNIFORM, with_shift(1, 0, 1, -1)),
        ValueError,
        "from integral 0 to 1 maps cell 0 to 1",
        "partial injections with T_ji = T_ij^-1",
    ),
    "a density of integral 2": Mistake(
        lambda: cells(V, F, UNIFORM * [[1], [2]], SWAP), ValueError, "the integrals are [[1. 2.]]", "divide by them"
    ),
    "a technique that samples nothing": Mistake(
        lambda: cells(V, F, UNIFORM * [[0], [1]], SWAP), ValueError, "the integrals are [[0. 1.]]", "divide by them"
    ),
    "a uniform number under enumeration": Mistake(
        lambda: list(outcomes(lambda index, chance: initial(Pixels(TOY, index), chance), 2)),
        TypeError,
        "uniform()",
        "choose() over finite cells",
    ),
    "an endless enumeration": Mistake(
        lambda: list(outcomes(chooses_ten_times, 1, most_leaves=1000)),
        ValueError,
        "at least 1024 leaves, more than the limit of 1000",
        "take fewer pixels, cells or passes, or raise most_leaves",
    ),
}

# ---------------------------------------------------------------- batches

BATCHES = {
    f"samples in {kind}": Mistake(
        lambda x=x: spatial(replace(X, x=x), HERE, [RIGHT], live()),
        TypeError,
        f"not {type(x).__name__}: {x!r}",
        "a batch holds arrays, tuples or dataclasses of arrays",
    )
    for kind, x in {"a list": [0.5] * 4, "a dict": {"x": [0.5] * 4}, "a number": 0.5}.items()
}

MISTAKES = SHAPES | CANONICAL | ORACLE | BATCHES


@pytest.mark.parametrize("mistake", MISTAKES.values(), ids=MISTAKES)
def test_a_mistake_raises_the_right_error_with_place_and_remedy(mistake):
    assert faults(mistake) == []


def test_their_right_counterparts_are_no_mistakes():
    cells(V, F, UNIFORM, SWAP)
    assert len(list(outcomes(chooses_ten_times, 1, most_leaves=1024))) == 1
    temporal(X, HERE, X, [RIGHT], live(), cap=1e-9)
    spatial(X, HERE, [], live())


# ---------------------------------------------------------------- poor complaints


def mute() -> None:
    raise ValueError("bad value")


POOR = {
    "silence": (lambda: None, ["no complaint"]),
    "another error": (lambda: {}["x"], ["KeyError instead of ValueError"]),
    "no words": (mute, ["no place", "no remedy"]),
    "a place only": (lambda: nonnegative(at(1, -1), "W", "Pray."), ["no remedy"]),
    "a remedy only": (lambda: per_column(THREE, 4, "q"), ["no place"]),
}


@pytest.mark.parametrize(("act", "found"), POOR.values(), ids=POOR)
def test_a_poor_complaint_is_noticed(act, found):
    assert faults(Mistake(act, ValueError, "W must be", "the last axis must be 4")) == found

"""Laws of the doors to integrals: Jacobians, densities and samples that come through, memory, and f where W = 0."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np
import pytest

from restir_ref import integrals as doors
from restir_ref import resampling
from restir_ref.batch import Array
from restir_ref.decorrelation import Blue, Move, mutate
from restir_ref.gradient import MAGNITUDE, Pairs, gap, gradient_after, omega, one_sided
from restir_ref.integrals import (
    NOWHERE,
    Pixels,
    Reservoirs,
    Shifted,
    p_hat_from,
    pdf,
    pixels,
    shifted,
    target,
    times,
    weighted,
)
from restir_ref.mis import WEIGHTS
from restir_ref.oracle.laws import bias_of
from restir_ref.oracle.scenes import offset, three_pixel_scene
from restir_ref.resampling import Input, gris
from restir_ref.restir import initial, resample, reuse_all, shade, spatial, temporal
from tests.core.stubs import Always, Wrapped, live, same_bits
from toy1d import image_of_64, overlapping_supports, partial_shift, walking

pytestmark = pytest.mark.kernel

TALBOT = WEIGHTS["talbot"]
TOY, N = overlapping_supports(), 70
HERE = Pixels(TOY, np.arange(N))
NEAR = [offset(TOY, HERE.index, by) for by in (1, 2)]
X = initial(HERE, live())
X = replace(X, x=X.x.copy())


def of(integrals) -> tuple[Pixels, list[Pixels]]:
    """The pixels of these integrals instead, and their neighbours."""
    return Pixels(integrals, HERE.index), [Pixels(integrals, near.index) for near in NEAR]


# ---------------------------------------------------------------- numbers that come through


@dataclass(frozen=True, eq=False)
class Returning(Wrapped):
    """Integrals of which one answer is replaced by change(answer)."""

    x: Callable[[Array], Array] = lambda x: x
    J: Callable[[Array], Array] = lambda J: J
    p: Callable[[Array], Array] = lambda p: p
    p_hat: Callable[[Array], Array] = lambda p_hat: p_hat

    def target(self, index, x):
        return self.p_hat(self.of.target(index, x))

    def shift(self, x, index, to):
        y = super().shift(x, index, to)
        return Shifted(self.x(y.x), self.J(y.J))

    def pdf(self, index, x):
        return self.p(self.of.pdf(index, x))


def with_value(value: float, column: int = 2) -> Callable[[Array], Array]:
    return lambda a: np.where(np.arange(len(a)) == column, value, a)


BAD = {
    "signed": (lambda a: -np.abs(a) - 1, "must be finite and non-negative, but is -"),
    "negative in one column": (with_value(-0.5), "is -0.5 in column 2"),
    "NaN": (with_value(np.nan), "is nan in column 2"),
    "infinite": (with_value(np.inf), "is inf in column 2"),
    "a column of a matrix": (lambda a: a[:, None], r"has shape \(\d+, 1\)"),
    "a row of a matrix": (lambda a: a[None], r"has shape \(1, \d+\)"),
    "too short": (lambda a: a[1:], r"has shape \(\d+,\), but this batch has \d+ columns"),
    "of one column": (lambda a: a[:1], r"has shape \(1,\), but this batch has \d+ columns"),
}
every_bad_number = pytest.mark.parametrize(("change", "said"), BAD.values(), ids=BAD)


def from_near(integrals):
    """A neighbour, the samples, and the pixels they are in, in the order of `p_hat_from`."""
    here, (near, _) = of(integrals)
    return near, X.x, here


def line_pair(**changes) -> tuple[Pairs, Pixels, Pixels]:
    """A pair of pixels of the partial shift, with an inner shift that answers otherwise."""
    line = Returning(partial_shift(), **changes)
    return Pairs(line, np.array([[0], [1]]), MAGNITUDE), *(Pixels(line, np.full(8, k)) for k in (0, 1))


def paths_of_a_pair(pairs: Pairs):
    return pairs.paired(np.zeros(8, dtype=int), np.linspace(0.05, 0.35, 8), np.zeros(8, dtype=int))


EIGHT = Reservoirs(np.linspace(0.05, 0.35, 8), np.ones(8), np.ones(8))


def outer_shift(**changes):
    """A pair moved onto another one, whose inner shifts are right: only tau answers otherwise."""
    right, wrong = line_pair()[0], line_pair(**changes)[0]
    zeros = np.zeros(8, dtype=int)
    return shifted(paths_of_a_pair(right), Pixels(replace(wrong, proxy=target), zeros), Pixels(right, zeros))


SHIFTS = {
    "of a pass": lambda **changes: spatial(X, *of(Returning(TOY, **changes)), live()),
    "back": lambda **changes: p_hat_from(*from_near(Returning(TOY, **changes))),
    "of all samples": lambda **changes: reuse_all(X, *of(Returning(TOY, **changes))),
    "of a one-sided difference": lambda **changes: one_sided(EIGHT, *line_pair(**changes)[1:]),
    "inside of a pair": lambda **changes: paths_of_a_pair(line_pair(**changes)[0]),
    "of a whole pair": outer_shift,
}
every_shift = pytest.mark.parametrize("act", SHIFTS.values(), ids=SHIFTS)


@every_shift
@every_bad_number
def test_a_bad_jacobian_of_any_shift_is_refused(act, change, said):
    with pytest.raises(ValueError, match=f"the Jacobian J .*{said}"):
        act(J=change)


@every_shift
def test_samples_of_one_column_are_refused_and_not_broadcast(act):
    with pytest.raises(ValueError, match=r"shift have a part of shape \(1,\), but this batch has \d+ columns"):
        act(x=lambda x: x[:1])


@every_shift
def test_the_right_jacobian_of_any_shift_is_accepted(act):
    act()


@every_bad_number
def test_a_bad_density_is_refused(change, said):
    with pytest.raises(ValueError, match=f"the density p .*{said}"):
        pdf(Pixels(Returning(TOY, p=change), HERE.index), X.x)


@every_bad_number
def test_a_bad_target_is_refused(change, said):
    with pytest.raises(ValueError, match=f"the target p_hat .*{said}"):
        target(Pixels(Returning(TOY, p_hat=change), HERE.index), X.x)


REMEDIES = {
    "the Jacobian J": (
        lambda: SHIFTS["back"](J=with_value(np.nan)),
        r"Return \|dT/dx\| from shift\(\), .* 0 where T is",
    ),
    "the density p": (
        lambda: pdf(Pixels(Returning(TOY, p=with_value(np.nan)), HERE.index), X.x),
        r"Return the density of the candidates from pdf\(\)",
    ),
    "the target p_hat": (
        lambda: target(Pixels(Returning(TOY, p_hat=with_value(np.nan)), HERE.index), X.x),
        r"Return \|f\|, or another finite non-negative proxy",
    ),
}


@pytest.mark.parametrize("what", REMEDIES)
def test_what_is_bad_is_named_first_and_its_remedy_last(what):
    act, remedy = REMEDIES[what]
    with pytest.raises(ValueError, match=f"^{what} must be finite and non-negative, but is nan in column 2 .*{remedy}"):
        act()


def test_answers_may_be_lists():
    listed = Returning(TOY, J=lambda J: J.tolist(), p=lambda p: p.tolist(), p_hat=lambda p: p.tolist())
    here, (near, _) = of(listed)
    for found, right in (
        (target(here, X.x), target(HERE, X.x)),
        (pdf(here, X.x), pdf(HERE, X.x)),
        (p_hat_from(near, X.x, here), p_hat_from(NEAR[0], X.x, HERE)),
    ):
        assert np.array_equal(found, right)


def test_densities_from_elsewhere_are_those_of_targets_unless_told():
    default, by_target, by_pdf = (p_hat_from(NEAR[0], X.x, HERE, *proxy) for proxy in ([], [target], [pdf]))
    assert np.array_equal(default, by_target)
    assert not np.allclose(default, by_pdf)


def test_integrals_without_a_number_of_pixels_are_an_image_of_one():
    assert pixels(TOY) == 7
    assert pixels(object()) == 1  # type: ignore[arg-type]


def test_densities_and_jacobians_that_are_zero_or_one_number_for_all_are_no_mistakes():
    here = Pixels(Returning(TOY, p=lambda p: 0 * p, J=lambda J: np.array(0.0)), HERE.index)
    assert (pdf(here, X.x) == 0).all()
    assert shifted(X.x, here, of(Wrapped(TOY))[0]).J == 0
    assert (pdf(HERE, X.x) > 0).all()


def test_samples_of_another_number_of_columns_are_no_input():
    with pytest.raises(ValueError, match=r"the samples of input 0 have a part of shape \(1,\)"):
        gris([Input(replace(X, x=X.x[:1]), HERE)], HERE, TALBOT, live())


# ---------------------------------------------------------------- memory


@dataclass(frozen=True, eq=False)
class Buffered(Wrapped):
    """A mistake: answers of one kind are written into the same array at every call, views of it for fewer columns."""

    what: str
    buffer: Array

    def kept(self, what: str, values: Array) -> Array:
        if what != self.what:
            return values
        self.buffer[: len(values)] = values
        return self.buffer[: len(values)]

    def candidates(self, index, chance):
        for x, mW in self.of.candidates(index, chance):
            yield self.kept("candidates()", x), mW

    def target(self, index, x):
        return self.kept("target()", self.of.target(index, x))

    def pdf(self, index, x):
        return self.kept("pdf()", self.of.pdf(index, x))

    def shift(self, x, index, to):
        y = super().shift(x, index, to)
        return Shifted(self.kept("samples from shift()", y.x), self.kept("Jacobians from shift()", y.J))

    def propose(self, index, x, chance):
        return self.of.propose(index, x, chance)


def buffered(what: str, integrals=TOY) -> Buffered:
    return Buffered(integrals, what, np.empty(4 * N))


def mutated(integrals):
    here = Pixels(integrals, np.arange(64))
    return mutate(Reservoirs(np.full(64, 0.5), np.ones(64), np.ones(64)), here, live())


SHARED = {
    "of a pass": lambda: spatial(X, *of(buffered("target()")), live()),
    "of another weight": lambda: spatial(X, *of(buffered("target()")), live(), mis=TALBOT),
    "of history": lambda: temporal(X, of(buffered("target()"))[0], X, of(buffered("target()"))[1], live()),
    "of all samples": lambda: reuse_all(X, *of(buffered("target()"))),
    "of two sets of candidates": lambda: initial(of(buffered("target()"))[0], live(), M=2),
    "of a mutation": lambda: mutated(buffered("target()", walking(image_of_64()))),
    "of a difference": lambda: gradient_after(X, *pair_of(buffered("target()"))),
    "of a difference of densities": lambda: gradient_after(X, *pair_of(buffered("pdf()")), pdf),
    "of candidates": lambda: initial(of(buffered("candidates()"))[0], live(), M=2),
    "of shifted samples": lambda: spatial(X, *of(buffered("samples from shift()")), live(), mis=TALBOT),
    "of Jacobians": lambda: spatial(X, *of(buffered("Jacobians from shift()")), live(), mis=TALBOT),
}


def pair_of(integrals) -> tuple[Pixels, Pixels]:
    return Pixels(integrals, HERE.index), Pixels(integrals, NEAR[0].index)


@pytest.mark.parametrize("act", SHARED.values(), ids=SHARED)
def test_a_buffer_that_is_used_again_is_refused(act):
    with pytest.raises(ValueError, match=r"are the same memory.*return new arrays each time, or read-only ones"):
        act()


def bias_of_buffer(what: str) -> float:
    """The largest bias per cell of a pass over three pixels with one kind of answer in a buffer, enumerated."""
    scene = three_pixel_scene()
    kind = int if what.startswith("samples") else float

    def loop(index, chance):
        here = Pixels(Buffered(scene.now, what, np.empty(4 * len(index), dtype=kind)), index)
        near = [offset(here.of, index, by) for by in (1, 2)]  # type: ignore[arg-type]
        return spatial(initial(here, chance), here, near, chance, mis=TALBOT)

    return float(abs(bias_of(loop, scene.v, scene.support)).max())


@pytest.mark.parametrize("what", ["target()", "samples from shift()", "Jacobians from shift()"])
def test_without_the_refusal_a_buffer_that_is_used_again_is_biased(what, monkeypatch):
    assert bias_of_buffer("nothing") < 1e-13
    for module in (resampling, doors):
        monkeypatch.setattr(module, "apart", lambda one, other, what: None)
    assert bias_of_buffer(what) > 0.4


@dataclass(frozen=True, eq=False)
class Constant(Wrapped):
    """Integrals whose target is the same read-only ones at every call."""

    ones: Array

    def target(self, index, x):
        return self.ones


def test_a_read_only_array_may_be_returned_again_and_so_may_the_sample_and_the_input_be_used_twice():
    spatial(X, *of(Constant(TOY, np.broadcast_to(1.0, N))), live())
    spatial(X, *of(Returning(TOY, x=lambda y: y)), live())
    gris([Input(X, HERE)] * 3, HERE, TALBOT, live())
    resample([(X.x, X.W), (X.x.copy(), X.W)], HERE, live())


@dataclass(frozen=True, eq=False)
class Writing(Wrapped):
    """A mistake: one of the methods sorts out its sample in place."""

    method: str

    def spoiled(self, method: str, x: Array) -> Array:
        if method == self.method:
            x *= 0.5
        return x

    def target(self, index, x):
        return self.of.target(index, self.spoiled("target", x))

    def contribution(self, index, x):
        return self.of.contribution(index, self.spoiled("contribution", x))

    def pdf(self, index, x):
        return self.of.pdf(index, self.spoiled("pdf", x))

    def shift(self, x, index, to):
        return super().shift(self.spoiled("shift", x), index, to)

    def propose(self, index, x, chance):
        return self.of.propose(index, self.spoiled("propose", x), chance)


WRITERS = {
    "target of a candidate": ("target", lambda here, near: initial(here, live())),
    "target of a pass": ("target", lambda here, near: spatial(X, here, near, live())),
    "shift of a pass": ("shift", lambda here, near: spatial(X, here, near, live())),
    "pdf": ("pdf", lambda here, near: pdf(here, X.x)),
    "shading": ("contribution", lambda here, near: shade(X, here)),
    "shading of all": ("contribution", lambda here, near: reuse_all(X, here, near)),
    "difference": ("contribution", lambda here, near: one_sided(X, here, near[0])),
    "shift of a difference": ("shift", lambda here, near: one_sided(X, here, near[0])),
    "proposal": ("propose", lambda here, near: mutate(X, here, Always(0))),
}


@pytest.mark.parametrize(("method", "act"), WRITERS.values(), ids=WRITERS)
def test_a_method_that_writes_into_its_sample_is_stopped_and_the_sample_is_as_it_was(method, act):
    before = X.x.copy()
    with pytest.raises(ValueError, match="read-only"):
        act(*of(Writing(walking(TOY), method)))
    assert np.array_equal(X.x, before)


# ---------------------------------------------------------------- f where W = 0


@dataclass(frozen=True, eq=False)
class Undefined(Wrapped):
    """Integrals whose contribution is NaN where the target is 0: f / p_hat, say, times p_hat."""

    def contribution(self, index, x):
        f = self.of.contribution(index, x)
        return np.where(self.of.target(index, x) > 0, f, np.nan)


def with_nulls() -> Reservoirs:
    """Samples of which every third lies outside of its domain, with W = 0."""
    out = HERE.index % 3 == 0
    return replace(X, x=np.where(out, 2.0, X.x), W=np.where(out, 0, X.W))


ESTIMATES = {
    "shading": lambda Z, here, near: shade(Z, here),
    "all shifted": reuse_all,
    "a difference": lambda Z, here, near: one_sided(Z, here, near[0]),
    "differences of all": lambda Z, here, near: gradient_after(Z, here, near[0]),
}


@pytest.mark.parametrize("estimate", ESTIMATES.values(), ids=ESTIMATES)
def test_a_contribution_that_is_undefined_where_the_target_is_zero_changes_no_estimate(estimate):
    Z = with_nulls()
    assert np.array_equal(estimate(Z, *of(Undefined(TOY))), estimate(Z, *of(Wrapped(TOY))))


def test_an_undefined_contribution_times_zero_is_noticed():
    Z, here = with_nulls(), of(Undefined(TOY))[0]
    assert np.isnan(here.of.contribution(here.index, Z.x) * Z.W).sum() == (Z.W == 0).sum() > 0


def test_times_is_the_product_to_the_sign_of_zero_wherever_f_is_a_number():
    f, W = np.array([-2.0, -2, 0, 3, np.nan, np.inf, -np.inf]), np.array([0.0, 1, 5, 0.5, 0, 0, 0])
    assert times(f, W).tobytes() == np.array([-0.0, -2, 0, 1.5, 0, 0, 0]).tobytes()
    exact = times(np.array([Fraction(1, 3)] * 2, dtype=object), np.array([Fraction(0), Fraction(3)], dtype=object))
    assert exact.tolist() == [0, 1]
    assert np.isnan(times(np.array([np.nan, 1.0]), np.array([1.0, np.nan]))).all()


def test_an_undefined_contribution_that_counts_is_not_hidden():
    Z, here = with_nulls(), of(Undefined(TOY))[0]
    assert np.isnan(weighted(here, Z.x, np.ones(N))).any()


def test_the_energy_of_a_proposal_without_a_target_is_that_of_darkness():
    Z, here = with_nulls(), of(Undefined(TOY))[0]
    p_hat = target(here, X.x)
    move = Move(here, X, Z.x, p_hat, target(here, Z.x), np.ones(N))
    noise = Blue(np.ones(N), [NEAR[0].index], [1.0], 1.0)
    dark = Blue(np.ones(N), [NEAR[0].index], [1.0], 1.0).energies(replace(move, here=of(Wrapped(TOY))[0]))
    assert np.array_equal(noise.energies(move), dark)


def test_a_gap_to_an_offset_that_is_undefined_is_the_base_alone():
    here, (near, _) = of(Undefined(TOY))
    y = Shifted(np.full(N, 2.0), np.zeros(N))
    assert np.array_equal(gap(X.x, here, y, near), TOY.contribution(here.index, X.x))
    assert np.array_equal(omega(X.x, here, y, near), np.where(target(here, X.x) > 0, 1, 0))


def test_nowhere_is_no_column():
    assert NOWHERE == -1
    assert not same_bits(X, replace(X, W=2 * X.W))

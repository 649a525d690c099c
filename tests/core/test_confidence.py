"""Laws of merged confidences: they add up, saturate, are capped on entry, and never depend on sample values."""

from dataclasses import replace

import numpy as np
import pytest

from restir_ref import resampling
from restir_ref.integrals import Pixels, Reservoirs, target
from restir_ref.mis import WEIGHTS
from restir_ref.oracle.cells import Frame, cells
from restir_ref.oracle.laws import expected_weight
from restir_ref.oracle.scenes import keep, offset
from restir_ref.resampling import LARGEST_CONFIDENCE
from restir_ref.restir import capped, initial, spatial, temporal
from tests.core.stubs import Always, live
from toy1d import image_of_64, overlapping_supports, two_pixels

every_weight = pytest.mark.parametrize("mis", WEIGHTS.values(), ids=WEIGHTS)
every_cap = pytest.mark.parametrize("cap", [0.5, 1, 5, 20, np.inf])


# ---------------------------------------------------------------- they add up


@pytest.mark.kernel
@every_weight
@every_cap
def test_confidences_add_up_after_the_cap_on_each_history(mis, cap):
    toy, index = overlapping_supports(), np.arange(70)
    here = Pixels(toy, index)
    X, Y = (Reservoirs(initial(here, live()).x, np.ones(70), np.arange(1.0, 71) / k) for k in (1, 7))
    sources = [offset(toy, index, by) for by in (0, 2)]
    merged = temporal(X, here, Y, sources, live(), mis=mis, cap=cap)
    histories = [np.minimum(Y.c[source.index], cap) for source in sources]
    assert (merged.c == X.c + histories[0] + histories[1]).all()
    assert (spatial(X, here, sources, live(), mis=mis).c == X.c + X.c + X.c[sources[1].index]).all()


def confidence_after_two_frames(seed, edit):
    """Of a chain on pixels whose domains overlap in part; `edit` runs after each pass."""
    toy, index = overlapping_supports(), np.arange(70)
    before, here, chance = Pixels(toy, index), Pixels(toy, index), live(seed)
    Y, X = edit(initial(before, chance), before), edit(initial(here, chance), here)
    X = edit(temporal(X, here, Y, [offset(toy, index, 1)], chance), here)
    return edit(spatial(X, here, [offset(toy, index, -1)], chance, mis=WEIGHTS["talbot"]), here).c


def null_confidence_zero(X, here):
    """A mistake: null samples do not count."""
    return replace(X, c=np.where(X.W > 0, X.c, 0))


def unlucky(X, here):
    """The same, where whatever lands in the left half is null."""
    return null_confidence_zero(replace(X, W=np.where(X.x < 0.5, 0, X.W)), here)


@pytest.mark.kernel
def test_confidence_does_not_depend_on_sample_values():
    assert (confidence_after_two_frames(1, keep) == confidence_after_two_frames(2, keep)).all()


def test_a_confidence_that_depends_on_sample_values_is_noticed():
    assert (confidence_after_two_frames(1, unlucky) != confidence_after_two_frames(2, unlucky)).any()


# ---------------------------------------------------------------- they stay finite


def uncapped(frames, c=1.0) -> Reservoirs:
    """The two-pixel loop without a cap, from a history of confidence c; confidence doubles every frame."""
    toy, index = two_pixels(), np.arange(2)
    here, before, chance = Pixels(toy, index), Pixels(toy, index), live()
    other, talbot = offset(toy, index, 1), WEIGHTS["talbot"]
    Y = initial(here, chance)
    Y = replace(Y, c=np.full(2, c))
    for _ in range(frames):
        Y = temporal(initial(here, chance), here, Y, [before], chance, mis=talbot, cap=np.inf)
        Y = spatial(Y, here, [other], chance, mis=talbot)
    return Y


@pytest.mark.claims("GRIS-A04")
def test_three_thousand_uncapped_frames_stay_finite():
    Y = uncapped(3000)
    assert (Y.c == LARGEST_CONFIDENCE).all()
    assert ((Y.W > 0) & (Y.W < 10)).all()


def test_without_saturation_uncapped_frames_overflow(monkeypatch):
    monkeypatch.setattr(resampling, "LARGEST_CONFIDENCE", np.inf)
    assert (uncapped(20).c == 2.0**21 + 2.0**20 - 2).all()
    with pytest.raises(RuntimeWarning, match="overflow"):
        uncapped(20, c=2.0**1010)


@pytest.mark.kernel
def test_saturated_confidences_stay_where_they_are():
    assert (uncapped(3, c=LARGEST_CONFIDENCE).c == LARGEST_CONFIDENCE).all()


# ---------------------------------------------------------------- the cap


def share_of_history(mis, cap, toy):
    """Relative weight of an old sample of confidence 1000 beside a new one: same target, identity shift."""
    index = np.arange(50)
    here, chance = Pixels(toy, index), Always()
    X, Y = (
        Reservoirs(x, 1 / target(here, x), np.full(50, c))
        for x, c in zip(np.random.default_rng(4).random((2, 50)), (1.0, 1000.0), strict=True)
    )
    temporal(X, here, Y, [Pixels(toy, index)], chance, mis=mis, cap=cap)
    (w,) = chance.asked
    return w[1] / w.sum(axis=0)


@pytest.mark.kernel
@pytest.mark.claims("GRIS-A04")
@every_weight
@pytest.mark.parametrize("cap", [0.5, 1, 5, 20, 999])
@pytest.mark.parametrize("toy", [two_pixels(), image_of_64()], ids=["T2", "T64"])
def test_a_capped_history_weighs_at_most_M_c_over_M_c_plus_one(mis, cap, toy):
    share = share_of_history(mis, cap, toy)
    assert (share <= cap / (cap + 1) * (1 + 1e-12)).all()
    if mis is not WEIGHTS["defensive"]:
        assert share == pytest.approx(cap / (cap + 1), rel=1e-12)


@pytest.mark.kernel
@every_weight
def test_an_uncapped_history_weighs_more(mis):
    assert (share_of_history(mis, np.inf, two_pixels()) > 20 / 21).all()


@pytest.mark.kernel
@every_cap
def test_the_cap_lowers_confidences_and_nothing_else(cap):
    X = Reservoirs(np.arange(4.0), np.ones(4), np.array([0.25, 1, 7, 1e9]))
    Y = capped(X, cap)
    assert Y.x is X.x
    assert Y.W is X.W
    assert (Y.c == [min(c, cap) for c in X.c]).all()


# ---------------------------------------------------------------- nulls count


def mean_of_a_rarely_lit_pixel(edit, cap, merges=6) -> float:
    """E[f W] after temporal merges, enumerated: f = 1 on [0, .2] of [0, 1], uniform samples."""
    v = np.array([[0.2, 0.8]])
    pixel = Frame(cells(v, np.array([[1.0, 0.0]]), np.ones((1, 1, 2)), np.array([[[0, 1]]])), 1)

    def loop(index, chance):
        here, before = Pixels(pixel, index), Pixels(pixel, index)
        Y = edit(initial(here, chance), here)
        for _ in range(merges):
            X = edit(initial(here, chance), here)
            Y = edit(temporal(X, here, Y, [before], chance, cap=cap), here)
        return Y

    return float(expected_weight(loop, v)[0, 0])


@pytest.mark.claims("GRIS-A18")
@every_cap
def test_null_samples_that_count_leave_the_mean_exactly_right(cap):
    assert mean_of_a_rarely_lit_pixel(keep, cap) == pytest.approx(0.2, rel=1e-13)


@pytest.mark.claims("GRIS-A18")
@pytest.mark.parametrize("merges", [1, 5, 6])
def test_counting_only_samples_that_found_light_gives_the_chance_of_ever_finding_it(merges):
    mean = mean_of_a_rarely_lit_pixel(null_confidence_zero, np.inf, merges)
    assert mean == pytest.approx(1 - 0.8 ** (merges + 1), rel=1e-13)

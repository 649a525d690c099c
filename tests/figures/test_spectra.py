"""Laws of what GPT-P03 expects of noise that is not white: all but the cross terms of image and differences."""

from dataclasses import replace

import numpy as np
import pytest

from figures.claims import criteria
from figures.claims.figure import Claim, verdict_of
from figures.experiments.replicas import compared, inside
from figures.experiments.spectra import CLOSE, expected, explained, in_bands
from figures.gradient import gpt_c04, gpt_f12
from restir_ref.poisson import ALPHA, cosine_power, l2, output_spectrum, symbol, transposed

N, R = 64, 4000


def white(n: int, size: float, seed: int) -> np.ndarray:
    return size * np.random.default_rng(seed).standard_normal((R, n))


def red(errors: np.ndarray) -> np.ndarray:
    """Means of nine neighbours."""
    return np.apply_along_axis(np.convolve, -1, errors, np.ones(9) / 9, mode="same")


def rebuilt(image: np.ndarray, dx: np.ndarray) -> np.ndarray:
    """Power of the errors of L2, (R, n)."""
    flat = np.linspace(0, 10, N)
    return cosine_power(l2(flat + image, np.diff(flat) + dx) - flat, 1)


def crossed(image: np.ndarray, dx: np.ndarray) -> np.ndarray:
    """2 alpha^2 C H / (alpha^2 + D)^2."""
    (C, H), D = (_cosines(each) for each in (image, transposed([dx], image.shape))), symbol((N,))
    return 2 * ALPHA**2 * C * H / (ALPHA**2 + D) ** 2


def _cosines(errors: np.ndarray) -> np.ndarray:
    """Orthonormal cosine transform, by its definition."""
    k, x = np.arange(N)[:, None], np.arange(N)
    basis = np.sqrt((2 - (k == 0)) / N) * np.cos(np.pi * k * (x + 0.5) / N)
    return errors @ basis.T


CASES = {
    "white": (white(N, 1.0, 1), white(N - 1, 0.5, 2)),
    "red image": (red(white(N, 3.0, 3)), white(N - 1, 0.5, 4)),
    "shared": (white(N, 1.0, 5), np.diff(white(N, 1.0, 5)) + white(N - 1, 0.3, 6)),
}


@pytest.mark.parametrize("name", CASES)
def test_with_its_cross_terms_it_is_the_power_of_what_l2_makes_exactly(name):
    image, dx = CASES[name]
    assert np.allclose(expected(image, dx) + crossed(image, dx), rebuilt(image, dx), rtol=0, atol=1e-9)


@pytest.mark.claims("GPT-P03")
def test_of_white_noise_it_is_the_formula_for_white_noise():
    found = expected(*CASES["white"]).mean(axis=0)
    assert found == pytest.approx(output_spectrum((N,), 1.0, 0.25), rel=0.12)


def verdict(name: str, formula=expected) -> list[str]:
    image, dx = CASES[name]
    pairs = zip(in_bands(rebuilt(image, dx)), in_bands(formula(image, dx)), strict=True)
    return [verdict_of(compared("GPT-P06", pair, inside(*CLOSE), "part")) for pair in pairs]


@pytest.mark.parametrize("name", ["white", "red image"])
def test_independent_noise_of_any_colour_is_as_expected_in_both_bands(name):
    assert verdict(name) == ["reproduced", "reproduced"]


def test_noise_that_image_and_differences_share_is_not():
    assert "not reproduced" in verdict("shared")


def for_white(image: np.ndarray, dx: np.ndarray) -> np.ndarray:
    """The formula with one number for each: what red noise must miss."""
    return np.broadcast_to(output_spectrum((N,), (image**2).mean(), (dx**2).mean()), image.shape)


def test_red_noise_misses_the_formula_for_white_noise():
    assert verdict("white", for_white) == ["reproduced", "reproduced"]
    assert "not reproduced" in verdict("red image", for_white)


def test_bands_part_all_frequencies_at_alpha():
    S = np.where(np.sqrt(symbol((N,))) < ALPHA, 2.0, 3.0)[None]
    assert [each.tolist() for each in in_bands(S)] == [[2.0], [3.0]]


@pytest.mark.parametrize("measured", [0.0, 2.0])
def test_cross_terms_are_told_and_the_formula_judges_nothing_either_way(measured):
    claim, pair = Claim("GPT-P06", criteria.below(measured, 1), "part"), (np.full(8, 1.5), np.ones(8))
    told = explained(claim, pair)
    assert "are +50% of what it expects" in told.reason
    assert f"Measured {measured}, asked < 1" in told.reason
    assert verdict_of(told) == "not judged"
    assert verdict_of(explained(replace(claim, outcome=criteria.reported(1.0)), pair)) == "reported"


# ---------------------------------------------------------------- which rule decides


def row(s_g: float) -> dict[str, np.ndarray]:
    """The occluder row of GPT-F12 by noise of this s_g / s_c around 10."""
    image, dx = CASES["white"]
    at = f"{gpt_f12.ROW_VIEW}.with"
    return {f"{at}.primal": 10 + image, f"{at}.dx": 2 * np.sqrt(s_g) * dx, "reference": np.full(N, 10.0)}


@pytest.mark.parametrize(("s_g", "by"), [(0.1, "before"), (0.3, "by GPT-P03")])
def test_little_noise_of_differences_is_judged_by_the_sentence_more_is_held_against_the_formula(s_g, by):
    first, *rest = gpt_f12.repaired(row(s_g))
    assert first.outcome.measured.startswith(f"{s_g:.1g}")
    deciding = {claim.part for claim in rest if verdict_of(claim) != "reported"}
    assert deciding == {f"power after / {by}, {band} alpha" for band in ("below", "above")}
    assert len(rest) == 4


@pytest.mark.parametrize(("s_g", "part"), [(0.05, "order"), (0.2, "GPT-P03")])
def test_clean_gradients_are_judged_by_the_order_of_octaves_others_are_held_against_the_formula(s_g, part):
    a = row(s_g)
    found = {"primal": a["occluders row.with.primal"], "dx": a["occluders row.with.dx"], "reference": a["reference"]}
    claims = gpt_c04.by_octave(found)
    (deciding,) = [claim for claim in claims if verdict_of(claim) != "reported"]
    assert part in deciding.part
    assert len(claims) == 2


def test_the_octave_farthest_off_is_found_in_either_direction():
    even, less, more = (np.ones(8), np.ones(8)), (np.full(8, 0.5), np.ones(8)), (np.full(8, 1.9), np.ones(8))
    assert gpt_c04.farthest([even, less, more])[0] == 2
    assert gpt_c04.farthest([more, even, more])[0] == 1

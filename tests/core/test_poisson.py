"""Laws of L2 reconstruction: what it recovers, two solvers and a dense one, its spectrum, what it refuses."""

from itertools import product

import numpy as np
import pytest
from scipy.fft import fftn, ifftn

from restir_ref.batch import Array, total
from restir_ref.integrals import Pixels
from restir_ref.oracle.laws import expected_sum
from restir_ref.oracle.scenes import three_pixel_scene
from restir_ref.poisson import (
    by_elimination,
    by_transform,
    cosine_power,
    differences,
    forward,
    gradient_matrix,
    l2,
    output_spectrum,
    right_side,
    symbol,
    transposed,
)
from restir_ref.poisson_l1 import l1
from restir_ref.restir import initial, shade
from tests.oracle.pairs import ENDS, both_signs, true_means

SHAPES = {"row": (9,), "image": (5, 7), "one row": (1, 8), "one column": (6, 1)}
every_shape = pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES)
every_alpha = pytest.mark.parametrize("alpha", [0.02, 0.2, 5.0])
SOLVERS = {"transform": by_transform, "elimination": by_elimination}


def rng(seed: int = 1) -> np.random.Generator:
    return np.random.default_rng(seed)


def picture(*shape: int, seed: int = 1) -> Array:
    """Steps and noise."""
    return np.asarray(rng(seed).random(shape) + (np.arange(shape[-1]) > shape[-1] // 2))


def noisy(shape: tuple[int, ...], s_c: float = 0.1, s_g: float = 0.01, leading: tuple[int, ...] = (3,), seed: int = 2):
    """A picture with leading axes, a noisy primal image and noisy gradients of it."""
    dice, I = rng(seed), picture(*leading, *shape)
    primal = I + np.sqrt(s_c) * dice.standard_normal(I.shape)
    return I, primal, [g + np.sqrt(s_g) * dice.standard_normal(g.shape) for g in differences(I, len(shape))]


# ---------------------------------------------------------------- what comes back


@pytest.mark.claims("GPT-A11", part="exact gradients and primal are recovered")
@pytest.mark.parametrize("solver", SOLVERS.values(), ids=SOLVERS)
@every_alpha
@every_shape
def test_exact_gradients_and_primal_come_back(shape, alpha, solver):
    I = picture(3, *shape)
    found = l2(I, *differences(I, len(shape)), alpha=alpha, solver=solver)
    assert found == pytest.approx(I, abs=1e-8)


@every_shape
def test_one_wrong_difference_is_noticed(shape):
    I = picture(*shape)
    G = differences(I, len(shape))
    next(g for g in G if g.size).flat[0] += 0.1
    assert abs(l2(I, *G) - I).max() > 1e-3


@every_shape
def test_from_exact_gradients_and_any_primal_the_image_comes_back_but_for_its_mean(shape):
    I, wrong = picture(*shape), rng(5).random(shape)
    found = l2(wrong, *differences(I, len(shape)), alpha=1e-4)
    assert found - found.mean() == pytest.approx(I - I.mean(), abs=1e-6)  # alpha^2 / D of the lowest frequency
    assert found.mean() == pytest.approx(wrong.mean(), abs=1e-6)


def test_a_heavy_primal_is_noticed_to_matter():
    I, wrong = picture(5, 7), rng(5).random((5, 7))
    found = l2(wrong, *differences(I), alpha=1.0)
    assert abs(found - found.mean() - I + I.mean()).max() > 0.01


def test_differences_of_pairs_are_turned_round():
    I = picture(5, 7)
    deltas = [I[:, :-1] - I[:, 1:], I[:-1] - I[1:]]
    assert l2(I, *forward(*deltas)) == pytest.approx(I, abs=1e-12)


def expected_deltas() -> tuple[Array, Array]:
    """The three pixels of a finite scene, and E of what pairs (0, 1) and (1, 2) estimate, by enumeration."""
    scene = three_pixel_scene()

    def program(index, chance) -> Array:
        parts = both_signs(scene.now, ENDS)
        return total([shade(initial(Pixels(part, index), chance), Pixels(part, index)) for part in parts])

    return true_means(scene), expected_sum(program, 2)[0]


def test_what_pairs_estimate_turned_round_gives_the_row_in_expectation():
    I, deltas = expected_deltas()
    assert l2(I, *forward(deltas)) == pytest.approx(I, rel=1e-12)


def test_what_pairs_estimate_as_it_is_is_noticed():
    I, deltas = expected_deltas()
    assert abs(l2(I, deltas) / I - 1).max() > 0.1


@every_shape
def test_gradients_of_the_other_sign_make_it_worse_than_the_primal(shape):
    I, primal, G = noisy(shape, s_c=0.01, s_g=0.001)
    turned = by_transform(shape)(right_side(primal, *forward(*G)))
    errors = [((each - I) ** 2).mean() for each in (l2(primal, *G), primal, turned)]
    assert errors == sorted(errors)
    assert errors[2] > 2 * errors[1]


# ---------------------------------------------------------------- one solver checks the other


@every_alpha
@every_shape
def test_transform_and_elimination_agree(shape, alpha):
    _, primal, G = noisy(shape)
    found = [l2(primal, *G, alpha=alpha, solver=solver) for solver in SOLVERS.values()]
    assert found[0] == pytest.approx(found[1], abs=1e-10)


def test_an_image_that_is_taken_for_a_torus_is_noticed():
    _, primal, G = noisy((5, 7))
    b, along = right_side(primal, *G), [2 - 2 * np.cos(2 * np.pi * np.arange(n) / n) for n in (5, 7)]
    torus = ifftn(fftn(b, axes=(-2, -1)) / (0.04 + along[0][:, None] + along[1]), axes=(-2, -1)).real
    assert abs(torus - l2(primal, *G)).max() > 0.01


def dense(shape: tuple[int, ...]) -> Array:
    """grad as a matrix, from the differences of images with one bright pixel."""
    bright = np.eye(int(np.prod(shape))).reshape(-1, *shape)
    return np.concatenate([g.reshape(len(bright), -1) for g in differences(bright, len(shape))], axis=1).T


@every_shape
def test_the_transpose_and_the_sparse_matrix_are_those_of_the_differences(shape):
    A, (_, _, G) = dense(shape), noisy(shape)
    flat = np.concatenate([g.reshape(3, -1) for g in G], axis=1)
    assert gradient_matrix(shape).toarray() == pytest.approx(A, abs=0)
    assert transposed(G, (3, *shape)).reshape(3, -1) == pytest.approx(flat @ A, abs=1e-14)


@pytest.mark.claims("GPT-A11", part="residual of the normal equations")
@every_alpha
@every_shape
def test_the_normal_equations_hold(shape, alpha):
    assert abs(residual(shape, alpha, alpha)) < 1e-12


def residual(shape: tuple[int, ...], alpha: float, used: float) -> float:
    """Largest |alpha^2 (I - I_prim) + A^T (A I - G)| of what is reconstructed with another alpha."""
    A, (_, primal, G) = dense(shape), noisy(shape)
    g = np.concatenate([each.reshape(3, -1) for each in G], axis=1)
    u, p = l2(primal, *G, alpha=used).reshape(3, -1), primal.reshape(3, -1)
    return float(abs(alpha**2 * (u - p) + (u @ A.T - g) @ A).max())


def test_alpha_in_the_place_of_its_square_is_noticed():
    assert residual((5, 7), np.sqrt(0.2), 0.2) > 1e-3


@every_shape
def test_every_image_of_a_stack_is_reconstructed_by_itself(shape):
    _, primal, G = noisy(shape, leading=(2, 3))
    stack = l2(primal, *G)
    for at in product(range(2), range(3)):
        assert stack[at] == pytest.approx(l2(primal[at], *(g[at] for g in G)), abs=1e-14)


def test_inputs_stay_as_they_are_and_whole_numbers_will_do():
    primal, dx = np.array([1, 2, 4]), np.array([1, 2])
    assert l2(primal, dx) == pytest.approx([1, 2, 4], abs=1e-12)
    assert primal.tolist() == [1, 2, 4]
    assert dx.tolist() == [1, 2]


def test_short_numbers_are_reckoned_with_in_64_bits():
    _, primal, G = noisy((5, 7))
    short = [each.astype(np.float32) for each in (primal, *G)]
    assert np.array_equal(l2(*short), l2(*(each.astype(float) for each in short)))
    assert l2(np.array([3, 1], dtype=np.uint8), np.array([-2], dtype=np.int8)) == pytest.approx([3, 1], abs=1e-12)


# ---------------------------------------------------------------- linear, so unbiased


def mean_over_outcomes(reconstruct) -> tuple[Array, Array]:
    """E of what is reconstructed from three pixels and two differences with two values each, and the means' own."""
    low, high = np.array([0.0, 1.0, 0.5, 0.1, -0.9]), np.array([3.0, 1.5, 2.5, 1.1, 0.3])
    chance = np.array([0.25, 0.5, 0.125, 0.75, 0.5])
    picks = np.array([*product([0, 1], repeat=5)])
    values = np.where(picks, high, low)
    P = np.where(picks, chance, 1 - chance).prod(axis=1)
    mean = P @ values
    found = np.stack([reconstruct(each[:3], each[3:]) for each in values])
    return P @ found, reconstruct(mean[:3], mean[3:])


@pytest.mark.claims("GPT-A11", part="L2 unbiased, by enumeration")
@pytest.mark.claims("GPT-C03", part="L2 unbiased, L1 biased, by enumeration")
def test_l2_of_unbiased_inputs_is_unbiased():
    mean, truth = mean_over_outcomes(l2)
    assert mean == pytest.approx(truth, abs=1e-13)


def test_the_bias_of_l1_is_noticed():
    mean, truth = mean_over_outcomes(l1)
    assert abs(mean - truth).max() > 0.01


# ---------------------------------------------------------------- the spectrum of what is left


def exact_spectrum(shape: tuple[int, ...], s_c: float, s_g: float) -> Array:
    """E |cosine transform of the error|^2 of independent white noise, noise of one value after the other."""
    n, d = int(np.prod(shape)), len(shape)
    bright, nothing = np.eye(n).reshape(-1, *shape), np.zeros((n, *shape))
    power = s_c * cosine_power(l2(bright, *differences(nothing, d)), d).sum(axis=0)
    for k, g in enumerate(differences(nothing[0], d)):
        one = [np.zeros((g.size, *each.shape)) for each in differences(nothing[0], d)]
        one[k] = np.eye(g.size).reshape(g.size, *g.shape)
        power += s_g * cosine_power(l2(np.zeros((g.size, *shape)), *one), d).sum(axis=0)
    return np.asarray(power)


@pytest.mark.claims("GPT-P03", part="exact at every frequency")
@every_shape
def test_the_spectrum_of_the_error_is_the_predicted_one_at_every_frequency(shape):
    assert exact_spectrum(shape, 2.0, 0.3) == pytest.approx(output_spectrum(shape, 2.0, 0.3), rel=1e-10)


def test_a_spectrum_of_the_wrong_noise_or_symbol_is_noticed():
    exact, D = exact_spectrum((5, 7), 2.0, 0.3), symbol((5, 7))
    assert abs(exact / output_spectrum((5, 7), 0.3, 2.0) - 1).max() > 0.5
    assert abs(exact / ((0.04 * 2 + D * 0.3) / (0.04 + D) ** 2) - 1).max() > 0.5


BANDS = {"row": ((128,), 2000), "image": ((32, 32), 300)}


def band_ratios(shape: tuple[int, ...], replicas: int, s_g: float) -> Array:
    """Measured power over predicted, for six bands of frequencies, the lowest ones by themselves."""
    dice, d = rng(7), len(shape)
    nothing = np.zeros((replicas, *shape))
    G = [np.sqrt(0.1) * dice.standard_normal(g.shape) for g in differences(nothing, d)]
    measured = cosine_power(l2(dice.standard_normal(nothing.shape), *G), d).mean(axis=0)
    D = symbol(shape)
    band = np.digitize(np.sqrt(D), np.array([0.1, 0.2, 0.4, 0.8, 1.6]))
    S = output_spectrum(shape, 1.0, s_g)
    return np.array([measured[band == k].mean() / S[band == k].mean() for k in range(6)])


@pytest.mark.claims("GPT-P03")
@pytest.mark.parametrize("size", BANDS.values(), ids=BANDS)
def test_measured_power_is_the_predicted_one_in_every_band(size):
    assert abs(band_ratios(*size, s_g=0.1) - 1).max() < 0.1


@pytest.mark.parametrize("size", BANDS.values(), ids=BANDS)
def test_a_fifth_more_noise_of_the_gradients_is_noticed(size):
    assert abs(band_ratios(*size, s_g=0.12) - 1).max() > 0.1


def test_the_spectrum_of_white_noise_is_flat_and_its_mean_is_that_of_the_squares():
    e = rng().standard_normal((4, 6, 5))
    assert cosine_power(e).mean(axis=(-2, -1)) == pytest.approx((e**2).mean(axis=(-2, -1)), rel=1e-12)
    assert cosine_power(np.eye(30).reshape(-1, 6, 5)).sum(axis=0) == pytest.approx(1, rel=1e-12)
    assert cosine_power(np.ones((6, 5))) == pytest.approx(30 * (np.arange(30) == 0).reshape(6, 5), abs=1e-12)


# ---------------------------------------------------------------- what is refused

SOUND = picture(2, 5, 7)
DX, DY = differences(SOUND)
LARGE = picture(30, 30)


def spoiled(values: Array, value: float, *at: int) -> Array:
    changed = values.copy()
    changed[at] = value
    return changed


REFUSED = {
    "no gradients": ((SOUND,), {}, "came with 0 gradients"),
    "too many": ((SOUND, DX, DY, DX), {}, "came with 3 gradients"),
    "a row with two": ((SOUND[0, 0], DX[0, 0], DY[0, 0]), {}, "came with 2 gradients"),
    "dx as wide as the image": ((SOUND, SOUND, DY), {}, r"dx must have shape \(2, 5, 6\).* but has \(2, 5, 7\)"),
    "dy and dx exchanged": ((SOUND, DY, DX), {}, r"dx must have shape \(2, 5, 6\).* but has \(2, 4, 7\)"),
    "dy of other channels": ((SOUND, DX, DY[:1]), {}, r"dy must have shape \(2, 4, 7\).* but has \(1, 4, 7\)"),
    "one pixel": ((SOUND[..., :1, :1], DX[..., :1, :0], DY[..., :0, :1]), {}, "an image of 1 pixel"),
    "a row of one pixel": ((SOUND[0, 0, :1], DX[0, 0, :0]), {}, "an image of 1 pixel"),
    "no pixel": ((SOUND[..., :0], DX[..., :0]), {}, "an image of 0 pixel"),
    "alpha 0": ((SOUND, DX, DY), {"alpha": 0.0}, "alpha.*must be one positive number, but is 0.0"),
    "alpha negative": ((SOUND, DX, DY), {"alpha": -0.2}, "must be one positive number, but is -0.2"),
    "alpha NaN": ((SOUND, DX, DY), {"alpha": np.nan}, "must be one positive number, but is nan"),
    "alpha infinite": ((SOUND, DX, DY), {"alpha": np.inf}, "alpha is inf"),
    "NaN pixel": (
        (spoiled(SOUND, np.nan, 1, 2, 3), DX, DY),
        {},
        r"primal image is nan in row 2, column 3 of image \[1\] \(1 of 70",
    ),
    "NaN in a row": (
        (spoiled(SOUND, np.nan, 0, 0, 4)[0, 0], DX[0, 0]),
        {},
        r"primal image is nan in column 4 \(1 of 7",
    ),
    "NaN in dy": ((SOUND, DX, spoiled(DY, np.nan, 0, 3, 1)), {}, r"dy is nan in row 3, column 1 of image \[0\]"),
    "infinite pixel": ((spoiled(SOUND, np.inf, 0, 0, 0), DX, DY), {}, "primal image is inf in row 0, column 0"),
    "dx of the other sign": (
        (LARGE, *forward(*differences(LARGE))),
        {},
        "dx points against.*stand",
    ),
    "dy of the other sign": (
        (LARGE, np.diff(LARGE, axis=1), -np.diff(LARGE, axis=0)),
        {},
        "dy points against.*Hand in its negative",
    ),
}


@pytest.mark.parametrize("reconstruct", [l2, l1])
@pytest.mark.parametrize("why", REFUSED)
def test_bad_input_is_refused_by_name(why, reconstruct):
    inputs, options, words = REFUSED[why]
    with pytest.raises(ValueError, match=words):
        reconstruct(*inputs, **options)


def test_the_sign_of_right_gradients_is_never_doubted_however_noisy():
    flat = np.ones((20, 30))
    for seed in range(100):
        dice = rng(seed)
        l2(dice.standard_normal(flat.shape), *(dice.standard_normal(g.shape) for g in differences(flat)))
    l2(flat, *differences(flat))
    l2(picture(20, 30), *differences(flat))


@pytest.mark.parametrize("unit", [1e-3, 1.0, 1e3])
def test_the_other_sign_is_refused_from_six_standard_errors_on(unit):
    def turned(differences_: int) -> Array:
        zigzag = unit * (np.arange(differences_ + 1) % 2)
        return l2(zigzag, -np.diff(zigzag))

    assert np.isfinite(turned(36)).all()
    with pytest.raises(ValueError, match=r"by 6\.1 standard errors"):
        turned(37)


def test_of_several_bad_numbers_the_first_is_named():
    with pytest.raises(ValueError, match=r"primal image is inf in column 2 \(2 of 5 values are not finite\)"):
        l2(np.array([0, 1, np.inf, 2, np.nan]), np.zeros(4))


def test_one_outlier_against_the_image_is_no_other_sign():
    I = picture(20, 30)
    dx, dy = differences(I)
    dx[3, 4] = -1000 * dx[3, 4]
    assert np.isfinite(l2(I, dx, dy)).all()

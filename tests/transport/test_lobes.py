"""Laws of every lobe in every dimension: sample, density, weight and inversion agree, and energy is kept."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chisquare

from restir_ref.batch import Array
from restir_ref.transport.lobes import LOBES, Lobe, evaluate
from restir_ref.transport.space import Space, sphere_area
from restir_ref.transport.vectors import norm
from tests.transport.lobe_cases import (
    CASES,
    CONTINUOUS,
    DELTA,
    SURFACES,
    Plain,
    grid,
    integral,
    plain,
    samples,
    spread,
    stretch,
    tilted,
    views,
)
from tests.transport.spaces import SEEING, SPACES

every_case = pytest.mark.parametrize(("space", "name"), CASES)
every_delta = pytest.mark.parametrize("name", DELTA)


# ---------------------------------------------------------------- inversion


def inversion_error(lobe: Lobe, space: Space, s: Plain, n: int) -> float:
    """Largest |invert(sample(u)) - u|."""
    x = samples(lobe, space, s, n, seed=1)
    return float(np.abs(lobe.invert(space, s, x.o, x.i) - x.u).max())


@pytest.mark.claims("MCMC-A08")
@every_case
def test_directions_invert_to_their_numbers(space, name):
    errors = [inversion_error(CONTINUOUS[name], SPACES[space], s, 100_000 // len(SURFACES)) for s in SURFACES]
    assert max(errors) < 1e-11


@pytest.mark.claims("COM-A04")
@pytest.mark.parametrize("alpha", [0.15, 0.25, 0.5])
def test_ggx_in_the_plane_inverts_to_1e_12(alpha):
    assert inversion_error(CONTINUOUS["ggx"], SPACES["plane"], plain(alpha), 100_000) < 1e-12


def sampled_sine(i: Array) -> Array:
    """u from sin(theta) = 2 u - 1, (1, N)."""
    return (i[:1] + 1) / 2


def cosine_of_3d(i: Array) -> Array:
    """A mistake: u from sin(theta)^2 = u, as in space."""
    return i[:1] ** 2


def lambert_errors(invert) -> float:
    """Largest |invert(sample(u)) - u| in the plane."""
    x = samples(LOBES["lambert"], SPACES["plane"], plain(), 100_000, seed=1)
    return float(np.abs(invert(x) - x.u).max())


@pytest.mark.claims("COM-A02")
def test_lambert_in_the_plane_samples_the_sine_evenly_and_inverts_to_1e_12():
    lobe, space = LOBES["lambert"], SPACES["plane"]
    assert lambert_errors(lambda x: sampled_sine(x.i)) < 1e-12
    assert lambert_errors(lambda x: lobe.invert(space, x.s, x.o, x.i)) < 1e-12
    assert lambert_errors(lambda x: cosine_of_3d(x.i)) > 0.1


def test_inverting_with_another_width_is_noticed():
    wrong = replace(LOBES["ggx"], invert=lambda space, s, o, i: LOBES["ggx"].invert(space, plain(0.31), o, i))
    assert inversion_error(wrong, SPACES["plane"], plain(0.3), 1000) > 1e-3


# ---------------------------------------------------------------- density


def density_errors(lobe: Lobe, space: Space, s: Plain) -> Array:
    """|pdf * stretch of the sampler - 1|."""
    x = samples(lobe, space, s, 500, seed=2)
    return np.abs(lobe.pdf(space, s, x.o, x.i) * stretch(lambda u: lobe.sample(space, s, x.o, u), x.u) - 1)


@every_case
def test_the_density_is_the_reciprocal_stretch_of_the_sampler(space, name):
    errors = np.concatenate([density_errors(CONTINUOUS[name], SPACES[space], s) for s in SURFACES])
    assert np.quantile(errors, 0.99) < 1e-6
    assert errors.max() < 1e-2  # finite differences beside a kink or the horizon


MISTAKES = {
    "the half vector's density": lambda s, o, i: 2 * norm(o + i) / 2,
    "the Jacobian of 3D": lambda s, o, i: 2 / (4 * norm(o + i) / 2),
    "alpha = roughness": lambda s, o, i: (
        LOBES["ggx"].pdf(SPACES["plane"], plain(s.alpha**0.5), o, i) / LOBES["ggx"].pdf(SPACES["plane"], s, o, i)
    ),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_wrong_density_is_noticed(mistake):
    factor = MISTAKES[mistake]
    wrong = replace(LOBES["ggx"], pdf=lambda space, s, o, i: LOBES["ggx"].pdf(space, s, o, i) * factor(s, o, i))
    assert np.median(density_errors(wrong, SPACES["plane"], plain(0.3))) > 0.1


@pytest.mark.parametrize(("space", "name"), [case for case in CASES if case[0] in SEEING])
@pytest.mark.parametrize("cos", [1.0, 0.5, 0.1])
def test_the_density_integrates_to_the_part_that_is_not_lost(space, name, cos):
    space, lobe, s = SPACES[space], CONTINUOUS[name], plain(0.3, 1 / 1.5)
    o, u = tilted(space.d, cos), np.random.default_rng(3).random((space.d - 1, 400_000))
    kept = (lobe.sample(space, s, spread(o, u), u)[-1] != 0).mean()
    mirrored = o * np.append(-np.ones(space.d - 1), 1)[:, None]
    about = mirrored if name != "rough transmission" else -np.eye(space.d)[:, -1:]
    total = integral(space, lambda i: lobe.pdf(space, s, spread(o, i), i), about, {2: 4000, 3: 400}[space.d])
    assert total == pytest.approx(kept, abs=5 * np.sqrt(0.25 / u.shape[1]))
    assert total <= 1 + 1e-4
    assert name == "lambert" or kept < 1


# ---------------------------------------------------------------- histogram


def cells_of(space: Space, w: Array) -> Array:
    """The number of each direction's cell among 12^(d-1) cells of equal size; an inverse of `sphere`."""
    turn = {2: w, 3: w[:2], 4: w[2:]}[space.d]
    numbers = [np.arctan2(turn[1], turn[0]) / (2 * np.pi) % 1]
    if space.d == 3:
        numbers.append((1 - w[2]) / 2)
    if space.d == 4:
        numbers += [np.arctan2(w[1], w[0]) / (2 * np.pi) % 1, w[0] ** 2 + w[1] ** 2]
    digits = [np.minimum((12 * number).astype(int), 11) for number in numbers]
    return sum(digit * 12**k for k, digit in enumerate(digits))


def histogram_p(lobe: Lobe, space: Space, pdf) -> float:
    """Chi-square p of 20 000 samples per cell of directions, lost samples in a cell of their own."""
    s, N, cells = plain(0.5), 20_000, 12 ** (space.d - 1)
    o = tilted(space.d, 0.7)
    i = lobe.sample(space, s, spread(o, np.empty((1, N))), np.random.default_rng(3).random((space.d - 1, N)))
    kept = i[:, i[-1] != 0]
    seen = np.append(np.bincount(cells_of(space, kept), minlength=cells), N - kept.shape[1])
    w = space.sphere(grid(space.d - 1, {2: 12 * 4000, 3: 12 * 60, 4: 12 * 8}[space.d]))
    density = pdf(space, s, spread(o, w), w)
    expected = N * np.bincount(cells_of(space, w), density, cells) / w.shape[1] * sphere_area(space.d)
    expected = np.append(expected, max(N - expected.sum(), 0))
    few = expected < 10
    seen, expected = (np.append(each[~few], each[few].sum()) for each in (seen, expected))
    return float(chisquare(seen[expected > 0], expected[expected > 0] * N / expected.sum()).pvalue)


@pytest.mark.claims("COM-A02")
@every_case
def test_histograms_of_samples_follow_the_density(space, name):
    assert histogram_p(CONTINUOUS[name], SPACES[space], CONTINUOUS[name].pdf) > 1e-4


@pytest.mark.claims("COM-A02")
@pytest.mark.parametrize("space", SPACES)
def test_a_histogram_of_uniform_directions_is_told_from_lambert_s(space):
    def uniform(space, s, o, i):
        return (i[-1] > 0) * 2 / sphere_area(space.d)

    assert histogram_p(LOBES["lambert"], SPACES[space], uniform) < 1e-9


# ---------------------------------------------------------------- reciprocity


def flipped(w: Array) -> Array:
    """The same direction in the frame of the opposite normal."""
    return np.concatenate([w[:-1], -w[-1:]])


def reciprocity_error(lobe: Lobe, name: str, space: Space, s: Plain) -> float:
    """Largest |f(i, o) / f(o, i) - 1|; for transmission |f(i, o) eta^(d-1) / f(o, i) - 1|."""
    x, back = samples(lobe, space, s, 5000, seed=4), s
    there, here, f = x.i, x.o, evaluate(lobe, space, s, x.o, x.i) / np.abs(x.i[-1])
    if "transmission" in name:
        back, there, here = Plain(s.alpha, 1 / s.eta), flipped(x.i), flipped(x.o)
        f = f / s.eta ** (space.d - 1)
    f_back = evaluate(lobe, space, back, there, here) / x.o[-1]
    return float(np.abs(f_back / f - 1).max())


@pytest.mark.claims("MCMC-E02", "COM-A04")
@every_case
def test_lobes_are_reciprocal(space, name):
    rounding = 1e-9 if name == "rough transmission" else 1e-12  # 1 - F cancels where little is transmitted
    assert max(reciprocity_error(CONTINUOUS[name], name, SPACES[space], s) for s in SURFACES) < rounding


def test_a_lobe_without_its_masking_by_the_light_is_not_reciprocal():
    wrong = replace(LOBES["ggx"], weight=LOBES["lambert"].weight)
    assert reciprocity_error(wrong, "ggx", SPACES["plane"], plain(0.3)) > 0.1


def test_radiance_that_is_not_basic_is_not_reciprocal():
    right = LOBES["rough transmission"]
    wrong = replace(right, weight=lambda space, s, o, i: right.weight(space, s, o, i) / s.eta ** (space.d - 1))
    assert reciprocity_error(wrong, "rough transmission", SPACES["plane"], plain(0.3)) > 0.1


# ---------------------------------------------------------------- energy


def albedo(lobe: Lobe, space: Space, s: Plain, cos: float, n: int) -> float:
    """int f cos by a regular grid of numbers."""
    u = grid(space.d - 1, n)
    o = tilted(space.d, cos, u.shape[1])
    i = lobe.sample(space, s, o, u)
    return float((lobe.weight(space, s, o, i) * (i[-1] != 0)).mean())


@pytest.mark.claims("COM-A04")
@every_case
@pytest.mark.parametrize("cos", [1.0, 0.6, 0.2, 0.01])
def test_no_lobe_reflects_more_than_it_gets(space, name, cos):
    n = {2: 2000, 3: 60, 4: 12}[SPACES[space].d]
    assert max(albedo(CONTINUOUS[name], SPACES[space], s, cos, n) for s in SURFACES) <= 1 + 1e-12


@pytest.mark.claims("COM-A04")
@pytest.mark.parametrize(("alpha", "expected"), [(0.15, 0.98), (0.5, 0.82)])
def test_the_albedo_of_ggx_in_the_plane_is_what_masking_leaves(alpha, expected):
    assert albedo(LOBES["ggx"], SPACES["plane"], plain(alpha), 1.0, 200_000) == pytest.approx(expected, abs=0.01)


@pytest.mark.parametrize("space", SEEING)
@pytest.mark.parametrize("cos", [1.0, 0.5, 0.1])
@pytest.mark.parametrize("s", SURFACES)
def test_reflection_and_transmission_together_lose_no_more_than_masking_takes(space, cos, s):
    ways = [LOBES[f"rough {way}"] for way in ("reflection", "transmission")]
    both = sum(albedo(lobe, SEEING[space], s, cos, {2: 2000, 3: 60}[SEEING[space].d]) for lobe in ways)
    assert both <= 1 + 1e-12
    assert both > 0.98 or s.alpha > 0.1 or cos < 0.5


def test_flatland_s_lambert_makes_light_in_3d():
    wrong = replace(LOBES["lambert"], weight=lambda space, s, o, i: np.full(o.shape[-1], np.pi / 2))
    assert albedo(wrong, SPACES["solid"], plain(), 1.0, 20) > 1.5


# ---------------------------------------------------------------- shares


def lost_light(lobe: Lobe) -> float:
    """Largest share of views of which a lobe scatters light that choosing lobes never chooses."""
    x = samples(lobe, SPACES["plane"], plain(0.5, 1 / 1.5), 20_000, seed=5)
    return float((lobe.share(x.s, x.o) == 0).mean()) if lobe.share else 0.0


@pytest.mark.parametrize("name", CONTINUOUS)
def test_a_lobe_has_a_share_wherever_it_scatters(name):
    assert lost_light(CONTINUOUS[name]) == 0


def test_fresnel_s_share_loses_light_of_rough_transmission_in_total_internal_reflection():
    smooth = LOBES["glass transmission"].share
    assert lost_light(replace(LOBES["rough transmission"], share=smooth)) > 0.05


@pytest.mark.parametrize("pair", ["rough", "glass"])
def test_shares_of_reflection_and_transmission_sum_to_one(pair):
    o = views(2, 1000, np.random.default_rng(6))
    shares = [LOBES[f"{pair} {way}"].share(plain(0.5), o) for way in ("reflection", "transmission")]
    assert np.abs(sum(shares) - 1).max() < 1e-15


# ---------------------------------------------------------------- delta lobes


@every_delta
@pytest.mark.parametrize("space", SPACES)
def test_delta_lobes_have_one_direction_and_no_density(space, name):
    space, lobe = SPACES[space], DELTA[name]
    o, u = views(space.d, 100, np.random.default_rng(7)), np.random.default_rng(8).random((2, space.d - 1, 100))
    i, again = (lobe.sample(space, plain(), o, numbers) for numbers in u)
    assert (i == again).all()
    assert (lobe.pdf(space, plain(), o, i) == 0).all()
    assert (evaluate(lobe, space, plain(), o, i) == 0).all()
    assert lobe.invert(space, plain(), o, i).shape == u[0].shape


@pytest.mark.parametrize("space", SPACES)
def test_a_mirror_turns_directions_half_around_the_normal(space):
    space = SPACES[space]
    o = views(space.d, 100, np.random.default_rng(9))
    i = LOBES["mirror"].sample(space, plain(), o, np.zeros((space.d - 1, 100)))
    assert (i[:-1] == -o[:-1]).all()
    assert (i[-1] == o[-1]).all()
    assert (i[:-1] != o[:-1]).any()


# ---------------------------------------------------------------- extremes


@pytest.mark.parametrize("name", LOBES)
@pytest.mark.parametrize("space", SEEING)
@pytest.mark.parametrize("eta", [1.5, 1 / 1.5])
def test_nothing_is_undefined_at_the_horizon_or_for_opposite_directions(space, name, eta):
    space, lobe, s = SEEING[space], LOBES[name], plain(1e-3, eta)
    n = 200
    o = np.concatenate([tilted(space.d, cos, n) for cos in (1e-12, 1e-6, 1.0)], axis=1)
    u = np.random.default_rng(9).random((space.d - 1, 3 * n))
    u[:, ::7], u[:, 1::7] = 0, 1 - 1e-16
    sampled = lobe.sample(space, s, o, u)
    for i in (sampled, -o, o, flipped(o), -sampled, np.zeros_like(o)):
        values = lobe.pdf(space, s, o, i), lobe.weight(space, s, o, i)
        assert all(np.isfinite(value).all() and (value >= 0).all() for value in values)
    assert np.isfinite(sampled).all()

"""Laws of single steps and of the energies of blue noise, number by number.  [MCMC 4.2, 5.2]"""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.special import ndtr, ndtri

from restir_ref import decorrelation as module
from restir_ref.batch import Array, total
from restir_ref.decorrelation import STEPS, Blue, Move, attempt, bounded, energy, gaussian, metropolis, mutate, wrapped
from restir_ref.integrals import Pixels, Reservoirs
from tests.core.stubs import Always, Wrapped, live, same_bits
from toy1d import image_of_64, walking

pytestmark = pytest.mark.kernel


@dataclass(frozen=True)
class Normal(Always):
    """Chance whose uniform numbers are those of a standard normal n, the same everywhere."""

    n: float = 0.0

    def uniform(self, shape):
        return np.full(shape, ndtr(self.n))


@dataclass(frozen=True)
class Lowest(Always):
    """Chance that draws 0, of which the normal number is -infinity."""

    def uniform(self, shape):
        return np.zeros(shape)


# ---------------------------------------------------------------- steps of primary sample numbers


@pytest.mark.parametrize("n", [-2.0, 0.0, 1.5])
def test_a_gaussian_step_is_sigma_times_the_normal_number(n):
    assert gaussian(np.array([0.25, 0.5]), 0.1, Normal(n=n)) == pytest.approx([0.25 + 0.1 * n, 0.5 + 0.1 * n])


def test_the_longest_step_is_finite_and_nearly_nine_sigma():
    assert gaussian(np.zeros(1), 1.0, Lowest()).item() == pytest.approx(ndtri(2.0**-60), rel=1e-12)
    assert -9 < ndtri(2.0**-60) < -8.5


@pytest.mark.parametrize(("n", "right"), [(1.0, [0.35, 0.15]), (-1.0, [0.85, 0.65]), (9.0, [0.35, 0.15])])
def test_a_wrapped_step_leaves_at_one_end_and_enters_at_the_other(n, right):
    u, ratio = wrapped(np.array([0.1, 0.9]), 0.25, Normal(n=n) if n < 5 else Normal(n=5.0))
    assert u == pytest.approx(right)
    assert ratio.tolist() == [1, 1]


def test_a_wrapped_step_just_below_zero_arrives_inside_of_the_domain():
    u, _ = wrapped(np.zeros(1), 1e-20, Normal(n=-1.0))
    assert u.tolist() == [0]
    assert (-1e-20) % 1 == 1  # which a bare modulo would return


BOUNDED = {"inside": ([0.1, 0.9], -0.05, [0.05, 0.85], [1, 1]), "at the ends": ([0.0, 1.0], 0.0, [0.0, 1.0], [1, 0])}


@pytest.mark.parametrize(("u", "by", "right", "ratios"), BOUNDED.values(), ids=BOUNDED)
def test_a_bounded_step_is_valid_from_zero_on_and_below_one(u, by, right, ratios):
    found, ratio = bounded(np.array(u), abs(by), Normal(n=float(np.sign(by))))
    assert found == pytest.approx(right)
    assert ratio.tolist() == ratios


def test_a_bounded_step_out_of_the_domain_stays_and_is_invalid_if_one_coordinate_does_so():
    u = np.array([[0.5, 0.95, 0.5], [0.5, 0.5, 0.95]])
    found, ratio = bounded(u, 0.1, Normal(n=1.0))
    assert ratio.tolist() == [1, 0, 0]
    assert found == pytest.approx(np.array([[0.6, 0.95, 0.6], [0.6, 0.6, 0.95]]))
    assert bounded(u[None].repeat(2, axis=0), 0.1, Normal(n=1.0))[1].tolist() == [1, 0, 0]
    assert bounded(u, 0.6, Normal(n=-1.0))[1].tolist() == [0, 0, 0]


@pytest.mark.parametrize("step", STEPS.values(), ids=STEPS)
@pytest.mark.parametrize("shape", [(4,), (2, 4), (2, 3, 4), (1, 4)])
def test_a_step_keeps_the_shape_of_points_and_has_one_ratio_each(step, shape):
    u, ratio = step(np.full(shape, 0.5), 0.1, live())
    assert u.shape == shape
    assert ratio.tolist() == [1] * 4


def test_steps_are_known_by_their_names():
    assert dict(STEPS) == {"wrapped": wrapped, "bounded": bounded}


# ---------------------------------------------------------------- moves

LINE = walking(image_of_64())
HERE = Pixels(LINE, np.arange(64))
X = Reservoirs(np.full(64, 0.4), np.linspace(0.5, 1, 64), np.arange(1.0, 65))


def test_a_move_that_is_made_keeps_p_hat_W_and_the_confidence():
    moved, accepted = attempt(X, HERE, Always(1), metropolis)
    kept, rejected = attempt(X, HERE, Always(0), metropolis)
    assert accepted.all()
    assert not rejected.any()
    assert LINE.target(HERE.index, moved.x) * moved.W == pytest.approx(LINE.target(HERE.index, X.x) * X.W, rel=1e-12)
    assert (moved.c == X.c).all()
    assert (kept.x == X.x).all()
    assert (kept.W == X.W).all()


@dataclass(frozen=True, eq=False)
class Proposing(Wrapped):
    """Integrals with p_hat = x that propose x' = x + by, with T(x' -> x) / T(x -> x') = T."""

    by: Array
    T: Array

    def target(self, index, x):
        return x + 0.0

    def propose(self, index, x, chance):
        return x + self.by, self.T


FIVE = Pixels(Proposing(LINE, np.array([-0.25, 0.25, -0.2, -0.3125, 0.0]), np.array([1.0, 1, 2, 0.5, 0])), np.arange(5))
QUARTER = Reservoirs(np.array([0.25, 0.25, 0.25, 0.375, 0.5]), np.array([1.0, 2, 3, 4, 5]), np.ones(5))


def test_an_acceptance_is_asked_with_the_move_and_decides_but_for_proposals_in_the_dark():
    moves: list[Move] = []

    def acceptance(move: Move) -> Array:
        moves.append(move)
        return np.array([0.875, 0.75, 0.25, 0.5, 0.125])

    chance = Always(1)
    Z, accepted = attempt(QUARTER, FIVE, chance, acceptance)
    (move,), ((refused, a),) = moves[:1], chance.asked
    assert a.tolist() == [0, 0.75, 0.25, 0.5, 0.125]
    assert (refused + a).tolist() == [1] * 5
    assert move.here is FIVE
    assert move.X is QUARTER
    assert np.array_equal(move.p_hat, QUARTER.x)
    assert np.array_equal(move.p_hat_new, move.x_new)
    assert move.x_new == pytest.approx([0, 0.5, 0.05, 0.0625, 0.5])
    assert np.array_equal(move.T_ratio, FIVE.of.T)
    assert accepted.all()
    assert np.array_equal(Z.x, move.x_new)
    assert pytest.approx([0, 2 / 2, 3 * 5, 4 * 6, 5]) == Z.W
    assert same_bits(attempt(QUARTER, FIVE, Always(0), acceptance)[0], QUARTER)
    assert np.array_equal(mutate(QUARTER, FIVE, Always(1), acceptance).x, Z.x)


def test_metropolis_is_the_acceptance_unless_told():
    chance = Always(1)
    mutate(QUARTER, FIVE, chance)
    assert chance.asked[0][1] == pytest.approx([0, 1, 0.4, 1 / 12, 0])


@pytest.mark.parametrize("T", [-0.5, np.nan, np.inf])
def test_a_ratio_of_transition_densities_that_is_none_is_refused(T):
    of = Proposing(LINE, np.zeros(5), np.array([1, 1, T, 1, 1]))
    said = (
        rf"the ratio T\(x' -> x\) / T\(x -> x'\) must be .* but is {T} in column 2 .*Return 0 for an invalid proposal"
    )
    with pytest.raises(ValueError, match=said):
        mutate(QUARTER, Pixels(of, np.arange(5)), live())


def acceptance_of(p_hat: float, p_hat_new: float, T_ratio: float) -> float:
    """What Metropolis says of one move."""
    p, new, T = (np.array([value]) for value in (p_hat, p_hat_new, T_ratio))
    return float(metropolis(Move(HERE, X, X.x, p, new, T))[0])


def test_metropolis_accepts_by_the_ratio_of_targets_and_transitions_and_at_most_surely():
    assert [
        acceptance_of(*each) for each in ((2, 1, 1), (2, 1, 0.5), (1, 2, 1), (1, 2, 0.25), (1, 0, 1), (0, 1, 1))
    ] == [
        0.5,
        0.25,
        1,
        0.5,
        0,
        0,
    ]


# ---------------------------------------------------------------- blue noise


@dataclass(frozen=True, eq=False)
class Coloured(Wrapped):
    """Integrals in three channels f, 2 f and 6 f, of mean luminance 3 f."""

    def contribution(self, index, x):
        return self.of.contribution(index, x) * np.array([[1.0], [2.0], [6.0]])


LEFT = [HERE.index - 1, HERE.index - 2]


def blue(w: float, **temperature: float) -> Blue:
    """Noise of the two neighbours to the left, at distances 1 and 2; all are about as bright as what is proposed."""
    of = move(LINE)
    proposed = LINE.contribution(HERE.index, of.x_new)[0] * X.W * of.p_hat / of.p_hat_new
    return Blue(proposed * np.random.default_rng(1).uniform(0.9, 1.1, 64), LEFT, [1, 2], w, **temperature)


def move(of) -> Move:
    """From x = .4 to x = .7 with a ratio of transitions of .5."""
    x_new = np.full(64, 0.7)
    p_hat, p_hat_new = (LINE.target(HERE.index, x) for x in (X.x, x_new))
    return Move(Pixels(of, HERE.index), X, x_new, p_hat, p_hat_new, np.full(64, 0.5))


def by_hand(noise: Blue, luminance: Array) -> Array:
    """The mean energy with both neighbours."""
    return total([energy(d, luminance - noise.luminance[near]) for near, d in zip(LEFT, (1, 2), strict=True)]) / 2


def test_the_luminance_of_a_mutated_colour_is_the_mean_of_its_channels():
    of, noise = move(Coloured(LINE)), blue(1.0)
    W_new = X.W * of.p_hat / of.p_hat_new
    e, e_new = noise.energies(of)
    assert e == pytest.approx(by_hand(noise, noise.luminance), rel=1e-12)
    assert e_new == pytest.approx(by_hand(noise, 3 * LINE.contribution(HERE.index, of.x_new)[0] * W_new), rel=1e-12)


def test_the_energy_of_a_pair_decays_with_their_distance_squared_and_the_root_of_their_difference():
    assert energy(6.3, np.array([0.25, -0.25, 9])) == pytest.approx(np.exp([-9.5, -9.5, -12]), rel=1e-12)


def test_every_neighbour_has_its_distance():
    with pytest.raises(ValueError, match="zip"):
        replace(blue(1.0), distances=[1]).energies(move(LINE))


def test_a_proposal_from_the_dark_has_no_say_in_the_ratio_of_targets():
    of = replace(move(LINE), p_hat=np.zeros(64))
    assert (blue(0.0)(of) == 0).all()


def test_one_channel_for_the_mean_of_three_is_noticed():
    noise = blue(1.0)
    assert abs(noise.energies(move(Coloured(LINE)))[1] - noise.energies(move(LINE))[1]).max() > 0.01


@pytest.mark.parametrize("w", [0.0, 0.25, 1.0])
@pytest.mark.parametrize("T", [0.01, 0.1])
def test_blue_noise_mixes_the_annealed_acceptance_with_the_ratio_of_targets(w, T):
    of, noise = move(LINE), blue(w, temperature=T)
    e, e_new = noise.energies(of)
    assert 0.2 < (e_new < e).mean() < 0.8
    a_bn = np.where(e_new < e, 1, np.exp(-(e_new - e) / T))
    right = np.minimum(1, (w * a_bn + (1 - w) * of.p_hat_new / of.p_hat) * 0.5)
    assert noise(of) == pytest.approx(right, rel=1e-12)


def test_the_rule_compares_with_what_pixels_show_before_the_mutations():
    """The luminance p_hat W, not p_hat: uneven weights tell them apart."""
    uneven, here = replace(X, W=np.random.default_rng(2).uniform(0.5, 2, 64)), Pixels(LINE, HERE.index)
    found = module.blue(1.0, lambda here, chance: (LEFT, [1, 2]))(uneven, here, live(1))
    assert found.luminance == pytest.approx(LINE.contribution(HERE.index, X.x)[0] * uneven.W, rel=1e-12)
    assert abs(found.luminance / LINE.contribution(HERE.index, X.x)[0] - 1).max() > 0.3
    assert (found.neighbours, found.distances, found.w) == (LEFT, [1, 2], 1.0)


def test_the_temperature_is_a_hundredth_unless_told():
    of = move(LINE)
    assert np.array_equal(blue(1.0)(of), blue(1.0, temperature=0.01)(of))
    assert not np.array_equal(blue(1.0)(of), blue(1.0, temperature=0.1)(of))

"""Windows of Fig. 7 to 10: real passes with n inputs per pixel weigh like the algebra, and short chains judge less."""

from collections.abc import Sequence

import numpy as np
import pytest

from figures.claims.criteria import Outcome
from figures.claims.figure import Claim, undeclared, verdict_of
from figures.gris import gris_f07flat, gris_f09flat
from figures.gris.gris_f07flat import around, grouped, one_pass, realised, window_of
from restir_ref.batch import Array
from restir_ref.integrals import Pixels
from restir_ref.mis import WEIGHTS
from restir_ref.resampling import Input
from restir_ref.restir import initial
from tests.core.stubs import live

# ---------------------------------------------------------------- n samples of each of seven pixels


def inputs_of(n: int, columns: int) -> tuple[Sequence[Input], Sequence[Pixels]]:
    window, chance = window_of("across the foot of a box", 7, columns), live()
    return [Input(initial(at, chance), at) for _ in range(n) for at in window], window


@pytest.mark.claims("GRIS-F07", part="the algebra of 7 n inputs")
@pytest.mark.parametrize("mis", WEIGHTS)
def test_sum_w_of_7_n_inputs_is_the_mean_over_n_groups_of_seven(mis) -> None:
    inputs, window = inputs_of(3, 40)
    _, w = one_pass(inputs, window[0], mis, live())
    assert w.any()
    np.testing.assert_allclose(w, grouped(inputs, window, mis), rtol=1e-12)


def test_groups_of_another_size_do_not_add_up_to_it() -> None:
    inputs, window = inputs_of(3, 40)
    _, w = one_pass(inputs[:14], window[0], "talbot", live())
    assert abs(w - grouped(inputs, window, "talbot")).max() > 0.01 * w.max()


@pytest.mark.parametrize("mis", gris_f07flat.PROPER)
def test_a_proper_weights_estimate_is_sum_w(mis) -> None:
    inputs, window = inputs_of(2, 40)
    estimate, w = one_pass(inputs, window[0], mis, live())
    np.testing.assert_allclose(estimate, w, rtol=1e-12)


@pytest.mark.claims("GRIS-F08", part="what the windows contain")
def test_at_the_foot_of_a_box_others_sample_a_third_of_the_light_a_hundred_times_more_rarely() -> None:
    _, poor = realised(window_of("foot of a box, film", 33, 1000), live())
    assert 0.2 < poor < 0.5


def test_in_the_middle_of_the_floor_they_do_not() -> None:
    share, poor = realised(around("cornell", 768, 33, 24, 1000), live())
    assert poor < 0.01
    assert 0 < share < 1


# ---------------------------------------------------------------- means of frames


def chains(frames: int) -> dict[str, Array]:
    """Arrays of Fig. 9 as the paper has them: a moderate cap is best, means fall like 1/t, without a cap none does."""
    rng, R = np.random.default_rng(1), 12
    t = gris_f09flat.recorded(frames)
    level = dict(enumerate((0.4, 0.3, 0.1, 0.15, 0.3, 0.5, 0.8, 1.0)))
    noise = {k: v * (1 + 0.01 * rng.normal(size=R)) for k, v in level.items()}
    a = {f"late.{k}": v for k, v in noise.items()}
    a |= {f"mean.{k}": v / t[:, None] for k, v in noise.items()} | {f"t_mean.{k}": t for k in noise}
    a |= {"mean.0": a["mean.0"] / 20, f"mean.{gris_f09flat.UNCAPPED}": np.full((len(t), R), 1.0)}
    a |= {"t.6": t, "frame.6": 0.2 * t[:, None] ** 0.3 * (1 + 0.01 * rng.normal(size=(len(t), R)))}
    image = rng.uniform(1, 2, size=(R, 64))
    a |= {"last.7": image, "before.7": image * (1 + 1e-5 * rng.normal(size=image.shape))}
    a |= {"last.3": image, "before.3": rng.uniform(1, 2, size=(R, 64)), "truth": np.ones(64)}
    return a


def verdicts(frames: int) -> dict[str, str]:
    found = gris_f09flat.check(chains(frames))
    assert undeclared(gris_f09flat.FIGURE, found) == ""
    return {claim.part: verdict_of(claim) for claim in found}


SLOPE = "rough Cornell box, cap 20: slope of the mean's relMSE, last decade"


@pytest.mark.claims("GRIS-F09a", "GRIS-F09b", "GRIS-F10", part="the rule")
def test_numbers_like_the_papers_pass_and_a_short_chain_does_not_judge_the_slope_at_cap_20() -> None:
    long, short = verdicts(3000), verdicts(1000)
    assert set(long.values()) == {"reproduced"}
    assert short == {**long, SLOPE: "not judged"}


@pytest.mark.parametrize(
    ("name", "size"), [("late.6", 0.05), ("late.0", 0.05), ("frame.6", 0.05), ("mean.3", 0.05), ("mean.7", 1e-5)]
)
def test_numbers_unlike_the_papers_do_not_pass(name, size) -> None:
    a = chains(3000)
    a[name] = size * (1 + 0.1 * live().uniform(a[name].shape))
    assert "reproduced" not in {worst_of(gris_f09flat.check(a))}


def worst_of(claims: Sequence[Claim]) -> str:
    failed = [claim for claim in claims if isinstance(claim.outcome, Outcome) and not claim.outcome.passed]
    return verdict_of(failed[0]) if failed else "reproduced"

"""Every stage of every frame has unbiased contribution weights, seen through four functions of the sample."""

from dataclasses import dataclass, field

import numpy as np
import pytest

from restir_ref.batch import Array, total
from restir_ref.chance import Live
from restir_ref.integrals import Pixels
from restir_ref.mis import WEIGHTS
from restir_ref.restir import initial, shade, spatial, temporal
from restir_ref.transport.proofs.zoo import TRANSPORT_BUGS
from restir_ref.transport.restir_pt import PathIntegrals
from tests.flatland.probes import PROBES, probes
from tests.flatland.renderings import (
    RULES,
    Bias,
    bias,
    columns,
    frames,
    images,
    last,
    moving,
    paired,
)
from tests.transport.furnished import furnished_shifts
from tests.transport.paths import HYBRID

# ---------------------------------------------------------------- Definition 4.1, function by function


def chance() -> Live:
    return Live(np.random.default_rng(11))


@pytest.mark.claims("GRIS-E08", part="all stages but mutation")
@pytest.mark.claims("GRIS-A05")
def test_after_every_stage_the_integral_of_any_function_is_unbiased() -> None:
    found = probes(moving(images("cornell", "hybrid"), 20, 0.002), 1500, chance())
    assert len(found) == 4 * 7
    assert {at: each for at, each in found.items() if not each.is_none(0.01)} == {}


def kept(before: PathIntegrals, now: PathIntegrals) -> PathIntegrals:
    """A mistake: history is taken over as it is, weights and all, though the camera has moved."""
    return TRANSPORT_BUGS["path taken over as it is"].wrong(before.tracer)


@pytest.mark.claims("GRIS-A05")
def test_weights_kept_while_the_camera_moves_are_noticed() -> None:
    found = probes(moving(images("occluders", "hybrid"), 5), 160, chance(), kept)
    assert found[5, "temporal", "p_hat"].z > 8
    assert found[5, "temporal", "p_hat"].bias > 0.01


@pytest.mark.claims("GRIS-E08", part="initial samples")
def test_initial_samples_integrate_any_function_like_all_leaves_of_their_trees() -> None:
    here, chance = columns(images("cornell", "hybrid"), 700), Live(np.random.default_rng(12))
    X, other = (initial(here, chance, M) for M in (1, 4))
    for probe in PROBES.values():
        x, y = ((probe(each.x) * each.W).reshape(-1, here.of.n) for each in (X, other))
        assert bias(y - x, x).is_none(0.01)


# ---------------------------------------------------------------- f proportional to p_hat


@dataclass
class Remembering:
    """Chance that remembers the sums of the weights it chose by."""

    chance: Live
    sums: list[Array] = field(default_factory=list)

    def choose(self, weights: Array) -> Array:
        self.sums.append(total([*weights]))
        return self.chance.choose(weights)

    def uniform(self, shape: tuple[int, ...]) -> Array:
        return self.chance.uniform(shape)


def largest_difference(rule: str, scene: str) -> float:
    """|f(Y) W_Y - sum w| relative to the estimate, over all pixels, stages and frames."""
    chance, worst = Remembering(Live(np.random.default_rng(4))), 0.0
    for stage in frames(moving(images(scene, rule), 4), 16, chance, ("temporal", "spatial")):
        estimate = shade(stage.Y, stage.here)[0]
        worst = max(worst, float((np.abs(estimate - chance.sums[-1]) / np.maximum(estimate, 1e-300)).max()))
    return worst


@pytest.mark.claims("GRIS-E32", "GPT-E10")
@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize("scene", ["glossy_cornell", "glass_disc"])
def test_the_estimate_is_the_sum_of_weights_in_every_pixel_of_every_frame(scene, rule) -> None:
    assert largest_difference(rule, scene) < 1e-10


@pytest.mark.claims("GRIS-E32", part="a room of triangles", world="tracer3d")
@pytest.mark.parametrize("name", ["solid", "hyper"])
def test_in_rooms_of_more_dimensions_the_brightness_is_the_sum_of_weights_in_every_frame(name) -> None:
    of, chance = PathIntegrals(furnished_shifts(name, HYBRID, 1, 0).t), Remembering(Live(np.random.default_rng(4)))
    here, history, errors = columns(of, 50), [], []

    def note(X) -> None:
        estimate = shade(X, here).mean(axis=0)
        errors.append((np.abs(estimate - chance.sums[-1]) / np.maximum(estimate, 1e-300)).max())

    for _ in range(3):
        X = initial(here, chance)
        for Y in history:
            X = temporal(X, here, Y, [here], chance)
            note(X)
        X = spatial(X, here, [Pixels(of, here.index ^ 1)], chance)
        note(X)
        history = [X]
    assert len(errors) == 5
    assert max(errors) < 1e-10


@pytest.mark.claims("GRIS-E32")
def test_contribution_weights_apart_from_the_selection_s_break_that() -> None:
    here, chance = columns(images("cornell", "hybrid"), 16), Remembering(Live(np.random.default_rng(4)))
    X = initial(here, chance)
    Y = spatial(X, here, [Pixels(here.of, here.index ^ 1)], chance, mis=WEIGHTS["1/Z"])
    estimate = shade(Y, here)[0]
    assert (np.abs(estimate - chance.sums[-1]) > 1e-3 * estimate).mean() > 0.01


# ---------------------------------------------------------------- visibility belongs to the target


def after_two_rounds(kind, scene: str) -> Bias:
    """Bias of two rounds of spatial reuse of other integrals of the same image."""
    of = kind(images(scene, "hybrid").tracer)
    image = paired(last(frames([of], 256, Live(np.random.default_rng(5)), ("spatial", "spatial"))))
    return bias(image.added, image.initial)


shadowy = pytest.mark.parametrize("scene", ["occluders", "rack", "crease"])


@pytest.mark.claims("GRIS-A15")
@shadowy
def test_a_target_with_visibility_is_unbiased(scene) -> None:
    assert after_two_rounds(PathIntegrals, scene).is_none(0.01)


@pytest.mark.claims("GRIS-A15")
@shadowy
def test_a_target_without_visibility_is_dark(scene) -> None:
    found = after_two_rounds(TRANSPORT_BUGS["target without visibility"].wrong, scene)
    assert found.bias < -0.05
    assert found.z < -8

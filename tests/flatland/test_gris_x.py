"""Numbers without verdicts are numbers all the same: ratios of a renderer with itself are 1."""

import numpy as np
import pytest

from figures.claims.figure import undeclared, verdict_of
from figures.experiments import offline
from figures.experiments.references import INDIRECT, reference
from figures.gris import gris_x
from restir_ref.chance import Live

SCENE = "cornell"


def path_tracing_for_all() -> dict[str, np.ndarray]:
    """Path tracing under every name; frames of ReSTIR cost as many rays as they have trees here."""
    made = offline.compute(
        {"path tracing": 512}, {"scene": SCENE, "method": "path tracing"}, rng=np.random.default_rng(1)
    )
    names = (gris_x.TRACED, *gris_x.SHIFTS)
    arrays = {f"{SCENE}.{name}.{key}": value for name in names for key, value in made.items()}
    return {**arrays, f"{SCENE}.reference": reference(SCENE, INDIRECT).mean}


def test_path_tracing_is_as_fast_as_path_tracing() -> None:
    a = path_tracing_for_all()
    assert gris_x.speedups(a, SCENE) == pytest.approx([1, 1], rel=1e-12)
    assert gris_x.ratios(a, SCENE) == pytest.approx([1, 1], rel=1e-12)


def test_twice_the_rays_halve_the_speedup() -> None:
    a = path_tracing_for_all()
    a[f"{SCENE}.hybrid.rays"] = 2 * a[f"{SCENE}.hybrid.rays"]
    assert gris_x.speedups(a, SCENE) == pytest.approx([1, 0.5], rel=1e-12)


def test_long_paths_carry_more_light_than_short_ones() -> None:
    deep = gris_x.truth("occluders", 0, Live(np.random.default_rng(1)))
    assert (deep > reference("occluders").mean * 0.999).all()
    assert deep.mean() > 1.1 * reference("occluders").mean.mean()


def test_path_tracing_finds_the_truth_of_long_paths() -> None:
    images = gris_x.trees("occluders", 512, Live(np.random.default_rng(2)))["images"].mean(axis=1)
    truth = gris_x.truth("occluders", 0, Live(np.random.default_rng(1))).mean()
    error = images.std(ddof=1) / np.sqrt(len(images))
    assert error < 0.003 * truth
    assert abs(images.mean() - truth) < 4 * error


def numbers() -> dict[str, np.ndarray]:
    """Arrays of the figure as they might be: path tracing three times as expensive in one scene, cheaper in another."""
    return {
        "errors": np.full((2, 2, 2), 0.5),
        "cost": np.full((2, 2), 30.0),
        "speedups": np.array([[3, 3], [0.5, 2], [1, 1], [1, 1], [1, 1], [1, 1]]),
        "ratios": np.full((6, 2), 2.0),
        "rays": np.array([[[1.5, 3], [2.5, 5]]] * 3),
    }


def test_claims_on_gpus_are_reported_and_what_the_paper_leaves_to_the_future_is_not_judged() -> None:
    verdicts = {claim.id: verdict_of(claim) for claim in gris_x.check(numbers())}
    assert undeclared(gris_x.FIGURE, gris_x.check(numbers())) == ""
    assert verdicts.pop("GRIS-A22") == "not judged"
    assert set(verdicts.values()) == {"reported"}


def test_what_is_reported_says_in_how_many_scenes_reuse_is_slower_than_path_tracing() -> None:
    text = gris_x.of_speedups(numbers())
    assert "1 of 6 scenes by reconnection" in text
    assert "0 of 6 scenes by hybrid" in text

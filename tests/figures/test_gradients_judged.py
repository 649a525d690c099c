"""What gradient figures judge, report or leave open: by the numbers that decide it, not by how they came out."""

import numpy as np
import pytest

from figures.experiments import by_metrics
from figures.experiments.gradients import averaged
from figures.experiments.pans import floor_views
from figures.gradient import gpt_f01, gpt_f05, gpt_f07, gpt_f10, gpt_f10_3d, gpt_f12
from restir_ref.gradient_loop import PRIMAL


def noise(replicas, n, seed=1):
    return np.random.default_rng(seed).standard_normal((replicas, n))


# ---------------------------------------------------------------- rows have no edges but points


def test_edge_pairs_of_a_row_that_see_alike_are_far_apart_or_do_not_exist():
    assert "15 edge pairs that see alike are 62 pairs apart" in gpt_f10.alike_in("checker")
    assert gpt_f10.alike_in("occluders") == "no two of its 9 edge pairs see alike"


def test_in_space_edge_pairs_stand_side_by_side():
    (view,) = floor_views(1, gpt_f10_3d.preset_of(gpt_f10.ADAPTIVE), gpt_f10.ADAPTIVE, {})
    edge = view["dx"].active.reshape(view["dx"].shape)
    assert (edge[1:] & edge[:-1]).sum() > 30


@pytest.mark.parametrize("ratio", [0.1, 10.0])
def test_edge_pairs_of_a_row_are_reported_whatever_they_are(ratio):
    errors = noise(64, 1)[:, 0] ** 2 + 1
    claim = gpt_f10.in_a_row("GPT-F06", (ratio * errors, errors + 1e-9), "checker, aligned / none, edge pairs")
    assert claim.outcome.passed is None
    assert "62 pairs apart" in claim.reason


# ---------------------------------------------------------------- what is not in the experiment


@pytest.mark.parametrize("gain", [0.2, 5.0])
def test_the_gain_of_a_pair_over_a_pixel_is_not_judged_either_way(gain):
    a = {f"{arm}.{name}": noise(128, 4) for arm in gpt_f05.ARMS for name in (PRIMAL, "dx")}
    a["by area.dx"] = a["by area.dx"] / gain
    first, second = gpt_f05.check(a)
    assert first.outcome.passed is (gain > 1)
    assert second.outcome is None
    assert "> 1 at 95%" in second.reason
    assert "not in the experiment" in second.reason


# ---------------------------------------------------------------- too noisy to tell


@pytest.mark.parametrize(
    ("bias", "error", "passed"),
    [(0.0, 0.002, True), (0.01, 0.002, False), (0.01, 0.02, None), (0.1, 0.02, False), (0.0, 0.02, None)],
)
def test_a_bias_is_seen_or_excluded_or_left_open(bias, error, passed):
    sample = np.tile([-1.0, 1.0], 64) * error * np.sqrt(127)
    claim = gpt_f12.told_apart("part", 1 + bias + sample, 1.0)
    assert (claim.outcome.passed if claim.outcome else None) is passed
    assert claim.outcome or "too noisy to tell" in claim.reason


# ---------------------------------------------------------------- equal rays


def maps(rays):
    """Images of one scene by every method, alike but for their random numbers and their rays."""
    n = {"primal": gpt_f07.SIDE**2, "dx": gpt_f07.SIDE * (gpt_f07.SIDE - 1)}
    n["dy"] = n["dx"]
    found = {}
    for seed, (method, share) in enumerate(gpt_f07.SHARES.items()):
        found |= {f"s.{method}.{name}": noise(8 * share, size, seed) for name, size in n.items()}
        found[f"s.{method}.rays"] = np.array(rays.get(method, 1.0))
    return found


def test_images_and_differences_of_a_method_are_dearer_by_its_rays():
    cheap, dear = maps({"path tracing": 0.25}), maps({"path tracing": 0.5})
    one, two = (gpt_f07.noise_of(a, "s", "path tracing") for a in (cheap, dear))
    for band, by in one.items():
        assert all(two[band][metric] == pytest.approx(2 * each) for metric, each in by.items())
    one, two = (gpt_f07.gradient_error(a, "s", "path tracing") for a in (cheap, dear))
    assert two == pytest.approx(2 * one)


def test_the_better_image_alone_is_the_better_one_at_its_rays():
    alike = maps({"after": 0.5, "temporal": 1 / 3})
    for cheaper, other in (("after", "temporal"), ("temporal", "after")):
        a = alike | {f"s.{cheaper}.rays": alike[f"s.{cheaper}.rays"] / 100}
        mine = gpt_f07.bands(a, "s", gpt_f07.at_equal_rays(a, "s", cheaper)["primal"].reshape(-1, 24, 24), 0.01)
        for band, by in gpt_f07.primal(a, "s").items():
            assert all(each == pytest.approx(mine[band][metric]) for metric, each in by.items())
        assert gpt_f07.rays_of(a, "s", other) == pytest.approx(1)


def test_on_maps_differences_and_images_above_alpha_are_judged_at_one_limit(monkeypatch):
    swing, sizes = np.tile([-1.0, 1.0], 32), {"with": 0.75, "after": 1.0, "path tracing": 1.0, gpt_f07.ONE: 1.0}
    waves = {method: 1 + 1e-3 * (k + 1) * swing for k, method in enumerate(sizes)}
    monkeypatch.setattr(gpt_f07, "gradient_error", lambda a, scene, method: sizes[method] * waves[method])

    def power(a, scene, method):
        return {band: dict.fromkeys(by_metrics.METRICS, sizes[method] * waves[method]) for band in gpt_f07.BANDS}

    monkeypatch.setattr(gpt_f07, "noise_of", power)
    monkeypatch.setattr(gpt_f07, "primal", lambda a, scene: power(a, scene, "after"))
    monkeypatch.setattr(gpt_f07, "rebuilt", lambda a, scene, method: np.zeros((2, 24, 24)))
    a = {f"{scene}.path tracing.primal": np.ones((2, 576)) for scene in gpt_f07.SCENES}
    for ours, passed in ((0.75, True), (0.85, False)):
        sizes["with"] = ours
        judged = {f"{c.id} {c.part}": c.outcome.passed for c in gpt_f07.check(a) if c.outcome}
        found = {part for part, answer in judged.items() if answer is not None}
        assert {judged[part] for part in found} == {passed}
        assert len(found) == 3 * len(gpt_f07.SCENES)
        assert {part for part in found if "GPT-F08" in part} == {
            f"GPT-F08 {scene}, L2 with / primal, above alpha" for scene in gpt_f07.SCENES
        }


def test_pixels_that_no_light_reaches_are_told_with_their_share_of_either_error():
    black = np.arange(576).reshape(24, 24) < 144
    images = 1.0 * ~black + noise(64, 576).reshape(64, 24, 24)
    said = gpt_f07.unlit("GPT-F08", images, black, "part").outcome.measured
    assert said.startswith("25.0% of all")
    squared, relative = (float(each.split()[1].rstrip("%")) for each in said.split("L2's ")[1].split(", "))
    assert squared == pytest.approx(25, abs=2)
    assert relative > 99.9  # the reference is 0 there, not the noise of its mean


# ---------------------------------------------------------------- L1 and L2, on maps


def two_maps():
    """Images of both maps of GPT-F01 by every method, 64 replicas, at equal rays."""
    n = {"primal": gpt_f01.SIDE**2, "dx": gpt_f01.SIDE * (gpt_f01.SIDE - 1), "dy": gpt_f01.SIDE * (gpt_f01.SIDE - 1)}
    found = {}
    for view in gpt_f01.MAPS:
        for seed, (method, share) in enumerate(gpt_f01.SHARES.items()):
            for k, (name, size) in enumerate(n.items()):
                found[f"{view}.{method}.{name}"] = noise(2 * share, size, 3 * seed + k)
            found[f"{view}.{method}.rays"] = np.array(1 / share)
    return found


def test_all_maps_and_methods_are_cases_of_l1_against_l2(monkeypatch):
    asked, lower = [], [0.5]
    swing = np.tile([-1.0, 1.0], 32)

    def error(a, view, method, norm="L2"):
        asked.append((view, method, norm))
        return {"total": dict.fromkeys(by_metrics.METRICS, (lower[0] if norm == "L1" else 1.0) + 1e-3 * swing)}

    monkeypatch.setattr(gpt_f01, "rebuilt_error", error)
    judged, *reported = gpt_f01.norms({})
    assert {(view, method) for view, method, _ in asked} == {(v, m) for v in gpt_f01.MAPS for m in gpt_f01.METHODS}
    assert judged.outcome.passed is True
    lower[0] = 2.0
    assert gpt_f01.norms({})[0].outcome.passed is False
    assert all(claim.outcome.passed is None for claim in reported)
    assert len(reported) == len(gpt_f01.MAPS) * len(gpt_f01.METHODS)


def test_on_maps_l1_has_its_bias_and_l2_none():
    a = two_maps()
    view = gpt_f01.MAPS[0]
    images = np.zeros((8, 24, 24)) + np.array([-1.0, 1] * 4)[:, None, None]
    none, its_own = (gpt_f01.error_of(a, view, "with", images, biased=b)["total"]["MSE"].mean() for b in (0.0, 1.0))
    assert none == pytest.approx(8 / 7)
    assert its_own == pytest.approx(8 / 7 + (gpt_f01.truth(a, view) ** 2).mean())


def test_the_better_image_of_a_map_is_the_better_one_by_either_metric():
    a = two_maps()
    view, dear = gpt_f01.MAPS[0], 100 / gpt_f01.SHARES["after"]
    alone = gpt_f01.alone(a | {f"{view}.after.rays": np.array(dear)}, view)["total"]
    cheap = averaged(a[f"{view}.temporal.primal"], gpt_f01.SHARES["temporal"]).reshape(-1, 24, 24)
    expected = gpt_f01.error_of(a, view, "temporal", cheap)["total"]
    assert all(alone[metric] == pytest.approx(expected[metric]) for metric in by_metrics.METRICS)

"""What gradient figures judge, report or leave open: by the numbers that decide it, not by how they came out."""

from collections import Counter

import numpy as np
import pytest

from figures.claims.figure import verdict_of
from figures.experiments import by_metrics
from figures.experiments.gradients import CROP, NONE, SIDE, averaged, views_of
from figures.experiments.pans import SMALL, floor_views, panned, views_along
from figures.gradient import gpt_f01, gpt_f05, gpt_f07, gpt_f10, gpt_f10_3d, gpt_f12
from restir_ref.batch import changed
from restir_ref.chance import Live
from restir_ref.gradient_loop import PRIMAL
from restir_ref.integrals import NOWHERE, Pixels
from restir_ref.restir import initial, shade


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


def test_on_the_map_edge_pairs_stand_side_by_side_and_the_window_finds_them():
    own = gpt_f10.preset_of(gpt_f10.ADAPTIVE, gpt_f10.WINDOW_OF_A_MAP)
    dx = views_of(gpt_f10.MAP, own, gpt_f10.ADAPTIVE, Counter())[-1]["dx"]
    edge = dx.active.reshape(dx.shape)
    assert (edge[1:] & edge[:-1]).sum() > 90
    columns = np.flatnonzero(dx.active)
    (near,) = dx.around(dx.of["positive"], columns, 1, own.pairs.radius, Live(np.random.default_rng(1)))
    assert (near.index == NOWHERE).mean() < 0.05


def test_radii_and_windows_are_shares_of_the_film_and_the_map_is_a_crop_of_480_pixels():
    film = round(SIDE / CROP)
    assert film == gpt_f10.FILM
    assert film * 20 / 1920 == gpt_f10.RADIUS
    assert gpt_f10.WINDOW_OF_A_MAP / film == gpt_f10_3d.WINDOW / SMALL[0] == 1 / 20


def gradients(edge_gain=1.0, random_gain=1.0, interior_gain=1.0):
    """Arrays of GPT-F10: adaptive reuse divides noise at edge pairs, random neighbours at all, and interior ones."""
    a = gpt_f10.masks()
    for scene in (*gpt_f10.SCENES, gpt_f10.MAP):
        for k, arm in enumerate(gpt_f10.ARMS):
            a[f"{scene}.{arm}.rays"] = np.array([10.0, 14.0, 11.0][k])
            for name in gpt_f10.DIRECTIONS:
                if (edge := a.get(f"edge.{scene}.{name}")) is not None:
                    inside = interior_gain if arm == "adaptive" else 1.0
                    at_edges = {"adaptive": edge_gain, "random neighbours": random_gain}.get(arm, 1.0)
                    a[f"{scene}.{arm}.{name}"] = noise(64, len(edge), k + 10) / np.where(edge, at_edges, inside)
    return a


def verdicts(claims, part):
    """Verdicts of those parts, by id."""
    return {claim.id: verdict_of(claim) for claim in claims if claim.part.endswith(part)}


@pytest.mark.parametrize(
    ("gains", "over_none", "over_random"),
    [
        ({"edge_gain": 2.0}, "reproduced with caveat", "reproduced with caveat"),
        ({}, "not judged", "not judged"),
        ({"edge_gain": 0.5, "random_gain": 1.0}, "not reproduced", "not reproduced"),
        ({"edge_gain": 2.0, "random_gain": 4.0}, "reproduced with caveat", "not reproduced"),
    ],
)
def test_edge_pairs_of_the_map_are_judged_against_none_and_against_random_neighbours(gains, over_none, over_random):
    claims = gpt_f10.on_the_map(gradients(**gains))
    assert verdicts(claims, "aligned / no neighbours, edge pairs") == {"GPT-F06": over_none}
    assert verdicts(claims, "aligned / random neighbours, edge pairs") == {"GPT-F06": over_random}
    adaptive = verdicts(claims, "adaptive / no neighbours, edge pairs")["GPT-F10"]
    assert adaptive == (over_none if gains else "not reproduced")  # at 1 it is above .9


def test_edge_pairs_alone_count_as_edge_pairs_and_interior_ones_as_interior():
    a, b = gradients(), gradients(edge_gain=2.0)
    assert gpt_f10.error(a, gpt_f10.MAP, "adaptive", gpt_f10.EDGE) == pytest.approx(
        4 * gpt_f10.error(b, gpt_f10.MAP, "adaptive", gpt_f10.EDGE)
    )
    assert np.array_equal(
        gpt_f10.error(a, gpt_f10.MAP, "adaptive", gpt_f10.INTERIOR),
        gpt_f10.error(b, gpt_f10.MAP, "adaptive", gpt_f10.INTERIOR),
    )
    claims = gpt_f10.on_the_map(gradients(interior_gain=2.0))
    assert verdicts(claims, "interior pairs") == {"GPT-F06": "not reproduced"}


def test_every_edge_pair_counts_once_in_whatever_direction():
    """12 of the map's edge pairs are along columns, 120 along rows."""
    a = gradients()
    edge = {name: a[f"edge.{gpt_f10.MAP}.{name}"] for name in gpt_f10.DIRECTIONS}
    for name, scale in (("dx", 0.0), ("dy", 1.0)):
        a[f"{gpt_f10.MAP}.adaptive.{name}"] *= scale
    share = edge["dy"].sum() / sum(each.sum() for each in edge.values())
    assert gpt_f10.error(a, gpt_f10.MAP, "adaptive", gpt_f10.EDGE).mean() == pytest.approx(share, rel=0.1)


# ---------------------------------------------------------------- the primary hit fixed


def test_point_reuse_sees_every_pixel_of_a_replica_through_one_place():
    row = panned("checker", 16, 0.0, 1)[0]
    both = gpt_f05.Fixed(row, np.array([0.25, 0.75]))
    pixel = np.arange(32)
    found = both.ray(pixel, np.random.default_rng(1).random((1, 32)))
    at = row.ray(pixel % 16, np.repeat([0.25, 0.75], 16)[None])
    assert all(np.array_equal(one, other) for one, other in zip(found, at, strict=True))


def test_reuse_of_points_moves_a_path_to_the_place_of_its_target():
    """As if its place were moved there first: the same contribution and the same Jacobian."""
    views = views_along("checker", panned("checker", 64, 0.0045, 2), gpt_f05.PRESET, NONE, Counter())
    plain = [view[PRIMAL].of[PRIMAL] for view in views]
    before, now = (gpt_f05.fixed(v, np.full(2, at))[PRIMAL].of[PRIMAL] for v, at in zip(views, (0.2, 0.7), strict=True))
    index = np.arange(128)
    x = initial(Pixels(before, index), Live(np.random.default_rng(1))).x
    y = before.shift(x, index, Pixels(now, index))
    moved = plain[0].displaced(changed(x, u=np.concatenate([np.full((1, 128), 0.2), x.u[1:]])), np.full((1, 128), 0.5))
    expected = plain[0].shift(moved, index, Pixels(plain[1], index))
    assert np.allclose(y.J, expected.J)
    assert np.allclose(y.x.F, expected.x.F)
    assert (y.J > 0).mean() > 0.5


@pytest.mark.parametrize("arm", gpt_f05.POINTS)
def test_reuse_of_points_is_unbiased_for_what_it_shows(arm, monkeypatch):
    """The halves of a small row, and the sum of its differences, against independent trees."""
    for name, value in {"FILM": 48, "STEP": 0.006, "FRAMES": 4}.items():
        monkeypatch.setattr(gpt_f05, name, value)
    found = gpt_f05.compute({"replicas": 256}, {"reuse": arm}, rng=np.random.default_rng(3))
    (view,) = views_along("checker", panned("checker", 48, 0.0, 1), gpt_f05.PRESET, NONE, Counter())
    view = gpt_f05.fixed(view, np.full(512, 0.5)) if arm == gpt_f05.MIDDLE else view
    here = Pixels(view[PRIMAL].of[PRIMAL], np.arange(48 * 512))
    truth = shade(initial(here, Live(np.random.default_rng(4))), here)[0].reshape(512, 48)
    ends = found[PRIMAL][:, -8:].mean(axis=1) - found[PRIMAL][:, :8].mean(axis=1)
    for ours, theirs in (
        (found[PRIMAL].mean(axis=1), truth.mean(axis=1)),
        (ends, truth[:, -8:].mean(axis=1) - truth[:, :8].mean(axis=1)),
        (found["dx"][:, 20:30].sum(axis=1), truth[:, 30] - truth[:, 20]),
    ):
        error = np.hypot(*(each.std(ddof=1) / np.sqrt(len(each)) for each in (ours, theirs)))
        assert abs(ours.mean() - theirs.mean()) < 4 * error


# ---------------------------------------------------------------- gains of area reuse


def reuses(gradient=1.0, primal=1.0):
    """Arrays of GPT-F05 around a slope, whose noise area reuse divides."""
    flat = {PRIMAL: np.linspace(1, 2, 48), "dx": np.full(47, 1 / 47)}
    a = {}
    for k, arm in enumerate(gpt_f05.ARMS):
        for name, gain in ((PRIMAL, primal), ("dx", gradient)):
            a[f"{arm}.{name}"] = flat[name] + noise(128, len(flat[name]), k) * 0.01 / (
                gain if arm == gpt_f05.AREA else 1
            )
    return a


@pytest.mark.parametrize(
    ("gains", "first", "second"),
    [
        ({"gradient": 2.0}, "reproduced", "reproduced"),
        ({"gradient": 2.0, "primal": 2.0}, "reproduced", "not judged"),
        ({"gradient": 2.0, "primal": 4.0}, "reproduced", "not reproduced"),
        ({"gradient": 0.5}, "refuted", "not reproduced"),
    ],
)
def test_area_reuse_is_judged_by_both_clauses_against_point_reuse_of_the_same_pixels_alone(gains, first, second):
    claims = {claim.part: verdict_of(claim) for claim in gpt_f05.check(reuses(**gains))}
    parts = [(f"gradient, area / {at}", f"gain of area over {at}, primal / gradient") for at in gpt_f05.POINTS]
    found = {at: tuple(claims[part] for part in each) for at, each in zip(gpt_f05.POINTS, parts, strict=True)}
    assert found[gpt_f05.JITTERED] == (first, second)
    assert set(found[gpt_f05.MIDDLE]) <= {"reported", "not judged"}


def test_reuse_that_keeps_the_place_is_reported_beside_them():
    (claim,) = [claim for claim in gpt_f05.check(reuses(gradient=2.0)) if gpt_f05.KEPT in claim.part]
    assert verdict_of(claim) == "reported"


def test_what_middles_miss_of_whole_pixels_is_an_error_of_theirs():
    """Of the same noise and the same means 1; with a bias of three standard deviations a tenth."""
    a = reuses()
    assert gpt_f05.of_whole_pixels(a, "dx") == pytest.approx(1, rel=0.05)
    a[f"{gpt_f05.MIDDLE}.dx"] = a[f"{gpt_f05.MIDDLE}.dx"] + 0.03
    assert gpt_f05.of_whole_pixels(a, "dx") == pytest.approx(0.1, rel=0.05)


def test_errors_are_told_over_the_squares_of_what_is_estimated():
    a = reuses()
    scaled = a | {f"{gpt_f05.MIDDLE}.dx": 3 * a[f"{gpt_f05.MIDDLE}.dx"]}
    assert gpt_f05.error(scaled, gpt_f05.MIDDLE, "dx") == pytest.approx(gpt_f05.error(a, gpt_f05.MIDDLE, "dx"))
    scaled = a | {f"{gpt_f05.JITTERED}.dx": 3 * a[f"{gpt_f05.JITTERED}.dx"]}
    assert gpt_f05.error(scaled, gpt_f05.JITTERED, "dx") == pytest.approx(9 * gpt_f05.error(a, gpt_f05.JITTERED, "dx"))


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

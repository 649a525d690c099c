"""Reuse changes no mean: shifts, loops, moving cameras and colours, over whole films seen in few pixels."""

from dataclasses import replace

import numpy as np
import pytest

from flatland2d import SCENES
from flatland2d.radiosity import render
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.integrals import Pixels, Shifted
from restir_ref.loop import OFFLINE, random_in_row
from restir_ref.mis import WEIGHTS
from restir_ref.restir import initial, shade, spatial
from restir_ref.transport.paths import Path, radiance, trace
from restir_ref.transport.proofs.zoo import TRANSPORT_BUGS
from restir_ref.transport.proofs.zoo.domains import Refused
from restir_ref.transport.restir_pt import PathIntegrals
from tests.flatland.renderings import (
    LOOPS,
    MATRIX,
    NEIGHBOURS,
    REACH,
    RULES,
    Paired,
    bias,
    columns,
    error_slope,
    frames,
    images,
    last,
    offline,
    paired,
    rendering,
    spread,
    view,
)

LARGEST_SPREAD = 1.7
"""Of 32 z-scores: less than 1e-6 of independent ones are spread wider."""

# ---------------------------------------------------------------- the matrix

REPLICAS = {"ajar": 1024, "clear_coat": 320}


@pytest.mark.parametrize("loop", LOOPS)
@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize("scene", MATRIX)
def test_reuse_changes_no_mean_and_no_pixel(scene, rule, loop) -> None:
    image = rendering(scene, rule, loop, REPLICAS.get(scene, 192), Live(np.random.default_rng(21)))
    assert bias(image.added, image.initial).is_none(0.02)
    assert spread(image.added) < LARGEST_SPREAD


@pytest.mark.parametrize("rule", RULES)
def test_reuse_agrees_with_radiosity(rule) -> None:
    setting = SCENES["ajar"]()
    cuts = [render(setting.scene, view("ajar", 32), setting.depth, n, film=4).mean() for n in (24, 28, 32, 36, 40)]
    image = rendering("ajar", rule, "spatial", 1024, Live(np.random.default_rng(22)))
    assert np.std(cuts) < 0.005 * np.mean(cuts)
    assert bias(image.initial + image.added - np.mean(cuts), np.array(cuts)).is_none(0.02)


# ---------------------------------------------------------------- one integral per pixel


def as_one_pixel(scene: str, u: Array, pixel: Array, n: int) -> Array:
    """Radiance of primary samples of pixels, found through a film of one pixel; (N,)."""
    t = images(scene, "hybrid", 1).tracer
    return radiance(trace(t, np.concatenate([(pixel + u[:1]) / n, u[1:]]), np.zeros_like(pixel)))[0]


@pytest.mark.claims("GRIS-E44")
@pytest.mark.parametrize("scene", SCENES)
def test_pixels_share_out_the_film_sample_by_sample(scene) -> None:
    t, rng = images(scene, "hybrid").tracer, np.random.default_rng(23)
    u, pixel = rng.random((t.D, 3200)), np.arange(3200) % 32
    by_pixel, whole = radiance(trace(t, u, pixel))[0], as_one_pixel(scene, u, pixel, 32)
    same = np.abs(by_pixel - whole) <= 1e-6 * whole
    assert (~same).mean() < 1e-3


def reused(kind, replicas: int) -> Array:
    """The image after two rounds of reuse over pixels, (replicas, 32)."""
    of, chance = kind(images("cornell", "hybrid").tracer), Live(np.random.default_rng(24))
    image = paired(last(frames([of], replicas, chance, ("spatial", "spatial"))))
    return image.initial + image.added


def film(count: int) -> Array:
    """Independent estimates of the integral over the whole film, (count,)."""
    t, rng = images("cornell", "hybrid", 1).tracer, np.random.default_rng(25)
    return radiance(trace(t, rng.random((t.D, count)), np.zeros(count, dtype=int)))[0]


@pytest.mark.claims("GRIS-E44")
def test_the_pixels_integrals_with_reuse_sum_to_that_of_the_film() -> None:
    pixels, whole = reused(PathIntegrals, 2000), film(64_000).reshape(2000, 32)
    assert bias(pixels - whole, whole).is_none(0.003)


@pytest.mark.claims("GRIS-E44")
def test_paths_reused_without_a_shift_end_up_in_wrong_pixels() -> None:
    initial_image = reused(PathIntegrals, 64)
    mixed = reused(TRANSPORT_BUGS["path taken over as it is"].wrong, 64)
    assert spread(mixed - initial_image) > 3


# ---------------------------------------------------------------- colours


def coloured(of: PathIntegrals) -> PathIntegrals:
    """The same image in three colours: every material and light has its own."""
    s, rng = of.tracer.scene, np.random.default_rng(26)
    table, lights = s.materials, s.lights
    dyed = replace(table, colour=table.colour * rng.uniform(0.2, 1, (3, table.colour.shape[-1])))
    light = np.array([[1.0], [0.8], [0.5]])
    emission, lit = s.emission * light, replace(lights, emission=lights.emission * light)
    return PathIntegrals(replace(of.tracer, scene=replace(s, materials=dyed, emission=emission, lights=lit)))


def channels(of, replicas: int) -> list:
    """Bias of each channel's mean after two rounds of reuse."""
    stage = last(frames([of], replicas, Live(np.random.default_rng(27)), ("spatial", "spatial")))
    Y, X = (shade(each, stage.here).reshape(3, replicas, -1) for each in (stage.Y, stage.X))
    return [bias(y - x, x) for x, y in zip(X, Y, strict=True)]


@pytest.mark.claims("GRIS-E47")
@pytest.mark.parametrize("rule", RULES)
def test_every_channel_is_unbiased(rule) -> None:
    found = channels(coloured(images("glossy_cornell", rule)), 700)
    assert [each.is_none(0.005) for each in found] == [True] * 3


class KeepsColour(PathIntegrals):
    """A mistake: the offset path is as bright as it should be, in the base path's colour."""

    def shift(self, x: Path, index: Array, to: Pixels) -> Shifted:
        y = super().shift(x, index, to)
        hue = x.F / np.maximum(x.F.mean(axis=0), 1e-300)
        return Shifted(replace(y.x, F=hue * y.x.F.mean(axis=0)), y.J)


@pytest.mark.claims("GRIS-E47")
def test_colours_kept_from_the_base_path_are_noticed() -> None:
    of = coloured(images("glossy_cornell", "hybrid"))
    stage = last(frames([KeepsColour(of.tracer)], 256, Live(np.random.default_rng(27)), ("spatial", "spatial")))
    Y, X = (shade(each, stage.here).reshape(3, 256, -1) for each in (stage.Y, stage.X))
    assert max(spread(y - x) for x, y in zip(X, Y, strict=True)) > 2


# ---------------------------------------------------------------- shifts that are refused


def refused(x: Path, i: Array, j: Array) -> Array:
    """3 of 10 shifts, decided by the film number, which shifts keep, and the pair of pixels in no order."""
    return (x.u[0] * 7919 + (i + j) * 0.618 + i * j * 0.414) % 1 < 0.3


def both_ways(x: Path, i: Array, j: Array, J: Array) -> Array:
    """A shift is refused with its inverse."""
    return ~refused(x, i, j)


def forth_only(x: Path, i: Array, j: Array, J: Array) -> Array:
    """Shifts to pixels further right are refused, their inverses are not."""
    return ~(refused(x, i, j) & (i < j))


def one_round(of: PathIntegrals, replicas: int) -> tuple[Array, Array]:
    """Added by one round of reuse, and initial (replicas, 32)."""
    image = paired(last(frames([of], replicas, Live(np.random.default_rng(28)), ("spatial",))))
    return image.added, image.initial


@pytest.mark.claims("GRIS-C18")
@pytest.mark.parametrize("scene", ["cornell", "glossy_cornell", "crease"])
def test_shifts_refused_both_ways_cost_noise_only(scene) -> None:
    of = images(scene, "hybrid")
    (whole, _), (part, base) = one_round(of, 384), one_round(Refused(of.tracer, both_ways), 384)
    assert bias(part, base).is_none(0.01)
    assert spread(part) < LARGEST_SPREAD
    assert (base + part).var(axis=0).sum() > 1.02 * (base + whole).var(axis=0).sum()


def not_returned(allowed) -> float:
    """Share of successful shifts whose inverse is undefined."""
    of = Refused(images("glossy_cornell", "hybrid").tracer, allowed)
    index = np.arange(32 * 200)
    there = random_in_row(of, index, 1, REACH, Live(np.random.default_rng(29)))[0]
    X = initial(Pixels(of, index), Live(np.random.default_rng(30)))
    y = of.shift(X.x, index, there)
    back = of.shift(y.x, there.index, Pixels(of, index))
    return float((back.J == 0)[(y.J > 0) & y.x.F.any(axis=0)].mean())


@pytest.mark.claims("GRIS-C18")
def test_shifts_refused_one_way_are_found_by_inverting_them() -> None:
    assert not_returned(both_ways) < 1e-3
    assert not_returned(forth_only) > 0.1


# ---------------------------------------------------------------- averaged offline frames

SMALL = replace(OFFLINE, trees=4, neighbours=3, radius=REACH)


def some_frames(count: int) -> Paired:
    """So many small offline frames of 16 pixels."""
    return offline("cornell", "hybrid", 16, count, Live(np.random.default_rng(31)), SMALL)


@pytest.mark.claims("GRIS-A06", "GRIS-C09", part="a smaller preset, on a coarse film")
def test_averages_of_offline_frames_are_unbiased_and_converge() -> None:
    found = some_frames(1024)
    assert bias(found.added, found.initial).is_none(0.005)
    assert error_slope(found.initial + found.added) == pytest.approx(-1, abs=0.07)


def test_frames_that_share_samples_do_not_converge_like_that() -> None:
    found = some_frames(64)
    assert error_slope(np.repeat(found.initial + found.added, 16, axis=0)) > -0.9


def over_bound(mis, rounds: int) -> float:
    """The largest p_hat(Y) W_Y over sum_i c_i p_hat_i(X_i) W_i / c_R, of any pixel in any round."""
    here, chance, worst = columns(images("glossy_cornell", "hybrid"), 128), Live(np.random.default_rng(32)), 0.0
    X = initial(here, chance)
    for _ in range(rounds):
        near = random_in_row(here.of, here.index, NEIGHBOURS, REACH, chance)
        each = X.c * shade(X, here)[0]
        bound = each + sum(each[at.index] for at in near)
        X = spatial(X, here, near, chance, mis=mis)
        worst = max(worst, float((shade(X, here)[0] * (X.c / (NEIGHBOURS + 1)) / np.maximum(bound, 1e-300)).max()))
    return worst


@pytest.mark.claims("GRIS-C09")
def test_contributions_of_offline_frames_stay_below_their_bound() -> None:
    assert over_bound(WEIGHTS["defensive"], SMALL.rounds) <= 1 + 1e-9
    assert over_bound(WEIGHTS["1/Z"], SMALL.rounds) > 1.1

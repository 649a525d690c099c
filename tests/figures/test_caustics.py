"""Laws of Fig. 13's caustics: what a shift keeps of their light, which scenes hold the effect, and who is judged."""

from collections import Counter
from dataclasses import dataclass, replace

import numpy as np
import pytest

from figures.experiments import kept_light
from figures.experiments.indirect import METHODS
from figures.experiments.kept_light import by_mirror, kept, share
from figures.experiments.split_light import IndirectIntegrals
from figures.experiments.views import view
from figures.gris import gris_f13, gris_f13_3d
from figures.gris.gris_f13 import FLAT, KEPT, PT, SHIFTS, Caustics
from figures.gris.gris_f13_3d import SPACE
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.integrals import Pixels, Shifted
from restir_ref.restir import initial
from restir_ref.transport.paths import Path, trace
from restir_ref.transport.rays import arrive

# ---------------------------------------------------------------- what a shift keeps


def flat(scene: str, shift: str):
    """Flatland's standard view, with the integrals of a shift."""
    method = METHODS[shift]
    return method.integrals(view(scene, method.rule, Counter()).tracer)


def solid(scene: str, shift: str):
    """The crop of space in which is measured what shifts keep."""
    return gris_f13_3d.views(scene, shift, gris_f13_3d.WIDE, Counter())[-1]


def found(of, replicas: int) -> float:
    """The share that a shift keeps."""
    return share({f"x.{key}": value for key, value in kept(of, replicas, Live(np.random.default_rng(3))).items()}, "x")


@dataclass(frozen=True, eq=False)
class Halved(IndirectIntegrals):
    """A shift whose Jacobian is half as large as it should be."""

    def shift(self, x: Path, index: Array, to: Pixels) -> Shifted:
        y = super().shift(x, index, to)
        return Shifted(y.x, y.J / 2)


def the_pixel_itself(of, index, count, radius, chance):
    return [Pixels(of, index)] * count


@pytest.mark.parametrize("scene", [FLAT.glass, FLAT.distant])
def test_a_shift_from_a_pixel_to_itself_keeps_all(scene, monkeypatch):
    monkeypatch.setattr(kept_light, "at_random", the_pixel_itself)
    of = flat(scene, "hybrid")
    assert found(of, 40) == pytest.approx(1, abs=1e-12)
    assert found(Halved(of.tracer), 40) == pytest.approx(0.5, abs=1e-12)


def test_a_shift_keeps_as_much_one_way_as_the_other(monkeypatch):
    """Over a ring of pixels: int min(f_i, f_j o T |T'|) is that of j, i and the inverse of T.  Not with half of J."""
    of = flat(FLAT.glass, "hybrid")
    there, back = (light_kept(of, aside(step), monkeypatch) for step in (9, -9))
    assert abs(there[0] - back[0]) < 4 * np.hypot(there[1], back[1])
    halved = light_kept(Halved(of.tracer), aside(9), monkeypatch)
    assert abs(halved[0] - back[0]) > 8 * np.hypot(halved[1], back[1])


def aside(step: int):
    """Each pixel's neighbour so many pixels further in a ring."""
    return lambda of, index, *_: [Pixels(of, index - index % of.n + (index + step) % of.n)]


def light_kept(of, around, monkeypatch) -> tuple[float, float]:
    """The light that is kept, and its standard error."""
    monkeypatch.setattr(kept_light, "at_random", around)
    means = [float(kept(of, 20, Live(np.random.default_rng(seed)))["kept"]) for seed in range(16)]
    return float(np.mean(means)), float(np.std(means, ddof=1) / np.sqrt(len(means)))


# ---------------------------------------------------------------- what arrives by way of a mirror


@pytest.mark.parametrize(("of", "material"), [(flat(FLAT.glass, "hybrid"), 1), (solid(SPACE.distant, "hybrid"), 2)])
def test_light_by_a_mirror_is_that_whose_second_vertex_is_on_it(of, material, monkeypatch):
    index = np.arange(10 * of.n)
    x = initial(Pixels(of, index), Live(np.random.default_rng(1))).x
    tree = trace(of.tracer, x.u, index % of.n)
    on = (of.tracer.scene.material[tree.x[1].prim] == material) & (x.k > 1)
    assert on.any()
    assert np.array_equal(by_mirror(of.tracer, x, index % of.n), on)
    monkeypatch.setattr(kept_light, "HYBRID", METHODS["reconnection"].rule)
    assert not by_mirror(of.tracer, x, index % of.n).any()


# ---------------------------------------------------------------- which scenes hold the effect


@pytest.mark.claims("GRIS-F13t", part="what shifts keep of a caustic below glass")
@pytest.mark.parametrize("of", [lambda shift: flat(FLAT.glass, shift), lambda shift: solid(SPACE.glass, shift)])
def test_below_glass_reconnection_keeps_nothing_and_replay_most(of):
    assert found(of("reconnection"), 8) == 0
    assert found(of("hybrid"), 8) > 0.8


@pytest.mark.claims("GRIS-F13b", part="what shifts keep of a distant highlight", world="tracer3d")
def test_replay_loses_most_of_the_distant_highlight_and_reconnection_little():
    assert found(solid(SPACE.distant, "hybrid"), 24) < 0.35
    assert found(solid(SPACE.distant, "reconnection"), 24) > 0.85


def test_in_flatland_both_shifts_keep_nearly_all_of_the_distant_highlight():
    assert {shift: found(flat(FLAT.distant, shift), 200) > 0.85 for shift in SHIFTS} == dict.fromkeys(SHIFTS, True)


# ---------------------------------------------------------------- who is judged


ERRORS = {"hybrid": 1.0, "reconnection": 4.0, "reconnection at equal rays": 3.0, PT: 2.0}
"""Squared errors below glass."""


def arrays(scenes: Caustics, keeps, ratio: float, images: int = 64):
    """Images of one pixel whose errors are given; of the distant highlight `ratio` is reconnection over hybrid."""
    rng, a = np.random.default_rng(1), {}
    for scene, errors in ((scenes.glass, ERRORS), (scenes.distant, {"hybrid": 1.0, "reconnection": ratio})):
        a[f"{scene}.reference"] = np.ones(2)
        for name, error in errors.items():
            a[f"{scene}.{name}"] = 1 + np.sqrt(error * rng.uniform(0.9, 1.1, (images, 1))) * np.ones(2)
            a[f"{scene}.{name}.rays"] = np.array(20.0)
        for shift, of_light in zip(SHIFTS, keeps[scene], strict=True):
            name = f"{scene}.{KEPT}.{shift}"
            a |= {f"{name}.{key}": np.array(v) for key, v in (("kept", of_light), ("light", 1.0), ("paths", 9))}
    return a


def outcomes(scenes: Caustics, glass, distant, ratio: float, images: int = 64):
    """Whether each judged part passed, by its words; what has no verdict is None."""
    claims = gris_f13.judged(arrays(scenes, {scenes.glass: glass, scenes.distant: distant}, ratio, images), scenes)
    return {claim.part: claim.outcome and claim.outcome.passed for claim in claims if "relMSE" in claim.part}


@pytest.mark.parametrize("scenes", [FLAT, SPACE])
@pytest.mark.parametrize("ratio", [0.5, 2.0])
def test_a_scene_that_holds_the_effect_is_judged_whatever_is_found(scenes, ratio):
    below, traced, distant = outcomes(scenes, (0.9, 0.0), (0.2, 0.9), ratio).values()
    assert below is traced is True
    assert distant is (ratio < 0.8)


@pytest.mark.parametrize("scenes", [FLAT, SPACE])
@pytest.mark.parametrize("ratio", [0.5, 2.0])
@pytest.mark.parametrize("distant", [(0.9, 0.9), (0.2, 0.3), (0.9, 0.2), (0.5, 0.9)])
def test_a_highlight_that_replay_keeps_or_reconnection_loses_is_not_judged_either_way(scenes, ratio, distant):
    assert list(outcomes(scenes, (0.9, 0.0), distant, ratio).values()) == [True, True, None]


@pytest.mark.parametrize("glass", [(0.9, 0.9), (0.4, 0.0), (0.0, 0.9)])
def test_a_caustic_below_glass_that_reconnection_keeps_is_not_judged(glass):
    assert list(outcomes(SPACE, glass, (0.2, 0.9), 0.5).values()) == [None, None, True]


def test_what_is_not_judged_says_what_was_measured_and_why():
    a = arrays(SPACE, {SPACE.glass: (0.9, 0.0), SPACE.distant: (0.96, 0.9)}, 0.5)
    (claim,) = (each for each in gris_f13.judged(a, SPACE) if each.id == "GRIS-F13b" and "relMSE" in each.part)
    assert str(claim.outcome.measured).startswith("0.5")
    assert "they keep 0.96 and 0.90" in claim.reason


def test_few_frames_judge_no_distant_highlight():
    assert list(outcomes(SPACE, (0.9, 0.0), (0.2, 0.9), 0.5, images=8).values()) == [True, True, None]


# ---------------------------------------------------------------- blocks of frames


def test_blocks_are_one_run_of_images():
    parts = [{"images": np.full((2, 3), k), "rays": np.array(k)} for k in range(4)]
    whole = gris_f13_3d.joined(parts)
    assert whole["images"][:, 0].tolist() == [0, 0, 1, 1, 2, 2, 3, 3]
    assert float(whole["rays"]) == 1.5


@pytest.mark.parametrize("preset", ["quick", "paper"])
def test_every_preset_has_all_chunks_of_flatland_and_both_truths(preset):
    of = gris_f13_3d.FIGURE.presets[preset]
    named = {gris_f13.name_of({k: v for k, v in chunk.items() if k != "block"}) for chunk in gris_f13_3d.chunks(of)}
    truths = {f"{scene}.{gris_f13_3d.TRUTH}" for scene in gris_f13_3d.SCENES}
    assert named == {gris_f13.name_of(chunk) for chunk in gris_f13.chunks_of(SPACE)} | truths


@pytest.mark.parametrize("scene", gris_f13_3d.SCENES)
def test_every_frame_of_a_moving_camera_has_in_its_middle_what_the_last_one_has(scene):
    of, last = gris_f13_3d.SCENES[scene](), gris_f13_3d.crop(scene, 18)
    sensors = [each.tracer.sensor for each in gris_f13_3d.views(scene, "hybrid", 18, Counter())]
    (crop,) = last.crops()
    x, w, _ = crop.through(np.array([crop.left + 9]), np.array([crop.top + 9]))
    seen, _, _ = arrive(of.scene, x, w)
    places = [sensor.crops()[0].project(seen.x)[:, 0] for sensor in sensors]
    assert (len(sensors), sensors[-1]) == (20, last)
    assert np.abs(np.array(places) - 9).max() <= 0.5 + 1e-9
    at_rest = replace(sensors[0].crops()[0], left=crop.left, top=crop.top)
    assert np.abs(at_rest.project(seen.x) - 9).max() > 18

"""References of flatland: every scene of today has one, it is what path tracing finds, and never a stale one."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.jobs.indirect_references import direct
from benchmarks.jobs.references import has_radiosity, moved
from figures.claims.errors import FigureError
from figures.experiments import references
from figures.experiments.flatland import TEN
from figures.experiments.references import INDIRECT, Reference, digest, key_of, reference, save
from flatland2d import SCENES
from flatland2d.radiosity import render
from flatland2d.scenes import INSET
from restir_ref.transport import paths
from restir_ref.transport.paths import RECONNECTION, Tracer

every_scene = pytest.mark.parametrize("scene", SCENES)


@every_scene
def test_every_scene_has_a_reference_whose_mean_is_known_to_a_thousandth(scene) -> None:
    found = reference(scene)
    assert found.mean.shape == found.error.shape == (INSET,)
    assert (found.mean > 0).all()
    assert (found.error < 0.02 * found.mean).all()
    assert found.image_error < 1e-3 * found.mean.mean()


# ---------------------------------------------------------------- against today's code


def z_of_path_tracing(scene: str, count: int = 16, pixels: int = 4) -> float:
    """z of the mean of a few pixels, traced anew with `count` moved lattices."""
    setting, rng = SCENES[scene](), np.random.default_rng(3)
    t = Tracer(setting.scene, setting.pinhole(), setting.depth, RECONNECTION)
    pixel = np.arange(pixels) * (INSET // pixels) + 8
    means = np.array([moved(t, pixel, rng).mean() for _ in range(count)])
    truth = reference(scene)
    error = np.hypot(means.std(ddof=1) / np.sqrt(count), np.linalg.norm(truth.error[pixel]) / pixels)
    assert error < 0.03 * truth.mean[pixel].mean()
    return float((means.mean() - truth.mean[pixel].mean()) / error)


@every_scene
def test_path_tracing_finds_the_reference(scene) -> None:
    assert abs(z_of_path_tracing(scene)) < 4.5  # t of 15 degrees of freedom, 14 scenes: false alarm .6%


def test_light_counted_twice_is_noticed(monkeypatch) -> None:
    """A mistake: light sampling and BSDF samples both with full weight."""
    right = paths.ratio
    monkeypatch.setattr(paths, "ratio", lambda a, b: np.minimum(right(a, b) + 1, 1) if a.ndim == 1 else right(a, b))
    assert z_of_path_tracing("matte_cornell") > 8


@pytest.mark.parametrize("scene", [scene for scene in SCENES if has_radiosity(scene)])
def test_radiosity_is_the_reference_where_it_applies(scene) -> None:
    setting, found = SCENES[scene](), reference(scene)
    assert found.samples == 0
    image = render(setting.scene, setting.pinhole(), setting.depth, per_segment=30, film=4)
    assert image.mean() == pytest.approx(found.mean.mean(), rel=0.002)


# ---------------------------------------------------------------- indirect light


def unlike_all_light(scene: str, indirect) -> float:
    """Largest difference of a pixel of indirect light and direct light by quadrature from all light, over its mean."""
    truth = reference(scene).mean
    return float(np.abs(indirect + direct(SCENES[scene](), 512, 8) - truth).max() / truth.mean())


@pytest.mark.parametrize("scene", TEN)
def test_indirect_light_and_direct_light_by_quadrature_are_all_light(scene) -> None:
    found = reference(scene, INDIRECT)
    assert (found.mean > 0).all()
    assert found.image_error < 1e-3 * found.mean.mean()
    assert unlike_all_light(scene, found.mean) < 0.02


@pytest.mark.parametrize("scene", [scene for scene in TEN if scene not in ("ajar", "glass_disc")])
def test_direct_light_that_is_counted_twice_is_noticed(scene) -> None:
    """A mistake; behind the door and below the disc no light is direct."""
    assert unlike_all_light(scene, reference(scene).mean) > 0.2


# ---------------------------------------------------------------- never a stale one


def moved_corner(s):
    return replace(s, scene=replace(s.scene, corners=s.scene.corners + 1e-9))


def painted(s):
    table = s.scene.materials
    return replace(s, scene=replace(s.scene, materials=replace(table, colour=table.colour * 0.99)))


def polished(s):
    table = s.scene.materials
    return replace(s, scene=replace(s.scene, materials=replace(table, roughness=table.roughness * 0.99)))


CHANGES = {
    "a corner": moved_corner,
    "a colour": painted,
    "roughness": polished,
    "light": lambda s: replace(s, scene=replace(s.scene, emission=s.scene.emission * 2)),
    "a material": lambda s: replace(s, scene=replace(s.scene, material=1 - s.scene.material)),
    "the eye": lambda s: replace(s, eye=(s.eye[0] + 1e-9, s.eye[1])),
    "the inset": lambda s: replace(s, crop=s.crop + 1),
    "the field of view": lambda s: replace(s, half=0.61),
    "the depth": lambda s: replace(s, depth=s.depth + 1),
}


@pytest.mark.parametrize("change", CHANGES)
def test_a_changed_scene_has_no_reference_and_the_message_names_the_remedy(monkeypatch, change) -> None:
    right = SCENES["cornell"]()
    changed = CHANGES[change](right)
    monkeypatch.setattr(references, "setting", lambda name: changed)
    monkeypatch.setattr(references, "standard", lambda name: changed.pinhole())
    with pytest.raises(FigureError, match=r"'cornell' has changed.*make evidence ARGS=references"):
        reference("cornell")


def test_rounding_on_another_machine_changes_no_fingerprint() -> None:
    right = SCENES["many_lights"]()
    noise = 1 + 1e-15 * np.random.default_rng(1).choice([-1, 0, 1], right.scene.emission.shape)
    noisy = replace(right.scene, emission=right.scene.emission * noise)
    assert digest(noisy, right.pinhole(), right.depth) == digest(right.scene, right.pinhole(), right.depth)


def some(error: float) -> Reference:
    return Reference(np.ones(INSET), np.full(INSET, error), error, 1, "by hand")


def test_what_is_stored_comes_back_and_the_better_reference_stays(tmp_path) -> None:
    path = tmp_path / "references.npz"
    save({"cornell": some(0.1)}, path)
    save({"ajar": some(0.2), "cornell": some(0.3)}, path)
    assert reference("ajar", path=path).error[0] == 0.2
    assert reference("cornell", path=path).image_error == 0.1
    assert reference("cornell", path=path).how == "by hand"


def test_references_of_both_lights_are_apart(tmp_path) -> None:
    path = tmp_path / "references.npz"
    save({"cornell": some(0.1), key_of("cornell", INDIRECT): some(0.3)}, path)
    assert reference("cornell", path=path).image_error == 0.1
    assert reference("cornell", INDIRECT, path).image_error == 0.3
    with pytest.raises(FigureError, match=r"no reference of the scene 'ajar', indirect.*'indirect references'"):
        reference("ajar", INDIRECT, path)


def test_a_missing_reference_and_a_damaged_file_are_told_apart(tmp_path) -> None:
    path = tmp_path / "references.npz"
    with pytest.raises(FigureError, match=r"no reference of the scene 'cornell'.*make evidence"):
        reference("cornell", path=path)
    save({"cornell": some(0.1)}, path)
    path.write_bytes(path.read_bytes()[:-40])
    with pytest.raises(FigureError, match="cannot be used"):
        reference("cornell", path=path)

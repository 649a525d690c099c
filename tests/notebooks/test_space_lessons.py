"""Laws of what the notebook of space shows, without any notebook."""

import numpy as np
import pytest

from figures.claims.criteria import Void
from figures.claims.figure import verdict_of
from figures.experiments import offline, solid
from notebooks import in_space as lesson
from restir_ref.metrics import rel_mse
from tracer3d import SCENES
from tracer3d.scenes import INSET

MINE = """
camera = { position = [0, 0.6, 2.2], target = [0, 0.35, 0], field_of_view = 45 }
material.chalk.lobes = [{ kind = "lambert", colour = 0.6 }]
rectangle = [{ corners = [[-2, 0, 1], [2, 0, 1], [2, 0, -1], [-2, 0, -1]], material = "chalk" }]
light = [{ corners = [[0, 2, -0.4], [0.8, 2, -0.4], [0.8, 2, 0.4]], emission = 12, material = "chalk" }]
"""


@pytest.mark.parametrize("side", [2, 8, 32, INSET])
def test_an_inset_is_the_middle_of_the_standard_one(side):
    setting = SCENES["cornell"]()
    camera, standard = lesson.inset(setting, side), setting.pinhole()
    assert (camera.n, camera.left - standard.left) == (side**2, (INSET - side) / 2)
    assert 2 * camera.top + camera.height == 2 * standard.top + standard.height


# ---------------------------------------------------------------- a moving camera


def bias(images) -> tuple[float, float]:
    """Mean over all frames minus that of path tracing, and four standard errors, relative."""
    truth = lesson.by_paths(SCENES["crease"](), lesson.inset(SCENES["crease"](), lesson.CROP), 64).mean()
    each = images.mean(axis=(0, 2)) / truth - 1
    return float(each.mean()), float(4 * each.std(ddof=1) / np.sqrt(len(each)))


@pytest.mark.parametrize("history", lesson.HISTORY)
def test_history_from_any_pixel_is_unbiased(history):
    found, error = bias(lesson.film("crease", history))
    assert abs(found) < error < 0.15


def test_frames_that_are_too_bright_are_noticed():
    found, error = bias(1.2 * lesson.film("crease", "motion vectors"))
    assert found > error


# ---------------------------------------------------------------- a scene of one's own


def test_a_scene_of_a_text_is_as_deep_and_bright_as_it_says():
    setting = lesson.opened(MINE)
    assert setting.depth == 4
    assert setting.scene.emission.max() == 12
    assert lesson.complaint(MINE) == ""


@pytest.mark.parametrize(
    ("right", "wrong", "said"),
    [
        ("lambert", "lambort", "mine.toml, [material.chalk], lobe 1: "),
        ("field_of_view", "field_of_vew", "mine.toml, [camera]: there is no key 'field_of_vew'"),
        ("= 12", "= ", "mine.toml is no TOML: "),
    ],
)
def test_what_is_wrong_in_a_text_is_told_with_its_place(right, wrong, said):
    assert lesson.complaint(MINE.replace(right, wrong)).startswith(said)


# ---------------------------------------------------------------- when reuse pays, and a claim


def test_four_trees_tell_what_others_do_to_a_neighbourhood():
    found = lesson.pays("crease", 3)
    predicted = np.array([found.split.with_reuse(M)[0] for M in lesson.TREES])
    np.testing.assert_allclose(found.reused, predicted, rtol=0.25)


def test_without_the_noise_of_choosing_the_prediction_is_wrong():
    found = lesson.pays("crease", 3)
    assert found.reused[-1] > 2 * found.split.Q[0] / lesson.TREES[-1]


def test_numbers_have_two_digits():
    assert [lesson.rounded(x) for x in (0.9432, 10.14, 2187.3)] == ["0.94", "10", "2200"]


def test_a_claim_is_reproduced_by_half_the_error_and_refuted_by_twice():
    error = 1 + 0.1 * np.random.default_rng(1).random((2, 12))
    assert verdict_of(lesson.claim(0.5 * error[0], error[1])) == "reproduced"
    assert verdict_of(lesson.claim(2.0 * error[0], error[1])) == "refuted"
    assert verdict_of(lesson.claim(error[0], error[1])) == "not reproduced"


def test_on_rough_boxes_both_shifts_make_the_same_images_and_the_claim_refuses():
    scene, rng = "CB3, box", np.random.default_rng
    inset = solid.inset(scene, 3)
    images = [offline.render(offline.METHODS[s], scene, 8, rng(1), inset)["images"] for s in ("hybrid", "reconnection")]
    assert (images[0] > 0).any()
    with pytest.raises(Void):
        lesson.claim(*(rel_mse(each, np.ones(inset.n)) for each in images))

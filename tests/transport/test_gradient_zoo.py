"""Mistakes about differences are off as their words say, exactly; each has its name, and the right code has none."""

import re
from dataclasses import replace

import numpy as np
import pytest

from restir_ref.gradient import TossedPairs
from restir_ref.integrals import pdf
from restir_ref.transport.edges import edges
from restir_ref.transport.proofs.zoo import areas, gradients, pairs
from restir_ref.transport.proofs.zoo.bug import ModelBug
from restir_ref.transport.proofs.zoo.cures import GRADIENT_CURES
from restir_ref.transport.proofs.zoo.gradients import GRADIENT_BUGS, named

EVERY = pytest.mark.parametrize("name", GRADIENT_BUGS)
UP, DOWN = {"bright", "strong", "marked"}, {"dark", "weak", "missed"}


def said(symptom: str) -> set[int]:
    """The signs that a symptom tells of."""
    words = set(re.findall(r"\b(?:bright|strong|marked|dark|weak|missed)\b", symptom))
    return {sign for sign, those in ((1, UP), (-1, DOWN)) if words & those}


def signs(off: np.ndarray) -> set[int]:
    return {sign for sign in (1, -1) if (sign * off).max() > 1e-9}


def poor_words(bug: ModelBug) -> list[str]:
    """What a bug's description lacks, or says against its own numbers."""
    found = [] if said(bug.symptom) == signs(bug.wrong()) else [f"says {said(bug.symptom)} of {signs(bug.wrong())}"]
    found += [] if re.fullmatch(r"\[GPT [^]]*\]", bug.breaks) else ["breaks no equation"]
    return found + [f"tells no {what}" for what in ("story", "symptom") if len(getattr(bug, what)) < 25]


@EVERY
def test_a_mistake_about_differences_is_off_and_what_it_replaces_is_not(name) -> None:
    bug = GRADIENT_BUGS[name]
    right, wrong = bug.right(), bug.wrong()
    assert right.shape == wrong.shape
    assert right.ndim == 2
    assert abs(right).max() < 1e-12
    assert abs(wrong).max() > 0.01


@EVERY
def test_a_mistake_about_differences_is_named_by_its_table_and_the_right_code_is_acquitted(name) -> None:
    bug = GRADIENT_BUGS[name]
    assert named(bug.wrong()) == (name,)
    assert named(bug.right()) == ()


def test_a_table_that_is_a_little_other_is_none_of_a_known_mistake() -> None:
    assert named(1.001 * GRADIENT_BUGS["probability of the side left out"].wrong()) == ()


@EVERY
def test_a_mistake_about_differences_says_what_it_looks_like(name) -> None:
    assert poor_words(GRADIENT_BUGS[name]) == []


@pytest.mark.parametrize(("part", "words"), [("symptom", "strong"), ("breaks", "[Eq. 3]"), ("story", "oops")])
def test_poor_words_are_noticed(part, words) -> None:
    assert poor_words(replace(GRADIENT_BUGS["dark base paths thrown away"], **{part: words}))


def test_every_mistake_about_differences_has_a_cure() -> None:
    assert set(GRADIENT_CURES) == set(GRADIENT_BUGS)


# ---------------------------------------------------------------- what is known of single ones


@pytest.mark.claims("GPT-E03", part="the control, as a member of the zoo")
def test_half_weights_lose_half_of_what_has_no_offset_path() -> None:
    """Cell 2 of pixel 0 and cell 1 of pixel 1 have no partner in the pair (0, 1), nor cells 1 and 2 in (1, 2)."""
    v, f, I = (pairs.falling().now.cells.v, pairs.falling().now.cells.f, pairs.means(pairs.falling()))
    alone = np.array([[f[0, 2] * v[0, 2] - f[1, 1] * v[1, 1], f[1, 1] * v[1, 1] - f[2, 2] * v[2, 2]]])
    expected = -alone / 2 / (I[:2] - I[1:])
    assert pairs.bias_of_pairs(pairs.HalfWeights) == pytest.approx(expected, rel=1e-9)


@pytest.mark.claims("GPT-E02", part="the control, as a member of the zoo")
def test_one_integral_leaves_out_what_only_the_other_pixel_sees() -> None:
    v, f, I = (pairs.falling().now.cells.v, pairs.falling().now.cells.f, pairs.means(pairs.falling()))
    unseen = np.array([[f[1, 1] * v[1, 1], f[2, 2] * v[2, 2]]])
    assert pairs.bias_of_pairs(pairs.OneIntegral) == pytest.approx(unseen / (I[:2] - I[1:]), rel=1e-9)


@pytest.mark.claims("GPT-E04z", part="the control, as a member of the zoo")
def test_dark_base_paths_may_be_thrown_away_beside_weights_of_targets() -> None:
    assert abs(pairs.bias_of_pairs(pairs.Sieved)).max() < 1e-12
    assert abs(pairs.bias_of_pairs(pairs.Sieved, pdf)).max() > 0.1


@pytest.mark.claims("GPT-E14", part="the control, as a member of the zoo")
def test_without_the_probability_of_the_side_all_differences_are_halves() -> None:
    assert pairs.bias_of_pairs(pairs.Forgetful) == pytest.approx(-0.5, rel=1e-12)
    assert abs(pairs.bias_of_pairs(TossedPairs)).max() < 1e-12


@pytest.mark.claims("GPT-E18", "GPT-E22", part="the controls, as members of the zoo")
@pytest.mark.parametrize(
    "wrong", [{"merge": pairs.shifted_once_more}, {"kind": pairs.InnerJacobian}, {"kind": pairs.NotRebuilt}]
)
def test_what_is_wrong_about_the_outer_shift_shows_in_reuse_only(wrong) -> None:
    def alone(inputs, here, chance):
        return inputs[0].X

    without = {key: value for key, value in wrong.items() if key == "kind"}
    assert abs(pairs.bias_of_pairs(**without, merge=alone)).max() < 1e-12
    assert abs(pairs.bias_of_pairs(**wrong)).max() > 0.01


@pytest.mark.claims("GPT-E24", part="the control, as a member of the zoo")
def test_added_magnitudes_are_right_where_there_is_no_negative_part() -> None:
    assert (pairs.bias_of_pairs(together=pairs.magnitudes_added) > 0.1).all()
    assert abs(pairs.bias_of_pairs(together=lambda plus, minus: plus + minus)).max() < 1e-12


@pytest.mark.claims("GPT-A05", part="the controls, as members of the zoo")
def test_shares_of_the_area_left_out_of_weights_and_counts_alike_are_no_bias() -> None:
    """Confidences may be any numbers that know no samples; what is wrong then is how long history is believed."""
    assert abs(areas.bias_of_history(share=areas.no_share)).max() < 1e-12
    assert areas.bias_of_history(share=areas.share_of_weight).min() < -0.1


@pytest.mark.claims("GPT-A05", part="the controls, as members of the zoo")
@pytest.mark.parametrize("kind", [areas.IgnoredOneWay, areas.DrawnAnew])
def test_what_is_wrong_about_places_shows_under_motion_by_fractions_only(kind, monkeypatch) -> None:
    assert abs(areas.bias_of_history(kind)).max() > 0.1
    monkeypatch.setattr(areas, "HALVES", np.zeros((1, 2)))
    assert abs(areas.bias_of_history()).max() < 1e-12
    still = abs(areas.bias_of_history(areas.IgnoredOneWay)).max()
    assert still < 1e-12


@pytest.mark.claims("GPT-A06", part="the control, as a member of the zoo")
def test_the_printed_test_of_normals_marks_every_flat_pair_and_misses_the_crease() -> None:
    """On five flat pairs, a step of albedo, one of depth, and a crease that nothing else shows."""
    found = gradients.marked(gradients.normals_as_printed)[0]
    assert found[~gradients.EDGES].tolist() == [1.0] * 5
    assert found[gradients.EDGES].tolist() == [0.0, 0.0, -1.0]
    assert (gradients.marked(edges) == 0).all()

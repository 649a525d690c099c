"""The mistakes about caches are biased as their words say, exactly, and what they replace is not."""

import re
from dataclasses import replace

import numpy as np
import pytest

from restir_ref.transport.proofs.zoo.cached import (
    CACHE_BUGS,
    G_MAX,
    ModelBug,
    crease,
    in_a_furnace,
    operator,
    second_vertex,
)
from restir_ref.transport.proofs.zoo.cures import CACHE_CURES

EVERY = pytest.mark.parametrize("name", CACHE_BUGS)


def signs(bias: np.ndarray) -> set[str]:
    """What a bias does."""
    return {word for word, there in (("dark", bias.min() < -1e-9), ("bright", bias.max() > 1e-9)) if there}


def poor_words(bug: ModelBug) -> list[str]:
    """What a bug's description lacks, or says against its own numbers."""
    said = set(re.findall("dark|bright", bug.symptom))
    found = [] if said == signs(bug.wrong()) else [f"says {sorted(said)} of {sorted(signs(bug.wrong()))}"]
    found += [] if re.fullmatch(r"\[DDGIR [^]]*\]", bug.breaks) else ["breaks no equation"]
    return found + [f"tells no {what}" for what in ("story", "symptom") if len(getattr(bug, what)) < 25]


@EVERY
def test_a_mistake_about_caches_is_biased_and_what_it_replaces_is_not(name) -> None:
    bug = CACHE_BUGS[name]
    right, wrong = bug.right(), bug.wrong()
    assert right.shape == wrong.shape
    assert right.ndim == 2
    assert abs(right).max() < 1e-12
    assert abs(wrong).max() > 0.02


@EVERY
def test_a_mistake_about_caches_says_what_it_looks_like(name) -> None:
    assert poor_words(CACHE_BUGS[name]) == []


@pytest.mark.parametrize(("part", "words"), [("symptom", "bright"), ("breaks", "[Eq. 3]"), ("story", "oops")])
def test_poor_words_are_noticed(part, words) -> None:
    assert poor_words(replace(CACHE_BUGS["no residual beside bounded geometry"], **{part: words}))


def test_every_mistake_about_caches_has_a_cure() -> None:
    assert set(CACHE_CURES) == set(CACHE_BUGS)


@pytest.mark.claims("DDGIR-E06", part="the printed constant, as a member of the zoo")
def test_the_printed_constant_halves_reflections_in_space_and_leaves_1_over_pi_of_them_in_flatland() -> None:
    (flat, space), *_ = CACHE_BUGS["constant of the glossy term as printed"].wrong()
    assert (flat, space) == pytest.approx((1 / np.pi - 1, -0.5))
    assert (in_a_furnace(lambda E, d: E) > 0.9).all()


@pytest.mark.claims("DDGIR-C01", part="an operator", world="flatland2d")
def test_probes_of_the_older_rule_lose_what_reaches_the_second_vertex_directly() -> None:
    """(L - ours) / L = T T L_e / L."""
    T, L_e = operator()
    L = np.linalg.solve(np.eye(12) - T, L_e)
    found = CACHE_BUGS["probes without direct light at the second vertex"].wrong()
    np.testing.assert_allclose(found[0], -(T @ T @ L_e) / L, rtol=1e-9)


def test_without_iterating_not_even_the_right_rule_is_right() -> None:
    rule = CACHE_BUGS["probes without direct light at the second vertex"].right.args[0]
    assert second_vertex(rule, times=1).min() < -0.1


@pytest.mark.claims("DDGIR-E09", part="the residual, point by point")
def test_the_residual_is_what_the_bound_leaves_out_of_every_point() -> None:
    assert abs(crease(1.0)).max() < 1e-15
    assert (crease(0.0) <= 0).all()
    assert (crease(0.0) == 0).any()
    assert (crease(2.0) >= 0).all()
    assert G_MAX > 0

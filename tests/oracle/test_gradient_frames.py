"""What a gradient renderer's step counts: every part's rounds, neighbours, partners and replicas, by its confidence.

Every input brings a confidence of 1 for each sample that it stands for, so that confidences count who was asked.
"""

from dataclasses import replace

import numpy as np
import pytest

from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.gradient_loop import (
    ACROSS_SIGNS,
    PRIMAL,
    SAME_SIGN,
    UNSIGNED,
    GradientPreset,
    Group,
    History,
    Partners,
    View,
    in_space,
    in_time,
    pairs_of,
    step,
)
from restir_ref.loop import Preset
from restir_ref.oracle.film import film_scene
from tests.oracle.test_area import ring

N = 4
RING = np.stack([(np.arange(N) + 1) % N, np.arange(N)])
STILL = np.zeros((1, N))
EVERYBODY = np.ones(N, dtype=bool)


def two_groups(partners: Partners, t: int = 0) -> View:
    """Four pixels, and the four pairs around them, of a frame."""
    frame = film_scene(1, N).frames[t]
    groups = {PRIMAL: {PRIMAL: frame}, "ring": pairs_of(frame, RING, partners)}
    return {name: Group(of, (N,), STILL, ring, EVERYBODY) for name, of in groups.items()}


def counted(preset: GradientPreset, replicas: int = 1, last: tuple[View, History] | None = None) -> dict[str, Array]:
    """The confidences of the first part of pixels and of pairs after a step."""
    found = step(two_groups(preset.partners), Live(np.random.default_rng(1)), preset, replicas, last)
    return {name: next(iter(parts.values())).c for name, parts in found.items()}


PARTNERS = {"same sign": (SAME_SIGN, 1), "across signs": (ACROSS_SIGNS, 2), "unsigned": (UNSIGNED, 1)}
"""Who reuses from whom, and how many parts' reservoirs each part reuses."""


def unequal(rounds: int, partners: Partners = SAME_SIGN) -> GradientPreset:
    """Pixels reuse from two neighbours so many times, pairs from one once more often."""
    pixels, pairs = (Preset(trees=1, rounds=rounds + more, neighbours=2 - more, radius=1, cap=3.0) for more in (0, 1))
    return GradientPreset(pixels, pairs, partners)


@pytest.mark.parametrize("rounds", [0, 1, 2])
def test_pixels_and_pairs_reuse_each_as_often_and_from_as_many_as_their_own_preset_says(rounds) -> None:
    found = counted(unequal(rounds))
    assert (found[PRIMAL] == 3**rounds).all()
    assert (found["ring"] == 2 ** (rounds + 1)).all()


@pytest.mark.claims("GPT-A09", part="whose reservoirs are asked")
@pytest.mark.parametrize(("partners", "parts"), PARTNERS.values(), ids=PARTNERS)
def test_a_partner_of_the_other_sign_is_asked_at_the_pair_itself_as_well(partners, parts) -> None:
    """One neighbour and the pair itself, in as many parts as are partners; each part's own sample counts once."""
    assert (counted(unequal(0, partners))["ring"] == 2 * parts).all()


@pytest.mark.parametrize(("partners", "parts"), PARTNERS.values(), ids=PARTNERS)
def test_history_of_every_partner_is_added_up_to_its_cap(partners, parts) -> None:
    preset = unequal(0, partners)
    preset = replace(preset, pairs=replace(preset.pairs, rounds=0))
    view = two_groups(partners, 1)
    chance = Live(np.random.default_rng(2))
    last = step(view, chance, preset)
    old = {name: {part: replace(X, c=7.0 * X.c) for part, X in group.items()} for name, group in last.items()}
    for history, count in ((last, 1), (old, 3)):
        found = counted(preset, last=(view, history))
        assert (found[PRIMAL] == 1 + count).all()
        assert (found["ring"] == 1 + count * parts).all()


@pytest.mark.parametrize("replicas", [1, 3])
def test_a_step_has_a_column_for_every_pixel_and_pair_of_every_replica(replicas) -> None:
    assert {len(c) for c in counted(unequal(1), replicas).values()} == {replicas * N}


def test_a_step_has_one_replica_unless_told_otherwise() -> None:
    preset = unequal(1)
    found = step(two_groups(SAME_SIGN), Live(np.random.default_rng(1)), preset)
    assert {len(X.W) for parts in found.values() for X in parts.values()} == {N}


def test_reuse_in_space_changes_none_of_the_reservoirs_it_reads() -> None:
    """Else the second sign would read what the first one has become."""
    view, chance, preset = two_groups(ACROSS_SIGNS), Live(np.random.default_rng(1)), unequal(0, ACROSS_SIGNS)
    read = step(view, chance, replace(preset, pairs=replace(preset.pairs, rounds=0)))["ring"]
    before = dict(read)
    found = in_space(view["ring"], read, preset.pairs, ACROSS_SIGNS, chance)
    assert all(read[part] is X for part, X in before.items())
    assert not any(found[part] is X for part, X in before.items())


# ---------------------------------------------------------------- history of the same places


def pixels_of(shape, n: int = N) -> Group:
    return Group({PRIMAL: film_scene(0, n).now}, shape, np.zeros((len(shape), n)), ring, np.ones(n, dtype=bool))


def confidence_after(now: Group, before: Group) -> Array:
    """Of pixels after temporal reuse alone."""
    chance, preset = Live(np.random.default_rng(1)), GradientPreset(Preset(1, 0, 1, 1, 3.0), Preset(1, 0, 1, 1, 3.0))
    X, Y = (step({PRIMAL: each}, chance, preset)[PRIMAL] for each in (now, before))
    return in_time(now, X, (before, Y), preset.pixels, {PRIMAL: (PRIMAL,)}, chance)[PRIMAL].c


def test_history_is_that_of_as_many_images_of_the_same_shape() -> None:
    for shape in ((4,), (2, 2), (2,), [4], [2, 2]):
        for same in (tuple(shape), [*shape]):
            assert (confidence_after(pixels_of(shape), pixels_of(same)) == 2).all()


@pytest.mark.parametrize(
    "before", [pixels_of((2, 2)), pixels_of((2,)), pixels_of((4,), 8)], ids=["folded", "in two crops", "of two crops"]
)
def test_history_of_as_many_pixels_in_another_shape_and_of_another_number_of_images_is_refused(before) -> None:
    with pytest.raises(ValueError, match="has no places for 4 of shape"):
        confidence_after(pixels_of((4,)), before)

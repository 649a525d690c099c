"""What sees a wrong shift: round trips, re-tracing, finite differences, the change of variables, pixels, or the mean.

For right shifts, and all functions h of paths y of pixel j,

    E_x[p_hat_j(Tx) J W h(Tx)] = E_y[p_hat_j(y) W 1{T^-1 y defined} h(y)].

h is Talbot's weight of x against y, which keeps both sides bounded, in bins of J, reconnection index and technique.
"""

import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from restir_ref.batch import Array, ratio, take
from restir_ref.chance import Live
from restir_ref.integrals import Pixels, shifted
from restir_ref.loop import random_in_row
from restir_ref.restir import initial
from restir_ref.transport.paths import Path
from restir_ref.transport.proofs.zoo import TRANSPORT_BUGS, WRONG_SHIFTS, TransportBug
from restir_ref.transport.proofs.zoo.bug import CHECKS as ZOO_CHECKS
from restir_ref.transport.proofs.zoo.domains import Loosened
from restir_ref.transport.restir_pt import PathIntegrals
from tests.flatland.renderings import REACH, bias, frames, images, last, paired, spread
from tests.transport.paths import Shifts, finite_difference_jacobian, retraced

REPLICAS = 1000
EDGE_CASES = 1e-3
"""Share of paths that floating point may decide differently there and back."""

# ---------------------------------------------------------------- the change of variables

STEPS = (1 / 1.3, 1, 1.3)
"""Bins of J."""
SIGMAS = 4.5
"""About 30 bins: right shifts exceed it once in 5000 times."""


def kinds(y: Path, J: Array) -> Array:
    """A number for the bin of each path: J, reconnection index, length, technique; (N,)."""
    return ((np.digitize(J, STEPS) * 8 + y.c) * 8 + y.k) * 2 + y.nee


def sides(of: PathIntegrals, seed: int) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """Values (N,) and bins (N,) of both sides of the identity, from independent initial samples of pixels i and j."""
    chance = Live(np.random.default_rng(seed))
    here = Pixels(of, np.arange(of.n * REPLICAS))
    (there,) = random_in_row(of, here.index, 1, REACH, chance)
    X, Y = (initial(Pixels(PathIntegrals(of.tracer), at.index), chance) for at in (here, there))
    y, back = shifted(X.x, here, there), shifted(Y.x, there, here)
    forth = harmonic(of.target(here.index, X.x), of.target(there.index, y.x) * y.J) * X.W
    found = harmonic(of.target(there.index, Y.x), of.target(here.index, back.x) * back.J) * Y.W
    return (forth, kinds(y.x, y.J)), (found, kinds(Y.x, ratio(np.ones(1), back.J)))


def harmonic(p: Array, q: Array) -> Array:
    """p q / (p + q)."""
    return ratio(p * q, p + q)


def z_scores(of: PathIntegrals, seed: int) -> Array:
    """z of the difference in every bin with at least 30 values on one side."""
    (a, kind_a), (b, kind_b) = sides(of, seed)
    found = []
    for kind in np.unique(np.concatenate([kind_a[a > 0], kind_b[b > 0]])):
        left, right = a * (kind_a == kind), b * (kind_b == kind)
        if max((left > 0).sum(), (right > 0).sum()) >= 30:
            found.append((left.mean() - right.mean()) / np.sqrt((left.var() + right.var()) / len(left)))
    assert b.std() / np.sqrt(len(b)) < 0.02 * b.mean()
    return np.array(found)


# ---------------------------------------------------------------- path by path


def tried(of: PathIntegrals, N: int, seed: int) -> Shifts:
    """Shifts of initial samples of random pixels that succeeded."""
    chance = Live(np.random.default_rng(seed))
    i = np.arange(N) % of.n
    (there,) = random_in_row(of, i, 1, REACH, chance)
    X = initial(Pixels(PathIntegrals(of.tracer), i), chance)
    y = shifted(X.x, Pixels(of, i), there)
    there_at_all = (y.J > 0) & (y.x.A > 1e-12 * X.x.A)  # else J = 0 but for rounding: two points of one facet
    good = np.flatnonzero(there_at_all & y.x.F.any(axis=0) & X.x.F.any(axis=0))
    return Shifts(of.tracer, take(X.x, good), i[good], take(y.x, good), there.index[good], y.J[good])


def returns(of: PathIntegrals, seed: int) -> bool:
    """Whether the way back exists, has the inverse Jacobian, and ends at the base path."""
    s = tried(of, 20_000, seed)
    back = of.shift(s.y, s.j, Pixels(of, s.i))
    same = np.abs(back.J * s.J - 1) < 1e-6
    same &= (np.abs(back.x.F - s.x.F) <= 1e-6 * s.x.F).all(axis=0)
    return bool((~same).mean() <= EDGE_CASES)


def is_traced(of: PathIntegrals, seed: int) -> bool:
    """Whether tracing u^y from scratch finds the offset path, with what it carries, and where it reconnects."""
    s = tried(of, 20_000, seed)
    _, y = retraced(s)
    same = (np.abs(y.F - s.y.F) <= 1e-6 * s.y.F).all(axis=0) & (y.c == s.y.c)
    return bool((~same).mean() <= EDGE_CASES)


def has_its_jacobian(of: PathIntegrals, seed: int) -> bool:
    """Whether J is the determinant that finite differences of u^y give."""
    s = tried(of, 4000, seed)
    through = np.flatnonzero((s.x.c > 0) & (s.x.c < s.x.k))[:100]
    s = Shifts(s.t, take(s.x, through), s.i[through], take(s.y, through), s.j[through], s.J[through])
    measured, decided = finite_difference_jacobian(s)
    return bool((np.abs(measured / s.J - 1)[decided] > 1e-4).mean() < 0.05)


# ---------------------------------------------------------------- renderings


@cache
def rendered(of: PathIntegrals, seed: int) -> tuple[float, float]:
    """Spread of the pixels' z-scores after two rounds of spatial reuse, and z of the image's mean."""
    image = paired(last(frames([of], REPLICAS, Live(np.random.default_rng(seed)), ("spatial", "spatial"))))
    return spread(image.added), bias(image.added, image.initial).z


LARGEST_SPREAD = 1.5
"""Of 32 z-scores; about 1e-4 of independent normal ones are spread wider."""

TESTS = {
    "round trip": lambda of: returns(of, 1),
    "re-tracing": lambda of: is_traced(of, 2),
    "finite differences": lambda of: has_its_jacobian(of, 3),
    "change of variables": lambda of: np.abs(z_scores(of, 4)).max() < SIGMAS,
    "spread over pixels": lambda of: rendered(of, 5)[0] < LARGEST_SPREAD,
    "mean of the image": lambda of: abs(rendered(of, 5)[1]) < 5,
}


RENDERED = ("spread over pixels", "mean of the image")


def red(of: PathIntegrals) -> tuple[str, ...]:
    """The checks that speak."""
    return tuple(name for name, silent in TESTS.items() if not silent(of))


# ---------------------------------------------------------------- who sees what

POSTS, COAT, GLOSSY, HYBRID = (
    ("occluders", "reconnection"),
    ("clear_coat", "reconnection"),
    ("glossy_cornell", "reconnection"),
    ("glossy_cornell", "hybrid"),
)
SHOWN_IN = {
    "geometric Jacobian left out": POSTS,
    "inverted path Jacobian": POSTS,
    "distance to the power of another dimension": POSTS,
    "distances swapped": POSTS,
    "cosines left out of the Jacobian": POSTS,
    "lobe probability left out of the Jacobian": COAT,
    "second density ratio left out": GLOSSY,
    "light density of the base path kept": POSTS,
    "MIS weight of the base path kept": COAT,
    "BSDF beyond the connection kept": ("distant_caustic", "reconnection"),
    "no test for an earlier connection": HYBRID,
    "connection tested for the base path only": HYBRID,
    "connection through walls": POSTS,
    "large Jacobians refused one way": POSTS,
    "path taken over as it is": POSTS,
}


@pytest.mark.parametrize(("scene", "rule"), sorted(set(SHOWN_IN.values())))
def test_every_check_is_silent_about_the_right_shift(scene, rule) -> None:
    assert red(images(scene, rule)) == ()


CONTROLS = [
    pytest.param("inverted path Jacobian", marks=pytest.mark.claims("GRIS-E35")),
    pytest.param("distance to the power of another dimension", marks=pytest.mark.claims("GRIS-E52")),
    pytest.param("second density ratio left out", marks=pytest.mark.claims("GRIS-E54")),
    pytest.param("no test for an earlier connection", marks=pytest.mark.claims("GRIS-A11")),
    pytest.param("large Jacobians refused one way", marks=pytest.mark.claims("GRIS-C18")),
]
OTHERS = sorted(set(SHOWN_IN) - {each.values[0] for each in CONTROLS})


@pytest.mark.parametrize("name", [*CONTROLS, *OTHERS])
def test_a_wrong_shift_is_seen_by_these_checks_and_no_others(name) -> None:
    bug = TRANSPORT_BUGS[name]
    assert red(bug.wrong(images(*SHOWN_IN[name]).tracer)) == bug.caught_by


@pytest.mark.claims("GRIS-A15")
def test_a_target_without_visibility_is_seen_in_pixels_and_in_the_mean() -> None:
    bug = TRANSPORT_BUGS["target without visibility"]
    of = bug.wrong(images(*POSTS).tracer)
    assert tuple(name for name in RENDERED if not TESTS[name](of)) == bug.caught_by


def test_pixels_err_by_tens_of_percent_where_the_image_s_mean_hardly_moves() -> None:
    of = TRANSPORT_BUGS["geometric Jacobian left out"].wrong(images(*POSTS).tracer)
    image = paired(last(frames([of], REPLICAS, Live(np.random.default_rng(6)), ("spatial", "spatial"))))
    error = image.added.mean(axis=0) / image.initial.mean(axis=0)
    assert error.min() < -0.15
    assert error.max() > 0.1
    assert abs(error.mean()) < 0.01


# ---------------------------------------------------------------- the zoo's words


def poor_words(bug: TransportBug) -> list[str]:
    """What a bug's description lacks."""
    found = [] if re.fullmatch(r"\[GRIS [^]]*\]", bug.breaks) else ["breaks no equation"]
    found += [] if re.search("dark|bright|noise|fireflies", bug.symptom) else ["says no sign"]
    found += [] if bug.caught_by and set(bug.caught_by) <= set(ZOO_CHECKS) else ["is caught by no check there is"]
    return found + [f"tells no {what}" for what in ("story", "symptom") if len(getattr(bug, what)) < 25]


@pytest.mark.parametrize("name", TRANSPORT_BUGS)
def test_a_transport_bug_says_how_it_gets_in_what_it_looks_like_and_who_sees_it(name) -> None:
    assert poor_words(TRANSPORT_BUGS[name]) == []


@pytest.mark.parametrize(
    "change", [{"breaks": "[Eq. 3]"}, {"story": "oops"}, {"symptom": "it looks wrong somehow to me"}, {"caught_by": ()}]
)
def test_poor_words_are_noticed(change) -> None:
    assert poor_words(replace(TRANSPORT_BUGS["distances swapped"], **change))


def test_every_transport_bug_is_demonstrated() -> None:
    elsewhere = {"target without visibility", "history rated with the current camera"}
    assert set(SHOWN_IN) | elsewhere == set(TRANSPORT_BUGS)
    assert set(WRONG_SHIFTS) <= set(SHOWN_IN)


@pytest.mark.parametrize("kind", ["reconnection", "hybrid"])
def test_with_nothing_loosened_the_shift_is_the_right_one(kind) -> None:
    """The twin of `Loosened` bugs: what they replay and reconnect by themselves is else the shift, to the last bit."""
    of = images("glass_disc", kind)
    index = np.arange(3200)
    X, there = initial(Pixels(of, index), Live(np.random.default_rng(7))), Pixels(of, index ^ 1)
    found, expected = Loosened(of.tracer).shift(X.x, index, there), of.shift(X.x, index, there)
    assert (found.J == expected.J).all()
    assert (found.x.F == expected.x.F).all()

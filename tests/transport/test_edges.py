"""Edges by G-buffer: each criterion speaks alone, past its threshold and not before, in the first pixel's scale."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from flatland2d import PLANE
from restir_ref.batch import Array
from restir_ref.transport.edges import THRESHOLDS, TRIES, Seen, edges, like_pairs, seen
from restir_ref.transport.materials import Layer, Material
from restir_ref.transport.scene import Facet, scene

COLOUR, COSINE, DEPTH = THRESHOLDS
TURN = np.arccos(COSINE)
HAIR = 1e-9
NEIGHBOURS = np.array([[0], [1]])


def beside(albedo: float = 0.0, turn: float = 0.0, depth: float = 0.0, t: float = 2.0) -> Seen:
    """Two pixels; the second one differs from the first by so much, in depth by a share of the first one's."""
    a = np.array([0.7, 0.7 + turn])
    return Seen(np.array([0.6, 0.6 + albedo]), np.stack([np.cos(a), np.sin(a)]), np.array([t, t + depth * t]))


def is_edge(g: Seen) -> bool:
    return bool(edges(g, NEIGHBOURS)[0])


PAST = {"albedo": COLOUR, "turn": TURN, "depth": DEPTH}
"""By how much the second pixel may differ, in each way by itself."""


@pytest.mark.claims("GPT-A06")
@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("way", PAST)
def test_each_difference_alone_makes_an_edge_past_its_threshold_and_not_before(way, sign) -> None:
    assert is_edge(beside(**{way: sign * (PAST[way] + HAIR)}))
    assert not is_edge(beside(**{way: sign * (PAST[way] - HAIR)}))


def test_differences_do_not_add_up_to_an_edge() -> None:
    assert not is_edge(beside(**{way: most - HAIR for way, most in PAST.items()}))


def test_the_thresholds_are_those_of_the_paper() -> None:
    """[GPT 4.3.2]: albedos .1 apart, normals with a cosine below .9, depths apart by a tenth of the first one's; N."""
    assert THRESHOLDS == (0.1, 0.9, 0.1)
    assert TRIES == 256


def test_what_differs_by_just_the_threshold_is_no_edge() -> None:
    """The paper's signs are > .1, < .9 and > .1; here all three hold as equations, without rounding."""
    turned = np.array([[1.0, COSINE], [0.0, np.sqrt(1 - COSINE**2)]])
    assert not is_edge(Seen(np.array([0.0, COLOUR]), turned, np.array([10.0, 11.0])))


@pytest.mark.parametrize("size", [0.01, 100.0])
def test_an_edge_does_not_depend_on_the_size_of_the_scene(size) -> None:
    for depth in (DEPTH - HAIR, DEPTH + HAIR):
        assert is_edge(beside(depth=depth, t=size)) == is_edge(beside(depth=depth))


def test_depths_are_compared_in_the_scale_of_the_first_end() -> None:
    g = beside(depth=DEPTH + 0.005)
    assert is_edge(g)
    assert not edges(g, NEIGHBOURS[::-1])[0]


@pytest.mark.parametrize(("first", "second"), [(2.0, np.inf), (np.inf, 2.0)])
def test_the_silhouette_of_what_is_seen_before_nothing_is_an_edge_from_either_side(first, second) -> None:
    assert is_edge(replace(beside(), t=np.array([first, second])))
    assert not is_edge(replace(beside(), t=np.full(2, np.inf)))


# ---------------------------------------------------------------- pairs


def four(change: dict[str, float], at: int) -> Seen:
    """The ends of two pairs, (0, 1) and (2, 3), all alike but for one end that is changed."""
    same, other = beside(), beside(**change)
    parts = (np.repeat(each[..., :1], 4, axis=-1) for each in vars(same).values())
    found = []
    for part, changed in zip(parts, vars(other).values(), strict=True):
        part[..., at] = changed[..., 1]
        found.append(part)
    return Seen(*found)


PAIRS = np.array([[0, 2], [1, 3]])


@pytest.mark.claims("GPT-A07")
@pytest.mark.parametrize("at", range(4))
@pytest.mark.parametrize("way", PAST)
def test_pairs_are_alike_if_both_ends_are_and_unlike_if_either_one_is(way, at) -> None:
    for factor, found in ((0.9, True), (1.2, False)):
        alike = like_pairs(four({way: factor * PAST[way]}, at), PAIRS)
        assert alike(np.array([0, 1]), np.array([1, 0])).tolist() == [found, found]
        assert alike(np.array([0, 1]), np.array([0, 1])).all()


def test_pairs_are_compared_end_with_like_end_and_each_in_its_own_scale() -> None:
    mirrored = Seen(np.array([0.2, 0.8, 0.8, 0.2]), np.tile([[0.0], [1.0]], 4), np.ones(4))
    assert not like_pairs(mirrored, PAIRS)(np.array([0]), np.array([1]))[0]
    for far in range(2):
        g = replace(mirrored, albedo=np.full(4, 0.5), t=np.where(np.arange(4) == 2 + far, 2 * 1.105, 2.0))
        assert like_pairs(g, PAIRS)(np.array([0, 1]), np.array([1, 0])).tolist() == [False, True]


# ---------------------------------------------------------------- what middles of pixels see


@dataclass(frozen=True)
class Comb:
    """Three parallel rays down from y = 3, through pixel + u_0 along x; u_1 is a place on a lens of no size."""

    n: int = 3
    numbers: int = 2

    def ray(self, pixel: Array, u: Array) -> tuple[Array, Array, Array]:
        return np.stack([pixel + u[0], np.full(self.n, 3.0)]), np.tile([[0.0], [-1.0]], self.n), np.ones(self.n)


def test_what_is_seen_is_that_of_the_middles_only_with_the_mean_albedo_and_the_distance() -> None:
    """Two teeth around the middles of pixels 0 and 1, of two materials; below pixel 2 is nothing."""
    red = Material([Layer("lambert", (0.6, 0.0, 0.3)), Layer("ggx", (0.3, 0.0, 0.0), 0.5)])
    teeth = [Facet([[k + 0.55, 0.0], [k + 0.45, 0.0]], k, (1.0, 1.0, 1.0)) for k in (0, 1)]
    g = seen(scene(PLANE, [red, Material([Layer("lambert", (0.1, 0.35, 0.6))])], teeth), Comb())
    assert g.albedo[:2] == pytest.approx([0.4, 0.35], rel=1e-12)
    assert g.t == pytest.approx([3.0, 3.0, np.inf], rel=1e-9)
    assert np.abs(g.n[:, :2]) == pytest.approx(np.array([[0.0, 0.0], [1.0, 1.0]]), abs=1e-12)
    assert edges(g, np.array([[0, 1], [1, 2]])).tolist() == [False, True]

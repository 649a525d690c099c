"""What people get wrong about light from a cache, one deliberate error each, on models whose numbers are exact.

Cells of two pixels (see `kept`), an operator that scatters light, a furnace, and the geometry term beside a crease:
none needs a renderer, and each has the right model beside the wrong one.  [DDGIR 3]
"""

from collections.abc import Callable, Mapping
from functools import partial
from types import MappingProxyType

import numpy as np

from restir_ref.batch import Array
from restir_ref.oracle.enumeration import scattered
from restir_ref.transport.cache.integrals import bound
from restir_ref.transport.cache.leaving import prefiltered
from restir_ref.transport.cache.rules import AUGMENTED, ORIGINAL, Rule, gathered
from restir_ref.transport.proofs.zoo import kept
from restir_ref.transport.proofs.zoo.bug import ModelBug
from restir_ref.transport.space import ball_volume

# ---------------------------------------------------------------- an operator

PLACES = 12
"""Places that scatter light to each other."""


def operator() -> tuple[Array, Array]:
    """T (PLACES, PLACES), which sends on at most 80 % of what it gets, and L_e (PLACES,)."""
    T = scattered(np.arange(PLACES**2), 1).reshape(PLACES, PLACES)
    return 0.8 * T / T.sum(axis=0).max(), scattered(np.arange(PLACES), 2)


def second_vertex(rule: Rule, times: int = 400) -> Array:
    """(L_e + T (L_e + probes) - L) / L, (1, PLACES): probes by a rule, asked at the second vertex.  [DDGIR Eq. 3-5]"""
    T, L_e = operator()
    L, probes = np.linalg.solve(np.eye(PLACES) - T, L_e), 0 * L_e
    for _ in range(times):
        probes = T @ gathered(rule, probes, L_e, T @ L_e)
    return np.asarray((L_e + T @ (L_e + probes)) / L - 1)[None]


# ---------------------------------------------------------------- a furnace


def in_a_furnace(mirrored: Callable[[Array, int], Array]) -> Array:
    """What a mirror returns of radiance 1 from everywhere, minus 1; in flatland and in space, (1, 2).  [DDGIR Eq. 6]"""
    found = [mirrored(np.full((1, 1), ball_volume(d)), d)[0, 0] for d in (2, 3)]
    return np.asarray(found)[None] - 1


def as_printed(E: Array, d: int) -> Array:
    """A mistake: E+ / (2 pi) in every dimension."""
    return np.asarray(E / (2 * np.pi))


# ---------------------------------------------------------------- a crease

HEIGHTS = np.geomspace(0.01, 1, 8)
"""Of points on a wall."""

DISTANCE, G_MAX = 0.02, 1.0
"""Of x_1 on the floor to the wall; the bound on G."""


def crease(residual: float) -> Array:
    """(min(G, G_max) + residual max(G - G_max, 0) - G) / G of points on a wall in flatland, (1, 8).  [DDGIR Eq. 9]"""
    r = np.hypot(HEIGHTS, DISTANCE)
    G = (HEIGHTS / r) * (DISTANCE / r) / r
    b = bound(G_MAX, G)
    return np.asarray(b + residual * (1 - b) - 1)[None]


# ---------------------------------------------------------------- the family

CELLWISE = kept.bias_of_frames
CELLWISE_RIGHT = partial(CELLWISE, kept.cells())

CACHE_BUGS: Mapping[str, ModelBug] = MappingProxyType(
    {
        bug.name: bug
        for bug in (
            ModelBug(
                "constant of the glossy term as printed",
                "Eq. 6 is taken as it reads, 1 / (2 pi), or from an engine whose probes hold another normalisation.",
                "dark reflections where a cache is asked for what a glossy surface mirrors",
                "[DDGIR Eq. 6]",
                right=partial(in_a_furnace, prefiltered),
                wrong=partial(in_a_furnace, as_printed),
            ),
            ModelBug(
                "probes without direct light at the second vertex",
                "Probes of the older method hold what is scattered twice; they are asked where once is missing.",
                "dark one bounce away from the light, right where light falls first",
                "[DDGIR Eq. 4, 5]",
                right=partial(second_vertex, AUGMENTED),
                wrong=partial(second_vertex, ORIGINAL),
            ),
            ModelBug(
                "no residual beside bounded geometry",
                "The geometry term is bounded against fireflies, and the rest of it is nobody's.",
                "dark creases, corners and contacts, fireflies gone",
                "[DDGIR Eq. 9]",
                right=partial(crease, 1.0),
                wrong=partial(crease, 0.0),
            ),
            ModelBug(
                "shading with the kept value",
                "The query is kept with the sample for selection, and spared in shading as well.",
                "bright and dark where pixels see the same point from other sides: glossy points, leaks that travel",
                "[DDGIR 3.6]",
                right=partial(kept.bias_of_shading, kept.cells(), kept.own),
                wrong=partial(kept.bias_of_shading, kept.cells(), kept.as_kept),
            ),
            ModelBug(
                "target drawn anew where W is formed",
                "p_hat is a function with one random sample, or one more query, in it, and called once more to divide.",
                "bright where pixels, or two calls, look up different values of one point",
                "[DDGIR 3.6; GRIS Eq. 22]",
                right=CELLWISE_RIGHT,
                wrong=partial(CELLWISE, kept.cells(), after=kept.looked_up_again),
            ),
            ModelBug(
                "MIS weights that see the kept value",
                "The target is a mean of products over channels, so that densities depend on what was looked up.",
                "bright and dark a little, where pixels look up different colours of one point",
                "[DDGIR 3.6; GRIS Eq. 35]",
                right=CELLWISE_RIGHT,
                wrong=partial(CELLWISE, kept.cells(kept.mean_of_products)),
            ),
            ModelBug(
                "kept value of 0 where others see light",
                "A glossy sample was lost, or a probe is in a wall: what is looked up is 0, and the target with it.",
                "dark where some pixels look up nothing: walls of probes, glossy lobes below the horizon",
                "[DDGIR 3.6; GRIS Eq. 15]",
                right=CELLWISE_RIGHT,
                wrong=partial(CELLWISE, kept.lost()),
            ),
        )
    }
)
"""By name.  Densities of points and of directions that are mixed are a mistake of `restir_ref.oracle.zoo` already."""

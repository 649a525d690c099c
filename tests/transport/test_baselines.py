"""Path reuse, ReSTIR GI and ReSTIR DI know no dimension.

A furnace shows the first two its closed form.  It is no place for ReSTIR DI, which has no BSDF samples: where
lights touch what they light its variance is infinite.  Its candidates are compared with the tracer's, one by one.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest

from figures.claims.criteria import all_unbiased
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.integrals import Pixels
from restir_ref.loop import random_in_row
from restir_ref.mis import WEIGHTS
from restir_ref.restir import initial, shade, spatial
from restir_ref.transport.baselines import path_reuse as module
from restir_ref.transport.baselines.path_reuse import path_reuse
from restir_ref.transport.baselines.restir_di import LightIntegrals, LightSample, visibility
from restir_ref.transport.baselines.restir_gi import RadianceIntegrals
from restir_ref.transport.materials import evaluate_all, lobe_shares
from restir_ref.transport.paths import RECONNECTION, Tracer, trace
from restir_ref.transport.rays import LightPoint, sample_light
from restir_ref.transport.space import Space
from restir_ref.transport.vectors import norm
from tests.transport.rooms import room, simplex
from tests.transport.spaces import SPACES

ALBEDO, DEPTH, TILE, REPLICAS = 0.5, 2, 8, 4096


@dataclass(frozen=True)
class Fan:
    """A place whose pixels see, one beside the other, all directions."""

    space: Space
    n: int = TILE

    @property
    def numbers(self) -> int:
        return self.space.d - 1

    def ray(self, pixel: Array, u: Array) -> tuple[Array, Array, Array]:
        place = simplex(self.space.d).mean(axis=0)[:, None].repeat(len(pixel), axis=1)
        return place, self.space.sphere(np.stack([(pixel + u[0]) / self.n, *u[1:]])), np.ones(len(pixel))


def by_path_reuse(t: Tracer, index: Array, chance: Live) -> Array:
    return path_reuse(t, index % TILE, chance, TILE)


def by_restir_gi(t: Tracer, index: Array, chance: Live) -> Array:
    here = Pixels(RadianceIntegrals(t), index)
    X = initial(here, chance)
    return shade(spatial(X, here, random_in_row(here.of, index, 2, 3, chance), chance, mis=WEIGHTS["talbot"]), here)


SYSTEMS = {"path reuse": by_path_reuse, "ReSTIR GI": by_restir_gi}


def furnace(space: Space, system: Callable[[Tracer, Array, Live], Array]) -> bool:
    """Whether all pixels are as bright as 1 + albedo + .. + albedo^depth."""
    t = Tracer(room(space, ALBEDO), Fan(space), DEPTH, RECONNECTION)
    L = system(t, np.arange(TILE * REPLICAS), Live(np.random.default_rng(1)))[0].reshape(REPLICAS, TILE)
    return all_unbiased(L, np.full(TILE, sum(ALBEDO**k for k in range(DEPTH + 1))), eps=0.02).passed


@pytest.mark.parametrize("name", SYSTEMS)
@pytest.mark.parametrize("space", SPACES.values(), ids=SPACES)
def test_a_furnace_is_evenly_bright_in_any_dimension(space, name) -> None:
    assert furnace(space, SYSTEMS[name])


def test_path_reuse_with_the_distances_of_3d_is_noticed_in_the_plane(monkeypatch) -> None:
    """A mistake: r^2 where it is r."""
    right = module.norm
    monkeypatch.setattr(module, "norm", lambda a: right(a) ** 2)
    assert not furnace(SPACES["plane"], by_path_reuse)


def candidate_and_leaf(space: Space) -> tuple[Array, Array]:
    """f V / p of points on lights in ReSTIR DI, and in light sampling with the same numbers but no MIS weights."""
    t = Tracer(room(space, ALBEDO), Fan(space), DEPTH, RECONNECTION)
    index, table = np.arange(TILE * 64), t.scene.materials
    tree = trace(t, np.random.default_rng(2).random((t.D, len(index))), index % TILE)
    of, light = LightIntegrals(t.scene, TILE, tree.x[0], tree.T[0]), sample_light(t.scene, *t.light_numbers(tree.u, 1))
    x = LightSample(light, of.arriving(index, light))
    (leaf, w), v = tree.lights[0], tree.x[0]
    _, p_bsdf = evaluate_all(table, space, v, lobe_shares(table, v), space.to_local(v.n, w))
    ours = of.contribution(index, x) * visibility(Pixels(of, index), x) / light.pdf_area
    return ours, tree.T[0] * leaf.end * (leaf.p_light + p_bsdf) / leaf.p_light


@pytest.mark.parametrize("space", SPACES.values(), ids=SPACES)
def test_candidates_of_restir_di_are_the_light_samples_of_path_tracing(space) -> None:
    ours, theirs = candidate_and_leaf(space)
    assert (theirs > 0).any()
    assert ours == pytest.approx(theirs, rel=1e-9)


def test_restir_di_with_the_distances_of_3d_is_noticed_in_four_dimensions(monkeypatch) -> None:
    """A mistake: r^2 where it is r^3."""
    right = LightIntegrals.arriving

    def wrong(of: LightIntegrals, index: Array, light: LightPoint) -> Array:
        return right(of, index, light) * norm(light.y - of.v.x[:, index])

    monkeypatch.setattr(LightIntegrals, "arriving", wrong)
    ours, theirs = candidate_and_leaf(SPACES["hyper"])
    assert ours != pytest.approx(theirs, rel=1e-2)

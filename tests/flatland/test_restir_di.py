"""ReSTIR DI against quadrature over the lights: weights that see obstacles are right, 1/M is dark at shadows' edges."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from figures.claims.criteria import all_unbiased, biased, mean_and_blocks, unbiased
from figures.gris.gris_f15di import shadow_edges
from flatland2d import PLANE, SCENES, Pinhole
from flatland2d.radiosity import cut, gather
from flatland2d.scenes import LAMP, chain, matte, room
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.integrals import Pixels
from restir_ref.loop import WHOLE, Passes, random_in_row
from restir_ref.mis import Weights
from restir_ref.restir import initial, shade
from restir_ref.transport.baselines.restir_di import (
    BIASED,
    CANDIDATES,
    DEBIASED,
    LightIntegrals,
    direct_light,
    indirect_light,
    light_integrals,
    lit,
    visibility,
)
from restir_ref.transport.materials import Layer, Material
from restir_ref.transport.paths import RECONNECTION, Tracer, Tree, first_hit, leaves, radiance, trace
from restir_ref.transport.scene import scene as compiled
from tests.flatland.truths import radiosity

PIXELS, REPLICAS, FRAMES, RADIUS = 128, 32, 3, 20
CENTRE = 0.5


def tracer(scene: str, n: int = PIXELS) -> Tracer:
    """The scene's inset."""
    setting = SCENES[scene]()
    return Tracer(setting.scene, setting.pinhole(n), setting.depth, RECONNECTION)


def quadrature(t: Tracer) -> Array:
    """Direct light at the pixels' centres."""
    v, _, _ = first_hit(t, np.full((1, t.sensor.n), CENTRE), np.arange(t.sensor.n))
    panels = cut(t.scene, 16)
    return gather(t.scene, panels, panels.emission, v.x, v.prim, v.n)


def images(t: Tracer, mis: Weights, batches: int) -> Array:
    """The last of some frames with temporal and spatial reuse, (replicas, pixels)."""
    chance, index, found = Live(np.random.default_rng(1)), np.arange(REPLICAS * t.sensor.n), []
    for _ in range(batches):
        of = light_integrals(t, np.full((1, len(index)), CENTRE), index % t.sensor.n)
        here, X, before = Pixels(of, index), None, []
        for _ in range(FRAMES):
            X = direct_light(here, random_in_row(of, index, 3, RADIUS, chance), mis, chance, X, before)
            before = [here]
        found.append(shade(X, here)[0].reshape(REPLICAS, -1))
    return np.concatenate(found)


@pytest.mark.claims("COM-B04", part="the unbiased variant, to 2 %")
@pytest.mark.parametrize("name", DEBIASED)
def test_restir_di_whose_weights_see_obstacles_is_unbiased(name) -> None:
    t = tracer("many_lights")
    estimates, truth = images(t, DEBIASED[name], 6), quadrature(t)
    assert all_unbiased(mean_and_blocks(estimates), mean_and_blocks(truth), eps=0.02).passed
    edges = shadow_edges(t.scene, t.sensor, RADIUS)
    assert unbiased(estimates[:, edges].mean(axis=1), truth[edges].mean(), eps=0.02).passed


@pytest.mark.claims("COM-B04", part="the biased variant")
def test_restir_di_that_counts_all_inputs_is_too_dark_at_the_edges_of_shadows() -> None:
    t = tracer("many_lights")
    estimates, truth, edges = images(t, BIASED, 4), quadrature(t), shadow_edges(t.scene, t.sensor, RADIUS)
    assert biased(estimates[:, edges].mean(axis=1), truth[edges].mean(), -0.5, -0.01).passed
    assert estimates[:, edges].mean() / truth[edges].mean() < estimates.mean() / truth.mean()


def test_candidates_alone_are_unbiased_without_any_weights() -> None:
    """Before anything is shared there is nothing to debias: the error is in the weights."""
    t, index = tracer("many_lights"), np.arange(4 * REPLICAS * PIXELS)
    here = Pixels(light_integrals(t, np.full((1, len(index)), CENTRE), index % PIXELS), index)
    X = lit(initial(here, Live(np.random.default_rng(2)), CANDIDATES), here)
    assert unbiased(shade(X, here)[0].reshape(-1, PIXELS).mean(axis=1), quadrature(t).mean(), eps=0.02).passed
    assert (X.c == 1).all()
    assert (X.W == 0).any()


def whole_images(t: Tracer, chance: Live) -> tuple[Array, Array]:
    """(C, N) with ReSTIR DI at x_1, and by path tracing alone."""
    index = np.arange(REPLICAS * t.sensor.n)
    tree = trace(t, chance.uniform((t.D, len(index))), index % t.sensor.n)
    of = LightIntegrals(t.scene, t.sensor.n, tree.x[0], tree.T[0])
    here = Pixels(of, index)
    near = random_in_row(of, index, 3, RADIUS, chance)
    ours = shade(direct_light(here, near, DEBIASED["talbot"], chance), here) + indirect_light(tree)
    return ours, np.asarray(sum(F for _, _, F in leaves(tree)))


@pytest.mark.claims("COM-B08", part="to 2 %")
def test_path_tracing_with_restir_di_agrees_with_radiosity() -> None:
    t = tracer("matte_cornell", 32)
    truth = radiosity("matte_cornell", 32, (44, 52, 60, 68))
    chance = Live(np.random.default_rng(3))
    ours = np.concatenate([whole_images(t, chance)[0][0].reshape(REPLICAS, -1).mean(axis=1) for _ in range(12)])
    assert unbiased(ours, truth, eps=0.02).passed


def left_to_lights(indirect: Callable[[Tree], Array]) -> float:
    """z of what is left of path tracing, walls being Lambert beside a mirror, against quadrature over the lamp."""
    facets, eye = [*room(0), *chain(LAMP, 0, 8.0)], Pinhole((0.5, 0.7), (0.45, 0.2), 32, film=32)
    layers = [Layer("lambert", (0.3,), weight=0.5), Layer("mirror", (0.2,), weight=0.5)]
    t = Tracer(compiled(PLANE, [Material(layers)], facets), eye, 3, RECONNECTION)
    truth = quadrature(replace(t, scene=compiled(PLANE, [matte(0.3)], facets))).mean()
    u, pixel = np.random.default_rng(5).random((t.D, 32 * 1500)), np.arange(32 * 1500) % 32
    u[0] = CENTRE
    tree = trace(t, u, pixel)
    direct = (radiance(tree) - indirect(tree) - tree.T[0] * tree.seen.end)[0].reshape(-1, 32).mean(axis=1)
    error = direct.std(ddof=1) / np.sqrt(len(direct))
    assert error < 0.005 * truth
    return float(abs(direct.mean() - truth) / error)


def by_any_leaf(tree: Tree) -> Array:
    """A mistake: where a mirror was sampled, light sampling is left to the path tracer as well."""
    by_delta = tree.at[0].p == 0
    return np.asarray(sum(F if k > 1 else F * by_delta for k, _, F in leaves(tree) if k))


def test_beside_a_mirror_light_sampling_stands_for_the_other_lobes_whichever_was_chosen() -> None:
    assert left_to_lights(lambda tree: indirect_light(tree) - tree.T[0] * tree.seen.end) < 4


def test_leaving_it_to_both_is_noticed() -> None:
    assert left_to_lights(by_any_leaf) > 10


@pytest.mark.claims("COM-B08", part="to 2 %")
@pytest.mark.parametrize("scene", ["glossy_cornell", "clear_coat", "glass_disc"])
def test_restir_di_stands_for_just_the_direct_light_of_path_tracing(scene) -> None:
    setting, chance = SCENES[scene](), Live(np.random.default_rng(4))
    t = Tracer(setting.scene, setting.fluence(8, 8), setting.depth, RECONNECTION)  # sees every surface
    ours, alone = (
        np.concatenate(each, axis=1)[0].reshape(-1, 64)
        for each in zip(*(whole_images(t, chance) for _ in range(8)), strict=True)
    )
    truth = mean_and_blocks(alone).mean(axis=0)
    assert all_unbiased(mean_and_blocks(ours - alone) + truth, truth, eps=0.02).passed


def test_every_pass_is_given_samples_that_their_pixel_sees() -> None:
    t, chance, given = tracer("many_lights"), Live(np.random.default_rng(4)), []

    def noting(act):
        def noted(X, here, *others, **more):
            given.append((X.W * (1 - visibility(here, X.x))).max())
            return act(X, here, *others, **more)

        return noted

    index = np.arange(8 * t.sensor.n)
    here = Pixels(light_integrals(t, np.full((1, len(index)), CENTRE), index % t.sensor.n), index)
    passes = Passes(WHOLE.initial, noting(WHOLE.temporal), noting(WHOLE.spatial))
    X = direct_light(here, [], DEBIASED["talbot"], chance, passes=passes)
    Y = direct_light(here, [], DEBIASED["talbot"], chance, X, [here], passes=passes)
    assert given == [0, 0, 0]
    assert (Y.W * (1 - visibility(here, Y.x)) == 0).all()
    blind = WHOLE.initial(here, chance, CANDIDATES)
    assert (blind.W * (1 - visibility(here, blind.x))).max() > 0

"""Laws of complaints about tracers, materials and scenes: the value and the remedy are named, near misses render."""

from dataclasses import replace

import numpy as np
import pytest

from flatland2d import Pinhole
from restir_ref.guards import whole
from restir_ref.transport.materials import Layer, Material, table
from restir_ref.transport.paths import RECONNECTION, REPLAY, Connectability, Tracer, radiance, trace
from restir_ref.transport.proofs.inversion import traced
from restir_ref.transport.scene import Ball, Facet, Scene, scene
from restir_ref.transport.shifts import shift_path
from tests.core.test_bad_input import Mistake, faults
from tests.transport.rooms import MATTE, room
from tests.transport.spaces import SPACES

PLANE, SOLID = SPACES["plane"], SPACES["solid"]
NAN, INF = np.nan, np.inf

LIGHT = Facet(((0, 0), (1, 0)), 0, (1.0,))
PLAIN = Facet(((1, 1), (0, 1)))
TRIANGLE = Facet(((0, 0, 0), (1, 0, 0), (0, 1, 0)), 0, (1.0,))
CAMERA = Pinhole((0.5, 0.7), (0.4, 0.2), 8)
LAMBERT, GGX = Layer("lambert", (0.5,)), Layer("ggx", (0.5,), 0.5)


def bare(*more: Facet, materials=(MATTE,), balls=(), space=PLANE, light=LIGHT) -> Scene:
    """A light and little else."""
    return scene(space, materials, [light, *more], balls)


TRACER = Tracer(bare(PLAIN), CAMERA, 2, RECONNECTION)

# ---------------------------------------------------------------- tracers

DEPTHS = {
    f"a depth of {depth!r}": Mistake(
        lambda depth=depth: replace(TRACER, depth=depth),
        ValueError,
        f"the path depth must be a whole number >= 1, but is {depth!r}.",
        "It counts scattering vertices; 1 is direct light.",
    )
    for depth in (0, -1, 2.5, 3.0, NAN, INF, "3", None)
}
RULES = {
    f"a threshold of {roughness} and {distance}": Mistake(
        lambda r=roughness, d=distance: Connectability(r, d),
        ValueError,
        f"roughness {roughness} and distance {distance}",
        "0 connects whatever can be, inf nothing",
    )
    for roughness, distance in ((NAN, 0.1), (-0.1, 0.1), (-INF, 0), (0.2, NAN), (0.2, -1e-9))
}
SAMPLES = {
    f"a primary sample of shape {shape}": Mistake(
        lambda shape=shape: trace(TRACER, np.full(shape, 0.5), np.arange(8)),
        ValueError,
        f"9 numbers for each of 8 pixels, but u has shape {shape}",
        "draw chance.uniform((tracer.D, len(pixel)))",
    )
    for shape in ((8, 8), (10, 8), (9, 7), (9,))
}
MISMATCH = {
    "a sensor of another world": Mistake(
        lambda: replace(TRACER, scene=bare(space=SOLID, light=TRIANGLE)),
        ValueError,
        "has rays in 2 dimensions, but the scene has 3",
        "take a sensor of the scene's own world",
    )
}

# ---------------------------------------------------------------- materials


def made_of(*layers: Layer, eta: float = 1.5) -> Scene:
    return bare(materials=[Material(layers, eta)])


ROUGHNESSES = {
    f"roughness {r}": Mistake(
        lambda r=r: made_of(LAMBERT, replace(GGX, roughness=r)),
        ValueError,
        f"the roughness of ggx must be in (0, 1], but is {r}",
        "0 needs a delta lobe",
    )
    for r in (NAN, 0.0, -0.1, 1.001, INF)
}
COLOURS = {
    f"colour {colour}": Mistake(
        lambda colour=colour: made_of(LAMBERT, replace(GGX, colour=colour)),
        ValueError,
        f"but is {colour}",
        "one number in [0, 1] per channel of the lights' emission, here 1",
    )
    for colour in ((NAN,), (-0.1,), (1.001,), (0.1, 0.2, 0.3), (), 0.5, "red")
}
WEIGHTS = {
    f"weight {weight}": Mistake(
        lambda weight=weight: made_of(LAMBERT, replace(GGX, weight=weight)),
        ValueError,
        f"but is {weight}",
        "must be finite and, unless it is black, positive",
    )
    for weight in (NAN, -1.0, INF, 0.0)
}
INDICES = {
    f"index {eta}": Mistake(
        lambda eta=eta: made_of(LAMBERT, eta=eta), ValueError, f"but is {eta}", "must be positive and finite"
    )
    for eta in (NAN, 0.0, -1.5, INF)
}
MATERIALS = {
    "an unknown lobe": Mistake(
        lambda: made_of(replace(GGX, kind="phong")), ValueError, "no lobe 'phong'", "the kinds are lambert, ggx"
    ),
    "a material without lobes": Mistake(
        made_of, ValueError, "needs a lobe of positive weight", "a black one is Layer('lambert', (0.0,))"
    ),
    "no materials": Mistake(
        lambda: table([], 1), ValueError, "needs at least one material", "a black one is Material([Layer('lambert'"
    ),
    "rough glass like its surroundings": Mistake(
        lambda: made_of(replace(GGX, kind="rough transmission"), eta=1.0001), ValueError, "it is 1.0001", "unlike 1"
    ),
}

# ---------------------------------------------------------------- scenes

CORNERS = {
    f"a corner at {x}": Mistake(
        lambda x=x: bare(Facet(((0, 1), (1, x)))), ValueError, f"(1, {x})", "2 corners of 2 finite coordinates"
    )
    for x in (NAN, INF, -INF)
}
EMISSIONS = {
    f"emission {e}": Mistake(
        lambda e=e: bare(replace(PLAIN, emission=(e,))), ValueError, f"but is ({e},)", "1 finite numbers >= 0, or ()"
    )
    for e in (NAN, INF, -1.0)
}
BALLS = {
    f"{ball}": Mistake(
        lambda ball=ball: bare(balls=[ball]),
        ValueError,
        f"{ball}",
        "a centre of 2 finite coordinates and a positive, finite radius",
    )
    for ball in (Ball((0, 0), -1.0), Ball((0, 0), 0.0), Ball((0, 0), NAN), Ball((NAN, 0), 1.0), Ball((0, 0, 0), 1.0))
}
SCENES = {
    "no light": Mistake(lambda: scene(PLANE, [MATTE], [PLAIN]), ValueError, "has no light", "a positive emission"),
    "a dark light": Mistake(
        lambda: bare(light=replace(LIGHT, emission=(0.0,))), ValueError, "has no light", "a positive emission"
    ),
    "a segment that is a point": Mistake(
        lambda: bare(Facet(((0.5, 0.5), (0.5, 0.5)))), ValueError, "[[0.5, 0.5], [0.5, 0.5]]", "facet 1 is degenerate"
    ),
    "a triangle that is a segment": Mistake(
        lambda: bare(Facet(((0, 0, 0), (1, 0, 0), (2, 0, 0))), space=SOLID, light=TRIANGLE),
        ValueError,
        "[2.0, 0.0, 0.0]",
        "facet 1 is degenerate",
    ),
    "a missing material": Mistake(
        lambda: bare(replace(PLAIN, material=1)), ValueError, "no material 1", "the scene has 1, counted from 0"
    ),
}


COLOURS_AND_PLACES = {
    "a far scene": Mistake(
        lambda: bare(Facet(((2e4, 0), (2e4, 1))), light=Facet(((2e4 + 1, 1), (2e4 + 1, 0)), 0, (1.0,))),
        ValueError,
        "coordinates up to 20001",
        "to the origin",
    ),
    "two lamps in one place": Mistake(
        lambda: bare(replace(LIGHT, emission=(2.0,))), ValueError, "facets 0 and 1 emit", "leave one out"
    ),
    "more colour than light": Mistake(
        lambda: made_of(Layer("lambert", (0.6,)), Layer("ggx", (0.6,), 0.5)), ValueError, "sum to 1.2", "at most 1"
    ),
}

FAMILIES = {
    **COLOURS_AND_PLACES,
    **DEPTHS,
    **RULES,
    **SAMPLES,
    **MISMATCH,
    **ROUGHNESSES,
    **COLOURS,
    **WEIGHTS,
    **INDICES,
    **MATERIALS,
    **CORNERS,
    **EMISSIONS,
    **BALLS,
    **SCENES,
}


@pytest.mark.parametrize("mistake", FAMILIES.values(), ids=FAMILIES)
def test_a_mistake_is_named_with_its_value_and_the_remedy(mistake) -> None:
    assert faults(mistake) == []


# ---------------------------------------------------------------- near misses


def seen(s: Scene) -> Tracer:
    return replace(TRACER, scene=s)


NEAR_MISSES = {
    "a depth of 1": replace(TRACER, depth=1),
    "a depth from an array": replace(TRACER, depth=np.arange(4)[3]),
    "a rule that connects everything": replace(TRACER, rule=Connectability(0, 0)),
    "a rule that connects nothing": replace(TRACER, rule=Connectability(INF, INF)),
    "a rule for Lambert only": replace(TRACER, rule=Connectability(1, 0)),
    "roughness 1": seen(made_of(replace(GGX, roughness=1))),
    "hardly any roughness": seen(made_of(replace(GGX, roughness=1e-8))),
    "a delta lobe without roughness": seen(made_of(Layer("mirror", (1,), NAN))),
    "black": seen(made_of(replace(LAMBERT, colour=(0,)))),
    "a black layer without weight": seen(made_of(LAMBERT, Layer("ggx", (0,), 0.5, weight=0))),
    "an index below 1": seen(made_of(replace(GGX, kind="rough transmission"), eta=0.5)),
    "no emission beside a light": seen(bare(replace(PLAIN, emission=(0.0,)))),
    "a faint light": seen(bare(light=replace(LIGHT, emission=(1e-30,)))),
    "a short segment": seen(bare(Facet(((0.5, 0.5), (0.5 + 1e-9, 0.5))))),
    "a small ball": seen(bare(balls=[Ball((0.5, 0.5), 1e-6)])),
    "the last material": seen(bare(replace(PLAIN, material=1), materials=[MATTE, MATTE])),
    "a scene of a far corner": seen(bare(Facet(((1e4, 0), (1e4, 1))))),
    "a lamp in a wall": seen(bare(replace(LIGHT, emission=()))),
    "a lamp with two sides": seen(bare(Facet(LIGHT.corners[::-1], 0, (1.0,)))),
    "all colour there is": seen(made_of(Layer("lambert", (0.7,)), Layer("ggx", (0.2,), 0.5), Layer("mirror", (0.1,)))),
    "two walls in one place": seen(bare(PLAIN, PLAIN)),
}


@pytest.mark.parametrize("t", NEAR_MISSES.values(), ids=NEAR_MISSES)
def test_a_near_miss_is_no_mistake_and_renders(t) -> None:
    rng, pixel = np.random.default_rng(1), np.arange(400) % 8
    u, k = rng.random((t.D, 400)), np.ones(400, dtype=int)
    y, J = shift_path(t, traced(t, u, pixel, k, k > 0), (pixel + 1) % 8)
    for values in (radiance(trace(t, u, pixel)), y.F, J):
        assert (np.isfinite(values) & (values >= 0)).all()


def test_no_pixels_are_no_mistake() -> None:
    assert radiance(trace(TRACER, np.zeros((9, 0)), np.arange(0))).shape == (1, 0)


@pytest.mark.parametrize("space", SPACES.values(), ids=SPACES)
def test_a_sensor_of_the_scene_s_own_dimension_is_accepted(space) -> None:
    class Inside:
        n, numbers = 1, 0

        def ray(self, pixel, u):
            return np.zeros((space.d, len(pixel))), np.ones((space.d, len(pixel))), np.ones(len(pixel))

    t = Tracer(room(space), Inside(), 1, REPLAY)
    assert t.D / space.d == 2


# ---------------------------------------------------------------- what happens without the checks


@pytest.mark.parametrize("rule", [Connectability(1e9, 0.0), RECONNECTION])
def test_a_threshold_of_nan_would_pass_unnoticed_and_connect_nothing(rule) -> None:
    """Every comparison with NaN is false: the wrong rule renders an image, so nobody would look for it."""
    object.__setattr__(nan := Connectability(0, 0), "roughness", NAN)
    u, k = np.random.default_rng(2).random((9, 400)), np.full(400, 2)
    found, other = (traced(replace(TRACER, rule=each), u, np.arange(400) % 8, k, k > 0) for each in (nan, rule))
    assert (found.F == other.F).all()
    assert (found.c == 0).all()
    assert (other.c > 0).any() == (rule is RECONNECTION)


@pytest.mark.parametrize("value", [2.5, 0, "2", None, NAN])
def test_a_poor_complaint_about_a_whole_number_is_noticed(value) -> None:
    right = Mistake(
        lambda: whole(value, 1, "it", "Count."),
        ValueError,
        f"it must be a whole number >= 1, but is {value!r}",
        "Count.",
    )
    assert faults(right) == []
    assert faults(right._replace(remedy="Pray.")) == ["no remedy"]
    assert faults(right._replace(act=lambda: whole(2, 1, "it", "Count."))) == ["no complaint"]

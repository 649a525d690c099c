"""Laws of complaints about views and names in flatland: the value and the remedy are named, near misses render."""

from dataclasses import replace

import numpy as np
import pytest

from flatland2d import SCENES, FluenceMap, Pinhole, scenes
from flatland2d.scenes import PLANE, Setting, ajar, block, chain, cornell, matte, room, setting
from flatland2d.sensors import FILM, check_view
from restir_ref.transport.paths import RECONNECTION, Tracer, radiance, trace
from restir_ref.transport.scene import Ball, scene
from tests.core.test_bad_input import Mistake, faults

NAN, INF = np.nan, np.inf
HOME = setting("cornell")
CAMERA, MAP = HOME.pinhole(8), HOME.fluence(4, 4)
MOVE = "Move it, or turn the facets round"


def with_ball() -> Setting:
    """A room with a ball in it."""
    facets = [*room(0), *chain([(0.65, 0.995), (0.35, 0.995)], 0, 8.0)]
    return Setting(scene(PLANE, [matte(0.5)], facets, [Ball((0.5, 0.3), 0.2)]), (0.5, 0.7), (0.5, 0.0))


def inside_out() -> Setting:
    """A room whose corners were given clockwise."""
    facets = [*block((0, 0), (1, 1), 0), *chain([(0.35, 0.995), (0.65, 0.995)], 0, 8.0)]
    return Setting(scene(PLANE, [matte(0.5)], facets), (0.5, 0.7), (0.5, 0.0))


BALLROOM = with_ball()
VIEWS = {
    "an eye in a box": (lambda: replace(HOME, eye=(0.3, 0.2), towards=(0.3, 0.3)), "eye=(0.3, 0.2)"),
    "an eye in a ball": (lambda: replace(BALLROOM, eye=(0.5, 0.25)), "eye=(0.5, 0.25)"),
    "an eye out of doors": (lambda: replace(HOME, eye=(3.0, 3.0), towards=(0.5, 0.5)), "eye=(3.0, 3.0)"),
    "an eye that looks away from everything": (lambda: replace(HOME, eye=(-1.0, 0.5), towards=(-2.0, 0.5)), "-1.0"),
    "a map in a box": (lambda: replace(HOME, low=(0.2, 0.1), high=(0.3, 0.2)), "low=(0.2, 0.1)"),
    "a map elsewhere": (lambda: replace(HOME, low=(2.0, 0.0), high=(3.0, 1.0)), "low=(2.0, 0.0)"),
    "a room that is inside out": (inside_out, "eye=(0.5, 0.7)"),
    "a pinhole in a box": (lambda: check_view(HOME.scene, replace(CAMERA, eye=(0.3, 0.2))), "eye=(0.3, 0.2)"),
}
IN_SOLIDS = {name: Mistake(act, ValueError, place, MOVE) for name, (act, place) in VIEWS.items()}

POINTS = {
    f"{name} {at}": Mistake(lambda of=of, name=name, at=at: replace(of, **{name: at}), ValueError, f"{at}", remedy)
    for of, name, at, remedy in (
        (CAMERA, "eye", (0.5, 0.7, 0.1), "a point of the plane has 2 coordinates"),
        (CAMERA, "towards", (0.5,), "a point of the plane has 2 coordinates"),
        (CAMERA, "eye", (NAN, 0.0), "needs a direction to look in"),
        (CAMERA, "towards", (INF, 0.0), "needs a direction to look in"),
        (CAMERA, "towards", CAMERA.eye, "needs a direction to look in"),
        (MAP, "low", (0.0, 0.0, 0.0), "a point of the plane has 2 coordinates"),
        (MAP, "high", (1.0, NAN), "low below high"),
        (MAP, "high", (INF, 1.0), "low below high"),
        (MAP, "high", (1.0, 0.0), "low below high"),
    )
}
PIXELS = {
    f"{name} = {count!r}": Mistake(lambda of=of, name=name, n=count: replace(of, **{name: n}), ValueError, said, remedy)
    for of, name, count, said, remedy in (
        (CAMERA, "n", 0, "has 0", "needs pixels on the film, 0 .. 1919"),
        (CAMERA, "n", NAN, "has nan", "needs pixels on the film, 0 .. 1919"),
        (CAMERA, "n", FILM + 1, "has 1921", "needs pixels on the film, 0 .. 1919"),
        (CAMERA, "n", 2.5, "is 2.5", "It counts pixels."),
        (CAMERA, "first", -1, "begins at -1", "needs pixels on the film, 0 .. 1919"),
        (CAMERA, "first", 1.5, "is 1.5", "It counts pixels."),
        (CAMERA, "film", 1e4, "is 10000.0", "It counts pixels."),
        (CAMERA, "half", NAN, "is nan", "must be positive and finite"),
        (CAMERA, "half", 0.0, "is 0.0", "must be positive and finite"),
        (MAP, "columns", 0, "0 columns", "needs pixels"),
        (MAP, "columns", 2.5, "is 2.5", "It counts pixels."),
        (MAP, "rows", NAN, "nan rows", "needs pixels"),
    )
}
SETTINGS = {
    **{
        f"a depth of {depth!r}": Mistake(
            lambda depth=depth: replace(HOME, depth=depth), ValueError, f"is {depth!r}", "1 is direct light"
        )
        for depth in (0, -2, 1.5, NAN)
    },
    "half a field of view of 0": Mistake(lambda: replace(HOME, half=0.0), ValueError, "is 0.0", "must be positive"),
    "a rough box of NaN": Mistake(lambda: cornell(NAN), ValueError, "is nan", "must be in (0, 1]"),
    **{
        f"a door open by {gap}": Mistake(lambda gap=gap: ajar(gap), ValueError, f"is {gap}", "must be in (0, 0.7)")
        for gap in (0.0, -0.1, 0.7, NAN)
    },
}
NAMES = {
    "a misspelt scene": Mistake(lambda: setting("cornel"), ValueError, "no scene 'cornel'", "did you mean 'cornell'?"),
    "a scene in capitals": Mistake(lambda: setting("ajar2D"), ValueError, "no scene 'ajar2D'", "did you mean 'ajar'?"),
    "a scene of another world": Mistake(
        lambda: setting("xyz"), ValueError, "no scene 'xyz'", "there are cornell, glossy_cornell, matte_cornell, ajar"
    ),
    "no name": Mistake(lambda: setting(""), ValueError, "no scene ''", "there are cornell"),
}
FAMILIES = IN_SOLIDS | POINTS | PIXELS | SETTINGS | NAMES


@pytest.mark.parametrize("mistake", FAMILIES.values(), ids=FAMILIES)
def test_a_mistake_is_named_with_its_value_and_the_remedy(mistake) -> None:
    assert faults(mistake) == []


# ---------------------------------------------------------------- near misses


def on_the_floor(**changes) -> Setting:
    return replace(HOME, eye=(0.5, 0.0), towards=(0.5, 1.0), **changes)


NEAR_MISSES = {
    "an eye on the floor": on_the_floor(),
    "an eye in a corner": replace(HOME, eye=(0.0, 0.0), towards=(1.0, 1.0)),
    "an eye on an end of the lamp": replace(HOME, eye=(0.35, 0.995)),
    "an eye a hair above a box": replace(HOME, eye=(0.3, 0.5 + 1e-9), towards=(0.6, 0.9)),
    "an eye on a ball": replace(BALLROOM, eye=(0.5, 0.5), towards=(0.5, 1.0)),
    "a narrow view": replace(HOME, half=1e-6),
    "a wide view": replace(HOME, half=1e3),
    "a map with a box in it": replace(HOME, low=(0.1, 0.1), high=(0.5, 0.6)),
    "a depth of 1": replace(HOME, depth=1),
    "a door hardly open": ajar(1e-6),
    "a door open to the ceiling": ajar(0.7 - 1e-6),
}


@pytest.mark.parametrize("view", NEAR_MISSES.values(), ids=NEAR_MISSES)
def test_a_near_miss_is_no_mistake_and_renders(view) -> None:
    for sensor in (view.pinhole(64), view.pinhole(1, FILM - 1), view.fluence(1, 1)):
        t = Tracer(view.scene, sensor, view.depth, RECONNECTION)
        L = radiance(trace(t, np.random.default_rng(1).random((t.D, 64)), np.arange(64) % sensor.n))
        assert (np.isfinite(L) & (L >= 0)).all()


@pytest.mark.parametrize("name", SCENES)
def test_every_scene_is_found_by_its_name(name) -> None:
    found, made = setting(name), SCENES[name]()
    assert (found.eye, found.scene.S) == (made.eye, made.scene.S)


@pytest.mark.parametrize("sensor", [Pinhole((0.3, 0.2), (0.3, 0.3), FILM), FluenceMap((0.2, 0.1), (0.3, 0.2), 4, 4)])
def test_without_the_check_a_view_in_a_box_is_a_black_image(monkeypatch, sensor) -> None:
    monkeypatch.setattr(scenes, "check_view", lambda scene, sensor: None)
    blind = replace(HOME, eye=(0.3, 0.2))
    t = Tracer(blind.scene, sensor, blind.depth, RECONNECTION)
    assert (radiance(trace(t, np.random.default_rng(1).random((t.D, 1000)), np.arange(1000) % t.sensor.n)) == 0).all()

"""Light that formulas know: an irradiated point, facing squares, a furnace, and every lobe in front of white walls."""

from dataclasses import replace

import numpy as np
import pytest

from restir_ref.batch import Array
from restir_ref.transport import lobes
from restir_ref.transport.lobes import LOBES, evaluate
from restir_ref.transport.materials import Layer, Material
from restir_ref.transport.paths import RECONNECTION, Tracer, radiance, trace
from restir_ref.transport.rays import arrive, light_pdf, sample_light
from restir_ref.transport.scene import Scene, scene
from tests.tracer3d.views import mean_and_error, seen
from tests.transport.lobe_cases import CONTINUOUS, grid, integral, plain
from tracer3d import SCENES
from tracer3d.scenes import grey, matte
from tracer3d.shapes import joined, quad, rectangle, room
from tracer3d.space import SOLID, Solid

# ---------------------------------------------------------------- a rectangle lights a point


def irradiance(corners: Array, x: Array, n: Array) -> float:
    """E = L/2 sum_k angle_k n . (R_k x R_(k+1)) / |R_k x R_(k+1)| of a polygon all above x, L = 1.  [Lambert 1760]"""
    R = np.asarray(corners) - x
    R = R / np.linalg.norm(R, axis=1, keepdims=True)
    S = np.roll(R, -1, axis=0)
    edge = np.cross(R, S)
    edge /= np.linalg.norm(edge, axis=1, keepdims=True)
    return float(abs((np.arccos((R * S).sum(axis=1)) * (edge @ n)).sum() / 2))


LAMP_AT = rectangle((0.2, 0.3), (0.7, 0.9), 0.8)[::-1]
ALBEDO = 0.6


def lit_floor() -> Scene:
    """A floor under one lamp."""
    floor = quad(rectangle((-1, -1), (2, 2), 0.0), 0)
    return scene(SOLID, [matte((ALBEDO,))], [*floor, *quad(LAMP_AT, 0, (1.0,))])


def error_at_a_point(s: Scene, x: tuple[float, float, float]) -> tuple[float, float]:
    """z of the light that a point of the floor reflects against Lambert's formula, and its relative standard error."""
    truth = ALBEDO / np.pi * irradiance(LAMP_AT, np.array(x), np.array([0, 1.0, 0]))
    mean, error = mean_and_error(seen(s, (-0.5, 0.5, 1.5), x, 100_000)[0])
    return (mean - truth) / error, error / truth


@pytest.mark.claims("COM-A03", part="direct light", world="tracer3d")
@pytest.mark.parametrize("x", [(0.3, 0.0, 0.4), (0.9, 0.0, 0.1), (-0.6, 0.0, 1.8)])
def test_a_rectangle_lights_a_point_as_lambert_s_formula_says(x):
    z, error = error_at_a_point(lit_floor(), x)
    assert error < 0.003
    assert abs(z) < 4


def test_a_lamp_taken_for_larger_than_it_is_is_noticed():
    s = lit_floor()
    larger = replace(s, lights=replace(s.lights, pdf_area=s.lights.pdf_area / 1.05))
    z, _ = error_at_a_point(larger, (0.3, 0.0, 0.4))
    assert abs(z) > 8


def parallel_squares(c: float) -> float:
    """The form factor of facing unit squares at distance c.  [Howell]"""
    X = 1 / c
    root = np.sqrt(1 + X**2)
    log = np.log(np.sqrt((1 + X**2) ** 2 / (1 + 2 * X**2)))
    return float(2 / (np.pi * X**2) * (log + 2 * X * root * np.arctan(X / root) - 2 * X * np.arctan(X)))


def form_factor(space: Solid, c: float, n: int) -> tuple[float, float]:
    """Share of light from a lamp that meets the square below it, and its standard error."""
    lamp, floor = rectangle((0, 0), (1, 1), c)[::-1], rectangle((0, 0), (1, 1), 0.0)
    s = scene(SOLID, [matte((0.5,))], [*quad(floor, 0), *quad(lamp, 0, (1.0,))])
    u = np.random.default_rng(4).random((5, n))
    light = sample_light(s, u[0], u[1:3])
    local = lobes.lambert_sample(space, plain(), light.n, u[3:])
    v, _, met = arrive(s, light.y, space.to_world(light.n, local))
    return mean_and_error((met & (v.prim < 2)).astype(float))


class Crowded(Solid):
    """A mistake: a disk that is crowded in the middle."""

    def ball(self, u):
        return u[0] * np.stack([np.cos(2 * np.pi * u[1]), np.sin(2 * np.pi * u[1])])


@pytest.mark.parametrize("c", [0.5, 1.0, 3.0])
def test_facing_squares_exchange_what_their_form_factor_says(c):
    mean, error = form_factor(SOLID, c, 300_000)
    assert error < 0.01 * mean
    assert abs(mean - parallel_squares(c)) < 4 * error


def test_directions_crowded_about_the_normal_are_noticed():
    mean, error = form_factor(Crowded(), 1.0, 300_000)
    assert abs(mean - parallel_squares(1.0)) > 20 * error


def test_both_formulas_agree():
    """The mean irradiance of a square is its form factor times pi; by quadrature."""
    x = grid(2, 24)
    lamp = rectangle((0, 0), (1, 1), 1.0)
    up = np.array([0, 1.0, 0])
    mean = np.mean([irradiance(lamp, np.array([a, 0, b]), up) for a, b in x.T]) / np.pi
    assert mean == pytest.approx(parallel_squares(1.0), rel=1e-3)
    assert parallel_squares(1.0) == pytest.approx(0.1998, abs=5e-5)


# ---------------------------------------------------------------- densities


def lamp_density(s: Scene, x: Array, n: int = 500) -> float:
    """int of the density of light sampling over all directions from a point, by quadrature."""

    def density(w: Array) -> Array:
        v, r, met = arrive(s, np.broadcast_to(x[:, None], w.shape), w)
        return light_pdf(s, v, r) * met

    return integral(s.space, density, np.array([[0.0], [1.0], [0.0]]), n)


@pytest.mark.claims("COM-A03", part="area to solid angle", world="tracer3d")
def test_the_density_of_lights_in_directions_integrates_to_one():
    x = np.array([0.3, 0.1, 0.4])
    assert lamp_density(lit_floor(), x) == pytest.approx(1, abs=5e-3)
    hidden = scene(SOLID, [matte((0.5,))], [*quad(rectangle((-1, -1), (2, 2), 0.5), 0), *quad(LAMP_AT, 0, (1.0,))])
    assert lamp_density(hidden, x) < 0.01


@pytest.mark.parametrize("name", SCENES)
def test_lights_are_picked_by_power_and_their_points_by_area(name):
    light = SCENES[name]().scene.lights
    edges = light.corners[1:] - light.corners[0]
    sizes = np.linalg.norm(np.cross(edges[0], edges[1], axis=0), axis=0) / 2
    share = np.diff(light.upto, prepend=0.0)
    assert share.sum() == pytest.approx(1, rel=1e-12)
    assert light.pdf_area * sizes == pytest.approx(share, rel=1e-9)
    power = light.emission.mean(axis=0) * sizes
    assert share == pytest.approx(power / power.sum(), rel=1e-9)


# ---------------------------------------------------------------- the furnace


def furnace_light(n: int) -> tuple[float, float]:
    """The furnace's mean light and its standard error."""
    setting = SCENES["furnace"]()
    t = Tracer(setting.scene, setting.view(16, 9), setting.depth, RECONNECTION)
    return mean_and_error(
        radiance(trace(t, np.random.default_rng(1).random((t.D, n)), np.arange(n) % 144)).mean(axis=0)
    )


def test_the_furnace_has_the_sum_of_its_bounces():
    """1 + .5 + ... + .5^8, and no other number of them."""
    mean, error = furnace_light(50_000)
    assert error < 0.0009
    assert abs(mean - (2 - 0.5**8)) < 4 * error
    assert abs(mean - (2 - 0.5**7)) > 4 * error


WALLS = Material([Layer("lambert", (0.0,))])
UPWARDS, DOWNWARDS = 1.5, 1 / 1.5


def plate(layers: list[Layer]) -> Scene:
    """A level plate in the middle of a room whose black walls all shine."""
    middle = joined([rectangle((0.05, 0.05), (0.95, 0.95), 0.5)], 1)
    return scene(SOLID, [WALLS, Material(layers)], [*room(0, emission=(1.0,)), *middle])


def view_of_plate(cos: float) -> tuple[Array, Array]:
    """The eye that sees the plate's middle at this cosine; from below it where that is negative."""
    sine, height = np.sqrt(1 - cos**2), np.array([0.5, 0.5, 0.5])
    return height + 0.4 * np.array([0.6 * sine, cos, 0.8 * sine]), height


def albedo_by_quadrature(kind: str, alpha: float, cos: float, n: int = 500) -> float:
    """int f |cos_i| over all directions; the grid is dense about the lobe."""
    surface = plain(alpha, UPWARDS if cos > 0 else DOWNWARDS)
    o = np.array([[0.0], [np.sqrt(1 - cos**2)], [abs(cos)]])
    up = np.array([[0.0], [0.0], [1.0]])
    through = lobes.refract(o, up, surface.eta)
    about = through if "transmission" in kind and through.any() else np.array([[0.0], [-o[1, 0]], [o[2, 0]]])
    return integral(
        SOLID, lambda w: evaluate(LOBES[kind], SOLID, surface, np.repeat(o, w.shape[1], axis=1), w), about, n
    )


ERROR = 0.0018
"""Relative standard error of what a plate is seen to reflect."""


def z_of_plate(kind: str, roughness: float, cos: float) -> tuple[float, float]:
    """z of the light against the lobe's albedo, and its relative standard error; from as many samples as that needs."""
    truth = albedo_by_quadrature(kind, roughness**2, cos)
    s, (eye, middle) = plate([Layer(kind, (1.0,), roughness)]), view_of_plate(cos)
    _, rough = mean_and_error(seen(s, eye, middle, 20_000, seed=2)[0])
    n = int(20_000 * max((1.05 * rough / (ERROR * truth)) ** 2, 0.2))
    mean, error = mean_and_error(seen(s, eye, middle, n)[0])
    return (mean - truth) / max(error, 1e-6 * truth), error / truth


CASES = [(kind, r, cos) for kind in CONTINUOUS for r in (0.15, 0.5, 1.0) for cos in (0.9, 0.4) if kind != "lambert"]
FROM_BELOW = [("rough reflection", 0.15, -0.9), ("rough transmission", 0.15, -0.9), ("rough transmission", 0.5, -0.9)]


@pytest.mark.claims("COM-A04", part="albedos in a furnace", world="tracer3d")
@pytest.mark.parametrize(("kind", "roughness", "cos"), [("lambert", 1.0, 0.9), *CASES, *FROM_BELOW])
def test_in_a_furnace_every_lobe_shines_with_its_albedo(kind, roughness, cos):
    z, error = z_of_plate(kind, roughness, cos)
    assert error <= 0.002
    assert abs(z) < 4


@pytest.mark.parametrize("kind", ["ggx", "rough transmission"])
def test_another_roughness_is_noticed(kind):
    truth = albedo_by_quadrature(kind, 0.25, 0.4)
    mean, error = mean_and_error(seen(plate([Layer(kind, (1.0,), 0.9)]), *view_of_plate(0.4), 60_000)[0])
    assert abs(mean - truth) > 8 * error


@pytest.mark.parametrize(
    ("kind", "cos"),
    [("mirror", 0.4), ("glass reflection", 0.4), ("glass transmission", 0.4), ("glass transmission", -0.9)],
)
def test_in_a_furnace_smooth_lobes_shine_with_fresnel_s_share(kind, cos):
    F = float(lobes.fresnel(np.array(UPWARDS if cos > 0 else DOWNWARDS), np.array(abs(cos))))
    share = {"mirror": 1.0, "glass reflection": F, "glass transmission": 1 - F}[kind]
    found = seen(plate([Layer(kind, (1.0,), 0.0)]), *view_of_plate(cos), 100)[0]
    assert found == pytest.approx(share, rel=1e-6)


def test_a_mix_of_lobes_shines_with_the_sum_of_their_albedos():
    layers = [Layer("lambert", (0.3,), weight=0.3), Layer("ggx", (0.5,), 0.5, weight=0.5)]
    truth = 0.3 + 0.5 * albedo_by_quadrature("ggx", 0.25, 0.4)
    mean, error = mean_and_error(seen(plate(layers), *view_of_plate(0.4), 60_000)[0])
    assert error <= 0.002 * truth
    assert abs(mean - truth) < 4 * error


def test_channels_are_rendered_alike():
    s = scene(SOLID, [matte(grey(0.5))], room(0, emission=grey(1.0)))
    L = seen(s, (0.5, 0.9, 0.5), (0.4, 0.0, 0.5), 200, depth=3)
    assert (L[0] == L).all()

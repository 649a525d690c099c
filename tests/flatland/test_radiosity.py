"""Path tracing against references that are not sampled: a furnace in closed form, radiosity, crossed strings."""

import numpy as np
import pytest
from scipy.integrate import dblquad

from flatland2d import SCENES
from flatland2d.radiosity import crossed_strings, cut, form_factors, render
from flatland2d.scenes import FURNACE_ALBEDO
from restir_ref.batch import Array
from restir_ref.transport import paths
from restir_ref.transport.paths import RECONNECTION, Tracer, radiance, trace


def replicas(setting, n: int, count: int, size: int, seed: int) -> Array:
    """Mean images of `count` independent batches of path tracing, `size` paths per pixel each; (count, n)."""
    rng = np.random.default_rng(seed)
    sensor = setting.pinhole(n, 700)
    t, pixel = Tracer(setting.scene, sensor, setting.depth, RECONNECTION), np.arange(n * size) % n
    batches = [radiance(trace(t, rng.random((t.D, n * size)), pixel))[0] for _ in range(count)]
    return np.array([batch.reshape(size, n).mean(axis=0) for batch in batches])


def z_score(samples: Array, truth: float, eps: float) -> float:
    """|mean - truth| / SE, with a power clause: SE <= eps truth."""
    error = samples.std(ddof=1) / np.sqrt(len(samples))
    assert error <= eps * truth
    return float(abs(samples.mean() - truth) / error)


def truncated_furnace(bounces: int) -> float:
    """L_e (1 + a + .. + a^bounces)."""
    return (1 - FURNACE_ALBEDO ** (bounces + 1)) / (1 - FURNACE_ALBEDO)


@pytest.mark.claims("GRIS-E49", "COM-B01")
def test_a_furnace_traces_its_closed_form() -> None:
    setting = SCENES["furnace"]()
    images = replicas(setting, 4, 64, 128, seed=1).mean(axis=1)
    assert z_score(images, truncated_furnace(setting.depth), 0.003) < 4


def test_a_furnace_has_its_closed_form_radiosity() -> None:
    setting = SCENES["furnace"]()
    image = render(setting.scene, setting.pinhole(4), setting.depth, per_segment=16, film=4)
    assert image == pytest.approx(truncated_furnace(setting.depth), rel=1e-12)


CUTS = {"checker": (20, 24, 28), "matte_cornell": range(40, 80, 4)}


@pytest.mark.claims("COM-A01")
@pytest.mark.parametrize("scene", CUTS)
def test_path_tracing_agrees_with_radiosity(scene) -> None:
    setting = SCENES[scene]()
    cuts = [render(setting.scene, setting.pinhole(4, 700), setting.depth, n, film=4).mean() for n in CUTS[scene]]
    truth = np.mean(cuts)  # shadow edges make each cut err by some .1%, at random
    assert np.std(cuts) / np.sqrt(len(cuts)) < 0.003 / 4 * truth
    assert z_score(replicas(setting, 4, 64, 512, seed=2).mean(axis=1), truth, 0.003) < 4


def test_double_counting_light_is_caught(monkeypatch) -> None:
    """A mistake: light sampling and BSDF samples both with full weight."""
    setting = SCENES["matte_cornell"]()
    truth = render(setting.scene, setting.pinhole(4, 700), setting.depth, per_segment=100, film=8).mean()
    right = paths.ratio
    monkeypatch.setattr(paths, "ratio", lambda a, b: np.minimum(right(a, b) + 1, 1) if a.ndim == 1 else right(a, b))
    images = replicas(setting, 4, 64, 128, seed=3).mean(axis=1)
    assert images.mean() > 1.2 * truth


def test_crossed_strings_are_the_double_integral_of_the_geometry_term() -> None:
    a, b, c, d = (np.array(p)[:, None] for p in ((0.0, 0.0), (1.0, 0.0), (0.2, 0.7), (1.1, 0.4)))

    def geometry(s: float, t: float) -> float:
        x, y = a + t * (b - a), c + s * (d - c)
        to = (y - x)[:, 0]
        r = float(np.hypot(*to))
        n = np.array([-(d - c)[1, 0], (d - c)[0, 0]]) / float(np.hypot(*(d - c)[:, 0]))
        return float(to[1] / r * abs(n @ to) / r / (2 * r) * np.hypot(*(d - c)[:, 0]))

    assert crossed_strings(a, b, c, d)[0] == pytest.approx(dblquad(geometry, 0, 1, 0, 1)[0], rel=1e-7)


def test_form_factors_of_a_closed_room_sum_to_one() -> None:
    panels = cut(SCENES["furnace"]().scene, 12)
    inside = np.flatnonzero(panels.emission > 0)
    sums = form_factors(SCENES["furnace"]().scene, panels)[np.ix_(inside, inside)].sum(axis=1)
    assert sums == pytest.approx(1, abs=1e-9)  # differences of nearly equal lengths

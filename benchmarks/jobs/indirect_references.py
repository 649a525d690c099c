"""Reference images of indirect light, which the paper's section 9 shows: as of all light, without what ReSTIR DI does.

Of Lambert scenes it is the radiosity of all bounces less that of one; elsewhere path tracing without the leaves that
end on a light right behind x_1.  Both are compared where both are known; elsewhere path tracing is added to direct
light by quadrature, which has to give the reference of all light.
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.jobs.job import ROOT, Done, Job, Params, Row, parts
from benchmarks.jobs.references import (
    CHECKS,
    CHUNKS,
    FILM,
    LATTICES,
    PANELS,
    compared,
    has_radiosity,
    image,
    refined,
    row,
    traced,
)
from figures.claims.figure import Arrays
from figures.experiments.flatland import TEN
from figures.experiments.references import INDIRECT, PATH, Reference, fingerprint, key_of, reference, save
from flatland2d.radiosity import film_points, render
from flatland2d.scenes import SCENES, Setting
from restir_ref.batch import Array
from restir_ref.integrals import Pixels
from restir_ref.transport.baselines.restir_di import LightSample, indirect_light, light_integrals, visibility
from restir_ref.transport.paths import RECONNECTION, Tracer
from restir_ref.transport.rays import sample_light
from restir_ref.transport.scene import Scene

QUADRATURE, AT_ONCE = ((2048, 16), (4096, 32)), 2**16
"""Direct light, coarse and fine: points over all lights, and per part of a pixel; pairs of them at a time."""


def chunks(share: float) -> Sequence[Params]:
    """Radiosity, then path tracing chunk by chunk."""
    lambert = [scene for scene in TEN if has_radiosity(scene)]
    counts = {scene: CHECKS if scene in lambert else CHUNKS for scene in TEN}
    listed = sorted((part, scene) for scene, count in counts.items() for part in parts(count, share))
    exact: list[Params] = [{"scene": scene, "part": "radiosity"} for scene in lambert]
    return exact + [{"scene": scene, "part": part} for part, scene in listed]


def compute(params: Params, *, rng: np.random.Generator) -> Arrays:
    """Independent images, (LATTICES, n), or the coarse and the fine one."""
    setting = SCENES[params["scene"]]()
    if params["part"] == "radiosity":
        return {"images": coarse_and_fine(setting)}
    return {"images": np.array([image(setting, rng, indirect_light) for _ in range(LATTICES)])}


def coarse_and_fine(setting: Setting) -> Array:
    """All bounces less the first, with few panels and with many, (2, n); lights are out of the insets' sight."""
    scene, sensor = setting.scene, setting.pinhole()
    both = [[render(scene, sensor, bounces, n, FILM) for bounces in (setting.depth, 1)] for n in PANELS]
    return np.array([full - direct for full, direct in both])


def direct(setting: Setting, on_lights: int, on_film: int) -> Array:
    """What ReSTIR DI stands for, by quadrature: Gauss points on the film times midpoints on the lights; (n,)."""
    s, sensor = setting.scene, setting.pinhole()
    t = Tracer(s, sensor, 1, RECONNECTION)
    pixel, place, weight = film_points(s, sensor, on_film)
    u = np.full((t.D, len(pixel)), 0.5)
    u[0] = place
    of, (pick, at), L = light_integrals(t, u, pixel), quantiles(s, on_lights), np.zeros(len(pixel))
    for some in np.array_split(np.arange(len(pixel)), -(-len(pixel) * on_lights // AT_ONCE)):
        light = sample_light(s, np.tile(pick, len(some)), np.tile(at, len(some)))
        index = some.repeat(on_lights)
        x = LightSample(light, of.arriving(index, light))
        seen = x.f.mean(axis=0) / light.pdf_area * visibility(Pixels(of, index), x)
        L[some] = seen.reshape(len(some), on_lights).mean(axis=1)
    return np.bincount(pixel, weight * L, sensor.n)


def quantiles(s: Scene, count: int) -> tuple[Array, Array]:
    """(i + 1/2) / N of light sampling: which light it picks (N,), and the place on that (1, N)."""
    q, upto = (np.arange(count) + 0.5) / count, s.lights.upto
    which = np.searchsorted(upto[:-1], q, side="right")
    below = np.append(0, upto)[which]
    return q, ((q - below) / (upto[which] - below))[None]


def identity(params: Params) -> str:
    """The scene, and for radiosity how fine it is."""
    scene = f"indirect, {fingerprint(params['scene'])}"
    return f"{scene}, panels {PANELS}, film {FILM}" if params["part"] == "radiosity" else scene


def judge(done: Done) -> Sequence[Row]:
    """Errors below 0.1%, at no less than 1e6 samples per pixel where path traced; and each against another way."""
    exact = refined(done)
    rows: list[Row] = []
    for scene in dict.fromkeys(params["scene"] for params, _ in done):
        found = traced(done, scene)
        other = against_radiosity(scene, exact[scene], found) if scene in exact else with_direct(scene, found)
        rows += [row(f"{scene}, indirect", exact.get(scene, found)), other]
    return rows


def against_radiosity(scene: str, exact: Reference, found: Reference) -> Row:
    """Path tracing, judged by radiosity."""
    return compared("COM-A09", f"{scene}, indirect: path tracing against radiosity", exact, found)


def with_direct(scene: str, found: Reference) -> Row:
    """Path traced indirect light and direct light by quadrature, judged by the reference of all light.

    The error of the quadrature is its change when refined.
    """
    coarse, fine = (direct(SCENES[scene](), *points) for points in QUADRATURE)
    error, image_error = np.hypot(found.error, fine - coarse), np.hypot(found.image_error, (fine - coarse).mean())
    both = replace(found, mean=found.mean + fine, error=error, image_error=float(image_error))
    what = f"{scene}: indirect, and direct by quadrature, against all light"
    return compared("COM-A09", what, reference(scene), both)


def publish(done: Done, root: Path) -> None:
    """Store the references for the figures."""
    exact = refined(done)
    scenes = dict.fromkeys(params["scene"] for params, _ in done)
    found = {key_of(scene, INDIRECT): exact.get(scene) or traced(done, scene) for scene in scenes}
    save(found, root / PATH.relative_to(ROOT))


JOB = Job("Reference images of indirect light", chunks, compute, judge, identity)

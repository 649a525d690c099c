"""Reference images: radiosity where it applies and is resolved, long path tracing elsewhere and as a check.

Path tracing takes all leaves of every tree, light and BSDF sampling combined by MIS.  Primary numbers are a
lattice of 1021 points, moved at random for every pixel anew: each sample is uniform, so
the mean is that of independent samples, with about a tenth of their variance; the standard error
comes from the spread over the moves.
"""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from benchmarks.jobs.job import ROOT, Done, Job, Params, Row, parts
from figures.claims.figure import Arrays
from figures.experiments.references import PATH, Reference, fingerprint, save
from flatland2d.radiosity import cut, render
from flatland2d.scenes import INSET, SCENES, Setting
from restir_ref.batch import Array
from restir_ref.transport.paths import RECONNECTION, Tracer, Tree, radiance, trace

POINTS, GENERATOR = 1021, 76
"""Points of the lattice, a prime, and its generator."""
LATTICES = 10
CHUNKS, CHECKS = 98, 10
"""Chunks where path tracing is the reference, 1 000 580 samples per pixel, and where it checks radiosity."""
PIXELS_AT_ONCE = 8
PANELS, FILM = (120, 240), 24
"""Panels per segment, coarse and fine, and points per part of a pixel."""
UNRESOLVED = ("many_lights",)
"""Scenes whose segments have more edges of shadows than panels: there path tracing is the better reference."""
LIMIT, EPS, SIGMA, SPREAD = 1e-3, 0.003, 4.0, 1.3
Shown = Callable[[Tree], Array]
"""Which leaves of a tree make the image, (C, N)."""

TRACED = "path tracing, light and BSDF sampling combined by MIS, randomly moved lattices"
REFINED = "radiosity with exact visibility; the error is its change when refined"


def lattice(D: int) -> Array:
    """x_k = (a^j k mod N)_j / N, k = 0 .. N-1: Korobov's lattice; (D, N)."""
    powers = np.array([pow(GENERATOR, j, POINTS) for j in range(D)])
    return np.asarray(powers[:, None] * np.arange(POINTS) % POINTS / POINTS)


def moved(t: Tracer, pixel: Array, rng: np.random.Generator, shown: Shown = radiance) -> Array:
    """The mean radiance of each pixel (n,) over one lattice, moved at random for each; (n,)."""
    u = (lattice(t.D)[:, None] + rng.random((t.D, len(pixel), 1))) % 1
    L = shown(trace(t, u.reshape(t.D, -1), pixel.repeat(POINTS)))
    return np.asarray(L[0].reshape(len(pixel), POINTS).mean(axis=1))


def image(setting: Setting, rng: np.random.Generator, shown: Shown = radiance) -> Array:
    """One image of POINTS samples per pixel, (n,)."""
    t = Tracer(setting.scene, setting.pinhole(), setting.depth, RECONNECTION)
    first = range(0, INSET, PIXELS_AT_ONCE)
    return np.concatenate([moved(t, np.arange(at, at + PIXELS_AT_ONCE), rng, shown) for at in first])


def has_radiosity(scene: str) -> bool:
    """Whether radiosity is the reference."""
    try:
        cut(SCENES[scene]().scene, 1)
    except ValueError:
        return False
    return scene not in UNRESOLVED


def coarse_and_fine(setting: Setting) -> Array:
    """Radiosity of the inset, (2, n)."""
    return np.array([render(setting.scene, setting.pinhole(), setting.depth, panels, FILM) for panels in PANELS])


def chunks(share: float) -> Sequence[Params]:
    """Radiosity, then path tracing chunk by chunk."""
    lambert = [scene for scene in SCENES if has_radiosity(scene)]
    counts = {scene: CHECKS if scene in lambert else CHUNKS for scene in SCENES}
    traced = sorted((part, scene) for scene, count in counts.items() for part in parts(count, share))
    refined: list[Params] = [{"scene": scene, "part": "radiosity"} for scene in lambert]
    return refined + [{"scene": scene, "part": part} for part, scene in traced]


def compute(params: Params, *, rng: np.random.Generator) -> Arrays:
    """Independent images, (LATTICES, n), or the coarse and the fine one."""
    setting = SCENES[params["scene"]]()
    if params["part"] == "radiosity":
        return {"images": coarse_and_fine(setting)}
    return {"images": np.array([image(setting, rng) for _ in range(LATTICES)])}


def identity(params: Params) -> str:
    """The scene, and for radiosity how fine it is; whatever transport becomes is tested against these references."""
    scene = fingerprint(params["scene"])
    return f"{scene}, panels {PANELS}, film {FILM}" if params["part"] == "radiosity" else scene


def traced(done: Done, scene: str) -> Reference:
    """Mean and standard error of all path traced images."""
    found = [arrays["images"] for params, arrays in done if params["scene"] == scene and params["part"] != "radiosity"]
    images = np.concatenate(found)
    root = np.sqrt(len(images))
    error, image_error = images.std(axis=0, ddof=1) / root, images.mean(axis=1).std(ddof=1) / root
    return Reference(images.mean(axis=0), error, float(image_error), len(images) * POINTS, TRACED)


def refined(done: Done) -> dict[str, Reference]:
    """The finer radiosity, with its change as error, of the scenes that have it."""
    found = {}
    for params, arrays in done:
        if params["part"] == "radiosity":
            coarse, fine = arrays["images"]
            change = float(abs(fine.mean() - coarse.mean()))
            found[params["scene"]] = Reference(fine, np.abs(fine - coarse), change, 0, REFINED)
    return found


def judge(done: Done) -> Sequence[Row]:
    """Errors below 0.1%, at no less than 1e6 samples per pixel where path traced; path tracing against radiosity."""
    exact = refined(done)
    rows: list[Row] = []
    for scene in dict.fromkeys(params["scene"] for params, _ in done):
        found = traced(done, scene)
        rows += (
            [row(scene, exact[scene]), against(scene, exact[scene], found)] if scene in exact else [row(scene, found)]
        )
    return rows


def row(scene: str, found: Reference) -> Row:
    """One reference, judged."""
    error, each = found.image_error / found.mean.mean(), found.error / found.mean
    enough = found.how == REFINED or found.samples >= 1e6
    what = "change when refined" if found.how == REFINED else "standard error"
    return Row(
        "COM-A09",
        f"{scene}: {what} of the reference's image mean",
        error,
        f"< {LIMIT:.1%}" + " at >= 1e6 samples per pixel" * (found.how == TRACED),
        bool(error < LIMIT and enough),
        found.samples,
        note=f"mean pixel {each.mean():.2g}, worst pixel {each.max():.2g}",
    )


def against(scene: str, exact: Reference, found: Reference) -> Row:
    """Path tracing, judged by radiosity."""
    return compared("COM-A01, COM-B01, GRIS-E49", f"{scene}: path tracing against radiosity", exact, found)


def compared(claims: str, what: str, exact: Reference, found: Reference) -> Row:
    """One image judged by another: its mean, and the spread of the pixels' z-scores."""
    scale, difference = exact.mean.mean(), found.mean - exact.mean
    error = np.hypot(found.image_error, exact.image_error)
    z = difference.mean() / error
    spread = np.sqrt(np.mean((difference / np.hypot(found.error, exact.error)) ** 2))
    holds = abs(z) <= SIGMA and error <= EPS * scale and spread <= SPREAD
    note = f"z {z:+.2f}; z-spread of pixels {spread:.2f}"
    limit, relative = f"|z| <= {SIGMA:g}, SE <= {EPS:.1%}, spread <= {SPREAD}", difference.mean() / scale
    return Row(claims, what, relative, limit, bool(holds), found.samples, error / scale, note)


def publish(done: Done, root: Path) -> None:
    """Store the references for the figures."""
    exact = refined(done)
    scenes = dict.fromkeys(params["scene"] for params, _ in done)
    save(
        {scene: exact.get(scene) or traced(done, scene) for scene in scenes},
        root / PATH.relative_to(ROOT),
    )


JOB = Job("Reference images of all scenes", chunks, compute, judge, identity)

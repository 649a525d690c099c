"""Path tracing by its techniques: each alone, and both combined, against each other and against radiosity.

The combination is known from its leaves, a technique alone from the same leaves without their MIS weight.
The sum of both without weights is the control: direct light counted twice.  Lambert variants are the
same rooms with every lobe made Lambert.  The whole film as one pixel is the truth for the sum over its
pixels, traced one by one and with samples shifted between them.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from benchmarks.jobs.comparing import as_truth, biased, joined, judged, nothing, refined, stored, sums
from benchmarks.jobs.job import Done, Job, Params, Row, parts
from benchmarks.jobs.references import coarse_and_fine, lattice
from figures.claims.figure import Arrays
from flatland2d.scenes import INSET, SCENES, Setting, matte
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.integrals import Pixels
from restir_ref.loop import REAL_TIME, random_in_row
from restir_ref.restir import initial, shade, spatial
from restir_ref.transport import materials as mat
from restir_ref.transport.paths import RECONNECTION, Sensor, Tracer, Tree, radiance, trace
from restir_ref.transport.restir_pt import PathIntegrals
from tests.transport.paths import HYBRID

CHUNKS, IMAGES = 32, 4
"""128 images of 1021 samples per pixel and technique."""
EPS = 0.003
PIXELS_AT_ONCE = 8


def lambert(setting: Setting) -> Setting:
    """The same with every lobe Lambert, of the material's whole colour."""
    colour = setting.scene.materials.colour[0].reshape(-1, setting.scene.materials.L).sum(axis=1)
    table = mat.table([matte(float(albedo)) for albedo in colour], setting.scene.C)
    return replace(setting, scene=replace(setting.scene, materials=table))


SEEN: Mapping[str, Callable[[], Setting]] = {
    "cornell": SCENES["cornell"],
    "clear_coat": SCENES["clear_coat"],
    "cornell, all Lambert": lambda: lambert(SCENES["cornell"]()),
    "clear_coat, all Lambert": lambda: lambert(SCENES["clear_coat"]()),
}


def by_bsdf(t: Tracer, tree: Tree) -> Array:
    """BSDF sampling alone, every light it meets with full weight; (C, N)."""
    hits = [T * hit.bare for T, hit in zip(tree.T[1:], tree.hits, strict=True)]
    return np.asarray(tree.T[0] * tree.seen.bare + sum(hits))


def by_lights(t: Tracer, tree: Tree) -> Array:
    """Light sampling alone with full weight, and light seen directly; (C, N)."""
    found = tree.T[0] * tree.seen.bare
    for T, v, at, (light, w) in zip(tree.T, tree.x, tree.at, tree.lights, strict=False):
        s = t.scene
        f, _ = mat.evaluate_all(s.materials, s.space, v, at.P, s.space.to_local(v.n, w))
        found = found + T * f * light.bare
    return np.asarray(found)


TECHNIQUES: Mapping[str, Callable[[Tracer, Tree], Array]] = {
    "both by MIS": lambda t, tree: radiance(tree),
    "BSDF samples alone": by_bsdf,
    "light samples alone": by_lights,
    "both in full": lambda t, tree: by_bsdf(t, tree) + by_lights(t, tree) - tree.T[0] * tree.seen.bare,
}


def images(setting: Setting, sensor: Sensor, rng: np.random.Generator) -> dict[str, Array]:
    """One image by each technique, from the same moved lattices; (n,) each."""
    t = Tracer(setting.scene, sensor, setting.depth, RECONNECTION)
    found: dict[str, list[Array]] = {name: [] for name in TECHNIQUES}
    for at in range(0, sensor.n, PIXELS_AT_ONCE):
        pixel = np.arange(at, min(at + PIXELS_AT_ONCE, sensor.n))
        u = (lattice(t.D)[:, None] + rng.random((t.D, len(pixel), 1))) % 1
        tree = trace(t, u.reshape(t.D, -1), pixel.repeat(u.shape[2]))
        for name, technique in TECHNIQUES.items():
            found[name].append(technique(t, tree)[0].reshape(len(pixel), -1).mean(axis=1))
    return {name: np.concatenate(each) for name, each in found.items()}


def compute(params: Params, *, rng: np.random.Generator) -> Arrays:
    """Images of the inset by all techniques, or of the film as a whole, or radiosity."""
    return PARTS[params["of"]](params, rng)


def by_technique(params: Params, rng: np.random.Generator) -> Arrays:
    """IMAGES independent images, and by how much techniques differ from the first."""
    setting = SEEN[params["scene"]]()
    each = [images(setting, setting.pinhole(), rng) for _ in range(IMAGES)]
    all_of = {name: np.array([image[name] for image in each]) for name in TECHNIQUES}
    first = all_of["both by MIS"]
    against = {f"{name} - MIS": sums(image - first) for name, image in all_of.items()}
    kept = against | {name: sums(image) for name, image in all_of.items()}
    return {key: value for name, found in kept.items() for key, value in stored(found, name).items()}


def by_radiosity(params: Params, rng: np.random.Generator) -> Arrays:
    """A coarse and a fine image."""
    return {"images": coarse_and_fine(SEEN[params["scene"]]())}


# ---------------------------------------------------------------- the film as a whole

STRIPES, FILM_IMAGES = 8, 16
"""The film's pixels are cut in eight blocks; 8 traced pixels stand for the whole film in one image."""


def by_film(params: Params, rng: np.random.Generator) -> Arrays:
    """The film's mean: in one pixel, in all pixels, and in all pixels with reuse; FILM_IMAGES times."""
    setting = SEEN["cornell"]()
    view = setting.pinhole(1920, 0)
    whole = replace(view, n=STRIPES, film=STRIPES)
    one = np.array([images(setting, whole, rng)["both by MIS"] for _ in range(FILM_IMAGES)])
    of = PathIntegrals(Tracer(setting.scene, view, setting.depth, HYBRID))
    index, chance = np.arange(FILM_IMAGES * view.n), Live(rng)
    here = Pixels(of, index)
    X = initial(here, chance)
    Y = spatial(X, here, random_in_row(of, index, REAL_TIME.neighbours, REAL_TIME.radius, chance), chance)
    pixels = {
        name: shade(Z, here)[0].reshape(FILM_IMAGES, STRIPES, -1).mean(axis=2) for name, Z in (("X", X), ("Y", Y))
    }
    found = {"whole": one, **pixels}
    return {key: value for name, each in found.items() for key, value in stored(sums(each), name).items()}


PARTS = {"techniques": by_technique, "radiosity": by_radiosity, "film": by_film}


def chunks(share: float) -> Sequence[Params]:
    """Radiosity where it applies, then images and films."""
    exact: list[Params] = [{"of": "radiosity", "scene": scene} for scene in SEEN if "Lambert" in scene]
    images = [{"of": "techniques", "scene": scene, "part": part} for part in parts(CHUNKS, share) for scene in SEEN]
    return [*exact, *images, *({"of": "film", "part": part} for part in parts(CHUNKS, share))]


def judge(done: Done) -> Sequence[Row]:
    """Techniques agree with each other and radiosity, both in full do not; the film is the sum of its pixels."""
    rows: list[Row] = []
    for scene in SEEN:
        mine = [arrays for params, arrays in done if params["of"] == "techniques" and params["scene"] == scene]
        exact = [arrays["images"] for params, arrays in done if params == {"of": "radiosity", "scene": scene}]
        rows += each_other(scene, mine) + [row for each in exact for row in against_radiosity(scene, mine, each)]
    return rows + of_film([arrays for params, arrays in done if params["of"] == "film"])


def each_other(scene: str, mine: list[Arrays]) -> list[Row]:
    """Techniques against their combination, from the same random numbers."""
    scale = float(joined(mine, "both by MIS").mean.mean())
    alone = [name for name in TECHNIQUES if "alone" in name]
    what = {name: f"{scene}: {name} against both by MIS" for name in TECHNIQUES}
    rows = [
        judged("GRIS-E49, COM-B01", what[name], joined(mine, f"{name} - MIS"), nothing(INSET), scale, EPS)
        for name in alone
    ]
    doubled = joined(mine, "both in full - MIS")
    doubled, once = joined(mine, "both in full"), as_truth(joined(mine, "both by MIS"))
    return [*rows, biased("GRIS-E49", what["both in full"], doubled, once, 0.01)]


def against_radiosity(scene: str, mine: list[Arrays], exact: Array) -> list[Row]:
    """Techniques against a deterministic truth."""
    truth = refined(exact)
    names = [name for name in TECHNIQUES if name != "both in full"]
    claims, scale = "GRIS-E49, COM-A01, COM-B01", float(truth.mean.mean())
    return [
        judged(claims, f"{scene}: {name} against radiosity", joined(mine, name), truth, scale, EPS) for name in names
    ]


def of_film(mine: list[Arrays]) -> list[Row]:
    """The sum over pixels against the film as a whole."""
    truth, found = as_truth(joined(mine, "whole")), {"traced": "X", "with samples shifted between them": "Y"}
    scale = float(truth.mean.mean())
    return [
        judged("GRIS-E44", f"cornell: all 1920 pixels {how} against the film", joined(mine, name), truth, scale, EPS)
        for how, name in found.items()
    ]


JOB = Job("Path tracing by its techniques, and the film as the sum of its pixels", chunks, compute, judge)

"""GRIS Fig. 1: a frame of a moving camera by path tracing, ReSTIR GI and ReSTIR PT, at equal rays.

Twenty frames with one path tree per pixel, and the last one judged: the whole film, at every fifteenth of its pixels.
All renderers add the same direct light by ReSTIR DI.  Path tracing gets as many trees as cost at least the rays of one
frame of ours.  ReSTIR GI keeps the radiance it found at x_2, which is right if x_2 is Lambertian.
"""

from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments import indirect, realtime
from figures.experiments.rendering import lattice_tracing, path_tracing
from figures.experiments.split_light import direct_film
from figures.experiments.views import HYBRID, view
from figures.report import style
from flatland2d import SCENES, radiosity
from flatland2d.sensors import FILM, Pinhole
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.metrics import mape
from restir_ref.transport.baselines.restir_di import indirect_light
from restir_ref.transport.counting import rays
from restir_ref.transport.restir_pt import PathIntegrals

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Picture

PT, GI = "path tracing", "ReSTIR GI"
DIRECT, TRUTH = "direct by ReSTIR DI", "truth"
RENDERED = {
    "glossy_cornell": ("hybrid", GI, PT),
    "ajar": ("hybrid", PT),
    "distant_caustic": ("hybrid", GI, PT),
    "clear_coat": ("hybrid", GI, PT),
}
JUDGED = ("glossy_cornell", "ajar", "distant_caustic")
GLOSSY, CAUSTIC = ("glossy_cornell", "clear_coat"), "distant_caustic"
"""Scenes whose film shows surfaces with glossy lobes; and one that shows only the light that such a surface throws."""

PIXELS = np.arange(7, FILM, 15)
"""128 pixels of the film, at which errors are measured."""


def film(scene: str) -> Pinhole:
    """All of the film."""
    return SCENES[scene]().pinhole(FILM, 0)


def chunks(preset: Any) -> Sequence[dict[str, str]]:
    """One per scene and renderer; direct light and the truth of every scene."""
    compared = [{"scene": scene, "method": method} for scene, methods in RENDERED.items() for method in methods]
    return compared + [{"scene": scene, "light": light} for scene in RENDERED for light in (DIRECT, TRUTH)]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Indirect light of one renderer at PIXELS, (count, 128), and its rays per pixel; or direct light, or the truth."""
    scene = chunk["scene"]
    if "light" in chunk:
        make = {DIRECT: direct, TRUTH: truth}[chunk["light"]]
        return {"images": make(scene, preset[chunk["light"]], rng)}
    if chunk["method"] == PT:
        return trees(scene, preset[PT], rng)
    return last_frames(scene, chunk["method"], preset["replicas"], rng)


def last_frames(scene: str, method: str, replicas: int, rng: np.random.Generator) -> Arrays:
    """The last frame of a moving camera, (replicas, 128), and its rays per pixel."""
    asked, m = Counter[str](), indirect.METHODS[method]
    views = [m.integrals(view(scene, m.rule, asked, each).tracer) for each in realtime.sideways(film(scene))]
    *_, (images, cost) = realtime.costed(views, asked, replicas, Live(rng))
    return {"images": images[:, PIXELS], "rays": np.array(cost)}


def trees(scene: str, count: int, rng: np.random.Generator) -> Arrays:
    """Independent path trees, (count, 128), and rays per tree; those from x_1 towards lights, at most one, are free."""
    asked = Counter[str]()
    of = view(scene, HYBRID, asked, film(scene))
    images = path_tracing(1, indirect_light)(of, np.tile(PIXELS, count), Live(rng)).reshape(count, -1)
    return {"images": images, "rays": np.array(rays(asked) / images.size - 1)}


def direct(scene: str, replicas: int, rng: np.random.Generator) -> Array:
    """Direct light of the last frame by ReSTIR DI, (replicas, 128)."""
    views = [view(scene, HYBRID, Counter(), each) for each in realtime.sideways(film(scene))]
    *_, images = direct_film(views, replicas, Live(rng))
    return images[:, PIXELS]


def truth(scene: str, lattices: int, rng: np.random.Generator) -> Array:
    """All light, (128,): by radiosity where everything is Lambert, else by lattices of path trees."""
    of: PathIntegrals = view(scene, HYBRID, Counter(), film(scene))
    if scene == "ajar":
        return np.asarray(radiosity.render(of.tracer.scene, film(scene), of.tracer.depth, film=4)[PIXELS])
    images = lattice_tracing()(of, np.tile(PIXELS, lattices), Live(rng))
    return np.asarray(images.reshape(lattices, -1).mean(axis=0))


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """MAPE (replicas,) and one image per renderer, image means, and rays, by "scene.renderer.name"."""
    found = {tuple(chunk.values()): part for chunk, part in zip(chunks(preset), results, strict=True)}
    arrays: Arrays = {}
    for scene, methods in RENDERED.items():
        expected, light = found[scene, TRUTH]["images"], found[scene, DIRECT]["images"]
        cost, traced = float(found[scene, "hybrid"]["rays"]), found[scene, PT]
        images = {method: found[scene, method]["images"] for method in methods if method != PT}
        images |= {PT: realtime.at_equal_rays(traced, cost), "equal time": realtime.at_equal_time(traced, scene)}
        arrays |= {f"{scene}.reference": expected, f"{scene}.rays": np.array([cost, float(traced["rays"])])}
        for name, each in images.items():
            whole = np.add(*realtime.paired(each, light))
            arrays |= {
                f"{scene}.{name}.error": mape(whole, expected),
                f"{scene}.{name}.image": whole[0],
                f"{scene}.{name}.mean": whole.mean(axis=-1) / expected.mean(),
            }
    return arrays


def check(a: Arrays) -> list[Claim]:
    """Against path tracing in three scenes; against ReSTIR GI where glossy surfaces are seen, and where only thrown."""
    against_paths = [judged(a, scene, PT, 0.76) for scene in JUDGED]
    against_gi = [judged(a, scene, GI, 1) for scene in GLOSSY]
    opposite = criteria.ratio_interval(*pair(a, CAUSTIC, GI))[2]
    return [
        *against_paths,
        *against_gi,
        Claim("GRIS-F01", criteria.reported(opposite), part_of(CAUSTIC, GI), reason=OTHERWISE + bias(a, CAUSTIC)),
    ]


def judged(a: Arrays, scene: str, other: str, limit: float) -> Claim:
    """MAPE of ReSTIR PT over another renderer's."""
    both = pair(a, scene, other)
    less, more = criteria.ratio_below(*both, limit), criteria.ratio_above(*both, 1)
    why, but = (bias(a, scene), EXCEPT) if other == GI else ("", "")
    return Claim("GRIS-F01", less, part_of(scene, other), counter=more, reason=why, caveat=but)


def part_of(scene: str, other: str) -> str:
    """The name of a comparison."""
    return f"{scene}: MAPE, ReSTIR PT / {other}"


EXCEPT = "Not where a small distant highlight is mirrored: there ReSTIR GI has the lower error (distant_caustic)."
OTHERWISE = (
    "The opposite holds: no glossy surface is seen, and nearly all error is that of light which a small mirror throws "
    "onto a matte wall. Such highlights are the paper's own exception, better reconnected than replayed [GRIS 9.2] "
    "(GRIS-F13b), and ReSTIR GI reconnects. "
)


def pair(a: Arrays, scene: str, other: str) -> tuple[Array, Array]:
    """MAPE of the hybrid shift and of another renderer, (replicas,) each."""
    return realtime.paired(a[f"{scene}.hybrid.error"], a[f"{scene}.{other}.error"])


def bias(a: Arrays, scene: str) -> str:
    """How far the mean image of ReSTIR GI is off."""
    ratios = a[f"{scene}.{GI}.mean"]
    return f"ReSTIR GI's mean: {ratios.mean() - 1:+.1%} (SE {ratios.std(ddof=1) / np.sqrt(len(ratios)):.1%})."


def draw(a: Arrays) -> "Picture":
    """One scene as an image, and MAPE in all of them."""
    picture, axes = style.panels(1, 2, width=5.2, height=3.4)
    _strips(axes[0, 0], a, "glossy_cornell")
    _bars(axes[0, 1], a)
    return picture


NAMES = {PT: "path tracing, equal rays", "equal time": "path tracing, equal time", GI: GI, "hybrid": "ReSTIR PT"}
LOOKS = {
    PT: style.bar(PT, label=NAMES[PT]),
    "equal time": style.bar(PT, label=NAMES["equal time"], hatch=""),
    GI: style.bar(GI),
    "hybrid": style.bar("ReSTIR PT"),
}


def _strips(axis: "Axes", a: Arrays, scene: str) -> None:
    names = [name for name in NAMES if name != "equal time"]
    rows = [a[f"{scene}.reference"], *(a[f"{scene}.{name}.image"] for name in names)]
    high = 1.5 * a[f"{scene}.reference"].max()
    style.strips(axis, rows, ["reference", *(NAMES[name].replace(", ", ",\n") for name in names)], high, FILM)
    axis.set(xlabel="pixel of the film", title=f"{scene}, frame {realtime.FRAMES} of a moving camera")


def _bars(axis: "Axes", a: Arrays) -> None:
    for k, name in enumerate(NAMES):
        x = {scene: i + 0.2 * (k - 1.5) for i, scene in enumerate(RENDERED) if f"{scene}.{name}.error" in a}
        errors = [a[f"{scene}.{name}.error"] for scene in x]
        spread = [1.96 * e.std(ddof=1) / np.sqrt(len(e)) for e in errors]
        bars = {"yerr": spread, "error_kw": {"lw": 0.8}, **LOOKS[name]}
        axis.bar(list(x.values()), [e.mean() for e in errors], 0.19, **bars)
    axis.set_yscale("log")
    axis.set_ylim(0.01, 6)
    labels = [f"{scene}\n{a[f'{scene}.rays'][0]:.0f} rays,\n{a[f'{scene}.rays'][1]:.1f} a tree" for scene in RENDERED]
    axis.set_xticks(np.arange(len(RENDERED)), labels, fontsize=8)
    axis.grid(visible=False, axis="x")
    axis.set(xlabel="scene", ylabel="MAPE", title="Error of that frame (bars: 95%)")
    axis.legend(ncols=2, loc="upper right")


FIGURE = Figure(
    id="GRIS-F01",
    title="Path tracing, ReSTIR GI and ReSTIR PT in real time",
    world="flatland2d",
    source="[GRIS Fig. 1; 8.3, 9.3]",
    claims=("GRIS-F01",),
    conditions=(
        Conditions(
            ("GRIS-F01",),
            "[GRIS Fig. 1; 9.3]",
            Setup("real time", "moving", "direct by ReSTIR DI", "whole images of two large glossy scenes, equal time"),
            Setup("real time", "moving", "direct by ReSTIR DI", "whole films of FS2, FS3, FS9 and FS10, equal rays"),
        ),
    ),
    arm="method",
    presets={
        "quick": {"replicas": 8, DIRECT: 8, PT: 96, TRUTH: 2},
        "paper": {"replicas": 32, DIRECT: 32, PT: 512, TRUTH: 40},
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)

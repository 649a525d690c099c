"""The scenes of space, each by every method: a few frames of one coarse view, and their errors.

A gallery: it shows what `python -m tracer3d render` renders, and claims nothing.  Methods have equally many frames, not
equal costs: rays per pixel stand beside each error, which a single bright pixel can rule.  Neighbours are at most 2
pixels away, as pixels are large.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims.figure import Arrays, Claim, Figure
from figures.report import style
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.loop import REAL_TIME
from restir_ref.metrics import MAP, SMALL
from restir_ref.transport.counting import counted, rays
from restir_ref.transport.paths import RECONNECTION, Connectability, Tracer
from tracer3d.files import exposure, tone
from tracer3d.methods import METHODS, Shot, traced
from tracer3d.scenes import SCENES

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Picture

SHOWN: Mapping[str, str] = MappingProxyType(
    {
        "path": "path tracing",
        "path-reuse": "path reuse",
        "restir-di": "ReSTIR DI + paths",
        "restir-gi": "ReSTIR GI",
        "restir-pt": "ReSTIR PT, hybrid",
        "restir-pt-reconnection": "... reconnection",
    }
)
"""Methods by their columns; replay alone, which nobody would use, is left out.  GI is biased where x_2 is glossy."""

SHAPE = 20, 32
"""Rows and columns of a picture; path reuse has tiles of 4 x 4."""

PRESET = replace(REAL_TIME, radius=2)

AT_ONCE = 12
"""Trees per pixel that are traced together."""


def chunks(preset: Any) -> Sequence[Any]:
    """One per scene."""
    return [{"scene": name} for name in SCENES]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Halves of a reference (2, C, rows, columns); the mean of frames (methods, ...), and rays per pixel (methods,)."""
    scene = chunk["scene"]
    found = [frames(scene, method, preset["frames"], rng) for method in SHOWN]
    return {
        "halves": np.stack([traced_for_long(scene, preset["trees"] // 2, rng) for _ in range(2)]),
        "images": np.stack([image for image, _ in found]),
        "rays": np.array([cost for _, cost in found]),
    }


def seen(scene: str, rule: Connectability, asked: Counter[str]) -> Tracer:
    """All of the scene's view in SHAPE; its rays are counted."""
    setting = SCENES[scene]()
    return Tracer(counted(setting.scene, asked), setting.view(*reversed(SHAPE)), setting.depth, rule)


def frames(scene: str, method: str, count: int, rng: np.random.Generator) -> tuple[Array, float]:
    """The mean of so many frames, (C, rows, columns), and its rays per pixel."""
    asked, made = Counter[str](), METHODS[method]
    t = seen(scene, made.rule, asked)
    images = [*made.frames([Shot(t, Live(each)) for each in rng.spawn(count)], PRESET, SHAPE)]
    return np.mean(images, axis=0).reshape(-1, *SHAPE), rays(asked) / t.sensor.n


def traced_for_long(scene: str, trees: int, rng: np.random.Generator) -> Array:
    """The mean of so many path trees per pixel, a multiple of AT_ONCE, (C, rows, columns)."""
    t, chance = seen(scene, RECONNECTION, Counter()), Live(rng)
    pixel = np.tile(np.arange(t.sensor.n), AT_ONCE)
    total = np.sum([traced(t, pixel, chance) for _ in range(trees // AT_ONCE)], axis=0)
    return np.asarray((total / trees).reshape(-1, AT_ONCE, *SHAPE).sum(axis=1))


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Everything by "scene name"."""
    pairs = zip(SCENES, results, strict=True)
    return {f"{scene} {name}": array for scene, result in pairs for name, array in result.items()}


def rel_mse(image: Array, halves: Array) -> float:
    """mean (I - A)(I - B) / (R^2 + (.01 mean R)^2), R = (A + B) / 2: relMSE of I by independent halves of a reference.

    I, A and B (C, rows, columns), channels averaged.  E (I - A)(I - B) = (I - truth)^2, so that the noise of A and B
    counts through R alone, in its fourth power: E a b / (1 + (a + b) / 2)^2 = 1.5 s^4 + ... for noise a, b ~ N(0, s^2).
    """
    I, (A, B) = image.mean(axis=0), halves.mean(axis=1)
    R = (A + B) / 2
    return float(((I - A) * (I - B) / (R**2 + (SMALL * R.mean()) ** 2)).mean(axis=MAP))


def check(a: Arrays) -> list[Claim]:
    """Nothing: tests of scenes and methods do."""
    return []


def draw(a: Arrays) -> "Picture":
    """A row per scene: a picture per method, and the reference on the right."""
    picture, axes = style.panels(len(SCENES), 1, width=11.0, height=1.35)
    for axis, scene in zip(axes[:, 0], SCENES, strict=True):
        draw_scene(axis, scene, {name: a[f"{scene} {name}"] for name in ("halves", "images", "rays")})
    return picture


def draw_scene(axis: "Axes", scene: str, a: Arrays) -> None:
    """Pictures over their methods, errors and costs, all in the exposure of the reference."""
    reference, (rows, columns) = a["halves"].mean(axis=0), SHAPE
    e = exposure(reference)
    pictures = [tone(image, e).transpose(1, 2, 0) for image in (*a["images"], reference)]
    framed = np.pad(pictures, ((0, 0), (0, 0), (0, style.BETWEEN), (0, 0)), constant_values=1)
    axis.imshow(np.concatenate([*framed], axis=1))
    words = [
        f"{name}\nrelMSE {short(rel_mse(image, a['halves']))}, {cost:.0f} rays"
        for name, image, cost in zip(SHOWN.values(), a["images"], a["rays"], strict=True)
    ]
    middles = np.arange(len(pictures)) * (columns + style.BETWEEN) + (columns - 1) / 2
    axis.set_xticks(middles, [*words, "reference"], fontsize=8)
    axis.set_yticks([(rows - 1) / 2], [scene.replace("_", "\n")], fontsize=9, rotation=90, va="center")
    axis.tick_params(length=0)
    axis.spines[:].set_visible(False)
    axis.grid(visible=False)


def short(error: float) -> str:
    """Two digits, or all before the point."""
    return f"{error:.2g}" if abs(error) < 100 else f"{error:.0f}"


FIGURE = Figure(
    id="SPACE-SCENES",
    title="Scenes of space by all methods",
    world="tracer3d",
    source="scenes and cameras of this project, methods of [GRIS 9.3]",
    claims=(),
    presets={"quick": {"frames": 2, "trees": 72}, "paper": {"frames": 16, "trees": 4104}},
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)

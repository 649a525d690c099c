"""The scenes of flatland: each with paths that carry its light, beside its fluence map.

A gallery: it shows what the other figures compute on, and claims nothing.
"""

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims.figure import Arrays, Claim, Figure
from figures.report import style
from flatland2d import SCENES
from flatland2d.fluence import fluence_map
from flatland2d.pictures import bundle_picture, fluence_picture
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.transport.paths import RECONNECTION, Tracer

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Picture

FILM = 1920


def chunks(preset: Any) -> Sequence[Any]:
    """One per scene."""
    return [{"scene": name} for name in SCENES]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """The fluence map (rows, columns) of a scene, square pixels, and the numbers and pixels of a bundle."""
    setting, chance, rows = SCENES[chunk["scene"]](), Live(rng), preset["rows"]
    width, height = np.subtract(setting.high, setting.low)
    fluence = fluence_map(setting, round(rows * width / height), rows, preset["samples"], chance)
    t = whole_film(chunk["scene"])
    u = chance.uniform((t.D, preset["paths"]))
    pixel = ((np.arange(preset["paths"]) + 0.5) / preset["paths"] * FILM).astype(int)
    return {"fluence": fluence, "u": u, "pixel": pixel}


def whole_film(scene: str) -> Tracer:
    """The scene seen by all pixels of its film."""
    setting = SCENES[scene]()
    return Tracer(setting.scene, setting.pinhole(FILM, 0), setting.depth, RECONNECTION)


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Maps and bundles by the scenes' names."""
    pairs = zip(SCENES, results, strict=True)
    return {f"{scene} {name}": array for scene, result in pairs for name, array in result.items()}


def check(a: Arrays) -> list[Claim]:
    """Nothing: tests of scenes, transport and radiosity do."""
    return []


def draw(a: Arrays) -> "Picture":
    """Two scenes in a row, each with its bundle and its map."""
    rows = (len(SCENES) + 1) // 2
    picture, axes = style.panels(rows, 4, width=2.9, height=3.05)
    for panels, scene in zip(axes.reshape(-1, 2), SCENES, strict=True):
        draw_scene(panels, scene, {name: a[f"{scene} {name}"] for name in ("fluence", "u", "pixel")})
    return picture


def draw_scene(panels: Sequence["Axes"] | Array, scene: str, a: Arrays) -> None:
    """Paths on the left, under the scene's sentence; fluence on the right."""
    setting, (left, right) = SCENES[scene](), panels
    bundle_picture(left, setting, whole_film(scene), a["u"], a["pixel"])
    fluence_picture(right, setting, a["fluence"])
    left.set_title(sentence(scene), fontsize=8.5)
    right.set_title(f"fluence of {scene}", fontsize=8.5)


def sentence(scene: str) -> str:
    """What the scene is for, the first sentence of its docstring, in short lines."""
    words = " ".join((SCENES[scene].__doc__ or "").partition("\n\n")[0].split())
    return "\n".join(textwrap.wrap(f"{scene}, {words}", 42))


FIGURE = Figure(
    id="FLAT-SCENES",
    title="Scenes of flatland, and the light in them",
    world="flatland2d",
    source="scenes and sensor of this project, after [GRIS 9]",
    claims=(),
    presets={
        "quick": {"rows": 60, "samples": 16, "paths": 96},
        "paper": {"rows": 160, "samples": 1024, "paths": 96},
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)

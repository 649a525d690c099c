"""GRIS Fig. 13 in space: the caustic below a ball of glass, and the highlight that a pane throws onto a small ball.

As in flatland, by the same code: the last of twenty frames of a moving camera, in a square crop that follows what its
middle sees.  Before errors are compared, the share of the caustic's light is measured that each shift keeps on the way
to a neighbour: both scenes have to hold what the paper gives as the reason.  Window3 was chosen by this share alone;
how large it is in the paper's San Miguel is not known.  The truth is path tracing by lattices.
"""

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments import arriving, kept_light, realtime
from figures.experiments.indirect import METHODS
from figures.experiments.rendering import Light, estimates, lattice_tracing, path_tracing
from figures.experiments.split_light import direct_film
from figures.experiments.views import HYBRID, Traced
from figures.gris.gris_f13 import DIRECT, KEPT, PT, SHIFTS, Caustics, chunks_of, combined, errors, judged, name_of
from figures.report import style
from restir_ref.chance import Live
from restir_ref.transport.baselines.restir_di import indirect_light
from restir_ref.transport.counting import counted
from restir_ref.transport.paths import Sensor, Tracer, radiance
from restir_ref.transport.restir_pt import PathIntegrals
from tracer3d import scenes
from tracer3d.scenes import Setting
from tracer3d.sensors import Mosaic

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Picture

SPACE = Caustics("GlassBall3", "Window3")
SCENES: Mapping[str, Callable[[], Setting]] = {SPACE.glass: scenes.glass_ball, SPACE.distant: scenes.distant_caustic}
LIGHT: Mapping[str, Light] = {SPACE.glass: radiance, SPACE.distant: indirect_light}
"""What the truth counts: the caption has direct light in the upper row only."""

TRUTH, WIDE = "reference", 40
"""What chunks of the truth are called; columns of the crop in which is measured what shifts keep, at any preset."""


def chunks(preset: Any) -> Sequence[dict[str, Any]]:
    """As in flatland, and the truth of both scenes; those with images in blocks."""
    all_of = [*chunks_of(SPACE), *({"scene": scene, "what": TRUTH} for scene in SCENES)]
    return [chunk | {"block": block} for chunk in all_of for block in range(blocks(preset, chunk))]


def blocks(preset: Any, chunk: Mapping[str, str]) -> int:
    """How many: of frames, so that a block fits the memory; of lattices, so that it does not take too long."""
    kind = chunk.get("what") or chunk.get("light") or chunk["method"]
    return int(preset["blocks"][chunk["scene"]].get(kind, 1))


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """A block of images of one renderer with its rays per pixel, of direct light or of the truth; or light kept."""
    scene, counts = chunk["scene"], preset[chunk["scene"]]
    if "light" in chunk:
        *_, images = direct_film(views(scene, "hybrid", preset["side"], Counter()), counts[DIRECT], Live(rng))
        return {"images": images}
    if chunk.get("what") == TRUTH:
        return truth(scene, preset["side"], counts[TRUTH], rng)
    method = chunk["method"]
    if "what" in chunk:
        return kept_light.kept(views(scene, method, WIDE, Counter())[-1], counts[KEPT], Live(rng))
    if method == PT:
        return trees(scene, preset["side"], counts[PT], rng)
    asked = Counter[str]()
    *_, (images, cost) = realtime.costed(views(scene, method, preset["side"], asked), asked, counts[method], Live(rng))
    return {"images": images, "rays": np.array(cost)}


def crop(scene: str, side: int) -> Mosaic:
    """A square in the middle of the setting's own inset."""
    of = SCENES[scene]()
    whole = of.pinhole()
    left, top = whole.left + (whole.width - side) // 2, whole.top + (whole.height - side) // 2
    return Mosaic(of.pinhole(side, side), ((left, top),))


def views(scene: str, method: str, side: int, asked: Counter[str]) -> list[Traced]:
    """The integrals of a shift in every frame of a camera that arrives at the crop; they count their rays."""
    of = SCENES[scene]()
    return [_integrals(of, each, method, asked) for each in arriving.approach(of, crop(scene, side))]


def _integrals(of: Setting, sensor: Sensor, method: str, asked: Counter[str]) -> Traced:
    shift = METHODS[method]
    return shift.integrals(Tracer(counted(of.scene, asked), sensor, of.depth, shift.rule))


def alone(scene: str, side: int, asked: Counter[str]) -> PathIntegrals:
    """What path tracing sees: the crop of the last frame, whatever the rule of shifts."""
    of = SCENES[scene]()
    return PathIntegrals(Tracer(counted(of.scene, asked), crop(scene, side), of.depth, HYBRID))


def trees(scene: str, side: int, count: int, rng: np.random.Generator) -> Arrays:
    """Indirect light by path trees (count, n), and rays per tree, as in `split_light.indirect_trees`."""
    asked = Counter[str]()
    found = estimates(path_tracing(1, indirect_light), alone(scene, side, asked), asked, count, Live(rng))
    return {"images": found.images, "rays": np.array(found.rays - 1)}


def truth(scene: str, side: int, lattices: int, rng: np.random.Generator) -> Arrays:
    """So many images of path tracing by lattices, (lattices, n)."""
    of, render, chance = alone(scene, side, Counter()), lattice_tracing(LIGHT[scene]), Live(rng)
    return {"images": np.stack([render(of, np.arange(of.n), chance) for _ in range(lattices)])}


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """As in flatland, of all blocks, and the references (n,) with their standard errors."""
    found: dict[str, list[Arrays]] = {}
    for chunk, part in zip(chunks(preset), results, strict=True):
        named = {key: value for key, value in chunk.items() if key != "block"}
        found.setdefault(name_of(named), []).append(part)
    whole = {name: joined(parts) for name, parts in found.items()}
    truths = {f"{scene}.{TRUTH}": whole[f"{scene}.{TRUTH}"]["images"] for scene in SCENES}
    noise = {f"{name}.error": images.std(axis=0, ddof=1) / np.sqrt(len(images)) for name, images in truths.items()}
    return combined(whole, SPACE) | {name: images.mean(axis=0) for name, images in truths.items()} | noise


def joined(parts: Sequence[Arrays]) -> Arrays:
    """Images of all blocks, and the mean of what is one number of each."""
    names = {name: [part[name] for part in parts] for name in parts[0]}
    return {name: np.concatenate(each) if each[0].ndim else np.asarray(np.mean(each)) for name, each in names.items()}


def check(a: Arrays) -> list[Claim]:
    """As in flatland."""
    return judged(a, SPACE)


# ---------------------------------------------------------------- picture


def draw(a: Arrays) -> "Picture":
    """One frame of every renderer, scene by scene, and the errors of all frames."""
    picture, axes = style.panels(1, 4, width=3.2, height=4.0)
    for axis, scene in zip(axes[0], SCENES, strict=False):
        images = {TRUTH: a[f"{scene}.{TRUTH}"], **{name: a[f"{scene}.{name}"][0] for name in shown(scene)}}
        side = math.isqrt(len(images[TRUTH]))
        style.crops(axis, images, side=side, title=f"{scene}: one frame")
    for axis, scene in zip(axes[0, 2:], SCENES, strict=True):
        _frames(axis, a, scene)
    return picture


def shown(scene: str) -> tuple[str, ...]:
    """Renderers of a scene."""
    return (*SHIFTS, PT) if scene == SPACE.glass else SHIFTS


def _frames(axis: "Axes", a: Arrays, scene: str) -> None:
    of = {name: np.sort(errors(a, scene, name)) for name in shown(scene)}
    every = np.log10(np.concatenate([*of.values()]))
    for name, found in of.items():
        axis.plot(found, (np.arange(len(found)) + 0.5) / len(found), markevery=0.15, **style.look(name, label=name))
    axis.set(xscale="log", xlabel="relMSE of the caustic, frame by frame", ylabel="share of frames below", ylim=(0, 1))
    axis.set_xlim(10 ** np.floor(every.min()), 10 ** np.ceil(every.max()))
    axis.minorticks_off()
    axis.set_title(f"{scene}: errors")
    style.below(axis, ncols=2)


FIGURE = Figure(
    id="GRIS-F13-3D",
    title="Caustics through glass and from a distant highlight, in space",
    world="tracer3d",
    source="[GRIS Fig. 13; 9.2, 9.3]",
    claims=("GRIS-F13t", "GRIS-F13b"),
    conditions=(
        Conditions(
            ("GRIS-F13t",),
            "[GRIS Fig. 13 top; 9.3]",
            Setup("real time", "moving", "direct by ReSTIR DI", "caustic of a glass bunny, equal time"),
            Setup("real time", "moving", "direct by ReSTIR DI", "caustic below a ball of glass, equal rays"),
        ),
        Conditions(
            ("GRIS-F13b",),
            "[GRIS Fig. 13 bottom; 9.3]",
            Setup("real time", "moving", "indirect", "reflection of a lamp, San Miguel"),
            Setup("real time", "moving", "indirect", "lamp mirrored by a pane onto a small ball (Window3)"),
        ),
    ),
    arm="method",
    presets={
        "quick": {
            "side": 16,
            SPACE.glass: {"hybrid": 8, "reconnection": 16, PT: 64, DIRECT: 8, KEPT: 12, TRUTH: 2},
            SPACE.distant: {"hybrid": 4, "reconnection": 4, KEPT: 24, TRUTH: 2},
            "blocks": {SPACE.glass: {}, SPACE.distant: {}},
        },
        "paper": {
            "side": 40,
            SPACE.glass: {"hybrid": 12, "reconnection": 24, PT: 192, DIRECT: 12, KEPT: 60, TRUTH: 2},
            SPACE.distant: {"hybrid": 12, "reconnection": 12, KEPT: 120, TRUTH: 4},
            "blocks": {
                SPACE.glass: {"hybrid": 2, "reconnection": 2, DIRECT: 2, TRUTH: 2},
                SPACE.distant: {"hybrid": 8, "reconnection": 8, TRUTH: 8},
            },
        },
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)

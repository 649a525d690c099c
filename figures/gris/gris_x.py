"""What rays and flatland can say about GRIS' claims on GPUs and production scenes: numbers that are reported.

Rays stand for time.  Real time: the last of 20 frames of a moving camera, with paths of up to ten scattering vertices.
Offline, indirect light: single frames of 32 trees and three spatial rounds, and how many rays path tracing needs for
the same MAPE.
"""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments import offline, realtime
from figures.experiments.references import INDIRECT, reference
from figures.experiments.rendering import estimates, path_tracing
from figures.experiments.views import HYBRID, Traced, view
from figures.gris import gris_c12, gris_f17
from figures.report import style
from flatland2d import SCENES, radiosity
from restir_ref.batch import Array
from restir_ref.chance import Chance, Live
from restir_ref.metrics import mape, rel_mse
from restir_ref.transport.paths import Tracer
from restir_ref.transport.restir_pt import PathIntegrals

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Picture

DEPTH = 10
LONG = ("glossy_cornell", "occluders")
"""Scenes with long paths: in one most is glossy, in the other much is hidden."""

REUSED = ("ReSTIR GI", "hybrid")
SHIFTS = ("reconnection", "hybrid")
SHIFTED = ("glossy_cornell", "clear_coat", "distant_caustic")
TRACED = "path tracing"
TARGET = 128
"""Path trees whose MAPE is to be reached: somewhat more than cost the rays of one frame."""


# ---------------------------------------------------------------- paths of length 10


def deeper(of: Traced) -> Tracer:
    """The same image with longer paths."""
    return replace(of.tracer, depth=DEPTH)


def trees(scene: str, count: int, chance: Chance) -> Arrays:
    """Images of one long path tree per pixel, (count, 128), and rays per tree."""
    asked = Counter[str]()
    found = estimates(path_tracing(1), PathIntegrals(deeper(view(scene, HYBRID, asked))), asked, count, chance)
    return {"images": found.images, "rays": np.array(found.rays)}


def truth(scene: str, count: int, chance: Chance) -> Array:
    """The inset with long paths, (128,): by radiosity, good to .05%, or by many path trees."""
    if scene != "occluders":
        return np.asarray(trees(scene, count, chance)["images"].mean(axis=0))
    setting = SCENES[scene]()
    return radiosity.render(setting.scene, setting.pinhole(), DEPTH, per_segment=40, film=8)


def last_frame(scene: str, name: str, replicas: int, chance: Chance) -> tuple[Array, float]:
    """The last frame of a moving camera, (replicas, 128), and its rays per pixel."""
    asked, method = Counter[str](), realtime.METHODS[name]
    views = [method.integrals(deeper(view(scene, method.rule, asked, each))) for each in realtime.widened(scene)]
    *_, (images, cost) = realtime.costed(views, asked, replicas, chance)
    return realtime.inset(images), cost


def long_paths(preset: Any, scene: str, rng: np.random.Generator) -> Arrays:
    """MAPE of ReSTIR's last frame, each renderer beside path tracing at its rays (renderer, 2), and those rays."""
    chance = Live(rng)
    expected, others = truth(scene, preset["truth"], chance), trees(scene, preset["trees"], chance)
    frames = [last_frame(scene, name, preset["replicas"], chance) for name in REUSED]
    pairs = [(images, realtime.at_equal_rays(others, cost)) for images, cost in frames]
    errors = [[mape(images, expected).mean() for images in pair] for pair in pairs]
    return {"errors": np.array(errors), "cost": np.array([cost for _, cost in frames])}


# ---------------------------------------------------------------- offline frames, and shifts


def frames(preset: Any, scene: str, rng: np.random.Generator) -> Arrays:
    """Images and rays by "method.name"; one shift where both are the same map."""
    names = [name for name in (TRACED, *SHIFTS) if name != "reconnection" or scene not in gris_f17.ONE_MAP]
    made = {name: offline.render(offline.METHODS[name], scene, preset[name], rng) for name in names}
    return {f"{name}.{key}": array for name, part in made.items() for key, array in part.items()}


def speedups(a: Arrays, scene: str) -> list[float]:
    """Rays of path tracing with TARGET trees over those of reconnection and of hybrid frames with the same MAPE."""
    costs, errors = gris_f17.curve(a, scene, TRACED)
    cost = TARGET * float(a[f"{scene}.{TRACED}.rays"]) / offline.UNIT
    error = float(np.exp(np.interp(np.log(cost), np.log(costs), np.log(errors))))
    return [cost / gris_f17.rays_to(error, *gris_f17.curve(a, scene, shift)) for shift in SHIFTS]


def ratios(a: Arrays, scene: str) -> Array:
    """MAPE and relMSE of path tracing over those of one hybrid frame at equal rays, (2,)."""
    expected = a[f"{scene}.reference"]
    ours = offline.after(a, scene, "hybrid", 1)
    theirs = offline.traced(a, scene, offline.equal_rays(a, scene, "hybrid", 1))
    return np.array([error(theirs, expected).mean() / error(ours, expected).mean() for error in (mape, rel_mse)])


def shifts(preset: Any, scene: str, rng: np.random.Generator) -> Arrays:
    """Mean rays per shift and what 95% need at most, if nothing ends them early; (shift, 2)."""
    found = [gris_c12.rays_per_shift(scene, shift, preset["shifts"], rng) for shift in SHIFTS]
    late = [np.searchsorted(np.cumsum(each["needed"]) / each["needed"].sum(), 0.95) for each in found]
    return {"rays": np.array([[float(each["mean"]), most] for each, most in zip(found, late, strict=True)])}


PARTS: Mapping[str, tuple[Sequence[str], Callable[[Any, str, np.random.Generator], Arrays]]] = MappingProxyType(
    {"long": (LONG, long_paths), "offline": (gris_f17.SIX, frames), "shifts": (SHIFTED, shifts)}
)
"""Name -> scenes, and what is computed of each."""


def chunks(preset: Any) -> Sequence[dict[str, str]]:
    """One per part and scene."""
    return [{"part": part, "scene": scene} for part, (scenes, _) in PARTS.items() for scene in scenes]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """One part of one scene."""
    return PARTS[chunk["part"]][1](preset, chunk["scene"], rng)


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Errors and costs of long paths, speedups (scene, shift) and error ratios (scene, 2) offline, rays of shifts."""
    done = list(zip(chunks(preset), results, strict=True))
    of = {part: [result for chunk, result in done if chunk["part"] == part] for part in PARTS}
    a = {f"{scene}.{k}": v for scene, part in zip(gris_f17.SIX, of["offline"], strict=True) for k, v in part.items()}
    a |= {f"{scene}.reference": reference(scene, INDIRECT).mean for scene in gris_f17.SIX}
    return {
        "errors": np.stack([part["errors"] for part in of["long"]]),
        "cost": np.stack([part["cost"] for part in of["long"]]),
        "speedups": np.array([speedups(a, scene) for scene in gris_f17.SIX]),
        "ratios": np.array([ratios(a, scene) for scene in gris_f17.SIX]),
        "rays": np.stack([part["rays"] for part in of["shifts"]]),
    }


def check(a: Arrays) -> list[Claim]:
    """Numbers, for what needs a GPU or somebody's scenes gets no other verdict."""
    found = {
        "GRIS-F01x": ("paths of length 10, moving camera", of_long_paths(a)),
        "GRIS-F17x": ("rays of path tracing / of one offline frame, to equal MAPE", of_speedups(a)),
        "GRIS-C20": ("errors of path tracing / of one hybrid frame offline, at equal rays", of_ratios(a)),
        "GRIS-C13": ("rays per shift, mean and what 95% need at most", of_shifts(a)),
    }
    claims = [Claim(id_, criteria.reported(text), part) for id_, (part, text) in found.items()]
    return [*claims, Claim("GRIS-A22", None, "manifold exploration", reason=FUTURE)]


FUTURE = "Out of scope: the paper leaves this shift to future work, and so does this project."


def of_long_paths(a: Arrays) -> str:
    """MAPE of both kinds of reuse beside path tracing's, in words."""
    found = zip(LONG, a["cost"], a["errors"], strict=True)
    return "; ".join(f"{scene}: " + ", ".join(map(_beside, REUSED, *pair)) for scene, *pair in found)


def _beside(name: str, cost: float, errors: Array) -> str:
    return f"{name} {errors[0]:.3g}, path tracing {errors[1]:.3g} at its {cost:.0f} rays"


def of_speedups(a: Arrays) -> str:
    """Ratios of rays by scene, in words."""
    found = zip(gris_f17.SIX, a["speedups"], strict=True)
    slow = [sum(each < 1) for each in a["speedups"].T]
    texts = [
        f"{scene} " + ", ".join(f"{s:.2g} {name}" for s, name in zip(each, SHIFTS, strict=True))
        for scene, each in found
    ]
    one_map = " and ".join(scene for scene in gris_f17.SIX if scene in gris_f17.ONE_MAP)
    slower = "; slower than path tracing in " + ", ".join(map(_of_six, slow, SHIFTS))
    return "; ".join(texts) + slower + f"; in {one_map} both shifts are one map"


def _of_six(count: int, name: str) -> str:
    return f"{count} of {len(gris_f17.SIX)} scenes by {name}"


def of_ratios(a: Arrays) -> str:
    """Ratios of errors by scene, in words."""
    found = zip(gris_f17.SIX, a["ratios"], strict=True)
    return "; ".join(f"{scene} MAPE {l1:.2g}, relMSE {l2:.2g}" for scene, (l1, l2) in found)


def of_shifts(a: Arrays) -> str:
    """Rays per shift by scene, in words."""
    return "; ".join(
        f"{scene} "
        + ", ".join(f"{name} {mean:.2f} and {most:.0f}" for name, (mean, most) in zip(SHIFTS, each, strict=True))
        for scene, each in zip(SHIFTED, a["rays"], strict=True)
    )


# ---------------------------------------------------------------- tables


def draw(a: Arrays) -> "Picture":
    """Three tables."""
    picture, axes = style.panels(3, 1, width=7.6, height=1.3)
    axes[0, 0].get_gridspec().set_height_ratios([5, 9, 6])
    long, still, rays = axes[:, 0]
    _table(
        long,
        f"GRIS-F01x: moving camera, paths of length {DEPTH}; MAPE beside path tracing's at equal rays",
        [f"{name}:\n{what}" for name in REUSED for what in ("rays per pixel", "MAPE", "path tracing's")],
        LONG,
        [[x for c, e in zip(a["cost"][k], a["errors"][k], strict=True) for x in (c, *e)] for k in range(len(LONG))],
    )
    _table(
        still,
        "GRIS-F17x, GRIS-C20: path tracing / offline frame; rays to equal MAPE, errors at equal rays",
        [*(f"rays,\n{shift}" for shift in SHIFTS), "MAPE,\nhybrid", "relMSE,\nhybrid"],
        gris_f17.SIX,
        np.hstack([a["speedups"], a["ratios"]]),
    )
    _table(
        rays,
        "GRIS-C13: rays per shift of an initial sample to a neighbour",
        [f"{shift}:\n{what}" for shift in SHIFTS for what in ("mean", "95% need at most")],
        SHIFTED,
        a["rays"].reshape(len(SHIFTED), -1),
    )
    return picture


def _table(axis: "Axes", title: str, heads: Sequence[str], names: Sequence[str], rows: Any) -> None:
    """Rows of numbers, which fill the axis."""
    axis.axis("off")
    axis.set_title(title, fontsize=9)
    cells = [[f"{value:.3g}" for value in row] for row in rows]
    table = axis.table(cells, rowLabels=list(names), colLabels=list(heads), loc="upper center", edges="horizontal")
    table.auto_set_font_size(value=False)
    table.set_fontsize(8)
    for (row, _), cell in table.get_celld().items():
        cell.set_height((2 if row == 0 else 1) / (len(cells) + 2))
        cell.set_edgecolor(style.GREY)


FIGURE = Figure(
    id="GRIS-X",
    title="Numbers in place of GPU times and production scenes",
    world="flatland2d",
    source="[GRIS Fig. 1, 17; 9.3]",
    claims=("GRIS-F01x", "GRIS-F17x", "GRIS-C20", "GRIS-C13", "GRIS-A22"),
    conditions=(
        Conditions(
            ("GRIS-F01x",),
            "Fig. 1; 9.3",
            Setup("real time", "moving", "direct by ReSTIR DI", "two production scenes, equal time"),
            Setup("real time", "moving", "all", "insets of the glossy Cornell box and of occluders, equal rays"),
            why="Direct light comes by the same paths as all other light.",
        ),
        Conditions(
            ("GRIS-F17x",),
            "Fig. 17; 9.3",
            Setup("offline", "still", "indirect", "production scenes, equal time"),
            Setup("offline", "still", "indirect", "the insets of six scenes, equal rays"),
        ),
        Conditions(
            ("GRIS-C20",),
            "Abstract; 1",
            Setup("real time", "moving", "all", "what is said of ReSTIR in general, equal time"),
            Setup("offline", "still", "indirect", "the insets of six scenes, equal rays"),
            why="One frame of 32 trees stands beside path tracing at its rays; GRIS-F15 has the real-time loop.",
        ),
        Conditions(
            ("GRIS-C13",),
            "9.3",
            Setup("offline", "still", "indirect", "rendering times on a GPU"),
            Setup("candidates only", "still", "all", "shifts of initial samples to a neighbour in three scenes"),
            why="Rays per shift are counted, which needs no frames.",
        ),
        Conditions(
            ("GRIS-A22",),
            "7.2; 9.2",
            Setup("offline", "still", "all", "an outlook: no view"),
            Setup("offline", "still", "all", "nothing"),
        ),
    ),
    presets={
        "quick": {
            "replicas": 10,
            "truth": 2048,
            "trees": 96,
            "path tracing": 320,
            "reconnection": 16,
            "hybrid": 16,
            "shifts": 64,
        },
        "paper": {
            "replicas": 128,
            "truth": 131072,
            "trees": 1024,
            "path tracing": 8192,
            "reconnection": 512,
            "hybrid": 512,
            "shifts": 256,
        },
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)

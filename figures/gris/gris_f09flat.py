"""GRIS Fig. 9 and 10 in flatland: what the M-cap does to frames of a still camera and to their mean.

Indirect light of the middle 64 pixels of the rough Cornell box' inset, as many as the toy of GRIS-F09 has, by the
reconnection shift, as in [GRIS 9.1].  All caps run side by side: a column's history keeps its own cap.  Without history
frames are independent.  Everything is rough enough to connect.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments.references import reference
from figures.experiments.rendering import estimates, means, spatial_only
from figures.experiments.split_light import IndirectIntegrals
from figures.experiments.views import view
from figures.report import style
from flatland2d import SCENES
from restir_ref.batch import Array
from restir_ref.chance import Chance, Live
from restir_ref.integrals import Pixels, Reservoirs
from restir_ref.loop import REAL_TIME, frame, random_in_row
from restir_ref.metrics import rel_mse
from restir_ref.transport.paths import RECONNECTION
from restir_ref.transport.restir_pt import PathIntegrals

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Picture

SCENE, PIXELS = "cornell", 64
CAPS = (0.0, 1.0, 5.0, 20.0, 50.0, 200.0, 1000.0, np.inf)
SPATIAL, UNCAPPED = 0, len(CAPS) - 1


def chunks(preset: Any) -> Sequence[Any]:
    """Independent frames without history, and blocks of chains that run equally long; caps by number in CAPS."""
    chains = [{"kind": name, "block": b} for name in ("short", "long") for b in range(preset[name]["blocks"])]
    return [*chains[::-1], {"kind": "spatial"}]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Errors of frames and of means of frames, by cap."""
    chance = Live(rng)
    if chunk["kind"] == "spatial":
        return independent(preset["spatial"]["frames"], chance)
    run = preset[chunk["kind"]]
    return chains(run["caps"], run["replicas"], run["frames"], chance)


def scene() -> PathIntegrals:
    """The middle of the rough Cornell box' standard inset."""
    setting = SCENES[SCENE]()
    sensor = setting.pinhole(PIXELS, setting.crop + margin(setting.pinhole().n))
    return view(SCENE, RECONNECTION, Counter(), sensor, IndirectIntegrals)


def truth() -> Array:
    """Its reference, (n,)."""
    found = reference(SCENE, "indirect").mean
    left = margin(len(found))
    return found[left : left + PIXELS]


def margin(n: int) -> int:
    """Pixels of a row of n that are left out before the middle."""
    return (n - PIXELS) // 2


def independent(frames: int, chance: Chance) -> Arrays:
    """relMSE of frames without history (frames,), and of means of t of them, (t, 8)."""
    images = estimates(spatial_only(REAL_TIME, random_in_row), scene(), Counter(), frames, chance).images
    t = recorded(frames // 8)
    errors = [rel_mse(means(images, int(k)), truth())[:8] for k in t]
    return {"frame": rel_mse(images, truth()), "t": t, "mean": np.stack(errors)}


def chains(caps: Sequence[int], replicas: Sequence[int], frames: int, chance: Chance) -> Arrays:
    """relMSE of every frame, and of the mean of the first t frames, (t, chains); the last two frames and the mean."""
    of, I = scene(), truth()
    cap = np.repeat([CAPS[k] for k in caps], replicas)
    total = last = before = np.zeros((len(cap), of.n))
    found, averaged = [], []
    for t, image in enumerate(side_by_side(of, cap, frames, chance), start=1):
        total, before, last = total + image, last, image
        found.append(rel_mse(image, I))
        if t in recorded(frames):
            averaged.append(rel_mse(total / t, I))
    errors = {"frame": np.stack(found), "mean": np.stack(averaged), "t": recorded(frames)}
    return errors | {"last": last, "before": before, "average": total / frames}


def side_by_side(of: PathIntegrals, cap: Array, frames: int, chance: Chance) -> Iterator[Array]:
    """Frames of chains with caps of their own, (chains, n) each: c <- min(c, cap), and none in the loop."""
    here = Pixels(of, np.arange(len(cap) * of.n))
    preset, history = replace(REAL_TIME, cap=np.inf), None
    for _ in range(frames):
        X = frame(here, chance, preset, random_in_row, history, [Pixels(of, here.index)])
        yield np.asarray((of.contribution(here.index, X.x) * X.W).mean(axis=0).reshape(len(cap), of.n))
        history = Reservoirs(X.x, X.W, np.minimum(X.c, cap.repeat(of.n)))


def recorded(frames: int) -> Array:
    """Frames to look at: 20 per decade and the last one."""
    return np.unique(np.append(10 ** np.arange(0, np.log10(frames), 0.05), frames).round().astype(int))


# ---------------------------------------------------------------- judging


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """By cap's number: errors of frames "frame.k" (t, R), late ones "late.k" (R,), and of means "mean.k"."""
    *blocks, spatial = results
    arrays: Arrays = {
        "truth": truth(),
        "frame.0": spatial["frame"][None],
        "late.0": spatial["frame"],
        "mean.0": spatial["mean"],
        "t_mean.0": spatial["t"],
    }
    for name, parts in (("long", blocks[: preset["long"]["blocks"]]), ("short", blocks[preset["long"]["blocks"] :])):
        run = preset[name]
        upto = np.cumsum([0, *run["replicas"]])
        for k, start, end in zip(run["caps"], upto, upto[1:], strict=False):
            arrays |= of_cap(k, start, end, parts)
    return arrays


def of_cap(k: int, start: int, end: int, parts: Sequence[Arrays]) -> Arrays:
    """The chains of one cap out of all blocks."""
    frames, average = (np.concatenate([p[key][:, start:end] for p in parts], axis=1) for key in ("frame", "mean"))
    images = {f"{key}.{k}": np.concatenate([p[key][start:end] for p in parts]) for key in ("last", "before", "average")}
    t = parts[0]["t"]
    windows = [frames[int(0.95 * (i - 1)) : max(i, int(1.05 * i))].mean(axis=0) for i in t]
    late = frames[len(frames) // 2 :].mean(axis=0)
    return {
        f"frame.{k}": np.stack(windows),
        f"late.{k}": late,
        f"mean.{k}": average,
        f"t.{k}": t,
        f"t_mean.{k}": t,
    } | images


def check(a: Arrays) -> list[Claim]:
    """The best cap and both ends; decay of means; the frozen image."""
    return [*_of_frames(a), *_of_means(a), *_frozen(a)]


def _of_frames(a: Arrays) -> list[Claim]:
    """The order of the caps; how far apart they are is asked on the line, where pixels have more neighbours."""
    late = [a[f"late.{k}"] for k in range(len(CAPS))]
    best = int(np.argmin([e.mean() for e in late]))
    moderate = min((e for e, cap in zip(late, CAPS, strict=True) if 1 <= cap <= 50), key=np.mean)
    t = list(a["t.6"])
    then, early = a["frame.6"][[t.index(1000), t.index(10)]]
    pairs = {
        "relMSE, cap 1000 / best of 1 to 50": (late[6], moderate),
        "relMSE, cap 0 / best of 1 to 50": (late[0], moderate),
        "cap 1000, relMSE at t = 1000 / t = 10": (then, early),
    }
    claims = [Claim("GRIS-F09a", criteria.between(CAPS[best], 1, 50), f"{BOX}: best cap")]
    for name, pair in pairs.items():
        worse, better = criteria.ratio_above(*paired(*pair), 1), criteria.ratio_below(*paired(*pair), 1)
        claims.append(Claim("GRIS-F09a", worse, f"{BOX}: {name}", counter=better))
    return claims


BOX = "rough Cornell box"


def paired(errors: Array, others: Array) -> tuple[Array, Array]:
    """As many replicas of both."""
    R = min(len(errors), len(others))
    return errors[:R], others[:R]


LONG = 3000
"""Frames of a chain with cap 20 from which on the decay of its mean is judged."""

SHORT = f"The slope at cap 20 needs chains of at least {LONG} frames, which the paper preset has."


def _of_means(a: Arrays) -> list[Claim]:
    claims = [_slope(a, "spatial only", SPATIAL), _slope(a, "cap 20", 3)]
    if a["t_mean.3"][-1] < LONG:
        claims[1] = Claim("GRIS-F09b", None, claims[1].part, reason=SHORT)
    T = np.intersect1d(a["t_mean.0"], a["t_mean.3"])[-1]
    spatial, capped = (a[f"mean.{k}"][list(a[f"t_mean.{k}"]).index(T)][:8] for k in (SPATIAL, 3))
    better, worse = criteria.ratio_below(spatial, capped, 0.5), criteria.ratio_above(spatial, capped, 1)
    part = f"{BOX}: relMSE of the mean of as many frames, spatial only / cap 20"
    return [*claims, Claim("GRIS-F09b", better, part, counter=worse, reason=f"Means of {T} frames.")]


def _slope(a: Arrays, name: str, k: int) -> Claim:
    t, error = a[f"t_mean.{k}"], a[f"mean.{k}"].mean(axis=1)
    last = t >= t[t <= t[-1] / 10].max()
    outcome = criteria.slope_within(t[last], error[last], -1, 0.15, decades=1)
    return Claim("GRIS-F09b", outcome, f"{BOX}, {name}: slope of the mean's relMSE, last decade")


def _frozen(a: Arrays) -> list[Claim]:
    pair = paired(a[f"mean.{UNCAPPED}"][-1], a["mean.3"][-1])
    far, near = criteria.ratio_above(*pair, 20), criteria.ratio_below(*pair, 1)
    still, moving = (likeness(a, k) for k in (UNCAPPED, 3))
    why = f"Means of {a['t_mean.3'][-1]} frames."
    return [
        Claim("GRIS-F10", far, f"{BOX}: relMSE of the mean, uncapped / cap 20", counter=near, reason=why),
        Claim("GRIS-F10", criteria.above(still, 0.99), f"{BOX}, uncapped: correlation of the last two frames"),
        Claim("GRIS-F10", criteria.below(moving, 0.99), f"{BOX}, cap 20: the same"),
    ]


def likeness(a: Arrays, k: int) -> float:
    """Correlation of the last two frames, relative to the truth, over pixels and chains."""
    one, other = (a[f"{key}.{k}"] / a["truth"] for key in ("last", "before"))
    return float(np.corrcoef(one.ravel(), other.ravel())[0, 1])


def draw(a: Arrays) -> "Picture":
    """Frames over time, late frames over the cap, means of frames, and a frozen image."""
    picture, axes = style.panels(2, 2, width=4.6, height=3.3)
    _frames(axes[0, 0], a)
    _caps(axes[0, 1], a)
    _means(axes[1, 0], a)
    _images(axes[1, 1], a)
    return picture


def _frames(axis: "Axes", a: Arrays) -> None:
    end = max(a[f"t.{k}"][-1] for k in range(1, len(CAPS)))
    for k, cap in enumerate(CAPS):
        look = style.look(style.cap(cap), markevery=0.12)
        if k == SPATIAL:
            axis.loglog([1, end], [a["late.0"].mean()] * 2, **look)
        else:
            axis.loglog(a[f"t.{k}"], a[f"frame.{k}"].mean(axis=1), **look)
    axis.set(xlabel="frame $t$", ylabel="relMSE of frame $t$", title="Frames of a still camera")
    style.below(axis, ncols=4)


def _caps(axis: "Axes", a: Arrays) -> None:
    x = np.where(np.isinf(CAPS), 6000, np.maximum(CAPS, 0.3))
    late = [a[f"late.{k}"] for k in range(len(CAPS))]
    spread = [1.96 * e.std(ddof=1) / np.sqrt(len(e)) for e in late]
    axis.errorbar(x, [e.mean() for e in late], yerr=spread, markevery=1)
    axis.set_xscale("log")
    axis.set_yscale("log")
    axis.set_xticks(x, ["0", "1", "5", "20", "50", "200", "1000", "no cap"])
    axis.minorticks_off()
    axis.set(xlabel="cap $M_c$", ylabel="relMSE of late frames", title="The second half of each chain (bars: 95%)")


def _means(axis: "Axes", a: Arrays) -> None:
    for k in (SPATIAL, 2, 3, UNCAPPED):
        name = style.cap(CAPS[k])
        look = style.look(name, label=f"{name}, spatial only" if k == SPATIAL else name, markevery=0.12)
        t, error = a[f"t_mean.{k}"], a[f"mean.{k}"].mean(axis=1)
        axis.loglog(t, error, **look)
    axis.set(xlabel="frames averaged $t$", ylabel="relMSE of their mean", title="Means of frames")
    style.below(axis, ncols=4)


def _images(axis: "Axes", a: Arrays) -> None:
    rows = (a["truth"], a[f"average.{UNCAPPED}"][0], a[f"last.{UNCAPPED}"][0], a["average.3"][0], a["last.3"][0])
    names = ("reference", "no cap, mean", "no cap, last", "cap 20, mean", "cap 20, last")
    style.strips(axis, rows, names, 1.5 * a["truth"].max(), PIXELS)
    axis.set(xlabel="pixel of the inset", title=f"One chain after {a['t_mean.3'][-1]} frames")


FIGURE = Figure(
    id="GRIS-F09flat",
    title="What the M-cap does in flatland",
    world="flatland2d",
    source="[GRIS Fig. 9, 10; 6.4, 6.5, 9.1]",
    claims=("GRIS-F09a", "GRIS-F09b", "GRIS-F10"),
    conditions=(
        Conditions(
            ("GRIS-F09a", "GRIS-F10"),
            "Fig. 9a, 10; 9.1",
            Setup("real time", "still", "indirect", "the rough Cornell box, reconnection shift"),
            Setup("real time", "still", "indirect", "64 pixels of it, at the foot and side of a box, same shift"),
        ),
        Conditions(
            ("GRIS-F09b",),
            "Fig. 9b; 9.1",
            Setup("real time", "still", "indirect", "the same, beside offline frames"),
            Setup("real time", "still", "indirect", "the same 64 pixels, beside frames of this preset without history"),
        ),
    ),
    presets={
        "quick": {
            "short": {"caps": [1, 2, 4, 5], "replicas": [12, 12, 12, 12], "frames": 200, "blocks": 1},
            "long": {"caps": [3, 6, 7], "replicas": [8, 8, 8], "frames": 1000, "blocks": 1},
            "spatial": {"frames": 4000},
        },
        "paper": {
            "short": {"caps": [1, 2, 4, 5], "replicas": [24, 24, 24, 24], "frames": 400, "blocks": 1},
            "long": {"caps": [3, 6, 7], "replicas": [20, 16, 8], "frames": 3000, "blocks": 2},
            "spatial": {"frames": 16_000},
        },
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)

"""DDGI resampling Fig. 1, 8 and Table 1: probes at x_2, resampled, against probes at x_1 and path tracing.

Six rooms, each with one frozen volume of probes, one sample per pixel.  Path tracing, primary and secondary DDGI take
their direct light from ReSTIR DI; all see the same first vertices.  History is cold in the first frame, and warm in the
last of a chain.  DDGI resampling has visibility in its MIS weights and the bound 10 per room height; beside it stands
the method as printed, which traces a single shadow ray and has G_max = 1.  Bias is that of converged images.
"""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.criteria import Outcome
from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments.cached import (
    METHODS,
    PLACES,
    Place,
    compared,
    converged,
    frozen,
    scenery,
)
from figures.experiments.deep import direct, truth, truth_of_trees
from figures.experiments.rendering import means
from figures.report import style
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.metrics import mape_with_floor

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Picture

LEAKING, LEAKTIGHT = "FS11", "FS11, 8 probes per unit"
SHOWN: Mapping[str, Place] = {**PLACES, LEAKTIGHT: Place("sunlit")}
OPEN = tuple(name for name in PLACES if name != LEAKING)
HISTORIES = ("cold", "warm")
TREES, PRIMARY, SECONDARY, OURS, PRINTED = range(len(METHODS))
ENOUGH = 64
"""Images, or batches, that can tell how many are needed, and whether means are equal."""

WHY = (
    "G_max = 1 has no unit in the paper.  Per room height it bounds most connections, and the ray that makes up for it "
    "is as noisy as secondary DDGI; DDGIR-F06 sweeps it."
)
"""Why nothing is refuted by the method as printed."""

BY_RAYS = "rays of path tracing / resampled"
NEVER = "inf: the mean of all images errs more than that, by noise or by bias."
MATCHED = 1.03
"""How much more than the error of one resampled frame counts as equal: Tab. 1 matches MAPE to some 3%."""

LONG = 1.25
"""Numbers of frames that are tried grow by this factor."""


def chunks(preset: Any) -> Sequence[Any]:
    """Chains of frames, and converged images, room by room."""
    rooms = [*PLACES, *preset["beside"]]
    chains = [{"room": name, "part": "chains", "block": k} for name in rooms for k in range(preset["blocks"])]
    return chains + [{"room": name, "part": "converged", "block": k} for name in PLACES for k in range(preset["means"])]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Images (history, method, replica, pixel) and costs; or means (batch, 3, pixel)."""
    of, chance = scenery(frozen(SHOWN[chunk["room"]], preset["tolerance"])), Live(rng)
    if chunk["part"] == "chains":
        return compared(of, preset["replicas"], preset["frames"], chance)
    return {"means": np.stack([converged(of, preset["samples"], chance) for _ in range(preset["batches"])])}


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Per room: images, costs (history, method, 2), converged means, and the truth: all light, and direct light."""
    listed, found = chunks(preset), {"frames": np.array(preset["frames"])}
    for name, place in SHOWN.items():
        if name not in (*PLACES, *preset["beside"]):
            continue
        mine = [r for c, r in zip(listed, results, strict=True) if c["room"] == name]
        chains, batches = [r for r in mine if "images" in r], [r["means"] for r in mine if "means" in r]
        found[f"{name}.images"] = np.concatenate([r["images"] for r in chains], axis=2)
        found[f"{name}.spent"] = np.mean([r["spent"] for r in chains], axis=0)
        found[f"{name}.drawn"] = np.mean([r["drawn"] for r in chains], axis=0)
        found[f"{name}.truth"], found[f"{name}.trees"] = truth(place.room), truth_of_trees(place.room)
        if batches:
            found[f"{name}.means"] = np.concatenate(batches)
            found[f"{name}.direct"] = direct(place.room)
    return found


# ---------------------------------------------------------------- numbers


def errors(a: Arrays, name: str) -> Array:
    """MAPE (history, method, replica)."""
    return mape_with_floor(a[f"{name}.images"], truths(a, name)[:, None])


def truths(a: Arrays, name: str) -> Array:
    """What each method is held against, (method, n): path tracing, which ends after some bounces, against as many."""
    return np.stack([a[f"{name}.trees"] if k == TREES else a[f"{name}.truth"] for k in range(len(METHODS))])


def variances(a: Arrays, name: str) -> Array:
    """Squares of what is not the mean over replicas, averaged over pixels: (history, method, replica)."""
    images = a[f"{name}.images"]
    R = images.shape[2]
    return np.asarray(((images - images.mean(axis=2, keepdims=True)) ** 2).mean(axis=-1) * R / (R - 1))


def biases(a: Arrays, name: str) -> Array:
    """MAPE of the converged images of primary and of secondary DDGI, and were their mean brightness right; (2, 2)."""
    tails, at, direct = a[f"{name}.means"][:, 1:].mean(axis=0), a[f"{name}.truth"], a[f"{name}.direct"]
    right = tails * ((at - direct).mean() / tails.mean(axis=-1, keepdims=True))
    return np.stack([mape_with_floor(direct + each, at) for each in (tails, right)])


def frames_to(images: Array, truth: Array, target: float) -> float:
    """How many of independent images (R, n) make a mean with a MAPE of at most `target`; inf if all do not."""
    T = 1.0
    while int(T) <= len(images):
        if mape_with_floor(means(images, int(T)), truth).mean() <= target:
            return float(int(T))
        T = max(int(T) + 1, T * LONG)
    return float("inf")


def frames(a: Arrays, name: str, history: int) -> Array:
    """Frames of METHODS to the error of one frame of DDGI resampling, matched to MATCHED; (method,)."""
    images, at = a[f"{name}.images"][history], truths(a, name)
    target = MATCHED * float(errors(a, name)[history, OURS].mean())
    return np.array([1.0 if k == OURS else frames_to(each, at[k], target) for k, each in enumerate(images)])


def speed_up(a: Arrays, name: str, history: int) -> float:
    """Rays of path tracing over those of one frame of DDGI resampling, to the error of this frame."""
    spent = a[f"{name}.spent"][history, :, 0]
    return float(frames(a, name, history)[TREES] * spent[TREES] / spent[OURS])


# ---------------------------------------------------------------- verdicts


def in_rooms(outcomes: Mapping[str, Outcome], least: int) -> Outcome:
    """Holds in at least so many rooms; what was measured in each."""
    said = "; ".join(f"{name} {short(o.measured)}{'' if o.passed else ' (no)'}" for name, o in outcomes.items())
    rule = f"{next(iter(outcomes.values())).criterion}, in at least {least} of {len(outcomes)}"
    return Outcome(said, rule, sum(bool(o.passed) for o in outcomes.values()) >= least)


def short(measured: float | str) -> str:
    """A number, or the first one of a text."""
    return f"{measured:.3g}" if isinstance(measured, float) else measured.removeprefix("bias ").split()[0]


def smaller(id_: str, x: Array, y: Array, limit: float, part: str) -> Claim:
    """x / y below a limit, refuted where it is above 1; paired replicas."""
    return Claim(id_, criteria.ratio_below(x, y, limit), part, criteria.ratio_above(x, y, 1))


CHARGED = (
    "As Tab. 1 does, one frame of each method is charged as one: histories, of ReSTIR DI's lights in path tracing and "
    "in secondary DDGI as well, are those of a sequence that is under way, and nobody pays for them."
)
LITTLE = (
    "In the insets of FS3, FS5 and FS13 primary queries have next to no bias to improve on: judged where they have "
    "some, in DDGIR-F08-FILMS."
)
WHOLE = (
    "An inset of 128 of 1920 pixels.  Fig. 8 shows whole images and measures their error: judged in DDGIR-F08-FILMS."
)
UNLIKE = {
    "cold": "The paper takes past frames too: no history is not its setting.",
    "printed": "G_max = 1 has no unit: 1 / room height is ours, and 1 / m in a room of 3 m would be 3.",
}
"""Why what is not the paper's setting is reported, whichever way it comes out."""


def check(a: Arrays) -> list[Claim]:
    """Everything, claim by claim."""
    both = [
        each for k in range(len(HISTORIES)) for each in (*check_noise(a, k), *check_leaks(a, k), *check_frames(a, k))
    ]
    return [*both, *check_bias(a), *check_cost(a)]


def check_noise(a: Arrays, k: int) -> list[Claim]:
    """Ratios of errors of one frame, with cold or warm history; the paper's is warm."""
    e = {name: errors(a, name)[k] for name in PLACES}

    def everywhere(x: int, y: int, limit: float, least: int) -> Claim:
        below = {name: criteria.ratio_below(e[name][x], e[name][y], limit) for name in OPEN}
        part = f"{METHODS[x]} / {METHODS[y]}, {HISTORIES[k]}"
        told = [WHOLE, *([UNLIKE["cold"]] if k == 0 else []), *([UNLIKE["printed"], WHY] if x == PRINTED else [])]
        return Claim("DDGIR-F08", criteria.reported(in_rooms(below, least).measured), part, reason="  ".join(told))

    door, room = e["FS3"], e["FS13"]
    rules = ((TREES, 0.7, 5), (SECONDARY, 0.9, 4))
    judged = [everywhere(x, y, limit, least) for y, limit, least in rules for x in (OURS, PRINTED)]
    if k == 0:
        ratios = [criteria.ratio_interval(door[x], door[SECONDARY])[2] for x in (OURS, PRINTED)]
        cold = criteria.reported(f"resampled {ratios[0]}, as printed {ratios[1]}")
        judged.append(Claim("DDGIR-F01", cold, f"resampled / secondary, {HISTORIES[k]}"))
    else:
        judged += [
            smaller("DDGIR-F01", door[x], door[SECONDARY], 1, f"{METHODS[x]} / secondary, {HISTORIES[k]}")
            for x in (OURS, PRINTED)
        ]
    return [
        *judged,
        smaller("DDGIR-F01", door[SECONDARY], door[TREES], 1, f"secondary / path tracing, {HISTORIES[k]}"),
        smaller("DDGIR-C06", room[PRIMARY], room[OURS], 1, f"primary / resampled, {HISTORIES[k]}"),
    ]


def check_leaks(a: Arrays, k: int) -> list[Claim]:
    """Where thin walls leak: nothing gained, and too bright."""
    e, images, at = errors(a, LEAKING)[k], a[f"{LEAKING}.images"][k], float(a[f"{LEAKING}.truth"].mean())
    history, beside = HISTORIES[k], ""
    if f"{LEAKTIGHT}.images" in a:
        tight = errors(a, LEAKTIGHT)[k].mean(axis=-1)
        ratio = f"{tight[OURS] / tight[SECONDARY]:.2f}"
        beside = f"  With 8 probes per unit, on either side of the walls, next to nothing leaks: {ratio} there."
    return [
        each
        for ours in (OURS, PRINTED)
        for each in (
            nothing_gained(e[ours], e[SECONDARY], f"{METHODS[ours]} / secondary, {history}", beside),
            Claim(
                "DDGIR-F08f",
                criteria.biased(images[ours].mean(axis=-1), at, 0, np.inf),
                f"leak of {METHODS[ours]}, {history}",
            ),
        )
    ]


def nothing_gained(ours: Array, secondary: Array, part: str, beside: str) -> Claim:
    """A ratio near 1."""
    if len(ours) < ENOUGH:
        return Claim("DDGIR-F08f", None, part, reason=f"{len(ours)} replicas cannot tell a ratio to some percent.")
    ratio = criteria.ratio_within(ours, secondary, 0.9, 1.3)
    return Claim("DDGIR-F08f", ratio, part, reason=f"Probes stand in the plane of the walls.{beside}")


def check_frames(a: Arrays, k: int) -> list[Claim]:
    """Frames, and rays, to the error of one frame."""
    T, history, R = {name: frames(a, name, k) for name in PLACES}, HISTORIES[k], a["FS2.images"].shape[2]
    parts = ("frames of secondary", "frames of path tracing / secondary", f"{LEAKING}: frames of secondary", BY_RAYS)
    if R < ENOUGH:
        few = f"{R} images cannot be averaged far enough."
        unjudged = [Claim("DDGIR-T1", None, f"{part}, {history}", reason=few) for part in parts]
        return [*unjudged, Claim("DDGIR-C04", None, f"{BY_RAYS}, {history}", reason=few)]
    faster = {name: criteria.above(speed_up(a, name, k), 10) for name in OPEN}
    secondary = {name: criteria.between(T[name][SECONDARY], 2, np.inf) for name in OPEN}
    trees = {name: criteria.above(least_ratio(T[name], R), 4.999) for name in OPEN}
    rays, reason = in_rooms(faster, 3), CHARGED
    leaking = criteria.below(T[LEAKING][SECONDARY], 1.001)
    outcomes = (in_rooms(secondary, len(OPEN)), in_rooms(trees, 3), leaking, rays)
    reasons = (NEVER, NEVER, "", reason)
    return [
        *(
            Claim("DDGIR-T1", outcome, f"{part}, {history}", reason=why)
            for part, outcome, why in zip(parts, outcomes, reasons, strict=True)
        ),
        Claim("DDGIR-C04", rays, f"{BY_RAYS}, {history}", reason=reason),
    ]


def least_ratio(T: Array, R: int) -> float:
    """Frames of path tracing, of R at most, over those of secondary DDGI; nan where no images of that are enough."""
    return float(min(T[TREES], R) / T[SECONDARY]) if np.isfinite(T[SECONDARY]) else float("nan")


def check_bias(a: Arrays) -> list[Claim]:
    """Noise and bias apart."""
    found = []
    for k, history in enumerate(HISTORIES):
        V = {name: variances(a, name)[k] for name in PLACES}
        for x, y in ((PRIMARY, OURS), (OURS, SECONDARY), (SECONDARY, TREES)):
            below = {name: criteria.ratio_below(each[x], each[y], 1) for name, each in V.items()}
            above = {name: criteria.ratio_above(each[x], each[y], 1) for name, each in V.items()}
            part = f"variance, {METHODS[x]} < {METHODS[y]}, {history}"
            opposite = in_rooms(above, len(V) // 2) if k else None
            found.append(Claim("DDGIR-F08b", in_rooms(below, len(V)), part, opposite))
        found.append(check_means(a, k))
    B = {name: biases(a, name) for name in PLACES}
    less, even = ({name: criteria.below(b[k, 1] / b[k, 0], 1) for name, b in B.items()} for k in range(2))
    reason = (
        "Direct light in updates of probes is attenuated by too much in open rooms, which primary DDGI does not suffer "
        f"from.  Were both right in the mean, as the paper's slider allows: {in_rooms(even, 4).measured}."
    )
    part, enough = "bias, secondary / primary", len(a["FS2.means"]) >= ENOUGH
    few = Claim("DDGIR-F08b", None, part, reason="Too few samples for images without noise.")
    beside = Claim("DDGIR-F08b", criteria.reported(in_rooms(less, 4).measured), part, reason=f"{reason}  {LITTLE}")
    found.append(beside if enough else few)
    return [*found, *check_trees(a), *reported({name: b[0] for name, b in B.items()})]


def check_means(a: Arrays, k: int) -> Claim:
    """Resampling keeps the mean of secondary DDGI."""
    part, R = f"mean, resampled = secondary, {HISTORIES[k]}", a["FS2.images"].shape[2]
    if R < ENOUGH:
        return Claim("DDGIR-F08b", None, part, reason=f"{R} replicas cannot tell.")
    equal = {name: same_mean(a, name, k) for name in PLACES}
    bright = "; ".join(f"{name} {short(same_mean(a, name, k, PRINTED).measured)}" for name in PLACES)
    return Claim("DDGIR-F08b", in_rooms(equal, len(equal)), part, reason=f"As printed: {bright}.")


def same_mean(a: Arrays, name: str, k: int, ours: int = OURS) -> Outcome:
    """E[resampled] = E[secondary], by images that share their x_1."""
    images = a[f"{name}.images"][k].mean(axis=-1)
    at = float(images[SECONDARY].mean())
    return criteria.unbiased(images[ours] - images[SECONDARY] + at, at, 0.02)


def check_trees(a: Arrays) -> list[Claim]:
    """Path tracing with direct light by ReSTIR DI has no bias."""
    found = {
        name: criteria.unbiased(a[f"{name}.means"][:, 0].mean(axis=-1), float(a[f"{name}.trees"].mean()))
        for name in PLACES
    }
    unbiased = in_rooms(found, len(found))
    return [
        Claim(id_, unbiased, "bias of path tracing")
        if len(a["FS2.means"]) >= ENOUGH
        else Claim(id_, None, "bias of path tracing", reason="Batches are too few, and too noisy behind the door.")
        for id_ in ("DDGIR-F08b", "DDGIR-A10")
    ]


def reported(B: Mapping[str, Array]) -> list[Claim]:
    """Bias of both ways to ask probes."""
    primary, secondary = (criteria.reported("; ".join(f"{name} {b[k]:.3f}" for name, b in B.items())) for k in range(2))
    both = criteria.reported(f"primary {primary.measured}; secondary {secondary.measured}")
    return [
        Claim("DDGIR-A10", both, "bias of probes"),
        Claim("COM-B09", primary, "MAPE of converged images"),
        Claim("COM-B10", secondary, "MAPE of converged images"),
    ]


def check_cost(a: Arrays) -> list[Claim]:
    """Rays and queries, per pixel and frame."""
    spent = {name: a[f"{name}.spent"][1] for name in PLACES}
    fewer = {
        METHODS[k]: criteria.below(max(each[k, 0] / each[TREES, 0] for each in spent.values()), 1)
        for k in (SECONDARY, OURS, PRINTED)
    }
    table = "; ".join(
        f"{METHODS[k]} {np.mean([each[k, 0] for each in spent.values()]):.1f} rays, "
        f"{np.mean([each[k, 1] for each in spent.values()]):.1f} queries"
        for k in range(len(METHODS))
    )
    parts = np.mean(
        [[each[OURS, 0] / each[SECONDARY, 0], each[OURS, 0] / each[PRIMARY, 0]] for each in spent.values()], axis=0
    )
    added = max(float(a[f"{name}.drawn"][1, 0]) for name in PLACES) - 1
    return [
        Claim("DDGIR-T2", in_rooms(fewer, len(fewer)), "rays / those of path tracing, most of all rooms"),
        Claim("DDGIR-T2", criteria.equal_to(added, 0.0), "rays that resampling adds, as printed"),
        Claim("DDGIR-T2", criteria.reported(table), "mean of all rooms, warm"),
        Claim(
            "DDGIR-C04",
            criteria.reported(f"{parts[0]:.2f} of secondary's, {parts[1]:.2f} of primary's"),
            "rays of a frame, warm",
        ),
    ]


# ---------------------------------------------------------------- picture


def draw(a: Arrays) -> "Picture":
    """Errors of a frame, noise against bias, frames to equal error, and images of the door ajar."""
    picture, axes = style.panels(2, 2, width=6.2, height=3.6)
    draw_errors(axes[0, 0], a)
    draw_both(axes[0, 1], a)
    draw_frames(axes[1, 0], a)
    draw_images(axes[1, 1], a)
    return picture


def draw_errors(axis: "Axes", a: Arrays) -> None:
    """MAPE of one frame: warm as bars, cold as marks."""
    for k, method in enumerate(METHODS):
        place = np.arange(len(PLACES)) + 0.16 * (k - 2)
        cold, warm = np.transpose([errors(a, name)[:, k].mean(axis=-1) for name in PLACES])
        axis.bar(place, warm, 0.15, **style.bar(method))
        axis.plot(place, cold, ls="", marker="_", color=style.INK, ms=7, label="cold history" if k == 0 else None)
    axis.set_yscale("log")
    axis.set_xticks(range(len(PLACES)), list(PLACES))
    axis.set(ylabel="MAPE", title="Error of one frame, warm history", ylim=(None, 30))
    axis.legend(loc="upper left", ncols=2)


def draw_both(axis: "Axes", a: Arrays) -> None:
    """Noise of a warm frame over the bias of its converged image; one mark per room."""
    for k, method in enumerate(METHODS):
        if k == TREES:
            continue
        bias = [biases(a, name)[0, 0 if k == PRIMARY else 1] for name in PLACES]
        noise = [np.sqrt(variances(a, name)[1, k].mean()) / a[f"{name}.truth"].mean() for name in PLACES]
        axis.loglog(bias, noise, **style.look(method, ls=""))
    axis.set(
        xlabel="bias: MAPE of the converged image",
        ylabel="noise: rms / mean radiance",
        title="Noise and bias of a warm frame, by room",
    )
    style.below(axis)


def draw_frames(axis: "Axes", a: Arrays) -> None:
    """Frames to the error of one frame of DDGI resampling."""
    for j, k in enumerate((TREES, SECONDARY)):
        cold, warm = np.transpose([[frames(a, name, h)[k] for h in (0, 1)] for name in PLACES])
        place, known = np.arange(len(warm)) + 0.36 * (j - 0.5), np.isfinite(warm)
        axis.bar(place[known], warm[known], 0.34, **style.bar(METHODS[k]))
        for x in place[~known]:
            axis.text(x, 1.2, "never", rotation=90, ha="center", va="bottom", fontsize=9)
        also = np.isfinite(cold)
        label = "cold history" if j == 0 else None
        axis.plot(place[also], cold[also], ls="", marker="_", color=style.INK, ms=12, label=label)
    axis.set_yscale("log")
    axis.set_xticks(range(len(PLACES)), list(PLACES))
    axis.set(ylabel="frames", title="To the error of one resampled frame, warm", ylim=(0.8, None))
    style.below(axis, ncols=3)


def draw_images(axis: "Axes", a: Arrays) -> None:
    """The door ajar, one warm frame of each method."""
    at = a["FS3.truth"]
    rows = [*a["FS3.images"][1, :, 0], at]
    style.strips(axis, rows, [*METHODS, "reference"], float(2 * at.max()), len(at))
    axis.set(xlabel="pixel", title="Behind the door ajar, FS3")


SETUP = "six rooms of flatland (FS2, FS3, FS4, FS5, FS11, FS13), cold and warm history"

CLAIMS = (
    "DDGIR-F01",
    "DDGIR-F08",
    "DDGIR-F08b",
    "DDGIR-F08f",
    "DDGIR-T1",
    "DDGIR-T2",
    "DDGIR-C04",
    "DDGIR-C06",
    "DDGIR-A10",
    "COM-B09",
    "COM-B10",
)

FIGURE = Figure(
    id="DDGIR-F08",
    title="Probes at the second vertex, resampled",
    world="flatland2d",
    source="[DDGIR Fig. 1, 2, 8; Tab. 1, 2]",
    claims=CLAIMS,
    conditions=(
        Conditions(
            CLAIMS,
            "[DDGIR Fig. 8, Tab. 1; 4]",
            Setup("real time", "still", "all", "six rooms, one sample per pixel"),
            Setup("real time", "still", "all", SETUP),
        ),
    ),
    presets={
        "quick": {
            "blocks": 1,
            "replicas": 8,
            "frames": 6,
            "means": 1,
            "batches": 2,
            "samples": 32,
            "tolerance": 0.05,
            "beside": [],
        },
        "paper": {
            "blocks": 12,
            "replicas": 16,
            "frames": 20,
            "means": 4,
            "batches": 16,
            "samples": 64,
            "tolerance": 0.01,
            "beside": [LEAKTIGHT],
        },
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)

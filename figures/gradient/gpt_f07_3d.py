"""GPT Fig. 1, 7 and 8 in space: differences and reconstructed images at the paper's counts, in motion and at rest.

A frame with pair reuse is held against as many averaged ones of the others as the paper averages, 2 of gradient after
ReSTIR, 3 paths of gradient-domain path tracing and 4 of Area ReSTIR; what comes out at equal rays is beside it.  Each
scene is seen through the middle of its own inset of the virtual 1920 x 1080 film, which was fixed long before.  The
moving camera is the paper's, and judged at two paces; its crop follows what its centre sees.  The still one stands
beside it, and in one scene a crop that slides by whole pixels.

Of the up to four previous pixels that a moved one overlaps, what lies in its square is kept, and the rest either
rejected or moved into it: Area ReSTIR has both options, and the paper does not say which it took.  So either is an arm,
and a claim holds that holds by one of them in two of three scenes.  What asking one pixel blindly does is reported.
All are unbiased before reconstruction, and L2 keeps that, so that the variance over replicas is the squared error; L1
and a filter have their bias added, from the mean of all L2 images.  Images are compared by the squared error and by the
same relative to the pixel of that mean, as the paper names neither, and against the best image without differences, by
either option, with reuse in space or without.
"""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments import by_metrics, solid
from figures.experiments.by_metrics import MSE, Bands, ByMetric
from figures.experiments.following import followed, frugal, gathered, in_place, views_of
from figures.experiments.gradients import ADAPTIVE, METHODS, Method, averaged, spread, temporal_only
from figures.experiments.replicas import few, told
from figures.experiments.scenewise import Sorted, in_enough, sorted_by, standing, words
from figures.report import style
from restir_ref.batch import Array, ratio, take
from restir_ref.chance import Live
from restir_ref.gradient_loop import GRADIENT, PRIMAL, Group, Parts, View, forward, step
from restir_ref.integrals import Pixels, shifted, target
from restir_ref.poisson import ALPHA, l2
from restir_ref.poisson_l1 import l1
from restir_ref.transport.edges import edges, seen, unlike
from tracer3d.scenes import Setting, checker
from tracer3d.sensors import Pinhole

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

SCENES: Mapping[str, Callable[[], Setting]] = MappingProxyType({**solid.SCENES, "Checker3": checker})
ARMS: Mapping[str, Method] = MappingProxyType({**METHODS, "temporal": temporal_only})
SHARES = {"with": 1, "after": 2, "path tracing": 3, "temporal": 1}
"""Images of each method that are averaged: as many as the paper averages in 30 ms.  [GPT Fig. 8]"""

AREA = 4
"""Images of Area ReSTIR that the paper averages: those of "after", or of "temporal" where reuse in space costs."""

NORMS: Mapping[str, Callable[..., Array]] = MappingProxyType({"L2": l2, "L1": l1})

HALVES, FIFTHS, STILL = "moving by halves", "moving by fifths", "still"
WHOLE, BLIND = "whole pixels", "one of four, blindly"
PACES = (HALVES, FIFTHS)

KEPT, GATHERED = "kept", "gathered"
OPTIONS: Mapping[str, Callable[[View], View]] = MappingProxyType({KEPT: in_place, GATHERED: gathered})
"""Both options of Area ReSTIR: what lies in the square is kept and the rest rejected, or moved into it."""


def moving(pace: str, option: str) -> str:
    """The camera of a pace whose history follows by an option."""
    return f"{pace}, {option}"


MOVING = tuple(moving(pace, option) for option in OPTIONS for pace in PACES)
"""The cameras that are judged."""

FIFTH = (1 - 3**-0.5) / 2
"""The fraction at which a square lies in as many pixels, 1 / sum b^2 = 9/4, as over all fractions on average.

b are the shares of its area: over all fractions f the mean of f^2 + (1 - f)^2 is 2/3 along either axis.  At halves of
a pixel these are four, which is the worst case of rejection.
"""

CONTROL = "Checker3"
"""The scene that is also seen by a crop that slides by whole pixels."""

MOVED, LOST = "moved", 0.1
"""The chunk that moves samples by a pixel, and the share of its target below which a sample counts as lost."""

REACH = 3
"""Pixels: the width of the bilateral filter."""


# ---------------------------------------------------------------- cameras


def slower(s: Setting, side: int, frames: int) -> list[Pinhole]:
    """The camera that moves by two pixels and a fraction of the usual size to the right, and by this fraction up."""
    return followed(replace(s, pace=(2 + FIFTH, FIFTH)), side, frames)


def resting(s: Setting, side: int, frames: int) -> list[Pinhole]:
    """The last crop of the moving camera, in all frames."""
    return followed(s, side, 1) * frames


def sliding(s: Setting, side: int, frames: int) -> list[Pinhole]:
    """A camera at rest whose crop slides by one pixel to the right and one down per frame, and arrives there."""
    (last,) = followed(s, side, 1)
    return [replace(last, left=last.left + k, top=last.top + k) for k in range(1 - frames, 1)]


@dataclass(frozen=True)
class Camera:
    """The sensors of all frames of a setting, and how a view's history follows the motion."""

    sensors: Callable[[Setting, int, int], list[Pinhole]]
    history: Callable[[View], View] = in_place


SENSORS: Mapping[str, Callable[[Setting, int, int], list[Pinhole]]] = MappingProxyType(
    {HALVES: followed, FIFTHS: slower}
)
CAMERAS: Mapping[str, Camera] = MappingProxyType(
    {
        **{
            moving(pace, option): Camera(sensors, history)
            for option, history in OPTIONS.items()
            for pace, sensors in SENSORS.items()
        },
        STILL: Camera(resting),
        WHOLE: Camera(sliding),
        BLIND: Camera(followed, frugal),
    }
)


# ---------------------------------------------------------------- computing


def chunks(preset: Any) -> Sequence[dict[str, Any]]:
    """One per camera, scene, method and block of replicas; and one per scene that moves samples by a pixel."""
    runs = [(camera, scene, method) for scene in preset["scenes"] for camera in (*MOVING, STILL) for method in ARMS]
    runs += [(WHOLE, scene, "with") for scene in preset["scenes"] if scene == CONTROL]
    runs += [(BLIND, scene, "with") for scene in preset["scenes"]]
    found = [
        {"camera": camera, "scene": scene, "method": method, "block": block}
        for camera, scene, method in runs
        for block in range(preset["blocks"])
    ]
    return found + [{"camera": STILL, "scene": scene, "method": MOVED, "block": 0} for scene in preset["scenes"]]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Averages of image and differences, (replicas, n), the L2 and L1 images, and rays per pixel."""
    method, s = chunk["method"], SCENES[chunk["scene"]]()
    if method == MOVED:
        return lost_by_a_pixel(s, preset, rng)
    side, share, asked = preset["side"], SHARES[method], Counter[str]()
    camera = CAMERAS[chunk["camera"]]
    views = views_of(s, camera.sensors(s, side, preset["frames"]), GRADIENT, ADAPTIVE, asked)
    found = ARMS[method]([*map(camera.history, views)], asked, share * preset["replicas"], Live(rng))
    mean = {name: averaged(found[name], share) for name in (PRIMAL, "dx", "dy")}
    shapes = {PRIMAL: (side, side), "dx": (side, side - 1), "dy": (side - 1, side)}
    inputs = [mean[name].reshape(-1, *shape) for name, shape in shapes.items()]
    rebuilt = {name: norm(*inputs) for name, norm in NORMS.items() if method in METHODS}
    return mean | rebuilt | {"rays": found["rays"] * share}


def lost_by_a_pixel(s: Setting, preset: Any, rng: np.random.Generator) -> Arrays:
    """Of a frame's samples, by their p_hat W: the share whose p_hat J is below LOST p_hat one pixel to the right."""
    (view,) = views_of(s, resting(s, preset["side"], 1), GRADIENT, ADAPTIVE, Counter())
    X = step(view, Live(rng), GRADIENT, preset["replicas"])
    return {name: np.array(lost(view[name], X[name], preset["replicas"])) for name in view}


def lost(group: Group, X: Parts, replicas: int) -> float:
    """The share of one group, all of its parts together."""
    pixel = np.arange(replicas * group.n)
    here = pixel[pixel % group.shape[1] < group.shape[1] - 1]
    gone = whole = 0.0
    for part, of in group.of.items():
        x, at = take(X[part], here), Pixels(of, here)
        y, p = shifted(x.x, at, Pixels(of, here + 1)), target(at, x.x)
        mass = p * x.W
        gone += float(mass[target(Pixels(of, here + 1), y.x) * y.J < LOST * p].sum())
        whole += float(mass.sum())
    return float(ratio(np.array(gone), np.array(whole)))


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """All blocks by "camera.scene.method.name"; rays and shares as their mean."""
    found: dict[str, list[Array]] = {}
    for at, part in zip(chunks(preset), results, strict=True):
        for key, each in part.items():
            found.setdefault(f"{at['camera']}.{at['scene']}.{at['method']}.{key}", []).append(each)
    return {key: np.concatenate(parts) if parts[0].ndim else np.asarray(np.mean(parts)) for key, parts in found.items()}


# ---------------------------------------------------------------- errors


Cost = Callable[[Arrays, str, str], float]
"""By how much the variance of a method's average counts, in a view, "camera.scene"."""


def dearer(a: Arrays, view: str, method: str) -> float:
    """Rays of a method's average over those of one frame with pair reuse."""
    return float(a[f"{view}.{method}.rays"] / a[f"{view}.with.rays"])


def as_averaged(a: Arrays, view: str, method: str) -> float:
    """1: as many images as the paper averages are averaged here."""
    return 1.0


def gradient_error(a: Arrays, view: str, method: str, cost: Cost = dearer) -> Array:
    """Variance of dx and dy at the cost of one frame with pair reuse, of every replica; (R,)."""
    return spread([a[f"{view}.{method}.dx"], a[f"{view}.{method}.dy"]]) * cost(a, view, method)


def truth(a: Arrays, scene: str) -> Array:
    """The mean of all L2 images of a scene, by method and camera: all are unbiased; (side, side)."""
    each = [a[f"{camera}.{scene}.{method}.L2"].mean(axis=0) for camera in (*MOVING, STILL) for method in METHODS]
    return np.asarray(np.mean(each, axis=0))


def power(a: Arrays, view: str, method: str, image: str, cost: Cost = dearer) -> Bands:
    """Noise of one method's image at the cost of one frame with pair reuse, and the bias of L1, by band and metric."""
    biased = float(image == "L1")
    return error_of(a, view, a[f"{view}.{method}.{image}"], cost(a, view, method), biased=biased)


def error_of(a: Arrays, view: str, images: Array, cost: float, *, biased: float) -> Bands:
    """That of images (R, ...) about their mean at equal cost, and so many times how far that is from the truth."""
    right = truth(a, view.split(".")[1])
    return by_metrics.bands(by_metrics.off(images.reshape(-1, *right.shape), right, cost, biased), right, ALPHA)


def one_image(a: Arrays, view: str, method: str) -> float:
    """Of one image alone, not of those that are averaged."""
    return float(SHARES[method])


def rivals(view: str) -> list[tuple[str, str]]:
    """The images without differences, (view, method): with reuse in space or without, in motion by either option."""
    camera, scene = view.split(".")
    pace = camera.partition(", ")[0]
    cameras = [each for each in (*MOVING, STILL) if each.partition(", ")[0] == pace]
    return [(f"{each}.{scene}", method) for each in cameras for method in ("after", "temporal")]


def area(a: Arrays, view: str) -> Bands:
    """The power of the error of as many images of Area ReSTIR as the paper averages, by the best of its methods."""
    return by_metrics.best(
        [
            error_of(a, view, a[f"{at}.{method}.{PRIMAL}"], SHARES[method] / AREA, biased=0.0)
            for at, method in rivals(view)
        ]
    )


def alone(a: Arrays, view: str) -> Bands:
    """The power of the error of the best image without differences, at the rays of a view's frame with pair reuse."""
    return by_metrics.best(
        [
            error_of(a, view, a[f"{at}.{method}.{PRIMAL}"], beside(a, view, at, method), biased=0.0)
            for at, method in rivals(view)
        ]
    )


def beside(a: Arrays, view: str, at: str, method: str) -> float:
    """Rays of a method's average in a view over those of one frame with pair reuse in another one."""
    return float(a[f"{at}.{method}.rays"] / a[f"{view}.with.rays"])


def bilateral(a: Arrays, view: str) -> Bands:
    """The same after a joint bilateral filter: the mean over like pixels, weighted by exp(-|i - j|^2 / 2 REACH^2)."""
    scene = view.split(".")[1]
    w = like(scene, len(truth(a, scene)))
    return by_metrics.best(
        [
            error_of(a, view, a[f"{at}.{method}.{PRIMAL}"] @ w.T, beside(a, view, at, method), biased=1.0)
            for at, method in rivals(view)
        ]
    )


def like(scene: str, side: int) -> Array:
    """The weights of the filter, rows sum to 1; (n, n)."""
    s = SCENES[scene]()
    g, (i, j) = seen(s.scene, followed(s, side, 1)[0]), np.indices((side**2, side**2))
    far = (i % side - j % side) ** 2 + (i // side - j // side) ** 2
    w = np.exp(-far / 2 / REACH**2) * ~unlike(g, i.ravel(), j.ravel()).reshape(i.shape)
    return np.asarray(w / w.sum(axis=1, keepdims=True))


def scenes_of(a: Arrays) -> list[str]:
    """The scenes that were rendered."""
    return [scene for scene in SCENES if f"{STILL}.{scene}.with.dx" in a]


# ---------------------------------------------------------------- judging


def check(a: Arrays) -> list[Claim]:
    """Moving cameras at the paper's counts; equal rays and the still one beside; a whole pixel; L1, a filter."""
    claims = [*(judged(a, pace, each) for pace in PACES for each in JUDGED), at_rest(a)]
    claims += [smallest(a, pace) for pace in PACES] + [rest_images(a, norm) for norm in NORMS]
    claims += [lower(a)] + [exact(a, scene) for scene in scenes_of(a)]
    for scene in scenes_of(a):
        claims += [
            *counts(a, scene),
            *differences(a, scene),
            *otherwise(a, scene),
            *images(a, scene),
            *gained(a, scene),
            *norms(a, scene),
            *filters(a, scene),
        ]
    return [*claims, *options(a), *whole_pixels(a)]


@dataclass(frozen=True)
class Comparison:
    """Errors of ours and of another method (R,), and the ratio of their means that is asked for."""

    name: str
    ours: Array
    theirs: Array
    limit: float


Compared = Callable[[Arrays, str], list[Comparison]]
"""The comparisons of a view, "camera.scene", at the paper's counts."""


def of_differences(a: Arrays, view: str) -> list[Comparison]:
    """dx and dy: lowest, and below .8 of those after ReSTIR."""
    ours, after, traced = (gradient_error(a, view, method, as_averaged) for method in METHODS)
    return [Comparison("with / after", ours, after, 0.8), Comparison("with / path tracing", ours, traced, 1.0)]


def of_rebuilt(norm: str, metric: str) -> Compared:
    """Reconstructed images: the cleanest, and above alpha below .8 of the images of Area ReSTIR."""

    def compared(a: Arrays, view: str) -> list[Comparison]:
        ours, after, traced = (power(a, view, method, norm, as_averaged) for method in METHODS)
        return [
            Comparison("with / after", ours["total"][metric], after["total"][metric], 1.0),
            Comparison("with / path tracing", ours["total"][metric], traced["total"][metric], 1.0),
            Comparison("above alpha, with / Area ReSTIR", ours["high"][metric], area(a, view)["high"][metric], 0.8),
        ]

    return compared


def of_noise(norm: str, metric: str) -> Compared:
    """Reconstructed images above alpha: below .8 of both others."""

    def compared(a: Arrays, view: str) -> list[Comparison]:
        ours, traced = (
            power(a, view, method, norm, as_averaged)["high"][metric] for method in ("with", "path tracing")
        )
        return [
            Comparison("above alpha, with / path tracing", ours, traced, 0.8),
            Comparison("above alpha, with / Area ReSTIR", ours, area(a, view)["high"][metric], 0.8),
        ]

    return compared


def by_both(of: Callable[[str, str], Compared], norm: str) -> dict[str, Compared]:
    """The comparisons of images by every metric."""
    return {metric: of(norm, metric) for metric in by_metrics.METRICS}


@dataclass(frozen=True)
class Judged:
    """A claim, of what, and the comparisons that a scene has to meet by every metric; nameless is the variance."""

    id: str
    of: str
    by: Mapping[str, Compared]


JUDGED: Sequence[Judged] = (
    Judged("GPT-F07", "dx and dy", {"": of_differences}),
    *(Judged("GPT-F08", norm, by_both(of_rebuilt, norm)) for norm in NORMS),
    *(Judged("GPT-F01", norm, by_both(of_noise, norm)) for norm in NORMS),
)
"""What is judged at either pace."""


def on_most(a: Arrays, pace: str, id_: str, of: str, compared: Compared) -> Claim:
    """All comparisons of a scene by one nameless measure: `judged`."""
    return judged(a, pace, Judged(id_, of, {"": compared}))


def judged(a: Arrays, pace: str, what: Judged) -> Claim:
    """All comparisons of a scene are met, in two of three scenes, by at least one option of Area ReSTIR.

    It fails if under either option too many scenes miss one with certainty; between the two replicas do not tell.
    Of images a scene must meet them, or miss one, by every metric.
    """
    part = f"{pace}, the paper's counts, {what.of}, two of three scenes"
    any_view = f"{moving(pace, KEPT)}.{scenes_of(a)[0]}"
    if trouble := few(a[f"{any_view}.with.dx"]):
        return Claim(what.id, None, part, reason=trouble)
    found = {m: {option: by_standing(a, moving(pace, option), c) for option in OPTIONS} for m, c in what.by.items()}
    agreed = {option: by_metrics.agreed([options[option] for options in found.values()]) for option in OPTIONS}
    passed = by_an_option(agreed, least(a))
    measured = ". ".join(
        f"{metric}, {option}: {words(scenes)}".removeprefix(", ")
        for metric, options in found.items()
        for option, scenes in options.items()
    )
    if passed is None:
        return Claim(what.id, None, part, reason=f"Undecided. {measured}.")
    comparisons = next(iter(what.by.values()))(a, any_view)
    rule = f"in 2 of 3 scenes, by one option{metrics_of(what)}: "
    rule += "; ".join(f"{each.name} < {each.limit:g} at 95%" for each in comparisons)
    enough = [option for option, scenes in agreed.items() if by_metrics.answer(scenes, least(a))]
    caveat = f"Only where history is {enough[0]}." if len(enough) == 1 else ""
    return Claim(what.id, criteria.Outcome(measured, rule, passed), part, caveat=caveat, reason=WITHIN)


def by_an_option(options: Mapping[str, Sorted], least: int) -> bool | None:
    """True where one of them has enough scenes, False where none can have them any more, None in between."""
    answers = [by_metrics.answer(scenes, least) for scenes in options.values()]
    if True in answers:
        return True
    return None if None in answers else False


def metrics_of(what: Judged) -> str:
    """By which metrics a scene is asked, in words; nothing for the nameless one."""
    return f", by {by_metrics.both(what.by)}" if len(what.by) > 1 else ""


WITHIN = (
    "Crops of 32 pixels with few edges (below): what the paper's rooms have in clutter and texture is hardly in them. "
    "Variance counts outliers most; the mean size of errors, which they do not carry, is below."
)


def least(a: Arrays) -> int:
    """Two of three scenes."""
    return -(-2 * len(scenes_of(a)) // 3)


def by_standing(a: Arrays, camera: str, compared: Compared) -> Sorted:
    """Scenes that meet all comparisons, that miss one for certain, and the others."""
    limits = {
        scene: [((c.ours, c.theirs), c.limit) for c in compared(a, f"{camera}.{scene}")] for scene in scenes_of(a)
    }
    return sorted_by({scene: standing(each) for scene, each in limits.items()})


def of_sizes(a: Arrays, view: str) -> list[Comparison]:
    """The mean size of errors of dx and dy: the smallest of the three."""
    ours, *others = (sizes(a, view, method) for method in METHODS)
    return [Comparison("", ours, theirs, 1.0) for theirs in others]


def smallest(a: Arrays, pace: str) -> Claim:
    """In which scenes pair reuse has the smallest errors by their mean size, by either option."""
    part = f"{pace}, the paper's counts, dx and dy, where the mean size of errors is below both others'"
    if trouble := few(a[f"{moving(pace, KEPT)}.{scenes_of(a)[0]}.with.dx"]):
        return Claim("GPT-F07", None, part, reason=trouble)
    found = {option: words(by_standing(a, moving(pace, option), of_sizes)) for option in OPTIONS}
    return Claim("GPT-F07", criteria.reported(". ".join(f"{option}: {each}" for option, each in found.items())), part)


def at_rest(a: Arrays) -> Claim:
    """dx and dy of a camera that stands still, at equal rays: below .8 of both others in two of three scenes."""
    scenes = {scene: list(against(a, f"{STILL}.{scene}").values())[:2] for scene in scenes_of(a)}
    return in_enough("GPT-F07", scenes, (0.8, least(a)), f"{STILL}, equal rays, dx and dy", YOUNG)


def rest_images(a: Arrays, norm: str) -> Claim:
    """Reconstructed images of a camera at rest, above alpha: below .8 of the best image alone at equal rays."""
    found = {
        scene: (power(a, f"{STILL}.{scene}", "with", norm), alone(a, f"{STILL}.{scene}")) for scene in scenes_of(a)
    }
    compared = {scene: by_metrics.pairs(ours["high"], image["high"]) for scene, (ours, image) in found.items()}
    part = f"{STILL}, equal rays, {norm}, above alpha, with / image alone"
    return by_metrics.in_enough("GPT-F08", compared, (0.8, least(a)), part, YOUNG)


YOUNG = "The last of 21 frames, a cap and one: a history that stands still goes on to half of its variance there."


def against(a: Arrays, view: str) -> dict[str, tuple[Array, Array]]:
    """dx and dy at equal rays: pair reuse against both others, and these against each other."""
    ours, after, traced = (gradient_error(a, view, method) for method in METHODS)
    return {
        "with / after": (ours, after),
        "with / path tracing": (ours, traced),
        "after / path tracing": (after, traced),
    }


def counts(a: Arrays, scene: str) -> list[Claim]:
    """What is judged, scene by scene and by either option, by every metric."""
    claims = []
    for camera in MOVING:
        for what in JUDGED:
            by = {metric: compared(a, f"{camera}.{scene}") for metric, compared in what.by.items()}
            for k, name in enumerate(each.name for each in next(iter(by.values()))):
                pairs = {metric: (found[k].ours, found[k].theirs) for metric, found in by.items()}
                part = f"{camera}, {scene}, the paper's counts, {what.of}, {name}"
                claims.append(by_metrics.told(what.id, pairs, part))
    return claims


def differences(a: Arrays, scene: str) -> list[Claim]:
    """dx and dy at equal rays: pair reuse against both others."""
    return [
        told("GPT-F07", pair, f"{camera}, {scene}, equal rays, {name}")
        for camera in (*MOVING, STILL)
        for name, pair in against(a, f"{camera}.{scene}").items()
    ]


def otherwise(a: Arrays, scene: str) -> list[Claim]:
    """dx and dy at the paper's counts by another measure, which outliers do not carry, and at edges and elsewhere."""
    claims, edge = [], edge_of(a, scene)
    measures: Mapping[str, Callable[[str, str], Array]] = {
        "mean size of errors": lambda view, method: sizes(a, view, method),
        "edge pairs": lambda view, method: among(a, view, method, edge),
        "other pairs": lambda view, method: among(a, view, method, {name: ~at for name, at in edge.items()}),
    }
    for camera in MOVING:
        for name, measure in measures.items():
            ours, after, traced = (measure(f"{camera}.{scene}", method) for method in METHODS)
            part = f"{camera}, {scene}, the paper's counts, dx and dy, {name}"
            claims.append(told("GPT-F07", (ours, after), f"{part}, with / after"))
            claims.append(told("GPT-F07", (ours, traced), f"{part}, with / path tracing"))
    return claims


def sizes(a: Arrays, view: str, method: str) -> Array:
    """mean |error| of dx and dy, of every replica; (R,)."""
    parts = [a[f"{view}.{method}.{name}"] for name in ("dx", "dy")]
    return np.asarray(sum(abs(each - each.mean(axis=0)).mean(axis=1) for each in parts))


def among(a: Arrays, view: str, method: str, at: Mapping[str, Array]) -> Array:
    """Variance of dx and dy of some pairs, of every replica, nothing where there are none; (R,)."""
    found = [a[f"{view}.{method}.{name}"][:, which] for name, which in at.items() if which.any()]
    return spread(found) if found else np.zeros(len(a[f"{view}.{method}.dx"]))


def images(a: Arrays, scene: str) -> list[Claim]:
    """Reconstructed images at equal rays, against the other gradients' and the best image without differences."""
    claims = []
    for norm in NORMS:
        for camera in (*MOVING, STILL):
            part = f"{camera}, {scene}, {norm}, equal rays"
            ours, after, traced = (power(a, f"{camera}.{scene}", method, norm) for method in METHODS)
            image = alone(a, f"{camera}.{scene}")
            claims += [
                over("GPT-F01", (ours["high"], traced["high"]), f"{part}, above alpha, with / path tracing"),
                over("GPT-F08", (ours["total"], after["total"]), f"{part}, with / after"),
                over("GPT-F08", (ours["total"], traced["total"]), f"{part}, with / path tracing"),
                over("GPT-F08", (ours["high"], image["high"]), f"{part}, above alpha, with / image alone"),
                over("GPT-F08", (ours["total"], image["total"]), f"{part}, with / image alone"),
            ]
    return claims


def over(id_: str, errors: tuple[ByMetric, ByMetric], part: str) -> Claim:
    """The first error over the other by every metric, reported."""
    return by_metrics.told(id_, by_metrics.pairs(*errors), part)


def gained(a: Arrays, scene: str) -> list[Claim]:
    """One frame's image with history and reuse in space, over one path tree."""
    claims = []
    for camera in (*MOVING, STILL):
        image, tree = (
            power(a, f"{camera}.{scene}", method, PRIMAL, one_image)["total"] for method in ("after", "path tracing")
        )
        claims.append(over("GPT-F08", (image, tree), f"{camera}, {scene}, image alone / one path tree"))
    return claims


OF_NORMS = moving(HALVES, KEPT)
"""The camera by which L1 and L2 are compared; path tracing has no history, and sees the same by every one."""


def lower(a: Arrays) -> Claim:
    """L1 against L2, bias and all: in at least half of the cases that are decided, all scenes and all methods."""
    cases = {f"{scene} {method}": l1_over_l2(a, scene, method) for scene in scenes_of(a) for method in METHODS}
    return by_metrics.often("GPT-C03", cases, "L1 / L2, all scenes and methods")


def l1_over_l2(a: Arrays, scene: str, method: str) -> by_metrics.Pairs:
    """Errors of both by one method, by metric."""
    found = (power(a, f"{OF_NORMS}.{scene}", method, norm)["total"] for norm in ("L1", "L2"))
    return by_metrics.pairs(*found)


def norms(a: Arrays, scene: str) -> list[Claim]:
    """L1 against L2, method by method, and the bias of L1."""
    claims = [
        by_metrics.told("GPT-C03", l1_over_l2(a, scene, method), f"{OF_NORMS}, {scene}, L1 / L2, {method}")
        for method in METHODS
    ]
    bias = f"{a[f'{OF_NORMS}.{scene}.path tracing.L1'].mean() / truth(a, scene).mean() - 1:+.2%} of the image's mean"
    return [*claims, Claim("GPT-C03", criteria.reported(bias), f"{scene}, bias of L1, path tracing", reason=POOLED)]


POOLED = "Against the mean of all L2 images."


def exact(a: Arrays, scene: str) -> Claim:
    """L2 is unbiased in eight blocks of rows, unless no bias is seen and one of EXACT could not be: then it is open."""
    part, left, of = f"{scene}, L2 less its own image, eighths, path tracing", *eighths(a, scene)
    if trouble := few(left):
        return Claim("GPT-C03", None, part, reason=trouble)
    outcome = criteria.all_unbiased(of + left, np.full(left.shape[1], of), EXACT)
    error, seen_at = left.std(axis=0, ddof=1) / np.sqrt(len(left)), criteria.sidak(left.shape[1], len(left))
    if (error > EXACT * of).any() and (abs(left.mean(axis=0)) <= seen_at * error).all():
        said = f"Measured {outcome.measured}, asked {outcome.criterion}: too noisy to tell."
        return Claim("GPT-C03", None, part, reason=said)
    return Claim("GPT-C03", outcome, part, reason=ITS_OWN)


EXACT = 0.005
"""The largest standard error, over the image's mean, that tells an unbiased estimate."""

ITS_OWN = "The mean of L2 is that of its image; by all cameras, as path tracing has no history and sees the same."


def eighths(a: Arrays, scene: str) -> tuple[Array, float]:
    """Means over eight blocks of rows of L2 less the image it is made of, (R, 8), and the mean of that image."""
    views = [f"{camera}.{scene}.path tracing" for camera in (*MOVING, STILL)]
    rebuilt, image = (np.concatenate([a[f"{view}.{name}"] for view in views]) for name in ("L2", PRIMAL))
    left = criteria.mean_and_blocks(rebuilt.reshape(len(rebuilt), -1) - image)[:, 1:]
    return left, float(image.mean())


def filters(a: Arrays, scene: str) -> list[Claim]:
    """A joint bilateral filter of the images alone, against the best of them and against L2 with pair reuse."""
    claims = []
    for camera in (*MOVING, STILL):
        view = f"{camera}.{scene}"
        found, image, ours = bilateral(a, view), alone(a, view), power(a, view, "with", "L2")
        claims += [
            over("COM-B15", (found["total"], image["total"]), f"{camera}, {scene}, filtered / image alone"),
            over("COM-B15", (found["total"], ours["total"]), f"{camera}, {scene}, filtered / L2, with"),
        ]
    return claims


def options(a: Arrays) -> list[Claim]:
    """One option of Area ReSTIR against the other: differences and images of one frame, and its rays."""
    claims = []
    for scene, pace in [(scene, pace) for scene in scenes_of(a) for pace in PACES]:
        cameras, part = [moving(pace, option) for option in (GATHERED, KEPT)], f"{pace}, {scene}, {GATHERED} / {KEPT}"
        dx = [own_error(a, camera, scene) for camera in cameras]
        image = [power(a, f"{camera}.{scene}", "after", PRIMAL, one_image)["total"] for camera in cameras]
        rays = " / ".join(f"{float(a[f'{camera}.{scene}.with.rays']):.0f}" for camera in cameras)
        claims += [
            told("GPT-F07", (dx[0], dx[1]), f"{part}, with, one frame's dx and dy"),
            over("GPT-F08", (image[0], image[1]), f"{part}, one image alone"),
            Claim("GPT-F07", criteria.reported(rays), f"{part}, rays per pixel of a frame"),
        ]
    return claims


def whole_pixels(a: Arrays) -> list[Claim]:
    """What moves by a fraction of a pixel against what moves by whole ones, and what one pixel does to a sample."""
    pairs = {camera: own_error(a, camera, CONTROL) for camera in (*MOVING, WHOLE, STILL)}
    claims = [
        told("GPT-F07", (pairs[camera], pairs[STILL]), f"{CONTROL}, with, one frame's dx and dy, {camera} / {STILL}")
        for camera in (*MOVING, WHOLE)
    ]
    for scene in scenes_of(a):
        cameras = moving(HALVES, KEPT), BLIND
        kept, blind = (own_error(a, camera, scene) * a[f"{camera}.{scene}.with.rays"] for camera in cameras)
        claims.append(told("GPT-F07", (kept, blind), f"{scene}, with, equal rays, {cameras[0]} / {BLIND}"))
    for scene in scenes_of(a):
        of = {name: float(a[f"{STILL}.{scene}.{MOVED}.{name}"]) for name in (PRIMAL, "dx", "dy")}
        text = ", ".join(f"{name} {share:.1%}" for name, share in of.items())
        claims.append(Claim("GPT-F07", criteria.reported(text), f"{scene}, lost by a pixel to the right", reason=GONE))
        text = ", ".join(f"{camera} {at_edges(a, scene, camera):.0%}" for camera in (*MOVING, STILL))
        part = f"{scene}, with: share of the variance of dx and dy that edge pairs carry"
        claims.append(
            Claim("GPT-F07", criteria.reported(text), part, reason=f"{edge_pairs(a, scene):.1%} of all pairs.")
        )
    return claims


def own_error(a: Arrays, camera: str, scene: str) -> Array:
    """Variance of dx and dy of one frame with pair reuse; (R,)."""
    return spread([a[f"{camera}.{scene}.with.{name}"] for name in ("dx", "dy")])


def edge_of(a: Arrays, scene: str) -> dict[str, Array]:
    """Which pairs of the last crop are edges, by direction."""
    s = SCENES[scene]()
    (sensor,) = followed(s, len(truth(a, scene)), 1)
    return {name: edges(seen(s.scene, sensor), ends) for name, (ends, _) in forward(sensor.shape).items()}


def edge_pairs(a: Arrays, scene: str) -> float:
    """The share of edge pairs among all."""
    return float(np.concatenate(list(edge_of(a, scene).values())).mean())


def at_edges(a: Arrays, scene: str, camera: str) -> float:
    """Their share of the variance of dx and dy with pair reuse."""
    edge = edge_of(a, scene)
    variance = {name: a[f"{camera}.{scene}.with.{name}"].var(axis=0) for name in edge}
    whole = sum(float(each.sum()) for each in variance.values())
    return sum(float(variance[name][at].sum()) for name, at in edge.items()) / whole


GONE = "Samples, by p_hat W, that have less than a tenth of their target there; the film place in the pixel is kept."


# ---------------------------------------------------------------- drawing


def draw(a: Arrays) -> "Picture":
    """dx by either option in one replica, and the errors of differences and of images, in motion and at rest."""
    scenes = scenes_of(a)
    picture, axes = style.panels(len(scenes), 4, width=3.0, height=2.6)
    for row, scene in zip(axes, scenes, strict=True):
        views = {option: f"{moving(HALVES, option)}.{scene}" for option in OPTIONS}
        ours = a[f"{views[KEPT]}.with.dx"]
        side = round(a[f"{views[KEPT]}.with.{PRIMAL}"][0].size ** 0.5)
        high = float(np.quantile(abs(ours.mean(axis=0)), 0.98) + ours.std(axis=0).mean())
        for axis, (option, view) in zip(row, views.items(), strict=False):
            image = a[f"{view}.with.dx"][0].reshape(side, side - 1)
            shown = axis.imshow(image, vmin=-high, vmax=high, cmap="PuOr")
            axis.set(title=f"{scene}, by halves: {option}", xlabel="pair of pixels", ylabel="pixel")
            axis.grid(visible=False)
            picture.colorbar(shown, ax=axis, label="$I_{i+1} - I_i$, radiance", shrink=0.8)
        by_camera(row[2], lambda view: {m: gradient_error(a, view, m, as_averaged).mean() for m in METHODS}, scene)
        row[2].set(ylabel="variance of dx, dy (radiance$^2$)", title="differences")
        by_camera(row[3], lambda view: of_images(a, view), scene)
        row[3].set(ylabel="power above alpha (radiance$^2$)", title="L2 images")
    style.below(axes[-1, 3], ncols=2, borderaxespad=1.5)
    return picture


def of_images(a: Arrays, view: str) -> dict[str, float]:
    """Power above alpha of the L2 images, and of images alone."""
    found = {method: power(a, view, method, "L2", as_averaged) for method in METHODS} | {"image alone": area(a, view)}
    return {name: float(each["high"][MSE].mean()) for name, each in found.items()}


SHORT = ("1/2\nkept", "1/5\nkept", "1/2\ngath.", "1/5\ngath.", STILL)
"""Cameras, in the order of the bars."""


def by_camera(axis: Any, found: Callable[[str], Mapping[str, float]], scene: str) -> None:
    """Bars of every method, for all cameras."""
    for k, camera in enumerate((*MOVING, STILL)):
        for j, (name, each) in enumerate(found(f"{camera}.{scene}").items()):
            axis.bar(k + 0.2 * (j - 1.5), each, 0.18, **style.bar(name, label=name if k == 0 else "_"))
    axis.set_xticks(range(len(SHORT)), SHORT)
    axis.set(yscale="log", xlabel="moves by (pixels)")
    heights = [bar.get_height() for bar in axis.patches]
    axis.set_ylim(10 ** np.floor(np.log10(min(heights) / 2)), 10 ** np.ceil(np.log10(max(heights))))
    axis.minorticks_off()
    axis.grid(axis="x", visible=False)


FIGURE = Figure(
    id="GPT-F07-3D",
    title="Differences and reconstructed images in space",
    world="tracer3d",
    source="[GPT Fig. 1, 7, 8; 2.1, 5.1]",
    claims=("GPT-F01", "GPT-F07", "GPT-F08", "GPT-C03", "COM-B15"),
    conditions=(
        Conditions(
            ("GPT-F01", "GPT-F07", "GPT-F08", "GPT-C03", "COM-B15"),
            "[GPT Fig. 1, 7, 8; 5]",
            Setup("real time", "moving", "all", "Aachen Toys (1); Classroom, Veach-Ajar (7); these and Kitchen (8)"),
            Setup("real time", "moving", "all", "insets of CB3, Ajar3, Checker3; a still camera beside, reported"),
        ),
    ),
    arm="method",
    presets={
        "quick": {"scenes": ["CB3", "Ajar3", "Checker3"], "replicas": 2, "blocks": 1, "side": 6, "frames": 2},
        "paper": {"scenes": ["CB3", "Ajar3", "Checker3"], "replicas": 16, "blocks": 4, "side": 32, "frames": 21},
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)

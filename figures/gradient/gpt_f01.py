"""GPT Fig. 1 and 11: the whole method in flatland, a denoiser beside it, and what still flickers.

Maps of two scenes are reconstructed (L2) at the rays of one frame with pair reuse, by this method and by
gradient-domain path tracing, beside the image of ReSTIR alone.  The checker row moves; of its inset the last two frames
are kept: their difference, replica by replica, is what flickers.  No network is at hand: a joint bilateral filter of
the image, guided by the G-buffer, stands beside L1 and L2 of the same samples.  Maps are compared by their squared
error and by the same relative to the reference pixel, as the paper names neither.
"""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments import by_metrics
from figures.experiments.by_metrics import MSE, Bands
from figures.experiments.gradients import (
    ADAPTIVE,
    METHODS,
    SIDE,
    averaged,
    grey,
    inner,
    rendered,
    temporal_only,
    views_of,
)
from figures.experiments.references import reference
from figures.experiments.replicas import few, told
from figures.experiments.views import setting, standard
from figures.gradient.gpt_f07 import unlit, whole_view
from figures.report import style
from flatland2d.pictures import scene_picture
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.gradient_loop import GRADIENT, PRIMAL, forward, shaded, step
from restir_ref.metrics import ROW, band_powers
from restir_ref.poisson import ALPHA, l2
from restir_ref.poisson_l1 import l1
from restir_ref.transport.edges import edges, seen, unlike

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Picture

ROW_VIEW, MAPS = "checker row", ("occluders map", "checker map")
ARMS = {**METHODS, "temporal": temporal_only}
NORMS: Mapping[str, Callable[..., Array]] = MappingProxyType({"L2": l2, "L1": l1})
SHARES = {"with": 1, "after": 2, "path tracing": 4, "temporal": 3}
"""Images of each method that are averaged: about as many as cost one frame's rays."""

REACH = 3
"""Pixels from an edge pair within which the row counts as of high frequency, and the width of the bilateral filter."""


def chunks(preset: Any) -> Sequence[dict[str, Any]]:
    """One per map, method and block of replicas; the row once per block."""
    arms = [(view, method) for view in MAPS for method in ARMS] + [(ROW_VIEW, "with")]
    return [{"view": view, "method": method, "block": k} for view, method in arms for k in range(preset["blocks"])]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Image and differences, (replicas, n), and rays per pixel; of the row the last two frames."""
    method, replicas = chunk["method"], preset["replicas"]
    if chunk["view"] == ROW_VIEW:
        return last_frames(replicas, rng)
    return rendered(chunk["view"], ARMS[method], replicas * SHARES[method], rng)


def last_frames(replicas: int, rng: np.random.Generator) -> Arrays:
    """The last two frames of the moving row: image and dx of its inset, (replicas, n) each."""
    views, chance, last = views_of(ROW_VIEW, GRADIENT, ADAPTIVE, Counter()), Live(rng), None
    found: Arrays = {}
    for k, view in enumerate(views, start=1 - len(views)):
        last = view, step(view, chance, GRADIENT, replicas, last)
        if k >= -1:
            for name, group in view.items():
                found[f"{name}{k}"] = inner(ROW_VIEW, name, grey(shaded(group, last[1][name]), replicas))
    return found


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """All blocks by "view.method.name", rays once, and the row's reference."""
    found: dict[str, list[Array]] = {}
    for at, part in zip(chunks(preset), results, strict=True):
        for key, each in part.items():
            found.setdefault(f"{at['view']}.{at['method']}.{key}", []).append(each)
    named = {key: parts[0] if parts[0].ndim == 0 else np.concatenate(parts) for key, parts in found.items()}
    return named | {"reference": reference("checker").mean}


# ---------------------------------------------------------------- maps


def inputs(a: Arrays, view: str, method: str) -> list[Array]:
    """Image, dx and dy of a method at about equal rays, (R, ...) each."""
    shapes = {"primal": (SIDE, SIDE), "dx": (SIDE, SIDE - 1), "dy": (SIDE - 1, SIDE)}
    return [averaged(a[f"{view}.{method}.{name}"], SHARES[method]).reshape(-1, *s) for name, s in shapes.items()]


def truth(a: Arrays, view: str) -> Array:
    """The mean of a map's L2 images by all methods: all are unbiased; (SIDE, SIDE)."""
    return np.asarray(np.mean([l2(*inputs(a, view, method)).mean(axis=0) for method in METHODS], axis=0))


def rebuilt_error(a: Arrays, view: str, method: str, norm: str = "L2") -> Bands:
    """Error of a map's reconstruction at the rays of one frame with pair reuse, by band and metric; L1 has its bias."""
    return error_of(a, view, method, NORMS[norm](*inputs(a, view, method)), biased=float(norm == "L1"))


def error_of(a: Arrays, view: str, method: str, images: Array, *, biased: float = 0.0) -> Bands:
    """That of images which a method has averaged, (R, SIDE, SIDE)."""
    right = truth(a, view)
    return by_metrics.bands(by_metrics.off(images, right, dearer(a, view, method), biased), right, ALPHA)


def alone(a: Arrays, view: str) -> Bands:
    """The same of the better image of ReSTIR without differences, by either metric."""
    images = {
        method: averaged(a[f"{view}.{method}.primal"], SHARES[method]).reshape(-1, SIDE, SIDE)
        for method in ("after", "temporal")
    }
    return by_metrics.best([error_of(a, view, method, each) for method, each in images.items()])


def dearer(a: Arrays, view: str, method: str) -> float:
    """Rays of the averaged images over those of one frame with pair reuse."""
    return float(a[f"{view}.{method}.rays"] * SHARES[method] / a[f"{view}.with.rays"])


# ---------------------------------------------------------------- the row


def rebuilt(a: Arrays, frame: int, norm: Any = l2) -> Array:
    """The row of one of the last two frames, 0 or -1, from its image and differences, (R, n)."""
    return np.asarray(norm(a[f"{ROW_VIEW}.with.{PRIMAL}{frame}"], a[f"{ROW_VIEW}.with.dx{frame}"]))


def near_edges() -> Array:
    """Which pixels of the row's inset are within reach of an edge pair, (n,)."""
    s, sensor = setting("checker"), standard("checker")
    edge = np.flatnonzero(edges(seen(s.scene, sensor), forward((sensor.n,))["dx"][0]))
    return np.asarray((abs(np.arange(sensor.n)[:, None] - edge - 0.5) < REACH).any(axis=1))


def flicker(a: Arrays) -> tuple[Array, Array]:
    """Power of the change from frame to frame, without its mean, near edges and elsewhere; (R,) each."""
    change = rebuilt(a, 0) - rebuilt(a, -1)
    noise, near = (change - change.mean(axis=0)) ** 2, near_edges()
    return noise[:, near].mean(axis=1), noise[:, ~near].mean(axis=1)


def filtered(images: Array) -> Array:
    """Joint bilateral filter: the mean over like pixels, weighted by exp(-(i - j)^2 / 2 REACH^2)."""
    g, i = seen(setting("checker").scene, standard("checker")), np.arange(images.shape[-1])
    pair = np.meshgrid(i, i, indexing="ij")
    alike = ~unlike(g, pair[0].ravel(), pair[1].ravel()).reshape(len(i), -1)
    w = np.exp(-((pair[0] - pair[1]) ** 2) / 2 / REACH**2) * alike
    return np.asarray(images @ (w / w.sum(axis=1, keepdims=True)).T)


def images(a: Arrays) -> dict[str, Array]:
    """What is made of the same samples of the row's last frame, (R, n) each."""
    primal = a[f"{ROW_VIEW}.with.{PRIMAL}0"]
    return {
        "primal": primal,
        "Poisson L2": rebuilt(a, 0),
        "Poisson L1": rebuilt(a, 0, l1),
        "bilateral": filtered(primal),
    }


def high_error(a: Arrays, name: str) -> Array:
    """Power of the error against the reference above alpha, bias included; (R,)."""
    return band_powers(images(a)[name] - a["reference"], ALPHA, ROW)[1]


# ---------------------------------------------------------------- judging


def check(a: Arrays) -> list[Claim]:
    """Maps against gradient-domain path tracing; L1 against L2; flicker; filters reported."""
    claims = []
    for view in MAPS:
        ours, traced = (rebuilt_error(a, view, method)["total"] for method in ("with", "path tracing"))
        part, image = f"{view}, L2, with / path tracing", alone(a, view)["total"]
        claims.append(by_metrics.smaller("GPT-F01", by_metrics.pairs(ours, traced), 1, part, STILL))
        claims.append(by_metrics.told("GPT-F01", by_metrics.pairs(ours, image), f"{view}, L2 with / image alone"))
        black = (a[f"{view}.path tracing.primal"] == 0).all(axis=0).reshape(SIDE, SIDE)
        claims.append(unlit("GPT-F01", l2(*inputs(a, view, "with")), black, f"{view}, pixels that no light reaches"))
    claims += norms(a)
    near, elsewhere = flicker(a)
    part = "power of the change between frames, near edges / elsewhere"
    if few(near):
        claims.append(Claim("GPT-C08", None, part, reason=few(near)))
    else:
        claims.append(Claim("GPT-C08", criteria.ratio_above(near, elsewhere, 1.5), part))
    primal = high_error(a, "primal")
    others = ("Poisson L2", "Poisson L1", "bilateral")
    return claims + [told("GPT-F11", (high_error(a, x), primal), f"error above alpha, {x} / primal") for x in others]


STILL = "Maps stand still; the caption's camera moves."


def norms(a: Arrays) -> list[Claim]:
    """L1 against L2, bias and all, on all maps by all methods: in at least half of the cases that are decided."""
    cases = {(view, method): l1_over_l2(a, view, method) for view in MAPS for method in METHODS}
    reported = [by_metrics.told("GPT-C03", cases[case], f"L1 / L2, {', '.join(case)}") for case in cases]
    named = {f"{view.removesuffix(' map')} {method}": each for (view, method), each in cases.items()}
    return [by_metrics.often("GPT-C03", named, "L1 / L2, all maps and methods"), *reported]


def l1_over_l2(a: Arrays, view: str, method: str) -> by_metrics.Pairs:
    """Errors of both by metric."""
    return by_metrics.pairs(*(rebuilt_error(a, view, method, norm)["total"] for norm in ("L1", "L2")))


def draw(a: Arrays) -> "Picture":
    """Where maps and row lie in their scenes; noise of the maps; where the row flickers; its errors by what made it."""
    picture, axes = style.panels(2, 3, width=4.0, height=3.0)
    for axis, view in zip(axes[0], MAPS, strict=False):
        whole_view(axis, view.removesuffix(" map"))
    scene_picture(axes[0, 2], setting("checker"), standard("checker").n)
    axes[0, 2].set(title="checker row: what its inset sees")
    noise_of_maps(axes[1, 0], a)
    changes_of_row(axes[1, 1], a)
    errors = {name: high_error(a, name).mean() for name in images(a)}
    for k, each in enumerate(errors.values()):
        axes[1, 2].bar(k, each, color=style.nth(k)["color"], hatch=style.HATCHES[k], edgecolor=style.PAPER)
    axes[1, 2].set_xticks(range(len(errors)), [name.removeprefix("Poisson ") for name in errors])
    axes[1, 2].set(ylabel="error above alpha (radiance$^2$)", title="checker row: same samples")
    axes[1, 2].grid(axis="x", visible=False)
    return picture


def noise_of_maps(axis: "Axes", a: Arrays) -> None:
    """Squared error of L2 images, and of the better image alone."""
    for k, view in enumerate(MAPS):
        found = {method: rebuilt_error(a, view, method) for method in METHODS} | {"image alone": alone(a, view)}
        for j, (method, each) in enumerate(found.items()):
            look = style.bar(method, label=method if k == 0 else "_")
            axis.bar(k + 0.2 * (j - 1.5), each["total"][MSE].mean(), 0.18, **look)
    axis.set_xticks([0, 1], MAPS)
    axis.set(yscale="log", ylabel="variance (fluence$^2$)", title="L2 images of maps, equal rays")
    axis.grid(axis="x", visible=False)
    style.below(axis, ncols=2)


def changes_of_row(axis: "Axes", a: Arrays) -> None:
    """The variance of the change between the last two frames, pixel by pixel."""
    change = rebuilt(a, 0) - rebuilt(a, -1)
    axis.semilogy(change.var(axis=0, ddof=1), **style.look("Poisson L2", marker=""))
    n = np.arange(change.shape[1])
    axis.fill_between(n, 0, 1, near_edges(), transform=axis.get_xaxis_transform(), color=style.PALE)
    axis.set(xlabel="pixel of the inset (grey: near edges)", ylabel="variance of the change (radiance$^2$)")
    axis.set(title="checker row: what flickers")


FIGURE = Figure(
    id="GPT-F01",
    title="The whole method, a denoiser, and what flickers",
    world="flatland2d",
    source="[GPT Fig. 1, 11; 6]",
    claims=("GPT-F01", "GPT-C03", "GPT-C08", "GPT-F11"),
    conditions=(
        Conditions(
            ("GPT-F01", "GPT-C03"),
            "[GPT Fig. 1; 2.1]",
            Setup("real time", "moving", "all", "Veach-Ajar and others"),
            Setup("real time", "still", "all", "maps at a post (FS5) and over a checker floor (FS6)"),
            "A fluence map has no camera to move.  Light that its own rays meet is left out: it would hide all else.",
        ),
        Conditions(
            ("GPT-C08", "GPT-F11"),
            "[GPT Fig. 11; 6]",
            Setup("real time", "moving", "all", "not named"),
            Setup("real time", "moving", "all", "inset of the checker row (FS6)"),
        ),
    ),
    arm="method",
    presets={"quick": {"replicas": 2, "blocks": 1}, "paper": {"replicas": 32, "blocks": 3}},
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)

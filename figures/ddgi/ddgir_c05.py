"""DDGI resampling 5: guiding by probes, ReSTIR GI and correlated pixels, behind the door ajar.

One ray from x_1 by the BSDF, or half the time where the nearest probe's rays found light; DDGI resampling without and
with history; ReSTIR GI without history, its paths traced to the end.  What resampling costs a denoiser is what is left
of the noise after a box of 9 pixels, beside pixels of the same variance that know nothing of each other.
"""

from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.criteria import Outcome
from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments.cached import PLACES, RESAMPLED, SHADING, Bill, Chain, Scenery, frozen, scenery
from figures.experiments.deep import truth, truth_of_trees
from figures.experiments.rendering import means
from figures.report import style
from flatland2d.probe_cells import Sectors
from restir_ref.batch import Array
from restir_ref.chance import Chance, Live
from restir_ref.integrals import Pixels
from restir_ref.loop import REAL_TIME, frame, random_in_row
from restir_ref.restir import shade
from restir_ref.transport.baselines.restir_gi import RadianceIntegrals
from restir_ref.transport.cache.guiding import guided
from restir_ref.transport.cache.integrals import CacheIntegrals, Ray, ray
from restir_ref.transport.cache.probe_rays import brought
from restir_ref.transport.cache.shading import met, sent

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Picture

ROOM, RAYS, TAPS = "FS3", 64, 9
METHODS = ("BSDF", "guided", "resampled, cold", "resampled, warm", "ReSTIR GI")
BY_BSDF, GUIDED, COLD, WARM, GI = range(len(METHODS))
ENOUGH = 64
"""Replicas that can tell: of few, one finds the slit and the next does not."""


GUIDING = (
    "variance, guided / BSDF",
    "variance times rays, resampled / guided, cold",
    "variance times rays, resampled / guided, warm",
)
"""Of guiding, of a first frame of DDGI resampling, and of a later one."""

NO_HISTORY = (
    "The method takes past frames, so that a first frame is not its setting: its reuse of neighbours alone costs more "
    "rays than it saves."
)
ELSEWHERE = (
    "The paper does not say that guiding lowers variance.  Here the nearest probe sees the slit in another direction "
    "than x_1 does, and its rays are a tenth of a radian apart."
)

PLENTY = 256
"""Replicas that tell a bias."""

Guide = Callable[[CacheIntegrals, Array, Chance], Ray]
"""How a ray from x_1 is chosen."""


def chunks(preset: Any) -> Sequence[Any]:
    """Groups of replicas."""
    return [{"block": k} for k in range(preset["blocks"])]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Images (method, replica, pixel) and rays per pixel (method,)."""
    place, chance, replicas = frozen(PLACES[ROOM], preset["tolerance"]), Live(rng), preset["replicas"]
    of = scenery(place)
    index, grid = np.arange(replicas * of.n), place.augmented.grid
    rays = brought(of.cache, grid.place(np.arange(grid.P)), Sectors(RAYS), chance)
    bill = Bill(of.asked, len(index))
    ways: tuple[Guide, Guide] = (ray, lambda first, index, chance: guided(first, rays, index, chance))
    found = [bill.of(partial(by_one, of, way, index, chance)) for way in ways]
    chain = Chain(RESAMPLED)
    for k in range(preset["frames"]):
        L, cost = bill.of(partial(one_frame, of, chain, index, chance))
        if k in (0, preset["frames"] - 1):
            found.append((L, cost))
    found.append(bill.of(partial(restir_gi, of, index, chance)))
    images = [L.mean(axis=0).reshape(replicas, of.n) for L, _ in found]
    return {"images": np.stack(images), "rays": np.array([cost[0] for _, cost in found])}


def by_one(of: Scenery, way: Guide, index: Array, chance: Chance) -> Array:
    """L_e + L+ by one ray, (C, N)."""
    first, _ = of.first(index, chance)
    found = way(first, index, chance)
    return np.asarray(found.weight * sent(of.cache, met(first, index, found, found.weight), SHADING, chance))


def one_frame(of: Scenery, chain: Chain, index: Array, chance: Chance) -> Array:
    """The next frame of DDGI resampling, (C, N)."""
    first, _ = of.first(index, chance)
    return np.asarray(chain.shown(chain.keep(chain.run(first, index, chance)), chance))


def restir_gi(of: Scenery, index: Array, chance: Chance) -> Array:
    """A frame without history, (C, N)."""
    here = Pixels(RadianceIntegrals(of.tracer), index)
    return np.asarray(shade(frame(here, chance, REAL_TIME, random_in_row), here))


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """All images, rays, and truths: all bounces, and as many as path tracing has."""
    return {
        "images": np.concatenate([r["images"] for r in results], axis=1),
        "rays": np.mean([r["rays"] for r in results], axis=0),
        "truth": truth(PLACES[ROOM].room),
        "traced": truth_of_trees(PLACES[ROOM].room),
    }


def squares(images: Array) -> Array:
    """Squares of what is not the mean over replicas, (replica,)."""
    return np.asarray(((images - images.mean(axis=0)) ** 2).mean(axis=-1))


def boxed(images: Array) -> Array:
    """Means of TAPS neighbouring pixels, (replica, n - TAPS + 1)."""
    return np.asarray(np.lib.stride_tricks.sliding_window_view(images, TAPS, axis=-1).mean(axis=-1))


def strangers(images: Array) -> Array:
    """Every pixel from another replica: of the same variance, and independent of its neighbours within the box."""
    R, n = images.shape
    return np.asarray(images[(np.arange(R)[:, None] + np.arange(n)) % R, np.arange(n)])


def at_equal_rays(a: Arrays) -> tuple[Array, int]:
    """Means of as many frames of DDGI resampling, without history, as cost at most the rays of ReSTIR GI."""
    T = max(1, int(a["rays"][GI] // a["rays"][COLD]))
    return means(a["images"][COLD], T), T


def check(a: Arrays) -> list[Claim]:
    """Variances, bias, and what is left after the box."""
    images = a["images"]
    if images.shape[1] < ENOUGH:
        reason = f"{images.shape[1]} replicas cannot tell: few rays find the slit."
        parts = [("DDGIR-C05", each) for each in GUIDING]
        parts += [("DDGIR-C07", each) for each in ("variance, resampled / ReSTIR GI", "bias")]
        return [*(Claim(id_, None, part, reason=reason) for id_, part in parts), *check_boxes(a)]
    V = [squares(each) for each in images]
    cost = [rays * v for rays, v in zip(a["rays"], V, strict=True)]
    by_guide = criteria.reported(criteria.ratio_interval(V[GUIDED], V[BY_BSDF])[2])
    cold = criteria.reported(criteria.ratio_interval(cost[COLD], cost[GUIDED])[2])
    alone = f"Variance alone: {criteria.ratio_interval(V[COLD], V[GUIDED])[2]}."
    return [
        Claim("DDGIR-C05", by_guide, GUIDING[0], reason=ELSEWHERE),
        Claim("DDGIR-C05", cold, GUIDING[1], reason=f"{NO_HISTORY}  {alone}"),
        smaller(cost[WARM], cost[GUIDED], 1, GUIDING[2], FIRST_FRAME),
        *check_gi(a),
        *check_boxes(a),
    ]


FIRST_FRAME = "With a history; of a first frame guiding is the more efficient (the part beside)."


def smaller(x: Array, y: Array, limit: float, part: str, caveat: str) -> Claim:
    """A ratio of variances, refuted where it is above 1."""
    return Claim("DDGIR-C05", criteria.ratio_below(x, y, limit), part, criteria.ratio_above(x, y, 1), caveat)


def check_gi(a: Arrays) -> list[Claim]:
    """Less noise at equal rays; more bias."""
    ours, T = at_equal_rays(a)
    gi = a["images"][GI][: len(ours)]
    pair = squares(ours), squares(gi)
    reason = f"{a['rays'][GI]:.1f} rays against {T} times {a['rays'][COLD]:.1f}."
    below, above = criteria.ratio_below(*pair, 1), criteria.ratio_above(*pair, 1)
    both = less_bias((a["images"][GI], a["traced"]), (a["images"][COLD], a["truth"]))
    few = Claim("DDGIR-C07", None, "bias", reason=f"{len(pair[1])} images do not tell a bias of some percent.")
    bias = few if a["images"].shape[1] < PLENTY else Claim("DDGIR-C07", both, "bias")
    return [
        Claim("DDGIR-C07", below, "variance, resampled / ReSTIR GI", above, reason=reason),
        bias,
    ]


def less_bias(x: tuple[Array, Array], y: tuple[Array, Array]) -> Outcome:
    """|bias| of the image's mean of x below that of y, 1.96 standard errors of both apart."""
    bias, error = np.transpose([of_mean(*each) for each in (x, y)])
    apart = abs(bias[1]) - abs(bias[0]) > 1.96 * np.hypot(*error)
    said = f"ReSTIR GI {bias[0]:+.2%}, resampled {bias[1]:+.2%} (SE {error[0]:.2%}, {error[1]:.2%})"
    return Outcome(said, "|bias| of ReSTIR GI below resampled's at 95%", bool(apart))


def of_mean(images: Array, at: Array) -> tuple[float, float]:
    """Bias of the image's mean and its standard error, as shares of the truth."""
    mean = images.mean(axis=-1) / at.mean()
    return float(mean.mean() - 1), float(mean.std(ddof=1) / np.sqrt(len(mean)))


def check_boxes(a: Arrays) -> list[Claim]:
    """What the box leaves of noise, beside independent pixels."""
    cold, warm = ((squares(boxed(each)), squares(boxed(strangers(each)))) for each in a["images"][[COLD, WARM]])
    above, below = criteria.ratio_above(*warm, 1.2), criteria.ratio_below(*warm, 1)
    beside = criteria.reported(criteria.ratio_interval(*cold)[2])
    return [
        Claim("DDGIR-C09", above, "after the box, warm", below),
        Claim("DDGIR-C09", beside, "after the box, cold"),
    ]


def draw(a: Arrays) -> "Picture":
    """Variances, and what the box leaves."""
    picture, axes = style.panels(1, 2, width=5.0, height=3.2)
    draw_variances(axes[0, 0], a)
    draw_boxes(axes[0, 1], a)
    return picture


def draw_variances(axis: "Axes", a: Arrays) -> None:
    """Of one frame, as shares of the squared mean."""
    V = [squares(each).mean() / a["truth"].mean() ** 2 for each in a["images"]]
    bars = axis.bar(range(len(V)), V, 0.6, color=style.COLOURS[0])
    axis.bar_label(bars, labels=[f"{v:.3g}" for v in V])
    labels = [name.replace(", ", ",\n") + f"\n{rays:.1f} rays" for name, rays in zip(METHODS, a["rays"], strict=True)]
    axis.set_xticks(range(len(V)), labels)
    axis.set_yscale("log")
    axis.margins(y=0.2)
    axis.set(ylabel="variance / mean²", title="One frame, behind the door ajar")


def draw_boxes(axis: "Axes", a: Arrays) -> None:
    """Variance after the box over variance before."""
    shown = [a["images"][k] for k in (COLD, WARM)]
    arms = {"as rendered": shown, "independent pixels": [strangers(each) for each in shown]}
    for j, (label, images) in enumerate(arms.items()):
        left = [squares(boxed(each)).mean() / squares(each).mean() for each in images]
        place, look = np.arange(2) + 0.36 * (j - 0.5), style.nth(j)
        bars = axis.bar(
            place, left, 0.34, color=look["color"], hatch=style.HATCHES[j], edgecolor=style.PAPER, label=label
        )
        axis.bar_label(bars, fmt="%.2f")
    axis.set_xticks([0, 1], ["cold history", "warm history"])
    axis.margins(y=0.2)
    axis.set(ylabel="variance after / before", title=f"Resampled, after a box of {TAPS} pixels")
    style.below(axis)


ALIKE = Setup("real time", "still", "all", "door ajar (FS3), one sample per pixel")

FIGURE = Figure(
    id="DDGIR-C05",
    title="Guiding, ReSTIR GI and correlation behind a door ajar",
    world="flatland2d",
    source="[DDGIR 2, 5]",
    claims=("DDGIR-C05", "DDGIR-C07", "DDGIR-C09"),
    conditions=(
        Conditions(
            ("DDGIR-C05", "DDGIR-C07", "DDGIR-C09"),
            "[DDGIR 2, 5.1, 5.2]",
            Setup("real time", "still", "all", "said of all scenes"),
            ALIKE,
        ),
    ),
    presets={
        "quick": {"blocks": 2, "replicas": 32, "frames": 8, "tolerance": 0.05},
        "paper": {"blocks": 16, "replicas": 32, "frames": 20, "tolerance": 0.01},
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)

"""MCMC Fig. 7, Fig. 8 and Table 2 in space: the ceiling of a room lit through a door that stands ajar.

From a point of the ceiling light is found through the slit; a step out of the plane of the slit and the path is
blocked, a step in that plane and it is not.  So streaks are expected along x, from the door into the room, and not
along z.  Steps of x_c weaken streaks even where all of them are accepted: that the mutations are right is shown
elsewhere (MCMC-E06, C02), and here the mean of the image is reported beside.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments.mutated import (
    ARMS,
    ENOUGH,
    FRAMES,
    LOOP,
    RADIUS,
    VIEWS,
    accepted,
    chain,
    covariances,
    covariances_of_map,
    shown,
)
from figures.experiments.views import HYBRID
from figures.report import style
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.metrics import MAP, low_frequency_ratio, power_spectrum
from restir_ref.transport.mutations import TwoRays
from restir_ref.transport.paths import Tracer
from tracer3d.scenes import ajar_ceiling

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

NAMES = {"k = 0": "no mutations", "k = 5": "5 mutations", "k = 5, blue": "5 mutations, blue"}
SIDE = 36
PRESET = replace(LOOP, radius=5)
"""The radius is a smaller part of the view than 20 pixels of the thesis' image would be of ours."""

GLOSSY = "FS2, inset"


def ceiling() -> TwoRays:
    """The whole view, coarsely."""
    setting = ajar_ceiling()
    return TwoRays(Tracer(setting.scene, setting.view(SIDE, SIDE), setting.depth, HYBRID))


def chunks(preset: Any) -> Sequence[dict[str, Any]]:
    """Every way to mutate, in parts; and the glossy box of flatland, for its acceptance and covariance."""
    rows = [{"view": "ceiling", "arm": arm, "part": part} for arm in NAMES for part in range(preset["parts"])]
    return [*rows, *({"view": GLOSSY, "arm": arm, "part": 0} for arm in ("k = 0", "k = 5"))]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Images (replicas, pixels), and the acceptance of another proposal."""
    chance, arm = Live(rng), ARMS[chunk["arm"]]
    if chunk["view"] == GLOSSY:
        X, here = chain(TwoRays(VIEWS[GLOSSY].tracer), arm, preset["frames"], preset["box"], chance)
    else:
        X, here = chain(ceiling(), arm, preset["frames"], preset["replicas"], chance, loop=PRESET)
    return {"images": shown(X, here), "accepted": np.array([accepted(X, here, chance)])}


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Covariances in the box, along x and along z, low-frequency ratios, mean spectrum, an image, means, acceptance.

    Covariances of all arms are relative to one mean, that of images without mutations.
    """
    found: Arrays = {}
    parts = preset["parts"]
    scale = np.mean([each["images"].mean() for each in results[:parts]]) ** 2
    for number, arm in enumerate(NAMES):
        mine = results[number * parts : (number + 1) * parts]
        images = np.concatenate([each["images"] for each in mine]).reshape(-1, SIDE, SIDE)
        errors = images - images.mean(axis=0)
        found |= {
            f"{arm}.covariance": covariances_of_map(images) / scale,
            f"{arm}.along": covariances_of_map(images, (0, RADIUS)) / scale,
            f"{arm}.across": covariances_of_map(images, (RADIUS, 0)) / scale,
            f"{arm}.low": low_frequency_ratio(errors, MAP),
            f"{arm}.spectrum": power_spectrum(errors, MAP).mean(axis=0),
            f"{arm}.image": images[0],
            f"{arm}.mean": images.mean(axis=(1, 2)),
            f"{arm}.accepted": np.array([each["accepted"][0] for each in mine]),
        }
    for arm, each in zip(("k = 0", "k = 5"), results[-2:], strict=True):
        found[f"{GLOSSY}.{arm}.covariance"] = covariances(each["images"])
        found[f"{GLOSSY}.{arm}.accepted"] = each["accepted"]
    return found


def check(a: Arrays) -> list[Claim]:
    """Streaks, and what five mutations do to them and to all covariance; spectra."""
    none, five, blue = NAMES
    if len(a[f"{none}.low"]) < ENOUGH:
        return [Claim(id_, None, part, reason="Too few images.") for id_, part in PARTS]
    cov = {arm: a[f"{arm}.covariance"] for arm in NAMES}
    streaks = criteria.ratio_above(a[f"{none}.along"], a[f"{none}.across"], 1.5)
    weaker = a[f"{five}.along"], a[f"{none}.along"]
    outcomes = [
        (streaks, criteria.ratio_below(a[f"{none}.along"], a[f"{none}.across"], 1)),
        (criteria.ratio_below(*weaker, 0.95), criteria.ratio_above(*weaker, 1)),
        (criteria.reported(criteria.ratio_interval(a[f"{five}.mean"], a[f"{none}.mean"])[2]), None),
        (criteria.reported(criteria.ratio_interval(a[f"{five}.across"], a[f"{none}.across"])[2]), None),
        (criteria.ratio_below(cov[five], cov[none], 0.9), criteria.ratio_above(cov[five], cov[none], 1)),
        (criteria.reported(criteria.ratio_interval(cov[blue], cov[five])[2]), None),
        *(red(a[f"{arm}.low"]) for arm in NAMES),
        less(a, none, five),
    ]
    claims = [Claim(id_, outcome, part, other) for (id_, part), (outcome, other) in zip(PARTS, outcomes, strict=True)]
    low, high, _ = criteria.ratio_interval(cov[five], cov[none])
    why = {"MCMC-T2": f"{len(cov[five])} images leave {(high - low) / 2:.2f} of the ratio open.", "MCMC-C04": OVERLAP}
    return [
        replace(each, reason=why.get(each.id, "") if each.outcome and each.outcome.passed is False else "")
        for each in claims
    ]


OVERLAP = "Fewer proposals are accepted behind the slit, but the intervals of the covariance overlap."


PARTS = (
    ("MCMC-F07", "Ajar3: covariance without mutations, along x / along z"),
    ("MCMC-F07", "Ajar3: covariance along x, 5 / 0"),
    ("MCMC-F07", "Ajar3: mean of the image, 5 / 0"),
    ("MCMC-F07", "Ajar3: covariance along z, 5 / 0"),
    ("MCMC-T2", "Ajar3: covariance 5 / 0"),
    ("MCMC-T2b", "Ajar3: covariance, blue / plain"),
    *(("MCMC-F08", f"Ajar3, {name}: low-frequency ratio") for name in NAMES.values()),
    ("MCMC-C04", "Ajar3 against FS2: remaining covariance, and acceptance"),
)


def red(low: Array) -> tuple[criteria.Outcome, criteria.Outcome]:
    """More low frequencies than white noise."""
    one = np.ones_like(low)
    return criteria.ratio_above(low, one, 1), criteria.ratio_below(low, one, 1)


def less(a: Arrays, none: str, five: str) -> tuple[criteria.Outcome, criteria.Outcome]:
    """Covariance falls less, and fewer proposals are accepted, than in the glossy box."""
    left = criteria.ratio_interval(a[f"{five}.covariance"], a[f"{none}.covariance"])
    box = criteria.ratio_interval(a[f"{GLOSSY}.{five}.covariance"], a[f"{GLOSSY}.{none}.covariance"])
    rates = [float(each.mean()) for each in (a[f"{none}.accepted"], a[f"{GLOSSY}.{none}.accepted"])]
    text = f"{left[2]} against {box[2]}; acceptance {rates[0]:.3f} against {rates[1]:.3f}"
    rule = "intervals apart, the slit's above; acceptance lower"
    other = left[1] < box[0] or rates[0] > rates[1]
    return criteria.Outcome(text, rule, left[0] > box[1] and rates[0] < rates[1]), criteria.Outcome(text, rule, other)


def draw(a: Arrays) -> "Picture":
    """An image and the spectrum of each way; covariances along both axes."""
    picture, axes = style.panels(2, 3, width=3.6, height=3.0)
    high = 3 * float(a["k = 0.image"].mean())
    top = float(np.quantile(a["k = 0.spectrum"], 0.99))
    for column, (arm, name) in enumerate(list(NAMES.items())[:2]):
        shown_ = axes[0, column].imshow(a[f"{arm}.image"], vmin=0, vmax=high)
        picture.colorbar(shown_, ax=axes[0, column], label="radiance", extend="max")
        axes[0, column].set(title=f"Ceiling, {name}", xlabel="column, along x", ylabel="row, along z")
        spectrum = np.fft.fftshift(a[f"{arm}.spectrum"])
        shown_ = axes[1, column].imshow(spectrum, vmin=0, vmax=top, extent=(-0.5, 0.5, -0.5, 0.5))
        picture.colorbar(shown_, ax=axes[1, column], label="power", extend="max")
        axes[1, column].set(title=f"Spectrum, {name}", xlabel="cycles per pixel", ylabel="cycles per pixel")
        for axis in axes[:, column]:
            axis.grid(visible=False)
    for number, (what, label) in enumerate({"along": "along x", "across": "along z"}.items()):
        middle = [a[f"{arm}.{what}"].mean() for arm in NAMES]
        spread = [1.96 * a[f"{arm}.{what}"].std(ddof=1) / np.sqrt(len(a[f"{arm}.{what}"])) for arm in NAMES]
        look = style.nth(number, label=label, markevery=1)
        axes[0, 2].errorbar(np.arange(len(NAMES)) + 0.06 * number, middle, spread, **{**look, "ls": ""}, capsize=3)
    axes[0, 2].set_xticks(range(len(NAMES)), ["none", "5", "5, blue"])
    axes[0, 2].set(
        ylabel="covariance / mean$^2$ (bars: 95%)",
        xlabel="mutations",
        title="Covariance up to 8 pixels away",
        xlim=(-0.5, 2.5),
    )
    axes[0, 2].legend(loc="best")
    low = [a[f"{arm}.low"] for arm in NAMES]
    spread = [1.96 * each.std(ddof=1) / np.sqrt(len(each)) for each in low]
    axes[1, 2].errorbar(
        range(len(NAMES)), [each.mean() for each in low], spread, **{**style.nth(3), "ls": ""}, capsize=3
    )
    axes[1, 2].axhline(1, color=style.INK, lw=1, ls=":", marker="", label="white noise")
    axes[1, 2].set_xticks(range(len(NAMES)), ["none", "5", "5, blue"])
    axes[1, 2].set(ylabel="low-frequency ratio (bars: 95%)", xlabel="mutations", title="All are red", xlim=(-0.5, 2.5))
    axes[1, 2].set_ylim(0)
    axes[1, 2].legend(loc="lower right")
    return picture


FIGURE = Figure(
    id="MCMC-F07",
    title="Streaks on the ceiling, and mutations",
    world="tracer3d",
    source="[MCMC Fig. 7, Fig. 8, Tab. 2; 6.2, 6.3]",
    claims=("MCMC-F07", "MCMC-F08", "MCMC-T2", "MCMC-T2b", "MCMC-C04"),
    conditions=(
        Conditions(
            ("MCMC-F07", "MCMC-F08", "MCMC-T2", "MCMC-T2b", "MCMC-C04"),
            "[MCMC 6; Fig. 7, Fig. 8, Tab. 2]",
            Setup("real time", "still", "all", "the ceiling of a room lit through a door, 50 frames, M_c = 50"),
            Setup("real time", "still", "all", "Ajar3's ceiling in 36 x 36 pixels, neighbours within 5, M_c = 50"),
        ),
    ),
    arm="arm",
    presets={
        "quick": {"frames": 3, "replicas": 10, "box": 10, "parts": 1},
        "paper": {"frames": FRAMES, "replicas": 26, "box": 200, "parts": 4},
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)

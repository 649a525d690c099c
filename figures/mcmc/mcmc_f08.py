"""MCMC Fig. 7 and 8 in flatland: spectra of the error behind the slit, without mutations, with 5, and with 5 blue ones.

The row of pixels has no direction along the slit, so of Fig. 7 only a covariance is left to report.  Blue mutations
differ from plain ones by their acceptance alone, which forgets p_hat: a grey pixel's luminance stays whatever is
accepted.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments import masks
from figures.experiments.mutated import ARMS, FRAMES, VIEWS, chain, covariances, shown
from figures.report import style
from restir_ref.chance import Live
from restir_ref.metrics import low_frequency_ratio, power_spectrum
from restir_ref.transport.mutations import TwoRays

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

NAMES = {"k = 0": "no mutations", "k = 5": "5 mutations", "k = 5, blue": "5 mutations, blue"}
VIEW, CONTROL, RING, SWEEPS, MASKS = "FS3, whole film", "swapped masks", 128, 120, 40


def chunks(preset: Any) -> Sequence[dict[str, Any]]:
    """Parts of every way to mutate, and the positive control."""
    return [*({"arm": arm, "part": part} for arm in NAMES for part in range(preset["parts"])), {"control": CONTROL}]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Images (replicas, 128); masks less their mean."""
    if "control" in chunk:
        kind = masks.Kind((RING,), SWEEPS)
        return {"images": masks.swapped(masks.white(kind.shape, MASKS, rng), kind, rng) - 0.5}
    of = TwoRays(VIEWS[VIEW].tracer)
    return {"images": shown(*chain(of, ARMS[chunk["arm"]], preset["frames"], preset["replicas"], Live(rng)))}


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Of every arm: each image's low-frequency ratio and covariance, the mean spectrum, one image; the truth."""
    view, parts = VIEWS[VIEW], preset["parts"]
    found: Arrays = {"truth": view.truth, "control.low": low_frequency_ratio(results[-1]["images"])}
    found["control.spectrum"] = power_spectrum(results[-1]["images"]).mean(axis=0)
    for number, arm in enumerate(NAMES):
        images = np.concatenate([each["images"] for each in results[number * parts : (number + 1) * parts]])
        errors = images - view.truth
        found |= {
            f"{arm}.low": low_frequency_ratio(errors),
            f"{arm}.covariance": covariances(images) / view.truth.mean() ** 2,
            f"{arm}.spectrum": power_spectrum(errors).mean(axis=0),
            f"{arm}.image": images[0],
        }
    return found


def check(a: Arrays) -> list[Claim]:
    """All spectra are red; the control is blue; five mutations' covariance is reported, and judged as MCMC-T2."""
    claims = []
    for arm, name in NAMES.items():
        low = a[f"{arm}.low"]
        one = np.ones_like(low)
        claims.append(
            Claim(
                "MCMC-F08",
                criteria.ratio_above(low, one, 1),
                f"FS3, {name}: low-frequency ratio",
                criteria.ratio_below(low, one, 1),
            )
        )
    claims.append(Claim("MCMC-F08", criteria.below(a["control.low"].mean(), 0.2), "positive control: swapped masks"))
    fallen = criteria.reported(criteria.ratio_interval(a["k = 5.covariance"], a["k = 0.covariance"])[2])
    return [*claims, Claim("MCMC-F07", fallen, "FS3: covariance, 5 / 0")]


def draw(a: Arrays) -> "Picture":
    """One image of each way; spectra."""
    picture, axes = style.panels(1, 2, width=4.4, height=3.6)
    left, right = axes[0]
    rows = [a["truth"], *(a[f"{arm}.image"] for arm in NAMES)]
    style.strips(left, rows, ["truth", *NAMES.values()], 2 * float(a["truth"].max()), len(a["truth"]))
    left.set(title="The film, last frame of a chain", xlabel="pixel")
    k = np.arange(1, RING // 2 + 1)
    for number, (arm, name) in enumerate(NAMES.items()):
        spectrum = a[f"{arm}.spectrum"][k] / a[f"{arm}.spectrum"][1:].mean()
        right.semilogy(k / RING, spectrum, **style.nth(number, label=name, markevery=8))
    control = a["control.spectrum"][k] / a["control.spectrum"][1:].mean()
    right.semilogy(k / RING, control, **style.nth(3, label=CONTROL, markevery=8))
    right.set(xlabel="cycles per pixel", ylabel="power / mean power", title="Spectrum of the error")
    style.below(right)
    return picture


FIGURE = Figure(
    id="MCMC-F08",
    title="No blue noise behind the slit",
    world="flatland2d",
    source="[MCMC Fig. 7, Fig. 8; 6.2, 6.3]",
    claims=("MCMC-F07", "MCMC-F08"),
    conditions=(
        Conditions(
            ("MCMC-F07", "MCMC-F08"),
            "[MCMC 6; Fig. 7, Fig. 8]",
            Setup("real time", "still", "all", "the ceiling of a room lit through a door, 50 frames, M_c = 50"),
            Setup("real time", "still", "all", "FS3, the whole film, frames as the preset says, M_c = 50"),
        ),
    ),
    arm="arm",
    presets={
        "quick": {"frames": 8, "replicas": 32, "parts": 1},
        "paper": {"frames": FRAMES, "replicas": 100, "parts": 2},
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)

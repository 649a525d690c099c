"""GRIS Fig. 10: a long accumulation with and without a cap.

Every frame of either chain is unbiased, and so is its mean.  Without a cap the frames of one run soon are all the
same, so that their mean is as wrong as one of them: a visibly wrong image that nothing ever repairs.
"""

from collections.abc import Sequence
from itertools import islice
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Figure
from figures.experiments.chains import chain, images, three_of_radius_5
from figures.experiments.exact import true_image
from figures.report import style
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.integrals import Pixels
from restir_ref.metrics import rel_mse
from toy1d import image_of_64

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

NAMES = ("no cap", "$M_c = 20$")
CAPS = (np.inf, 20)


def chunks(preset: Any) -> Sequence[Any]:
    """Both chains."""
    return [{"cap": k} for k in range(len(CAPS))]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Images after all frames: their mean and the last two, relative to nothing; (replicas, 64) each."""
    here, chance = Pixels(image_of_64(), np.arange(64 * preset["replicas"])), Live(rng)
    total, last, before = np.zeros((preset["replicas"], 64)), np.zeros(0), np.zeros(0)
    for Y in islice(chain(here, CAPS[chunk["cap"]], three_of_radius_5, chance), preset["frames"]):
        before, last = last, images(Y, here)
        total += last
    return {"mean": total / preset["frames"], "last": last, "before": before}


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Images (cap, replica, pixel), the truth (pixel,), and errors of the means (cap, replica)."""
    truth = true_image(image_of_64())
    arrays = {name: np.stack([result[name] for result in results]) for name in results[0]}
    return {**arrays, "truth": truth, "error": rel_mse(arrays["mean"], truth), "frames": np.array(preset["frames"])}


def check(a: Arrays) -> list[Claim]:
    """The mean without a cap is far off, because its frames are the same image over and over."""
    frozen, alive = (correlation(a["last"][k], a["before"][k], a["truth"]) for k in (0, 1))
    ratio = criteria.ratio_above(a["error"][0], a["error"][1], 20)
    why = f"Means of {int(a['frames'])} frames."
    return [
        Claim("GRIS-F10", ratio, "relMSE of the mean, uncapped / capped", reason=why),
        Claim("GRIS-F10", criteria.above(frozen, 0.99), "uncapped: correlation of the last two frames"),
        Claim("GRIS-F10", criteria.below(alive, 0.99), "capped: correlation of the last two frames"),
    ]


def correlation(frame: Array, before: Array, truth: Array) -> float:
    """Correlation of two frames' relative errors, over pixels and replicas."""
    return float(np.corrcoef((frame / truth).ravel(), (before / truth).ravel())[0, 1])


def draw(a: Arrays) -> "Picture":
    """One run as an image and as curves, and the errors of all runs."""
    picture, axes = style.panels(1, 3, width=3.8, height=3.2)
    strips, curves, errors = axes[0]
    rows = (a["truth"], a["mean"][0, 0], a["last"][0, 0], a["mean"][1, 0], a["last"][1, 0])
    labels = ("truth", "no cap,\nmean", "no cap,\nlast", "cap 20,\nmean", "cap 20,\nlast")
    style.strips(strips, rows, labels, 1.5 * a["truth"].max(), len(a["truth"]))
    strips.set(xlabel="pixel", title=f"One run after {int(a['frames'])} frames")
    curves.plot(a["truth"], **style.look("truth"))
    for k, name in enumerate(NAMES):
        curves.plot(a["mean"][k, 0], **style.look(name, label=f"{name}, mean"))
    curves.set(xlabel="pixel", ylabel="radiance", title="The same run, as curves")
    style.below(curves, ncols=3)
    for k, name in enumerate(NAMES):
        errors.loglog(
            np.sort(a["error"][k]), (np.arange(a["error"].shape[1]) + 0.5) / a["error"].shape[1], **style.look(name)
        )
    errors.set(xlabel="relMSE of the mean of one run", ylabel="share of runs below", title="All runs")
    errors.set_yscale("linear")
    errors.tick_params(axis="x", which="minor", labelbottom=False)
    style.below(errors)
    return picture


FIGURE = Figure(
    id="GRIS-F10",
    title="A long accumulation with and without a cap",
    world="toy1d",
    source="[GRIS Fig. 10; 6.4, 9.1]",
    claims=("GRIS-F10",),
    presets={"quick": {"frames": 1000, "replicas": 32}, "paper": {"frames": 10_000, "replicas": 64}},
    arm="cap",
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)

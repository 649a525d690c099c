"""GPT Sec. 3.1 and 2.1: why differences of shifted paths are cheap, and what they do to the noise of an image.

Gradient-domain path tracing of the occluder row, one tree per pixel.  A difference of two pixels has the variance
Var + Var - 2 Cov: of paths that a shift correlates it is compared with that of independent ones, which is the sum of
both pixels' variances.  Then the row is reconstructed from its image and differences (L2), and the power of the noise
left is compared with that of the image, octave by octave.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.stats import spearmanr

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments.gradients import NONE, gradient_view, path_traced
from figures.experiments.references import reference
from figures.experiments.replicas import inside, placed
from figures.experiments.spectra import CLOSE, expected, explained
from figures.experiments.views import setting, standard
from figures.report import style
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.gradient_loop import GRADIENT, forward
from restir_ref.poisson import cosine_power, l2
from restir_ref.transport.edges import edges, seen

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

SCENE, GROUPS = "occluders", 16
"""The scene, and groups of replicas that are resampled for intervals."""


def chunks(preset: Any) -> Sequence[dict[str, int]]:
    """As many as there are blocks of replicas."""
    return [{"block": block} for block in range(preset["blocks"])]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Image and dx of one tree per pixel, (replicas, n)."""
    sensor, asked = standard(SCENE), Counter[str]()
    view = gradient_view(SCENE, (sensor, sensor), asked, GRADIENT, NONE)
    found = path_traced([view], asked, preset["replicas"], Live(rng))
    return {"primal": found["primal"], "dx": found["dx"]}


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """All blocks, the reference, and which pairs are edges."""
    sensor = standard(SCENE)
    edge = edges(seen(setting(SCENE).scene, sensor), forward((sensor.n,))["dx"][0])
    joined = {name: np.concatenate([part[name] for part in results]) for name in results[0]}
    return joined | {"edge": edge, "reference": reference(SCENE).mean}


def variances(a: Arrays, where: Array) -> tuple[Array, Array]:
    """Of dx by shifted paths, and of differences of independent ones, means over pairs; (GROUPS,)."""
    truth = a["reference"]
    dx = (a["dx"] - np.diff(truth)) ** 2
    pixel = (a["primal"] - truth) ** 2
    independent = pixel[:, 1:] + pixel[:, :-1]
    return tuple(in_groups(each[:, where].mean(axis=1)) for each in (dx, independent))  # type: ignore[return-value]


def in_groups(values: Array) -> Array:
    """Means over groups of replicas, (R, ...) -> (GROUPS, ...)."""
    kept = values[: len(values) // GROUPS * GROUPS]
    return np.asarray(kept.reshape(GROUPS, -1, *values.shape[1:]).mean(axis=1))


def octaves(a: Array, n: int) -> Array:
    """Mean power in 1, 2-3, 4-7, ... half waves per row."""
    return np.array([a[2**k : 2 ** (k + 1)].mean() for k in range(int(np.log2(n)))])


def powers(a: Arrays) -> tuple[Array, Array]:
    """Power of the noise of the image, and of its reconstruction, by octave."""
    truth = a["reference"]
    noise = [cosine_power(each - truth, 1).mean(axis=0) for each in (a["primal"], l2(a["primal"], a["dx"]))]
    before, after = (octaves(each, len(truth)) for each in noise)
    return before, after


def beside_the_formula(a: Arrays) -> list[tuple[Array, Array]]:
    """Power after reconstruction and that by GPT-P03 from measured spectra, octave by octave; (GROUPS,) each."""
    truth = a["reference"]
    noise = a["primal"] - truth, a["dx"] - np.diff(truth)
    spectra = cosine_power(l2(a["primal"], a["dx"]) - truth, 1), expected(*noise)
    after, formula = (np.stack([octaves(each, len(truth)) for each in in_groups(S)]) for S in spectra)
    return list(zip(after.T, formula.T, strict=True))


def check(a: Arrays) -> list[Claim]:
    """Interior pairs judged, edge pairs beside them; the order of octaves."""
    shifted, independent = variances(a, ~a["edge"])
    at_edges = criteria.ratio_interval(*variances(a, a["edge"]))[2]
    return [
        Claim("GPT-C04", criteria.ratio_below(shifted, independent, 0.1), "interior pairs, shifted / independent"),
        Claim("GPT-C04", criteria.reported(at_edges), "edge pairs, shifted / independent", reason=FAILED),
        *by_octave(a),
    ]


def by_octave(a: Arrays) -> list[Claim]:
    """The order of octaves, judged where gradients are clean enough for it, and GPT-P03 at the measured spectra."""
    id_, truth, (before, after) = "GPT-C07", a["reference"], powers(a)
    s_g = ((a["dx"] - np.diff(truth)) ** 2).mean() / ((a["primal"] - truth) ** 2).mean()
    order = float(spearmanr(np.arange(len(before)), after / before).statistic)
    number, both = farthest(beside_the_formula(a))
    parts = "order of noise ratios by octave", "power after / by GPT-P03, the octave farthest off"
    by = f"s_g / s_c = {s_g:.3f}: {'' if s_g < CLEAN else 'not '}clean enough to judge by this order."
    first = criteria.below(order, -0.8) if s_g < CLEAN else criteria.reported(order)
    second = placed(id_, criteria.ratio_interval(*both), inside(*CLOSE), parts[1])
    if s_g < CLEAN:
        second = Claim(id_, criteria.reported(criteria.ratio_interval(*both)[2]), parts[1])
    return [
        Claim(id_, first, parts[0], reason=by),
        explained(replace(second, reason=f"Octave {number} of {len(before)}.  {second.reason}".rstrip()), both),
    ]


def farthest(octaves_: Sequence[tuple[Array, Array]]) -> tuple[int, tuple[Array, Array]]:
    """Number, from 1, of the octave whose power is farthest from the formula's, and both, replica groups (GROUPS,)."""
    off = [abs(np.log(after.mean() / formula.mean())) for after, formula in octaves_]
    k = int(np.argmax(off))
    return k + 1, octaves_[k]


CLEAN = 0.08
"""Noise of gradients over that of the image below which the order of octaves decides."""

FAILED = "Across an edge most shifts fail, and a failed shift leaves the whole difference of two pixels."


def draw(a: Arrays) -> "Picture":
    """Variances along the row, and noise by octave."""
    picture, axes = style.panels(1, 2, width=4.2, height=3.0)
    left, right = axes[0]
    truth = a["reference"]
    pixel = ((a["primal"] - truth) ** 2).mean(axis=0)
    pair = np.arange(len(truth) - 1)
    left.semilogy(
        pair, ((a["dx"] - np.diff(truth)) ** 2).mean(axis=0), **style.nth(0, marker="", label="shifted paths")
    )
    left.semilogy(pair, pixel[1:] + pixel[:-1], **style.nth(1, marker="", label="independent paths"))
    left.set(xlabel="pair of pixels", ylabel="variance of dx (radiance$^2$)", title="Occluder row, one tree per pixel")
    style.below(left)
    before, after = powers(a)
    middle = 1.5 * 2.0 ** np.arange(len(before))
    right.loglog(middle, before, **style.look("primal"))
    right.loglog(middle, after, **style.look("Poisson L2"))
    right.set(xlabel="half waves per row", ylabel="power of the noise (radiance$^2$)", title="Noise by octave")
    right.legend()
    return picture


FIGURE = Figure(
    id="GPT-C04",
    title="What shifted paths are good for",
    world="flatland2d",
    source="[GPT 2.1, 3.1]",
    claims=("GPT-C04", "GPT-C07"),
    conditions=(
        Conditions(
            ("GPT-C04", "GPT-C07"),
            "[GPT 2.1, 3.1]",
            Setup("offline", "still", "all", "not named"),
            Setup("offline", "still", "all", "posts before a lit wall (FS5)"),
        ),
    ),
    presets={"quick": {"blocks": 2, "replicas": 1024}, "paper": {"blocks": 32, "replicas": 1024}},
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)

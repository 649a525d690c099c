"""Reconstruction from gradients on test images (TI) with synthetic noise: spectrum, gain, outliers, bias.

What L2 leaves of white noise has the predicted spectrum at every frequency, and gains far more in images than in rows.
A wrong difference spoils L2 everywhere; L1 leaves it standing where closed loops contradict it, which rows have not.
Reconstructions of I + errors are I + those of the errors, so that white noise and outliers need no picture under them.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.special import ellipe, ellipk

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Figure
from figures.report import style
from restir_ref.batch import Array
from restir_ref.poisson import ALPHA, cosine_power, differences, l2, output_spectrum, symbol
from restir_ref.poisson_l1 import l1

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Picture

RATIOS = (0.01, 0.1, 0.5, 1.0, 2.0, 5.0)
"""s_g / s_c, variances of the noise of gradients and primal image."""
SHOWN = (0.01, 0.1, 1.0)
"""Those whose spectra are drawn."""
BANDS = np.array([0.1, 0.2, 0.4, 0.8, 1.2, 1.6])
"""Borders of bands of sqrt(D); the lowest begins at 0, the highest ends with the image's frequencies."""
DIMENSIONS = {1: "1D", 2: "2D"}
METHODS = ("primal", "Poisson L2", "Poisson L1")

PRIMAL, GRADIENT, WRONG, SIZE = 0.3, 0.05, 0.03, 2.0
"""Standard deviations of the noise; the fraction of differences that are outliers, and by how much, up or down."""
SAMPLES = 4
"""Exponential samples per pixel of the skewed primal image."""


# ---------------------------------------------------------------- closed forms


def closed_form(ratio: float, dimensions: int, alpha: float = ALPHA) -> float:
    """Variance after over variance before of an endless image: a^2 int 1/(a + D)^2 + r int D/(a + D)^2, a = alpha^2.

    Both follow from F(a) = mean over frequencies of 1/(a + D): the first is -a^2 F', the second F + a F'.
    """
    a = alpha**2
    F, slope = {1: _row, 2: _plane}[dimensions](a)
    return -(a**2) * slope + ratio * (F + a * slope)


def _row(a: float) -> tuple[float, float]:
    """F = (a (a + 4))^(-1/2), and F'."""
    return (a * (a + 4)) ** -0.5, -(a + 2) * (a * (a + 4)) ** -1.5


def _plane(a: float) -> tuple[float, float]:
    """F = 2 K(m) / (pi c), c = a + 4, m = (4 / c)^2, and F'."""
    c = a + 4
    m = (4 / c) ** 2
    K, E = float(ellipk(m)), float(ellipe(m))
    dK = (E - (1 - m) * K) / (2 * m * (1 - m))
    return 2 * K / (np.pi * c), -2 * K / (np.pi * c**2) + 2 * dK * (-2 * m / c) / (np.pi * c)


def break_even(dimensions: int) -> float:
    """s_g / s_c at which nothing is gained."""
    none = closed_form(0, dimensions)
    return (1 - none) / (closed_form(1, dimensions) - none)


# ---------------------------------------------------------------- test images and noise


def test_image(shape: Sequence[int]) -> Array:
    """TI: waves, with a step across the middle; from 0.5 to 2."""
    x = np.meshgrid(*(np.arange(n) / n for n in shape), indexing="ij")
    waves = np.sin(9 * x[-1]) * (np.cos(7 * x[0]) if len(shape) > 1 else 1)
    return np.asarray(1 + 0.5 * waves + 0.5 * (x[-1] + (x[0] if len(shape) > 1 else 0) > 0.5 * len(shape)))


def white(shape: Sequence[int], s: float, rng: np.random.Generator) -> list[Array]:
    """White noise of gradients, of this standard deviation; images are (replicas, *shape)."""
    nothing = np.zeros(tuple(shape))
    return [s * rng.standard_normal(g.shape) for g in differences(nothing, len(shape) - 1)]


def wrong(shape: Sequence[int], rng: np.random.Generator) -> list[Array]:
    """Noise of gradients with outliers of either sign."""
    chance = [WRONG / 2, 1 - WRONG, WRONG / 2]
    return [g + SIZE * rng.choice([-1, 0, 1], size=g.shape, p=chance) for g in white(shape, GRADIENT, rng)]


# ---------------------------------------------------------------- measuring


def chunks(preset: Any) -> Sequence[Any]:
    """White noise, outliers and skewed noise, in rows and in images, group by group."""
    kinds = ("white", "outliers", "skewed")
    return [
        {"kind": kind, "dimensions": d, "group": k}
        for kind in kinds
        for d in DIMENSIONS
        for k in range(preset["groups"])
    ]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Arrays of one kind of noise; replicas come first."""
    shape = tuple(preset[DIMENSIONS[chunk["dimensions"]]][chunk["kind"]])
    return {"white": of_white, "outliers": of_outliers, "skewed": of_skewed}[chunk["kind"]](shape, rng)


def of_white(shape: tuple[int, ...], rng: np.random.Generator) -> Arrays:
    """Errors of L2 (n, ratios) and of the primal (n,), mean power of the former per band (ratios, bands)."""
    d = len(shape) - 1
    noise = rng.standard_normal(shape)
    nothing = np.zeros(shape)
    kept, added = l2(noise, *differences(nothing, d)), l2(nothing, *white(shape, 1, rng))
    errors = [kept + np.sqrt(ratio) * added for ratio in RATIOS]  # L2 is linear
    band = bands(shape[1:])
    powers = [cosine_power(e, d).mean(axis=0) for e in errors]
    return {
        "l2": np.stack([mse(e) for e in errors], axis=-1),
        "primal": mse(noise),
        "power": np.array([by_band(power, band) for power in powers]),
    }


def of_outliers(shape: tuple[int, ...], rng: np.random.Generator) -> Arrays:
    """Errors of primal, L2 and L1 per replica (n, 3), and the first replica of each (3, *shape)."""
    I = test_image(shape[1:])
    primal = I + PRIMAL * rng.standard_normal(shape)
    G = [g + e for g, e in zip(differences(I, I.ndim), wrong(shape, rng), strict=True)]
    images = [primal, l2(primal, *G), l1(primal, *G)]
    return {
        "errors": np.stack([mse(each - I) for each in images], axis=-1),
        "images": np.stack([each[0] for each in images]),
    }


def of_skewed(shape: tuple[int, ...], rng: np.random.Generator) -> Arrays:
    """Means of image and eighths relative to the truth, (n, 9) of L2, (m, 9) of L1 of a sixteenth of the replicas.

    The primal image holds means of exponential samples, whose median is below their mean.
    """
    I = test_image(shape[1:])
    primal = I * rng.gamma(SAMPLES, 1 / SAMPLES, size=shape)
    G = [g + e for g, e in zip(differences(I, I.ndim), white(shape, GRADIENT, rng), strict=True)]
    some = max(shape[0] // 16, 1)
    images = {"l2": l2(primal, *G), "l1": l1(primal[:some], *(g[:some] for g in G))}
    truth = criteria.mean_and_blocks(I.ravel())
    return {name: criteria.mean_and_blocks(image.reshape(len(image), -1)) / truth for name, image in images.items()}


def mse(errors: Array) -> Array:
    """Mean square over the pixels, (n, *shape) -> (n,)."""
    return np.asarray((errors**2).reshape(len(errors), -1).mean(axis=-1))


def bands(shape: Sequence[int]) -> Array:
    """The band of every frequency."""
    return np.asarray(np.digitize(np.sqrt(symbol(tuple(shape))), BANDS))


def by_band(spectrum: Array, band: Array) -> Array:
    """Means over bands."""
    return np.array([spectrum[band == k].mean() for k in range(len(BANDS) + 1)])


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Groups joined, and the predicted power per band; names are "white 1D l2" and so on."""
    found: Arrays = {}
    groups = preset["groups"]
    of = [(chunk["kind"], DIMENSIONS[chunk["dimensions"]]) for chunk in chunks(preset)]
    for k in range(0, len(of), groups):
        parts = results[k : k + groups]
        found |= {f"{' '.join(of[k])} {name}": joined(name, [part[name] for part in parts]) for name in parts[0]}
    for d in DIMENSIONS.values():
        shape = tuple(preset[d]["white"][1:])
        band = bands(shape)
        found[f"predicted {d}"] = np.array([by_band(output_spectrum(shape, 1, ratio), band) for ratio in RATIOS])
        found[f"frequency {d}"] = by_band(np.sqrt(symbol(shape)), band)
    return found


def joined(name: str, parts: Sequence[Array]) -> Array:
    """Replicas one after the other; powers averaged, of pictures the first."""
    if name == "power":
        return np.asarray(np.mean(parts, axis=0))
    return parts[0] if name == "images" else np.concatenate(parts)


# ---------------------------------------------------------------- claims

ON_TI = "on test images only, not in a rendered scene"


def check(a: Arrays) -> list[Claim]:
    """Spectrum, gain and break-even of L2; outliers; bias."""
    return [claim for d in DIMENSIONS for claims in (of_spectrum, of_gain, of_bias) for claim in claims(a, d)] + [
        *outliers(a)
    ]


def of_spectrum(a: Arrays, d: int) -> list[Claim]:
    """Measured over predicted power, of all bands the one that is farthest off."""
    name, claims = DIMENSIONS[d], []
    for ratio in SHOWN:
        at = RATIOS.index(ratio)
        off = a[f"white {name} power"][at] / a[f"predicted {name}"][at]
        worst = off[abs(np.log(off)).argmax()]
        claims.append(Claim("GPT-P03", criteria.between(worst, 0.9, 1.1), f"{name}: worst band, s_g / s_c = {ratio:g}"))
    return claims


def of_gain(a: Arrays, d: int) -> list[Claim]:
    """Variance ratios against the closed form, and the tested ratios on either side of the break-even."""
    name, before = DIMENSIONS[d], a[f"white {DIMENSIONS[d]} primal"]
    after = dict(zip(RATIOS, a[f"white {name} l2"].T, strict=True))
    forms = {ratio: closed_form(ratio, d) for ratio in RATIOS}
    low = max(ratio for ratio in RATIOS if ratio < break_even(d))
    high = min(ratio for ratio in RATIOS if ratio > break_even(d))
    claims = [
        Claim(
            "GPT-P04",
            criteria.ratio_within(after[ratio], before, 0.95 * form, 1.05 * form),
            f"{name}: variance ratio, s_g / s_c = {ratio:g}",
        )
        for ratio, form in forms.items()
    ]
    return [
        *claims,
        Claim("GPT-P04", criteria.ratio_below(after[low], before, 1), f"{name}: a gain at {low:g}"),
        Claim("GPT-P04", criteria.ratio_above(after[high], before, 1), f"{name}: a loss at {high:g}"),
        Claim("GPT-P04", criteria.reported(break_even(d)), f"{name}: break-even of the closed form"),
    ]


def of_bias(a: Arrays, d: int) -> list[Claim]:
    """L2 of skewed noise is unbiased, L1 is not."""
    name = DIMENSIONS[d]
    l2_means, l1_means = a[f"skewed {name} l2"], a[f"skewed {name} l1"][:, 0]
    unbiased = criteria.all_unbiased(l2_means, np.ones(l2_means.shape[1]))
    return [
        Claim("GPT-A11", unbiased, f"{name}: L2, image and eighths"),
        Claim("GPT-C03", unbiased, f"{name}: L2, image and eighths", caveat=ON_TI),
        Claim("GPT-C03", criteria.biased(l1_means, 1, -0.5, -0.01), f"{name}: L1, skewed primal", caveat=ON_TI),
    ]


def outliers(a: Arrays) -> list[Claim]:
    """3% of the differences wrong: in a row L2 is worse than the primal and L1 better than L2, in images far better."""
    (row, row_l2, row_l1), (_, image_l2, image_l1) = (a[f"outliers {d} errors"].T for d in DIMENSIONS.values())
    far = criteria.ratio_below(image_l1, image_l2, 1)
    return [
        Claim("GPT-P05", criteria.ratio_below(row_l1, row_l2, 1), "1D: error of L1 / L2"),
        Claim("GPT-P05", criteria.ratio_above(row_l2, row, 1), "1D: error of L2 / primal"),
        Claim("GPT-P05", criteria.reported(criteria.ratio_interval(row_l1, row)[2]), "1D: error of L1 / primal"),
        Claim("GPT-P05", criteria.ratio_below(image_l1, image_l2, 0.3), "2D: error of L1 / L2"),
        Claim("GPT-C03", far, "2D with outliers: error of L1 / L2", caveat=ON_TI),
    ]


# ---------------------------------------------------------------- picture


def draw(a: Arrays) -> "Picture":
    """Spectra and gain above; what outliers do below."""
    picture, axes = style.panels(2, 3, width=3.7, height=3.1)
    for k, d in enumerate(DIMENSIONS):
        draw_spectrum(axes[0, k], a, d)
    draw_gain(axes[0, 2], a)
    draw_errors(axes[1, 0], a)
    draw_row(axes[1, 1], a["outliers 1D images"])
    draw_images(axes[1, 2], a["outliers 2D images"])
    return picture


def draw_spectrum(axis: "Axes", a: Arrays, d: int) -> None:
    """Predicted lines, measured markers."""
    name = DIMENSIONS[d]
    D = np.linspace(0.01, 2 * np.sqrt(d), 400) ** 2
    for k, ratio in enumerate(SHOWN):
        S = (ALPHA**4 + D * ratio) / (ALPHA**2 + D) ** 2
        axis.plot(np.sqrt(D), S, **style.nth(k, marker="", label=f"$s_g / s_c$ = {ratio:g}"))
        measured = a[f"white {name} power"][RATIOS.index(ratio)]
        axis.plot(a[f"frequency {name}"], measured, **style.nth(k, ls=""), markevery=1)
    axis.set(
        xscale="log",
        yscale="log",
        xlabel="frequency, $\\sqrt{D(k)}$",
        ylabel="power of the error / $s_c$",
        title=f"{name}: lines predicted, markers measured",
    )
    axis.legend(loc="lower left")


def draw_gain(axis: "Axes", a: Arrays) -> None:
    """Variance after over variance before."""
    x = np.geomspace(RATIOS[0], RATIOS[-1], 100)
    for k, (d, name) in enumerate(DIMENSIONS.items()):
        label = f"{name}, break-even {break_even(d):.2f}"
        axis.plot(x, [closed_form(ratio, d) for ratio in x], **style.nth(k, marker="", label=label))
        measured = a[f"white {name} l2"].mean(axis=0) / a[f"white {name} primal"].mean()
        axis.plot(RATIOS, measured, **style.nth(k, ls=""), markevery=1)
    axis.axhline(1, color=style.GREY, lw=1, label="neither gain nor loss")
    axis.set(
        xscale="log",
        yscale="log",
        xlabel="noise of gradients, $s_g / s_c$",
        ylabel="variance of L2 / primal",
        title="Gradients gain more in images",
    )
    axis.set_ylim(top=60)
    axis.legend(loc="upper left")


def draw_errors(axis: "Axes", a: Arrays) -> None:
    """Mean square errors with outliers, in rows and images."""
    for k, method in enumerate(METHODS):
        errors = [a[f"outliers {d} errors"][:, k].mean() for d in DIMENSIONS.values()]
        axis.bar(np.arange(len(errors)) + 0.27 * (k - 1), errors, 0.25, **style.bar(method))
    axis.set_xticks(range(len(DIMENSIONS)), list(DIMENSIONS.values()))
    axis.set(
        yscale="log",
        ylim=(1e-3, 1),
        ylabel="mean square error",
        title=f"{100 * WRONG:g}% of the differences off by {SIZE:g}",
    )
    style.below(axis, ncols=3)


def draw_row(axis: "Axes", images: Array) -> None:
    """One row: what it should be, and both reconstructions."""
    axis.plot(test_image(images.shape[1:]), **style.look("truth"))
    for k in (1, 2):
        axis.plot(images[k], **style.look(METHODS[k], marker="", lw=1.0))
    axis.set(xlabel="pixel", ylabel="radiance", title="1D: wrong differences are steps")
    style.below(axis, ncols=3)


def draw_images(axis: "Axes", images: Array) -> None:
    """The truth and the primal image above both reconstructions."""
    step = images.shape[-1] + style.BETWEEN
    frames = ((0, 0), (0, style.BETWEEN), (0, style.BETWEEN))
    four = np.pad(np.stack([test_image(images.shape[1:]), *images]), frames, constant_values=np.nan)
    shown = axis.imshow(np.vstack([np.hstack(list(pair)) for pair in (four[:2], four[2:])]), vmin=0, vmax=2.5)
    axis.figure.colorbar(shown, ax=axis, label="radiance")
    for k, name in enumerate(("truth", *METHODS)):
        place = (k % 2 * step + 2, k // 2 * step + 2)
        axis.text(*place, name, va="top", bbox={"facecolor": style.PAPER, "lw": 0, "pad": 1.5})
    axis.set_xticks([])
    axis.set_yticks([])
    axis.grid(visible=False)
    axis.set_title("2D: closed loops keep them out")


QUICK = {
    "1D": {"white": [400, 1024], "outliers": [64, 256], "skewed": [256, 1024]},
    "2D": {"white": [64, 256, 256], "outliers": [16, 64, 64], "skewed": [64, 64, 64]},
}

FIGURE = Figure(
    id="GPT-P03",
    title="What reconstruction makes of noise",
    world="toy1d",
    source="[GPT 2.1, 5]",
    claims=("GPT-P03", "GPT-P04", "GPT-P05", "GPT-A11", "GPT-C03"),
    presets={"quick": {"groups": 1, **QUICK}, "paper": {"groups": 12, **QUICK}},
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)

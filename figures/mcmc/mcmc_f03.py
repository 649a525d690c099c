"""MCMC Fig. 3: masks of white and of blue noise; what spatial reuse makes of estimates that are spread like them.

Swaps that lower the thesis' energy make masks that lack low frequencies, so that the metric can see blue noise where it
is.  On a ring of pixels with one integrand, samples are then chosen so that their estimates are spread like a mask, and
reuse from three random neighbours averages them: a linear filter, whose answer is known.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.ndimage import gaussian_filter

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Figure
from figures.experiments import masks
from figures.report import style
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.integrals import Pixels, Reservoirs
from restir_ref.metrics import low_frequency_ratio, power_spectrum
from restir_ref.restir import shade, spatial
from toy1d import Line
from toy1d.toys import wave

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

RING, SIDE, COUNT = 128, 64, 40
KINDS: Mapping[str, masks.Kind] = MappingProxyType(
    {"row": masks.Kind((RING,), 120), "map": masks.Kind((SIDE, SIDE), 2)}
)
NEIGHBOURS, RADIUS, BLUR = 3, 5, 1.5
NOISES = ("white", "blue")


def ring() -> Line:
    """128 pixels with the wave of T1, f = 1 + .9 sin(2 pi x); they mean 1."""
    return Line(lambda pixel, x: wave(x), np.zeros(RING), np.ones(RING))


def spread_like(mask: Array, chance: Live) -> Array:
    """x in [0, 1), each uniform, of which f(x) rises with the mask's value v: the phase goes from trough to crest.

    Each f is reached on the way up and on the way down, as likely.
    """
    up = (mask - 0.5) / 2
    return np.asarray(np.where(chance.uniform(mask.shape) < 0.5, up, 0.5 - up) % 1)


def reused(mask: Array, rng: np.random.Generator) -> tuple[Array, Array]:
    """Estimates of every ring before and after one pass, (count, 128) each."""
    chance, of = Live(rng), ring()
    here = Pixels(of, np.arange(mask.size))
    X = Reservoirs(spread_like(mask.reshape(-1), chance), np.ones(mask.size), np.ones(mask.size))
    by = np.floor(2 * RADIUS * chance.uniform((NEIGHBOURS, mask.size))).astype(int) - RADIUS
    near = [here.index - here.index % RING + (here.index + step + (step >= 0)) % RING for step in by]
    Y = spatial(X, here, [Pixels(of, each) for each in near], chance)
    before, after = (shade(each, here)[0].reshape(mask.shape) for each in (X, Y))
    return before, after


# ---------------------------------------------------------------- the figure


def chunks(preset: Any) -> Sequence[Any]:
    """Rows and maps."""
    return [{"kind": kind} for kind in KINDS]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Per noise: low-frequency ratio of each mask, RMSE of mask and blurred mask, mean spectrum, the first mask.

    Of rows also estimates' ratio and mean squared error before and after reuse.
    """
    kind = KINDS[chunk["kind"]]
    found: Arrays = {}
    white = masks.white(kind.shape, preset[chunk["kind"]], rng)
    for noise, mask in zip(NOISES, (white, masks.swapped(white, kind, rng)), strict=True):
        errors = (mask - 0.5).reshape(-1, *kind.shape)
        blurred = gaussian_filter(errors, (0, *(BLUR,) * len(kind.shape)), mode="wrap")
        found |= {
            f"{noise}.ratio": low_frequency_ratio(errors, kind.axes),
            f"{noise}.rmse": rms(errors),
            f"{noise}.blurred": rms(blurred),
            f"{noise}.spectrum": power_spectrum(errors, kind.axes).mean(axis=0),
            f"{noise}.mask": mask[0].reshape(kind.shape),
        }
        if kind.shape == (RING,):
            for when, image in zip(("before", "after"), reused(mask, rng), strict=True):
                found[f"{noise}.{when}.ratio"] = low_frequency_ratio(image - 1)
                found[f"{noise}.{when}.error"] = ((image - 1) ** 2).mean(axis=-1)
                found[f"{noise}.{when}.spectrum"] = power_spectrum(image - 1).mean(axis=0)
    return {f"{chunk['kind']}.{name}": each for name, each in found.items()}


def filtered(S: Array, radius: int) -> Array:
    """Spectrum after reuse of estimates with spectrum S (n,), |H|^2 S + 3 b^2 mean (1 - h^2) S, H = 1 - 3 b + 3 b h.

    Of equal integrands and confidences the pass averages f(x) with the weights of 3 neighbours b = 3/16 each, and of
    its own sample 1 - 3 b; h is the mean of cos 2 pi k s over steps s up to `radius`, which are drawn for each pixel
    apart.  [GRIS Eq. 38]
    """
    s, b = np.arange(1, radius + 1), 3 / 16
    h = np.cos(2 * np.pi * np.outer(np.fft.fftfreq(len(S)), s)).mean(axis=1)
    return np.asarray(S * (1 - 3 * b + 3 * b * h) ** 2 + 3 * b**2 * (S * (1 - h**2)).mean())


def low_share(S: Array) -> float:
    """Mean of a spectrum (n,) over 0 < |k| <= 1/8, over its mean without k = 0."""
    k = abs(np.fft.fftfreq(len(S)))
    return float(S[(k > 0) & (k <= 1 / 8)].mean() / S[k > 0].mean())


def rms(errors: Array) -> Array:
    """Root mean square of each mask."""
    return np.asarray(np.sqrt((errors.reshape(len(errors), -1) ** 2).mean(axis=-1)))


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Both kinds."""
    return results[0] | results[1]


def check(a: Arrays) -> list[Claim]:
    """Masks are what they are called; reuse takes the blue away, and keeps a smaller error."""
    claims = []
    for kind, name in (("row", "1D"), ("map", "2D")):
        white, blue = (a[f"{kind}.{noise}.ratio"].mean() for noise in NOISES)
        both = criteria.all_of(criteria.between(white, 0.8, 1.2), criteria.below(blue, 0.2))
        claims += [Claim(id_, both, f"{name}, white and blue: low-frequency ratio") for id_ in ("MCMC-E11", "MCMC-F03")]
        rmse = [a[f"{kind}.{noise}.rmse"] for noise in NOISES]
        blurred = [a[f"{kind}.{noise}.blurred"] for noise in NOISES]
        claims += [
            Claim("MCMC-C11", criteria.equal_to(rmse[1], rmse[0]), f"{name}: RMSE, blue / white"),
            Claim("MCMC-C11", criteria.ratio_below(blurred[1], blurred[0], 0.5), f"{name}: the same, blurred"),
            Claim(
                "MCMC-C12", criteria.reported(criteria.ratio_interval(blurred[1], blurred[0])[2]), f"{name}: blurred"
            ),
        ]
    error = [a[f"row.{noise}.after.error"] for noise in NOISES]
    low = [a[f"row.{noise}.after.error"] * a[f"row.{noise}.after.ratio"] for noise in NOISES]
    return [
        *claims,
        *check_reuse(a),
        Claim("MCMC-C06", criteria.ratio_below(error[1], error[0], 0.9), "variance after reuse, blue / white"),
        Claim("MCMC-C06", criteria.ratio_below(low[1], low[0], 1), "low-frequency power after reuse, blue / white"),
    ]


FINE = 0.005
"""The standard error of a ratio that is held against 1/2."""


def check_reuse(a: Arrays) -> list[Claim]:
    """What reuse makes of the ratios, of blue and of white, and that it is the filter."""
    before, after = ([a[f"row.{noise}.{when}.ratio"] for noise in NOISES] for when in ("before", "after"))
    half = criteria.ratio_above(after[1], np.ones_like(after[1]), 0.5)
    undone = criteria.all_of(criteria.below(before[1].mean(), 0.2), half)
    reddened = criteria.all_of(criteria.between(before[0].mean(), 0.8, 1.2), criteria.above(after[0].mean(), 1.3))
    part, error = "blue: low-frequency ratio before and after reuse", after[1].std(ddof=1) / np.sqrt(len(after[1]))
    rough = f"{len(after[1])} rings leave a standard error of {error:.3f}."
    claims = [
        Claim("MCMC-C05", undone, part, caveat=knife_edge(a), reason=rough),
        Claim("MCMC-C05", like_the_filter(a), "spectra after reuse, of the filter's, low and all"),
    ]
    if error > FINE:
        claims = [replace(each, outcome=None, caveat="", reason=rough) for each in claims]
    return [*claims, Claim("MCMC-C05", reddened, "white: low-frequency ratio before and after reuse")]


def knife_edge(a: Arrays) -> str:
    """How the answer depends on the radius."""
    found = {r: low_share(filtered(a["row.blue.before.spectrum"], r)) for r in (2, RADIUS, 20)}
    told = ", ".join(f"{ratio:.2f} at radius {r}" for r, ratio in found.items())
    return f"one pass leaves about half of white noise's low frequencies, and the radius decides: by the filter {told}"


def like_the_filter(a: Arrays) -> criteria.Outcome:
    """Low-frequency share and mean of the spectra after reuse, relative to what the filter says."""
    found = []
    for noise in NOISES:
        S = a[f"row.{noise}.after.spectrum"]
        right = filtered(a[f"row.{noise}.before.spectrum"], RADIUS)
        found += [low_share(S) / low_share(right), S[1:].mean() / right[1:].mean()]
    return criteria.all_of(*(criteria.between(each, 0.95, 1.05) for each in found))


def draw(a: Arrays) -> "Picture":
    """Masks and spectra in 2D; spectra of estimates on the ring before and after reuse."""
    picture, axes = style.panels(2, 3, width=3.7, height=2.9)
    for row, noise in zip(axes, NOISES, strict=True):
        shown = row[0].imshow(a[f"map.{noise}.mask"], vmin=0, vmax=1)
        picture.colorbar(shown, ax=row[0], label="value")
        row[0].set(title=f"A mask of {noise} noise", xlabel="column", ylabel="row")
        spectrum = np.fft.fftshift(a[f"map.{noise}.spectrum"])
        spectrum[SIDE // 2, SIDE // 2] = 0
        half = (-0.5, 0.5, -0.5, 0.5)
        shown = row[1].imshow(spectrum, vmin=0, vmax=0.2, extent=half)
        picture.colorbar(shown, ax=row[1], label="power", extend="max")
        row[1].set(
            title=f"Mean spectrum of {len(a[f'map.{noise}.ratio'])} masks",
            xlabel="cycles per pixel",
            ylabel="cycles per pixel",
        )
        for axis in row[:2]:
            axis.grid(visible=False)
        k = np.arange(1, RING // 2 + 1)
        for number, when in enumerate(("before", "after")):
            look = style.nth(3 * number, label=f"{when} reuse", markevery=8)
            row[2].semilogy(k / RING, a[f"row.{noise}.{when}.spectrum"][k], **look)
        row[2].set(xlabel="cycles per pixel", ylabel="power", title=f"Estimates like {noise} noise", ylim=(3e-4, 3))
        row[2].legend(loc="lower right")
    return picture


FIGURE = Figure(
    id="MCMC-F03",
    title="White and blue noise, and what spatial reuse makes of both",
    world="toy1d",
    source="[MCMC Fig. 3; 3.3, 4.2, 6.1, 6.3]",
    claims=("MCMC-E11", "MCMC-F03", "MCMC-C05", "MCMC-C06", "MCMC-C11", "MCMC-C12"),
    presets={"quick": {"row": COUNT, "map": COUNT}, "paper": {"row": 100 * COUNT, "map": 2 * COUNT}},
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)

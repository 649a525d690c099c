"""GRIS 6.4: what a chain with a finite cap forgets, and what it explores.

Left and middle: with temporal reuse alone, frames k apart correlate like (M_c / (M_c + 1))^k, so their mean
converges (exact moments; markers are the real code).  Right: a sample drawn from all frames of a chain with
temporal and spatial reuse, by its resampling weight, is distributed as the integrand, much closer than the
samples of single frames are.
"""

from collections.abc import Sequence
from itertools import islice
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.stats import chi2

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Figure
from figures.experiments.chains import chain, nobody, three_of_radius_5
from figures.experiments.exact import Loop, accumulated, copied, integrals, shaded_beside, start, step
from figures.report import style
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.integrals import Pixels
from restir_ref.oracle.moments import variance
from restir_ref.restir import shade
from toy1d import Line, image_of_64, quotient, two_pixels

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

CAPS = (1, 5, 20)
LAGS = np.arange(61)
BINS = 16


def chunks(preset: Any) -> Sequence[Any]:
    """Per cap: exact correlation and mean, and chains; then blocks of chains on the image."""
    per_cap = [{"kind": kind, "cap": cap} for kind in ("exact", "chains") for cap in CAPS]
    return per_cap + [{"kind": "drawn", "block": b} for b in range(preset["blocks"])]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """One of three things; see the functions."""
    if chunk["kind"] == "exact":
        loop = Loop(quotient(two_pixels(), 32), chunk["cap"], ())
        return {"rho": correlation(loop), "sd": sd_of_means(loop, preset["frames"])}
    if chunk["kind"] == "chains":
        return {"rho": sampled_correlation(chunk["cap"], preset["chains"], Live(rng))}
    return drawn_from_all(preset["long"], preset["replicas"], Live(rng))


# ---------------------------------------------------------------- correlation


def correlation(loop: Loop) -> Array:
    """Exact correlation of pixel 1's estimates at a late frame and k frames on, (lags,)."""
    Z, c = start(loop, 2), 0.0
    for _ in range(20 * int(loop.cap) + 20):
        Z, c = step(loop, Z, c)
    Z, found = copied(loop, Z), []
    for _ in LAGS:
        both = shaded_beside(loop, Z)
        covariance = both.second - np.outer(both.mean, both.mean)
        found.append(covariance[0, 2] / np.sqrt(covariance[0, 0] * covariance[2, 2]))
        Z, c = step(loop, Z, c)
    return np.array(found)


def sampled_correlation(cap: float, replicas: int, chance: Live) -> Array:
    """The same over chains of the real code, (lags,)."""
    here = Pixels(two_pixels(), np.arange(2 * replicas))
    frames = islice(chain(here, cap, nobody, chance), 6 * int(cap) + 20 + len(LAGS))
    late = [shade(Y, here)[0][::2] for Y in frames][-len(LAGS) :]
    return np.array([np.corrcoef(late[0], each)[0, 1] for each in late])


def recorded(frames: int) -> Array:
    """Frames to look at, 10 per decade and back from the last one."""
    return np.unique((frames / 10 ** np.arange(0, np.log10(frames), 0.1)).round().astype(int))


def sd_of_means(loop: Loop, frames: int) -> Array:
    """Exact relative standard deviation of the mean of t frames of pixel 1, for recorded t."""
    Z, c, found = start(loop, 2), 0.0, []
    for t in range(1, frames + 1):
        Z, c = step(loop, Z, c)
        Z = accumulated(loop, Z)
        found.append(np.sqrt(variance(Z)[-2]) / t / integrals(loop.frame)[0])
    return np.asarray(np.array(found)[recorded(frames) - 1])


# ---------------------------------------------------------------- one sample of all frames


def drawn_from_all(frames: int, replicas: int, chance: Live) -> Arrays:
    """Where in F_i the samples are: one Y per pixel drawn from all frames by f(Y_t) W_t, as counts (replicas, bins).

    Also how the weights of all frames spread over the bins, and how the samples of single frames do, (bins,).
    """
    line, here = image_of_64(), Pixels(image_of_64(), np.arange(64 * replicas))
    table, total = cdf_table(line), np.zeros(64 * replicas)
    drawn, weighted, single = np.zeros(64 * replicas, dtype=int), np.zeros((64 * replicas, BINS)), np.zeros(BINS)
    for Y in islice(chain(here, 20, three_of_radius_5, chance), frames):
        w, b = shade(Y, here)[0], bins(table, here.index % 64, Y.x)
        total += w
        drawn = np.where(chance.uniform(w.shape) * total < w, b, drawn)
        weighted[here.index, b] += w
        single += np.bincount(b[w > 0], minlength=BINS)
    counts = np.bincount(drawn + BINS * (here.index // 64), minlength=BINS * replicas).reshape(replicas, BINS)
    return {"counts": counts, "weighted": (weighted / total[:, None]).mean(axis=0), "single": single / single.sum()}


def cdf_table(line: Line, n: int = 4000) -> Array:
    """F_i at k / n by the midpoint rule, (pixels, n + 1)."""
    x = (np.arange(n) + 0.5) / n
    upto = np.cumsum([line.f(np.full(n, i), x) for i in range(line.n)], axis=1)
    return np.asarray(np.pad(upto / upto[:, -1:], ((0, 0), (1, 0))))


def bins(table: Array, pixel: Array, x: Array) -> Array:
    """Bin of F_i(x), which is uniform where x has density f_i / ||f_i||; linear between the table's entries."""
    n = table.shape[1] - 1
    k = np.minimum((x * n).astype(int), n - 1)
    F = table[pixel, k] + (x * n - k) * (table[pixel, k + 1] - table[pixel, k])
    return np.asarray(np.minimum((F * BINS).astype(int), BINS - 1))


def chi_square(share: Array, size: float) -> float:
    """p-value of bins (B,) against the uniform distribution, for `size` independent samples."""
    return float(chi2.sf(size * BINS * ((share - 1 / BINS) ** 2).sum(), BINS - 1))


def effective_size(counts: Array) -> float:
    """Independent samples worth as many as counts (replicas, bins): multinomial variance over that between replicas."""
    per_replica, n = counts / counts.sum(axis=1, keepdims=True), len(counts)
    share = per_replica.mean(axis=0)
    return float((share * (1 - share)).sum() / (per_replica.var(axis=0, ddof=1) / n).sum())


# ---------------------------------------------------------------- judging


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Correlations (cap, lag), spreads (cap, t), and the bins of all blocks."""
    exact, chains, blocks = results[:3], results[3:6], results[6:]
    return {
        "rho": np.stack([result["rho"] for result in exact]),
        "sampled": np.stack([result["rho"] for result in chains]),
        "t": recorded(preset["frames"]),
        "sd": np.stack([result["sd"] for result in exact]),
        "counts": np.concatenate([block["counts"] for block in blocks]),
        "weighted": np.mean([block["weighted"] for block in blocks], axis=0),
        "single": np.mean([block["single"] for block in blocks], axis=0),
    }


def check(a: Arrays) -> list[Claim]:
    """The law of correlation, the slope of the mean, and the distribution of the sample of all frames."""
    t, size = a["t"], effective_size(a["counts"])
    late = t >= 0.99 * t[-1] / 100
    share = a["counts"].mean(axis=0) / 64
    effective = f"As many as {size:.0f} independent ones."
    off = {name: float(abs(a[name] - 1 / BINS).sum()) for name in ("weighted", "single")}
    return [
        *(_correlated(k, a) for k in range(len(CAPS))),
        Claim("GRIS-C06", criteria.below(abs(a["sampled"] - a["rho"]).max(), 0.1), "real code against exact, any lag"),
        *(
            Claim(
                "GRIS-C06", criteria.slope_within(t[late], a["sd"][k][late], -0.5, 0.08), f"cap {cap}: sd of the mean"
            )
            for k, cap in enumerate(CAPS)
        ),
        Claim("GRIS-C07", criteria.above(chi_square(share, size), 1e-3), "chi-square p of samples", reason=effective),
        Claim("GRIS-C07", criteria.below(chi_square(a["single"], size), 1e-3), "twin: p of single frames at that size"),
        Claim("GRIS-C07", criteria.below(off["weighted"] / off["single"], 1), "L1 distance, all frames / single frame"),
    ]


def _correlated(k: int, a: Arrays) -> Claim:
    largest = abs(a["rho"][k] - (CAPS[k] / (CAPS[k] + 1)) ** LAGS).max()
    return Claim(
        "GRIS-C06", criteria.below(largest, 0.03), f"cap {CAPS[k]}: distance of the correlation from the power"
    )


def draw(a: Arrays) -> "Picture":
    """Correlation over lag, spread of the mean over frames, distribution of samples."""
    picture, axes = style.panels(1, 3, width=3.7, height=3.5)
    lags, means, shares = axes[0]
    for k, cap in enumerate(CAPS):
        name = style.cap(cap)
        lags.plot(LAGS, a["rho"][k], **style.look(name, marker=""))
        lags.plot(LAGS, a["sampled"][k], **style.look(name, ls="", label=None), markevery=4, ms=3.5)
        means.loglog(a["t"], a["sd"][k], **style.look(name, marker=""))
    lags.set(xlabel="lag $k$ (frames)", ylabel="correlation", title="Lines exact, markers the real code")
    lags.legend()
    means.set(xlabel="frames averaged $t$", ylabel="relative sd of their mean", title="Temporal reuse alone, exact")
    means.legend()
    edges = np.linspace(0, 1, BINS + 1)
    drawn = a["counts"].mean(axis=0) / 64
    shares.stairs(BINS * a["single"], edges, color=style.VERMILLION, ls="--", lw=1.5, label="samples of single frames")
    shares.stairs(BINS * a["weighted"], edges, color=style.BLUE, lw=2, label="drawn from all frames")
    shares.plot(
        (edges[1:] + edges[:-1]) / 2,
        BINS * drawn,
        ".",
        color=style.INK,
        ms=4,
        markevery=1,
        label="one draw per pixel and run",
    )
    shares.set(
        xlabel="$F_i(Y)$, uniform for $Y \\sim f_i / ||f_i||$", ylabel="density", title="64-pixel image, $M_c = 20$"
    )
    shares.set_ylim(0.5, 1.7)
    style.below(shares, ncols=1)
    return picture


FIGURE = Figure(
    id="GRIS-C06",
    title="A capped chain forgets and explores",
    world="toy1d",
    source="[GRIS 6.4]",
    claims=("GRIS-C06", "GRIS-C07"),
    presets={
        "quick": {"frames": 3000, "chains": 2000, "long": 2000, "replicas": 64, "blocks": 1},
        "paper": {"frames": 10_000, "chains": 20_000, "long": 2000, "replicas": 64, "blocks": 8},
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)

"""MCMC 6.3: what mutations move behind the slit, and what they cannot move, the pixel's own luminance.

Left: however many mutations, a grey pixel shows what it showed, and no proposal changes its energy with its neighbours
but by rounding, of which the square root in the energy makes half of the digits.  Right: accepted moves are as often
to brighter paths as to dimmer ones where samples follow p_hat; candidates of one tree do not, and brighten.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments.mutated import ARMS, BLUE_WEIGHT, ENOUGH, VIEWS, chain, near_by, shown
from figures.report import style
from restir_ref.batch import Array, ratio
from restir_ref.chance import Live
from restir_ref.decorrelation import Blue, Move, metropolis, mutate, ready
from restir_ref.integrals import Pixels, Reservoirs, target
from restir_ref.restir import initial
from restir_ref.transport.mutations import TwoRays

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

VIEW = "FS3, whole film"
WATCHED, BINS = (1, 5, 50), np.linspace(-3, 3, 61)
STARTS = ("resampled, weighted", "resampled", "candidates")
TITLES = {
    "resampled, weighted": "ReSTIR's samples, each by $\\hat p\\,W$",
    "resampled": "ReSTIR's samples, all alike",
    "candidates": "candidates of one tree",
}


def chunks(preset: Any) -> Sequence[dict[str, int]]:
    """Parts of the replicas."""
    return [{"part": part} for part in range(preset["parts"])]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Changes of luminance and energy, and log ratios of accepted moves by replica."""
    chance, of = Live(rng), TwoRays(VIEWS[VIEW].tracer)
    X, here = chain(of, ARMS["k = 0"], preset["frames"], preset["replicas"], chance)
    return kept(X, here, chance) | steps(X, initial(here, chance), here, chance)


def kept(X: Reservoirs, here: Pixels, chance: Live) -> Arrays:
    """Largest relative change of a lit pixel after 1, 5, 50 mutations, and largest |e' - e| of any proposal."""
    before, changes, energies = shown(X, here), [], [0.0]
    noise = Blue(before.reshape(-1), *near_by(here, chance), BLUE_WEIGHT)

    def watched(move: Move) -> Array:
        e, e_new = noise.energies(move)
        energies.append(float(np.abs(e_new - e)[(move.p_hat_new > 0) & (move.X.W > 0)].max(initial=0)))
        return metropolis(move)

    there = ready(X, here)
    for k in range(1, max(WATCHED) + 1):
        X = mutate(X, there, chance, watched)
        if k in WATCHED:
            after = shown(X, here)
            changes.append(float(np.abs(after - before).max() / before.mean()))
    return {"luminance": np.array(changes), "energy": np.array([max(energies)])}


def steps(X: Reservoirs, candidates: Reservoirs, here: Pixels, chance: Live) -> Arrays:
    """Per start: sums over accepted moves by replica of weight and weighted log ratio, and a histogram of these."""
    found: Arrays = {}
    for start in STARTS:
        Y = candidates if start == "candidates" else X
        there = ready(Y, here)
        x_new, T = there.of.propose(here.index, Y.x, chance)  # type: ignore[attr-defined]
        move = Move(here, Y, x_new, target(here, Y.x), target(here, x_new), T)
        a = np.where((move.p_hat_new > 0) & (Y.W > 0), metropolis(move), 0)
        weight = a * (move.p_hat * Y.W if start == STARTS[0] else 1)
        log = np.log(ratio(move.p_hat_new, move.p_hat), where=a > 0, out=np.zeros_like(a))
        n = VIEWS[VIEW].sensor.n
        found[f"{start}.weight"] = weight.reshape(-1, n).sum(axis=1)
        found[f"{start}.log"] = (weight * log).reshape(-1, n).sum(axis=1)
        found[f"{start}.histogram"] = np.histogram(np.clip(log, BINS[0], BINS[-1]), BINS, weights=weight)[0]
    return found


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """The largest changes; all replicas; histograms added."""
    found: Arrays = {name: np.stack([each[name] for each in results]).max(axis=0) for name in ("luminance", "energy")}
    for start in STARTS:
        for name in ("weight", "log"):
            found[f"{start}.{name}"] = np.concatenate([each[f"{start}.{name}"] for each in results])
        found[f"{start}.histogram"] = np.sum([each[f"{start}.histogram"] for each in results], axis=0)
    return found


def mean_log(a: Arrays, start: str) -> tuple[float, float]:
    """Mean log ratio of accepted moves, and its standard error over replicas."""
    weight, log = a[f"{start}.weight"], a[f"{start}.log"]
    mean = log.sum() / weight.sum()
    apart = (log - mean * weight) / weight.mean()
    return float(mean), float(apart.std(ddof=1) / np.sqrt(len(apart)))


def check(a: Arrays) -> list[Claim]:
    """Nothing that the pixel shows changes; moves are balanced where samples follow p_hat."""
    claims = [
        Claim("MCMC-P02", criteria.below(change, 1e-10), f"{k} mutations: largest change of a pixel / mean")
        for k, change in zip(WATCHED, a["luminance"], strict=True)
    ]
    claims.append(Claim("MCMC-P02", criteria.below(a["energy"][0], 1e-7), "largest |e' - e| of 50 proposals"))
    (mean, error), (bright, error_b) = (mean_log(a, start) for start in (STARTS[0], STARTS[2]))
    balanced = criteria.Outcome(
        f"{mean:+.4f} ± {1.96 * error:.4f}", "0 within its 95% interval, which is at most ± 0.02", holds(mean, error)
    )
    rising = criteria.Outcome(f"{bright:+.4f} ± {1.96 * error_b:.4f}", "95% interval above 0", bright > 1.96 * error_b)
    alike, error_a = mean_log(a, STARTS[1])
    return [
        *claims,
        if_enough(a, balanced, "samples that follow p_hat: mean log ratio of accepted moves"),
        if_enough(a, rising, "candidates of one tree: the same"),
        Claim("MCMC-C07", criteria.reported(f"{alike:+.4f} ± {1.96 * error_a:.4f}"), "resampled, not weighted"),
    ]


def if_enough(a: Arrays, outcome: criteria.Outcome, part: str) -> Claim:
    """Judged of as many images as covariances are."""
    if len(a[f"{STARTS[0]}.log"]) < ENOUGH:
        return Claim("MCMC-C07", None, part, reason="Too few images.")
    return Claim("MCMC-C07", outcome, part, reason="" if outcome.passed else FLAT)


FLAT = (
    "Walls are Lambert, so that over random numbers the target is nearly flat where the path is not blocked: a step "
    "changes it by a percent, and candidates, which are uniform there, follow it already."
)


def holds(mean: float, error: float) -> bool:
    """0 is in the interval, and the interval small."""
    return abs(mean) <= 1.96 * error <= 0.02


def draw(a: Arrays) -> "Picture":
    """Changes over k; distributions of log ratios."""
    picture, axes = style.panels(1, 2, width=4.4, height=3.4)
    left, right = axes[0]
    left.loglog(WATCHED, np.maximum(a["luminance"], 1e-18), **style.nth(0, label="pixel / mean", markevery=1))
    left.axhline(
        max(a["energy"][0], 1e-18), color=style.VERMILLION, ls="--", marker="", label="energy, any of 50 steps"
    )
    left.set(xlabel="mutations $k$", ylabel="largest change", ylim=(1e-18, 1), title="What a grey pixel shows")
    left.set_xticks(WATCHED, [str(k) for k in WATCHED])
    left.minorticks_off()
    left.legend(loc="upper left")
    for number, start in enumerate(STARTS):
        share = a[f"{start}.histogram"] / a[f"{start}.histogram"].sum() / np.diff(BINS)
        middle = (BINS[1:] + BINS[:-1]) / 2
        right.semilogy(middle, np.maximum(share, 1e-4), **style.nth(2 * number, label=TITLES[start], markevery=8))
    right.axvline(0, color=style.INK, lw=1, ls=":", marker="", label="as bright as before")
    right.set(xlabel="$\\log \\hat p(x') / \\hat p(x)$ of accepted moves", ylabel="density", title="Where paths move")
    right.set(ylim=(1e-3, 30), xlim=(-3, 3))
    style.below(right, ncols=2)
    return picture


FIGURE = Figure(
    id="MCMC-P02",
    title="What mutations behind the slit move, and what they keep",
    world="flatland2d",
    source="[MCMC 3.2.4, 6.3, Alg. 6]",
    claims=("MCMC-P02", "MCMC-C07"),
    conditions=(
        Conditions(
            ("MCMC-P02", "MCMC-C07"),
            "[MCMC 6.3]",
            Setup("real time", "still", "all", "the ceiling of a room lit through a door, after 50 frames"),
            Setup("real time", "still", "all", "FS3, the whole film, after as many frames as the preset says"),
        ),
    ),
    presets={
        "quick": {"frames": 6, "replicas": 24, "parts": 1},
        "paper": {"frames": 50, "replicas": 64, "parts": 2},
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)

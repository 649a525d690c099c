"""MCMC 3.2.4, 4.2: mutations make a larger M_c usable, as long as they leave the target invariant.

An image of 64 pixels runs temporal reuse, five mutations and spatial reuse.  Left: its mean is exact on cells, where
w_bn > 0 and the inverted W show as soon as pixels share samples.  Right: its error over M_c, from the real passes;
in the middle that of a smaller image, exact.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Figure
from figures.experiments.chains import images, three_of_radius_5
from figures.experiments.exact import Loop, across_space, along_time, integrals, shaded, start, true_image
from figures.report import style
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.decorrelation import mutate
from restir_ref.integrals import Pixels
from restir_ref.mis import WEIGHTS
from restir_ref.oracle.cells import Frame
from restir_ref.oracle.moments import Source, independent, operator, resampled, variance
from restir_ref.oracle.mutations import FOLDS, Mutation, blue, inverted, kernel, mutated, power, repeated, steps
from restir_ref.restir import initial, spatial, temporal
from toy1d import Line, image_of_64, quotient, ring_of_8, walking

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

CHAINS: Mapping[str, Mutation] = MappingProxyType(
    {"right": mutate, "W inverted": inverted, "$w_{bn}$ = 0.25": blue(0.25), "$w_{bn}$ = 1": blue(1)}
)
CELLS, RING_CELLS, SIGMA, CAP, MOST = 64, 16, 0.02, 20, 5
TURNS = (-4, 1, 3)

# ---------------------------------------------------------------- exact means


def stepping(line: Line, K: int) -> Frame:
    """A line on K cells, with wrapped steps of its primary sample number."""
    frame = quotient(line, K)
    moves = steps(K, max(SIGMA * K, 1), FOLDS["wrapped"])
    return Frame(replace(frame.cells, proposal=moves / moves.sum(axis=1, keepdims=True)), frame.n)


def image_bias(mutation: Mutation, frames: int) -> Array:
    """Exact relative bias of every pixel after the mutations and after spatial reuse of each frame, (2, frames, 64)."""
    frame = stepping(image_of_64(), CELLS)
    f, v, n = frame.cells.f, frame.cells.v, frame.n
    moved = [np.linalg.matrix_power(kernel(frame, i, mutation).A, MOST) for i in range(n)]
    E, c, found = v, 1, []
    for t in range(frames):
        if t > 0:
            history = min((1 + len(TURNS)) * c, CAP)
            E = np.stack([L @ np.concatenate([v[i], E[i]]) for i, L in enumerate(in_time(history))])
            c = 1 + history
        own = np.stack([E[i] @ A for i, A in enumerate(moved)])
        E = np.stack([L @ own[[i, *around(i, n)]].ravel() for i, L in enumerate(in_space(c))])
        found.append([(f * each).sum(axis=1) / (f * v).sum(axis=1) - 1 for each in (own, E)])
    return np.array(found).transpose(1, 0, 2)


def around(i: int, n: int) -> list[int]:
    """The neighbours of a pixel, mirrored where they would leave the image."""
    return [i + by if 0 <= i + by < n else i - by for by in TURNS]


@cache
def in_time(c: int) -> list[Array]:
    """Means of Talbot reuse of a new sample and history of confidence c, per pixel (K, 2 K)."""
    frame = stepping(image_of_64(), CELLS)
    sources = [[Source(0, frame, i, 1), Source(CELLS, frame, i, c)] for i in range(frame.n)]
    return [operator(each, 2 * CELLS, WEIGHTS["talbot"]).L for each in sources]


@cache
def in_space(c: int) -> list[Array]:
    """Means of defensive reuse from three neighbours, all of confidence c, per pixel (K, 4 K)."""
    frame = stepping(image_of_64(), CELLS)
    pixels = [[i, *around(i, frame.n)] for i in range(frame.n)]
    sources = [[Source(s * CELLS, frame, j, c) for s, j in enumerate(each)] for each in pixels]
    return [operator(each, 4 * CELLS, WEIGHTS["defensive"]).L for each in sources]


# ---------------------------------------------------------------- exact errors


def ring_error(cap: float, k: int, tolerance: float = 1e-6) -> float:
    """Exact relMSE of a frame of `ring_of_8` with k mutations and reuse from both sides, once it changes no more."""
    frame = stepping(ring_of_8(), RING_CELLS)
    loop, truth = Loop(frame, cap, (-1, 1)), integrals(frame)
    moved = [power(kernel(frame, i), k) for i in range(frame.n)]
    Z, c, error, change = start(loop, 0), 0.0, 0.0, np.inf
    while change > tolerance:
        history = min(c, cap)
        Z = resampled(independent([Z, loop.fresh]), along_time(loop, loop.size, history))
        Z = resampled(mutated(Z, moved), across_space(loop, loop.size, 1 + history))
        before, error = error, float((variance(shaded(loop, Z)) / truth**2).mean())
        c, change = 3 * (1 + history), abs(error / (before or np.inf) - 1)
    return error


# ---------------------------------------------------------------- real passes


def chain_error(cap: float, k: int, frames: int, replicas: int, rng: np.random.Generator) -> Array:
    """relMSE of single frames with k mutations each, over the pixels and the second half of the frames; (replicas,)."""
    line, chance, step = walking(image_of_64(), SIGMA), Live(rng), repeated(k)
    here = Pixels(line, np.arange(line.n * replicas))
    total, truth = np.zeros(replicas), true_image(line)
    X = initial(here, chance)
    for t in range(frames):
        if t > 0:
            X = temporal(initial(here, chance), here, X, [Pixels(line, here.index)], chance, cap=cap)
        X = step(X, here, chance)
        X = spatial(X, here, three_of_radius_5(here, chance), chance)
        if t >= frames // 2:
            total += ((images(X, here) / truth - 1) ** 2).mean(axis=1)
    return total / (frames - frames // 2)


# ---------------------------------------------------------------- the figure


def chunks(preset: Any) -> Sequence[Any]:
    """Exact means per way to mutate; exact errors, and real passes, per cap and number of mutations."""
    ring, real = (
        [{"kind": kind, "cap": cap, "k": k} for k in preset["mutations"] for cap in preset[caps]]
        for kind, caps in (("ring", "ring_caps"), ("real", "caps"))
    )
    return [*({"kind": "mean", "mutation": name} for name in CHAINS), *ring, *real]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Exact biases of the image, exact errors of the ring, or errors of the real passes."""
    if chunk["kind"] == "mean":
        return {"bias": image_bias(CHAINS[chunk["mutation"]], preset["exact_frames"])}
    if chunk["kind"] == "ring":
        return {"error": np.array([ring_error(chunk["cap"], chunk["k"])])}
    return {"error": chain_error(chunk["cap"], chunk["k"], preset["frames"], preset["replicas"], rng)}


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Biases (mutation, own or reused, frame, pixel); errors of the ring (mutations, cap) and real (.., replica)."""
    means, kinds = results[: len(CHAINS)], len(preset["mutations"])
    ring = results[len(CHAINS) :][: kinds * len(preset["ring_caps"])]
    real = results[len(CHAINS) + len(ring) :]
    return {
        "bias": np.stack([each["bias"] for each in means]),
        "ring": np.concatenate([each["error"] for each in ring]).reshape(kinds, -1),
        "error": np.stack([each["error"] for each in real]).reshape(kinds, -1, preset["replicas"]),
        **{name: np.array(preset[name]) for name in ("mutations", "caps", "ring_caps")},
    }


def check(a: Arrays) -> list[Claim]:
    """w_bn = 1 biases the image but no own pixel; five mutations move the best cap up and lower the error."""
    image = dict(zip(CHAINS, abs(a["bias"][:, 1, -1].mean(axis=-1)), strict=True))
    ks = list(a["mutations"])
    none, five = (a["error"][ks.index(k)] for k in (0, 5))
    still, moved = (a["ring"][ks.index(k)] for k in (0, 5))
    at, ring_at = (list(a[caps]).index(50) for caps in ("caps", "ring_caps"))

    def larger(caps: Array, without: Array, mutated: Array) -> tuple[criteria.Outcome, str]:
        best, other = (int(caps[error.argmin()]) for error in (without, mutated))
        return criteria.above(other / best, 1), f"The best cap is {best} without mutations and {other} with 5."

    real, exact = larger(a["caps"], none.mean(axis=-1), five.mean(axis=-1)), larger(a["ring_caps"], still, moved)
    return [
        Claim("MCMC-P04", criteria.below(image["right"], 1e-10), "w_bn = 0: exact bias of the image, frame 20"),
        Claim("MCMC-P04", criteria.above(image["$w_{bn}$ = 1"], 0.01), "w_bn = 1: exact bias of the image, frame 20"),
        Claim("MCMC-P04", criteria.below(abs(a["bias"][-1, 0, 0]).max(), 1e-10), "w_bn = 1: own pixels before reuse"),
        Claim("MCMC-C09", real[0], "64 pixels: best M_c with 5 mutations / without", reason=real[1]),
        Claim("MCMC-C09", criteria.ratio_below(five[at], none[at], 0.6), "64 pixels, M_c = 50: 5 / 0 mutations"),
        Claim("MCMC-C09", exact[0], "ring of 8, exact: best M_c with 5 mutations / without", reason=exact[1]),
        Claim("MCMC-C09", criteria.below(moved[ring_at] / still[ring_at], 0.6), "ring of 8, M_c = 50: exact ratio"),
    ]


def draw(a: Arrays) -> "Picture":
    """Exact bias over frames; error over caps, exact and of the real passes."""
    picture, axes = style.panels(1, 3, width=3.7, height=3.2)
    many, ring, caps = axes[0]
    for name, bias in zip(CHAINS, a["bias"][:, 1].mean(axis=-1), strict=True):
        many.semilogy(range(1, bias.size + 1), np.maximum(abs(bias), 1e-16), **style.look(name))
    many.set(xlabel="frame $t$", ylabel="|relative bias| of the image", title="64 pixels, 5 mutations a frame: exact")
    many.set_xticks([1, 5, 10, 15, 20])
    many.legend(loc="center right")
    for n, (k, exact, error) in enumerate(zip(a["mutations"], a["ring"], a["error"], strict=True)):
        look = style.nth(3 * n + 2, label=f"{k} mutations per frame", markevery=1)
        spread = 2 * error.std(axis=-1, ddof=1) / np.sqrt(error.shape[-1])
        ring.plot(a["ring_caps"], exact, **look)
        caps.errorbar(a["caps"], error.mean(axis=-1), spread, **look)
    for axis, title in ((ring, "Ring of 8 pixels: exact"), (caps, "64 pixels: the real passes")):
        axis.set(xlabel="cap $M_c$ (samples)", ylabel="relMSE of a frame", title=title)
        axis.set(xscale="log", yscale="log")
        axis.legend(loc="upper left")
    caps.set(ylabel="relMSE of a frame, ± 2 standard errors", ylim=(0.05, 5))
    return picture


CAPS = {"caps": [5, 10, 20, 50, 100, 200], "mutations": [0, 5], "exact_frames": 20}

FIGURE = Figure(
    id="MCMC-C09",
    title="Mutations make a larger cap usable",
    world="toy1d",
    source="[MCMC 3.2.4, 4.2]",
    claims=("MCMC-C09", "MCMC-P04"),
    presets={
        "quick": {**CAPS, "ring_caps": [1, 2, 5, 10, 20, 50], "frames": 400, "replicas": 32},
        "paper": {**CAPS, "ring_caps": [1, 2, 5, 10, 20, 50, 100, 200], "frames": 3000, "replicas": 64},
    },
    arm="k",
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)

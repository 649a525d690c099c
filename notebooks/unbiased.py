"""Behind `02_is_my_estimator_unbiased`: the same question put to samples, to an enumeration and to exact moments."""

from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import block_diag

from figures.report import style
from notebooks.show import Table
from restir_ref import WEIGHTS, Chance, Live, Pixels, Reservoirs, Weights, initial, shade
from restir_ref.batch import Array
from restir_ref.oracle.cells import Frame, cells
from restir_ref.oracle.enumeration import outcomes
from restir_ref.oracle.laws import expected_sum
from restir_ref.oracle.moments import Moments, Source, drawn, mapped, operator, resampled, variance
from restir_ref.oracle.scenes import Loop, Scene, normalised, random_scene, reference_scene, spatial_loop
from restir_ref.oracle.zoo import BUGS, INEFFICIENT, exact_bias

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

SEED = 1
ROUNDING = 1e-9
"""Whatever differs by more than this is a bias."""

# ---------------------------------------------------------------- all outcomes


def one_pixel() -> Frame:
    """A pixel with three cells: volumes (1, .5, 2), f = (2, 0, 1), sampled with probabilities (.5, .25, .25)."""
    v = np.array([[1.0, 0.5, 2.0]])
    return Frame(cells(v, np.array([[2.0, 0.0, 1.0]]), normalised([[0.5, 0.5, 0.125]], v), np.array([[[0, 1, 2]]])), 1)


def leaves(M: int) -> Table:
    """Every outcome (Y, W_Y) of RIS over M candidates of `one_pixel`, its probability, and what it estimates."""
    frame = one_pixel()

    def program(index: Array, chance: Chance) -> Reservoirs:
        return initial(Pixels(frame, index), chance, M)

    found: dict[tuple[int, float], float] = {}
    for outcome in outcomes(program, 1):
        for x, W, p in zip(outcome.result.x, outcome.result.W, outcome.probability, strict=True):
            key = (int(x) + 1, round(float(W), 12))
            found[key] = found.get(key, 0.0) + float(p)
    f = frame.cells.f[0]
    rows = [(f"{p:.4f}", x, f"{W:.4f}", f"{f[x - 1] * W:.4f}") for (x, W), p in sorted(found.items())]
    mean = sum(p * f[x - 1] * W for (x, W), p in found.items())
    return Table(["probability", "cell Y", "W_Y", "f(Y) W_Y"], [*rows, ("mean", "", "", f"{mean:.12f}")])


# ---------------------------------------------------------------- samples against the truth


@cache
def sampled(name: str, count: int = 100_000) -> Array:
    """Estimates f(Y) W_Y over their truth of a wrong loop, (count, n)."""
    bug = BUGS[name]
    scene = bug.scene()
    X = bug.wrong(scene)(np.arange(scene.now.n * count), Live(np.random.default_rng(SEED)))
    estimates: Array = shade(X, Pixels(scene.now, np.arange(len(X.W))))[0].reshape(count, -1)
    return estimates / integrals(scene)


def integrals(scene: Scene) -> Array:
    """The pixels' integrals over the support, (n,)."""
    return np.asarray((scene.p_hat * scene.v).sum(axis=-1))


@cache
def biases(name: str) -> Array:
    """Exact relative bias per cell of a wrong loop, (n, K)."""
    bug = BUGS[name]
    return exact_bias(bug.wrong(bug.scene()), bug.scene())


def bias_of_image(name: str) -> Array:
    """Exact relative bias of the estimates with f = p_hat, (n,)."""
    scene = BUGS[name].scene()
    return np.asarray((biases(name) * scene.p_hat * scene.v).sum(axis=-1) / integrals(scene))


def by_sampling(estimator: str) -> "Picture":
    """The mean of the first pixel over the number of samples, with two standard errors, and the exact answer."""
    e = sampled(estimator)[:, 0]
    counts = np.unique(np.geomspace(10, len(e), 17).astype(int))
    mean = np.array([e[:k].mean() for k in counts])
    error = np.array([e[:k].std(ddof=1) / np.sqrt(k) for k in counts])
    picture, axes = style.panels(width=7.4, height=2.9)
    ax, bias = axes[0, 0], bias_of_image(estimator)[0]
    ax.errorbar(counts, mean - 1, 2 * error, ls="", marker="o", markevery=1, label="mean, 2 standard errors")
    ax.axhline(0, color="k", lw=1.2)
    ax.axhline(bias, color=style.COLOURS[3], ls="--", lw=1.5, label="exact bias")
    limit = max(0.05, 1.4 * abs(bias))
    ax.set(xscale="log", xlabel="samples", ylabel="relative error of the mean", ylim=(-limit, limit))
    ax.set_title(f"{estimator}: {bias:+.2%} in pixel 1")
    ax.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return picture


# ---------------------------------------------------------------- the law per cell


def per_cell(estimator: str) -> "Picture":
    """E[W 1{Y=y}] / v(y) - 1 in every cell of every pixel, for a wrong loop."""
    bias = biases(estimator)
    picture, (panels,) = style.panels(1, len(bias), width=6.4 / len(bias), height=2.7)
    for pixel, (ax, values) in enumerate(zip(panels, bias, strict=True), start=1):
        ax.bar(np.arange(1, len(values) + 1), values, color=style.COLOURS[0])
        ax.axhline(0, color="k", lw=0.8)
        ax.set(xlabel="cell $y$", xticks=np.arange(1, len(values) + 1), ylim=_frame(bias), title=f"Pixel {pixel}")
    panels[0].set_ylabel("relative bias")
    picture.suptitle(estimator, fontsize=10)
    return picture


def _frame(bias: Array) -> tuple[float, float]:
    largest = max(0.1, 1.1 * float(abs(bias).max()))
    return -largest, largest


def blind() -> "Picture":
    """All bugs of the zoo: what an image of f = p_hat shows of them, and what the law per cell shows."""
    image = np.array([abs(bias_of_image(name)).max() for name in BUGS])
    cell = np.array([abs(biases(name)).max() for name in BUGS])
    picture, axes = style.panels(width=5.2, height=3.6)
    ax, unseen = axes[0, 0], image < 0.005
    for group, marker, label in ((~unseen, "o", "both see it"), (unseen, "D", "an image shows less than 0.5 %")):
        ax.loglog(cell[group], np.maximum(image[group], 1e-4), ls="", marker=marker, markevery=1, label=label)
    ax.axhline(1e-4, color="k", lw=0.8, ls=":")
    ax.set(xlabel="largest bias of a cell", ylabel="largest bias of a pixel's mean", title="Every bug of the zoo")
    ax.text(0.02, 1.15e-4, "0 or less than 0.01 %", fontsize=8)
    ax.set_xlim(0.015, 10)
    ax.legend(loc="upper left")
    return picture


def hidden_from_images(limit: float = 0.005) -> Table:
    """The bugs whose mean image is right to `limit`, with the worst of their cells."""
    names = [name for name in BUGS if abs(bias_of_image(name)).max() < limit]
    rows = [(name, f"{abs(bias_of_image(name)).max():.3%}", f"{abs(biases(name)).max():.1%}") for name in names]
    return Table(["bug", "worst pixel of the image", "worst cell"], rows)


# ---------------------------------------------------------------- your own weights


def judge(mis: Weights, scenes: int = 20) -> str:
    """Whether two rounds of spatial reuse with these weights are unbiased in every cell of random scenes."""
    rng = np.random.default_rng(SEED)
    tried = [reference_scene(), *(random_scene(reference_scene(), rng=rng) for _ in range(scenes))]
    found = [exact_bias(spatial_loop(scene, mis, passes=2), scene) for scene in tried]
    worst = max(float(abs(bias).max()) for bias in found)
    wrong = sum(bool(abs(bias).max() > ROUNDING) for bias in found)
    if not wrong:
        return f"Unbiased in every cell of {len(tried)} scenes; the largest deviation is {worst:.0e}."
    return f"Biased in {wrong} of {len(tried)} scenes; the worst cell is off by {worst:.1%}."


# ---------------------------------------------------------------- variances without noise


def moments(mis: str, rounds: int) -> Moments:
    """Exact moments of both pixels' estimates f(Y) W_Y after `rounds` rounds of spatial reuse."""
    scene = reference_scene()
    frame, (n, K) = scene.now, scene.v.shape
    lit = np.diag(scene.support.ravel() * 1.0)  # what falls where p_hat = 0 becomes a null sample, W = 0
    Z = mapped(drawn(frame), lit)
    for c in 2.0 ** np.arange(rounds):
        pairs = [[Source(j * K, frame, j, c) for j in (i, 1 - i)] for i in range(n)]
        Z = mapped(resampled(Z, [operator(pair, n * K, WEIGHTS[mis]) for pair in pairs]), lit)
    return mapped(Z, block_diag(*scene.p_hat))


def squares(loop: Loop, scene: Scene, index: Array, chance: Chance) -> Array:
    """f(Y) W_Y and its square, (2, N)."""
    estimate = shade(loop(index, chance), Pixels(scene.now, index))[0]
    return np.stack([estimate, estimate**2])


def enumerated(mis: str, rounds: int) -> Array:
    """Var[f(Y) W_Y] of both pixels from all outcomes, (2,)."""
    scene = reference_scene()
    loop = spatial_loop(scene, WEIGHTS[mis], rounds)
    mean, square = expected_sum(lambda index, chance: squares(loop, scene, index, chance), scene.now.n)
    return np.asarray(square - mean**2)


def three_ways(mis: str) -> "Picture":
    """The variance of the first pixel over rounds of reuse: moments, enumeration, and samples."""
    scene, rounds = reference_scene(), list(range(8))
    picture, axes = style.panels(width=5.2, height=2.9)
    ax = axes[0, 0]
    ax.plot(rounds, [variance(moments(mis, k))[0] for k in rounds], marker="", label="moments, exact")
    ax.plot(rounds[:4], [enumerated(mis, k)[0] for k in rounds[:4]], "kx", ms=9, markevery=1, label="all outcomes")
    count = 20_000
    for k in rounds[::2]:
        loop = spatial_loop(scene, WEIGHTS[mis], k)
        found = squares(loop, scene, np.arange(2 * count), Live(np.random.default_rng(SEED)))[0, ::2]
        error = ((found - found.mean()) ** 2).std() / np.sqrt(count)
        look = {
            "marker": "o",
            "markevery": 1,
            "color": style.COLOURS[3],
            "label": "20 000 samples, 2 errors" if k == 0 else None,
        }
        ax.errorbar(k, found.var(), 2 * error, ls="", capsize=3, **look)
    ax.set(
        xlabel="rounds of spatial reuse",
        ylabel="variance of $f(Y) W_Y$",
        title=f"{mis} weights, pixel 1",
        ylim=(0, None),
    )
    ax.legend(loc="lower left")
    return picture


def wasteful() -> Table:
    """Mistakes that no mean can show: their largest bias, which is rounding."""
    rows = [(b.name, f"{abs(exact_bias(b.wrong(b.scene()), b.scene())).max():.0e}") for b in INEFFICIENT.values()]
    return Table(["mistake", "largest bias of a cell"], rows)

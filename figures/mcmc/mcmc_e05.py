"""MCMC 3.2.3: are mutations of random numbers accepted more often than those of directions, as C = p_hat / q is flat?

Base paths are reservoirs of flatland: one leaf out of 32 trees per pixel.  The direction that leaves x_1 moves, by
a Gaussian step of its random number or by one of its angle; lobes and all later random numbers stay, so the target is
C over random numbers and C q over angles, q being the density of that direction.  A step of the number that leaves
[0, 1) is no path, and so is a direction below the horizon.

Steps are matched in two ways: so that the moved directions differ by the same root mean square, or the same median,
from those of the base paths.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.report import style
from flatland2d import SCENES
from restir_ref.batch import Array, ratio, take
from restir_ref.chance import Chance, Live
from restir_ref.decorrelation import bounded, gaussian
from restir_ref.integrals import Pixels
from restir_ref.loop import OFFLINE
from restir_ref.restir import initial
from restir_ref.transport import materials as mat
from restir_ref.transport.materials import Vertex
from restir_ref.transport.paths import RECONNECTION, Tracer, first_hit, leaves, scatter, trace
from restir_ref.transport.restir_pt import PathIntegrals

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

NAMES = ("cornell", "glossy_cornell", "ajar", "distant_caustic")
SIGMAS = (0.003, 0.01, 0.03, 0.1)
"""Standard deviations of steps of the random number."""

JUDGED = (0.01, 0.03)
"""Small ones: in these scenes a path then turns by a degree or two up to five."""

GROUPS = 16
HALF = 0.6745
"""The median of |n| for a standard normal n."""

HOW = ("numbers", "angles, same rms", "angles, same median")


@dataclass(frozen=True)
class Base:
    """Base paths: pixel, replica, weight W, primary sample u (D, N), leaf (k, nee), contribution C (N,).

    x_1, and of the direction that leaves it lobe, angle to the normal and density q (N,).
    """

    pixel: Array
    replica: Array
    W: Array
    u: Array
    k: Array
    nee: Array
    C: Array
    v: Vertex
    lobe: Array
    angle: Array
    q: Array


@dataclass(frozen=True)
class Moved:
    """Mutated paths: primary sample u (D, N), whether there is a direction that leaves x_1, its angle, C and q (N,)."""

    u: Array
    exists: Array
    angle: Array
    C: Array
    q: Array


def base_paths(t: Tracer, replicas: int, chance: Chance) -> Base:
    """Reservoirs whose path leaves x_1 by a BSDF sample."""
    n = t.sensor.n
    X = initial(Pixels(PathIntegrals(t), np.arange(replicas * n)), chance, OFFLINE.trees)
    kept = np.flatnonzero((X.W > 0) & (X.x.k > X.x.nee))
    x = take(X.x, kept)
    v, _, _ = first_hit(t, x.u, kept % n)
    at = scatter(t, v, x.u, 1)
    angle = angle_of(t.scene.space.to_local(v.n, at.w))
    return Base(kept % n, kept // n, X.W[kept], x.u, x.k, x.nee, x.F.mean(axis=0), v, at.lobe, angle, at.p)


def angle_of(i: Array) -> Array:
    """Angle of a local direction (2, N) to the normal."""
    return np.asarray(np.arctan2(i[0], i[1]))


def moved(t: Tracer, x: Base, number: Array, allowed: Array) -> Moved:
    """The paths with another number (1, N) for the direction that leaves x_1, where that is allowed (N,)."""
    u = np.array(x.u)
    t.direction_numbers(u, 1)[:] = number
    tree = trace(t, u, x.pixel)
    C = sum(F.mean(axis=0) * ((x.k == k) & (x.nee == nee)) for k, nee, F in leaves(tree))
    at, exists = tree.at[0], (allowed > 0) & tree.at[0].weight.any(axis=0)
    return Moved(u, exists, angle_of(t.scene.space.to_local(x.v.n, at.w)), np.asarray(C * exists), at.p)


def by_numbers(t: Tracer, x: Base, sigma: float, chance: Chance) -> tuple[Moved, Array]:
    """Step of the number, and by how much the directions turn, where there are any."""
    number, allowed = bounded(t.direction_numbers(x.u, 1), sigma, chance)
    y = moved(t, x, number, allowed)
    return y, np.abs(y.angle - x.angle)[y.exists]


def by_angles(t: Tracer, x: Base, sigma: float, chance: Chance) -> Moved:
    """Step of the angle: the number is the one that draws it."""
    angle = gaussian(x.angle, sigma, chance)
    up = np.cos(angle) > 0
    angle = np.where(up, angle, x.angle)
    i = np.stack([np.sin(angle), np.cos(angle)])
    number = mat.invert_lobe(t.scene.materials, t.scene.space, x.v, x.lobe, i)
    return moved(t, x, np.clip(number, 0, 1 - 2.0**-53), up)


def over_numbers(x: Base, y: Moved) -> Array:
    """a = min(1, C(u') / C(u)), (N,)."""
    return np.asarray(np.minimum(y.C / x.C, 1))


def over_angles(x: Base, y: Moved) -> Array:
    """a = min(1, p_hat(w') / p_hat(w)), p_hat = C q, (N,)."""
    return np.asarray(np.minimum(y.C * y.q / (x.C * x.q), 1))


def chunks(preset: Any) -> Sequence[dict[str, str]]:
    """One per scene."""
    return [{"scene": name} for name in NAMES]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Acceptance rates (sigma, how, group), and rms and median turn of the steps of numbers (sigma, 2), in radians."""
    setting, chance = SCENES[chunk["scene"]](), Live(rng)
    t = Tracer(setting.scene, setting.pinhole(), setting.depth, RECONNECTION)
    x = base_paths(t, preset["replicas"], chance)
    group = x.replica * GROUPS // preset["replicas"]
    rates, turns = [], []
    for sigma in SIGMAS:
        y, turn = by_numbers(t, x, sigma, chance)
        matched = np.sqrt((turn**2).mean()), np.median(turn) / HALF
        accepted = [over_numbers(x, y), *(over_angles(x, by_angles(t, x, s, chance)) for s in matched)]
        rates.append([ratio(np.bincount(group, a, GROUPS), np.bincount(group, minlength=GROUPS)) for a in accepted])
        turns.append([matched[0], np.median(turn)])
    return {"rates": np.array(rates), "turns": np.array(turns)}


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Stacked over scenes."""
    return {name: np.stack([part[name] for part in results]) for name in results[0]}


def more_often(a: Arrays, sigma: float, how: str) -> Mapping[str, criteria.Outcome]:
    """Acceptance rate of numbers over that of angles, above 1 or not, by scene."""
    rates = a["rates"][:, SIGMAS.index(sigma)]
    pairs = {name: (rates[k, 0], rates[k, HOW.index(how)]) for k, name in enumerate(NAMES)}
    return {name: criteria.ratio_above(*pair, 1) for name, pair in pairs.items()}


def check(a: Arrays) -> list[Claim]:
    """In how many scenes numbers are accepted more often, at steps of equal rms; equal medians make the caveat."""
    return [of_step(a, sigma) for sigma in JUDGED]


def of_step(a: Arrays, sigma: float) -> Claim:
    """The claim for one step: passed by equal rms, with a caveat if not by equal medians, whose ratios stand beside."""
    by_rms, by_median = (more_often(a, sigma, how) for how in HOW[1:])
    rms, median = (sum(bool(each.passed) for each in found.values()) for found in (by_rms, by_median))
    found = criteria.between(rms, 3, len(NAMES))
    text = f"{rms} of {len(NAMES)} at equal rms: {in_words(by_rms)}; {median} at equal median: {in_words(by_median)}"
    return Claim(
        "MCMC-E05",
        replace(found, measured=text),
        f"scenes with a ratio above 1, steps of {sigma:g}",
        caveat="" if median >= 3 else CAVEAT,
        reason=REASON,
    )


def in_words(found: Mapping[str, criteria.Outcome]) -> str:
    """All ratios."""
    return ", ".join(f"{name} {each.measured}" for name, each in found.items())


CAVEAT = (
    "Steps are matched in the root mean square of the angle, which few large turns dominate; matched in the median, "
    "fewer than three scenes have a ratio above 1"
)
REASON = (
    "Random numbers turn grazing directions more and those at peaks of a lobe less, which is just where p_hat falls "
    "steeply; on a matte surface q is but a cosine, and what rejects mutations are shadows, which no measure removes."
)


LIMITS = (0.04, 15)


def draw(a: Arrays) -> "Picture":
    """Acceptance rates over the typical turn, and their ratios with 95% intervals."""
    picture, axes = style.panels(2, len(NAMES), width=3.0, height=2.5)
    for k, name in enumerate(NAMES):
        turn = np.degrees(a["turns"][k, :, 1])
        for number, (how, rates) in enumerate(zip(HOW, a["rates"][k].mean(axis=-1).T, strict=True)):
            axes[0, k].semilogx(turn, rates, **style.nth(number, label=how), markevery=1)
        axes[0, k].set(title=name.replace("_", " "), ylim=(0, 1.02), xlim=LIMITS)
        for number, how in enumerate(HOW[1:], start=1):
            found = [criteria.ratio_interval(rates[0], rates[number])[:2] for rates in a["rates"][k]]
            middle = a["rates"][k, :, 0].mean(axis=-1) / a["rates"][k, :, number].mean(axis=-1)
            low, high = np.array(found).T
            look = style.nth(number, label=how, markevery=1)
            axes[1, k].errorbar(turn, middle, [middle - low, high - middle], **look)
        axes[1, k].axhline(1, color=style.INK, lw=1, ls=":", marker="", label="alike")
        axes[1, k].set(xscale="log", xlim=LIMITS, xlabel="median turn by numbers (degrees)")
    axes[0, 0].set_ylabel("acceptance rate")
    axes[1, 0].set_ylabel("acceptance, numbers / angles")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    guide = axes[1, 0].get_legend_handles_labels()
    handles, labels = [*handles, guide[0][guide[1].index("alike")]], [*labels, "alike"]
    picture.legend(handles, labels, title="Gaussian steps of", loc="outside lower center", ncols=4)
    return picture


FIGURE = Figure(
    id="MCMC-E05",
    title="Mutations of random numbers and of directions",
    world="flatland2d",
    source="[MCMC 3.2.3]",
    claims=("MCMC-E05",),
    conditions=(
        Conditions(
            ("MCMC-E05",),
            "3.2.3",
            Setup("candidates only", "still", "all", "a remark on any mutation: no view"),
            Setup("candidates only", "still", "all", "the standard insets of four scenes"),
        ),
    ),
    presets={"quick": {"replicas": 192}, "paper": {"replicas": 1536}},
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)

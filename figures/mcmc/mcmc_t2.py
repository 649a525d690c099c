"""MCMC Tables 1 and 2: what mutations do to the covariance of neighbouring pixels, and to the error.

Chains of 50 frames with M_c = 50, of which the last frame counts.  A mutation keeps p_hat W: it exchanges the path that
neighbours share for one like it, so that covariance falls where other pixels weigh the two differently, and hardly
where all agree, as on the inset behind the slit.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Conditions, Figure, Setup
from figures.experiments.mutated import ARMS, ENOUGH, FRAMES, RADIUS, VIEWS, accepted, chain, covariances, errors, shown
from figures.report import style
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.transport.mutations import TwoRays

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Picture

NONE, FIVE, BLUE, AFTER = "k = 0", "k = 5", "k = 5, blue", "k = 5, after spatial reuse"
GLOSSY, FILM, SLIT, POSTS, CLOSED = VIEWS
JUDGED = (GLOSSY, FILM, SLIT, POSTS)
"""Views of every way to mutate.  Both tables are of one scene, whose door is more closed: `CLOSED`."""

KS = ("k = 0", "k = 1", "k = 5", "k = 20")


def chunks(preset: Any) -> Sequence[dict[str, Any]]:
    """Every view with every way to mutate, in parts of the images."""
    return [
        {"view": view, "arm": arm, "part": part}
        for view, arms in preset["arms"].items()
        for arm in arms
        for part in range(arms[arm])
    ]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Images (replicas, 128), and the acceptance of another proposal."""
    chance = Live(rng)
    X, here = chain(
        TwoRays(VIEWS[chunk["view"]].tracer), ARMS[chunk["arm"]], preset["frames"], preset["replicas"], chance
    )
    return {"images": shown(X, here), "accepted": np.array(accepted(X, here, chance))}


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Of every view and arm: covariance, RMSE and mean of each image, (K,), and the acceptance."""
    found: Arrays = {}
    rows = chunks(preset)
    for view, arms in preset["arms"].items():
        truth = VIEWS[view].truth
        found[f"{view}.truth"] = truth
        for arm in arms:
            parts = [each for row, each in zip(rows, results, strict=True) if (row["view"], row["arm"]) == (view, arm)]
            images = np.concatenate([part["images"] for part in parts])
            name = f"{view}.{arm}"
            found[f"{name}.covariance"] = covariances(images) / truth.mean() ** 2
            found[f"{name}.error"] = errors(images, truth) / truth.mean()
            found[f"{name}.accepted"] = np.array([part["accepted"] for part in parts]).mean(keepdims=True)
    return found


# ---------------------------------------------------------------- judging


def pair(a: Arrays, view: str, arms: tuple[str, str], what: str) -> tuple[Array, Array] | None:
    """The two arms' numbers of as many images; None unless there are enough of both."""
    names = [f"{view}.{arm}.{what}" for arm in arms]
    if not all(name in a for name in names):
        return None
    K = min(len(a[name]) for name in names)
    return None if K < ENOUGH else (a[names[0]][:K], a[names[1]][:K])


def compared(id_: str, found: tuple[Array, Array] | None, limit: float, part: str, reason: str = "") -> Claim:
    """The first arm below `limit` times the second; the opposite is that it is above the second."""
    if found is None:
        return Claim(id_, None, part, reason=QUICK)
    return Claim(id_, criteria.ratio_below(*found, limit), part, criteria.ratio_above(*found, 1), reason=reason)


QUICK = "Few images of short chains, or none: judged by the paper preset."


def check(a: Arrays) -> list[Claim]:
    """Ratios with their intervals, view by view."""
    claims = [fallen(a, view) for view in VIEWS]
    claims += [compared("MCMC-T1", pair(a, CLOSED, (FIVE, NONE), "error"), 1.03, f"{CLOSED}: RMSE 5 / 0")]
    claims += [driven(a, view, k) for view in JUDGED for k in KS[1:]]
    claims += [like_plain(a, view) for view in JUDGED]
    claims += [either_way(a, view) for view in (FILM, SLIT)]
    return [*claims, *(less_behind_the_slit(a, view) for view in (FILM, SLIT))]


def either_way(a: Arrays, view: str) -> Claim:
    """Mutations between the passes decorrelate better than after both."""
    found = pair(a, view, (FIVE, AFTER), "covariance")
    reason = "" if found is None else f"{power(*found)}  {EITHER_WAY}"
    return compared("MCMC-C03", found, 0.95, f"{view}: covariance between / after", reason)


def fallen(a: Arrays, view: str) -> Claim:
    """Five mutations lower the covariance."""
    found = pair(a, view, (FIVE, NONE), "covariance")
    claim = compared("MCMC-T2", found, 0.9, f"{view}: covariance 5 / 0")
    if found is None or claim.outcome is None or claim.outcome.passed:
        return claim
    return replace(claim, reason=power(*found))


def power(one: Array, other: Array) -> str:
    """What so many images can tell."""
    low, high, _ = criteria.ratio_interval(one, other)
    left = (high - low) / 2
    return f"{len(one)} images leave {left:.2f} of the ratio open: a few rare paths carry most of a covariance."


def driven(a: Arrays, view: str, k: str) -> Claim:
    """Neither the error nor the covariance rises with k mutations."""
    part = f"{view}: {k} / 0, RMSE and covariance"
    error, covariance = (pair(a, view, (k, NONE), what) for what in ("error", "covariance"))
    if error is None or covariance is None:
        return Claim("MCMC-C01", None, part, reason=QUICK)
    outcome = criteria.all_of(*(criteria.ratio_below(*each, 1.03) for each in (error, covariance)))
    falls = FALLS if criteria.ratio_below(*error, 1).passed else ""
    counter, reason = criteria.ratio_above(*error, 1.03), "" if outcome.passed else NO_RISE
    return Claim("MCMC-C01", outcome, part, counter, caveat=falls, reason=reason)


def like_plain(a: Arrays, view: str) -> Claim:
    """How blue and plain mutations differ, as a ratio."""
    part, found = f"{view}: covariance, blue / plain", pair(a, view, (BLUE, FIVE), "covariance")
    if found is None:
        return Claim("MCMC-T2b", None, part, reason=QUICK)
    return Claim("MCMC-T2b", criteria.reported(criteria.ratio_interval(*found)[2]), part)


def less_behind_the_slit(a: Arrays, view: str) -> Claim:
    """Covariance falls less, and fewer proposals are accepted, than in the glossy box."""
    part = f"{view} against {GLOSSY}: remaining covariance, and acceptance"
    slit, box = (pair(a, each, (FIVE, NONE), "covariance") for each in (view, GLOSSY))
    if slit is None or box is None:
        return Claim("MCMC-C04", None, part, reason=QUICK)
    left, less = (criteria.ratio_interval(*each) for each in (slit, box))
    rates = [float(a[f"{each}.{NONE}.accepted"][0]) for each in (view, GLOSSY)]
    text = f"{left[2]} against {less[2]}; acceptance {rates[0]:.3f} against {rates[1]:.3f}"
    rule = "intervals apart, the slit's above; acceptance lower"
    passed = left[0] > less[1] and rates[0] < rates[1]
    counter = criteria.Outcome(text, "one of both the other way round", left[1] < less[0] or rates[0] > rates[1])
    return Claim("MCMC-C04", criteria.Outcome(text, rule, passed), part, counter, reason="" if passed else OVERLAP)


OVERLAP = "Fewer proposals are accepted behind the slit, and the covariance falls less, but the intervals overlap."


FALLS = "the error does not stay, as the sentence has it: it falls, because reuse alone keeps few distinct samples"
NO_RISE = "No certain increase, but so many images cannot exclude one of 3%."
EITHER_WAY = (
    "Our explanation: what is mutated after spatial reuse is what the next frame reuses in time, so that samples "
    "differ before the next spatial reuse either way."
)


def draw(a: Arrays) -> "Picture":
    """Covariance and RMSE over k relative to k = 0, and covariances of other ways to mutate."""
    picture, axes = style.panels(1, 3, width=3.9, height=4.0)
    for axis, what, title in (
        (axes[0, 0], "covariance", f"Covariance, radius {RADIUS}"),
        (axes[0, 1], "error", "RMSE"),
    ):
        for n, view in enumerate(VIEWS):
            over_k(axis, a, view, what, n)
        axis.axhline(1, color=style.INK, lw=1, ls=":", marker="", label="as without")
        axis.set(xlabel="mutations $k$ per frame", ylabel="relative to $k$ = 0 (bars: 95%)", title=title)
        axis.set_xscale("symlog", linthresh=1)
        axis.set_xticks([0, 1, 5, 20], ["0", "1", "5", "20"])
        axis.set_xlim(-0.2, 30)
        axis.minorticks_off()
    style.below(axes[0, 0], ncols=2)
    ways(axes[0, 2], a)
    return picture


def over_k(axis: "Axes", a: Arrays, view: str, what: str, n: int) -> None:
    """One view's ratios to k = 0 with their intervals."""
    arms = [k for k in KS if f"{view}.{k}.{what}" in a]
    if not arms:
        return
    middle, low, high = [1.0], [1.0], [1.0]
    for k in arms[1:]:
        each, none = of_both(a, view, k, what)
        ends = criteria.ratio_interval(each, none)
        middle, low, high = [*middle, each.mean() / none.mean()], [*low, ends[0]], [*high, ends[1]]
    bars = [np.subtract(middle, low), np.subtract(high, middle)]
    axis.errorbar(
        [int(k[4:]) * (1 + 0.06 * n) for k in arms], middle, bars, **style.nth(n, label=view, markevery=1), capsize=2
    )


def of_both(a: Arrays, view: str, arm: str, what: str) -> tuple[Array, Array]:
    """As many images of an arm and without mutations."""
    one, none = a[f"{view}.{arm}.{what}"], a[f"{view}.{NONE}.{what}"]
    K = min(len(one), len(none))
    return one[:K], none[:K]


def ways(axis: "Axes", a: Arrays) -> None:
    """Covariance of every way to mutate, relative to none, as bars."""
    views = [view for view in JUDGED if f"{view}.{FIVE}.covariance" in a]
    names = {FIVE: "between the passes", BLUE: "the same, blue", AFTER: "after spatial reuse"}
    for n, (arm, name) in enumerate(names.items()):
        shown_ = [view for view in views if f"{view}.{arm}.covariance" in a]
        if not shown_:
            continue
        found = [of_both(a, view, arm, "covariance") for view in shown_]
        middle = np.array([one.mean() / none.mean() for one, none in found])
        low, high = np.array([criteria.ratio_interval(*each)[:2] for each in found]).T
        place = [views.index(view) + 0.27 * (n - 1) for view in shown_]
        look: dict[str, Any] = {"color": style.COLOURS[n + 4], "hatch": style.HATCHES[n], "edgecolor": style.PAPER}
        axis.bar(place, middle, 0.25, yerr=[middle - low, high - middle], error_kw={"lw": 0.8}, label=name, **look)
    axis.axhline(1, color=style.INK, lw=1, ls=":", marker="", label="as without")
    axis.set_xticks(range(len(views)), [view.replace(", ", ",\n").replace("whole film", "film") for view in views])
    axis.grid(visible=False, axis="x")
    axis.set(yscale="log", ylabel="relative to $k$ = 0 (bars: 95%)", title="Covariance, five mutations in three ways")
    style.below(axis, ncols=1)


FEW = {NONE: 2, "k = 1": 2, FIVE: 2, "k = 20": 1, BLUE: 1, AFTER: 1}
MANY = {NONE: 4, "k = 1": 4, FIVE: 4, "k = 20": 2, BLUE: 2, AFTER: 4}
"""Parts of the images by arm: behind the slit a few rare paths carry most of a covariance."""

FIGURE = Figure(
    id="MCMC-T2",
    title="Covariance and error with mutations between the passes",
    world="flatland2d",
    source="[MCMC Tab. 1, Tab. 2; 3.2.2, 3.2.4, 6.1-6.3]",
    claims=("MCMC-T1", "MCMC-T2", "MCMC-T2b", "MCMC-C01", "MCMC-C03", "MCMC-C04"),
    conditions=(
        Conditions(
            ("MCMC-T1", "MCMC-T2", "MCMC-T2b", "MCMC-C01", "MCMC-C03", "MCMC-C04"),
            "[MCMC 6; Tab. 1, Tab. 2]",
            Setup("real time", "still", "all", "the ceiling of a room lit through a door, 50 frames, M_c = 50"),
            Setup("real time", "still", "all", "insets and films of three scenes, 50 frames, M_c = 50"),
        ),
    ),
    arm="arm",
    presets={
        "quick": {
            "arms": {view: {NONE: 1, FIVE: 1} for view in (GLOSSY, FILM)},
            "frames": 8,
            "replicas": 32,
        },
        "paper": {
            "arms": {GLOSSY: FEW, FILM: MANY, SLIT: MANY, POSTS: MANY, CLOSED: {NONE: 4, FIVE: 4}},
            "frames": FRAMES,
            "replicas": 100,
        },
    },
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)

"""GRIS Fig. 9: the M-cap.  Moderate caps keep the error of frames low; averages of frames prefer no history at all.

(a) Error of single frames over time, per cap, with temporal and spatial reuse; (b) error of the mean of all frames
so far.  Why (a) needs spatial reuse: with temporal reuse alone a frame is an exponential average, and a larger cap
is always better.  The 64-pixel image runs the real code; a ring of 8 pixels is exact (moments on cells).
"""

from collections.abc import Callable, Sequence
from itertools import islice
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Figure
from figures.experiments.chains import chain, images, nobody, three_of_radius_5
from figures.experiments.exact import Loop, accumulated, integrals, second_moment, shaded, start, step, true_image
from figures.report import style
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.integrals import Pixels
from restir_ref.metrics import rel_mse
from restir_ref.oracle.cells import Frame
from restir_ref.oracle.moments import variance
from toy1d import image_of_64, quotient, ring_of_8, two_pixels

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

CAPS = (0, 1, 5, 20, 50, 200, 1000, np.inf)
AVERAGED = (0, 1, 20)
ALONE = (1, 5, 20, 50, 200)


def chunks(preset: Any) -> Sequence[Any]:
    """One chunk per kind and cap, named by its place in the lists above: infinity is no plain data."""
    return [{"kind": kind, "cap": k} for kind, (_, caps) in KINDS.items() for k in range(len(caps))]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """One array, the errors over frames; see the functions."""
    make, caps = KINDS[chunk["kind"]]
    return {"found": make(caps[chunk["cap"]], *preset[chunk["kind"]], Live(rng))}


def recorded(frames: int) -> Array:
    """Frames to look at: 20 per decade and the last one."""
    wanted = np.append(10 ** np.arange(0, np.log10(frames), 0.05), frames)
    return np.unique(wanted.round().astype(int))


# ---------------------------------------------------------------- the image: real code


def errors_of_frames(cap: float, frames: int, replicas: int, chance: Live) -> Array:
    """relMSE of every frame of every replica, (frames, replicas)."""
    here, truth = Pixels(image_of_64(), np.arange(64 * replicas)), true_image(image_of_64())
    frame = islice(chain(here, cap, three_of_radius_5, chance), frames)
    return np.stack([rel_mse(images(Y, here), truth) for Y in frame])


def errors_of_means(cap: float, frames: int, replicas: int, chance: Live) -> Array:
    """relMSE of the mean of the first t frames, for recorded t, (t, replicas)."""
    here, truth, found = Pixels(image_of_64(), np.arange(64 * replicas)), true_image(image_of_64()), []
    total, wanted = np.zeros((replicas, 64)), recorded(frames)
    for t, Y in enumerate(islice(chain(here, cap, three_of_radius_5, chance), frames), start=1):
        total += images(Y, here)
        if t in wanted:
            found.append(rel_mse(total / t, truth))
    return np.stack(found)


def temporal_alone(cap: float, replicas: int, chance: Live) -> Array:
    """Late variance without spatial reuse over sigma^2 / (2 M_c + 1), real code and exact, and as it is; (3,)."""
    line, truth = image_of_64(), true_image(image_of_64())
    here, frames = Pixels(line, np.arange(64 * replicas)), max(60, int(6 * (cap + 1)))
    seen = [images(Y, here) for Y in islice(chain(here, cap, nobody, chance), frames)][frames // 2 :: int(cap)]
    sigma2 = np.array([second_moment(line, i) for i in range(64)]) / truth**2 - 1
    measured = ((np.stack(seen) / truth - 1) ** 2).mean()
    return np.array([measured * (2 * cap + 1) / sigma2.mean(), exactly_alone(cap, 2 * frames), measured])


# ---------------------------------------------------------------- the ring: exact


def ring() -> Frame:
    """Eight pixels of 16 cells."""
    return quotient(ring_of_8(), 16)


def relative(v: Array, truth: Array) -> float:
    """relMSE of an unbiased image of variances v."""
    return float((v / (truth**2 + (0.01 * truth.mean()) ** 2)).mean())


def ring_frames(cap: float, frames: int, chance: Live) -> Array:
    """Exact relMSE of every frame, neighbours to the left and right; (frames,)."""
    loop = Loop(ring(), cap, (-1, 1))
    Z, c, found = start(loop, 0), 0.0, []
    for _ in range(frames):
        Z, c = step(loop, Z, c)
        found.append(relative(variance(shaded(loop, Z)), integrals(loop.frame)))
    return np.array(found)


def ring_means(cap: float, frames: int, chance: Live) -> Array:
    """Exact relMSE of the mean of the first t frames, for recorded t; (t,)."""
    loop = Loop(ring(), cap, (-1, 1))
    Z, c, found = start(loop, 8), 0.0, []
    for t in range(1, frames + 1):
        Z, c = step(loop, Z, c)
        Z = accumulated(loop, Z)
        found.append(relative(variance(Z)[-8:] / t**2, integrals(loop.frame)))
    return np.asarray(np.array(found)[recorded(frames) - 1])


def exactly_alone(cap: float, frames: int) -> float:
    """Variance of a late frame of two pixels over sigma^2 / (2 M_c + 1), exact on cells."""
    loop = Loop(quotient(two_pixels(), 32), cap, ())
    Z, c = start(loop, 0), 0.0
    Z, c = step(loop, Z, c)
    sigma2 = variance(shaded(loop, Z))  # of the first frame, which is one sample
    for _ in range(frames):
        Z, c = step(loop, Z, c)
    return float((variance(shaded(loop, Z)) / sigma2).mean() * (2 * cap + 1))


KINDS: dict[str, tuple[Callable[..., Array], tuple[float, ...]]] = {
    "image": (errors_of_frames, CAPS),
    "mean": (errors_of_means, AVERAGED),
    "ring": (ring_frames, CAPS),
    "ring mean": (ring_means, (20,)),
    "alone": (temporal_alone, ALONE),
}

# ---------------------------------------------------------------- judging


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """Everything by cap: image (cap, t, replica), ring (cap, t), and so on."""
    parts = iter(results)
    frames = preset["image"][0]
    errors = np.stack([next(parts)["found"] for _ in CAPS])
    t = recorded(frames)
    windows = [errors[:, int(0.95 * (k - 1)) : max(k, int(1.05 * k))].mean(axis=1) for k in t]
    return {
        "t": t,
        "image": np.stack(windows, axis=1),
        "stationary": errors[:, frames // 2 :].mean(axis=1),
        "t_mean": recorded(preset["mean"][0]),
        "mean": np.stack([next(parts)["found"] for _ in AVERAGED]),
        "ring": np.stack([next(parts)["found"] for _ in CAPS]),
        "t_ring_mean": recorded(preset["ring mean"][0]),
        "ring_mean": next(parts)["found"],
        "alone": np.stack([next(parts)["found"] for _ in ALONE]),
    }


def check(a: Arrays) -> list[Claim]:
    """The best cap, both ends, decay of averages, and no optimum without spatial reuse."""
    return [*_of_frames(a), *_of_means(a), *_alone(a)]


def _of_frames(a: Arrays) -> list[Claim]:
    stationary, t = a["stationary"], list(a["t"])
    best = int(stationary.mean(axis=1).argmin())
    moderate = min((e for e, cap in zip(stationary, CAPS, strict=True) if 1 <= cap <= 50), key=np.mean)
    late, early = a["image"][CAPS.index(1000)][[t.index(1000), t.index(10)]]
    ring = a["ring"][:, -1]
    return [
        Claim("GRIS-F09a", criteria.between(CAPS[best], 1, 50), "image: best cap"),
        Claim(
            "GRIS-F09a", criteria.ratio_above(stationary[6], moderate, 3), "image: relMSE, cap 1000 / best of 1 to 50"
        ),
        Claim("GRIS-F09a", criteria.ratio_above(stationary[0], moderate, 3), "image: relMSE, cap 0 / best of 1 to 50"),
        Claim("GRIS-F09a", criteria.ratio_above(late, early, 4), "image, cap 1000: relMSE at t = 1000 / t = 10"),
        Claim("GRIS-F09a", criteria.between(CAPS[int(ring.argmin())], 1, 50), "ring, exact: best cap"),
        Claim("GRIS-F09a", criteria.above(ring[[0, 6]].min() / ring.min(), 3), "ring, exact: caps 0 and 1000 / best"),
    ]


def _of_means(a: Arrays) -> list[Claim]:
    t, t_ring = a["t_mean"], a["t_ring_mean"]
    late, late_ring = (last_decades(times, d) for times, d in ((t, 1), (t_ring, 2)))
    spatial, real_time = a["mean"][0], a["mean"][AVERAGED.index(20)]
    on_ring = criteria.slope_within(t_ring[late_ring], a["ring_mean"][late_ring], -1, 0.15)
    against_1 = spatial[-1].mean() / a["mean"][AVERAGED.index(1), -1].mean()
    return [
        *(
            Claim(
                "GRIS-F09b",
                criteria.slope_within(t[late], error[late].mean(axis=1), -1, 0.15, decades=1),
                f"image, {name}: slope of the mean's relMSE, last decade",
            )
            for name, error in (("spatial only", spatial), ("cap 20", real_time))
        ),
        Claim("GRIS-F09b", on_ring, "ring, exact, cap 20: the same, two decades"),
        Claim(
            "GRIS-F09b",
            criteria.ratio_below(spatial[-1], real_time[-1], 0.5),
            "image: relMSE of the mean, spatial only / cap 20",
            reason=f"For cap 20 only: spatial only has {against_1:.2f} times the relMSE that chains with cap 1 have.",
        ),
        Claim("GRIS-F09b", criteria.below(ring_ratio(a), 0.5), "ring, exact: the same"),
    ]


def last_decades(t: Array, decades: float) -> Array:
    """Which of the times t to fit."""
    return np.asarray(t >= t[t <= t[-1] / 10**decades].max())


def ring_ratio(a: Arrays) -> float:
    """relMSE of the mean on the ring, spatial only over cap 20; without history it is that of a frame over t."""
    return float(a["ring"][0, -1] / a["t_ring_mean"][-1] / a["ring_mean"][-1])


def _alone(a: Arrays) -> list[Claim]:
    parts = zip(ALONE, a["alone"], strict=True)
    return [
        claim
        for cap, (measured, exact, _) in parts
        for claim in (
            Claim("GRIS-F09t", criteria.within(measured, 1, 0.1), f"image, cap {cap}: variance over prediction"),
            Claim("GRIS-F09t", criteria.within(exact, 1, 1e-3), f"two pixels, exact, cap {cap}: the same"),
        )
    ]


def draw(a: Arrays) -> "Picture":
    """Frames of the image and of the ring, stationary error over the cap, and means of frames."""
    picture, axes = style.panels(2, 2, width=4.4, height=3.7)
    (frames, ring), (caps, means) = axes
    for k, cap in enumerate(CAPS):
        look = style.look(style.cap(cap), markevery=0.12)
        frames.loglog(a["t"], a["image"][k].mean(axis=1), **look)
        ring.loglog(np.arange(1, a["ring"].shape[1] + 1), a["ring"][k], **look)
    frames.set(xlabel="frame $t$", ylabel="relMSE of frame $t$", title="(a) 64-pixel image, real code")
    ring.set(xlabel="frame $t$", ylabel="relMSE of frame $t$", title="(a) ring of 8 pixels, exact")
    for axis in (frames, ring):
        style.below(axis, ncols=4)
    _caps(caps, a)
    _means(means, a)
    return picture


def _caps(axis: Any, a: Arrays) -> None:
    x = np.where(np.isinf(CAPS), 6000, np.maximum(CAPS, 0.3))
    axis.loglog(x, a["stationary"].mean(axis=1), label="image, temporal and spatial", markevery=1)
    axis.loglog(x, a["ring"][:, -1], label="ring, temporal and spatial", markevery=1)
    axis.loglog(ALONE, a["alone"][:, 2], label="image, temporal alone", markevery=1)
    axis.set_xticks(x, ["0", "1", "5", "20", "50", "200", "1000", "no cap"])
    axis.minorticks_off()
    axis.set(xlabel="cap $M_c$", ylabel="relMSE of late frames", title="An optimum only with spatial reuse")
    style.below(axis)


def _means(axis: Any, a: Arrays) -> None:
    for k, cap in enumerate(AVERAGED):
        label = f"{style.cap(cap)}{'' if cap else ', spatial only'}"
        axis.loglog(a["t_mean"], a["mean"][k].mean(axis=1), **style.look(style.cap(cap), label=label), markevery=0.12)
    for cap, error in ((0, a["ring"][0, -1] / a["t_ring_mean"]), (20, a["ring_mean"])):
        label = f"{style.cap(cap)}, ring, exact"
        axis.loglog(a["t_ring_mean"], error, **style.look(style.cap(cap), marker="", lw=1, label=label))
    axis.set(xlabel="frames averaged $t$", ylabel="relMSE of their mean", title="(b) means of frames")
    style.below(axis)


FIGURE = Figure(
    id="GRIS-F09",
    title="What the M-cap does to frames and to their mean",
    world="toy1d",
    source="[GRIS Fig. 9; 6.4, 6.5, 9.1]",
    claims=("GRIS-F09a", "GRIS-F09b", "GRIS-F09t"),
    presets={
        "quick": {"image": [1000, 36], "mean": [2000, 14], "ring": [300], "ring mean": [3000], "alone": [24]},
        "paper": {"image": [2000, 64], "mean": [10_000, 64], "ring": [1000], "ring mean": [10_000], "alone": [128]},
    },
    arm="cap",
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)

"""MCMC Tables 1 and 2 and Fig. 8 on the line: 64 pixels, chains of 50 frames with M_c = 50.

The same passes without transport: proposals step the one random number that a sample has.  Neighbours' integrands
differ, so that mutations decorrelate, and as reuse without them keeps few distinct samples, the error falls too.
With w_bn = 1 samples follow the proposals instead of p_hat, and what neighbours make of them is many times too bright.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Figure
from figures.experiments.exact import true_image
from figures.experiments.mutated import ARMS, ENOUGH, FRAMES, LOOP, covariances, errors, shown
from figures.report import style
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.integrals import Pixels
from restir_ref.loop import WHOLE, frame, random_in_row
from restir_ref.metrics import low_frequency_ratio, power_spectrum
from toy1d import image_of_64, walking

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

NONE, FIVE, BLUE, AFTER = "k = 0", "k = 5", "k = 5, blue", "k = 5, after spatial reuse"
KS = ("k = 1", "k = 5", "k = 20")
EVERY = (NONE, *KS, BLUE, AFTER)
NAMES = {NONE: "no mutations", FIVE: "5 mutations", BLUE: "5 mutations, blue", AFTER: "5 after spatial reuse"}
PRESET = replace(LOOP, radius=5)


def chunks(preset: Any) -> Sequence[dict[str, str]]:
    """Every way to mutate."""
    return [{"arm": arm} for arm in EVERY]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Covariance, RMSE and low-frequency ratio of every image, (replicas,), and their mean spectrum."""
    line, arm, chance = walking(image_of_64()), ARMS[chunk["arm"]], Live(rng)
    truth, here = true_image(line), Pixels(line, np.arange(line.n * preset["replicas"]))
    passes = replace(WHOLE, mutation=arm.between)
    X = arm.after(frame(here, chance, PRESET, random_in_row, passes=passes), here, chance)
    for _ in range(preset["frames"] - 1):
        X = arm.after(frame(here, chance, PRESET, random_in_row, X, [here], passes=passes), here, chance)
    images = shown(X, here)
    return {
        "covariance": covariances(images) / truth.mean() ** 2,
        "error": errors(images, truth) / truth.mean(),
        "low": low_frequency_ratio(images - truth),
        "spectrum": power_spectrum(images - truth).mean(axis=0),
        "correlation": correlation(images),
    }


def correlation(images: Array) -> Array:
    """Mean covariance over mean variance, (1,)."""
    return np.array([covariances(images).mean() / images.var(axis=0, ddof=1).mean()])


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """By way to mutate."""
    return {f"{arm}.{name}": each for arm, found in zip(EVERY, results, strict=True) for name, each in found.items()}


def check(a: Arrays) -> list[Claim]:
    """Covariance falls, the error does not rise, and nothing is blue."""
    claims = [
        ratio(a, "MCMC-T2", (FIVE, NONE, "covariance"), 0.9, "64 pixels: covariance 5 / 0"),
        ratio(a, "MCMC-T1", (FIVE, NONE, "error"), 1.03, "64 pixels: RMSE 5 / 0"),
        replace(
            ratio(a, "MCMC-C03", (FIVE, AFTER, "covariance"), 0.95, "64 pixels: covariance between / after"),
            reason=f"{open_by(a)}  {EITHER_WAY}",
        ),
    ]
    correlated = ", ".join(f"{a[f'{arm}.correlation'][0]:.3f} ({NAMES[arm]})" for arm in (NONE, FIVE))
    claims.append(Claim("MCMC-T2", criteria.reported(correlated), "64 pixels: correlation coefficient"))
    for k in KS:
        both = [criteria.ratio_below(a[f"{k}.{what}"], a[f"{NONE}.{what}"], 1.03) for what in ("error", "covariance")]
        counter = criteria.ratio_above(a[f"{k}.error"], a[f"{NONE}.error"], 1.03)
        falls = criteria.ratio_below(a[f"{k}.error"], a[f"{NONE}.error"], 1).passed
        claim = Claim("MCMC-C01", criteria.all_of(*both), f"64 pixels: {k} / 0", counter, caveat=FALLS if falls else "")
        claims.append(judged(a, claim))
    interval = criteria.ratio_interval(a[f"{BLUE}.covariance"], a[f"{FIVE}.covariance"])[2]
    claims.append(Claim("MCMC-T2b", criteria.reported(interval), "64 pixels: covariance, blue / plain"))
    for arm in (NONE, FIVE, BLUE):
        low = a[f"{arm}.low"]
        red, blue = criteria.ratio_above(low, np.ones_like(low), 1), criteria.ratio_below(low, np.ones_like(low), 1)
        claims.append(judged(a, Claim("MCMC-F08", red, f"64 pixels, {NAMES[arm]}: low-frequency ratio", blue)))
    return claims


FALLS = "the error does not stay, as the sentence has it: it falls, because reuse alone keeps few distinct samples"


def open_by(a: Arrays) -> str:
    """What so many images can tell of mutations between the passes and after both."""
    low, high, _ = criteria.ratio_interval(a[f"{FIVE}.covariance"], a[f"{AFTER}.covariance"])
    return f"{len(a[f'{FIVE}.covariance'])} images leave {(high - low) / 2:.2f} of the ratio open."


EITHER_WAY = (
    "Our explanation: what is mutated after spatial reuse is what the next frame reuses in time, so that samples "
    "differ before the next spatial reuse either way."
)


def ratio(a: Arrays, id_: str, of: tuple[str, str, str], limit: float, part: str) -> Claim:
    """One arm below `limit` times the other."""
    one, other, what = of
    pair = a[f"{one}.{what}"], a[f"{other}.{what}"]
    return judged(a, Claim(id_, criteria.ratio_below(*pair, limit), part, criteria.ratio_above(*pair, 1)))


def judged(a: Arrays, claim: Claim) -> Claim:
    """The claim, if there are images enough."""
    few = len(a[f"{NONE}.low"]) < ENOUGH
    return Claim(claim.id, None, claim.part, reason="Too few images.") if few else claim


def draw(a: Arrays) -> "Picture":
    """Spectra of the error; covariance and RMSE over k."""
    picture, axes = style.panels(1, 2, width=4.4, height=3.6)
    left, right = axes[0]
    k = np.arange(1, 33)
    for number, (arm, name) in enumerate(NAMES.items()):
        look = style.nth(number, label=name, markevery=4)
        left.semilogy(k / 64, a[f"{arm}.spectrum"][k], **look)
    left.set(xlabel="cycles per pixel", ylabel="power of the error", title="64 pixels, M_c = 50, frame 50")
    left.set_title("64 pixels: spectrum of the last frame")
    left.legend(loc="upper right")
    for number, (what, name) in enumerate({"covariance": "covariance, radius 8", "error": "RMSE"}.items()):
        rows = [criteria.ratio_interval(a[f"{each}.{what}"], a[f"{NONE}.{what}"])[:2] for each in KS]
        middle = np.array([a[f"{each}.{what}"].mean() / a[f"{NONE}.{what}"].mean() for each in KS])
        low, high = np.array(rows).T
        place = [int(each[4:]) for each in KS]
        look = style.nth(number + 4, label=name, markevery=1)
        right.errorbar(place, middle, [middle - low, high - middle], **look, capsize=2)
    right.axhline(1, color=style.INK, lw=1, ls=":", marker="", label="as without mutations")
    right.set(xscale="log", xlabel="mutations $k$ per frame", ylabel="relative to $k$ = 0 (bars: 95%)", ylim=(0, 1.2))
    right.set_title("Covariance and error")
    right.set_xticks([1, 5, 20], ["1", "5", "20"])
    right.minorticks_off()
    right.legend(loc="lower left")
    return picture


FIGURE = Figure(
    id="MCMC-T64",
    title="Covariance, error and spectrum with mutations, on the line",
    world="toy1d",
    source="[MCMC Tab. 1, Tab. 2, Fig. 8; 3.2.2, 3.2.4, 6.3]",
    claims=("MCMC-T1", "MCMC-T2", "MCMC-T2b", "MCMC-C01", "MCMC-C03", "MCMC-F08"),
    arm="arm",
    presets={"quick": {"frames": 20, "replicas": 60}, "paper": {"frames": FRAMES, "replicas": 8000}},
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)

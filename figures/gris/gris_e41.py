"""GRIS Eq. 41-43: bounds on the variance of the weight sum, from which the rate of convergence follows.

Independent inputs: seven overlapping domains, |R| of M samples canonical, which use little of the bound;
coins with a faint neighbour, which nearly attain it; a steep shift, with which 1/M weights exceed it.
Dependent inputs: a sticky chain X_(k+1) = X_k with probability rho, else new; rho = 1 gives duplicates.
All variances are exact.
"""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Figure
from figures.report import style
from restir_ref.batch import Array, ratio
from restir_ref.mis import WEIGHTS
from restir_ref.oracle import bounds
from restir_ref.oracle.cells import Frame, cells
from restir_ref.oracle.moments import Moments, Operator, Source, copies, drawn, operator, reused
from restir_ref.oracle.scenes import paired
from toy1d import overlapping_supports, quotient, two_pixels

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

ROBUST = ("talbot", "pairwise", "defensive")
CENTRE = 3
EXPONENTS = (0.5, 0.75, 1.0)
"""|R| = M to this power."""
HOLD = (0.5, 0.9, 1.0)
COPIES = (16, 256)


# ---------------------------------------------------------------- independent inputs


def independent_inputs(preset: Any) -> Arrays:
    """Relative Var[sum w] and its bounds over M; Talbot (exponent, M), all weights at |R| / M = 1/7 (mis, n)."""
    frame, M = quotient(overlapping_supports(), preset["cells"]), preset["M"]
    one = drawn(frame)
    growing = [[spread(frame, one, shared_out(m, int(np.ceil(m**a))), "talbot") for m in M] for a in EXPONENTS]
    fixed = [[spread(frame, one, np.full(7, n), mis) for n in preset["n"]] for mis in ROBUST]
    return {"M": np.array(M), "growing": np.array(growing), "n": np.array(preset["n"]), "fixed": np.array(fixed)}


def shared_out(M: int, R: int) -> Array:
    """R samples of the centre pixel and M - R of the six others as evenly as they go; (7,)."""
    n = np.full(7, (M - R) // 6)
    n[CENTRE] = R
    n[[2, 4, 1, 5, 0, 6][: (M - R) % 6]] += 1
    return n


def spread(frame: Frame, one: Moments, n: Array, mis: str) -> tuple[float, float, float]:
    """Var[sum w], Popoviciu's bound with each C_i, and with the largest; relative to ||p_hat||^2."""
    one_pass, Z = reused(frame, CENTRE, n, WEIGHTS[mis]), copies(one, np.repeat(np.maximum(n, 1), len(one.mean) // 7))
    C, norm2 = ratio(frame.cells.p_hat, frame.cells.pdf[0]).max(axis=-1), (one_pass.u @ one.mean) ** 2
    each = bounds.popoviciu(np.repeat(bounds.weight_bound(C, 1, n[CENTRE]), n))
    alike = bounds.equal_popoviciu(C.max(), n.sum(), n[CENTRE])
    return float(weight_variance(one_pass, Z) / norm2), float(each / norm2), float(alike / norm2)


def weight_variance(one_pass: Operator, Z: Moments) -> float:
    """Var[sum w] = u Cov[Z] u."""
    return float(one_pass.u @ (Z.second - np.outer(Z.mean, Z.mean)) @ one_pass.u)


# ---------------------------------------------------------------- two cells that use the bound, or break it


def faint_coins() -> Frame:
    """p_hat is 2 or 0 with equal chance, Popoviciu's worst case; pixel 1 is alike, a hundred times fainter."""
    f = np.array([[2.0, 0.0], [0.02, 0.0]])
    return Frame(cells(np.full((2, 2), 0.5), f, np.ones((1, 2, 2)), paired(2, 2, {(0, 1): (0, 1)})), 2)


def steep_shift() -> Frame:
    """p_hat = 1, uniform samples; a hundredth of pixel 1 is mapped to half of pixel 0, with J = 50."""
    v = np.array([[0.5, 0.5], [0.01, 0.99]])
    return Frame(cells(v, np.ones((2, 2)), np.ones((1, 2, 2)), paired(2, 2, {(0, 1): (0, 1)})), 2)


def bound_used(frame: Frame, n: int, mis: str) -> float:
    """Var[sum w] over sum_i C_i^2 / (4 |R|^2) for pixel 0 with n samples of each of two pixels."""
    count, C = np.full(2, n), ratio(frame.cells.p_hat, frame.cells.pdf[0]).max(axis=-1)
    found = weight_variance(reused(frame, 0, count, WEIGHTS[mis]), copies(drawn(frame), np.repeat(count, 2)))
    return found / float(bounds.popoviciu(np.repeat(bounds.weight_bound(C, 1, n), n)))


def extreme_inputs(preset: Any) -> Arrays:
    """Share of the bound that is used, (weight, n): coins, and a steep shift, the latter also with 1/M."""
    coins = [[bound_used(faint_coins(), n, mis) for n in preset["n"]] for mis in ROBUST]
    steep = [[bound_used(steep_shift(), n, mis) for n in preset["n"]] for mis in (*ROBUST, "constant")]
    return {"coins": np.array(coins), "steep": np.array(steep)}


# ---------------------------------------------------------------- dependent inputs


def dependent_inputs(preset: Any) -> Arrays:
    """Var[sum w] of sticky chains and its bound, relative, (rho, M); of real passes over duplicates, (copies,)."""
    frame = quotient(two_pixels(), preset["wave_cells"])
    M, norm = np.array(preset["M_sticky"]), float((frame.cells.p_hat * frame.cells.v).sum(axis=-1)[0])
    C, one = float(ratio(frame.cells.p_hat, frame.cells.pdf[0]).max(axis=-1)[0]), drawn(frame)
    alone = weight_variance(duplicates(frame, 1), one)
    bound = [[bounds.dependent_bound(C, m, rho ** np.arange(1, m + 1)) for m in M] for rho in HOLD]
    copied = [weight_variance(duplicates(frame, k), one) for k in COPIES]
    return {
        "M_sticky": M,
        "sticky": np.array([[alone * sticky_share(rho, m) for m in M] for rho in HOLD]) / norm**2,
        "sticky_bound": np.array(bound) / norm**2,
        "copied": np.array(copied) / alone,
    }


def sticky_share(rho: float, M: int) -> float:
    """Var of the mean of M links of a sticky chain over that of one: (1/M^2) (M + 2 sum_k (M - k) rho^k)."""
    k = np.arange(1, M)
    return float((M + 2 * ((M - k) * rho**k).sum()) / M**2)


def duplicates(frame: Frame, k: int) -> Operator:
    """The pass of pixel 0 over k inputs that are all one and the same sample."""
    return operator([Source(0, frame, 0, 1)] * k, frame.n * frame.cells.v.shape[-1], WEIGHTS["talbot"])


# ---------------------------------------------------------------- the figure

PARTS: dict[str, Callable[[Any], Arrays]] = {
    "independent": independent_inputs,
    "extreme": extreme_inputs,
    "dependent": dependent_inputs,
}


def chunks(preset: Any) -> Sequence[Any]:
    """Each part is one chunk."""
    return [{"part": part} for part in PARTS]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """Exact numbers: nothing is drawn."""
    return PARTS[chunk["part"]](preset)


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """All arrays together."""
    return {name: array for result in results for name, array in result.items()}


def check(a: Arrays) -> list[Claim]:
    """No variance exceeds its bound, and slopes are as predicted."""
    return [*check_independent(a), *check_dependent(a)]


def check_independent(a: Arrays) -> list[Claim]:
    """Eq. 41 at a fixed share of canonical inputs, and growing shares."""
    slopes = [criteria.slope_within(a["n"], a["fixed"][k, :, 0], -1, 0.1) for k in range(len(ROBUST))]
    used = (a["fixed"][..., 0] / a["fixed"][..., 1]).max()
    growing = (a["growing"][..., 0] / a["growing"][..., 1]).max()
    bound = [criteria.slope_within(a["M"], a["growing"][k, :, 2], 1 - 2 * x, 0.1) for k, x in enumerate(EXPONENTS)]
    return [
        Claim("GRIS-E41", criteria.between(used, 0, 1), "seven domains: largest variance over its bound"),
        *check_extreme(a),
        *(
            Claim("GRIS-E41", slope, f"{mis}: slope, 1/n as copies are independent")
            for mis, slope in zip(ROBUST, slopes, strict=True)
        ),
        Claim("GRIS-C04", criteria.between(growing, 0, 1), "the bound holds: largest variance over it"),
        *(
            Claim("GRIS-C04", s, f"the bound itself, not the variance, for |R| = M^{x:g}: slope")
            for x, s in zip(EXPONENTS, bound, strict=True)
        ),
    ]


def check_extreme(a: Arrays) -> list[Claim]:
    """The bound is nearly attained and not exceeded, and 1/M weights exceed it."""
    robust, control = a["steep"][:-1], a["steep"][-1]
    return [
        Claim(
            "GRIS-E41", criteria.between(a["coins"].min(), 0.9, 1), "faint coins, Eq. 36-38: least share of the bound"
        ),
        Claim("GRIS-E41", criteria.between(a["coins"].max(), 0.9, 1), "faint coins, Eq. 36-38: largest share"),
        Claim("GRIS-E41", criteria.between(robust.max(), 0, 1), "steep shift, Eq. 36-38: largest share of the bound"),
        Claim("GRIS-E41", criteria.above(control.min(), 1), "steep shift, 1/M must exceed it: least share"),
    ]


def check_dependent(a: Arrays) -> list[Claim]:
    """Eq. 42-43 and duplicates."""
    M = a["M_sticky"]
    last = (M >= 256) & (M <= 2048)
    used = (a["sticky"] / a["sticky_bound"]).max()
    claims = [Claim("GRIS-E42", criteria.between(used, 0, 1), "largest variance over its bound")]
    for rho, row_ in zip(HOLD, a["sticky"], strict=True):
        goal, tol = (-1, 0.15) if rho < 1 else (0, 0.05)
        slope = criteria.within(criteria.slope(M[last], row_[last]), goal, tol)
        claims.append(Claim("GRIS-E42", slope, f"hold {rho:g}: slope over M = 256..2048, exact"))
        far = criteria.slope_within(M[M >= 512], row_[M >= 512], goal, tol)
        claims.append(Claim("GRIS-E42", far, f"hold {rho:g}: slope over M = 512..65536, exact"))
    copied = [criteria.between(value, 0.95, 1.05) for value in a["copied"]]
    return [
        *claims,
        *(
            Claim("GRIS-C05", one, f"{k} copies: variance over that of one")
            for k, one in zip(COPIES, copied, strict=True)
        ),
    ]


def draw(a: Arrays) -> "Picture":
    """Variances under their bounds, over the number of inputs."""
    picture, axes = style.panels(1, 2, width=4.6, height=3.8)
    shares, sticky = axes[0]
    for k, x in enumerate(EXPONENTS):
        look = style.nth(k, markevery=1)
        bound = {**look, "ls": "--", "mfc": "none", "label": f"$|R| = M^{{{x:g}}}$, bound"}
        shares.loglog(a["M"], a["growing"][k, :, 0], **{**look, "ls": "-"}, label=f"$|R| = M^{{{x:g}}}$")
        shares.loglog(
            a["M"], a["growing"][k, :, 2], **look | {"ls": "--"}, mfc="none", label=f"$|R| = M^{{{x:g}}}$, bound"
        )
    for k, rho in enumerate(HOLD):
        look = style.nth(k, markevery=2)
        bound = {**look, "ls": "--", "mfc": "none", "label": f"hold {rho:g}, bound"}
        sticky.loglog(a["M_sticky"], a["sticky"][k], **{**look, "ls": "-"}, label=f"hold {rho:g}")
        sticky.loglog(a["M_sticky"], a["sticky_bound"][k], **bound)
    shares.set(title="Seven domains, Talbot weights")
    sticky.set(title="Sticky chain of samples")
    for each in (shares, sticky):
        each.set(xlabel="inputs $M$", ylabel=r"Var$[\sum w]$, relative to $\|\hat p\|^2$")
        style.below(each, ncols=3)
    return picture


EXACT = {
    "cells": 168,
    "M": [2**k for k in range(4, 13)],
    "n": [2**k for k in range(9)],
    "wave_cells": 48,
    "M_sticky": [2**k for k in range(3, 17)],
}

FIGURE = Figure(
    id="GRIS-E41",
    title="Variance bounds and the rates they give",
    world="toy1d",
    source="[GRIS 5.7, Eq. 41-43]",
    claims=("GRIS-E41", "GRIS-E42", "GRIS-C04", "GRIS-C05"),
    presets={"quick": EXACT, "paper": {**EXACT, "cells": 336}},
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)

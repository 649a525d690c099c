"""What a golden pass is made of, of paths or of pairs: inputs of which the first is canonical, weights, the choice."""

from typing import Any

import numpy as np

from restir_ref.batch import Array, entry, ratio
from restir_ref.integrals import Pixels, shifted
from restir_ref.mis import WEIGHTS
from restir_ref.resampling import Input, weigh

MIS = "pairwise"
"""The weights of the pass."""


def resampled(inputs: list[Input]) -> dict[str, Array]:
    """W, p_hat, p_hat_j, w of every input, their sum, and the choice s by the number u with its W_Y.  [GRIS Eq. 22]"""
    here = inputs[0].at
    landed = [landed_in(each, here) for each in inputs]
    J = np.stack([J for _, J in landed])
    w = np.stack([each.p_hat * each.mW for each in weigh(inputs, here, WEIGHTS[MIS])])
    p_hat = np.where(J > 0, np.stack([here.of.target(here.index, y) for y, _ in landed]), 0)
    u, s = middle(w)
    return {
        "W": np.stack([each.X.W for each in inputs]),
        "p_hat_own": np.stack([each.at.of.target(each.at.index, each.X.x) for each in inputs]),
        "p_hat": p_hat,
        "p_hat_from": np.stack([p_hat_from(y, J, here, inputs) for y, J in landed]),
        "u": u,
        "w": w,
        "w_sum": w.sum(axis=0),
        "s": s,
        "W_Y": ratio(w.sum(axis=0), entry(p_hat, s)),
    }


def landed_in(source: Input, here: Pixels) -> tuple[Any, Array]:
    """The sample in the pixel, or pair, of the pass, and J; the canonical one as it is."""
    if source.at is here:
        return source.X.x, np.ones(len(here.index))
    y = shifted(source.X.x, source.at, here)
    return y.x, y.J


def p_hat_from(y: Any, J: Array, here: Pixels, inputs: list[Input]) -> Array:
    """p_hat_j(T_j^-1 y) |dT_j^-1/dy| of every input j, 0 where y does not exist; (M, N).  [GRIS Eq. 35]"""
    rows = []
    for each in inputs:
        back = shifted(y, here, each.at)
        rows.append(np.where(J > 0, each.at.of.target(each.at.index, back.x) * back.J, 0))
    return np.stack(rows)


def middle(w: Array) -> tuple[Array, Array]:
    """A number in the middle of the widest option's interval, a multiple of 2^-12, and the option; (N,) each."""
    whole = w.sum(axis=0)
    share = ratio(w, whole)
    s = share.argmax(axis=0)
    before = entry(np.cumsum(share, axis=0) - share, s)
    return np.floor((before + entry(share, s) / 2) * 2**12) / 2**12, s

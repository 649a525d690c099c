"""ReSTIR as chained GRIS: initial candidates, temporal reuse, spatial reuse, shading.  [GRIS 6.3]

Which previous pixel and which neighbours to use is a function of pixels and G-buffers, never of
samples.  A loop is written by its caller from these passes: a renderer steps one history,
positivization two.
"""

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from restir_ref.batch import Array, take, total, wide
from restir_ref.chance import Chance
from restir_ref.guards import nonnegative, per_column
from restir_ref.integrals import Pixels, Reservoirs, Sample, target
from restir_ref.mis import WEIGHTS, Weights
from restir_ref.resampling import Candidate, Input, contribution_weight, gris, select, weigh

M_CAP = 20
"""Default cap M_c on the confidence of history.  [GRIS 8.3]"""


def initial(here: Pixels, chance: Chance, M: int = 1) -> Reservoirs:
    """RIS: resample M independent sets of candidates into one sample of confidence 1.  [GRIS Eq. 1-6; 6.3]"""
    drawn = ((x, mW / M) for _ in range(M) for x, mW in here.of.candidates(here.index, chance))
    return resample(drawn, here, chance)


def resample(drawn: Iterable[tuple[Sample, Array]], here: Pixels, chance: Chance) -> Reservoirs:
    """RIS over candidates (x, m W), W = 1/p; list them first to share them between integrals."""
    offered = (Candidate(x, target(here, x), _checked(mW, len(here.index))) for x, mW in drawn)
    return select(offered, chance, np.ones(len(here.index), dtype=int))


def _checked(mW: Array, n: int) -> Array:
    """The m W of candidates (n,), finite and >= 0, whether their target is 0 or not."""
    return nonnegative(per_column(mW, n, "the m W of a candidate"), "the m W of a candidate", "Yield m_i / p(x).")


def temporal(
    X: Reservoirs,
    here: Pixels,
    Y: Reservoirs,
    before: Sequence[Pixels],
    chance: Chance,
    *,
    mis: Weights = WEIGHTS["talbot"],
    cap: float = M_CAP,
) -> Reservoirs:
    """Resample new samples X with the history Y of the previous frame.  [GRIS 6.3 step 2, 6.4]

    Y holds the whole previous frame; each of `before` names one source column per pixel (motion
    vectors), in the previous frame's integrals.  The confidence of history is capped on entry,
    c <- min(c, cap), where [GRIS 6.2] caps the result of a merge.
    """
    history = [Input(capped(take(Y, source.index), cap), source) for source in before]
    return gris([Input(X, here), *history], here, mis, chance)


def spatial(
    X: Reservoirs,
    here: Pixels,
    neighbours: Sequence[Pixels],
    chance: Chance,
    *,
    mis: Weights = WEIGHTS["defensive"],
) -> Reservoirs:
    """Resample every pixel's reservoir with its neighbours', all in X.  [GRIS 6.3 step 3]"""
    return gris([Input(X, here), *around(X, neighbours)], here, mis, chance)


def reuse_all(
    X: Reservoirs,
    here: Pixels,
    neighbours: Sequence[Pixels],
    *,
    mis: Weights = WEIGHTS["talbot"],
) -> Array:
    """sum_i f(Y_i) c_i W_i J_i: shift all, select none; (C, N).  [GRIS Eq. 13-14; Bekaert 2002]"""
    shifted = weigh([Input(X, here), *around(X, neighbours)], here, mis)
    return total([here.of.contribution(here.index, y.x) * contribution_weight(y) for y in shifted])


def shade(X: Reservoirs, here: Pixels) -> Array:
    """<I> = f(X) W, shape (C, N).  [GRIS Eq. 3; 6.3 step 4]"""
    return here.of.contribution(here.index, X.x) * X.W


def capped(X: Reservoirs, cap: float) -> Reservoirs:
    """Confidence c <- min(c, M_c); needs cap > 0, for a null confidence is biased.  [GRIS 6.4]"""
    if not cap > 0:
        raise ValueError(f"the cap M_c must be positive, but is {cap!r}; leave temporal reuse out instead.")
    return replace(X, c=np.minimum(wide(X.c), cap))


def around(X: Reservoirs, neighbours: Sequence[Pixels]) -> list[Input]:
    """The neighbours' reservoirs as inputs of a pass."""
    return [Input(take(X, near.index), near) for near in neighbours]

"""Streaming reservoirs: resampling in constant memory, one candidate after the other.  [Chao 1982; GRIS 2.1]

The result has exactly the distribution of `resampling.select`; only the stored candidates differ.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from restir_ref.batch import Array, where
from restir_ref.chance import Chance
from restir_ref.integrals import Reservoirs
from restir_ref.resampling import Candidate, correction, over_target, resampling_weight, sum_of_weights


@dataclass(frozen=True)
class Stream:
    """The candidate kept so far and the sum of all weights seen; w_sum (N,)."""

    kept: Candidate
    w_sum: Array


def offer(stream: Stream, new: Candidate, chance: Chance) -> Stream:
    """Add w to w_sum *first*, then keep the new candidate with probability w / w_sum."""
    w = resampling_weight(new)
    w_sum = sum_of_weights(stream.w_sum + w)
    replaced = chance.choose(np.stack(np.broadcast_arrays(stream.w_sum, w))) == 1
    return Stream(where(replaced, _corrected(new), _corrected(stream.kept)), w_sum)


def select_streaming(candidates: Iterable[Candidate], chance: Chance, c: Array) -> Reservoirs:
    """As `resampling.select`, without holding more than one candidate.  [GRIS Eq. 21-22]

    Raises ValueError as it does.

    >>> import numpy as np
    >>> from restir_ref import Live
    >>> from restir_ref.resampling import Candidate
    >>> from restir_ref.streaming import select_streaming
    >>> offered = (Candidate(np.array([x]), p_hat=np.array([x]), mW=np.array([1 / 3])) for x in (0.2, 0.5, 0.8))
    >>> Y = select_streaming(offered, Live(np.random.default_rng(1)), c=np.array([1]))
    >>> Y.x, Y.W.round(3)  # W = .5 / .8
    (array([0.8]), array([0.625]))
    """
    stream = None
    for new in candidates:
        stream = Stream(new, resampling_weight(new)) if stream is None else offer(stream, new, chance)
    if stream is None:
        raise ValueError(
            "resampling needs at least one candidate (M = 0): yield one from candidates(), or pass an input."
        )
    W = over_target(stream.w_sum, stream.kept.p_hat) * correction(stream.kept)
    return Reservoirs(stream.kept.x, W, np.broadcast_to(c, W.shape))


def _corrected(y: Candidate) -> Candidate:
    """The candidate with its c_i/m_i written out, so that it can be merged with any other."""
    return replace(y, c_over_m=correction(y))

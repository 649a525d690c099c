"""ReSTIR as chained GRIS: initial candidates, temporal reuse, spatial reuse, shading.  [GRIS 6.3]

Which previous pixel and which neighbours to use is a function of pixels and G-buffers, never of
samples.  A loop is written by its caller from these passes: a renderer steps one history,
positivization two.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from restir_ref.batch import Array, total, wide
from restir_ref.chance import Chance
from restir_ref.guards import apart, nonnegative, per_column, positive, whole
from restir_ref.integrals import NOWHERE, Pixels, Reservoirs, Sample, held, pixels, target, weighted
from restir_ref.mis import WEIGHTS, Weights
from restir_ref.resampling import Candidate, Input, contribution_weight, gris, select, weigh

M_CAP = 20
"""Default cap M_c on the confidence of history.  [GRIS 8.3]"""


def initial(here: Pixels, chance: Chance, M: int = 1) -> Reservoirs:
    """RIS: resample M independent sets of candidates into one sample of confidence 1.  [GRIS Eq. 1-6; 6.3]

    All of them are held until one is chosen; `windows.windowed` bounds that for images of any size.

    >>> import numpy as np
    >>> from restir_ref import Live, Pixels, initial, shade
    >>> from toy1d import two_pixels
    >>> here = Pixels(two_pixels(), np.full(10_000, 1))
    >>> for M in (1, 16):
    ...     estimates = shade(initial(here, Live(np.random.default_rng(1)), M), here)[0]
    ...     print(M, estimates.mean().round(2), estimates.std().round(2))
    1 1.0 1.03
    16 1.0 0.26
    """
    whole(M, 1, "the number M of candidate sets", "Leave it out for one set.")
    drawn = ((x, mW / M) for _ in range(M) for x, mW in here.of.candidates(here.index, chance))
    return resample(drawn, here, chance)


def resample(drawn: Iterable[tuple[Sample, Array]], here: Pixels, chance: Chance) -> Reservoirs:
    """RIS over candidates (x, m W), W = 1/p; list them first to share them between integrals."""
    offered = (Candidate(x, target(here, x), _checked(mW, len(here.index))) for x, mW in drawn)
    return select(_anew(offered), chance, np.ones(len(here.index), dtype=int))


def _anew(offered: Iterable[Candidate]) -> Iterator[Candidate]:
    """The candidates, none of which is in the memory of the one before it."""
    last = None
    for each in offered:
        if last is not None:
            apart(last.x, each.x, "samples from candidates()")
            apart(last.p_hat, each.p_hat, "results of target()")
        yield (last := each)


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

    Y holds the whole previous frame, column k at place k; each of `before` names one source column per
    pixel (motion vectors), in the previous frame's integrals, or `NOWHERE` where there is no history.
    The confidence of history is capped on entry, c <- min(c, cap), where [GRIS 6.2] caps the result of a merge.

    >>> import numpy as np
    >>> from restir_ref import Live, Pixels, initial, shade, temporal
    >>> from toy1d import two_pixels
    >>> here, chance = Pixels(two_pixels(), np.arange(20_000)), Live(np.random.default_rng(1))
    >>> Y = initial(here, chance)
    >>> for frame in range(5):
    ...     Y = temporal(initial(here, chance), here, Y, [here], chance, cap=20)  # nothing moves
    >>> shade(Y, here).reshape(-1, 2).mean(axis=0).round(2), Y.c[:2]
    (array([1.  , 0.99]), array([6., 6.]))
    """
    return gris(reusing(X, here, capped(Y, cap), before), here, mis, chance)


def spatial(
    X: Reservoirs,
    here: Pixels,
    neighbours: Sequence[Pixels],
    chance: Chance,
    *,
    mis: Weights = WEIGHTS["defensive"],
) -> Reservoirs:
    """Resample every pixel's reservoir with its neighbours', all in X.  [GRIS 6.3 step 3]

    >>> import numpy as np
    >>> from restir_ref import Live, Pixels, initial, shade, spatial
    >>> from toy1d import two_pixels
    >>> line, chance = two_pixels(), Live(np.random.default_rng(1))
    >>> here = Pixels(line, np.arange(20_000))
    >>> Y = spatial(initial(here, chance), here, [Pixels(line, here.index ^ 1)], chance)  # the other of two pixels
    >>> shade(Y, here).reshape(-1, 2).mean(axis=0).round(2), Y.c[:2]
    (array([1.01, 0.98]), array([2., 2.]))
    """
    return gris(reusing(X, here, X, neighbours), here, mis, chance)


def reuse_all(
    X: Reservoirs,
    here: Pixels,
    neighbours: Sequence[Pixels],
    *,
    mis: Weights = WEIGHTS["talbot"],
) -> Array:
    """sum_i f(Y_i) c_i W_i J_i: shift all, select none; (C, N).  [GRIS Eq. 13-14; Bekaert 2002]

    >>> import numpy as np
    >>> from restir_ref import Live, Pixels, initial, reuse_all
    >>> from toy1d import two_pixels
    >>> line = two_pixels()
    >>> here = Pixels(line, np.arange(20_000))
    >>> X = initial(here, Live(np.random.default_rng(1)))
    >>> reuse_all(X, here, [Pixels(line, here.index ^ 1)]).reshape(-1, 2).mean(axis=0).round(2)
    array([1.01, 0.98])
    """
    shifted = weigh(reusing(X, here, X, neighbours), here, mis)
    return total([weighted(here, y.x, contribution_weight(y)) for y in shifted])


def shade(X: Reservoirs, here: Pixels) -> Array:
    """<I> = f(X) W, and 0 for null samples; shape (C, N).  [GRIS Eq. 3; 6.3 step 4]

    >>> import numpy as np
    >>> from restir_ref import Pixels, Reservoirs, shade
    >>> from toy1d import two_pixels
    >>> X = Reservoirs(np.array([0.4, 0.4]), W=np.array([1.0, 0.0]), c=np.ones(2))  # the second is a null sample
    >>> shade(X, Pixels(two_pixels(), np.array([0, 0]))).round(3)
    array([[1.529, 0.   ]])
    """
    return weighted(here, X.x, X.W)


def capped(X: Reservoirs, cap: float) -> Reservoirs:
    """Confidence c <- min(c, M_c); needs cap > 0, for a null confidence is biased.  [GRIS 6.4]

    >>> import numpy as np
    >>> from restir_ref import Reservoirs
    >>> from restir_ref.restir import capped
    >>> capped(Reservoirs(np.zeros(2), np.ones(2), c=np.array([3, 90])), 20).c
    array([ 3, 20])
    """
    positive(cap, "the cap M_c", "leave temporal reuse out instead.")
    return replace(X, c=np.minimum(wide(X.c), cap))


def around(X: Reservoirs, neighbours: Sequence[Pixels]) -> list[Input]:
    """The neighbours' reservoirs, columns of X, as inputs of a pass."""
    return [entering(X, near) for near in neighbours]


def entering(X: Reservoirs, source: Pixels) -> Input:
    """Columns `source` of X as an input; W = 0 and c = 0 `NOWHERE`, as if there were no such input."""
    if source.index.min(initial=0) > NOWHERE:
        return Input(held(X, source), source)
    nowhere = source.index == NOWHERE
    there = Pixels(source.of, np.where(nowhere, 0, source.index))
    Y = held(X, there)
    return Input(replace(Y, W=np.where(nowhere, 0, Y.W), c=np.where(nowhere, 0, Y.c)), there)


def reusing(X: Reservoirs, here: Pixels, Y: Reservoirs, sources: Sequence[Pixels]) -> list[Input]:
    """X and the columns of Y that `sources` name: the inputs of a pass that finds reservoirs by their place.

    Raises ValueError unless `here` are images in order, and Y as many of the sources' image, or one for all.
    """
    images = len(here.index) / pixels(here.of)
    if sources and not in_order(here.index):
        place = int(np.argmax(here.index != np.arange(len(here.index))))
        raise ValueError(
            f"reuse finds reservoirs by their place, so `here` must be columns 0 to {len(here.index) - 1} in order, "
            f"but has {here.index[place]} at place {place}: for others take() the sources and pass Inputs to gris()."
        )
    for n in (pixels(source.of) for source in sources):
        if np.size(Y.W) != n and np.size(Y.W) * pixels(here.of) != len(here.index) * n:
            raise ValueError(
                f"the sources' image has {n} pixels and the pass is for {images:g} images, but there are "
                f"{np.size(Y.W)} reservoirs: hand over {images * n:g}, or {n} for all, with the image they are of."
            )
    return [Input(X, here), *around(Y, sources)]


def in_order(index: Array) -> bool:
    """Whether `index` is 0 .. N - 1: whole numbers that rise from 0 to N - 1 in N places leave none out."""
    ends = index[:1].tolist() + index[-1:].tolist()
    return not ends or (ends == [0, len(index) - 1] and bool((index[1:] > index[:-1]).all()))

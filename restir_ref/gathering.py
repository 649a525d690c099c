"""Area reservoirs that gather: what lies in the square stays where it is, and the rest moves into it.  [Zhang 2024]

The square S = p + by of a pixel p overlaps pixels q of the previous film by shares b (`area`), and the integral over S
has a sample in two steps of RIS, of which the second is that of `squares`.  The first takes all samples of overlapped
q, by m p_hat W J of the old frame.  A sample x of q at the place u of its pixel goes to the one place of S that has the
same u, in the pixel h: by the identity where q = h, and by whole pixels otherwise,

    y = T_qh x,   m_q(y) = b_q c_q p_hat_q(x) / sum_r b_r c_r p_hat_r(T_qr x) J_qr.

This is the balance heuristic over all r that could have sent y, sum of b_r c_r p_hat_r(T_hr y) J_hr, times J_qh above
and below; for T_hr T_qh = T_qr, which every shift obeys that keeps a path's numbers and its vertex of reconnection.  So
all that is asked of x are its images in other pixels, 8 at most, whichever squares ask, and each is made once.

(The paper refers to Area ReSTIR, whose public code does so by default; the other option, to reject what lies elsewhere,
is `squares`.  There, too, m has b and the old frame's targets, and the 8 are made ahead.  The words are ours.)
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from restir_ref.area import Film, overlapped, shared_by
from restir_ref.batch import Array, joined, ratio, take, total
from restir_ref.chance import Chance
from restir_ref.integrals import Pixels, Reservoirs, Sample, shifted, target
from restir_ref.mis import WEIGHTS, Weights
from restir_ref.resampling import Candidate, Input, gris, select
from restir_ref.restir import M_CAP, capped, entering
from restir_ref.squares import Held, Squares, following


@dataclass(frozen=True, eq=False)
class Images:
    """The samples x_i of M sources in the pixels of all of them: T_ij x_i is column at[i, j] of K.

    x, p_hat, J  (K,) each sample, its target and its Jacobian there
    at           (M, M, N) columns
    """

    x: Sample
    p_hat: Array
    J: Array
    at: Array


def images(Y: Reservoirs, of: Film, sources: Sequence[Input]) -> Images:
    """All reservoirs' samples where they are, and then in every other pixel that asks for them, once.

    A sample without weight is asked for by nobody, and neither is anything in a pixel that is not there.
    """
    n, everybody = len(Y.W), Pixels(of, np.arange(len(Y.W)))
    q, W, c = (np.stack(each) for each in zip(*[(s.at.index, s.X.W, s.X.c) for s in sources], strict=True))
    asked = (q[:, None] != q) & (W > 0)[:, None] & (c > 0)
    pairs, place = np.unique((q[:, None] * n + q)[asked], return_inverse=True)
    here, there = (Pixels(of, columns) for columns in np.divmod(pairs, n))
    y = shifted(take(Y.x, here.index), here, there)
    at = np.repeat(q[:, None], len(q), axis=1)
    at[asked] = n + place
    p_hat = np.concatenate([target(everybody, Y.x), target(there, y.x)])
    return Images(joined([Y.x, y.x]), p_hat, np.concatenate([np.ones(n), y.J]), at)


def into_squares(Y: Reservoirs, at: Pixels, chance: Chance) -> list[Input]:
    """RIS among the samples of Y of all pixels that the squares `at` overlap; none where none overlaps the image.

    Confidence is sum_q b_q c_q, b the area shares.
    """
    squares: Squares = at.of  # type: ignore[assignment]
    overlap = overlapped(squares.shape, squares.by, at.index)
    if not overlap:
        return []
    columns = [column for column, _ in overlap]
    sources = [shared_by(entering(Y, Pixels(squares.of, column)), share) for column, share in overlap]
    found = images(Y, squares.of, sources)
    offered = []
    for i, source in enumerate(sources):
        inside = np.stack([squares.within(at.index, source.X.x, column) for column in columns])
        offered.append(landed(i, inside, found, sources))
    return [Input(select(offered, chance, total([each.X.c for each in sources])), at)]


def landed(i: int, inside: Array, found: Images, sources: Sequence[Input]) -> Candidate:
    """y = T_ih x_i with m W J, in the pixel h whose part of the square has the place, inside[h]; inside (M, N)."""
    h, N = inside.argmax(axis=0), np.arange(inside.shape[-1])
    y, x = found.at[i, h, N], sources[i].X
    column = np.stack([each.at.index for each in sources])[h, N]
    mW = balance(i, found, [each.X.c for each in sources]) * x.W * found.J[y] * inside.any(axis=0)
    return Candidate(Held(take(found.x, y), column), found.p_hat[y], mW)


def balance(i: int, found: Images, c: Sequence[Array]) -> Array:
    """m_i = c_i p_hat_i(x_i) / sum_j c_j p_hat_j(T_ij x_i) J_ij, in the old frame, c with its share; (N,)."""
    density = (found.p_hat * found.J)[found.at[i]]
    return ratio(c[i] * density[i], total([each * q for each, q in zip(c, density, strict=True)]))


def area_gathering(
    X: Reservoirs,
    here: Pixels,
    Y: Reservoirs,
    before: Pixels,
    chance: Chance,
    *,
    mis: Weights = WEIGHTS["talbot"],
    cap: float = M_CAP,
) -> Reservoirs:
    """Resample new samples X with the history Y of all pixels that their squares overlap.  [Zhang 2024]

    As `squares.area_rejection` otherwise.
    """
    return gris([Input(X, here), *into_squares(capped(Y, cap), before, chance)], here, mis, chance)


gathering = following(into_squares)
"""Samples in the square stay and the others move into it: `area.Following` of the loop.  [Zhang 2024]"""

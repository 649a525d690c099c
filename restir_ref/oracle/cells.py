"""Finite integrals: domains cut into cells, an exact quotient of a continuous problem.

Cell x of integral i has volume v[i, x]; densities and integrands are constant on it.  A shift is
a partial injection of cells, so its Jacobian is the ratio of the volumes.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from restir_ref.batch import Array, ratio
from restir_ref.chance import Chance
from restir_ref.guards import nonnegative
from restir_ref.integrals import Pixels, Shifted


@dataclass(frozen=True, eq=False)
class Cells:
    """Tables of I integrals with K cells each, for all frames of a scene.

    v        (I, K)     volumes > 0
    f        (I, K)     integrand >= 0; p_hat is 0 where no technique can sample it
    p_hat    (I, K)     target function
    pdf      (T, I, K)  densities of the sampling techniques, sum_x pdf v = 1
    shifts   (I, I, K)  shifts[i, j, x] = T_ij(x), or -1 where undefined; partial injections, T_ji = T_ij^-1
    proposal (K, K)     proposal[x, x'] = probability that a mutation moves from cell x to x', if mutations are wanted
    """

    v: Array
    f: Array
    p_hat: Array
    pdf: Array
    shifts: Array
    proposal: Array | None


def cells(
    v: Array, f: Array, pdf: Array, shifts: Array, p_hat: Array | None = None, proposal: Array | None = None
) -> Cells:
    """Tables of a scene, with p_hat = f unless given, and p_hat = 0 where no technique reaches.

    Raises ValueError where a density does not integrate to 1 or a shift has no inverse.
    """
    for what, table in (("volume v", v), ("density pdf", pdf), ("integrand f", f)):
        nonnegative(table, f"the {what}", "Columns here are cells.")
    mass = (pdf * v).sum(axis=-1)
    if not np.allclose(np.asarray(mass, dtype=float), 1):
        raise ValueError(
            f"every technique's density must integrate to 1, but the integrals are {mass}: divide by them."
        )
    check_inverse(shifts)
    covered = np.where(pdf.sum(axis=0) > 0, f if p_hat is None else p_hat, 0)
    moves = None if proposal is None else ratio(proposal, proposal.sum(axis=-1, keepdims=True))
    return Cells(v, f, covered, pdf, shifts, moves)


def check_inverse(shifts: Array) -> None:
    """Raise ValueError unless T_ji(T_ij(x)) = x wherever T_ij is defined; shifts (I, I, K)."""
    i, j, x = np.nonzero(shifts >= 0)
    wrong = shifts[j, i, shifts[i, j, x]] != x
    if wrong.any():
        w = int(np.argmax(wrong))
        raise ValueError(
            f"the shift from integral {i[w]} to {j[w]} maps cell {x[w]} to {shifts[i[w], j[w], x[w]]}, "
            "but the shift back does not return: shifts must be partial injections with T_ji = T_ij^-1."
        )


@dataclass(frozen=True, eq=False)
class Frame:
    """The n pixels of one frame: pixel p of frame t is integral t * n + p; a sample is a cell (N,)."""

    cells: Cells
    n: int
    t: int = 0

    def ids(self, index: Array) -> Array:
        """Integral of each column = lane * n + pixel."""
        return self.t * self.n + index % self.n

    def candidates(self, index: Array, chance: Chance) -> Iterator[tuple[Array, Array]]:
        """One draw per technique, balance heuristic between them: m W = 1 / sum_t p_t(x)."""
        i = self.ids(index)
        pdfs = self.cells.pdf[:, i]
        for pdf in pdfs:
            x = chance.choose((pdf * self.cells.v[i]).T)
            yield x, ratio(np.ones(len(i), dtype=int), pdfs[:, np.arange(len(i)), x].sum(axis=0))

    def target(self, index: Array, x: Array) -> Array:
        """p_hat_i(x)."""
        return self.cells.p_hat[self.ids(index), x]

    def pdf(self, index: Array, x: Array) -> Array:
        """Density of the candidates of a frame with one technique."""
        return np.asarray(self.cells.pdf[0, self.ids(index), x])

    def contribution(self, index: Array, x: Array) -> Array:
        """f_i(x), shape (1, N)."""
        return self.cells.f[None, self.ids(index), x]

    def shift(self, x: Array, index: Array, to: Pixels) -> Shifted:
        """T_ij by table, J = v_j(y) / v_i(x)."""
        there: Frame = to.of  # type: ignore[assignment]
        i, j = self.ids(index), there.ids(to.index)
        y = self.cells.shifts[i, j, x]
        J = np.where(y >= 0, ratio(self.cells.v[j, y], self.cells.v[i, x]), 0)
        return Shifted(np.maximum(y, 0), J)

    def propose(self, index: Array, x: Array, chance: Chance) -> tuple[Array, Array]:
        """A mutation by the table P of proposals; T(x -> y) = P / v(y) is a density."""
        P, v, i = self.cells.proposal, self.cells.v, self.ids(index)
        if P is None:
            raise ValueError("these cells have no table of mutations: pass proposal= to cells().")
        y = chance.choose(P[x].T)
        return y, ratio(P[y, x] * v[i, y], P[x, y] * v[i, x])

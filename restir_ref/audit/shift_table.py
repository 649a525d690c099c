"""A shift that is only a table: rows of (x, y, J), dumped by a shader, with no code that could be asked again.

x and y are primary samples, numbers in [0, 1), that the path of one pixel had and that of the other would have.  Three
laws can be held against rows alone: the slope between neighbouring rows is J; rows of the way back undo those of the
way forth; and J is not clamped.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from restir_ref.audit.plateaus import Plateau, plateaus
from restir_ref.batch import Array

NEAR = 0.02
"""Rows that are further apart than this in any number are no neighbours."""

OFF = 0.1
"""A slope may differ from J so much, relatively: shifts are curved, and rows are finitely close."""

FEWEST = 20
"""Of fewer slopes nothing is said."""


@dataclass(frozen=True)
class Law:
    """What one law says: how many rows could be tested, how many break it; of the worst its number, found, expected."""

    name: str
    tested: int
    broken: int
    worst: tuple[int, float, float]

    @property
    def answer(self) -> str:
        """broken, kept or undecided: one row in fifty may be off, where the shift bends."""
        if self.tested < FEWEST:
            return "undecided"
        return "broken" if self.broken > self.tested / 50 else "kept"

    def __str__(self) -> str:
        if self.answer == "undecided":
            return f"undecided {self.name}: {self.tested} rows could be tested, at least {FEWEST} are needed"
        row, found, expected = self.worst
        where = f"; worst in row {row}: found {found:.6g}, expected {expected:.6g}" if self.broken else ""
        return f"{self.answer:9} {self.name}: {self.broken} of {self.tested} rows{where}"


@dataclass(frozen=True)
class TableReport:
    """The laws, extremes of J where it is defined, and clamps that show."""

    laws: Sequence[Law]
    extremes: tuple[float, float]
    plateaus: Sequence[Plateau]

    @property
    def right(self) -> bool:
        """No law is broken, and nothing looks clamped; undecided laws acquit nobody."""
        return not self.plateaus and all(law.answer == "kept" for law in self.laws)

    def __str__(self) -> str:
        broken = [law.name for law in self.laws if law.answer == "broken"]
        decided = "right, as far as the table shows" if self.right else "UNDECIDED"
        head = f"WRONG: {', '.join(broken)}" if broken else "SUSPICIOUS: J looks clamped" if self.plateaus else decided
        low, high = self.extremes
        found = [f"  {each}" for each in (*self.laws, *self.plateaus)]
        return "\n".join([head, *found, f"  J is {low:.4g} to {high:.4g} where it is defined"])


def audit_shift_table(
    x: Array, y: Array, J: Array, *, back: Array | None = None, J_back: Array | None = None
) -> TableReport:
    """Hold laws against rows of a shift: x, y (d, N) in [0, 1), J (N,), 0 where undefined.

    `back` (d, N) and J_back (N,) are what the shift of y back came to, if that was dumped as well.
    Raises ValueError for shapes that do not fit.

    >>> import numpy as np
    >>> from restir_ref.audit import audit_shift_table
    >>> x = np.random.default_rng(1).random((1, 400))
    >>> right, wrong = (audit_shift_table(x, x**2, J) for J in (2 * x[0], np.ones(400)))
    >>> print(str(right).splitlines()[0])
    right, as far as the table shows
    >>> print(str(wrong).splitlines()[0])
    WRONG: slope
    """
    x, y, J = (np.asarray(each, dtype=float) for each in (x, y, J))
    _check(x, y, J)
    laws = [slopes(x, y, J)]
    if back is not None and J_back is not None:
        laws += [returns(x, np.asarray(back, dtype=float), J), inverses(J, np.asarray(J_back, dtype=float))]
    defined = J[J > 0]
    ends = (float(defined.min()), float(defined.max())) if defined.size else (0.0, 0.0)
    found = {"canonical": np.zeros(1), "J": J[None], "W": np.zeros((1, 0))}
    return TableReport(tuple(laws), ends, tuple(plateaus(found)))


def _check(x: Array, y: Array, J: Array) -> None:
    if x.ndim != 2 or x.shape != y.shape or J.shape != x.shape[1:]:
        raise ValueError(f"x, y and J have shapes {x.shape}, {y.shape} and {J.shape}: give (d, N), (d, N) and (N,).")


def slopes(x: Array, y: Array, J: Array) -> Law:
    """J = |det dy/dx|, by a linear fit to the 2 d + 2 nearest rows; those that do not lie on a plane are left out."""
    from scipy.spatial import cKDTree  # noqa: PLC0415

    rows = np.flatnonzero(J > 0)
    d, k = len(x), 2 * len(x) + 3
    if len(rows) < k:
        return Law("slope", 0, 0, (0, 0.0, 0.0))
    distance, near = (np.asarray(each) for each in cKDTree(x[:, rows].T).query(x[:, rows].T, k))
    around = rows[near[:, 1:]]
    dx = x[:, around] - x[:, rows][..., None]
    dy = y[:, around] - y[:, rows][..., None]
    A = np.einsum("ink,jnk->nij", dx, dx)
    B = np.einsum("ink,jnk->nij", dy, dx)
    sound = (distance[:, -1] < NEAR) & (abs(np.linalg.det(A)) > 1e-300)
    slope = np.zeros((len(rows), d, d))
    slope[sound] = B[sound] @ np.linalg.inv(A[sound])
    left = dy - np.einsum("nij,jnk->ink", slope, dx)
    flat = (left**2).sum(axis=(0, 2)) <= 1e-4 * np.maximum((dy**2).sum(axis=(0, 2)), 1e-300)
    tested = sound & flat
    return _law("slope", rows[tested], J[rows[tested]], abs(np.linalg.det(slope[tested])), OFF)


def returns(x: Array, back: Array, J: Array) -> Law:
    """T^-1(T(x)) = x."""
    rows = np.flatnonzero(J > 0)
    far = abs(back - x).max(axis=0)[rows]
    return _law("way back", rows, 1 + far, np.ones(len(rows)), 1e-3)


def inverses(J: Array, J_back: Array) -> Law:
    """J J_back = 1; a way back that is refused counts as broken."""
    rows = np.flatnonzero(J > 0)
    return _law("inverse Jacobians", rows, J_back[rows], 1 / J[rows], 1e-2)


def _law(name: str, rows: Array, found: Array, expected: Array, tolerance: float) -> Law:
    error = abs(found - expected) / np.maximum(abs(expected), 1e-300)
    if not len(rows):
        return Law(name, 0, 0, (0, 0.0, 0.0))
    worst = int(error.argmax())
    place = (int(rows[worst]), float(found[worst]), float(expected[worst]))
    return Law(name, len(rows), int((error > tolerance).sum()), place)

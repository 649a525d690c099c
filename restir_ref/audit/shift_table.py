"""A shift that is only a table: rows of (x, y, J), dumped by a shader, with no code that could be asked again.

x and y are primary samples, numbers in [0, 1), that the path of one pixel had and that of the other would have.  Four
laws can be held against rows alone: they are numbers; the slope between neighbouring rows is J; rows of the way back
undo those of the way forth; and J is not clamped.
"""

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from restir_ref.audit.fields import BadDump
from restir_ref.audit.files import Stored, read
from restir_ref.audit.plateaus import Plateau, plateaus
from restir_ref.batch import Array

NEAR = 0.02
"""Rows that are further apart than this in any number are no neighbours."""

OFF = 0.1
"""A slope may differ from J so much, relatively: shifts are curved, and rows are finitely close."""

FEWEST = 20
"""Of fewer slopes nothing is said."""

STRATA = 10
"""Strata of log J, each of which has to keep the law by itself: extremes of J are few, and the first to be wrong."""


@dataclass(frozen=True)
class Law:
    """What one law says: how many rows could be tested, how many break it; of the worst its number, found, expected.

    J        the smallest and the largest J among those tested
    stratum  the J of a stratum of log J that is off by itself, (0, 0) if none is
    may      the share of rows that may be off, where the shift bends
    """

    name: str
    tested: int
    broken: int
    worst: tuple[int, float, float]
    J: tuple[float, float] = (0.0, 0.0)
    stratum: tuple[float, float] = (0.0, 0.0)
    may: float = 1 / 50

    @property
    def answer(self) -> str:
        """broken, kept or undecided."""
        if self.tested < FEWEST and not (self.broken and not self.may):
            return "undecided"
        return "broken" if self.broken > self.may * self.tested or self.stratum[1] else "kept"

    def __str__(self) -> str:
        if self.answer == "undecided":
            return (
                f"undecided {self.name}: {self.tested} rows could be tested, at least {FEWEST} are needed: dump more "
                "rows, closer together, with fewer numbers that change"
            )
        row, found, expected = self.worst
        where = f"; worst in row {row}: found {found:.6g}, expected {expected:.6g}" if self.broken else ""
        low, high = self.stratum
        apart = f"; most of those with J from {low:.4g} to {high:.4g}" if high else ""
        tested = f" with J from {self.J[0]:.4g} to {self.J[1]:.4g}" if self.J[1] else ""
        return f"{self.answer:9} {self.name}: {self.broken} of {self.tested} rows{tested} are off{apart}{where}"


@dataclass(frozen=True)
class TableReport:
    """The laws, extremes of J where it is defined, and clamps that show."""

    laws: Sequence[Law]
    extremes: tuple[float, float]
    plateaus: Sequence[Plateau]

    def those(self, answer: str) -> list[str]:
        """The names of the laws with an answer."""
        return [law.name for law in self.laws if law.answer == answer]

    @property
    def wrong(self) -> bool:
        """A law is broken, or J looks clamped."""
        return bool(self.those("broken") or self.plateaus)

    @property
    def right(self) -> bool:
        """No law is broken, and nothing looks clamped; undecided laws acquit nobody."""
        return not self.wrong and not self.those("undecided")

    @property
    def status(self) -> int:
        """The exit status: 0 right, 1 wrong or suspicious, 3 undecided."""
        return 1 if self.wrong else 0 if self.right else 3

    def __str__(self) -> str:
        broken, undecided = self.those("broken"), self.those("undecided")
        decided = f"UNDECIDED: {', '.join(undecided)}" if undecided else "right, as far as the table shows"
        head = f"WRONG: {', '.join(broken)}" if broken else "SUSPICIOUS: J looks clamped" if self.plateaus else decided
        low, high = self.extremes
        found = [f"  {each}" for each in (*self.laws, *self.plateaus)]
        seen = f"  J is {low:.4g} to {high:.4g} where it is defined: limits beyond do not show in this table"
        return "\n".join([head, *found, seen])


def audit_shift_table(
    x: Array, y: Array, J: Array, *, back: Array | None = None, J_back: Array | None = None
) -> TableReport:
    """Hold laws against rows of a shift: x, y (d, N) in [0, 1), J (N,), 0 where undefined.

    `back` (d, N) and J_back (N,) are what the shift of y back came to, if that was dumped as well.
    Raises ValueError for shapes that do not fit.  Rows with numbers that are none are told, and left out.

    >>> import numpy as np
    >>> from restir_ref.audit import audit_shift_table
    >>> x = np.random.default_rng(1).random((1, 400))
    >>> right, wrong = (audit_shift_table(x, x**2, J) for J in (2 * x[0], np.ones(400)))
    >>> print(str(right).splitlines()[0])
    right, as far as the table shows
    >>> print(str(wrong).splitlines()[0])
    WRONG: slope
    """
    given = {"x": x, "y": y, "J": J, "back": back, "J_back": J_back}
    table = {name: np.asarray(each, dtype=float) for name, each in given.items() if each is not None}
    _check(table)
    sound = _sound(table)
    bad = np.flatnonzero(~sound)
    x, y, J, *_ = table.values()
    laws = [Law("numbers", len(sound), len(bad), (int(bad[0]), float(J[bad[0]]), 1.0), may=0)] if len(bad) else []
    table = {name: each[..., sound] for name, each in table.items()}
    x, y, J, *_ = table.values()
    number = np.flatnonzero(sound)
    laws += [slopes(x, y, J, number)]
    laws += [returns(x, table["back"], J, number)] if "back" in table else []
    laws += [inverses(J, table["J_back"], number)] if "J_back" in table else []
    defined = J[J > 0]
    ends = (float(defined.min()), float(defined.max())) if defined.size else (0.0, 0.0)
    found = {"canonical": np.zeros(1), "J": J[None], "W": np.zeros((1, 0))}
    return TableReport(tuple(laws), ends, tuple(plateaus(found)))


NAMES = ("x", "y", "J", "back", "J_back")


def shift_table(path: Path | str) -> dict[str, Array]:
    """The arguments of `audit_shift_table` from a file with columns x[0], ..., y[0], ..., J, back[0], ...

    Raises BadDump for what is no such table.
    """
    with tempfile.TemporaryDirectory() as folder:
        fields = read(path, Path(folder))
        unknown = [name for name in fields if name not in (*NAMES, "format", "version") and not name.startswith("note")]
        missing = [name for name in NAMES[:3] if name not in fields]
        if unknown or missing:
            said = f"has no {missing[0]}" if missing else f"has a field {unknown[0][:40]!r}"
            raise BadDump(f"{Path(path).name} {said}: write x[0], x[1], ..., y[0], ..., J; also back[0], ..., J_back.")
        return {name: _numbers(name, fields[name]) for name in NAMES if name in fields}


def _numbers(name: str, values: Any) -> Array:
    """The field as an array, (N,) for J and J_back, (d, N) for the others."""
    try:
        whole = values.columns(0, values.shape[-1]) if isinstance(values, Stored) else np.asarray(values, dtype=float)
    except (TypeError, ValueError) as error:
        raise BadDump(f"{name} holds no table of numbers: write one number per row.") from error
    return np.asarray(whole if name.startswith("J") else _rows(whole), dtype=float)


def _rows(table: Array) -> Array:
    """One row of numbers is a table (1, N)."""
    return table if table.ndim > 1 else table[None]


def _check(table: Mapping[str, Array]) -> None:
    """Raises ValueError for shapes that do not fit."""
    shapes = {name: each.shape for name, each in table.items()}
    first = shapes["x"]
    if len(first) != 2 or any(
        shape != (first[1:] if name.startswith("J") else first) for name, shape in shapes.items()
    ):
        listed = ", ".join(f"{name} {shape}" for name, shape in shapes.items())
        raise ValueError(f"the shapes are {listed}: give (d, N) for x, y and back, (N,) for J and J_back.")


def _sound(table: Mapping[str, Array]) -> Array:
    """Rows (N,) whose numbers are finite, and whose Jacobians are not negative."""
    finite = np.stack([np.isfinite(_rows(each)).all(axis=0) for each in table.values()]).all(axis=0)
    return np.asarray(finite & (table["J"] >= 0) & (table.get("J_back", table["J"]) >= 0))


def slopes(x: Array, y: Array, J: Array, number: Array) -> Law:
    """J = |det dy/dx|, by a linear fit to the 2 d + 2 nearest rows; those that do not lie on a plane are left out.

    Where J changes from row to row, what is measured is a mean: it may be off by as much as J differs in these rows.
    """
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
    held, measured, beside = rows[tested], abs(np.linalg.det(slope[tested])), J[around[tested]]
    near_enough = abs(J[held] - measured) <= OFF * measured + np.ptp(beside, axis=1)
    return _law("slope", number[held], (J[held], J[held], np.where(near_enough, J[held], measured)), OFF)


def returns(x: Array, back: Array, J: Array, number: Array) -> Law:
    """T^-1(T(x)) = x."""
    rows = np.flatnonzero(J > 0)
    far = abs(back - x).max(axis=0)[rows]
    return _law("way back", number[rows], (J[rows], 1 + far, np.ones(len(rows))), 1e-3)


def inverses(J: Array, J_back: Array, number: Array) -> Law:
    """J J_back = 1; a way back that is refused counts as broken."""
    rows = np.flatnonzero(J > 0)
    return _law("inverse Jacobians", number[rows], (J[rows], J_back[rows], 1 / J[rows]), 1e-2)


def _law(name: str, rows: Array, values: tuple[Array, Array, Array], tolerance: float) -> Law:
    """Rows with values (J, found, expected)."""
    J, found, expected = values
    if not len(rows):
        return Law(name, 0, 0, (0, 0.0, 0.0))
    error = abs(found - expected) / np.maximum(abs(expected), 1e-300)
    worst, off = int(error.argmax()), error > tolerance
    place = (int(rows[worst]), float(found[worst]), float(expected[worst]))
    return Law(name, len(rows), int(off.sum()), place, (float(J.min()), float(J.max())), _stratum(J, off))


def _stratum(J: Array, off: Array) -> tuple[float, float]:
    """The smallest and the largest J of the first stratum of log J most of whose rows, FEWEST at least, are off."""
    z = np.log(J)
    place = np.minimum((z - z.min()) / max(np.ptp(z), 1e-300) * STRATA, STRATA - 1).astype(int)
    size = np.bincount(place, minlength=STRATA)
    bad = np.flatnonzero((size >= FEWEST) & (2 * np.bincount(place, off, minlength=STRATA) > size))
    if not len(bad):
        return (0.0, 0.0)
    inside = J[place == bad[0]]
    return float(inside.min()), float(inside.max())

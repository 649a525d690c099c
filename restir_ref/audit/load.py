"""From the fields of a dump to a recorded pass, a few columns at a time.

Whatever an engine leaves out has a default; what cannot be a number of a pass is a *defect*, which is reported, and
its column is not compared.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from restir_ref.audit.engines import KNOWN
from restir_ref.audit.fields import (
    ARRAYS,
    DENSITIES,
    INPUTS,
    BadDump,
    Defect,
    array,
    check_names,
    improper,
    integers,
    refuse,
    shaped,
    word,
)
from restir_ref.audit.files import Stored, read
from restir_ref.audit.precision import tolerances
from restir_ref.audit.recorded import GIVEN, Pass
from restir_ref.batch import Array, ratio
from restir_ref.mis import CANONICAL_COVERS

BLIND = ("constant", GIVEN)
"""Weights that ask for no densities of other inputs."""

WHOLE = ("canonical", "cap", "k")
"""Fields without columns."""

Fields = Mapping[str, Array]


@dataclass(frozen=True, eq=False)
class Dump:
    """A recorded pass, the fields it is made of, the numbers of its columns in the dump, and which can be compared.

    `order[i]` is the number that input i has in the dump.
    """

    recorded: Pass
    found: Fields
    index: Array
    sound: Array
    order: Sequence[int]


@dataclass(frozen=True, eq=False)
class Whole:
    """A dump as it lies there: its weights, its fields as arrays or in files, M and N, and relative tolerances."""

    mis: str
    fields: Mapping[str, Any]
    M: int
    N: int
    columns_first: tuple[str, ...]
    eps: Mapping[str, float]

    def part(self, start: int, stop: int) -> dict[str, Array]:
        """The fields of some columns as float64, columns last."""
        return {name: self._field(name, start, stop).astype(float) for name in self.fields}

    def _field(self, name: str, start: int, stop: int) -> Array:
        values = self.fields[name]
        if name in WHOLE:
            return np.asarray(values)
        if name in self.columns_first:
            rows = values.rows(start, stop) if isinstance(values, Stored) else np.asarray(values[start:stop])
            return np.moveaxis(rows, 0, -1)
        return values.columns(start, stop) if isinstance(values, Stored) else np.asarray(values[..., start:stop])


def opened(source: Path | str | Mapping[str, Any], folder: Path) -> Whole:
    """A dump from a file or from a mapping of names to arrays; large archives are unpacked into a folder.

    Raises BadDump.
    """
    fields = source if isinstance(source, Mapping) else read(source, folder)
    mis = word(fields, "mis")
    check_names(fields)
    if mis not in (*KNOWN, GIVEN):
        raise BadDump(
            f"'mis' is {mis!r}, an unknown weight: it must be one of {', '.join(map(repr, (*KNOWN, GIVEN)))}."
        )
    arrays = {name: _array(name, fields[name]) for name in ARRAYS if name in fields}
    M, N, first = _layout(arrays)
    for name, values in arrays.items():
        shape = (*values.shape[1:], *values.shape[:1]) if name in first else values.shape
        shaped(name, _Shape(shape), {"M": M, "N": N})
    _check_whole(arrays, mis, M)
    return Whole(mis, arrays, M, N, first, tolerances(fields.get("precision"), arrays))


@dataclass(frozen=True)
class _Shape:
    shape: tuple[int, ...]


def _array(name: str, values: Any) -> Any:
    """Real numbers of any type, in memory or in a file; fields without columns are always small."""
    if isinstance(values, Stored):
        if name not in WHOLE and values.shape and 0 not in values.shape:
            return values
        raise BadDump(f"{name!r} has shape {values.shape} in a file of its own: {ARRAYS[name].meaning}.")
    return array(name, values)


def _layout(arrays: Mapping[str, Any]) -> tuple[int, int, tuple[str, ...]]:
    """M and N, from p_hat, and the fields with columns first: none, or all."""
    shape = arrays["p_hat"].shape
    if len(shape) != 2 or 0 in shape:
        raise BadDump(
            f"'p_hat' has shape {shape}, but must have two axes (M, N), M inputs and N columns, at least one of each: "
            "a single pass is N = 1, [[...], [...]]."
        )
    M, N = shape
    if _fits(arrays, M, N) or not _fits(arrays, N, M, by_rows=1):
        return M, N, ()
    return N, M, tuple(name for name in arrays if name not in WHOLE)


def _fits(arrays: Mapping[str, Any], M: int, N: int, by_rows: int = 0) -> bool:
    """Whether all arrays have the axes of M inputs and N columns, which come first if by_rows is 1."""
    sizes = {"M": M, "N": N}
    for name, values in arrays.items():
        axes = tuple(sizes[axis] for axis in ARRAYS[name].axes)
        if values.shape != (axes if name in WHOLE or not by_rows else (*axes[-1:], *axes[:-1])):
            return False
    return True


def _check_whole(arrays: Mapping[str, Any], mis: str, M: int) -> None:
    """What must be there, and what numbers without columns must be."""
    if "canonical" in arrays:
        integers("canonical", np.asarray(arrays["canonical"]), 2)
    for name in ("cap", "k"):
        value = np.asarray(arrays.get(name, 1.0)).astype(float)
        if not (value > 0).all() or not np.isfinite(value).all():
            raise BadDump(
                f"{name!r} is {value:g}, but must be positive and finite: leave the input, or it, out instead."
            )
    _check_selection(arrays, M)
    if ("p_hat_back" in arrays) != ("J_back" in arrays):
        other = "p_hat_back" if "J_back" in arrays else "J_back"
        raise BadDump(f"the dump has no {other!r} ({ARRAYS[other].meaning}): write what the pass used.")
    if not (rated(arrays, mis) and mis != GIVEN) and not {"m", "w"} & arrays.keys():
        raise BadDump(
            f"the dump has no 'p_hat_from' ({ARRAYS['p_hat_from'].meaning}), no 'm' and no 'w', but {mis!r} weights "
            "need one of them: write what the pass used."
        )


def _check_selection(arrays: Mapping[str, Any], M: int) -> None:
    """Exactly one way to select, at least where the result depends on it."""
    if "u" in arrays and "u_stream" in arrays:
        raise BadDump("the dump has both 'u' and 'u_stream': leave out the one that did not select.")
    if "W_Y" in arrays and not {"u", "u_stream", "s"} & arrays.keys() and M > 1:
        raise BadDump("'W_Y' depends on which input was selected: write 's', or the numbers 'u' or 'u_stream'.")


def rated(found: Mapping[str, Any], mis: str) -> bool:
    """Whether the densities that these weights compare are there."""
    return mis in BLIND or "p_hat_back" in found or "p_hat_from" in found


def load(fields: Mapping[str, Any]) -> Dump:
    """All columns of a dump in memory, as they stand; raises BadDump."""
    whole = opened(fields, Path())
    index = np.arange(whole.N)
    return dump_of(completed(whole.part(0, whole.N), index), whole.mis, index)


# ---------------------------------------------------------------- some columns


def defects(found: Fields, start: int) -> Iterator[Defect]:
    """Numbers among the inputs that none of a pass should be, the first of each field."""
    for name in (*INPUTS, *DENSITIES):
        if name in found and (bad := improper(found[name])).any():
            where = tuple(int(k) for k in np.argwhere(bad)[0])
            columns = int(bad.reshape(-1, bad.shape[-1]).any(axis=0).sum())
            yield Defect(name, (*where[:-1], where[-1] + start), float(found[name][where]), columns)


def dump_of(found: Fields, mis: str, index: Array, order: Sequence[int] = ()) -> Dump:
    """The recorded pass of some columns; raises BadDump for numbers that cannot be what they say."""
    whole = completed(found, index)
    sound = np.ones(len(index), dtype=bool)
    for name in (*INPUTS, *DENSITIES):
        if name in whole and name not in WHOLE:
            sound &= ~improper(whole[name]).reshape(-1, len(index)).any(axis=0)
    safe = {name: _safe(name, values, sound) for name, values in whole.items()}
    _check_values(safe, mis, index)
    return Dump(recorded(safe, mis), safe, index, sound, order or range(len(safe["p_hat"])))


def _safe(name: str, values: Array, sound: Array) -> Array:
    """The values, and 1 in columns that are not compared."""
    if name in (*INPUTS, *DENSITIES) and name not in WHOLE:
        return np.asarray(np.where(sound, values, 1.0))
    return values


def completed(found: Fields, index: Array) -> dict[str, Array]:
    """The fields with defaults for those that are not dumped: J = 1, c = 1, one canonical input."""
    M, N = found["p_hat"].shape
    new = dict(found)
    new.setdefault("J", np.ones((M, N)))
    new.setdefault("c", np.ones((M, N)))
    if "p_hat_own" not in new and "p_hat_from" in new:
        i = np.arange(M)
        new["p_hat_own"] = new["p_hat_from"][i, i] * new["J"]
    new.setdefault("canonical", _canonical(new))
    if "p_hat_own" not in new and "p_hat_back" in new:
        i = np.arange(M)
        new["p_hat_own"] = np.where(new["canonical"][:, None] == 1, new["p_hat"], new["p_hat_back"][i, i])
    return new


def _canonical(found: Fields) -> Array:
    """Where the dump does not say: the first input of those that are not shifted and have the target of the pass."""
    M = len(found["p_hat"])
    own = found.get("p_hat_own", found["p_hat"])
    close = abs(own - found["p_hat"]) <= 1e-3 * abs(found["p_hat"])
    like = ((found["J"] == 1) & close).all(axis=1)
    chosen = int(np.argmax(like)) if like.any() else 0
    return np.asarray(np.arange(M) == chosen, dtype=float)


def _check_values(found: Fields, mis: str, index: Array) -> None:
    """What numbers of columns must be beside finite and not negative."""
    canonical = found["canonical"] == 1
    if "s" in found:
        integers("s", found["s"], len(canonical))
    for name in ("u", "u_stream"):
        if name in found:
            refuse(name, found[name], ~((found[name] >= 0) & (found[name] < 1)), "at least 0 and below 1")
    lonely = ~(found["c"][canonical].sum(axis=0) > 0)
    if mis != GIVEN and KNOWN[mis].unbiased_for == CANONICAL_COVERS and lonely.any():
        raise BadDump(
            f"{mis!r} weights need an input with 'canonical' 1 and 'c' above 0 in every column, but column "
            f"{index[lonely][0]} has none: mark the pixel's own reservoir, and keep the confidence of null samples."
        )


def recorded(found: Fields, mis: str) -> Pass:
    """The pass of checked fields.  Without densities, weights are taken as they were dumped."""
    M, N = found["p_hat"].shape
    nothing = np.broadcast_to(np.nan, (M, M, N))
    whole = found.get("p_hat_from", nothing)
    known = rated(found, mis) and not (mis == GIVEN and "m" not in found)
    p = Pass(
        mis=mis if known else GIVEN,
        canonical=found["canonical"] == 1,
        p_hat=found["p_hat"],
        W=found["W"],
        J=found["J"],
        c=found["c"],
        p_hat_own=found.get("p_hat_own", nothing[0]),
        p_hat_back=found.get("p_hat_back", whole),
        J_back=found.get("J_back", np.broadcast_to(1.0, (M, M, N))),
        cap=float(found.get("cap", np.inf)),
        u=_draws(found),
        s=found["s"].astype(int) if "s" in found else None,
        m=found.get("m"),
        k=float(found["k"]) if "k" in found else None,
    )
    return p if p.mis != GIVEN or p.m is not None else replace(p, m=ratio(found["w"], p.p_hat * p.W * p.J))


def _draws(found: Fields) -> Sequence[Array]:
    if "u" in found:
        return (found["u"],)
    return tuple(found.get("u_stream", ()))

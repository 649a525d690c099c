"""From the fields of a dump to a recorded pass."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from restir_ref.audit.engines import KNOWN
from restir_ref.audit.fields import (
    ARRAYS,
    INPUTS,
    MOST_NUMBERS,
    BadDump,
    Field,
    array,
    check_names,
    integers,
    numbers,
    word,
)
from restir_ref.audit.files import read
from restir_ref.audit.recorded import GIVEN, Pass
from restir_ref.batch import Array
from restir_ref.mis import CANONICAL_COVERS

BLIND = ("constant", GIVEN)
"""Weights that ask for no densities of other inputs."""


@dataclass(frozen=True, eq=False)
class Dump:
    """A recorded pass, and those of the terms that were dumped."""

    recorded: Pass
    found: Mapping[str, Array]


def load(source: Path | str | Mapping[str, Any]) -> Dump:
    """A dump from a file or from a mapping of names to arrays; raises BadDump."""
    fields = source if isinstance(source, Mapping) else read(source)
    mis = word(fields, "mis")
    check_names(fields, _required(mis, fields))
    if mis not in (*KNOWN, GIVEN):
        raise BadDump(
            f"'mis' is {mis!r}, an unknown weight: it must be one of {', '.join(map(repr, (*KNOWN, GIVEN)))}."
        )
    sizes = _sizes(fields)
    found = {name: numbers(fields, name, sizes) for name in ARRAYS if name in fields}
    _check_values(found, mis, sizes["M"])
    return Dump(recorded(found, mis), found)


def _required(mis: str, fields: Mapping[str, Any]) -> dict[str, Field]:
    """What these weights need."""
    names = [*INPUTS]
    if mis == GIVEN:
        names += ["m"]
    if mis not in BLIND:
        pieces = "p_hat_back" in fields or "J_back" in fields
        names += ["p_hat_own", *(("p_hat_back", "J_back") if pieces else ("p_hat_from",))]
    return {name: ARRAYS[name] for name in names}


def _sizes(fields: Mapping[str, Any]) -> dict[str, int]:
    """M and N, from p_hat."""
    shape = array("p_hat", fields["p_hat"]).shape
    if len(shape) != 2 or 0 in shape:
        raise BadDump(
            f"'p_hat' has shape {shape}, but must have two axes (M, N), M inputs and N columns, at least one of each: "
            "a single pass is N = 1, [[...], [...]]."
        )
    M, N = shape
    if M * M * N > MOST_NUMBERS:
        raise BadDump(
            f"'p_hat' has shape {shape}, which makes M M N = {M * M * N} densities, more than the limit of "
            f"{MOST_NUMBERS}: dump fewer columns; each is audited by itself."
        )
    return {"M": M, "N": N}


def _check_values(found: Mapping[str, Array], mis: str, M: int) -> None:
    """What numbers must be beside finite and not negative."""
    canonical = integers("canonical", found["canonical"], 2) == 1
    if "s" in found:
        integers("s", found["s"], M)
    for name in ("u", "u_stream"):
        if (found.get(name, np.zeros(1)) >= 1).any():
            raise BadDump(f"{name!r} is {found[name].max()} somewhere, but must be below 1: {ARRAYS[name].meaning}.")
    if found.get("cap", 1) == 0:
        raise BadDump("'cap' is 0, but must be positive: leave the input out instead.")
    if (
        mis != GIVEN
        and KNOWN[mis].unbiased_for == CANONICAL_COVERS
        and not (found["c"][canonical].sum(axis=0) > 0).all()
    ):
        raise BadDump(
            f"{mis!r} weights need an input with 'canonical' 1 and 'c' above 0 in every column: mark the pixel's own "
            "reservoir, and keep the confidence of null samples."
        )
    _check_selection(found)


def _check_selection(found: Mapping[str, Array]) -> None:
    """Exactly one way to select, at least where the result depends on it."""
    if "u" in found and "u_stream" in found:
        raise BadDump("the dump has both 'u' and 'u_stream': leave out the one that did not select.")
    if "W_Y" in found and not {"u", "u_stream", "s"} & found.keys():
        raise BadDump("'W_Y' depends on which input was selected: write 's', or the numbers 'u' or 'u_stream'.")


def recorded(found: Mapping[str, Array], mis: str) -> Pass:
    """The pass of checked fields."""
    M, N = found["p_hat"].shape
    nothing = np.broadcast_to(np.nan, (M, M, N))
    whole = found.get("p_hat_from", nothing)
    return Pass(
        mis=mis,
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
    )


def _draws(found: Mapping[str, Array]) -> Sequence[Array]:
    if "u" in found:
        return (found["u"],)
    return tuple(found.get("u_stream", ()))

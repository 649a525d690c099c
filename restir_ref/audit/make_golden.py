"""Make the golden vectors: passes with their results, computed by `weigh`, `select` and `gris`.

    python -m restir_ref.audit.make_golden             write the files that ship with the package anew
    python -m restir_ref.audit.make_golden DIR         write them somewhere else
    python -m restir_ref.audit.make_golden --check     say whether the shipped ones are what would be written

One file per MIS weight; `docs/audit.md` explains the fields, which are those of a dump.  All inputs are
powers of two, or small multiples, so that they are the same numbers in float32, and only sums, products
and quotients follow: the files are the same on every machine.
"""

import argparse
import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from restir_ref.audit.cases import CASES, Case, inputs_of
from restir_ref.audit.engines import KNOWN
from restir_ref.audit.fields import FORMAT, VERSION
from restir_ref.audit.golden import GOLDEN, file_name
from restir_ref.audit.load import load
from restir_ref.audit.recorded import Pass, Terms, recompute
from restir_ref.batch import Array, ratio
from restir_ref.mis import CANONICAL_COVERS

ROUNDING = {"float32": 2.0**-24, "float64": 2.0**-53}
"""Relative error of one operation."""

TERMS = ("m", "w", "w_sum", "W_Y", "c_Y")


def vectors(mis: str) -> dict[str, Any]:
    """The golden vectors of a weight, computed."""
    suitable = [case for case in CASES if any(case.canonical) or KNOWN[mis].unbiased_for != CANONICAL_COVERS]
    return {"format": GOLDEN, "version": VERSION, "mis": mis, "cases": [vector(case, mis) for case in suitable]}


def vector(case: Case, mis: str) -> dict[str, Any]:
    """One case: inputs, expected terms, what the choices are far from, and tolerances."""
    fields = inputs_of(case)
    p = load({"format": FORMAT, "version": VERSION, "mis": mis, **fields}).recorded
    w = recompute(p, KNOWN[mis]).w
    u = case.u if case.u else inverting(w)
    streamed = streaming(w)
    one, other = (_terms(p, mis, numbers) for numbers in ([np.asarray(u)], list(streamed)))
    expected = {name: getattr(one, name) for name in (*TERMS[:3], "s", *TERMS[3:])}
    return {
        "name": case.name,
        "about": case.about,
        "float32": case.float32,
        "inputs": {**fields, "u": u, "u_stream": streamed},
        "expected": {**expected, "s_stream": other.s, "W_Y_stream": other.W_Y},
        "matters": ((p.J > 0) & (p.W > 0) & (p.p_hat > 0)).astype(int),
        "margin": {
            "u": rounded_down(margin(w, np.asarray(u))),
            "u_stream": rounded_down(margin_of_stream(w, streamed)),
        },
        "tolerance": {kind: tolerances(len(w), unit) for kind, unit in ROUNDING.items()},
    }


def _terms(p: Pass, mis: str, u: Sequence[Array]) -> Terms:
    return recompute(replace(p, u=u), KNOWN[mis])


def tolerances(M: int, unit: float) -> dict[str, float]:
    """Relative errors that so many roundings add up to, for formulas as the papers have them."""
    m = 3 * M + 8
    roundings = {"m": m, "w": m + 3, "w_sum": m + M + 3, "W_Y": 2 * m + M + 6, "c_Y": M}
    return {term: float(f"{count * unit:.1e}") for term, count in roundings.items()}


# ---------------------------------------------------------------- numbers that select beyond doubt

GRAIN = 2.0**-12
"""Random numbers are multiples of this."""


def shares(w: Array) -> Array:
    """Running sum of w / sum w, (M, N); 0 where all w are 0."""
    return np.asarray(np.cumsum(ratio(w, w.sum(axis=0)), axis=0))


def inverting(w: Array) -> Array:
    """A number per column in the middle of an option: of the widest ones, by turns; (N,)."""
    upto = shares(w)
    share = np.diff(upto, axis=0, prepend=0)
    ranked = np.argsort(-share, axis=0, kind="stable")
    column = np.arange(w.shape[1])
    turn = column % np.maximum((share > 0.1).sum(axis=0), 1)
    k = ranked[turn, column]
    return np.asarray(np.floor((upto[k, column] - share[k, column] / 2) / GRAIN) * GRAIN)


def margin(w: Array, u: Array) -> Array:
    """Distance of u from the nearest boundary between two options that are possible, 1 if there is none; (N,)."""
    upto = shares(w)
    later = w.sum(axis=0) - np.cumsum(w, axis=0)
    boundary = (w > 0) & (later > 0)
    return np.asarray(np.where(boundary, abs(upto - u), 1).min(axis=0))


def thresholds(w: Array) -> Array:
    """A new candidate is taken if its number is below w_i / (w_1 + ... + w_i), (M, N)."""
    return ratio(w, np.cumsum(w, axis=0))


def streaming(w: Array) -> Array:
    """Numbers (M, N) halfway between each threshold and 0 or 1: taken and refused by turns, if both are likely."""
    t = thresholds(w)
    i, column = np.indices(w.shape)
    taken = np.where((t > 0.1) & (t < 0.9), (i + column) % 2 == 0, t > 0.5)
    return np.asarray(np.floor(np.where(taken, t / 2, (1 + t) / 2) / GRAIN) * GRAIN)


def margin_of_stream(w: Array, u: Array) -> Array:
    """Distance of the numbers from the nearest threshold between 0 and 1, 1 if there is none; (N,)."""
    t = thresholds(w)
    return np.asarray(np.where((t > 0) & (t < 1), abs(t - u), 1).min(axis=0))


def rounded_down(values: Array) -> Array:
    """To four digits behind the point."""
    return np.asarray(np.floor(values * 1e4) / 1e4)


# ---------------------------------------------------------------- files


def text(value: Any, indent: str = "") -> str:
    """JSON with a line per field; arrays on one line each."""
    if isinstance(value, Mapping):
        inner = indent + " "
        lines = [f"{inner}{json.dumps(name)}: {text(each, inner)}" for name, each in value.items()]
        return "{\n" + ",\n".join(lines) + f"\n{indent}}}"
    if isinstance(value, list) and value and isinstance(value[0], Mapping):
        return "[\n" + ",\n".join(f"{indent} {text(each, indent + ' ')}" for each in value) + f"\n{indent}]"
    return json.dumps(_short(np.asarray(value).tolist()), separators=(",", ":"))


def _short(value: Any) -> Any:
    """Whole numbers without their point."""
    if isinstance(value, list):
        return [_short(each) for each in value]
    return int(value) if isinstance(value, float) and value.is_integer() and value < 2**53 else value


def files() -> dict[str, str]:
    """All golden files: name and contents."""
    return {file_name(mis): text(vectors(mis)) + "\n" for mis in KNOWN}


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the golden vectors, or check those that ship with the package."""
    parser = argparse.ArgumentParser(prog="python -m restir_ref.audit.make_golden", description="Golden vectors.")
    parser.add_argument("folder", nargs="?", default=Path(__file__).parent / "data", type=Path, metavar="DIR")
    parser.add_argument("--check", action="store_true", help="compare with what is in the folder, write nothing")
    options = parser.parse_args(arguments)
    if options.check:
        stale = [
            n for n, t in files().items() if not (f := options.folder / n).is_file() or f.read_bytes() != t.encode()
        ]
        print(f"stale: {', '.join(stale)}" if stale else "the golden vectors are up to date")
        return 1 if stale else 0
    options.folder.mkdir(parents=True, exist_ok=True)
    for name, contents in files().items():
        (options.folder / name).write_bytes(contents.encode())
    return 0


if __name__ == "__main__":
    raise SystemExit(main())

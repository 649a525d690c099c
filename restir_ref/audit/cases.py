"""The passes behind the golden vectors: what tends to go wrong in shaders, a few columns each.

Values are drawn from short lists by a fixed hash, the same on every machine and in every case of one size;
a case then changes what is special about it, so that two cases differ in that alone.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from restir_ref.batch import Array, ratio
from restir_ref.oracle.enumeration import scattered

Fields = dict[str, Any]


def unchanged(fields: Fields) -> Fields:
    """Nothing special."""
    return fields


@dataclass(frozen=True)
class Case:
    """A pass: which inputs are canonical, how many columns, and what is changed about drawn values.

    `float32` says whether everything stays within the range of float32; `u` replaces the numbers that select.
    """

    name: str
    about: str
    canonical: Sequence[int]
    change: Callable[[Fields], Fields] = unchanged
    columns: int = 4
    float32: bool = True
    u: Sequence[float] = ()


def drawn(options: Sequence[float], shape: tuple[int, ...], stream: int) -> Array:
    """Options by a fixed hash of place and stream."""
    pick = np.floor(scattered(np.arange(np.prod(shape)), stream) * len(options)).astype(int)
    return np.asarray(np.asarray(options, dtype=float)[pick].reshape(shape))


def inputs_of(case: Case) -> Fields:
    """The fields of a case: drawn, changed, and made consistent where one number follows from others."""
    M, N = len(case.canonical), case.columns
    fields: Fields = {
        "canonical": np.array(case.canonical),
        "p_hat": drawn([0.5, 1, 2, 3], (M, N), 1),
        "W": drawn([0.25, 0.5, 1, 2], (M, N), 2),
        "J": drawn([0.5, 1, 2, 4], (M, N), 3),
        "c": np.ones((M, N)),
        "p_hat_own": drawn([0.5, 1, 2, 4], (M, N), 4),
        "p_hat_from": drawn([0.25, 0.5, 1, 3], (M, M, N), 5),
    }
    return consistent(case.change(fields))


def consistent(fields: Fields) -> Fields:
    """Canonical inputs are not shifted and have the target of the pass; p_hat_from_i(y_i) = p_hat_i(X_i) / J."""
    ours = fields["canonical"] == 1
    p_hat, J, own = (fields[name].copy() for name in ("p_hat", "J", "p_hat_own"))
    J[ours], own[ours] = 1, p_hat[ours]
    q, i = fields["p_hat_from"].copy(), np.arange(len(ours))
    q[:, ours] = p_hat[:, None]
    q[i, i] = ratio(own, J)
    return {**fields, "J": J, "p_hat_own": own, "p_hat_from": q}


# ---------------------------------------------------------------- what is special


def holes(fields: Fields) -> Fields:
    """Undefined shifts forth (J = 0) and back (p_hat_from = 0), and shifted samples that are dark here."""
    J, q, p_hat = (fields[name].copy() for name in ("J", "p_hat_from", "p_hat"))
    J[1, 0] = J[2, 1] = J[1, 2] = J[2, 2] = 0
    q[0, 1, 0] = q[0, 2, 1] = q[1, 2, 1] = q[0, 1, 3] = q[0, 2, 3] = 0
    p_hat[1, 3] = 0
    return {**fields, "J": J, "p_hat_from": q, "p_hat": p_hat}


def nulls(fields: Fields) -> Fields:
    """Null samples with their confidence: column 0 the canonical one, 1 another, 2 all; in 3 all targets are 0."""
    W, p_hat = fields["W"].copy(), fields["p_hat"].copy()
    W[0, 0] = W[1, 1] = 0
    W[:, 2], p_hat[:, 3] = 0, 0
    return {**fields, "W": W, "p_hat": p_hat, "c": confidences(fields)["c"]}


def confidences(fields: Fields) -> Fields:
    """Unequal, also fractional confidences."""
    return {**fields, "c": drawn([1, 2, 3.5, 20], fields["W"].shape, 6)}


def caps(fields: Fields) -> Fields:
    """History of long confidence, capped at 4 before anything else."""
    return {
        **fields,
        "c": np.where(fields["canonical"][:, None] == 1, 1.0, drawn([2, 4, 5, 100], fields["W"].shape, 7)),
        "cap": 4.0,
    }


def zero_confidence(fields: Fields) -> Fields:
    """Neighbours of confidence 0 take no part, as if off the screen."""
    c = confidences(fields)["c"]
    c[1, 0] = c[2, 1] = c[1, 2] = c[2, 2] = 0
    return {**fields, "c": c}


def ends(fields: Fields) -> Fields:
    """The first, or the last, input has weight 0 and must not be selected by u = 0, or by u just below 1."""
    W = fields["W"].copy()
    W[0, :2] = W[2, 2:] = 0
    return {**fields, "W": W}


def scaled(p_hat: float, W: float, J: float) -> Callable[[Fields], Fields]:
    """Powers of two far from 1."""

    def change(fields: Fields) -> Fields:
        factor = {"p_hat": p_hat, "W": W, "J": J, "p_hat_own": p_hat, "p_hat_from": p_hat}
        return {name: values * factor.get(name, 1) for name, values in fields.items()}

    return change


def spread(power: int) -> Callable[[Fields], Fields]:
    """Targets and weights of one column that differ by 2^(2 power)."""

    def change(fields: Fields) -> Fields:
        up = 2.0 ** np.array([[-power], [0], [power]])
        return {**fields, "p_hat": fields["p_hat"] * up, "W": fields["W"] / up, "p_hat_own": fields["p_hat_own"] * up}

    return change


THREE = (1, 0, 0)
LAST = 1 - 2.0**-24
"""The largest float32 below 1."""

CASES = (
    Case("plain", "one canonical input and two others, all shifts defined", THREE),
    Case("confidences", "unequal confidences, also fractions", THREE, confidences),
    Case("unequal supports", "shifts undefined forth or back, targets 0 here", THREE, holes),
    Case(
        "nulls",
        "null samples; columns 2 and 3 have nothing to select: s = 0, W_Y = 0, confidences add up",
        THREE,
        nulls,
    ),
    Case("caps", "confidences of the others capped at 4", THREE, caps),
    Case("zero confidence", "inputs that take no part", THREE, zero_confidence),
    Case("one input", "M = 1, canonical", (1,)),
    Case("all canonical", "|R| = M, where pairwise weights are 0/0 in print", (1, 1, 1), confidences),
    Case("two canonical", "|R| = 2", (1, 0, 1, 0), confidences),
    Case("canonical last", "the order of the inputs does not matter", (0, 0, 1), confidences),
    Case("no canonical", "no input has the domain of the pass", (0, 0), confidences),
    Case("many inputs", "seven inputs", (1, *(0,) * 6), confidences, columns=2),
    Case("first and last", "u = 0 and u just below 1 beside weights of 0", THREE, ends, u=(0, LAST, 0, LAST)),
    Case(
        "bright",
        "targets times 2^20, weights times 2^-18, J times 2^6",
        THREE,
        scaled(2.0**20, 2.0**-18, 2.0**6),
        columns=2,
    ),
    Case(
        "dark",
        "targets times 2^-20, weights times 2^16, J times 2^-6",
        THREE,
        scaled(2.0**-20, 2.0**16, 2.0**-6),
        columns=2,
    ),
    Case("wide", "targets and weights of one column differ by 2^24", THREE, spread(12), columns=3),
    Case(
        "beyond float32",
        "targets times 2^200, weights times 2^-190: float64 only",
        THREE,
        scaled(2.0**200, 2.0**-190, 2.0**8),
        columns=2,
        float32=False,
    ),
)

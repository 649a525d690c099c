"""The second opinion: one pass in one column, written straight from the papers as a shader would be.

Scalars of any kind: floats, `numpy.float32`, or fractions, which are exact.  A mistake is a subclass.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

Number = Any
FORMULA = {
    "1/Z": "constant",
    "constant, talbot": "constant",
    "counted pairwise": "counted_pairwise",
    "counted defensive": "counted_defensive",
}


def divided(a: Number, b: Number) -> Number:
    """a / b, 0 for b = 0."""
    return a / b if b else 0 * a


@dataclass(frozen=True)
class Column:
    """What a pass reads in one column; lists over inputs, q[i][j] = p_hat_from_j(y_i) off the diagonal."""

    canonical: Sequence[bool]
    p_hat: Sequence[Number]
    W: Sequence[Number]
    J: Sequence[Number]
    c: Sequence[Number]
    own: Sequence[Number]
    q: Sequence[Sequence[Number]]
    cap: Number = None


@dataclass(frozen=True)
class Result:
    """What it writes."""

    m: Sequence[Number]
    w: Sequence[Number]
    w_sum: Number
    s: int
    W_Y: Number
    c_Y: Number


class Shader:
    """The pass; subclasses get one thing wrong."""

    def __init__(self, column: Column, mis: str) -> None:
        self.a, self.mis, self.M = column, mis, range(len(column.W))
        self.R = [i for i in self.M if column.canonical[i]]
        self.others = [i for i in self.M if not column.canonical[i]]

    # ------------------------------------------------------------ what goes in

    def jacobian(self, i: int) -> Number:
        return self.a.J[i]

    def confidence(self, j: int) -> Number:
        c = self.a.c[j]
        return c if self.a.canonical[j] or self.a.cap is None else min(c, self.a.cap)

    def counted(self, j: int) -> Number:
        """The confidence that a weight uses."""
        return self.confidence(j)

    def density(self, i: int, j: int) -> Number:
        """p_hat_from_j(y_i)."""
        if self.a.canonical[j]:
            return self.a.p_hat[i]
        return divided(self.a.own[i], self.a.J[i]) if i == j else self.a.q[i][j]

    # ------------------------------------------------------------ weights

    def m(self, i: int) -> Number:
        q = [self.density(i, j) for j in self.M]
        c = [self.counted(j) for j in self.M]
        return getattr(self, "m_" + FORMULA.get(self.mis, self.mis))(i, q, c)

    def m_constant(self, i: int, q: Any, c: Any) -> Number:
        return divided(c[i], sum(c))

    def m_talbot(self, i: int, q: Any, c: Any) -> Number:
        return divided(c[i] * q[i], sum(c[j] * q[j] for j in self.M))

    def pair(self, j: int, q: Any, c: Any) -> Number:
        return sum(c[r] for r in self.R) * q[self.R[0]] + sum(c[k] for k in self.others) * q[j]

    def m_pairwise(self, i: int, q: Any, c: Any) -> Number:
        if i in self.others:
            return divided(c[i] * q[i], self.pair(i, q, c))
        C_N = sum(c[j] for j in self.others)
        if not C_N:
            return divided(c[i], sum(c))
        return c[i] / C_N * sum(divided(c[j] * q[self.R[0]], self.pair(j, q, c)) for j in self.others)

    def m_defensive(self, i: int, q: Any, c: Any) -> Number:
        C, C_N = sum(c), sum(c[j] for j in self.others)
        if i in self.others:
            return C_N / C * divided(c[i] * q[i], self.pair(i, q, c))
        return c[i] / C * (1 + sum(divided(c[j] * q[self.R[0]], self.pair(j, q, c)) for j in self.others))

    def m_counted_pairwise(self, i: int, q: Any, c: Any) -> Number:
        if not self.others:
            return divided(c[i], sum(c))
        if i in self.others:
            return divided(c[i] * q[i], self.counted_pair(i, q, c))
        return c[i] / len(self.others) * sum(divided(q[self.R[0]], self.counted_pair(j, q, c)) for j in self.others)

    def m_counted_defensive(self, i: int, q: Any, c: Any) -> Number:
        k = len(self.others)
        m = self.m_counted_pairwise(i, q, c) * k / (k + 1)
        return (
            m + divided(c[i], sum(c[r] for r in self.R)) / (k + 1) if i in self.R and k else m if k else c[i] / sum(c)
        )

    def counted_pair(self, j: int, q: Any, c: Any) -> Number:
        return sum(c[r] for r in self.R) * q[self.R[0]] + len(self.others) * c[j] * q[j]

    def correction(self, s: int) -> Number:
        """c_s / m_s, where contribution weights differ."""
        c = [self.counted(j) for j in self.M]
        q = [self.density(s, j) for j in self.M]
        if self.mis == "1/Z":
            q = [0 * each + 1 if each > 0 else 0 * each for each in q]
        elif self.mis != "constant, talbot":
            return 1
        return divided(self.m_talbot(s, q, c), divided(c[s], sum(c)))

    # ------------------------------------------------------------ selection

    def w(self, i: int, m: Number) -> Number:
        return m * self.a.p_hat[i] * self.a.W[i] * self.jacobian(i)

    def total(self, w: Sequence[Number], s: int) -> Number:
        return sum(w)

    def select(self, w: Sequence[Number], u: Number) -> int:
        """Invert the running sum at u."""
        upto, last = 0 * w[0], 0
        for i, each in enumerate(w):
            upto = upto + each
            if each > 0:
                last = i
                if u * sum(w) < upto:
                    return i
        return last

    def stream(self, w: Sequence[Number], u: Sequence[Number]) -> int:
        """Add first, then take the new one if u w_sum < w."""
        upto, s = 0 * w[0], 0
        for i, each in enumerate(w):
            upto = upto + each
            if u[i] * upto < each:
                s = i
        return s

    def W_Y(self, s: int, w_sum: Number) -> Number:
        return self.correction(s) * divided(w_sum, self.a.p_hat[s])

    def c_Y(self) -> Number:
        return sum(self.confidence(j) for j in self.M)

    def run(self, u: Number = 0, streamed: Sequence[Number] = ()) -> Result:
        m = [self.m(i) for i in self.M]
        w = [self.w(i, m[i]) for i in self.M]
        s = self.stream(w, streamed) if len(streamed) else self.select(w, u)
        w_sum = self.total(w, s)
        return Result(m, w, w_sum, s, self.W_Y(s, w_sum), self.c_Y())


# ---------------------------------------------------------------- passes in bulk, as dumps


def scattered_passes(M: int, N: int, canonical: Sequence[bool], rng: np.random.Generator) -> dict[str, Any]:
    """Fields of N random columns: zeros, holes, null samples, unequal confidences."""
    zeros = rng.random((6, M, N)) < 0.15
    p_hat, W, own = (np.where(z, 0, rng.choice([0.25, 0.5, 1, 2, 3], (M, N))) for z in zeros[:3])
    J = np.where(zeros[3], 0, rng.choice([0.5, 1, 2, 4], (M, N)))
    c = rng.integers(1, 6, (M, N)).astype(float)
    q = np.where(rng.random((M, M, N)) < 0.2, 0, rng.choice([0.25, 0.5, 1, 2, 5], (M, M, N)))
    ours = np.asarray(canonical)
    J[ours], own[ours] = 1, p_hat[ours]
    q[:, ours] = p_hat[:, None]
    i = np.arange(M)
    q[i, i] = np.where(ours[:, None], p_hat, np.where(J > 0, own / np.where(J > 0, J, 1), 0))
    return {
        "format": "restir-ref dump", "version": 1, "canonical": ours.astype(int),
        "p_hat": p_hat, "W": W, "J": J, "c": c, "p_hat_own": own, "p_hat_from": q,
    }  # fmt: skip


def column(fields: dict[str, Any], n: int) -> Column:
    """One column of a dump's fields."""
    cap = float(fields["cap"]) if "cap" in fields else None
    names = {"p_hat": "p_hat", "W": "W", "J": "J", "c": "c", "p_hat_own": "own"}
    lists = {ours: fields[theirs][:, n].tolist() for theirs, ours in names.items()}
    return Column([bool(k) for k in fields["canonical"]], **lists, q=fields["p_hat_from"][..., n].tolist(), cap=cap)


def dumped(fields: dict[str, Any], mis: str, shader: type[Shader] = Shader) -> dict[str, Any]:
    """The fields with the results of a shader in every column."""
    N = fields["p_hat"].shape[1]
    u, streamed = fields.get("u", np.zeros(N)), fields.get("u_stream", np.zeros((0, N)))
    runs = [shader(column(fields, n), mis).run(u[n], streamed[:, n]) for n in range(N)]
    results = {
        name: np.array([getattr(run, name) for run in runs]).T for name in ("m", "w", "w_sum", "s", "W_Y", "c_Y")
    }
    return {**fields, "mis": mis, **results}


def converted(a: Column, number: Any) -> Column:
    """The same column in another kind of numbers."""

    def convert(values: Any) -> Any:
        return [convert(v) for v in values] if isinstance(values, (list, tuple)) else number(values)

    changed = {name: convert(getattr(a, name)) for name in ("p_hat", "W", "J", "c", "own", "q")}
    return replace(a, **changed, cap=None if a.cap is None else number(a.cap))

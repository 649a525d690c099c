"""Classic mistakes planted in the shader, each with the pass and the term where it shows first."""

from functools import partial
from typing import Any

import numpy as np

from tests.audit.shader import Shader, divided, scattered_passes

M, N = 3, 60
THREE = (True, False, False)


def fields(canonical=THREE, n: int = N, **more: Any) -> dict[str, Any]:
    rng = np.random.default_rng(5)
    return {**scattered_passes(len(canonical), n, canonical, rng), "u": rng.random(n), **more}


def streamed(**more: Any) -> dict[str, Any]:
    given = fields(**more)
    del given["u"]
    return {**given, "u_stream": np.random.default_rng(6).random(given["p_hat"].shape)}


def lonely(**more: Any) -> dict[str, Any]:
    """Neighbours of confidence 0 in every other column."""
    given = fields(**more)
    given["c"][1:, ::2] = 0
    return given


class OwnWithoutJ(Shader):
    def density(self, i, j):
        return self.a.own[i] if i == j else super().density(i, j)


class NoJ(Shader):
    def jacobian(self, i):
        return 1 if self.a.J[i] else 0


class InverseJ(Shader):
    def jacobian(self, i):
        return divided(1, self.a.J[i])


class SquaredJ(Shader):
    def jacobian(self, i):
        return self.a.J[i] ** 2


class OldTarget(Shader):
    def w(self, i, m):
        return super().w(i, m) if not self.a.p_hat[i] else m * self.a.own[i] * self.a.W[i] * self.a.J[i]


class NullUncounted(Shader):
    def confidence(self, j):
        return super().confidence(j) if self.a.W[j] else 0


class UnlitUncounted(Shader):
    def confidence(self, j):
        dark = j in self.others and not self.a.p_hat[j] * self.a.J[j]
        return 0 if dark else super().confidence(j)


class UnshiftedUncounted(Shader):
    def confidence(self, j):
        return super().confidence(j) if self.a.J[j] else 0


class NeverDivided(Shader):
    def W_Y(self, s, w_sum):
        return super().W_Y(s, w_sum) * self.c_Y()


class ZeroOverZero(Shader):
    def W_Y(self, s, w_sum):
        return super().W_Y(s, w_sum) if self.a.p_hat[s] or w_sum else np.nan


class Undefined(Shader):
    def m(self, i):
        m = super().m(i)
        return m if m or self.a.p_hat[i] else np.nan


class UnitConfidence(Shader):
    def counted(self, j):
        return 1


class CapOnlyBelow(Shader):
    def m_talbot(self, i, q, c):
        return divided(self.a.c[i] * q[i], sum(c[j] * q[j] for j in self.M))


class NoCap(Shader):
    def confidence(self, j):
        return self.a.c[j]


class UndefinedCounts(Shader):
    def m_talbot(self, i, q, c):
        return super().m_talbot(i, [each or q[self.R[0]] for each in q], c)


class Swapped(Shader):
    def pair(self, j, q, c):
        return sum(c[r] for r in self.R) * q[j] + sum(c[k] for k in self.others) * q[self.R[0]]


class HistoryForgotten(Shader):
    def m_talbot(self, i, q, c):
        return super().m_talbot(i, [q[j] if j in self.R or i in self.others else 0 for j in self.M], c)


class OneOverM(Shader):
    def correction(self, s):
        return 1


class AllInputs(Shader):
    def correction(self, s):
        return divided(self.m_constant(s, None, [self.counted(j) for j in self.M]), self.m(s))


class NoM(Shader):
    def m(self, i):
        return 1


class GrownFromZero(Shader):
    def m(self, i):
        return super().m(i) if i in self.others or any(self.confidence(j) for j in self.others) else 0


class OwnNotCounted(Shader):
    def divisor(self):
        return sum(self.confidence(j) for j in self.others) or self.c_Y()

    def m(self, i):
        return divided(super().m(i) * self.c_Y(), self.divisor())


class OwnNotCountedLate(OwnNotCounted):
    def m(self, i):
        return Shader.m(self, i) * self.c_Y()

    def W_Y(self, s, w_sum):
        return divided(super().W_Y(s, w_sum), self.divisor())


class DividedByM(Shader):
    def W_Y(self, s, w_sum):
        return super().W_Y(s, w_sum) / len(self.M)


class DividedByC(Shader):
    def W_Y(self, s, w_sum):
        return super().W_Y(s, w_sum) / self.c_Y()


class OneOverTarget(Shader):
    def W_Y(self, s, w_sum):
        return divided(1, self.a.p_hat[s]) if w_sum else 0


class NotDivided(Shader):
    def W_Y(self, s, w_sum):
        return w_sum


class SelectedW(Shader):
    def W_Y(self, s, w_sum):
        return self.a.W[s] if w_sum else 0


class SelectedWJ(Shader):
    def W_Y(self, s, w_sum):
        return self.a.W[s] * self.a.J[s] if w_sum else 0


class StoredTarget(Shader):
    def W_Y(self, s, w_sum):
        return divided(w_sum, self.a.own[s])


class SumOnAccept(Shader):
    def total(self, w, s):
        return sum(w[: s + 1])


class LastMissing(Shader):
    def total(self, w, s):
        return sum(w[:-1])


class FirstMissing(Shader):
    def total(self, w, s):
        return sum(w[1:])


class OldSum(Shader):
    def stream(self, w, u):
        s, before = 0, w[0]
        for i in range(1, len(w)):
            if w[i] and u[i] * before < w[i]:
                s = i
            before = before + w[i]
        return s


class Mirrored(Shader):
    def select(self, w, u):
        return super().select(w, 1 - u)


class LateDivision(Shader):
    def m(self, i):
        return super().m(i) * self.c_Y()

    def W_Y(self, s, w_sum):
        return divided(super().W_Y(s, w_sum), self.c_Y())


class CountsAlive(Shader):
    def c_Y(self):
        return sum(self.confidence(j) for j in self.M if self.a.W[j])


class CountsInputs(Shader):
    def c_Y(self):
        return len(self.M)


class NotCapped(Shader):
    def c_Y(self):
        return sum(self.a.c)


class CappedTwice(Shader):
    def c_Y(self):
        return super().c_Y() if self.a.cap is None else min(super().c_Y(), self.a.cap)


capped = partial(fields, cap=2.0)
PLANTED = {
    "own MIS term without its Jacobian": (OwnWithoutJ, "talbot", fields, "m"),
    "J left out of w": (NoJ, "defensive", fields, "w"),
    "J inverted in w": (InverseJ, "1/Z", fields, "w"),
    "J squared in w": (SquaredJ, "talbot", fields, "w"),
    "p_hat_i(X_i) in w, the target not evaluated anew": (OldTarget, "talbot", fields, "w"),
    "null samples have confidence 0": (NullUncounted, "talbot", fields, "m"),
    "inputs that are black here are not counted in M": (UnlitUncounted, "talbot", fields, "m"),
    "inputs whose shift fails are not counted in M": (UnshiftedUncounted, "talbot", fields, "m"),
    "confidences not multiplied in": (UnitConfidence, "talbot", fields, "m"),
    "history not capped": (NoCap, "talbot", capped, "m"),
    "cap only in the denominator": (CapOnlyBelow, "talbot", capped, "m"),
    "undefined shifts count in MIS": (UndefinedCounts, "talbot", fields, "m"),
    "pairwise targets swapped": (Swapped, "pairwise", fields, "m"),
    "history left out of the canonical weight": (HistoryForgotten, "talbot", fields, "m"),
    "1/M, contribution weight included": (OneOverM, "1/Z", fields, "W_Y"),
    "contribution weights over all inputs": (AllInputs, "talbot", fields, "W_Y"),
    "no m in w": (NoM, "talbot", fields, "m"),
    "canonical weight 0 without neighbours": (GrownFromZero, "pairwise", lonely, "m"),
    "own samples not counted in C": (OwnNotCounted, "constant", fields, "m"),
    "own samples not counted in the C that divides W_Y": (OwnNotCountedLate, "constant", fields, "W_Y"),
    "W_Y divided by M once more": (DividedByM, "pairwise", fields, "W_Y"),
    "W_Y divided by the sum of confidences once more": (DividedByC, "defensive", fields, "W_Y"),
    "the sum is never divided by M (the sum of confidences)": (NeverDivided, "talbot", fields, "W_Y"),
    "W_Y = 0/0 of null samples: test the target before dividing by it": (ZeroOverZero, "talbot", fields, "W_Y"),
    "m = 0/0 where nobody can make the sample: test the sum before dividing": (Undefined, "talbot", fields, "m"),
    "W_Y = 1 / p_hat(y)": (OneOverTarget, "talbot", fields, "W_Y"),
    "W_Y = sum w, not divided by p_hat(y)": (NotDivided, "talbot", fields, "W_Y"),
    "W_Y = W_s": (SelectedW, "talbot", fields, "W_Y"),
    "W_Y = W_s J_s": (SelectedWJ, "talbot", fields, "W_Y"),
    "W_Y = sum w / p_hat_s(X_s)": (StoredTarget, "talbot", fields, "W_Y"),
    "W_Y without c_s / m_s": (OneOverM, "1/Z", fields, "W_Y"),
    "the sum grows only when a candidate is taken": (SumOnAccept, "talbot", streamed, "w_sum"),
    "the last weight is missing in the sum": (LastMissing, "talbot", fields, "w_sum"),
    "the first weight is missing in the sum": (FirstMissing, "talbot", fields, "w_sum"),
    "u compared with the sum before the new weight": (OldSum, "talbot", streamed, "s"),
    "c_Y counts samples that are not null": (CountsAlive, "talbot", fields, "c_Y"),
    "c_Y counts inputs, not confidences": (CountsInputs, "talbot", fields, "c_Y"),
}

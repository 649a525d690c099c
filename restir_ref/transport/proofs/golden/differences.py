"""What pairs of pixels are made of, as the files of golden vectors have it: differences, their parts, and a pass.

The pair (i, j) is one integral; a base path on side 0 lives in i, one on side 1 in j, and its offset path in the other.
Rows named `sign` are the positive part and the negative one.  [GPT 3-4]
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from restir_ref.batch import Array, entry, ratio, take
from restir_ref.gradient import SIGNS, Paired, Pairs, gap, omega
from restir_ref.integrals import Pixels, Reservoirs, shifted
from restir_ref.resampling import Input
from restir_ref.transport.paths import Path, Tracer
from restir_ref.transport.proofs.golden.resampled import MIS, landed_in, resampled
from restir_ref.transport.restir_pt import PathIntegrals

Terms = dict[str, Any]

CONFIDENCES = (1.0, 4.0, 2.0)
"""Of the three inputs of a pass, the canonical one first."""

ENDS = ((0, 1), (2, 0), (2, 1))
"""The pairs of the three inputs, by their places among three pixels."""

BASES = (0, 2, 1)
"""Which of three base paths each input has."""

SIDES = (0, 0, 1)
"""On which side of its pair it lives: the third one is in its pair's second pixel."""


def pairs(t: Tracer, x: Path, pixel: Array, to: Array) -> Terms:
    """Of the pairs (pixel, to) with base paths x on side 0: w_ij, f_i - f_j J, and the parts of their product.

    [GPT Eq. 2, 13, 16, 25-26]
    """
    of = PathIntegrals(t)
    base, offset = Pixels(of, pixel), Pixels(of, to)
    y = shifted(x, base, offset)
    w, G = omega(x, base, y, offset), gap(x, base, y, offset)
    return {"omega": w, "gap": G, **parts(w * G)}


def parts(d: Array) -> Terms:
    """p_hat, the share of d and the contribution of both signs of d (C, N): (2, N), (2, N), (2, C, N)."""
    both = [*SIGNS.values()]
    share = np.stack([part.share(d) for part in both])
    return {"p_hat": np.stack([part.target(d) for part in both]), "share": share, "contribution": share[:, None] * d}


# ---------------------------------------------------------------- a pass


@dataclass(frozen=True, eq=False)
class Three:
    """Base paths x[i] (P,) of three pixels (3, P), all shifts between which are clear."""

    t: Tracer
    x: list[Path]
    pixel: Array

    @property
    def P(self) -> int:
        """Number of passes."""
        return int(self.pixel.shape[1])

    def pair(self, sign: str, i: int) -> Pixels:
        """The pair of input i in all passes, as the integrals of one sign."""
        return Pixels(Pairs(PathIntegrals(self.t), self.pixel[list(ENDS[i])], SIGNS[sign]), np.arange(self.P))

    def inputs(self, sign: str) -> list[Input]:
        """One base path per input with its offset path; W = 1/4, 1/2, 3/4, or 0 where it is not of that sign."""
        found = []
        for i, (row, side, c) in enumerate(zip(BASES, SIDES, CONFIDENCES, strict=True)):
            at = self.pair(sign, i)
            x = at.of.paired(at.index, self.x[row], np.full(self.P, side))  # type: ignore[attr-defined]
            W = np.where(at.of.target(at.index, x) > 0, (i + 1) / 4, 0)
            found.append(Input(Reservoirs(x, W, np.full(self.P, c)), at))
        return found


def one_pass(t: Tracer, x: Path, pixel: Array, passes: Array) -> Terms:
    """Pairs reuse pairs: x[passes] (3, P) of the shifts' base paths x (M,) in `pixel` (M,), into the first pair.

    (i, j) = (p_0, p_1) is the canonical pair, with base path 0 on side 0; (p_2, p_0) offers base path 2 on side 0 and
    (p_2, p_1) base path 1 on side 1.  Both signs resample the same.  [GPT Eq. 18-26]
    """
    three = Three(t, [take(x, row) for row in passes], pixel[passes])
    signs = [_of_sign(three, sign) for sign in SIGNS]
    found = {name: np.stack([each[name] for each in signs]) for name in signs[0]}
    return {
        "mis": MIS,
        "canonical": [1, 0, 0],
        "c": np.stack([np.full(three.P, c) for c in CONFIDENCES]),
        **_landed(three),
        **found,
        "difference": found["estimate"].sum(axis=0),
    }


def _landed(three: Three) -> Terms:
    """What all signs have in common: y_i = T* x_i in the first pair with J*, its offset path's J, w, and w G."""
    inputs = three.inputs("positive")
    here = inputs[0].at
    ys, Js = zip(*[landed_in(each, here) for each in inputs], strict=True)
    inner, w, d = zip(*[_difference(y, here) for y in ys], strict=True)
    J = np.stack(Js)
    there = J > 0
    return {
        "J": J,
        "J_offset": np.where(there, inner, 0),
        "omega": np.where(there, w, 0),
        "signed": np.where(there[:, None], d, 0),
    }


def _difference(y: Paired, here: Pixels) -> tuple[Array, Array, Array]:
    """J of the offset path, w, and w G with its sign."""
    of: Any = here.of
    base, other = of.end(here.index, y.k), of.end(here.index, 1 - y.k)
    return y.offset.J, omega(y.x, base, y.offset, other), of.difference(here.index, y)


def _of_sign(three: Three, sign: str) -> Mapping[str, Array]:
    """The terms of one sign's reservoir."""
    inputs = three.inputs(sign)
    here = inputs[0].at
    found = resampled(inputs)
    f = np.stack([here.of.contribution(here.index, landed_in(each, here)[0]) for each in inputs])
    return {**found, "estimate": np.where(found["W_Y"] > 0, entry(f, found["s"]) * found["W_Y"], 0)}


def doubt(d: Array, like: Array) -> Array:
    """How far from 0 the mean of d (C, N) is, as a share of a base path's light; inf where it has none; (N,)."""
    return np.where(like > 0, ratio(abs(d.mean(axis=0)), like), np.inf)


def margin_of_pairs(t: Tracer, x: Path, pixel: Array, to: Array) -> Array:
    """By which share the differences of the pairs (pixel, to) are of their sign; (M,)."""
    d = pairs(t, x, pixel, to)["contribution"].sum(axis=0)
    return doubt(d, PathIntegrals(t).target(pixel, x))


def margin_of_signs(t: Tracer, x: Path, pixel: Array, passes: Array) -> Array:
    """Least share by which the differences of a pass, in any of its pairs, are of their sign; (P,)."""
    three = Three(t, [take(x, row) for row in passes], pixel[passes])
    found = [np.full(three.P, np.inf)]
    inputs = three.inputs("positive")
    for source in inputs:
        for target in inputs:
            y, J = (source.X.x, np.ones(three.P)) if source is target else landed_in(source, target.at)
            of: Any = target.at.of
            d = of.difference(target.at.index, y)
            light = of.of.target(of.end(target.at.index, y.k).index, y.x)
            found.append(np.where(J > 0, doubt(d, light), np.inf))
    return np.asarray(np.min(found, axis=0))

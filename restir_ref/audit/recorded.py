"""A recorded pass, computed again by the same `weigh`, `select` and `gris` that render.

Recorded samples have no geometry any more, only numbers: `Recorded` integrals look up targets and
Jacobians where others would evaluate and shift.  A sample is the number i of the input it came from;
place 0 is where the pass selects, place j + 1 the domain of input j.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from restir_ref.audit.engines import ASKED, KNOWN
from restir_ref.audit.given import at
from restir_ref.batch import Array
from restir_ref.chance import Chance
from restir_ref.integrals import Pixels, Reservoirs, Shifted
from restir_ref.mis import ALL_CANONICAL, ANY, Confidences, Density, Weights
from restir_ref.resampling import Candidate, Input, gris, weigh
from restir_ref.restir import capped
from restir_ref.streaming import select_streaming

GIVEN = "given"
"""The name of weights that come with the dump and are not judged."""

BELOW_ONE = float(np.nextafter(1, 0))


@dataclass(frozen=True, eq=False)
class Pass:
    """One pass over N columns with M inputs each, as its engine saw it.

    mis        name of the weights: one of KNOWN, or GIVEN
    canonical  (M,)       which inputs have the domain of the pass
    p_hat      (M, N)     p_hat(y_i), the target of the shifted sample where the pass selects
    W, J, c    (M, N)     weights W_i, Jacobians J_i (0: shift undefined), confidences before capping
    p_hat_own  (M, N)     p_hat_i(X_i), the target of the sample where it came from
    p_hat_back (M, M, N)  [i, j]: p_hat_j(T_j^-1 y_i); diagonal and canonical j are not read
    J_back     (M, M, N)  [i, j]: |dT_j^-1/dy| at y_i, 0 where undefined; likewise
    cap        confidences of inputs that are not canonical are capped here
    u          numbers in [0, 1) that select: one (N,) for all inputs, or one per input, streaming
    s          the selected input (N,), where recorded
    m          (M, N)     the weights, where GIVEN
    blur       u may be off by this much
    k          neighbours asked for, where the weights count those
    """

    mis: str
    canonical: Array
    p_hat: Array
    W: Array
    J: Array
    c: Array
    p_hat_own: Array
    p_hat_back: Array
    J_back: Array
    cap: float = np.inf
    u: Sequence[Array] = ()
    s: Array | None = None
    m: Array | None = None
    blur: float = 0
    k: float | None = None

    @property
    def rated(self) -> bool:
        """Whether the densities of other inputs are known, which not all weights need."""
        return not bool(np.isnan(self.p_hat_own).any())


@dataclass(frozen=True, eq=False)
class Terms:
    """What a pass `of` inputs computes: m, w (M, N); w_sum, s, W_Y, c_Y (N,); and whether u is `clear` about s (N,)."""

    of: Pass
    m: Array
    w: Array
    w_sum: Array
    s: Array
    W_Y: Array
    c_Y: Array
    clear: Array


@dataclass(frozen=True, eq=False)
class Recorded:
    """Integrals that look everything up: targets (M, 1 + M, N) of input i's sample at every place, Jacobians to it."""

    targets: Array
    jacobians: Array

    @property
    def n(self) -> int:
        """Number of columns; index = place * n + column."""
        return int(self.targets.shape[-1])

    def candidates(self, index: Array, chance: Chance) -> Iterator[tuple[Array, Array]]:
        """None: a recorded pass draws no new samples."""
        yield from ()

    def target(self, index: Array, x: Array) -> Array:
        """p_hat of sample x at the place of each index."""
        place, column = np.divmod(index, self.n)
        return np.asarray(self.targets[x, place, column])

    def contribution(self, index: Array, x: Array) -> Array:
        """f = p_hat, (1, N)."""
        return self.target(index, x)[None]

    def shift(self, x: Array, index: Array, to: Pixels) -> Shifted:
        """The same sample at another place."""
        place, column = np.divmod(to.index, self.n)
        return Shifted(x, np.asarray(self.jacobians[x, place, column]))


def weights_of(p: Pass) -> Weights:
    """The weights that a pass says it uses."""
    if p.mis != GIVEN:
        known = KNOWN[p.mis]
        return known if p.k is None or p.mis not in ASKED else replace(known, m=ASKED[p.mis](p.k))
    m = np.asarray(p.m)
    return Weights(lambda i, q, c: m[i])


@dataclass
class Deciding:
    """Chance of one selection: the recorded s, or what the recorded numbers select.  It keeps the weights w (M, N)."""

    p: Pass
    w: Array = field(default_factory=lambda: np.empty(0))
    clear: Array = field(default_factory=lambda: np.empty(0))

    def choose(self, weights: Array) -> Array:
        """s (N,), beyond doubt where u moved by its blur selects the same."""
        self.w, (s, low, high) = weights, (self._choices(by) for by in (0, -self.p.blur, self.p.blur))
        self.clear = low == high
        return s

    def _choices(self, by: float) -> Array:
        N = self.w.shape[-1]
        if self.p.s is not None:
            return self.p.s
        if not self.p.u:
            return np.zeros(N, dtype=int)
        return chosen(self.w, [np.clip(u + by, 0, BELOW_ONE) for u in self.p.u])

    def uniform(self, shape: tuple[int, ...]) -> Array:
        """Refused: a selection draws no uniform numbers."""
        raise TypeError("a recorded pass draws no uniform numbers.")


def chosen(w: Array, u: Sequence[Array]) -> Array:
    """What numbers select: by inversion of the running sum at one (N,), or streaming with one (N,) per input.

    Streaming takes a new candidate if u w_sum < w, as GPU code does; ours inverts [old, new] at 1 - u.
    """
    if len(u) == 1:
        return at(u).choose(w)
    one = np.ones(u[0].shape)
    candidates = [Candidate(np.full(len(one), i), each, one) for i, each in enumerate(w)]
    return np.asarray(select_streaming(candidates, at([1 - each for each in u[1:]]), one).x)


def recompute(p: Pass, mis: Weights) -> Terms:
    """All terms of a pass with these weights.  [GRIS Eq. 19-22, 35]"""
    inputs, here = reservoirs(p)
    m: list[Array] = []

    def noted(i: int, q: Density, c: Confidences) -> Array:
        m.append(mis.m(i, q, c))
        return m[-1]

    chance = Deciding(p)
    promise = ALL_CANONICAL if mis.unbiased_for == ANY else mis.unbiased_for  # a dump may have lost samples
    Y = gris(inputs, here, replace(mis, m=noted, unbiased_for=promise), chance)
    return Terms(p, np.stack(m), chance.w, chance.w.sum(axis=0), Y.x, Y.W, Y.c, chance.clear)


def reservoirs(p: Pass) -> tuple[list[Input], Pixels]:
    """The inputs of a recorded pass, and where it selects."""
    M, N = p.p_hat.shape
    to_input = np.where(np.eye(M, dtype=bool)[..., None], p.p_hat_own[:, None], p.p_hat_back)
    of = Recorded(
        np.concatenate([p.p_hat[:, None], to_input], axis=1), np.concatenate([p.J[:, None], p.J_back], axis=1)
    )
    column = np.arange(N)
    here = Pixels(of, column)
    inputs = []
    for i in range(M):
        X = Reservoirs(np.full(N, i), p.W[i], p.c[i])
        inputs.append(Input(X, here) if p.canonical[i] else Input(capped(X, p.cap), Pixels(of, (i + 1) * N + column)))
    return inputs, here


def densities(p: Pass) -> Array:
    """p_hat_from_j(y_i) for all i, j as `weigh` asks for them, (M, M, N)."""
    inputs, here = reservoirs(p)
    rows: list[Array] = []

    def asked(i: int, q: Density, c: Confidences) -> Array:
        rows.append(np.stack([q(j) for j in range(len(c))]))
        return c[i]

    list(weigh(inputs, here, Weights(asked, unbiased_for=ALL_CANONICAL)))
    return np.stack(rows)

"""Is somebody's estimator unbiased?  Enumerated, so the answer is a number per cell, not an average over noise.

Definition 4.1 in full: E[W 1{X = x}] = v(x) in every cell of the support, 0 elsewhere, which is
E[f(X) W] = int f for all f at once.  [GRIS Def. 4.1]
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from restir_ref.audit.likeness import Lookalike, lookalikes, signatures
from restir_ref.audit.rehearsal import Estimator, checked, rehearse
from restir_ref.batch import Array, ratio
from restir_ref.integrals import Reservoirs
from restir_ref.oracle.enumeration import MOST_LEAVES, Enumerating
from restir_ref.oracle.laws import bias_per_cell, expected_weight
from restir_ref.oracle.scenes import Scene

TOLERANCE = 1e-9
"""Rounding, generously: a larger bias is one."""


@dataclass(frozen=True, eq=False)
class EstimatorReport:
    """The exact bias of an estimator.

    bias     (n, K)  E[W 1{X = x}] / v(x) minus 1 in cells of the support: relative; minus 0 elsewhere
    support  (n, K)  where p_hat > 0
    mean     (n,)    E[f(X) W] / int f minus 1, all that a mean test sees
    leaves           how many outcomes were enumerated
    lookalikes       bugs of the zoo with the same signature, none if unbiased
    """

    bias: Array
    support: Array
    mean: Array
    leaves: int
    tolerance: float
    lookalikes: Sequence[Lookalike]

    @property
    def unbiased(self) -> bool:
        """No cell is biased by more than rounding."""
        return abs(self.worst[2]) <= self.tolerance

    @cached_property
    def worst(self) -> tuple[int, int, float]:
        """Pixel, cell and bias of the most biased cell."""
        pixel, cell = np.unravel_index(abs(self.bias).argmax(), self.bias.shape)
        return int(pixel), int(cell), float(self.bias[pixel, cell])

    def __str__(self) -> str:
        return "\n".join([_verdict(self), *_table(self), *_named(self)])


def audit_estimator(
    estimator: Estimator, scene: Scene, *, most_leaves: int = MOST_LEAVES, tolerance: float = TOLERANCE
) -> EstimatorReport:
    """Exact bias per pixel and cell of `estimator(index, chance)` on the last frame of a finite scene.

    The estimator returns cells x (N,) and weights W (N,), as `Reservoirs`, for the columns
    `index` (N,) = lane * n + pixel, and draws everything by `chance.choose(weights)`, weights (options, N).
    Raises CannotAudit, a ValueError, if it does not, and ValueError with an estimate of the number of
    leaves if there are more than `most_leaves`.
    """
    n, K = scene.v.shape
    rehearse(estimator, scene.v)
    leaves: list[int] = []

    def program(index: Array, chance: Enumerating) -> Reservoirs:
        X = checked(estimator(index, chance), len(index), K)
        leaves.append(len(index) // n)
        return X

    E = expected_weight(program, scene.v, most_leaves=most_leaves)
    bias = bias_per_cell(E, scene.v, scene.support)
    alike = lookalikes(bias, signatures(scene, tolerance), tolerance) if abs(bias).max() > tolerance else ()
    return EstimatorReport(bias, scene.support, _mean_bias(E, scene), sum(leaves), tolerance, alike)


def _mean_bias(E: Array, scene: Scene) -> Array:
    """E[f(X) W] / int f - 1 over the support, per pixel (n,); 0 where nothing is to be found."""
    f = scene.now.cells.f[scene.now.ids(np.arange(scene.now.n))]
    truth = np.where(scene.support, f * scene.v, 0).sum(axis=-1)
    return np.asarray(ratio((f * E).sum(axis=-1) - truth, truth))


def _verdict(report: EstimatorReport) -> str:
    pixel, cell, bias = report.worst
    exactly = f"exact over {report.leaves} outcomes"
    if report.unbiased:
        return f"unbiased in every cell: largest relative error {abs(bias):.1e}, {exactly}"
    return f"BIASED: {bias:+.2%} in cell {cell} of pixel {pixel}, {exactly}"


def _table(report: EstimatorReport) -> list[str]:
    """One line per pixel: the bias of the mean, then of every cell."""
    rows = [f"{'':7} {'mean':>9} | bias per cell (in brackets: outside of the support, E[W 1{{X=x}}] / v)"]
    mean_bias, cell_bias = (np.where(abs(b) > report.tolerance, b, 0) for b in (report.mean, report.bias))
    for pixel, (mean, bias, inside) in enumerate(zip(mean_bias, cell_bias, report.support, strict=True)):
        cells = " ".join(f"{b:+9.2%}" if i else f"({b:+7.2f})" for b, i in zip(bias, inside, strict=True))
        rows.append(f"pixel {pixel} {mean:+9.2%} | {cells}")
    return rows


def _named(report: EstimatorReport) -> list[str]:
    if report.unbiased:
        return []
    if not report.lookalikes:
        return ["no bug of the zoo has this signature on this scene"]
    return ["same signature in the bug zoo:", *(f"  {each}" for each in report.lookalikes)]

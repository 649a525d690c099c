"""Is somebody's estimator unbiased, and does it pay?  Enumerated, so answers are exact, not averages over noise.

Definition 4.1 in full: E[W 1{X = x}] = v(x) in every cell of the support, 0 elsewhere, which is
E[f(X) W] = int f for all f at once.  [GRIS Def. 4.1]  Where it fails, the same estimator is run again on changed
scenes, which tells what its bias needs, and so where in its code to look.
"""

import textwrap
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from restir_ref.audit.advice import advice
from restir_ref.audit.changes import CHANGES, SCALES
from restir_ref.audit.facts import Facts, Moments, examined, fixed_draws, moments, read
from restir_ref.audit.known import known_signatures, needing_the_same
from restir_ref.audit.likeness import Lookalike, lookalikes
from restir_ref.audit.rehearsal import Estimator, checked, rehearse
from restir_ref.batch import Array, ratio
from restir_ref.chance import Chance
from restir_ref.integrals import Pixels, Reservoirs
from restir_ref.oracle.enumeration import MOST_LEAVES
from restir_ref.oracle.laws import bias_per_cell
from restir_ref.oracle.scenes import Scene
from restir_ref.restir import initial

TOLERANCE = 1e-9
"""Rounding, generously: a larger bias is one."""

FEW_TO_RERUN = 50_000
"""Estimators with more outcomes are not run again on changed scenes."""

WIDTH = 120
"""Advice is broken into lines of so many characters."""


@dataclass(frozen=True, eq=False)
class EstimatorReport:
    """The exact bias of an estimator, its variance, and what both depend on.

    bias        (n, K)  E[W 1{X = x}] / v(x) minus 1 in cells of the support: relative; minus 0 elsewhere
    support     (n, K)  where p_hat > 0
    mean        (n,)    E[f(X) W] / int f minus 1, all that a mean test sees
    variance    (n,)    Var[p_hat(X) W] over that of one new sample of `restir.initial`, the estimator without reuse
    reused              whether other pixels or earlier frames change any result; None if there was no time to try
    leaves              how many outcomes were enumerated
    lookalikes          bugs of the zoo with exactly this table, none if unbiased
    needs               names of `CHANGES` that leave no bias
    look_at             where in the code to look, most telling first
    kin                 bugs of the zoo that need the same
    """

    bias: Array
    support: Array
    mean: Array
    variance: Array
    reused: bool | None
    leaves: int
    tolerance: float
    lookalikes: Sequence[Lookalike] = ()
    needs: Sequence[str] = ()
    stays: Sequence[str] = ()
    look_at: Sequence[str] = ()
    kin: Sequence[str] = ()

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
        return "\n".join([_verdict(self), *_advice(self), *_table(self), *_noise(self), *_needs(self), *_named(self)])


def audit_estimator(
    estimator: Estimator, scene: Scene, *, most_leaves: int = MOST_LEAVES, tolerance: float = TOLERANCE
) -> EstimatorReport:
    """Exact bias per pixel and cell of `estimator(index, chance)` on the last frame of a finite scene.

    The estimator returns cells x (N,) and weights W (N,), as `Reservoirs`, for the columns
    `index` (N,) = lane * n + pixel, and draws everything by `chance.choose(weights)`, weights (options, N).
    Raises CannotAudit, a ValueError, if it does not, and ValueError with an estimate of the number of
    leaves if there are more than `most_leaves`.

    >>> from restir_ref import Pixels, initial
    >>> from restir_ref.audit import audit_estimator
    >>> from restir_ref.oracle.scenes import offset, reference_scene
    >>> scene = reference_scene()
    >>> right = audit_estimator(lambda index, chance: initial(Pixels(scene.now, index), chance), scene)
    >>> wrong = audit_estimator(lambda index, chance: initial(offset(scene.now, index, 1), chance), scene)
    >>> right.unbiased, wrong.unbiased  # the second takes the neighbour's sample without a shift
    (True, False)
    >>> print(str(wrong).splitlines()[0])
    BIASED: +300.00% in cell 2 of pixel 0, exact over 16 outcomes
    """
    whole = _whole(estimator, scene)
    asked = rehearse(estimator, scene.v)
    of = moments(whole, scene, most_leaves)
    bias = bias_per_cell(of.first, scene.v, scene.support)
    known = Facts(scene, of, bias, fixed_draws(asked, len(scene.v)))
    said = (bias, scene.support, _mean_bias(of.first, scene), _relative_variance(of, scene))
    few = of.leaves <= FEW_TO_RERUN
    if abs(bias).max() <= tolerance:
        reused = any(read(whole, scene, known, most_leaves)) if few else None
        return EstimatorReport(*said, reused, of.leaves, tolerance)
    alike = lookalikes(bias, known_signatures(scene, tolerance), tolerance)
    if not few:
        return EstimatorReport(*said, None, of.leaves, tolerance, alike, look_at=tuple(advice(known)))
    facts = examined(whole, scene, known, most_leaves)
    reused, where = facts.neighbours or facts.history, tuple(advice(facts))
    kin = () if alike else needing_the_same(facts)
    return EstimatorReport(*said, reused, of.leaves, tolerance, alike, facts.gone, facts.stays, where, kin)


def facts_of(estimator: Estimator, scene: Scene, most_leaves: int) -> Facts:
    """All facts about an estimator, biased or not; raises like `audit_estimator`."""
    whole = _whole(estimator, scene)
    of = moments(whole, scene, most_leaves)
    bias = bias_per_cell(of.first, scene.v, scene.support)
    known = Facts(scene, of, bias, fixed_draws(rehearse(estimator, scene.v), len(scene.v)))
    return examined(whole, scene, known, most_leaves)


def _whole(estimator: Estimator, scene: Scene) -> Estimator:
    """The estimator, whose results are checked."""
    K = scene.v.shape[-1]
    return lambda index, chance: checked(estimator(index, chance), len(index), K)


def _mean_bias(E: Array, scene: Scene) -> Array:
    """E[f(X) W] / int f - 1 over the support, per pixel (n,); 0 where nothing is to be found."""
    f = scene.now.cells.f[scene.now.ids(np.arange(scene.now.n))]
    truth = np.where(scene.support, f * scene.v, 0).sum(axis=-1)
    return np.asarray(ratio((f * E).sum(axis=-1) - truth, truth))


def _relative_variance(of: Moments, scene: Scene) -> Array:
    """Var[p_hat(X) W] over that of one new sample, per pixel (n,); 1 where neither has any."""

    def new(index: Array, chance: Chance) -> Reservoirs:
        return initial(Pixels(scene.now, index), chance)

    alone = moments(new, scene, MOST_LEAVES).variance(scene.p_hat)
    ours = of.variance(scene.p_hat)
    tiny = TOLERANCE * np.maximum(1, (scene.p_hat * scene.v).sum(axis=-1) ** 2)
    return np.asarray(np.where(alone > tiny, ratio(ours, alone), np.where(ours > tiny, np.inf, 1)))


def _verdict(report: EstimatorReport) -> str:
    pixel, cell, bias = report.worst
    exactly = f"exact over {report.leaves} outcomes"
    if report.unbiased:
        return f"unbiased in every cell{_but(report)}: largest relative error {abs(bias):.1e}, {exactly}"
    return f"BIASED: {bias:+.2%} in cell {cell} of pixel {pixel}, {exactly}"


def _but(report: EstimatorReport) -> str:
    """What is wrong with an unbiased estimator."""
    inert = ", and nothing is reused" if report.reused is False else ""
    if report.variance.max() > 1 + TOLERANCE:
        return f"{inert}, but noisier than new samples alone in pixel {int(report.variance.argmax())}"
    return inert


def _noise(report: EstimatorReport) -> Iterator[str]:
    """How the variance of the image compares with no reuse."""
    if not report.unbiased:
        return
    each = ", ".join(f"{value:.2f} in pixel {pixel}" for pixel, value in enumerate(report.variance))
    yield f"variance, over that of one new sample per pixel: {each}, exact"
    if report.reused is False:
        yield from textwrap.wrap(
            "no other pixel and no earlier frame changes any result: right for new samples; a pass of reuse that does "
            "this is inert: every neighbour is refused, or the result is not written back",
            WIDTH,
        )
    elif report.reused and report.variance.max() > 1 + TOLERANCE:
        yield "what to do when reuse does not pay: docs/when-reuse-pays.md"


def _advice(report: EstimatorReport) -> Iterator[str]:
    """Where to look, one paragraph each."""
    for k, text in enumerate(report.look_at):
        head = "look first at " if k == 0 else "then at "
        yield from textwrap.wrap(head + text, WIDTH, subsequent_indent="    ")


def _table(report: EstimatorReport) -> list[str]:
    """One line per pixel: the bias of the mean, then of every cell."""
    rows = [f"{'':7} {'mean':>9} | bias per cell (in brackets: outside of the support, E[W 1{{X=x}}] / v)"]
    mean_bias, cell_bias = (np.where(abs(b) > report.tolerance, b, 0) for b in (report.mean, report.bias))
    for pixel, (mean, bias, inside) in enumerate(zip(mean_bias, cell_bias, report.support, strict=True)):
        cells = " ".join(f"{b:+9.2%}" if i else f"({b:+7.2f})" for b, i in zip(bias, inside, strict=True))
        rows.append(f"pixel {pixel} {mean:+9.2%} | {cells}")
    return rows


def _needs(report: EstimatorReport) -> Iterator[str]:
    """What became of the bias on changed scenes."""
    if report.unbiased:
        return
    if not (report.needs or report.stays):
        yield f"more than {FEW_TO_RERUN} outcomes: not run again on changed scenes; take fewer passes or cells"
        return
    yield "the same estimator on scenes in which one thing is absent:"
    stays = [name for name in report.stays if name not in SCALES]
    for head, names in (("no bias without", report.needs), ("still biased without", stays)):
        said = "; ".join(CHANGES[name].absent for name in names) or "-"
        yield from textwrap.wrap(f"  {head}: {said}", WIDTH, subsequent_indent="    ")


def _named(report: EstimatorReport) -> list[str]:
    if report.unbiased:
        return []
    if report.lookalikes:
        return ["same signature in the bug zoo:", *(f"  {each}" for each in report.lookalikes)]
    if not report.kin:
        return ["no bug of the zoo has this signature on this scene"]
    kin = ", ".join(f'"{name}"' for name in report.kin)
    said = f"no bug of the zoo has this signature on this scene; bugs that need the same: {kin}"
    return textwrap.wrap(said, WIDTH, subsequent_indent="    ")

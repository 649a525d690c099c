"""Methods side by side: the same rays or the same time for each, their errors, and maps of them."""

import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from restir_ref.batch import Array
from restir_ref.metrics import MAP, mape, rel_mse, rmse
from restir_ref.transport.counting import counted, rays
from tracer3d.files import exposure, tone
from tracer3d.methods import METHODS
from tracer3d.render import Chances, Job, Picture, blank, render

FRAMES = 100_000
"""More than any budget allows."""


@dataclass(frozen=True)
class Budget:
    """What every method may spend: rays per pixel, or seconds of CPU time; whichever is first ends it."""

    rays: float = np.inf
    seconds: float = np.inf


@dataclass(frozen=True, eq=False)
class Row:
    """What one method has made of its budget."""

    method: str
    picture: Picture
    rays: float
    seconds: float


def spend(job: Job, budget: Budget, chances: Chances, clock: Callable[[], float] = time.process_time) -> Iterator[Row]:
    """The row after every frame, until the budget is spent; one frame at least."""
    asked = Counter[str]()
    scene = counted(job.compiled(), asked)
    pixels, begun = job.size[0] * job.size[1], clock()
    for picture in render(job, chances, FRAMES, blank(job), scene):
        row = Row(job.method, picture, rays(asked) / pixels, clock() - begun)
        yield row
        if row.rays >= budget.rays or row.seconds >= budget.seconds:
            return


def compared(job: Job, methods: Sequence[str], budget: Budget, chances: Chances) -> Iterator[Row]:
    """The last row of every method, one after the other."""
    for method in methods:
        *_, last = spend(replace(job, method=method), budget, chances)
        yield last


ERRORS = {"MAPE": mape, "relMSE": rel_mse, "RMSE": rmse}


def errors(L: Array, reference: Array) -> dict[str, float]:
    """Errors of an image (C, rows, columns), channels averaged."""
    image, truth = L.mean(axis=0), reference.mean(axis=0)
    return {name: float(metric(image, truth, MAP)) for name, metric in ERRORS.items()}


def table(rows: Sequence[Row], reference: Array) -> str:
    """A line per method: frames, rays per pixel, seconds, errors."""
    head = f"{'method':24}{'frames':>8}{'rays/px':>10}{'seconds':>9}" + "".join(f"{name:>10}" for name in ERRORS)
    lines = [
        f"{row.method:24}{row.picture.frames:8}{row.rays:10.0f}{row.seconds:9.1f}"
        + "".join(f"{value:10.4f}" for value in errors(row.picture.mean, reference).values())
        for row in rows
    ]
    return "\n".join([head, *lines])


def sheet(path: Path, rows: Sequence[Row], reference: Array) -> None:
    """Pictures beside the reference, and below them |I - R| / (.01 mean R + R), black is 0 and white 1."""
    from matplotlib.figure import Figure  # noqa: PLC0415

    e, truth = exposure(reference), reference.mean(axis=0)
    figure = Figure(figsize=(2.4 * (len(rows) + 1), 5.2), layout="constrained")
    axes = figure.subplots(2, len(rows) + 1, squeeze=False)
    for ax, L in zip(axes[0], [reference, *(row.picture.mean for row in rows)], strict=True):
        ax.imshow(np.broadcast_to(tone(L, e), (3, *truth.shape)).transpose(1, 2, 0), interpolation="nearest")
    axes[0, 0].set_title("reference", fontsize=9)
    for k, row in enumerate(rows, 1):
        axes[0, k].set_title(METHODS[row.method].words, fontsize=7)
        error = abs(row.picture.mean.mean(axis=0) - truth) / (0.01 * truth.mean() + truth)
        axes[1, k].imshow(error, vmin=0, vmax=1, cmap="gray", interpolation="nearest")
        axes[1, k].set_title(f"MAPE {errors(row.picture.mean, reference)['MAPE']:.3f}", fontsize=9)
    for ax in axes.flat:
        ax.set_axis_off()
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=150)

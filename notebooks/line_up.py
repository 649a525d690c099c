"""Behind `03_find_the_bug`: estimators of the zoo without their names, and what one can do to find them out.

A line-up is the same for everybody who asks with the same number, so a class can compare notes.
"""

import string
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.report import style
from notebooks.show import Table
from restir_ref.batch import Array
from restir_ref.oracle.cells import Cells, cells
from restir_ref.oracle.scenes import Parts, Scene, reference_scene
from restir_ref.oracle.zoo import BUGS, CHECKS, INEFFICIENT, Bug, exact_bias, examine

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

NOTHING, OWN = "nothing wrong", "your own"
ROUNDING = 1e-9
"""Whatever differs by more than this is a bias."""


@dataclass(frozen=True, eq=False)
class Suspect:
    """An estimator under a letter: only `answer` tells what it is."""

    letter: str
    scene: Scene = field(repr=False)
    parts: Parts = field(repr=False)
    _bug: Bug = field(repr=False)
    _truth: str = field(repr=False)


LineUp = Mapping[str, Suspect]


def line_up(number: int, guilty: int = 4, wasteful: int = 1, innocent: int = 1) -> LineUp:
    """Suspects A, B, C, ...: wrong loops, loops that only waste samples, and right loops, in an order of their own.

    At most 26 of them; what the zoo does not have so many of is listed once.
    """
    rng = np.random.default_rng(number)
    wrong = [(bug, bug.wrong, bug.name) for bug in _some(BUGS, guilty, rng)]
    slow = [(bug, bug.wrong, bug.name) for bug in _some(INEFFICIENT, wasteful, rng)]
    right = [(bug, bug.right, NOTHING) for bug in _some(BUGS, innocent, rng)]
    everybody = [*wrong, *slow, *right]
    letters = string.ascii_uppercase[: len(everybody)]
    order = [everybody[k] for k in rng.permutation(len(everybody))]
    suspects = [Suspect(a, b.scene(), p, b, t) for a, (b, p, t) in zip(letters, order, strict=True)]
    return {suspect.letter: suspect for suspect in suspects}


def _some(family: Mapping[str, Bug], count: int, rng: np.random.Generator) -> list[Bug]:
    return [list(family.values())[k] for k in rng.permutation(len(family))[:count]]


def planted(letter: str, **parts: Any) -> Suspect:
    """A suspect of one's own on the reference scene: the right loop of two frames with some `Parts` replaced."""
    own = Parts(**parts)
    bug = Bug(
        OWN,
        "It was written here.",
        "see for yourself",
        "nothing, or what you have put in",
        reference_scene,
        Parts(),
        own,
    )
    return Suspect(letter, reference_scene(), own, bug, OWN)


# ---------------------------------------------------------------- experiments: the same estimator elsewhere


def as_it_is(t: Cells, n: int) -> Cells:
    """The scene unchanged."""
    return t


def equal_volumes(t: Cells, n: int) -> Cells:
    """All cells of size 1, so that J = 1 everywhere; the samplers keep their probabilities."""
    return rebuilt(t, v=np.ones(t.v.shape), pdf=t.pdf * t.v)


def no_holes(t: Cells, n: int) -> Cells:
    """Undefined shifts completed to bijections: whatever has no counterpart gets one that is free."""
    shifts = t.shifts.copy()
    for i, j in zip(*np.triu_indices(len(shifts), 1), strict=True):
        open_, free = np.flatnonzero(shifts[i, j] < 0), np.flatnonzero(shifts[j, i] < 0)
        shifts[i, j, open_], shifts[j, i, free] = free, open_
    return rebuilt(t, shifts=shifts)


def nothing_dark(t: Cells, n: int) -> Cells:
    """No cell without light, and none that a sampler leaves out."""
    pdf = np.where(t.pdf > 0, t.pdf, t.pdf.mean(axis=-1, keepdims=True))
    pdf = pdf / (pdf * t.v).sum(axis=-1, keepdims=True)
    return rebuilt(t, f=np.where(t.f > 0, t.f, 1.0), p_hat=np.where(t.f > 0, t.f, 1.0), pdf=pdf)


def history_cut(t: Cells, n: int) -> Cells:
    """Shifts between frames undefined: history can bring nothing."""
    frame = np.arange(len(t.v)) // n
    return cut(t, frame[:, None] != frame[None])


def neighbours_cut(t: Cells, n: int) -> Cells:
    """Shifts between pixels of one frame undefined: neighbours can bring nothing."""
    integral = np.arange(len(t.v))
    same_frame = integral[:, None] // n == integral[None] // n
    return cut(t, same_frame & (integral[:, None] != integral[None]))


def cut(t: Cells, between: Array) -> Cells:
    """Shifts undefined between the integrals of a mask, (I, I)."""
    return rebuilt(t, shifts=np.where(between[..., None], -1, t.shifts))


def rebuilt(t: Cells, **changes: Any) -> Cells:
    """The tables with changes, checked."""
    new = replace(t, **changes)
    return cells(new.v, new.f, new.pdf, new.shifts, new.p_hat, new.proposal)


EXPERIMENTS: Mapping[str, Callable[[Cells, int], Cells]] = {
    "as it is": as_it_is,
    "equal volumes": equal_volumes,
    "no holes": no_holes,
    "nothing dark": nothing_dark,
    "history cut": history_cut,
    "neighbours cut": neighbours_cut,
}


def changed(scene: Scene, experiment: str) -> Scene:
    """The scene of an experiment."""
    n = scene.now.n
    tables = EXPERIMENTS[experiment](scene.now.cells, n)
    return Scene([type(frame)(tables, frame.n, frame.t) for frame in scene.frames])


def bias(suspect: Suspect, experiment: str = "as it is") -> Array:
    """Exact relative bias per cell in an experiment, (n, K)."""
    scene = changed(suspect.scene, experiment)
    return exact_bias(suspect.parts(scene), scene)


def experiments(suspects: LineUp) -> "Picture":
    """The largest bias of a cell, signed, for every suspect in every experiment."""
    worst = np.array([[_largest(bias(each, name)) for name in EXPERIMENTS] for each in suspects.values()])
    picture, axes = style.panels(width=6.4, height=0.8 + 0.36 * len(suspects))
    ax = axes[0, 0]
    ax.imshow(np.log10(np.maximum(abs(worst), 1e-3)), cmap="Greys", vmin=-3, vmax=2.5, aspect="auto")
    for (row, column), value in np.ndenumerate(worst):
        ax.text(column, row, f"{value:+.1%}" if abs(value) > ROUNDING else "0", ha="center", va="center", fontsize=8)
    ax.set_xticks(range(len(EXPERIMENTS)), EXPERIMENTS, rotation=20, ha="right")
    ax.set_yticks(range(len(suspects)), suspects)
    ax.set(xlabel="experiment", ylabel="estimator", title="Largest bias of a cell")
    ax.grid(visible=False)
    return picture


def _largest(values: Array) -> float:
    return float(values.flat[abs(values).argmax()])


def cells_of(suspects: LineUp, letter: str, experiment: str) -> "Picture":
    """The exact relative bias of every cell of an estimator, pixel by pixel."""
    found = bias(suspects[letter], experiment)
    limit = max(0.1, 1.1 * float(abs(found).max()))
    picture, (panels,) = style.panels(1, len(found), width=6.4 / len(found), height=2.6)
    for pixel, (ax, values) in enumerate(zip(panels, found, strict=True), start=1):
        x = np.arange(1, len(values) + 1)
        ax.bar(x, values, color=style.COLOURS[0])
        ax.axhline(0, color="k", lw=0.8)
        ax.set(xlabel="cell", xticks=x, ylim=(-limit, limit), title=f"{letter}, {experiment}: pixel {pixel}")
    panels[0].set_ylabel("relative bias")
    return picture


def checks(suspects: LineUp) -> Table:
    """Every check of the zoo on every suspect: a signed number, empty where it is 0."""
    found = [examine(each.parts, each._bug.right, each.scene) for each in suspects.values()]
    rows = [[name, *(f"{f[name].value:+.3f}" if f[name].caught else "" for f in found)] for name in CHECKS]
    return Table(["check", *suspects], rows)


# ---------------------------------------------------------------- words


def names() -> Sequence[str]:
    """Everything a suspect can turn out to be."""
    return [NOTHING, *BUGS, *INEFFICIENT]


def hint(suspect: Suspect) -> str:
    """What it would look like in a renderer."""
    return "It looks as it should." if suspect._truth == NOTHING else f"In a renderer: {suspect._bug.symptom}."


def accuse(suspect: Suspect, name: str) -> str:
    """Whether a suspicion is right, and no more."""
    if name not in names():
        raise ValueError(f"there is no {name!r}; names() lists what there is")
    return f"{suspect.letter}: {'Yes, that is it.' if name == suspect._truth else 'No.'}"


def answer(suspect: Suspect) -> str:
    """What it is, how that gets into renderers, and where the theory forbids it."""
    if suspect._truth == NOTHING:
        return f"{suspect.letter}: {NOTHING}."
    bug = suspect._bug
    return f"{suspect.letter}: {bug.name}. {bug.story} See {bug.breaks}."

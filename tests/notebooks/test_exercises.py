"""Every "Your turn" says "Not yet" as it stands and "Right" with its solution; no question is without an answer."""

import re
from itertools import pairwise

import numpy as np
import pytest

from notebooks import exercises, pages

SOLUTION = re.compile(r"<summary>Solution</summary>\n\n```python\n(.*?)\n```", re.DOTALL)
CHECKED = re.compile(r"^print\(exercises\.(\w+)\((my_\w+)\)\)$", re.MULTILINE)


def turns(path):
    """Of every exercise: its cell and the folded solution."""
    cells = pages.cells(path)
    for cell, after in pairwise(cells):
        if cell.kind == "code" and CHECKED.search(cell.source):
            yield cell.source, SOLUTION.search(after.source)[1]


TURNS = {CHECKED.search(cell)[1]: (path, cell, solved) for path in pages.notebooks() for cell, solved in turns(path)}


def says(path, source):
    """What the cell prints after the notebook's imports."""
    names = {}
    imports = next(cell.source for cell in pages.cells(path) if cell.kind == "code")
    exec(imports, names)
    (said,) = pages.run(source, names, "an exercise")
    return said


def test_every_check_has_its_exercise():
    assert TURNS.keys() == exercises.CHECKS.keys()


@pytest.mark.parametrize("check", TURNS)
def test_an_exercise_is_not_solved_as_it_stands(check):
    path, cell, _ = TURNS[check]
    assert says(path, cell).startswith("Not yet: ")


@pytest.mark.parametrize("check", TURNS)
def test_a_folded_solution_is_right(check):
    path, cell, solved = TURNS[check]
    assert says(path, solved + "\n" + CHECKED.search(cell)[0]).startswith("Right: ")


# ---------------------------------------------------------------- what a check notices

NEIGHBOURS = "spatial(X, here, random_in_row(here.of, here.index, 3, 20, chance), chance)"
WRONG = {
    "ris": {
        "W forgotten": ("* W /", "/"),
        "M forgotten": (" / len(x)", ""),
        "the largest": ("s = (upto <= u * upto[-1]).sum(axis=0)", "s = (p_hat(x) * W).argmax(axis=0)"),
        "the target's density": ("upto[-1] / p_hat(Y)", "0.9974 / p_hat(Y)"),
    },
    "gris_pass": {
        "J forgotten": (" * W * J", " * W * (J > 0)"),
        "J inverted": (" * W * J", " * W * np.where(J > 0, 1 / np.maximum(J, 0.1), 0)"),
        "1/M": ("m = np.stack([q[0, 0], q[1, 1]]) / q.sum(axis=0)", "m = 1 / 2"),
        "the other's target": (
            "return Y, w.sum(axis=0) / p_hat(Y)",
            "return Y, w.sum(axis=0) / np.maximum(p_hat_from(Y), 0.1)",
        ),
    },
    "weight": {"squared above": ("c[i] * q(i)", "c[i] * q(i) ** 2"), "uncounted": ("c[i] * q(i)", "q(i) / 7")},
    "all_outcomes": {"no volume": (" * v[x]", ""), "the larger one": ("chance.choose(np.stack(w))", "(w[1] > w[0])")},
    "jacobian": {
        "three dimensions": ("(x.r / y.r)", "(x.r / y.r) ** 2"),
        "one density": (" * (y.p_out / x.p_out)", ""),
    },
    "careful_shift": {
        "not mirrored": ("(J <= 2) & (J >= 1 / 2)", "J <= 2"),
        "clamped": ("(J <= 2) & (J >= 1 / 2), J", "J > 0, np.clip(J, 0.5, 2)"),
    },
    "film": {"no cap": ("cap=20", "cap=1000"), "no neighbours": (NEIGHBOURS, "X")},
    "motion_vector": {
        "rounded": ("np.floor(", "np.rint("),
        "columns first": ("row * before.width + column", "column * before.width + row"),
        "beyond the border": ("np.clip(column, 0, before.width - 1)", "column"),
    },
    "positivized": {
        "negative": ("np.maximum(d.mean(axis=0), 0) + some", "d.mean(axis=0) + some"),
        "lost where the mean is 0": ("0.1 * abs(d).mean(axis=0)", "0 * d[0]"),
    },
    "mutation": {
        "T forgotten": ("p_hat_new * T /", "p_hat_new /"),
        "T upside down": ("p_hat_new * T /", "p_hat_new / T /"),
        "no minimum": ("np.minimum(1, p_hat_new * T / p_hat)", "p_hat_new * T / p_hat"),
        "W inverted": ("W * p_hat / p_hat_new", "W * p_hat_new / p_hat"),
        "nothing moves": ("np.minimum(1,", "0 * np.minimum(1,"),
    },
    "visibility": {
        "moments swapped": ("r2 - r1**2", "abs(r1 - r2**2)"),
        "no square": ("(v - r1) ** 2", "(v - r1)"),
        "both sides": ("np.where(v <= r1, 1.0, bound)", "bound"),
        "the standard deviation": ("bound = var /", "bound = var**0.5 /"),
    },
}


@pytest.mark.parametrize(("check", "mistake"), [(check, each) for check in WRONG for each in WRONG[check]])
def test_a_mistake_in_a_solution_is_noticed(check, mistake):
    path, cell, solved = TURNS[check]
    old, new = WRONG[check][mistake]
    assert old in solved
    assert says(path, solved.replace(old, new) + "\n" + CHECKED.search(cell)[0]).startswith("Not yet: ")


NO_NUMBERS = {
    "ris": lambda x, W, p_hat, u: (x[0], np.nan * x[0]),
    "gris_pass": lambda x, W, u, *_: (x[0], np.nan * u),
    "weight": lambda i, q, c: np.nan * q(i),
    "all_outcomes": lambda index, chance: (index % 3, np.nan * index),
    "jacobian": lambda x, y: np.nan * x.r,
    "motion_vector": lambda x, before: np.nan * x[0],
    "positivized": lambda d: (np.nan * d[0],) * 3,
    "mutation": lambda p_hat, p_hat_new, T, W: (np.nan * T, W),
    "visibility": lambda v, r1, r2: np.nan * v,
}


@pytest.mark.parametrize("check", NO_NUMBERS)
def test_what_is_no_number_is_not_right(check):
    assert exercises.CHECKS[check](NO_NUMBERS[check]).startswith("Not yet: ")


def test_what_a_function_must_return_is_said():
    with pytest.raises(
        ValueError, match=r"return Y and W_Y, two arrays of shape \(40000,\), not of shapes \[\(40000,\)\]"
    ):
        exercises.ris(lambda x, W, p_hat, u: np.ones(40_000))


def test_a_pixel_is_asked_for_every_point():
    with pytest.raises(
        ValueError, match=r"return a pixel for each of the 1024 points, not an array of shape \(2, 1024\)"
    ):
        exercises.motion_vector(lambda x, before: before.project(x))


# ---------------------------------------------------------------- questions


def questions(path):
    """How many questions a notebook asks at its end, and how many folded answers it gives."""
    text = {cell.source.split("\n")[0]: cell.source for cell in pages.cells(path) if cell.kind == "markdown"}
    asked = re.findall(r"^\d+\. ", text.get("## Try it yourself", ""), re.MULTILINE)
    return len(asked), text.get("## Answers", "").count("<details>")


@pytest.mark.parametrize("path", [path for path in pages.notebooks() if "find_the_bug" not in path.name], ids=str)
def test_every_question_has_its_folded_answer(path):
    asked, answered = questions(path)
    assert asked == answered >= 4

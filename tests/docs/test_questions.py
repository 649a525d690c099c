"""The numbers in docs/questions.md are those that the code above them prints."""

import re
from contextlib import redirect_stdout
from io import StringIO
from typing import Any

import pytest

from tests.checkout import ROOT

PAGE = (ROOT / "docs" / "questions.md").read_text(encoding="utf-8")
EXAMPLES = re.findall(r"```python\n(.*?)```\n(?:\n```text\n(.*?)```)?", PAGE, re.DOTALL)
QUESTIONS = re.split(r"^\*\*", PAGE, flags=re.MULTILINE)[1:]


def printed(examples: list[tuple[str, str]]) -> list[str]:
    """What the pieces print, one after the other."""
    names: dict[str, Any] = {}
    found = []
    for code, _ in examples:
        with redirect_stdout(StringIO()) as out:
            exec(compile(code, "docs/questions.md", "exec"), names)
        found.append(out.getvalue())
    return found


def test_the_examples_print_what_the_page_says() -> None:
    assert printed(EXAMPLES) == [said for _, said in EXAMPLES]


def test_other_code_prints_something_else() -> None:
    (head, _), (first, said), *_ = EXAMPLES
    assert printed([(head, ""), (first, said)])[1] == said
    assert printed([(head.replace("wrong.max()", "right.max()"), ""), (first, said)])[1] != said


ANSWERED = {
    "history merged with": "W formed with the stored target",
    "the clamp": "new samples stay uncapped",
    "direct and indirect light share one reservoir": "from one reservoir",
    "Two samplers and one integral": "both techniques added in full",
    "One of the sources is a set of reservoirs": "between the reservoirs",
    "A random number of candidates": "until one is lit",
    "self-normalised importance sampling": "self-normalised +",
    "W go stale": "under another target",
}


@pytest.mark.parametrize("question", ANSWERED)
def test_every_question_of_learners_is_answered_with_a_number(question) -> None:
    (answer,) = [each for each in QUESTIONS if question in each.split("**")[0]]
    (said,) = re.findall(r"```text\n(.*?)```", answer, re.DOTALL)
    assert ANSWERED[question] in said
    assert re.search(r"\d", said)


def test_no_question_is_left_without_a_number() -> None:
    assert len(QUESTIONS) == len(ANSWERED)

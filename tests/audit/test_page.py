"""The examples of docs/audit.md run, find their planted bugs, and print what the page says."""

import re
from typing import Any

import pytest

from tests.checkout import ROOT

PAGE = (ROOT / "docs" / "audit.md").read_text(encoding="utf-8")
EXAMPLES = re.findall(r"```python\n(.*?)```\n(?:\n```text\n(.*?)```)?", PAGE, re.DOTALL)


@pytest.fixture
def here(tmp_path, monkeypatch) -> dict[str, Any]:
    monkeypatch.chdir(tmp_path)
    return {}


def test_the_examples_print_what_the_page_says(here, capsys) -> None:
    assert len(EXAMPLES) == 3
    for code, said in EXAMPLES:
        exec(compile(code, "docs/audit.md", "exec"), here)
        assert capsys.readouterr().out == said


def test_the_example_of_an_estimator_is_short_and_finds_its_bug() -> None:
    code, said = EXAMPLES[0]
    assert len([line for line in code.splitlines() if line.strip()]) < 15
    assert '"1/M over unequal supports" (its own loop): exactly this table' in said


def test_without_the_bug_the_example_is_unbiased(here, capsys) -> None:
    """m = p_hat / (p_hat + p_hat of the sample in the other pixel) instead of 1/2."""
    mended = EXAMPLES[0][0].replace(
        "    s = chance",
        "    back = frame.shift(np.array([X.x, y.x]), index, near)\n"
        "    q = frame.target(near.index, back.x) * back.J\n"
        "    own = np.stack([p_hat[0], q[1]])\n"
        "    s = chance",
    )
    mended = mended.replace("* y.J] / 2)", "* y.J] * ratio(own, p_hat + q))")
    exec(compile(mended, "docs/audit.md", "exec"), here)
    assert capsys.readouterr().out.startswith("unbiased in every cell")


def test_the_golden_example_notices_another_formula(here) -> None:
    code = EXAMPLES[2][0].replace("* J)", ")")
    with pytest.raises(AssertionError):
        exec(compile(f"import numpy as np\n{code}", "docs/audit.md", "exec"), here)

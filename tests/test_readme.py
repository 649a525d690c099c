"""The README's examples run, are short, and print what it promises."""

import re

from tests.checkout import ROOT

EXAMPLES = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(encoding="utf-8"), re.DOTALL)


def test_the_readme_examples_run_and_find_the_planted_bug(capsys) -> None:
    exec(compile("\n".join(EXAMPLES), "README.md", "exec"), {})
    printed = capsys.readouterr().out
    assert len(re.findall(r"\d\.\d+", printed.splitlines()[0])) > 3
    assert "1/M over unequal supports" in printed
    assert "BIASED: -50.00%" in printed


def test_the_readme_examples_have_at_most_20_lines_of_code() -> None:
    assert len([line for block in EXAMPLES for line in block.splitlines() if line.strip()]) <= 20

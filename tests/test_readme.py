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


def test_the_readme_examples_are_short() -> None:
    """20 lines for the first two, imports said once; the one that finds the bug, and that in flatland, at most 15."""
    first, second, third = ([line for line in block.splitlines() if line.strip()] for block in EXAMPLES)
    assert len(second) < 15
    assert len(third) <= 15
    assert len([*first, *(line for line in second if line not in first)]) <= 20


def test_the_readme_example_in_flatland_shows_what_reuse_is_for(capsys) -> None:
    exec(compile(EXAMPLES[2], "README.md", "exec"), {})
    traced, reused = (float(x) for x in re.findall(r"\d+\.\d+", capsys.readouterr().out))
    assert reused < traced / 3


def test_each_readme_example_runs_by_itself() -> None:
    for block in EXAMPLES:
        exec(compile(block, "README.md", "exec"), {})

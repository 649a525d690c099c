"""The README's example runs, is short, and prints what it promises."""

import re

from tests.checkout import ROOT


def example() -> str:
    return re.search(r"```python\n(.*?)```", (ROOT / "README.md").read_text(encoding="utf-8"), re.DOTALL).group(1)


def test_the_readme_example_runs_and_finds_the_planted_bug(capsys) -> None:
    exec(compile(example(), "README.md", "exec"), {})
    means, right, wrong = capsys.readouterr().out.splitlines()
    assert len(re.findall(r"\d\.\d+", means)) == 7
    assert float(right.split()[-1]) < 1e-13
    assert float(wrong.split()[-1]) > 0.1


def test_the_readme_example_has_at_most_20_lines_of_code() -> None:
    lines = [line for line in example().splitlines() if line.strip() and not line.lstrip().startswith("#")]
    assert len(lines) <= 20

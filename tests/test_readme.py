"""The README's examples run, are short, and print what it promises."""

import re
import shlex
from collections.abc import Iterator
from pathlib import Path

from tests.checkout import ROOT
from tests.figures.project import figures, project

README = (ROOT / "README.md").read_text(encoding="utf-8")
EXAMPLES = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
NUMBER = re.compile(r"[-+]?\d+\.\d+")


def rounded(text: str) -> list[str]:
    """The words of a printout, its numbers to three digits: the last ones are the machine's."""
    return NUMBER.sub(lambda number: f"{float(number[0]):.3g}", text).split()


SHOWN = [rounded(block) for block in re.findall(r"```text\n(.*?)```", README, re.DOTALL)]
LINES = [line.partition("  #")[0].strip() for block in re.findall(r"```sh\n(.*?)```", README, re.DOTALL)
         for line in block.splitlines()]  # fmt: skip


def test_the_readme_examples_run_and_find_the_planted_bug(capsys) -> None:
    exec(compile("\n".join(EXAMPLES), "README.md", "exec"), {})
    printed = capsys.readouterr().out
    assert len(re.findall(r"\d\.\d+", printed.splitlines()[0])) > 3
    assert "1/M over unequal supports" in printed
    assert "BIASED: -50.00%" in printed


def test_each_example_runs_by_itself_and_prints_what_the_readme_shows(capsys) -> None:
    assert len(SHOWN) == len(EXAMPLES)
    assert [printed(block, capsys) for block in EXAMPLES] == SHOWN


def test_another_printout_than_the_one_shown_is_noticed(capsys) -> None:
    assert printed(EXAMPLES[0].replace("default_rng(1)", "default_rng(2)"), capsys) != SHOWN[0]


def printed(block: str, capsys) -> list[str]:
    """What an example prints: its words, and its numbers to three digits, as a sum may differ in the last."""
    exec(compile(block, "README.md", "exec"), {})
    return rounded(capsys.readouterr().out)


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


# ---------------------------------------------------------------- the printed shell lines, one after the other

MAKEFILE = (ROOT / "Makefile").read_text(encoding="utf-8")
GIVEN = {"$(PY)": "python", "$(JOBS)": "2", "$(OUT)": "out", "$(ARGS)": ""}


def recipe(target: str) -> list[str]:
    """The commands of a target of the Makefile, with the variables it sets."""
    (found,) = re.findall(rf"^{target}:.*\n((?:\t.*\n)+)", MAKEFILE, re.MULTILINE)
    lines = found.replace("\\\n", "").splitlines()
    for variable, value in GIVEN.items():
        lines = [line.replace(variable, value) for line in lines]
    return [line.strip() for line in lines]


def commands(lines: list[str]) -> Iterator[list[str]]:
    """What runs, in order, of `python -m figures`: a figure that takes no time for the real ones, in one process."""
    for line in lines:
        for command in recipe(line.removeprefix("make ")) if line.startswith("make ") else [line]:
            if command.startswith("python -m figures "):
                words = shlex.split(re.sub(r"--(dask|jobs) \S+", "", command))[3:]
                yield ["DEMO-F01" if re.fullmatch(r"[A-Z]+-\w+", word) else word for word in words]


def failures(lines: list[str], folder: Path) -> list[str]:
    """Commands that end with an error, run in order in a folder."""
    here = project(folder, "sound")
    return [" ".join(words) for words in commands(lines) if figures(here, *words, *progress(words)) != 0]


def progress(words: list[str]) -> list[str]:
    return ["--progress", "log"] if words[0] == "run" else []


def test_the_printed_shell_lines_work_in_the_order_printed(tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert LINES[0] == "make figures"
    assert [words[0] for words in commands(LINES)] == ["run", "report", "list", "run", "run", "ledger", "audit"]
    assert failures(LINES, tmp_path) == []


def test_a_paper_run_into_the_folder_of_quick_results_is_noticed(tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert failures([line.replace("out-paper", "out") for line in LINES], tmp_path) == [
        "run DEMO-F01 --preset paper --out out"
    ]


def test_every_other_printed_line_names_something_that_exists() -> None:
    others = [line for line in LINES if not line.startswith("python -m figures ")]
    targets = [line.removeprefix("make ") for line in others if line.startswith("make ")]
    assert [line for line in others if not line.startswith("make ")] == [". .venv/bin/activate"]
    assert all(re.search(rf"^{target}:", MAKEFILE, re.MULTILINE) for target in targets)
    assert targets == ["figures", "test", "bench"]


# ---------------------------------------------------------------- papers and pictures


def test_the_readme_names_every_doi_that_the_references_have_of_the_four_papers() -> None:
    references = (ROOT / "docs" / "references.md").read_text(encoding="utf-8").partition("## Resampling")[0]
    dois = re.findall(r"doi:\[(.*?)\]", references)
    assert len(dois) == 3
    assert [doi for doi in dois if doi not in README] == []


def missing(text: str) -> list[str]:
    """Links of a page into the checkout that lead nowhere, to a file or to a heading."""
    headings = {re.sub(r"[^a-z0-9 -]", "", h.lower()).replace(" ", "-") for h in re.findall(r"^#+ (.*)", text, re.M)}
    links = [link for link in re.findall(r"\]\((.*?)\)", text) if "://" not in link]
    return [each for each in links if not (each[1:] in headings if each[0] == "#" else (ROOT / each).exists())]


def test_links_of_the_readme_lead_to_what_is_there() -> None:
    assert missing(README) == []
    assert missing("## Here\n[a](#here) [b](#there) [c](docs/none.md)") == ["#there", "docs/none.md"]


# ---------------------------------------------------------------- files


def missing_files(page: str) -> list[str]:
    """Paths in backticks of the table of equations, braces expanded, that are not in the checkout."""
    named = [name for name in re.findall(r"`([a-z0-9_]+/[^` ]*)`", page) if "*" not in name]
    whole = [head + each + tail for head, names, tail in map(braces, named) for each in names.split(",")]
    return [name for name in whole if not (ROOT / name).exists()]


def braces(name: str) -> tuple[str, str, str]:
    """What stands before, in and behind the braces of a path."""
    head, _, rest = name.partition("{")
    names, _, tail = rest.partition("}")
    return head, names, tail


def test_every_file_that_the_readme_names_is_there() -> None:
    assert missing_files((ROOT / "README.md").read_text("utf-8")) == []


def test_a_file_that_has_moved_is_noticed() -> None:
    assert missing_files("`restir_ref/transport/{paths,copies}.py`") == ["restir_ref/transport/copies.py"]

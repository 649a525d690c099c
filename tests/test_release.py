"""What is released: a wheel that stands alone, an sdist that holds the checkout, one version, honest links.

Both archives are built once, without a network: the build tools are part of the environment.
"""

import re
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from collections.abc import Iterable
from email import message_from_string
from email.message import Message
from pathlib import Path

import pytest

from restir_ref import __version__
from tests.checkout import ROOT, files

PYPROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
PACKAGES = PYPROJECT["tool"]["hatch"]["build"]["targets"]["wheel"]["packages"]
COMMANDS = ("tracer3d", "restir_ref.audit")


@pytest.fixture(scope="module")
def archives(tmp_path_factory) -> Path:
    """A folder with both archives."""
    folder = tmp_path_factory.mktemp("dist")
    command = [sys.executable, "-m", "hatchling", "build", "-d", str(folder)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return folder


@pytest.fixture(scope="module")
def wheel(archives) -> Path:
    """The wheel."""
    return next(archives.glob("*.whl"))


@pytest.fixture(scope="module")
def metadata(wheel) -> Message:
    """What a package index shows."""
    with zipfile.ZipFile(wheel) as archive:
        name = next(name for name in archive.namelist() if name.endswith("METADATA"))
        return message_from_string(archive.read(name).decode())


# ---------------------------------------------------------------- the wheel


def stray(names: Iterable[str]) -> list[str]:
    """Files of a wheel that belong to no package of ours."""
    return [name for name in names if name.partition("/")[0] not in PACKAGES and ".dist-info/" not in name]


def test_the_wheel_holds_every_file_of_the_packages_and_no_other(wheel):
    held = zipfile.ZipFile(wheel).namelist()
    ours = [path.relative_to(ROOT).as_posix() for path in files(ROOT)]
    assert stray(held) == []
    assert [name for name in ours if name.partition("/")[0] in PACKAGES and name not in held] == []


def test_a_test_in_the_wheel_would_be_noticed():
    assert stray(["restir_ref/mis.py", "tests/test_frame.py"]) == ["tests/test_frame.py"]


def elsewhere(wheel: Path, folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Python with the unpacked wheel, away from the checkout."""
    zipfile.ZipFile(wheel).extractall(folder / "site")
    program = f"import sys; sys.path = [{str(folder / 'site')!r}, *(p for p in sys.path if p != {str(ROOT)!r})]\n"
    command = [sys.executable, "-P", "-c", program + arguments[0], *arguments[1:]]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)


def test_every_module_of_the_wheel_is_imported_without_the_checkout(wheel, tmp_path):
    names = [name[:-3].replace("/", ".") for name in zipfile.ZipFile(wheel).namelist() if name.endswith(".py")]
    wanted = [name.removesuffix(".__init__") for name in names if "__main__" not in name and "make_" not in name]
    program = (
        f"import importlib\nfor name in {wanted!r}: assert {str(tmp_path)!r} in importlib.import_module(name).__file__"
    )
    done = elsewhere(wheel, tmp_path, program)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("command", COMMANDS)
def test_the_help_of_a_wheel_names_only_files_that_a_wheel_has(wheel, tmp_path, command):
    run = f"import runpy; sys.argv[1:] = ['--help']; runpy.run_module({command!r}, run_name='__main__')"
    said = elsewhere(wheel, tmp_path, run).stdout
    assert "usage:" in said
    assert missing(said.replace("\n", ""), tmp_path) == []


def missing(said: str, folder: Path) -> list[str]:
    """Markdown pages that a text names and that are not there; lines are broken after slashes and hyphens."""
    named = re.findall(r"[\w./-]+\.md", re.sub(r"(?<=[/-]) +", "", said))
    return [name for name in named if not (folder / name).exists()]


def test_a_page_that_a_wheel_does_not_have_is_noticed(tmp_path):
    assert missing("docs/audit.md has the format.", tmp_path) == ["docs/audit.md"]


# ---------------------------------------------------------------- the sdist


def test_the_sdist_holds_the_checkout(archives):
    with tarfile.open(next(archives.glob("*.tar.gz"))) as archive:
        held = {name.partition("/")[2] for name in archive.getnames()}
    ours = {path.relative_to(ROOT).as_posix() for path in files(ROOT)} - {".git"}  # a file in a worktree
    assert ours - held == set()
    assert {name for name in held - ours if name != "PKG-INFO"} == set()


# ---------------------------------------------------------------- what an index shows


def test_there_is_one_version(metadata):
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert metadata["Version"] == __version__
    assert f"\nversion: {__version__}\n" in citation


def relative_links(text: str) -> list[str]:
    """Links of a Markdown text that lead nowhere without the checkout."""
    return [to for to in re.findall(r"\]\(([^)\s]+)\)", text) if not to.startswith(("https://", "#"))]


def test_the_readme_of_an_index_has_absolute_links_only(metadata):
    shown = metadata.get_payload()
    assert relative_links((ROOT / "README.md").read_text(encoding="utf-8"))
    assert relative_links(shown) == []
    assert f"]({PYPROJECT['project']['urls']['Source']}/" in shown


def places(root: Path, url: str) -> list[str]:
    """Files that have an address."""
    found = [path for path in files(root) if url in path.read_bytes().decode(errors="replace")]
    return sorted(path.relative_to(root).as_posix() for path in found)


def test_the_projects_address_stands_in_one_file():
    address = PYPROJECT["project"]["urls"]["Homepage"]
    assert places(ROOT, address) == ["pyproject.toml"]
    rules = PYPROJECT["tool"]["hatch"]["metadata"]["hooks"]["fancy-pypi-readme"]["substitutions"]
    assert all(PYPROJECT["project"]["urls"]["Source"] in rule["replacement"] for rule in rules)


# ---------------------------------------------------------------- the workflows


def own_commands(workflow: str) -> list[str]:
    """What a workflow runs by itself instead of calling the Makefile or .ci/run."""
    runs = re.findall(r"^\s*- run: (.+)$", workflow, re.MULTILINE)
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))
    known = {".ci/run", *(f"make {target}" for target in targets)}
    return [run for run in runs if run not in known]


@pytest.mark.parametrize("path", sorted((ROOT / ".github/workflows").glob("*.yml")), ids=lambda path: path.stem)
def test_workflows_call_the_commands_of_the_checkout(path):
    workflow = path.read_text(encoding="utf-8")
    assert "- run: " in workflow
    assert own_commands(workflow) == []


def test_a_workflow_with_its_own_commands_is_noticed():
    assert own_commands("    - run: pip install .\n    - run: make test") == ["pip install ."]

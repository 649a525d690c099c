"""Laws over the checkout: no traces of a machine, honest packaging, a set-up that fails clearly.

Every law is a function that lists offenders; its twin plants one, which must be listed.
"""

import os
import re
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Iterable
from importlib.metadata import PackageNotFoundError, requires
from pathlib import Path
from typing import Any

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from tests.checkout import ROOT, WORLDS, files, plant

PYPROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
CONSTRAINTS = (ROOT / "constraints.txt").read_text(encoding="utf-8")
MAKEFILE = (ROOT / "Makefile").read_text(encoding="utf-8")

# ---------------------------------------------------------------- no trace of the machine it was made on

PLACES = ("work", "root", "opt", r"home/\w+", r"Users/\w+")
# The words are cut in two, or this file would be an offender itself.
HALVES = (("../", "shared"), ("py", "pi.org"), ("python", "hosted"), ("ana", "conda.org"), ("index", "-url"))
WORDS = tuple(map("".join, HALVES))
TRACE = re.compile(rf"(?<![\w./~-])/(?:{'|'.join(PLACES)})\b|{'|'.join(map(re.escape, WORDS))}")


def machine_traces(root: Path) -> list[str]:
    """Paths of somebody's machine and ways to package registries, wherever a file mentions them."""
    texts = ((path, path.read_bytes().decode(errors="replace")) for path in files(root))
    return [f"{path.relative_to(root)}: {found[0]}" for path, text in texts for found in TRACE.finditer(text)]


def test_no_file_mentions_a_machine_or_a_registry():
    assert machine_traces(ROOT) == []


@pytest.mark.parametrize("trace", [*WORDS, "see /" + "work/x", "(/" + "root)", "'/" + "home/ada/x'"])
def test_a_trace_of_a_machine_is_noticed(tmp_path, trace):
    assert len(machine_traces(plant(tmp_path, "docs/page.md", f"a line with {trace}"))) == 1


@pytest.mark.parametrize("innocent", ["and/or", "net/work/flow", "~/opt", "square/root", "/rootfinding"])
def test_an_innocent_slash_is_left_alone(tmp_path, innocent):
    assert machine_traces(plant(tmp_path, "docs/page.md", innocent)) == []


# ---------------------------------------------------------------- packaging


def named_requirements(pyproject: dict[str, Any]) -> list[Requirement]:
    """Everything pyproject.toml asks for: to build, to run, as extras and in groups."""
    named = (*pyproject["project"]["optional-dependencies"].values(), *pyproject["dependency-groups"].values())
    groups = (pyproject["build-system"]["requires"], pyproject["project"]["dependencies"], *named)
    return [Requirement(line) for group in groups for line in group if isinstance(line, str)]


def closure(requirements: Iterable[Requirement]) -> set[str]:
    """Names of the requirements and of what they need in turn, as far as they are installed here."""
    todo, seen = list(requirements), set()
    while todo:
        wanted = todo.pop()
        key = (canonicalize_name(wanted.name), *sorted(wanted.extras))
        if key not in seen:
            seen.add(key)
            todo += needs(wanted)
    return {name for name, *_ in seen}


def needs(wanted: Requirement) -> list[Requirement]:
    """What an installed requirement needs on this machine, with the extras it is asked for."""
    try:
        lines = requires(wanted.name) or ()
    except PackageNotFoundError:
        return []
    extras = ("", *wanted.extras)
    found = [Requirement(line) for line in lines]
    return [r for r in found if r.marker is None or any(r.marker.evaluate({"extra": e}) for e in extras)]


def pin_faults(constraints: str, requirements: list[Requirement]) -> list[str]:
    """Lines that are not `name==version`, packages without a pin, and pins that a requirement refuses."""
    lines = constraints.splitlines()
    odd = [line for line in lines if not re.fullmatch(r"[A-Za-z0-9][\w.-]*==\d[\w.+!]*", line)]
    pins = {canonicalize_name(name): version for name, _, version in (line.partition("==") for line in lines)}
    pinned = ((r, pins.get(canonicalize_name(r.name))) for r in requirements)
    refused = [f"{r} refuses {pin}" for r, pin in pinned if pin and not r.specifier.contains(pin)]
    return odd + sorted(closure(requirements) - pins.keys()) + refused


def test_constraints_pin_everything_that_is_needed():
    assert pin_faults(CONSTRAINTS, named_requirements(PYPROJECT)) == []


BAD_PINS = {
    "a range": ("numpy==", "numpy>="),
    "a named requirement missing": ("scipy==", "scipyy=="),
    "a needed package missing": ("pluggy==", "pluggyy=="),
    "too old": ("scipy==1", "scipy==0"),
    "a path": ("tqdm==", "tqdm @ file:"),
    "a comment": ("zipp==", "# zipp=="),
}


@pytest.mark.parametrize(("line", "instead"), BAD_PINS.values(), ids=BAD_PINS)
def test_a_bad_pin_is_noticed(line, instead):
    assert line in CONSTRAINTS
    assert pin_faults(CONSTRAINTS.replace(line, instead), named_requirements(PYPROJECT))


def wheel_faults(root: Path) -> list[str]:
    """Packages of the wheel that are missing or untyped; theory and worlds that the wheel leaves out."""
    pyproject = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))
    wheel = pyproject["tool"]["hatch"]["build"]["targets"]["wheel"]["packages"]
    wanted = [f"{package}/{name}" for package in wheel for name in ("__init__.py", "py.typed")]
    left_out = [name for name in ("restir_ref", *WORLDS) if (root / name).exists() and name not in wheel]
    return [name for name in wanted if not (root / name).exists()] + left_out


def test_the_wheel_holds_the_theory_and_every_world():
    assert wheel_faults(ROOT) == []


def test_a_missing_package_and_a_forgotten_one_are_noticed(tmp_path):
    plant(tmp_path, "pyproject.toml", '[tool.hatch.build.targets.wheel]\npackages = ["toy1d"]')
    plant(tmp_path, "restir_ref/__init__.py", "")
    assert wheel_faults(tmp_path) == ["toy1d/__init__.py", "toy1d/py.typed", "restir_ref"]


def missing_commands(readme: str) -> list[str]:
    """Which of the newcomer's two commands do not stand near the top."""
    top = "\n".join(readme.splitlines()[:25])
    return [command for command in ("make figures", "make test") if command not in top]


def test_the_readme_opens_with_the_two_commands():
    assert missing_commands((ROOT / "README.md").read_text(encoding="utf-8")) == []


def test_a_readme_that_buries_its_commands_is_noticed():
    assert missing_commands("\n" * 25 + "make figures\nmake test") == ["make figures", "make test"]


# ---------------------------------------------------------------- set-up

NO_VENV = f"""
case "$*" in "-m venv "*) mkdir .venv; exit 1;; esac
exec '{sys.executable}' "$@"
"""
TOO_OLD = "exit 1"
NO_VENV_REMEDY, TOO_OLD_REMEDY = "apt-get install python3-venv", "make PYTHON=python3.12"
needs_make = pytest.mark.skipif(shutil.which("make") is None, reason="needs make")


def set_up(root: Path, makefile: str, script: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run `make setup` with a script for a Python."""
    for name, text in {"Makefile": makefile, "constraints.txt": "", "pyproject.toml": ""}.items():
        plant(root, name, text)
    plant(root, "python", f"#!/bin/sh\n{script}")
    (root / "python").chmod(0o755)
    ours = {name: value for name, value in os.environ.items() if "MAKE" not in name and name not in ("MFLAGS", "CI")}
    command = ["make", "setup", "PYTHON=./python"]
    return subprocess.run(command, cwd=root, env=ours | environment, capture_output=True, text=True, check=False)


def failed_setup(root: Path, makefile: str, script: str) -> tuple[str, bool]:
    """Run it with a Python that fails: what it says, and whether a .venv is left."""
    done = set_up(root, makefile, script)
    assert done.returncode != 0
    return done.stderr, (root / ".venv").exists()


@needs_make
@pytest.mark.parametrize(
    ("script", "remedy"), [(NO_VENV, NO_VENV_REMEDY), (TOO_OLD, TOO_OLD_REMEDY)], ids=["no venv", "too old"]
)
def test_a_failed_set_up_names_the_remedy_and_leaves_nothing_behind(tmp_path, script, remedy):
    said, left = failed_setup(tmp_path, MAKEFILE, script)
    assert remedy in said
    assert not left


@needs_make
def test_a_half_made_environment_and_an_unnamed_remedy_are_noticed(tmp_path):
    careless = MAKEFILE.replace("rm -rf", "true").replace('echo "$$NO_VENV"', "true")
    said, left = failed_setup(tmp_path, careless, NO_VENV)
    assert NO_VENV_REMEDY not in said
    assert left


NO_WITNESS = """
case "$*" in
    "-m venv "*) mkdir -p .venv/bin && cp python .venv/bin/python;;
    *reference*) exit 1;;
esac
"""


@needs_make
def test_set_up_does_without_mitsuba_where_there_is_no_package_of_it_and_says_so(tmp_path):
    done = set_up(tmp_path, MAKEFILE, NO_WITNESS)
    assert done.returncode == 0
    assert "is skipped" in done.stderr


@needs_make
@pytest.mark.parametrize("fails", ["reference", "dev"])
def test_ci_insists_on_mitsuba_and_everybody_on_the_rest(tmp_path, fails):
    environment = {"CI": "1"} if fails == "reference" else {}
    assert set_up(tmp_path, MAKEFILE, NO_WITNESS.replace("reference", fails), **environment).returncode != 0

"""The manifest of a folder of results: by which programs, from which commit and when they were computed."""

import json
import platform
import subprocess
from collections.abc import Iterable, Mapping
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from figures.engine import disk

ROOT = Path(__file__).resolve().parents[2]
"""The checkout."""
FORMAT = 1
NAME = "manifest.json"
PROGRAM = "restir-ref figures"
PACKAGES = ("restir-ref", "numpy", "scipy", "matplotlib", "tqdm")


def now() -> str:
    """The time, UTC, to the second."""
    return datetime.now(UTC).isoformat(timespec="seconds")


def environment() -> dict[str, Any]:
    """What the results may depend on besides the seed: versions, platform, commit."""
    return {"versions": versions(PACKAGES), "platform": platform.platform(), "git": git(ROOT)}


def versions(packages: Iterable[str]) -> dict[str, str | None]:
    """The versions of Python and of packages, null where one is not installed."""
    return {"python": platform.python_version(), **{name: _version(name) for name in packages}}


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def git(root: Path) -> dict[str, Any]:
    """The checked-out commit and whether files differ from it; null where there is no git or no commit."""
    commit = _git(root, "rev-parse", "--verify", "HEAD")
    status = _git(root, "status", "--porcelain") if commit else None
    return {"commit": commit, "dirty": None if status is None else bool(status)}


def _git(root: Path, *words: str) -> str | None:
    command = ["git", "--no-optional-locks", "-C", str(root), *words]
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=20)
    except (OSError, subprocess.TimeoutExpired):
        return None
    return done.stdout.strip() if done.returncode == 0 else None


def write(out: Path, run: Mapping[str, Any], figures: Mapping[str, Mapping[str, Any]]) -> None:
    """Keep the manifest: what holds for the run, and an entry per figure, those of earlier runs included."""
    data = {"program": PROGRAM, "format": FORMAT, **run, "figures": {**earlier(out), **figures}}
    disk.write_text(out / NAME, json.dumps(data, indent=1) + "\n")


def earlier(out: Path) -> dict[str, Any]:
    """The figures of the manifest that stands there; empty if there is none to trust."""
    figures = read(out).get("figures")
    return figures if isinstance(figures, dict) else {}


def read(out: Path) -> dict[str, Any]:
    """The manifest that stands there; empty if it is missing or damaged."""
    try:
        data = json.loads((out / NAME).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return data if isinstance(data, dict) else {}


def is_ours(path: Path) -> bool:
    """Whether a manifest was written by this program; raises ValueError if it cannot be read."""
    data = json.loads(path.read_text(encoding="utf-8"))
    return isinstance(data, dict) and data.get("program") == PROGRAM

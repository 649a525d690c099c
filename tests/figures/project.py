"""Projects made for one test: a ledger, a folder of tests, and figures of `tests.figures.demos`."""

import json
import os
import signal
import subprocess
import sys
from contextlib import contextmanager, suppress
from pathlib import Path

from figures.cli import main
from figures.project import ROOT, Project
from tests.figures.demos.stuck import STUCK


def claim(id_="DEMO-C01", quick="reproduced", paper=None):
    """A row of a ledger."""
    texts = {"paper": "DEMO", "class": "A", "source": "Fig. 1", "sentence": f"Sentence <{id_}>."}
    return {
        "id": id_,
        **texts,
        "criterion": "0.5",
        "worlds": ["toy1d"],
        "scenes": [],
        "expected": {"quick": quick, "paper": paper},
    }


CLAIMS = (claim(), claim("DEMO-C02", quick="refuted"))


def project(folder, *demos, claims=CLAIMS):
    """A project of its own."""
    (folder / "tests").mkdir(parents=True, exist_ok=True)
    (folder / "ledger.json").write_text(json.dumps({"format": 1, "claims": list(claims)}))
    return at(folder, tuple(f"tests.figures.demos.{name}" for name in demos))


def at(folder, modules):
    """The project in a folder."""
    return Project(modules, folder / "ledger.json", folder / "tests", folder / "paper.json", folder / "benchmarks")


def figures(here, *words):
    """The command in this process: its exit status."""
    return main([str(word) for word in words], here)


@contextmanager
def stuck(here, *words):
    """The command in a process group of its own, under way, with `demos.stuck` stuck; nothing of it stays."""
    command = [sys.executable, "-m", "tests.figures.project", str(here.ledger.parent), ",".join(here.modules)]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    place = {"cwd": ROOT, "env": os.environ | {STUCK: "1"}, "start_new_session": True}
    with subprocess.Popen([*command, *map(str, words)], **place, **pipes) as run:
        try:
            yield run
        finally:
            with suppress(ProcessLookupError):
                os.killpg(run.pid, signal.SIGKILL)


def arrays(out):
    """Every array file under a folder: relative path -> bytes."""
    return {path.relative_to(out).as_posix(): path.read_bytes() for path in sorted(out.rglob("*.npz"))}


def from_command_line(folder, modules, *words):
    """The command on a project that another process has made."""
    return main(words, at(Path(folder), tuple(modules.split(","))))


if __name__ == "__main__":
    sys.exit(from_command_line(*sys.argv[1:]))

"""Our own project: the wings in which the figures stand, and the files of claims, tests and long runs."""

from dataclasses import dataclass, field
from pathlib import Path

from figures.engine.manifest import ROOT
from figures.engine.registry import standing

WINGS = ("figures.gris", "figures.gradient", "figures.mcmc", "figures.ddgi", "figures.trust")
"""The papers in their order, then what no paper has."""


@dataclass(frozen=True)
class Project:
    """Where the commands find figures, claims, tests and what long runs found; those of tests use another one."""

    modules: tuple[str, ...] = field(default_factory=lambda: standing(WINGS))
    ledger: Path = ROOT / "figures" / "ledger.json"
    tests: Path = ROOT / "tests"
    paper: Path = ROOT / "figures" / "paper.json"
    benchmarks: Path = ROOT / "benchmarks"

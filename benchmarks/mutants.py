"""Mutation testing of the kernel: does a quick law fail for every small change of the resampler's code?

    python benchmarks/mutants.py [--jobs 2] [mis resampling restir streaming]

Every mutant (made by `mutations.py`, in memory) meets the tests marked `kernel` in a forked child that
imports the changed module instead of the real one, in a copy of the checkout.  It is *killed* when a test
fails or time runs out.  `EQUIVALENT` says which mutants no test can kill, and why.  Exits with 1 if more
than one in twenty of the others survives, or if that list is wrong.  Takes 8 minutes of one core; Linux.
"""

import argparse
import importlib.util
import multiprocessing
import os
import re
import resource
import shutil
import sys
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from importlib.machinery import ModuleSpec, SourceFileLoader
from multiprocessing.connection import Connection
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter, process_time
from types import CodeType
from typing import Any, NamedTuple

from mutations import Mutant, mutants

ROOT = Path(__file__).resolve().parents[1]
COPIED = ("restir_ref", "toy1d", "tests", "pyproject.toml")
MODULES = ("mis", "resampling", "restir", "streaming")
LOADED = ("numpy", "scipy.integrate", "scipy.stats", "hypothesis.extra.numpy", "pytest")
"""Loaded once, before the children fork: nothing that imports our own code."""
OPTIONS = (
    *("-x", "-q", "-m", "kernel", "--assert=plain", "-p", "no:cacheprovider", "-p", "no:unraisableexception"),
    *("-W", "ignore:Module already imported:pytest.PytestAssertRewriteWarning"),
)
CRASHES = ("TypeError", "NameError", "UnboundLocalError", "AttributeError")
"""Errors that a type checker would find, for the most part."""
LEAST = 0.95
"""The least share of mutants that must be killed, of those that are not equivalent."""
SECONDS, MEMORY = 60, 4 << 30
"""What a child may use, in seconds and bytes: some mutants enumerate without end."""

FORK = multiprocessing.get_context("fork")
KILLS: Counter[str] = Counter()
"""How many mutants each test has killed: the next one meets the likeliest killer first."""

SAME_DENSITY = "the density of every canonical input is p_hat"
COMMUTES = "min(a, b) = min(b, a)"
EQUIVALENT = {
    "mis._pair: return {np.asarray(...": "asarray is for the type checker",
    "mis._pair: ...canonical[{0 => -1}]...": SAME_DENSITY,
    "mis._canonical_share: ...canonical[{0 => -1}]...": SAME_DENSITY,
    "resampling: ONE = {np.array(1) => 1}": "a factor of 1, as an array or not",
    "resampling.gris: ...minimum({C, LARGEST_CONFIDENCE => LARGEST_CONFIDENCE, C}))": COMMUTES,
    "resampling._densities.q: ...inputs[{i => j}]...": "i = j in this branch",
    "resampling._check_input: for ...source.X.c), ('weight W', source.X.W})):": "which of two mistakes is named first",
    "restir.capped: ...minimum({wide(X.c), cap => cap, wide(X.c)}))": COMMUTES,
}
"""Mutants that compute the same, with the reason; `...` stands for anything."""


class Verdict(NamedTuple):
    """The first test that fails, if one does, its error, and the CPU time of the suite up to there."""

    test: str
    error: str
    seconds: float


# ---------------------------------------------------------------- one mutant


class Planted(SourceFileLoader):
    """Finds and loads one module, from a text that is not that of its file."""

    def __init__(self, mutant: Mutant) -> None:
        super().__init__(mutant.module, f"{mutant.module.replace('.', '/')}.py")
        self.source = mutant.source

    def find_spec(self, fullname: str, path: object = None, target: object = None) -> ModuleSpec | None:
        """As a finder of modules: itself, for its own module."""
        found = fullname == self.name
        return importlib.util.spec_from_file_location(fullname, self.path, loader=self) if found else None

    def get_code(self, fullname: str) -> CodeType:
        """The mutant's code."""
        return compile(self.source, self.path, "exec")


class Observer:
    """A pytest plugin that runs the likeliest killers first and notes which test fails first."""

    failed = error = ""

    def pytest_collection_modifyitems(self, items: list[Any]) -> None:
        """Called with all tests."""
        items.sort(key=lambda item: -KILLS[item.nodeid])

    def pytest_exception_interact(self, node: Any, call: Any) -> None:
        """Called for an exception in a test or an import."""
        if not self.failed:
            self.failed, self.error = node.nodeid, call.excinfo.type.__name__


def suite() -> list[str]:
    """Files that hold tests marked `kernel`, below the working directory."""
    return [str(path) for path in sorted(Path("tests").rglob("test_*.py")) if "mark.kernel" in path.read_text()]


def child(mutant: Mutant | None, to: Connection) -> None:
    """Run the suite against a mutant, or against the real code, and send the verdict."""
    import pytest  # noqa: PLC0415  (loaded already, and not before the right profile is chosen)

    silence = os.open(os.devnull, os.O_WRONLY)
    for stream in (1, 2):
        os.dup2(silence, stream)
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    if mutant is not None:
        sys.meta_path.insert(0, Planted(mutant))
    observer, before = Observer(), process_time()
    status = pytest.main([*OPTIONS, *suite()], plugins=[observer])
    failed = observer.failed or ("pytest itself" if status else "")
    to.send(Verdict(failed, observer.error, process_time() - before))


def verdict(mutant: Mutant | None) -> Verdict:
    """What the suite says, in a child of its own that is stopped when its time is up."""
    here, there = FORK.Pipe(duplex=False)
    process = FORK.Process(target=child, args=(mutant, there))
    process.start()
    there.close()
    try:
        heard: Verdict = here.recv() if here.poll(SECONDS) else Verdict("the clock", "timeout", SECONDS)
    except EOFError:
        heard = Verdict("the system", "crash", 0.0)
    process.kill()
    process.join()
    KILLS[heard.test] += mutant is not None
    return heard


# ---------------------------------------------------------------- all mutants


class Fate(NamedTuple):
    """A mutant, what the suite says of it, and why it is equivalent, if it is said to be."""

    mutant: Mutant
    said: Verdict
    reason: str

    @property
    def word(self) -> str:
        """In one word; a mutant that is killed is not equivalent, whatever is said."""
        return "killed" if self.said.test else "equivalent" if self.reason else "SURVIVED"

    def __str__(self) -> str:
        by = f"{self.said.error} in {self.said.test}" if self.said.test else self.reason
        return f"{self.word:10} {self.mutant.place}  {self.mutant.name}  [{by}]"


def means(pattern: str, mutant: Mutant) -> bool:
    """Whether a key of `EQUIVALENT` means this mutant."""
    return bool(re.fullmatch(".*".join(map(re.escape, pattern.split("..."))), mutant.name))


def judged(them: Sequence[Mutant], jobs: int) -> list[Fate]:
    """Print and return the fate of every mutant."""
    fates = []
    with ProcessPoolExecutor(jobs, mp_context=FORK) as pool:
        for mutant, said in zip(them, pool.map(verdict, them), strict=True):
            reason = next((why for pattern, why in EQUIVALENT.items() if means(pattern, mutant)), "")
            fates.append(Fate(mutant, said, reason))
            print(fates[-1], flush=True)
    return fates


def summary(fates: Sequence[Fate]) -> float:
    """Print the scores, and return that of the mutants that are not equivalent."""
    count = Counter(fate.word for fate in fates)
    crashed = sum(fate.said.error in CRASHES for fate in fates)
    killed, alive = count["killed"], count["SURVIVED"]
    score = killed / max(1, killed + alive)
    print(f"\n{len(fates)} mutants: {killed} killed, {alive} survived, {count['equivalent']} equivalent")
    print(f"{killed / max(1, len(fates)):7.2%} of all were killed")
    print(f"{score:7.2%} of those that are not equivalent")
    print(f"{(killed - crashed) / max(1, killed - crashed + alive):7.2%} without the {crashed} that ended in a crash")
    return score


def wrongly_listed(fates: Sequence[Fate]) -> list[str]:
    """Entries of `EQUIVALENT` that a test disproves, or that mean no mutant of these modules."""
    killed = [f"not equivalent: {fate.mutant.name}" for fate in fates if fate.reason and fate.said.test]
    modules = {fate.mutant.name.partition(".")[0].partition(":")[0] for fate in fates}
    listed = (pattern for pattern in EQUIVALENT if re.split(r"[.:]", pattern)[0] in modules)
    stale = [each for each in listed if not any(means(each, fate.mutant) for fate in fates)]
    return killed + [f"means no mutant: {each}" for each in stale]


def main(arguments: Sequence[str]) -> int:
    """Copy the checkout, run the suite once as it is, then against every mutant; 0 if enough are killed."""
    parser = argparse.ArgumentParser(description="Mutation testing of the kernel.")
    parser.add_argument("modules", nargs="*", default=MODULES, help="modules of restir_ref")
    parser.add_argument("--jobs", type=int, default=1, help="children at a time")
    options = parser.parse_args(arguments)
    with TemporaryDirectory() as copy:
        for name in COPIED:
            (shutil.copytree if (ROOT / name).is_dir() else shutil.copy)(ROOT / name, Path(copy, name))
        os.chdir(copy)
        sys.path.insert(0, copy)
        os.environ["HYPOTHESIS_PROFILE"] = "kernel"
        for name in LOADED:
            importlib.import_module(name)
        return run(options.modules, options.jobs)


def run(modules: Sequence[str], jobs: int) -> int:
    """In the copy: everything but the copying."""
    start = perf_counter()
    verdict(None)  # compiles the tests
    real = verdict(None)
    print(f"the real code: {real.error} {real.test or 'passes'} in {real.seconds:.1f} s of one core", flush=True)
    if real.test:
        return 1
    fates = judged([each for name in modules for each in mutants(f"restir_ref.{name}", source(name))], jobs)
    score, wrong = summary(fates), wrongly_listed(fates)
    print(*wrong, f"{perf_counter() - start:.0f} s by the clock, {jobs} at a time", sep="\n")
    return int(score < LEAST or bool(wrong))


def source(name: str) -> str:
    """A module's text."""
    return Path("restir_ref", f"{name}.py").read_text(encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

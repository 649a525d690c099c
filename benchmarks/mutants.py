"""Mutation testing: does a quick law fail for every small change of our code?

    python benchmarks/mutants.py [kernel theory ...] [--sample 200] [--only restir_ref/metrics.py ...] [--jobs 2]

Every mutant (made by `mutations.py`, in memory) meets tests of its group's suite (`groups.py`) in a forked
child that imports the changed module instead of the real one, in a copy of the checkout: those that reach
the changed function, for `--budget` seconds (`reach.py`).  It is *killed* when a test fails or time runs out.
Groups say which mutants no test can kill, and why.  Exits with 1 if more than one in twenty of the others
survives, or if that list is wrong.

A sample is random, the same every time and part of any larger one; it stands for its group up to the
interval that is printed.  What was found is kept below `out/mutants/`: a killed mutant stays killed while
its module and the test file that killed it are unchanged; one that survived is tried again when anything in
its suite has changed.  Other modules are not asked: `--afresh` forgets everything.  The kernel takes 8
minutes of one core; Linux.

Where nearly all tests reach nearly everything (audit, zoo), 6 seconds leave out the test that would notice:
`--budget 60`.
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
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from importlib.machinery import ModuleSpec, SourceFileLoader
from multiprocessing.connection import Connection
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from time import perf_counter, process_time
from types import CodeType
from typing import Any, NamedTuple

from groups import GROUPS, Group
from mutations import Mutant, mutants
from reach import OURS, Kept, Reached, Watcher, digest, suite, together

ROOT = Path(__file__).resolve().parents[1]
NOT_COPIED = shutil.ignore_patterns("out*", ".*", "__pycache__", "build", "dist")
LOADED = ("numpy", "scipy.integrate", "scipy.stats", "hypothesis.extra.numpy", "pytest", "matplotlib.pyplot")
"""Loaded once, before the children fork: nothing that imports our own code."""
OPTIONS = (
    *("-q", "--assert=plain", "-p", "no:cacheprovider", "-p", "no:unraisableexception"),
    *("-W", "ignore:Module already imported:pytest.PytestAssertRewriteWarning"),
)
CRASHES = ("TypeError", "NameError", "UnboundLocalError", "AttributeError")
"""Errors that a type checker would find, for the most part."""
LEAST = 0.95
"""The least share of mutants that must be killed, of those that are not equivalent."""
SECONDS, MEMORY = 60, 4 << 30
"""What a child may use of the processor and of the memory: some mutants enumerate without end."""
AT_MOST = 10 * SECONDS
"""Seconds by the clock, for those that wait without end; a busy machine kills no mutant."""
PASSED = (0, 5)
"""Exit statuses of pytest: no test failed, or none was left."""

FORK = multiprocessing.get_context("fork")
KILLS: Counter[str] = Counter()
"""How many mutants each test has killed: the next one meets the likeliest killer first."""
SUITE: list[Any] = [[], 6.0]
"""The tests of the group at hand and their budget in seconds; children inherit it."""


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
    """A pytest plugin that runs chosen tests, in their order, and notes which one fails first."""

    failed = error = ""

    def __init__(self, chosen: Sequence[str]) -> None:
        self.place = {test: k for k, test in enumerate(chosen)}

    def pytest_collection_modifyitems(self, items: list[Any]) -> None:
        """Called with all tests."""
        chosen = [item for item in items if item.nodeid in self.place]
        items[:] = sorted(chosen, key=lambda item: self.place[item.nodeid])

    def pytest_exception_interact(self, node: Any, call: Any) -> None:
        """Called for an exception in a test or an import."""
        if not self.failed:
            self.failed, self.error = node.nodeid, call.excinfo.type.__name__


def session(plugin: object, *arguments: str) -> int:
    """Run pytest without a word, and without all the memory and time."""
    import pytest  # noqa: PLC0415  (loaded already, and not before the right profile is chosen)

    silence = os.open(os.devnull, os.O_WRONLY)
    for stream in (1, 2):
        os.dup2(silence, stream)
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS))
    return int(pytest.main([*OPTIONS, *arguments], plugins=[plugin]))


def child(mutant: Mutant, chosen: Sequence[str], to: Connection) -> None:
    """Run tests against a mutant and send the verdict."""
    sys.meta_path.insert(0, Planted(mutant))
    observer, before = Observer(chosen), process_time()
    status = session(observer, "-x", *dict.fromkeys(test.partition("::")[0] for test in chosen))
    failed = observer.failed or ("" if status in PASSED else "pytest itself")
    to.send(Verdict(failed, observer.error, process_time() - before))


def heard(target: Callable[..., None], *arguments: object) -> Iterator[Any]:
    """What a child of its own says, and how it ended if it had to be stopped or fell."""
    here, there = FORK.Pipe(duplex=False)
    process = FORK.Process(target=target, args=(*arguments, there))
    process.start()
    there.close()
    end = perf_counter() + AT_MOST
    try:
        while here.poll(max(0, end - perf_counter())):
            yield here.recv()
        yield Verdict("the clock", "timeout", AT_MOST)
    except EOFError:
        yield Verdict("the system", "crash or timeout", 0.0)
    finally:
        process.kill()
        process.join()


def verdict(mutant: Mutant) -> Verdict:
    """What the tests that reach a mutant say."""
    chosen = suite(mutant.module, mutant.scope, KILLS, *SUITE)
    said: Verdict = next(heard(child, mutant, chosen)) if chosen else Verdict("", "no test reaches it", 0.0)
    KILLS[said.test] += 1
    return said


# ---------------------------------------------------------------- the suite


def watched(file: str, marker: str, to: Connection) -> None:
    """Run a file of tests on the real code, and send what each of them reaches."""
    session(Watcher(to.send), "-m", marker, file)


def reached(group: Group) -> list[Reached]:
    """All tests of a group that pass; measured anew where their file or any module has changed."""
    tests, kept = [], Kept(ROOT / "out" / "mutants" / "reach.jsonl")
    modules = sorted(str(path) for name in OURS for path in Path(name).rglob("*.py"))
    for file in group.tests():
        key = digest(group.marker, file, *modules)
        if kept.get(key) is None:
            kept[key] = [said for said in heard(watched, file, group.marker) if not isinstance(said, Verdict)]
        tests += together(kept.get(key))
    return tests


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
        by = f"{self.said.error} in {self.said.test}" if self.said.test else self.reason or self.said.error
        return f"{self.word:10} {self.mutant.place}  {self.mutant.name}  [{by}]"


def means(pattern: str, mutant: Mutant) -> bool:
    """Whether a pattern of `equivalent` means this mutant."""
    return bool(re.fullmatch(".*".join(map(re.escape, pattern.split("..."))), mutant.name))


def judged(group: Group, them: Sequence[Mutant], kept: Kept, jobs: int) -> list[Fate]:
    """Print and return the fate of every mutant."""
    known = {mutant: remembered(group, mutant, kept) for mutant in them}
    KILLS.clear()
    KILLS.update(said.test for said in known.values() if said)
    fates = []
    with ProcessPoolExecutor(jobs, mp_context=FORK) as pool:
        new = pool.map(verdict, [mutant for mutant in them if not known[mutant]])
        for mutant in them:
            said = known[mutant] or next(new)
            kept[f"{mutant.place} {mutant.name}"] = [grounds(group, mutant, said), *said]
            reason = next((why for pattern, why in group.equivalent.items() if means(pattern, mutant)), "")
            fates.append(Fate(mutant, said, reason))
            print(fates[-1], flush=True)
    return fates


def remembered(group: Group, mutant: Mutant, kept: Kept) -> Verdict | None:
    """What is kept about a mutant, where it still holds."""
    found = kept.get(f"{mutant.place} {mutant.name}")
    said = Verdict(*found[1:]) if found else None
    return said if said and found[0] == grounds(group, mutant, said) else None


def grounds(group: Group, mutant: Mutant, said: Verdict) -> str:
    """What a verdict rests on: the mutant, and the file of the test that kills it, or all tests."""
    file = said.test.partition("::")[0]
    if Path(file).is_file():
        return digest(mutant.source, file)
    return digest(f"{SUITE[1]} {mutant.source}", *group.tests())


def summary(fates: Sequence[Fate], of: int) -> float:
    """Print the scores, and return that of the mutants that are not equivalent."""
    count = Counter(fate.word for fate in fates)
    crashed = sum(fate.said.error in CRASHES for fate in fates)
    killed, alive = count["killed"], count["SURVIVED"]
    score = killed / max(1, killed + alive)
    low, high = interval(killed, killed + alive) if of > len(fates) else (score, score)
    print(f"\n{len(fates)} of {of} mutants: {killed} killed, {alive} survived, {count['equivalent']} equivalent")
    print(f"{killed / max(1, len(fates)):7.2%} of all were killed")
    print(f"{score:7.2%} of those that are not equivalent, {low:.1%} to {high:.1%} of the whole group")
    print(f"{(killed - crashed) / max(1, killed - crashed + alive):7.2%} without the {crashed} that ended in a crash")
    return score


def interval(k: int, n: int, z: float = 1.96) -> tuple[float, float]:
    """Wilson's interval of a share of which k of n were seen."""
    middle, half = k + z**2 / 2, z * (k * (n - k) / n + z**2 / 4) ** 0.5
    return (middle - half) / (n + z**2), (middle + half) / (n + z**2)


def wrongly_listed(group: Group, fates: Sequence[Fate], everything: Sequence[Mutant]) -> list[str]:
    """Entries of `equivalent` that a test disproves, or that mean no mutant of these modules."""
    killed = [f"not equivalent: {fate.mutant.name}" for fate in fates if fate.reason and fate.said.test]
    modules = {re.split(r"[.:]", mutant.name)[0] for mutant in everything}
    listed = (pattern for pattern in group.equivalent if re.split(r"[.:]", pattern)[0] in modules)
    stale = [each for each in listed if not any(means(each, mutant) for mutant in everything)]
    return killed + [f"means no mutant: {each}" for each in stale]


# ---------------------------------------------------------------- the command


def run(name: str, options: argparse.Namespace) -> int:
    """One group, in the copy: 0 if enough mutants are killed."""
    start, group, kept = perf_counter(), GROUPS[name], Kept(ROOT / "out" / "mutants" / f"{name}.jsonl")
    SUITE[:] = reached(group), options.budget
    print(f"{name}: {len(SUITE[0])} tests, {perf_counter() - start:.0f} s to see what they reach", flush=True)
    files = [file for file in group.files() if file in (options.only or [file])]
    everything = [each for file in files for each in mutants(file, Path(file).read_text(encoding="utf-8"))]
    shuffled = Random(name).sample(everything, len(everything))
    sample = shuffled[: options.sample] if options.sample else everything
    fates = judged(group, sample, kept, options.jobs)
    score, wrong = summary(fates, len(everything)), wrongly_listed(group, fates, everything)
    print(*wrong, f"{perf_counter() - start:.0f} s by the clock, {options.jobs} at a time", sep="\n", flush=True)
    return int(score < LEAST or bool(wrong))


def main(arguments: Sequence[str]) -> int:
    """Copy the checkout, and run groups there."""
    parser = argparse.ArgumentParser(description="Mutation testing.")
    parser.add_argument("groups", nargs="*", default=["kernel"], help=f"{', '.join(GROUPS)}; the kernel by default")
    parser.add_argument("--jobs", type=int, default=1, help="children at a time")
    parser.add_argument("--sample", type=int, default=0, help="mutants of each group, drawn at random; all by default")
    parser.add_argument("--budget", type=float, default=6, help="seconds of tests for each mutant; 6 by default")
    parser.add_argument("--only", nargs="+", metavar="FILE", help="some of the groups' modules")
    parser.add_argument("--afresh", action="store_true", help="forget what was found before")
    options = parser.parse_args(arguments)
    if options.afresh:
        shutil.rmtree(ROOT / "out" / "mutants", ignore_errors=True)
    with TemporaryDirectory() as copy:
        shutil.copytree(ROOT, copy, ignore=NOT_COPIED, dirs_exist_ok=True)
        os.chdir(copy)
        sys.path.insert(0, copy)
        os.environ["HYPOTHESIS_PROFILE"] = "kernel"
        for name in LOADED:
            importlib.import_module(name)
        return max([run(name, options) for name in options.groups])


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

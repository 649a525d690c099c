"""Everything that a newcomer meets has an example in its docstring, which runs and prints what it says."""

import doctest
import importlib
import inspect
from collections.abc import Iterator
from io import StringIO

import pytest

from tests.checkout import ROOT, WORLDS, modules

PACKAGES = ("restir_ref", *WORLDS)
MET = ("restir_ref", "restir_ref.audit", *WORLDS)
"""The packages whose `__all__` is what a newcomer imports."""

ALSO = (
    "restir_ref.decorrelation.mutate",
    "restir_ref.decorrelation.mutations",
    "restir_ref.gradient.Pairs",
    "restir_ref.images.random_in_disk",
    "restir_ref.images.tiles",
    "restir_ref.loop.Preset",
    "restir_ref.loop.frame",
    "restir_ref.loop.random_in_row",
    "restir_ref.metrics.mape",
    "restir_ref.metrics.rel_mse",
    "restir_ref.mis.defensive",
    "restir_ref.mis.pairwise",
    "restir_ref.mis.talbot",
    "restir_ref.oracle.laws.bias_of",
    "restir_ref.poisson.l2",
    "restir_ref.poisson_l1.l1",
    "restir_ref.streaming.select_streaming",
    "restir_ref.transport.paths.Connectability",
    "restir_ref.transport.paths.Tracer",
    "restir_ref.transport.paths.trace",
    "restir_ref.transport.proofs.judge.judge",
    "restir_ref.transport.restir_pt.PathIntegrals",
    "restir_ref.windows.windowed",
    "flatland2d.scenes.Setting",
    "tracer3d.scenes.Setting",
)
RESULTS = "Report"
"""What a function returns is shown where the function is."""


def met() -> Iterator[tuple[str, object]]:
    """The functions and classes that a newcomer meets, by their full names; errors and results left out."""
    for package in MET:
        module = importlib.import_module(package)
        for name in module.__all__:
            found = getattr(module, name)
            if inspect.isfunction(found) or (inspect.isclass(found) and not issubclass(found, Exception)):
                yield f"{found.__module__}.{found.__qualname__}", found
    for name in ALSO:
        module, _, last = name.rpartition(".")
        yield name, getattr(importlib.import_module(module), last)


def without_example(found: Iterator[tuple[str, object]]) -> list[str]:
    return sorted({name for name, each in found if ">>> " not in (each.__doc__ or "") and not name.endswith(RESULTS)})


def examples() -> list[doctest.DocTest]:
    """The examples of all docstrings, in modules that have any."""
    files = [module for module in modules(ROOT, PACKAGES) if ">>> " in module.path.read_text(encoding="utf-8")]
    found = (doctest.DocTestFinder().find(importlib.import_module(module.name), module.name) for module in files)
    return [each for tests in found for each in tests if each.examples]


EXAMPLES = examples()


def complaints(test: doctest.DocTest) -> str:
    """What is printed otherwise than the docstring says; empty if nothing is."""
    said = StringIO()
    doctest.DocTestRunner(verbose=False, optionflags=doctest.REPORT_NDIFF).run(test, out=said.write)
    return said.getvalue()


def test_everything_that_a_newcomer_meets_has_an_example():
    assert without_example(met()) == []


def test_an_entry_without_an_example_is_noticed():
    assert without_example(iter([("here", test_an_entry_without_an_example_is_noticed)])) == ["here"]


@pytest.mark.parametrize("test", EXAMPLES, ids=lambda test: test.name)
def test_an_example_runs_as_it_is_copied_and_prints_what_its_docstring_says(test):
    """In an empty module, as somebody who copies it would run it."""
    assert complaints(doctest.DocTest(test.examples, {}, test.name, None, None, None)) == ""


def test_an_example_that_prints_something_else_is_noticed():
    test = doctest.DocTestParser().get_doctest(">>> 1 + 1\n3\n", {}, "wrong", None, None)
    assert "- 3" in complaints(test)

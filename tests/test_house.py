"""Laws over the source: imports point down, chance has one door, everything public is explained.

Every law is a function that lists offenders; its twin plants one, which must be listed.
"""

import ast
import re
import tokenize
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter
from importlib.util import resolve_name
from io import StringIO
from pathlib import Path

import pytest

from figures.project import WINGS
from tests.checkout import ROOT, WORLDS, Module, modules, plant

THEORY, TRANSPORT = "restir_ref", "restir_ref.transport"
PAPERS = ("figures.gris", "figures.gradient", "figures.mcmc", "figures.ddgi", "figures.trust")
"""Wings that hold nothing but figures."""
CLAIMS, ENGINE, REPORT, SHARED = "figures.claims", "figures.engine", "figures.report", "figures.experiments"
STORE, STYLE = "figures.engine.store", "figures.report.style"
"""What of the engine reference images need, and what of the report a figure's `draw` needs."""
BASELINES, CACHE, PROOFS = f"{TRANSPORT}.baselines", f"{TRANSPORT}.cache", f"{TRANSPORT}.proofs"
BELOW = {THEORY, TRANSPORT, BASELINES, CACHE, PROOFS, *WORLDS}
MAY_IMPORT = {
    THEORY: {THEORY},
    TRANSPORT: {THEORY, TRANSPORT},
    BASELINES: {THEORY, TRANSPORT, BASELINES, CACHE},
    CACHE: {THEORY, TRANSPORT, CACHE},
    PROOFS: {THEORY, TRANSPORT, CACHE, PROOFS},
    **{world: {THEORY, TRANSPORT, BASELINES, CACHE, PROOFS, world} for world in WORLDS},
    CLAIMS: {THEORY, CLAIMS},
    STORE: {CLAIMS, ENGINE},
    ENGINE: {CLAIMS, ENGINE, STORE},
    STYLE: {STYLE},
    REPORT: {CLAIMS, ENGINE, STORE, REPORT, STYLE},
    SHARED: BELOW | {CLAIMS, STORE, SHARED},
    **{wing: BELOW | {CLAIMS, SHARED, STYLE, wing} for wing in PAPERS},
    "figures": {CLAIMS, ENGINE, STORE, REPORT, STYLE, "figures"},
    "notebooks": BELOW | {CLAIMS, STYLE, SHARED, *PAPERS, "notebooks"},
}
FLOORS = (*MAY_IMPORT, "tests", "benchmarks")
PACKAGES = (THEORY, *WORLDS, "figures", "notebooks")

# ---------------------------------------------------------------- imports


def floor(name: str) -> str | None:
    """The floor of the house a dotted name belongs to; None for other people's packages."""
    return max((f for f in FLOORS if f"{name}.".startswith(f"{f}.")), key=len, default=None)


def imported(module: Module) -> Iterator[str]:
    """Dotted names a module imports, also inside functions and for type checking."""
    package = module.name if module.path.stem == "__init__" else module.name.rpartition(".")[0]
    for node in ast.walk(module.tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            source = resolve_name("." * node.level + (node.module or ""), package)
            yield from (f"{source}.{alias.name}" for alias in node.names)


def upward_imports(root: Path) -> list[str]:
    """Imports that do not point down: theory, transport, worlds (side by side), figures."""
    found = ((module.name, name) for module in modules(root, PACKAGES) for name in imported(module))
    ours = ((by, name) for by, name in found if floor(name))
    return [f"{by} imports {name}" for by, name in ours if floor(name) not in MAY_IMPORT[floor(by)]]


def import_cycle(root: Path) -> list[str]:
    """A chain of modules that import one another when the program runs, if there is one."""
    parsed = {module.name: untyped(module) for module in modules(root, PACKAGES)}
    graph = {name: owners(imported(module), parsed.keys()) - {name} for name, module in parsed.items()}
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as cycle:
        return cycle.args[1]
    return []


def untyped(module: Module) -> Module:
    """The module without what only a type checker imports."""
    guards = [n for n in module.tree.body if isinstance(n, ast.If) and "TYPE_CHECKING" in ast.unparse(n.test)]
    return module._replace(tree=ast.Module([n for n in module.tree.body if n not in guards], []))


def owners(names: Iterator[str], ours: set[str]) -> set[str]:
    """The modules that hold the imported names; a package's __init__ owns only what is not a module."""
    return {name if name in ours else name.rpartition(".")[0] for name in names} & ours


def test_imports_point_down():
    assert upward_imports(ROOT) == []


def test_imports_make_no_cycle():
    assert import_cycle(ROOT) == []


UPWARD = {
    "theory to world": ("restir_ref/mis.py", "import toy1d.pixels"),
    "theory to figures": ("restir_ref/mis.py", "from figures.report import style"),
    "theory to transport": ("restir_ref/mis.py", "from . import transport"),
    "oracle to transport": ("restir_ref/oracle/audit.py", "from ..transport.paths import trace"),
    "renderer to baseline": ("restir_ref/transport/paths.py", "from restir_ref.transport.baselines import restir_gi"),
    "renderer to cache": ("restir_ref/transport/paths.py", "from .cache.field import Field"),
    "cache to baseline": ("restir_ref/transport/cache/update.py", "from ..baselines import restir_di"),
    "cache to proof": ("restir_ref/transport/cache/update.py", "from ..proofs import reading"),
    "cache to world": ("restir_ref/transport/cache/maps.py", "from flatland2d.directions import Bins"),
    "renderer to proof": ("restir_ref/transport/restir_pt.py", "from .proofs.judge import judge"),
    "baseline to proof": ("restir_ref/transport/baselines/restir_gi.py", "from ..proofs import reading"),
    "proof to baseline": ("restir_ref/transport/proofs/judge.py", "from ..baselines import restir_di"),
    "transport to world": ("restir_ref/transport/paths.py", "def late():\n    from toy1d import pixels"),
    "world to world": ("flatland2d/scenes.py", "from toy1d import pixels"),
    "figures to tests": ("figures/runner.py", "from tests import conftest"),
    "claims to engine": ("figures/claims/ledger.py", "from figures.engine.registry import load"),
    "store to report": ("figures/engine/store.py", "from figures.report import tables"),
    "engine to report": ("figures/engine/run.py", "def late():\n    from figures.report.report import write"),
    "engine to a figure": ("figures/engine/registry.py", "import figures.gris.gris_f02"),
    "engine to theory": ("figures/engine/jobs.py", "from restir_ref import Live"),
    "style to report": ("figures/report/style.py", "from figures.report import page"),
    "report to a figure": ("figures/report/page.py", "from figures.gris.gris_f02 import FIGURE"),
    "experiments to a figure": ("figures/experiments/exact.py", "from figures.mcmc import mcmc_c09"),
    "experiments to style": ("figures/experiments/chains.py", "from figures.report import style"),
    "experiments to engine": ("figures/experiments/offline.py", "from figures.engine import jobs"),
    "gris to engine": ("figures/gris/gris_f02.py", "from figures.engine.jobs import stream"),
    "gris to gradient": ("figures/gris/gris_f02.py", "from figures.gradient.gpt_f03 import Exact"),
    "gradient to gris": ("figures/gradient/gpt_f03.py", "from figures.gris import gris_f02"),
    "mcmc to trust": ("figures/mcmc/mcmc_1d.py", "from figures.trust.zoo import FIGURE"),
    "ddgi to mcmc": ("figures/ddgi/probes.py", "from figures.mcmc import mcmc_1d"),
    "trust to report": ("figures/trust/zoo.py", "from figures.report import page"),
    "command to a figure": ("figures/cli.py", "from figures.gris import gris_f02"),
    "notebooks to engine": ("notebooks/frames.py", "from figures.engine import run"),
}


@pytest.mark.parametrize(("path", "text"), UPWARD.values(), ids=UPWARD)
def test_an_import_that_points_up_is_noticed(tmp_path, path, text):
    assert len(upward_imports(plant(tmp_path, path, text))) == 1


def test_imports_that_point_down_are_left_alone(tmp_path):
    plant(tmp_path, "restir_ref/transport/paths.py", "from restir_ref import batch\nfrom . import vectors")
    plant(tmp_path, "figures/gris/two_pixels.py", "import numpy\nfrom toy1d.pixels import two_pixels")
    assert upward_imports(tmp_path) == import_cycle(tmp_path) == []


def test_there_is_an_upward_import_from_every_wing():
    planted = {floor(path.removesuffix(".py").replace("/", ".")) for path, _ in UPWARD.values()}
    assert planted >= {name for name in MAY_IMPORT if name.startswith("figures")}


def homeless(root: Path) -> list[str]:
    """Packages in figures/ that are no wing of the house."""
    folders = (path for path in sorted((root / "figures").iterdir()) if (path / "__init__.py").exists())
    return [path.name for path in folders if f"figures.{path.name}" not in MAY_IMPORT]


def test_every_package_of_figures_is_a_wing():
    assert homeless(ROOT) == []
    assert set(WINGS) <= set(PAPERS)


def test_a_package_that_is_no_wing_is_noticed(tmp_path):
    assert homeless(plant(tmp_path, "figures/attic/__init__.py", ""))


def pictures(root: Path) -> list[str]:
    """Modules of claims and engine that import matplotlib when the program runs."""
    blind = [module for module in modules(root, ("figures",)) if floor(module.name) in {CLAIMS, ENGINE, STORE}]
    return [module.name for module in blind for name in imported(untyped(module)) if name.startswith("matplotlib")]


def test_claims_and_engine_know_no_picture():
    assert pictures(ROOT) == []


@pytest.mark.parametrize("path", ["claims/figure.py", "engine/finish.py", "engine/store.py"])
def test_a_picture_in_claims_or_engine_is_noticed(tmp_path, path):
    assert pictures(plant(tmp_path, f"figures/{path}", "def late():\n    from matplotlib.figure import Figure"))


def test_a_cycle_is_noticed(tmp_path):
    plant(tmp_path, "toy1d/pixels.py", "from toy1d.scenes import ajar")
    assert not import_cycle(plant(tmp_path, "toy1d/scenes.py", "if TYPE_CHECKING:\n    from toy1d import pixels"))
    assert import_cycle(plant(tmp_path, "toy1d/scenes.py", "from toy1d import pixels"))


# ---------------------------------------------------------------- figures are found, not listed


def listed(root: Path) -> list[str]:
    """Strings outside the figures' wings that name a module of theirs, as a list of figures would."""
    ours = list(modules(root, ("figures",)))
    figures = {module.path.stem for module in ours if floor(module.name) in PAPERS} - {"__init__"}
    others = (module for module in ours if floor(module.name) not in PAPERS)
    strings = ((module.name, text) for module in others for text in constants(module))
    return [f"{by} names {text}" for by, text in strings if re.split(r"[./]", text.removesuffix(".py"))[-1] in figures]


def constants(module: Module) -> Iterator[str]:
    """The strings of a module, docstrings among them."""
    nodes = (node.value for node in ast.walk(module.tree) if isinstance(node, ast.Constant))
    yield from (value for value in nodes if isinstance(value, str))


def test_no_list_of_figures_exists():
    assert listed(ROOT) == []


@pytest.mark.parametrize("name", ["figures.gris.gris_f02", "gris_f02", "figures/gris/gris_f02.py"])
@pytest.mark.parametrize("path", ["project.py", "engine/registry.py", "report/page.py"])
def test_a_list_of_figures_is_noticed(tmp_path, path, name):
    plant(tmp_path, "figures/gris/gris_f02.py", "")
    assert listed(plant(tmp_path, f"figures/{path}", f'MODULES = ("{name}",)'))


# ---------------------------------------------------------------- chance

DOORS = ("restir_ref.chance", "restir_ref.transport.proofs.golden.make", "tracer3d.cli")
DICE = re.compile(r"(?:(?:np|numpy)\.)?random\.(?!Generator$)\w+|(?:numpy\.)?random$")


def own_dice(root: Path) -> list[str]:
    """Uses of a random number generator below the figures; only `chance.py` is the door, and commands bring a seed."""
    below = [module for module in modules(root, (THEORY, *WORLDS)) if module.name not in DOORS]
    uses = ((module, use) for module in below for use in (*imported(module), *attributes(module)))
    return [f"{module.name} uses {use}" for module, use in uses if DICE.match(use)]


def attributes(module: Module) -> Iterator[str]:
    """Every dotted expression of a module, such as `np.random.default_rng`."""
    return (ast.unparse(node) for node in ast.walk(module.tree) if isinstance(node, ast.Attribute))


def test_chance_has_one_door():
    assert own_dice(ROOT) == []


THROWS = (
    "import numpy as np\nx = np.random.default_rng(1)",
    "import numpy\nnumpy.random.seed(1)",
    "from numpy import random",
    "from numpy.random import default_rng",
    "import random",
    "from random import gauss",
)


@pytest.mark.parametrize("text", THROWS)
def test_dice_thrown_below_the_figures_are_noticed(tmp_path, text):
    assert own_dice(plant(tmp_path, "restir_ref/oracle/laws.py", text))


def test_taking_a_generator_from_the_caller_is_no_throw(tmp_path):
    text = "import numpy as np\ndef audit(*, rng: np.random.Generator):\n    return Live(rng)"
    assert own_dice(plant(tmp_path, "toy1d/pixels.py", text)) == []


# ---------------------------------------------------------------- words


def undocumented(root: Path) -> list[str]:
    """Public modules, classes and functions of our packages without a docstring."""
    found = ((module.name, name) for module in modules(root, PACKAGES) for name in silent(module.tree, "module"))
    return [f"{module}: {name}" for module, name in found]


def silent(node: ast.Module | ast.ClassDef | ast.FunctionDef, name: str) -> Iterator[str]:
    """Names of the public parts of a node that have no docstring, its own first."""
    if ast.get_docstring(node) is None:
        yield name
    parts = node.body if not isinstance(node, ast.FunctionDef) else []
    for part in parts:
        if isinstance(part, ast.ClassDef | ast.FunctionDef) and not part.name.startswith("_"):
            yield from silent(part, part.name)


def test_everything_public_has_a_docstring():
    assert undocumented(ROOT) == []


SILENT = ("x = 1", '"""."""\ndef f(): pass', '"""."""\nclass A:\n    """."""\n    def f(self): pass')


@pytest.mark.parametrize("text", SILENT)
def test_a_missing_docstring_is_noticed(tmp_path, text):
    assert undocumented(plant(tmp_path, "toy1d/pixels.py", text))


# The four papers are cited by a key in capitals, [GRIS Eq. 36] or [GRIS 6.3]; others as [Chao 1982].
KEY = r"[A-Z]{3,}|[A-Z][a-z]+ \d{4}"
CITED = re.compile(rf"(?<![\w\]])\[({KEY})(?:\]|,? (?:Eqs?|Secs?|Figs?|Alg|Def|Thm|Theorem|Table|App|\d+)\b)")
EXPLAINED = re.compile(rf"\*\*\[({KEY})\]\*\*")


def unexplained_keys(root: Path) -> list[str]:
    """Citations in docstrings, comments and other strings whose key docs/references.md does not explain."""
    explained = set(EXPLAINED.findall((root / "docs" / "references.md").read_text(encoding="utf-8")))
    said = ((module.name, text) for module in modules(root, PACKAGES) for text in words(module))
    cited = {(name, key) for name, text in said for key in CITED.findall(text)}
    return [f"{name} cites [{key}]" for name, key in sorted(cited) if key not in explained]


def words(module: Module) -> Iterator[str]:
    """What a module says: strings, docstrings among them, and comments; not the code, where [SCENE] is a list."""
    yield from constants(module)
    tokens = tokenize.generate_tokens(StringIO(module.path.read_text(encoding="utf-8")).readline)
    yield from (token.string for token in tokens if token.type == tokenize.COMMENT)


def test_every_cited_key_is_explained():
    assert unexplained_keys(ROOT) == []


UNEXPLAINED = ("[GROS Eq. 3]", "[GROS 3.1]", "[GROS]", "[Veach 1896]", "[Veach 1896, Eq. 9]")


SAID = {"docstring": '"""p = q.  {}"""', "comment": "x = 1  # p = q.  {}", "string": 'FIGURE = dict(source="{}")'}


@pytest.mark.parametrize("said", SAID)
@pytest.mark.parametrize("citation", UNEXPLAINED)
def test_an_unexplained_key_is_noticed(tmp_path, citation, said):
    plant(tmp_path, "docs/references.md", "- **[GRIS]** and **[Veach 1997]**")
    plant(tmp_path, "toy1d/pixels.py", SAID[said].format(f"[GRIS Eq. 1] [Veach 1997]  {citation}"))
    assert len(unexplained_keys(tmp_path)) == 1


def test_code_in_brackets_is_no_citation(tmp_path):
    plant(tmp_path, "docs/references.md", "")
    text = 'rows = [SCENE] + [PIXEL, *rest]\nname = f"{[SCENE]} of {at[PIXEL]}"'
    assert unexplained_keys(plant(tmp_path, "toy1d/pixels.py", text)) == []

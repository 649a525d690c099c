"""What mutation testing knows about us, as data: groups of modules, the suites that must notice, and what is exempt."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType


@dataclass(frozen=True)
class Group:
    """Modules (globs of files) and their suite (files or folders of tests, of one marker if it is named).

    `equivalent` says which mutants compute the same, and why; `...` stands for anything.
    """

    modules: tuple[str, ...]
    suite: tuple[str, ...]
    marker: str = ""
    equivalent: Mapping[str, str] = field(default_factory=dict)

    def files(self) -> Iterator[str]:
        """The modules' files below the working directory; a package's own file only gathers names."""
        for pattern in self.modules:
            yield from sorted(str(path) for path in Path().glob(pattern) if path.name not in OMITTED)

    def tests(self) -> list[str]:
        """Files of the suite, below the working directory."""
        found = {path for name in self.suite for path in Path().glob(name)}
        return sorted(
            str(path) for path in found if not self.marker or f"mark.{self.marker}" in path.read_text("utf-8")
        )


OMITTED = ("__init__.py", "__main__.py", "page.py")
"""Names that are gathered, command lines of two statements, and pages of words, compared whole with what is kept."""

SAME_DENSITY = "the density of every canonical input is p_hat"
KERNEL = {
    "mis._canonical_share: ...canonical[{0 => -1}]...": SAME_DENSITY,
    "mis._pair: ...canonical[{0 => -1}]...": SAME_DENSITY,
    "resampling.correction: ...np.ones_like(y.{mW => p_hat})...": "a factor of 1 for each column",
    "mis.Confidences._numbers: ...{, copy=False => }...": "a copy has the same numbers",
    "restir.reusing: place = {int(...=> np.argmax(...": "a number prints alike, whatever its type",
    "resampling: ONE = {np.array(1) => 1}": "a factor of 1, as an array or not",
    "resampling._densities.q: ...inputs[{i => j}]...": "i = j in this branch",
    "resampling._check_input: for ...source.X.c), ('weight W', source.X.W})):": "which of two mistakes is named first",
}

SHORT_TABLE = "the last axis of a table is its axis 1"
TRUTH = "True counts as 1"
TAIL = "where the range of t ends, beyond which 1e-17 is left"
HEAD = "where the range of t begins, before which 1e-17 is left"
UNDRAWN = "cells that are never drawn lengthen the range of t at most"
ORACLE = {
    "scenes.normalised: ...axis={- => }1...": SHORT_TABLE,
    "laws.bias_per_cell: ...{np.where(support, 1, 0) => support}...": TRUTH,
    "mutations.without_T: ...np.where({move.T_ratio > 0, 1 => 1, move.T_ratio > 0}, 0)...": TRUTH,
    "mutations.without_T: ...{np.where(move.T_ratio > 0, 1, 0) => move.T_ratio > 0}...": TRUTH,
    "mutations.steps: ...fold(x, x {+ => -} by, K)...": "steps to the left are as many as to the right",
    "mutations.blue.step: ...[{1 => 0}.0]...": "no energy changes in grey, at whatever distance",
    "mutations.blue.step: ...[{1 => 2}.0]...": "no energy changes in grey, at whatever distance",
    "selected._abscissae: ...{+ => -} STEP...": TAIL,
    "selected._abscissae: ...{ + STEP => }...": TAIL,
    "selected._abscissae: ...{50 => 49}...": TAIL,
    "selected._abscissae: ...{50 => 51}...": TAIL,
    "selected.probability: ...reshape({P => W}.shape)...": "both are of one shape",
    "selected.probability: norm = n @ (P * w).{sum => max}...": HEAD,
    "selected.probability: norm = n @ {(P * w) => w}...": HEAD,
    "selected.probability: norm = n @ ({P => n} * w)...": HEAD,
    "selected.probability: t = ...{(w > 0) & (P > 0) => w > 0}...": UNDRAWN,
    "selected.probability: t = ...(P >{ => =} 0)...": UNDRAWN,
    "selected.probability: t = ...({P => W} > 0)...": UNDRAWN,
    "selected.probability: t = ...({P => n} > 0)...": UNDRAWN,
    "selected.probability: t = ...(P > {0 => -1})...": UNDRAWN,
    "selected.total_variance: ...sum(axis={- => }1))": SHORT_TABLE,
    "mutations: ...np.clip({x_new, 0 => 0, x_new}, K - 1)...": "max(a, b) = max(b, a)",
    "scenes.random_scene: f = rng.choice([0.{0, 0.5 => 5, 0.0}...": "each is as likely",
    "scenes.random_scene: ...for j in range({ => 1, }count)...": "nothing is below 0",
    "enumeration.outcomes: ...{lanes, *open_lanes => *open_lanes, lanes}...": "a sum in another order",
}
WHOLE = "a whole number either way"
AS_MANY = "as many confidences as weights"
TABLE = "motion is a table (film, n)"
ELIMINATED = "elimination in another order"
OF_THEORY = {
    "area.area_temporal: return gris([{canonical, *shared => *shared, canonical}]...": "inputs in another order",
    "gradient_loop: Partners = ...": "a type",
    "gradient_loop: View = ...": "a type",
    "gradient_loop: Parts = ...": "a type",
    "gradient_loop: History = ...": "a type",
    "gradient_loop.columns_of: ...{W => c})": AS_MANY,
    "gradient_loop.replaced: order[columns] = len(X.{W => c})...": AS_MANY,
    "gradient_loop.replaced: order = np.arange(len(X.{W => c}))": AS_MANY,
    "gradient_loop.Group.__post_init__: size = {int(np.prod(self.shape) => np.prod(self.shape})": WHOLE,
    "gradient_loop.forward: ...{int(np.prod(shape) => np.prod(shape})...": WHOLE,
    "gradient_loop.in_space: ...[{here, *near => *near, here}]": "inputs in another order",
    "area.overlapped: by = by[:, index % by.shape[{- => }1]]": TABLE,
    "metrics.neighbour_correlation: ...[..., {:-r], e[..., r: => r:], e[..., :-r}])...": "a correlation is symmetric",
    "decorrelation.bounded: ...all(axis=0), 1.0 => 1.0, inside...": TRUTH,
    "decorrelation.attempt: apart(move.{p_hat, move.p_hat_new => p_hat_new, move.p_hat}...": "apart is symmetric",
    "batch.pick.refer: if {any(... => True}:": "the same columns, each input gathered before one is picked",
    "metrics._frequencies: ...{, sparse=True => }...": "the same numbers, in more memory",
    "images.spread_in_disk.around: ...k {* => /} GOLDEN...": "1 / GOLDEN is 1 + GOLDEN, the same modulo 1",
    "images.tiles: ...swapaxes({1, 2 => 2, 1})...": "swapping is symmetric",
    "images.tiles: ...reshape(-{1 => 2})": "any negative number will do",
    "images.disk: ...reshape(2, -{1 => 2})": "any negative number will do",
    "images.disk: ...int(radius) + {1 => 2})": "what is beyond the radius is left out",
    "images.disk: ...{, kind='stable' => })": "steps of one length in another order",
    "images._rings: ...{, kind='stable' => })...": "steps of one angle in another order",
    "poisson.ends: ...swapaxes(-1{, -1 - k =>  - k, -1})...": "swapping is symmetric",
    "poisson.by_transform.solve: ...{, overwrite_x=True => }))": "the same numbers, in more memory",
    "poisson.by_transform.solve: ...overwrite_x={True => False}))": "the same numbers, in more memory",
    "poisson._along: factors[-1 {- => +} k] = ...": "an image has two axes at most, and -2 is the same as 0",
    "poisson.checked: ...np.asarray(g{, dtype=float => })...": "gradients meet the image, which has 64 bits",
    "poisson.by_elimination: ...{permc_spec='MMD_AT_PLUS_A',  => }...": ELIMINATED,
    "poisson.by_elimination: ...{diag_pivot_thresh=0.0,  => }...": ELIMINATED,
    "poisson.by_elimination: ...{, options={'SymmetricMode': True} => })": ELIMINATED,
    "poisson.by_elimination: ...diag_pivot_thresh={0 => ...": ELIMINATED,
    "poisson.by_elimination: ...options={{'SymmetricMode': True => }})": ELIMINATED,
    "poisson.by_elimination: ...options={'SymmetricMode': {True => False}})": ELIMINATED,
    "poisson.symbol: ...sparse=True => }...": "the same numbers, in more memory",
    "poisson.symbol: ...sparse={True => False}...": "the same numbers, in more memory",
    "poisson.checked: _forward({g, own => own, g}, name)": "a product is symmetric",
    "poisson_l1: ROUNDS, COOLING = ({60 => ...": "by then no more steps are taken",
    "poisson_l1.normal_equations.product: ...{v => primal}.shape))": "both are of one shape",
    "poisson_l1.l1: ...scale([{alpha * to_primal, *to_gradients => *to_gradients, alpha * to_primal}]...": (
        "a sum in another order"
    ),
    "poisson_l1.l1_norm: ...{alpha * to_primal, *to_gradients => *to_gradients, alpha * to_primal}...": (
        "a sum in another order"
    ),
    "poisson_l1.scale: ...np.where(mean > 0, mean, {1 => ...": "where all fits, residuals are 0 in any scale",
    "poisson_l1.normal_equations...{w_g, steps => steps, w_g}...": "a product is symmetric",
    "poisson_l1.normal_equations: ...{w_g, gradients => gradients, w_g}...": "a product is symmetric",
    "poisson_l1.conjugate_gradients: ...dot({r, z => z, r})...": "a product is symmetric",
}
SYMMETRIC = "one and the other are treated alike"
PRINTS = "a number prints alike, whatever its type"
NAMED_FIRST = "which of two mistakes is named first"
NOT_BOTH = "without both depths, one alone is apart already, and none is not: nothing exceeds an infinite limit"
TRANSPORT = {
    "reading._put_scattering: ...np.maximum(lobe, {0 => -1}))": "of ALL lobes, what one does is not used",
    "shifts.shift_path: if {start < stop => True}:": "no columns are no work",
    "shift_identity._means: ...((i <{ => =} j) == up)": "no path is shifted to its own pixel",
    "direction_measure.direction_jacobian: ...{x => y}.c - 1, ...": "only asked where y reconnects where x does",
    "edges.unlike: ...np.isfinite(t_i){ & np.isfinite(t_j) => })": NOT_BOTH,
    "edges.unlike: ...np.isfinite({t_i) & np.isfinite( => }t_j))": NOT_BOTH,
    "edges.unlike: apart = ~met | {both &  => }...": NOT_BOTH,
    "edges.unlike: apart = ...{np.where(both, t_i, 0) => t_i}...": NOT_BOTH,
    "edges.unlike: apart = ...{np.where(both, t_j, 0) => t_j}...": NOT_BOTH,
    "edges.unlike: ...np.where(both, t_i, {0 => ...": NOT_BOTH,
    "edges.unlike: ...np.where(both, t_j, {0 => ...": NOT_BOTH,
    "edges.unlike: ...dot(g.n[:, {i], g.n[:, j => j], g.n[:, i}])...": "a product is symmetric",
}
FLATLAND2D = {
    "pictures.view: for pixel, u in ...({FILM - 1, 1.0 => 1.0, FILM - 1})):": "a place on the film is pixel + u",
    "pictures.outline: lines = ...{scene.corners... => circles, *scene.corners...": "one collection in another order",
    "sensors.FluenceMap.__post_init__: _check_points(self.{low, self.high => high, self.low})": NAMED_FIRST,
    "sensors.Pinhole.__post_init__: _check_points(self.{eye, self.towards => towards, self.eye})": NAMED_FIRST,
    "shift_pictures.pair: ...{int(path.c[0]) => path.c[0]}...": PRINTS,
    "shift_pictures._vertices: common = ...": SYMMETRIC,
    "radiosity: POINTS_AT_ONCE = ...": "the same numbers, in blocks of another size",
    "radiosity.view: ...one]){, axis=1 => })...": "the last axis of a table is its axis 1",
    "scenes.crease: ...{float(np.tan(np.radians(40) => np.tan(np.radians(40})...": PRINTS,
    "scenes: ...{clear_coat, furnace => furnace, clear_coat}...": "scenes are found by name",
    "tone.decoded: ...{np.maximum(t, 0.04045) => t}...": "tones are not negative",
}
LOOKED = "how finely is looked whether anything is seen"
TRACER3D = {
    "cli._thumbnails: ..._chances({1 => ...": "any seed will do",
    "meshes._by_trimesh: ...{skip_materials=True,  => }...": "what it is given names no materials",
    "meshes._by_trimesh: ...skip_materials={True => ...": "what it is given names no materials",
    "embree.Embree._between: ...{, mode='clip' => }...": "-1 is the last facet as well, and its answer is not used",
    "embree.Embree._met: ...{, mode='clip' => }...": "-1 is the last facet as well, and its answer is not used",
    "witness._kinds: ...{int(m) => m}...": "a number is the same key, whatever its type",
    "sensors.Pinhole.project: to = ...{, dtype=float => }...": "whole numbers subtract alike",
    "scenes.Setting.__post_init__: check_view(self.scene, self.view({32 => ...": LOOKED,
    "scenes.Setting.__post_init__: check_view(self.scene, self.view(32, {18 => ...": LOOKED,
    "render.Job.hours: ...RAY / {3600 => ...": "an estimate is told in two digits",
    "methods.reuse_in_tiles: order = tiles(shape{, SIDE => })": "the default",
    "cli._picture_options: ...add_argument('--still', ...dest='moving',  => }...": "the default is not set again",
    "cli._path_traced: ...{desc='reference',  => }...": "words of a bar",
    "compare.sheet: figure.savefig(path, dpi={150 => ...": "how finely it is drawn",
    "cli._path_traced: ..._chances(job.seed + {1 => 2}...": "any seed but that of what it is held against",
    "shapes.quad: a, b, c, d = np.asarray(corners{, dtype=float => })": "whole numbers subtract alike",
    "embree.Embree._first: if not { => not }len(left):": "what is left is asked of all facets, more slowly",
    "sensors.Pinhole.through: ...np.ones(len({column => row}))": "as many columns as rows",
    "files.tone: ...{np.maximum(v, 0.0031308) => v}...": "tones are not negative",
    "witness._groups: return {list(dict.fromkeys(...": "the same kinds in the same order",
    "embree.Embree.visible: ...visible({x.take(doubt, axis=-1), y => y.take(doubt, axis=-1), x}...": SYMMETRIC,
    "compare.errors: ...{float(metric(image, truth, MAP) => ...": PRINTS,
    "compare.sheet: ...{, layout='constrained' => })": "how close to each other pictures stand",
    "cli._thumbnails: def ...trees: int={8 => ...": "how smooth they are",
    "cli._compare: {known(METHODS, method, 'method') => METHODS}": "every method's job asks as well",
    "witness._dielectric: ...kinds[{0 => -1}] in ROUGH...": "all are rough, or none is",
    "sensors.Pinhole.__post_init__: ...cross({forward, self.up => self.up, forward})...": SYMMETRIC,
    "render.blank: ...job.setting({0 => ...": "a scene has as many channels in every frame",
    "embree.Embree._nearest_facet: near = np.zeros(x.shape[{- => }1])": "points are (3, N)",
    "sensors.Pinhole.project: ...dot({forward, to => to, forward})": SYMMETRIC,
    "sensors.Pinhole.project: ...dot({right, to => to, right})...": SYMMETRIC,
    "meshes.with_area: n = np.cross(sides[:, {1], sides[:, 2 => 2], sides[:, 1}])": "an area has no sign",
    "witness: Description = ...": "a type",
    "shapes.turned: x = ...{, dtype=float => }...": "less their mean, they are of that type",
    "witness._rgb: ...{float(c) => c}...": PRINTS,
    "cli._thumbnails: ...{unit='scene',  => }...": "words of a bar",
    "cli._path_traced: ...{total=trees,  => }...": "words of a bar",
}
AUDIT = {
    "cases.drawn: pick = {np.floor => }(...": "what is not negative is cut down to the same integer",
    "compare.Check.worst: ...{float(expected) => expected}...": PRINTS,
    "mistakes.against_old_sum: s, before = (np.zeros(len(terms.s){, dtype=int => }), ...": PRINTS,
    "compare.Check.worst: columns = int(self.wrong.reshape(-{1 => 2}...": "any negative number will do",
    "load._check_values: for name in ('{u', 'u_stream => u_stream', 'u}'):": "which of two mistakes is named first",
    "mistakes.at_s: ...[{0 => -1}])": "the first of one row is the last",
    "mistakes.inputs_counted: ...len(p.{W => c})...": AS_MANY,
}
NOT_SELECTED = "the pass that follows selects no sample without light"
ROUNDING = "options of rounding's size change no mean"
NULL = "whichever cell a sample of weight 0 is in"
ZOO = {
    "checks.worst_mean: ...sum(axis={- => }1)...": SHORT_TABLE,
    "selection: ...{of the selected sample times J...": "bugs are found by name",
    "selection.density_of_chosen: ...np.where(X.W >{ => =} 0, ...": NOT_SELECTED,
    "selection.density_of_chosen: ...np.where(X.W > 0, X.x.number, {0 => ...": NOT_SELECTED,
    "selection.EqualShares.candidates: ...{ratio => np.divide}...": "what is drawn has a density",
    "confidence.OneSeed.choose: ...np.where(high {- low  => }> 1e-14, ...": ROUNDING,
    "shifts: ...{not mirrored...": "bugs are found by name",
    "selection.offer_against_old_sum: ...np.where(w > {0 => -1}, ...": "either of two samples without weight",
    "probe.bounds: ...own(stage, i, {0 => ...": NULL,
    "confidence.OneSeed.choose: ...{np.where(null, start, low[s, column]) => low[s, column]}...": (
        "the edges of a null column are 0, which start bounds from below"
    ),
    "confidence.OneSeed.choose: ...high - low > {1e-14 => -0.99...": ROUNDING,
    "weights.swapped_pairwise: ...canonical[{0 => -1}]...": SAME_DENSITY,
    "passes: ...Parts({along=TALBOT, ...": "the default",
}
TOY1D = {
    "walking.Walking.propose: ...np.clip({(x - low) / size, 0 => 0, (x - low) / size}, 1)...": "max(a, b) = max(b, a)",
    "line.Line.pixel: ...{if index.max(initial=0) < self.n else index  => }% self.n": "the same, more slowly",
    "toys: ...{partial_shift, two_pairs => two_pairs, partial_shift}...": "toys are found by name",
    "toys: ...{degrading_neighbours, overstating_neighbours => overstating_neighbours, degrading_neighbours}...": (
        "toys are found by name"
    ),
    "line.quotient: ...[:, None], {0 => 1}.0)": "what is outside has density 0 all the same",
    "line.Line.pixel: ...initial={0 => 1}...": "of one pixel, the remainder is 0 as well",
    "line.Line.pixel: ...initial={0 => -1}...": "indices are not negative",
    "line._kept_cells: i, j = ...{:, None, None], ...[None, : => None, :, None]...": "shifts that keep z are symmetric",
    "line._kept_cells: ...line.holes({i, j => j, i}, z)...": "holes are symmetric in i and j",
}

THEORY = (
    "batch",
    "chance",
    "integrals",
    "guards",
    "loop",
    "windows",
    "images",
    "area",
    "squares",
    "gathering",
    "gradient",
    "gradient_loop",
    "poisson",
    "poisson_l1",
    "decorrelation",
    "metrics",
    "counting",
)

GROUPS: Mapping[str, Group] = MappingProxyType(
    {
        "kernel": Group(
            tuple(f"restir_ref/{name}.py" for name in ("mis", "resampling", "restir", "streaming")),
            ("tests/**/test_*.py",),
            "kernel",
            KERNEL,
        ),
        "theory": Group(
            tuple(f"restir_ref/{name}.py" for name in THEORY),
            (
                *("tests/core/test_*.py", "tests/oracle/test_*.py"),
                *("tests/flatland/test_gbuffer.py", "tests/flatland/test_gradients.py"),
            ),
            equivalent=OF_THEORY,
        ),
        "oracle": Group(
            ("restir_ref/oracle/*.py",), ("tests/oracle/test_*.py", "tests/core/test_*.py"), equivalent=ORACLE
        ),
        "zoo": Group(("restir_ref/oracle/zoo/*.py",), ("tests/oracle/test_*.py",), equivalent=ZOO),
        "audit": Group(("restir_ref/audit/*.py",), ("tests/audit/test_*.py",), equivalent=AUDIT),
        "transport": Group(
            ("restir_ref/transport/**/*.py",),
            ("tests/transport/**/test_*.py", "tests/flatland/test_*.py"),
            equivalent=TRANSPORT,
        ),
        "toy1d": Group(("toy1d/*.py",), ("tests/core/test_*.py", "tests/toy1d/test_*.py"), equivalent=TOY1D),
        "flatland2d": Group(("flatland2d/*.py",), ("tests/flatland/test_*.py",), equivalent=FLATLAND2D),
        "tracer3d": Group(
            ("tracer3d/*.py",), ("tests/tracer3d/test_*.py", "tests/transport/test_spaces.py"), equivalent=TRACER3D
        ),
    }
)

INK = ("color", "colors", "edgecolors", "cmap", "ls", "lw", "linewidths", "capstyle", "marker", "zorder")
TEXT = ("fontsize", "pad", "bbox", "interpolation", "label", "xlabel", "ylabel")
LOOKS = frozenset((*INK, *TEXT))
"""Keyword arguments that decide what a picture looks like and says, not what it shows: no test pins a colour."""

OWN_MISTAKES = frozenset(("strict", "stacklevel"))
"""Keyword arguments that matter only where our own code is wrong: zip(strict=True) stops on lists that never differ."""

FOR_TYPES = frozenset(("asarray", "cast"))
"""Functions that tell the type checker what a value is already: without them, nothing changes."""

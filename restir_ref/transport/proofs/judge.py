"""Plug in your own shift and have it judged.

Whatever maps paths to paths can be judged; nothing is compared with our own shifts.  Image means are
nearly blind to mistakes in shifts, for reuse is nearly symmetric.  `CHECKS` are not, and name a path.
"""

import textwrap
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from inspect import getdoc
from types import MappingProxyType

import numpy as np

from restir_ref.batch import Array, take
from restir_ref.chance import Chance
from restir_ref.integrals import Pixels, Shifted
from restir_ref.transport.lobes import KINDS
from restir_ref.transport.paths import Path, Tracer
from restir_ref.transport.proofs import shift_checks as by_path
from restir_ref.transport.proofs.inversion import primary_sample
from restir_ref.transport.proofs.reading import ExtendedPath, extended_path
from restir_ref.transport.proofs.shift_checks import NOTHING, Case, Effort, Finding, Numbers, Offender, trials
from restir_ref.transport.proofs.shift_identity import change_of_variables
from restir_ref.transport.proofs.shift_slopes import finite_differences
from restir_ref.transport.restir_pt import PathIntegrals


@dataclass(frozen=True, eq=False)
class Shifting(PathIntegrals):
    """Path integrals with somebody's shift, by(tracer, x, pixel) -> (y, J) like `shift_path`: the plug.

    A shift that has to look at the base path's own pixel is a `shift` method, as in `copies.Copying`.
    """

    by: Callable[[Tracer, Path, Array], tuple[Path, Array]]

    def shift(self, x: Path, index: Array, to: Pixels) -> Shifted:
        """T as given."""
        there: PathIntegrals = to.of  # type: ignore[assignment]
        return Shifted(*self.by(there.tracer, x, to.index % there.n))


Check = Callable[[Case], Finding]

CHECKS: Mapping[str, Check] = MappingProxyType(
    {
        "there and back": by_path.there_and_back,
        "defined back": by_path.defined_back,
        "inverse Jacobians": by_path.inverse_jacobians,
        "traced from scratch": by_path.traced_from_scratch,
        "shifted again": by_path.shifted_again,
        "finite differences": finite_differences,
        "change of variables": change_of_variables,
    }
)


@dataclass(frozen=True, eq=False)
class Judgement:
    """What every check found in the shift of `of`, by name; `report` puts it into words."""

    of: PathIntegrals
    findings: Mapping[str, Finding]

    @property
    def red(self) -> tuple[str, ...]:
        """The checks that failed."""
        return tuple(name for name, found in self.findings.items() if found.red)

    @property
    def undecided(self) -> tuple[str, ...]:
        """The checks that lack something; what, is in their findings."""
        return tuple(name for name, found in self.findings.items() if found.undecided)

    @property
    def green(self) -> bool:
        """All checks could be made, and none failed: the only acquittal."""
        return not self.red and not self.undecided

    @property
    def status(self) -> int:
        """The exit status of a script: 0 green, 1 red, 3 undecided."""
        return 1 if self.red else 3 if self.undecided else 0


USUAL = Effort()
"""A second or two."""


def judge(
    of: PathIntegrals,
    chance: Chance,
    effort: Effort = USUAL,
    numbers: Numbers = primary_sample,
    checks: Mapping[str, Check] = CHECKS,
) -> Judgement:
    """Hold checks against the shift of `of`: green, red or undecided.

    numbers  which primary sample an offset path has

    Raises ValueError for fewer than two pixels, and where J is negative, NaN or infinite.

    >>> import numpy as np
    >>> from flatland2d import setting
    >>> from restir_ref import Live
    >>> from restir_ref.transport.paths import Connectability, Tracer
    >>> from restir_ref.transport.proofs.judge import Effort, judge
    >>> from restir_ref.transport.proofs.zoo import TRANSPORT_BUGS
    >>> from restir_ref.transport.restir_pt import PathIntegrals
    >>> room, few = setting("crease"), Effort(paths=1000, jacobians=40)
    >>> t = Tracer(room.scene, room.pinhole(32), 2, Connectability(roughness=0.2, distance=0.02))
    >>> judge(PathIntegrals(t), Live(np.random.default_rng(1)), few).green
    True
    >>> careless = TRANSPORT_BUGS["geometric Jacobian left out"].wrong(t)
    >>> judge(careless, Live(np.random.default_rng(1)), few).red
    ('finite differences', 'change of variables')
    """
    if of.n < 2:
        raise ValueError(f"a shift needs two pixels to be judged, but the sensor has {of.n}.")
    tried = trials(of, effort, chance)
    arrives = of.target(tried.j, tried.y) * tried.J > NOTHING * of.target(tried.i, tried.x)
    case = Case(of, effort, numbers, chance, take(tried, np.flatnonzero((tried.W > 0) & arrives)))
    return Judgement(of, MappingProxyType({name: check(case) for name, check in checks.items()}))


def report(judgement: Judgement) -> str:
    """The answer, then all checks: of each that failed the worst path, of each that is undecided what it takes."""
    t = judgement.of.tracer
    lines = (line for name, found in judgement.findings.items() for line in _lines(t, name, found))
    return "\n".join([_answer(judgement), *lines])


def _answer(judgement: Judgement) -> str:
    """WRONG, UNDECIDED or right, and by which checks."""
    if judgement.red:
        return f"WRONG: {', '.join(judgement.red)}"
    if judgement.undecided:
        return f"UNDECIDED: {', '.join(judgement.undecided)}"
    return "right, as far as it was tested"


def _lines(t: Tracer, name: str, found: Finding) -> Iterator[str]:
    law = (getdoc(CHECKS[name]) or "").split("\n")[0] if name in CHECKS else "a check of its own"
    yield f"{found.answer:9} {name}: {law}"
    yield from (f"{INDENT}{line}" for line in _tested(t, found))


INDENT, WIDTH = 10 * " ", 110


def _tested(t: Tracer, found: Finding) -> Iterator[str]:
    """What was tested, what failed, and what is missing."""
    if found.tested:
        yield f"{found.failed} of {found.tested} fail, the worst error is {found.worst:.3g} times what is tolerated"
    yield from found.where.splitlines()
    if found.undecided:
        yield from textwrap.wrap(f"needs more: {found.needs}", WIDTH)
    if found.red and found.offender is not None:
        yield from path_in_words(t, found.offender)


def path_in_words(t: Tracer, at: Offender) -> Iterator[str]:
    """What is wrong, and the vertices of both paths; where they have met, the offset path's are left out."""
    k, c, end = int(at.x.k[0]), int(at.x.c[0]), "light sampling" if at.x.nee[0] else "BSDF sampling"
    joint = f"reconnects at x_{c}" if c else "never reconnects"
    yield f"{at.what}: found {at.found:.9g}, expected {at.expected:.9g}"
    yield f"pixel {at.i[0]} -> {at.j[0]}, k = {k}, {end}, {joint}, J = {at.J[0]:.9g}"
    x, y = (extended_path(t, path.u, pixel, path.k, path.nee) for path, pixel in ((at.x, at.i), (at.y, at.j)))
    yield from (f"x_{m}  {_vertex_in_words(t, x, m)}" for m in range(k + 2))
    yield from (f"y_{m}  {_vertex_in_words(t, y, m)}" for m in range(c or k + 2))


def _vertex_in_words(t: Tracer, x: ExtendedPath, m: int) -> str:
    """Place, primitive, material, and the lobe that leaves it."""
    place = ", ".join(f"{each:.6g}" for each in x.x[m, :, 0])
    prim, lobe = int(x.prim[m, 0]), int(x.lobe[m, 0])
    if prim < 0:
        return f"({place})  sensor"
    table, material = t.scene.materials, int(t.scene.material[prim])
    row = material * table.L + lobe
    kind = f"{KINDS[table.kind[row]]}, roughness {table.roughness[row]:.3g}" if lobe >= 0 else "no lobe of its own"
    return f"({place})  primitive {prim}, material {material}, {kind}"

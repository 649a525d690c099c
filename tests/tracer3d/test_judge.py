"""The judge of shifts acquits ours in every scene, by inset and by the whole view, and convicts planted mistakes."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from restir_ref.chance import Live
from restir_ref.transport.paths import Tracer
from restir_ref.transport.proofs.judge import CHECKS, Check, Judgement, Shifting, judge, report
from restir_ref.transport.proofs.shift_checks import Effort
from restir_ref.transport.restir_pt import PathIntegrals
from restir_ref.transport.shifts import shift_path
from tests.tracer3d.views import RULES
from tracer3d import SCENES

SMALL, MORE, MOST = (Effort(paths=paths, jacobians=20) for paths in (3000, 10_000, 50_000))
EFFORTS = {
    ("glossy_cornell", "inset"): MORE,
    ("glossy_cornell", "view"): MORE,
    ("many_lights", "view"): MORE,
    ("ajar", "inset"): MOST,
    ("ajar", "view"): MOST,
    ("ajar_ceiling", "inset"): MOST,
    ("ajar_ceiling", "view"): MOST,
    ("distant_caustic", "inset"): Effort(paths=150_000, jacobians=20),
    ("distant_caustic", "view"): Effort(paths=400_000, jacobians=20),
}
"""Where few paths carry light: fewer would leave the judge undecided, which is no acquittal."""


def tracer(scene: str, rule: str, view: str) -> Tracer:
    """A scene's inset, or all of it."""
    setting = SCENES[scene]()
    sensor = {"inset": setting.pinhole, "view": setting.view}[view](32, 32)
    return Tracer(setting.scene, sensor, setting.depth, RULES[rule])


def judged(of: PathIntegrals, effort: Effort = SMALL, checks: Mapping[str, Check] = CHECKS) -> Judgement:
    return judge(of, Live(np.random.default_rng(1)), effort, checks=checks)


IN_VIEWS = {name: check for name, check in CHECKS.items() if name != "finite differences"}
"""Jacobians are measured in insets."""


@pytest.mark.claims("GRIS-A09", "GRIS-E35", "GRIS-E52", part="all scenes in 3D", world="tracer3d")
@pytest.mark.parametrize("view", ["inset", "view"])
@pytest.mark.parametrize("scene", SCENES)
def test_the_hybrid_shift_is_acquitted_in_every_scene(scene, view):
    found = judged(
        PathIntegrals(tracer(scene, "hybrid", view)),
        EFFORTS.get((scene, view), SMALL),
        {"inset": CHECKS, "view": IN_VIEWS}[view],
    )
    assert found.green, report(found)


@pytest.mark.parametrize("scene", [name for name in SCENES if name != "distant_caustic"])
def test_so_is_reconnection(scene):
    """In the scene left out the judge asks for 300 000 paths, which take a minute."""
    found = judged(PathIntegrals(tracer(scene, "reconnection", "inset")), EFFORTS.get((scene, "inset"), SMALL))
    assert found.green, report(found)


def without_jacobian(t, x, pixel):
    """A mistake: J = 1 wherever the shift is defined."""
    y, J = shift_path(t, x, pixel)
    return y, (J > 0).astype(float)


def flat_jacobian(t, x, pixel):
    """A mistake: the distances' ratio of flatland, to the first power."""
    y, J = shift_path(t, x, pixel)
    return y, np.sqrt(J)


def unchecked(t, x, pixel):
    """A mistake: paths that reconnect keep the base path's light."""
    y, J = shift_path(t, x, pixel)
    return replace(y, F=np.where(J > 0, x.F, y.F)), J


@pytest.mark.parametrize(("scene", "view"), [("cornell", "inset"), ("crease", "inset"), ("cornell", "view")])
@pytest.mark.parametrize("wrong", [without_jacobian, flat_jacobian, unchecked])
def test_a_planted_mistake_is_convicted(wrong, scene, view):
    found = judged(Shifting(tracer(scene, "hybrid", view), wrong))
    assert {"finite differences", "traced from scratch"} & {*found.red}

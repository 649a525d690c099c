"""A shift that is only rows of (x, y, J): its slope, its way back, and clamps; undecided is not kept."""

import numpy as np
import pytest

from flatland2d import SCENES
from restir_ref.audit.shift_table import TableReport, audit_shift_table
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.transport.paths import Connectability, Path, Tracer
from restir_ref.transport.proofs.judge import Shifting, judge, report
from restir_ref.transport.proofs.shift_checks import Effort
from restir_ref.transport.shifts import shift_path

X = np.random.default_rng(1).random((2, 20_000))


def squeezed(x: Array) -> tuple[Array, Array]:
    """y = (x_0^2, x_1 / (1 + x_0)): a curved shift of the square, with its slope."""
    return np.stack([x[0] ** 2, x[1] / (1 + x[0])]), 2 * x[0] / (1 + x[0])


Y, J = squeezed(X)


def said(J: Array, **more: Array) -> TableReport:
    return audit_shift_table(X, Y, J, **more)


def test_rows_of_a_right_shift_keep_all_laws() -> None:
    found = said(J, back=X, J_back=1 / J)
    assert found.right, found
    assert [law.answer for law in found.laws] == ["kept"] * 3
    assert str(found).startswith("right, as far as the table shows")
    assert found.extremes == (pytest.approx(J.min()), pytest.approx(J.max()))


WRONG = {
    "left out": (np.ones(len(J)), "slope"),
    "inverted": (1 / J, "slope"),
    "squared": (J**2, "slope"),
}


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_jacobian_breaks_the_slope(name) -> None:
    wrong, law = WRONG[name]
    assert str(said(wrong)).startswith(f"WRONG: {law}")


def test_a_clamped_jacobian_is_told_from_its_ends() -> None:
    found = said(np.clip(J, 0.4, 0.8))
    assert {each.value for each in found.plateaus} == {0.4, 0.8}
    assert not found.right


def test_a_way_back_that_is_refused_or_leads_elsewhere_is_broken() -> None:
    refused = said(J, back=X, J_back=np.where(J > 0.6, 1 / J, 0))
    assert "inverse Jacobians" in str(refused).splitlines()[0]
    elsewhere = said(J, back=(X + 0.1) % 1, J_back=1 / J)
    assert "way back" in str(elsewhere).splitlines()[0]


def test_too_few_rows_are_undecided_and_acquit_nobody() -> None:
    found = audit_shift_table(X[:, :30], Y[:, :30], J[:30])
    assert not found.right
    assert str(found).startswith("UNDECIDED")


def test_rows_that_do_not_fit_are_refused() -> None:
    with pytest.raises(ValueError, match=r"shapes \(2, 20000\), \(2, 20000\) and \(3,\)"):
        audit_shift_table(X, Y, J[:3])


# ---------------------------------------------------------------- shifts of paths, by the judge


def convicted(by) -> str:
    """What the judge says of somebody's shift in the glossy box."""
    setting = SCENES["glossy_cornell"]()
    tracer = Tracer(setting.scene, setting.pinhole(1920, 0), setting.depth, Connectability(0.2, 0.02))
    return report(judge(Shifting(tracer, by), Live(np.random.default_rng(1)), Effort(paths=4000, jacobians=100)))


def test_reconnections_whose_jacobian_is_clamped_are_convicted_by_finite_differences() -> None:
    def clamped(t: Tracer, x: Path, pixel: Array) -> tuple[Path, Array]:
        y, J = shift_path(t, x, pixel)
        return y, np.where(J > 0, np.clip(J, 0.5, 2.0), 0)

    said = convicted(clamped)
    assert "RED   finite differences" in said
    assert "J: found" in said

"""`python -m restir_ref.audit DUMP` prints the report and says by its exit status whether the dump is right."""

import subprocess
import sys

import numpy as np
import pytest

from restir_ref.audit.__main__ import main
from tests.audit.planted import DividedByM, fields
from tests.audit.shader import dumped

RIGHT = dumped(fields(n=8), "talbot")
WRONG = dumped(fields(n=8), "talbot", DividedByM)


@pytest.mark.parametrize(
    ("dump", "status", "said"),
    [
        (RIGHT, 0, "right: J, p_hat_own"),
        (WRONG, 1, "looks like: W_Y divided by M once more"),
        ({"a": 1}, 2, "'format' is 'None'"),
    ],
    ids=["right", "wrong", "unreadable"],
)
def test_the_exit_status_is_the_verdict(dump, status, said, tmp_path, capsys) -> None:
    np.savez(tmp_path / "pass.npz", **dump)
    assert main([str(tmp_path / "pass.npz")]) == status
    assert said in "".join(capsys.readouterr())


def test_the_tolerance_can_be_chosen(tmp_path) -> None:
    np.savez(tmp_path / "pass.npz", **{**RIGHT, "W_Y": RIGHT["W_Y"] * 1.01})
    assert main([str(tmp_path / "pass.npz")]) == 1
    assert main([str(tmp_path / "pass.npz"), "--rtol", "0.1"]) == 0
    with pytest.raises(SystemExit):
        main([str(tmp_path / "pass.npz"), "--rtol", "0"])


def test_it_runs_as_a_module() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "restir_ref.audit", "--help"], capture_output=True, text=True, check=True
    )
    assert "exit status: 0" in done.stdout

"""Presets are the paper's; neighbours stay near, and those of the offline preset are evenly spread."""

import numpy as np
import pytest

from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.loop import OFFLINE, REAL_TIME, Preset, random_in_row, spread_in_row
from restir_ref.mis import WEIGHTS
from tests.core.stubs import Row

N, REACH = 2_000_000, 500_000
AROUND = {"random": random_in_row, "spread": spread_in_row}
each_choice = pytest.mark.parametrize("around", AROUND.values(), ids=AROUND)


@pytest.mark.claims("GRIS-A07")
def test_the_real_time_preset_is_the_papers() -> None:
    assert REAL_TIME == Preset(
        trees=1, rounds=1, neighbours=3, radius=20, cap=20, along="talbot", across="defensive"
    )

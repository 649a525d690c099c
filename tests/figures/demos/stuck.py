"""A figure that can be caught in the middle: while STUCK is set, only its first five chunks ever end."""

import os
import time

from tests.figures.demos.sound import draws, figure

STUCK = "DEMO_STUCK"


def compute(preset, chunk, *, rng):
    while chunk["first"] >= 5 * preset["n"] and STUCK in os.environ:
        time.sleep(0.05)
    return draws(preset, chunk, rng=rng)


SIZE = {"chunks": 12, "n": 5}
FIGURE = figure(id="DEMO-F02", compute=compute, presets={"quick": SIZE, "paper": SIZE})

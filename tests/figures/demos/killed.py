"""A figure whose last chunk kills its own process, as the system does when memory runs out."""

import os
import signal

from tests.figures.demos.sound import draws, figure


def compute(preset, chunk, *, rng):
    if chunk["first"] == 2 * preset["n"]:
        os.kill(os.getpid(), signal.SIGKILL)
    return draws(preset, chunk, rng=rng)


FIGURE = figure(id="DEMO-F04", compute=compute)

"""A figure whose chunks take long enough to be caught in the middle."""

import time

from tests.figures.demos.sound import draws, figure


def compute(preset, chunk, *, rng):
    time.sleep(0.1)
    return draws(preset, chunk, rng=rng)


FIGURE = figure(
    id="DEMO-F02",
    compute=compute,
    presets={"quick": {"chunks": 12, "n": 5}, "paper": {"chunks": 300, "n": 5}},
)

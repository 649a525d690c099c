"""A figure whose bytes depend on all that may differ between machines: chance, exp, BLAS and its threads."""

import time

import numpy as np

from figures.claims.criteria import above
from figures.claims.figure import Claim
from restir_ref import WEIGHTS, Live, Pixels, initial, shade, spatial
from tests.figures.demos.sound import figure
from toy1d import overlapping_supports

LINE = overlapping_supports()


def compute(preset, chunk, *, rng):
    here = Pixels(LINE, np.arange(7 * preset["n"]))
    right = Pixels(LINE, here.index - here.index % 7 + (here.index + 1) % 7)
    chance = Live(rng)
    estimate = shade(spatial(initial(here, chance), here, [right], chance, mis=WEIGHTS["defensive"]), here)
    square = rng.random((300, 300))
    time.sleep(preset["seconds"])
    return {"x": estimate[0] + (square @ square)[: preset["n"], :7].ravel(), "first": np.array(chunk["first"])}


def check(arrays):
    return [Claim("DEMO-C01", above(arrays["x"].mean(), 0))]


SIZE = {"chunks": 10, "n": 20, "seconds": 0.1}
FIGURE = figure(id="DEMO-F06", compute=compute, check=check, presets={"quick": SIZE, "paper": SIZE})

"""Two ways to estimate the same mean, told apart by the chunk parameter "method", and a chunk without arms."""

import numpy as np

from figures.claims.criteria import above
from figures.claims.figure import Claim
from tests.figures.demos.sound import figure


def both(preset):
    return [{"method": "plain"}, {"method": "squared"}, {"alone": 1}]


def estimated(preset, chunk, *, rng):
    x = rng.random(8)
    return {"x": x**2 if chunk.get("method") == "squared" else x, "first": np.array(0)}


def larger(arrays):
    return [Claim("DEMO-C01", above(arrays["x"].mean(), 0.1), part="mean")]


FIGURE = figure(id="DEMO-F07", chunks=both, compute=estimated, check=larger, arm="method")

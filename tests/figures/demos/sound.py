"""A figure with nothing wrong."""

import numpy as np

from figures.claims.criteria import within
from figures.claims.figure import Claim, Figure
from figures.report import style

SIZES = {"quick": {"chunks": 3, "n": 50}, "paper": {"chunks": 4, "n": 200}}


def parts(preset):
    return [{"first": i * preset["n"]} for i in range(preset["chunks"])]


def draws(preset, chunk, *, rng):
    return {"x": rng.random(preset["n"]), "first": np.array(chunk["first"])}


def joined(_, results):
    return {name: np.hstack([result[name] for result in results]) for name in ("x", "first")}


def picture(arrays):
    fig, ax = style.panels(width=2, height=1)
    ax[0, 0].plot(arrays["x"])
    ax[0, 0].set(xticks=[], yticks=[])
    return fig


def mean_is_half(arrays):
    return [Claim("DEMO-C01", within(arrays["x"].mean(), 0.5, 0.2), part="mean")]


def figure(**changes):
    """The sound figure, but for the changes."""
    sound = {
        "id": "DEMO-F01",
        "title": "Uniform <draws>",
        "world": "toy1d",
        "source": "[DEMO Fig. 1]",
        "claims": ("DEMO-C01",),
        "presets": SIZES,
        "chunks": parts,
        "compute": draws,
        "combine": joined,
        "draw": picture,
        "check": mean_is_half,
    }
    return Figure(**(sound | changes))


FIGURE = figure()

"""A figure whose second chunk raises."""

from tests.figures.demos.sound import draws, figure


def compute(preset, chunk, *, rng):
    if chunk["first"]:
        raise ArithmeticError("a deliberate error")
    return draws(preset, chunk, rng=rng)


FIGURE = figure(id="DEMO-F03", compute=compute)

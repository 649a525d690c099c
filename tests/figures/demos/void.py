"""A comparison of a thing with itself: both arms give the same numbers."""

from tests.figures.demos.arms import both, estimated, larger
from tests.figures.demos.sound import figure


def alike(preset, chunk, *, rng):
    return estimated(preset, {}, rng=rng)


FIGURE = figure(id="DEMO-F08", chunks=both, compute=alike, check=larger, arm="method")

"""A figure whose verdicts have two parts; its quick preset drops the second where DROPPING is set."""

import os

from figures.claims.criteria import within
from figures.claims.figure import Claim
from tests.figures.demos.sound import figure

DROPPING = "DEMO_DROPS_A_PART"


def both_parts(arrays):
    x = arrays["x"]
    parts = [Claim("DEMO-C01", within(x.mean(), 0.5, 0.2), part="mean")]
    if x.size > 200:
        return [*parts, Claim("DEMO-C01", within(x.std(), 0.29, 0.1), part="spread")]
    if os.environ.get(DROPPING):
        return parts
    return [*parts, Claim("DEMO-C01", None, part="spread", reason="too few draws")]


FIGURE = figure(id="DEMO-F09", check=both_parts)

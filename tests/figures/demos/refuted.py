"""A figure that measures the opposite of its claim with certainty."""

from figures.claims.criteria import above, below
from figures.claims.figure import Claim
from tests.figures.demos.sound import figure


def check(arrays):
    mean = arrays["x"].mean()
    return [
        Claim(
            "DEMO-C02", above(mean, 0.8), counter=below(mean, 0.7), reason="it is a uniform draw. Its mean is a half."
        )
    ]


FIGURE = figure(id="DEMO-F05", claims=("DEMO-C02",), check=check)

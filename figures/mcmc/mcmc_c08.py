"""MCMC 8: blue noise by mutations that are unbiased, pi = p_hat exp(-E / T) in the acceptance and in W alike.

On the line, without reuse.  Every other pixel keeps its sample; those between mutate, and E asks how near their value
is to those of the resting ones, which are independent of them: so W stays unbiased.  The value has to be something that
a mutation can change.  It is x itself, with the usual target; or the contribution, with a flat target, which leaves
p_hat W = 1 and all noise to the contribution.  Either way W takes up exp(E / T), which is noise of its own: at smaller
temperatures than these means are carried by samples too rare to be met.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from figures.claims import criteria
from figures.claims.figure import Arrays, Claim, Figure
from figures.experiments.exact import true_image
from figures.report import style
from restir_ref.batch import Array, total, where
from restir_ref.chance import Chance, Live
from restir_ref.decorrelation import energy, mutate
from restir_ref.integrals import Pixels, Reservoirs, Shifted
from restir_ref.metrics import low_frequency_ratio
from restir_ref.restir import initial, shade
from toy1d import image_of_64, walking
from toy1d.walking import Walking

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

STEPS, REACH, SIGMA = 20, (-3, -1, 1, 3), 0.1
TEMPERATURES = (0.1, 0.2, 0.5, 1.0)

Value = Callable[[Walking, Array, Array], Array]


def itself(line: Walking, index: Array, x: Array) -> Array:
    """x, in units in which neighbours differ as the energy expects."""
    return np.asarray(4 * x)


def contribution(line: Walking, index: Array, x: Array) -> Array:
    """f / I."""
    return np.asarray(line.contribution(index, x)[0] / truth()[index % line.n])


@cache
def truth() -> Array:
    """The image."""
    return true_image(image_of_64())


@dataclass(frozen=True, eq=False)
class Tempered:
    """The line with target pi = p_hat^power exp(-E / T), E the mean energy with values `rest` (4, N) of neighbours."""

    line: Walking
    power: float
    value: Value
    rest: Array
    temperature: float

    @property
    def n(self) -> int:
        """Number of pixels."""
        return self.line.n

    def candidates(self, index: Array, chance: Chance) -> Iterator[tuple[Array, Array]]:
        """Those of the line."""
        return self.line.candidates(index, chance)

    def shift(self, x: Array, index: Array, to: Pixels) -> Shifted:
        """That of the line."""
        return self.line.shift(x, index, to)

    def target(self, index: Array, x: Array) -> Array:
        """pi; at an infinite temperature p_hat or 1."""
        value = self.value(self.line, index, x)
        E = total([energy(abs(d), value - rest) for d, rest in zip(REACH, self.rest, strict=True)]) / len(REACH)
        return np.asarray(self.line.target(index, x) ** self.power * np.exp(-E / self.temperature))

    def contribution(self, index: Array, x: Array) -> Array:
        """f."""
        return self.line.contribution(index, x)

    def propose(self, index: Array, x: Array, chance: Chance) -> tuple[Array, Array]:
        """A step of the random number."""
        return self.line.propose(index, x, chance)


VARIANTS: Mapping[str, tuple[float, Value]] = MappingProxyType(
    {"value x, usual target": (1.0, itself), "value f, flat target": (0.0, contribution)}
)


def images(variant: str, temperature: float, replicas: int, chance: Live) -> tuple[Array, Array]:
    """Relative errors before and after the mutations, (replicas, 64) each."""
    power, value = VARIANTS[variant]
    line = walking(image_of_64(), SIGMA)
    here = Pixels(line, np.arange(line.n * replicas))
    start = Reservoirs(chance.uniform(here.index.shape), np.ones(here.index.shape), np.ones(here.index.shape))
    X = initial(here, chance) if power else start
    pixel = here.index % line.n
    near = [here.index - pixel + np.where((pixel + d < 0) | (pixel + d >= line.n), pixel - d, pixel + d) for d in REACH]
    values = value(line, here.index, X.x)
    of = Tempered(line, power, value, np.stack([values[each] for each in near]), temperature)
    there, moving, Y = Pixels(of, here.index), pixel % 2 == 0, X
    for _ in range(STEPS):
        Y = mutate(Y, there, chance)
    Y = where(moving, Y, X)
    before, after = (shade(Z, here)[0].reshape(replicas, line.n) / truth() - 1 for Z in (X, Y))
    return before, after


# ---------------------------------------------------------------- the figure


def chunks(preset: Any) -> Sequence[dict[str, str]]:
    """Both variants."""
    return [{"variant": variant} for variant in VARIANTS]


def compute(preset: Any, chunk: Any, *, rng: np.random.Generator) -> Arrays:
    """By temperature: low-frequency ratio, mean and mean square of each image's error after, and before; (T, R)."""
    rows = [images(chunk["variant"], T, preset["replicas"], Live(rng)) for T in TEMPERATURES]
    found: Arrays = {}
    for number, when in enumerate(("before", "after")):
        errors = np.stack([row[number] for row in rows])
        found |= {
            f"{when}.low": low_frequency_ratio(errors),
            f"{when}.mean": errors.mean(axis=-1),
            f"{when}.square": (errors**2).mean(axis=-1),
        }
    return found


def combine(preset: Any, results: Sequence[Arrays]) -> Arrays:
    """By variant."""
    return {f"{name}.{key}": each for name, part in zip(VARIANTS, results, strict=True) for key, each in part.items()}


def check(a: Arrays) -> list[Claim]:
    """Unbiased at every temperature; how blue it gets, and at which cost."""
    claims = []
    for name in VARIANTS:
        for T, mean in zip(TEMPERATURES, a[f"{name}.after.mean"], strict=True):
            groups = mean[: len(mean) // 64 * 64].reshape(64, -1).mean(axis=1)
            claims.append(Claim("MCMC-C08", criteria.unbiased(1 + groups, 1, eps=0.01), f"{name}, T = {T:g}: mean"))
        low, square = a[f"{name}.after.low"].mean(axis=1), a[f"{name}.after.square"].mean(axis=1)
        best, none = int(low.argmin()), a[f"{name}.before.square"].mean()
        text = f"{low[best]:.3f} at T = {TEMPERATURES[best]:g}, where the variance is {square[best] / none:.3g} times"
        claims.append(Claim("MCMC-C08", criteria.reported(text), f"{name}: smallest low-frequency ratio"))
    return claims


def draw(a: Arrays) -> "Picture":
    """Low-frequency ratio and variance over the temperature."""
    picture, axes = style.panels(1, 2, width=4.4, height=3.2)
    for number, name in enumerate(VARIANTS):
        low, square = a[f"{name}.after.low"].mean(axis=1), a[f"{name}.after.square"].mean(axis=1)
        look = style.nth(number, label=name, markevery=1)
        axes[0, 0].semilogx(TEMPERATURES, low, **look)
        axes[0, 1].semilogx(TEMPERATURES, square / a[f"{name}.before.square"].mean(), **look)
    for axis in axes[0]:
        axis.axhline(1, color=style.INK, lw=1, ls=":", marker="", label="white noise, no mutations")
        axis.set_xlabel("temperature $T$")
    axes[0, 0].set(ylabel="low-frequency ratio", title="How blue the error gets", ylim=(0, 1.6))
    axes[0, 1].set(ylabel="variance / without mutations", title="What it costs", ylim=(0, 1.6))
    style.below(axes[0, 0], ncols=1)
    style.below(axes[0, 1], ncols=1)
    return picture


FIGURE = Figure(
    id="MCMC-C08",
    title="Blue noise by mutations, without bias",
    world="toy1d",
    source="[MCMC 1, 8]",
    claims=("MCMC-C08",),
    presets={"quick": {"replicas": 1088}, "paper": {"replicas": 25_600}},
    chunks=chunks,
    compute=compute,
    combine=combine,
    draw=draw,
    check=check,
)

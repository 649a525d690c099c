"""Functions of paths, to see whether contribution weights integrate them: E[f(Y) W_Y] = int f.  [GRIS Def. 4.1]"""

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType

import numpy as np

from restir_ref.batch import Array
from restir_ref.chance import Chance
from restir_ref.transport.paths import Path
from restir_ref.transport.restir_pt import PathIntegrals
from tests.flatland.renderings import Before, Bias, Stage, bias, frames, previous

FAINT = 0.1
"""Functions are 0 where p_hat is less: 1 / p_hat, so W, has no finite variance near 0, and no sample mean would do."""

FRAMES = (1, 2, 5, 20)

Probe = Callable[[Path], Array]


def carries(x: Path) -> Array:
    """Paths that are worth counting."""
    return np.asarray(x.F.mean(axis=0) > FAINT)


def bump(x: Path) -> Array:
    """Of the place in the pixel, which shifts keep."""
    return np.asarray(np.exp(-(((x.u[0] - 0.5) / 0.35) ** 2)))


PROBES: Mapping[str, Probe] = MappingProxyType(
    {
        "constant": lambda x: carries(x) * 1.0,
        "half of the domain": lambda x: carries(x) & x.nee,
        "p_hat": lambda x: np.asarray(x.F.mean(axis=0)),
        "bump": lambda x: carries(x) * bump(x),
    }
)


def probed(stage: Stage, probe: Probe) -> Bias:
    """E[f(Y) W_Y] against E[f(X) W_X] of the frame's own initial samples."""
    y, x = (probe(each.x) * each.W for each in (stage.Y, stage.X))
    n = stage.here.of.n  # type: ignore[attr-defined]
    return bias((y - x).reshape(-1, n), x.reshape(-1, n))


def probes(
    of: Sequence[PathIntegrals], replicas: int, chance: Chance, rated: Before = previous
) -> dict[tuple[int, str, str], Bias]:
    """Every probe after every stage of some frames; there is no history in the first."""
    stages = frames(of, replicas, chance, ("temporal", "spatial"), rated)
    later = (s for s in stages if s.frame in FRAMES and s.name != "initial" and (s.frame, s.name) != (1, "temporal"))
    return {(s.frame, s.name, name): probed(s, probe) for s in later for name, probe in PROBES.items()}

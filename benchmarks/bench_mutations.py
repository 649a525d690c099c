"""What five mutations per frame cost beside a frame without: in rays per pixel, and in CPU time, by both forms.

Frames have history and one round of spatial reuse.  Time is the least of interleaved repeats.  Takes 20 s.
"""

import sys
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from bench_resampling import Row, keep_freed_memory, print_sections
from bench_transport import cpu, rng

from figures.experiments.mutated import LOOP, VIEWS
from restir_ref.chance import Live
from restir_ref.decorrelation import mutations
from restir_ref.integrals import Pixels, Reservoirs
from restir_ref.loop import WHOLE, frame, random_in_row
from restir_ref.transport.counting import counted, rays
from restir_ref.transport.mutations import Retraced, TwoRays
from restir_ref.transport.paths import Tracer
from restir_ref.transport.restir_pt import PathIntegrals

REPLICAS, REPEATS, WARM = 32, 7, 4
FORMS: Mapping[str, tuple[Callable[[Tracer], PathIntegrals], int]] = {
    "none": (TwoRays, 0),
    "two rays": (TwoRays, 5),
    "retraced": (Retraced, 5),
}


@dataclass(frozen=True)
class Renderer:
    """A frame to repeat, and the rays that it counts."""

    of: PathIntegrals
    k: int
    asked: Counter[str]
    history: Reservoirs

    def __call__(self) -> Reservoirs:
        """The same frame every time."""
        here = Pixels(self.of, np.arange(REPLICAS * self.of.n))
        passes = replace(WHOLE, mutation=mutations(self.k))
        return frame(here, Live(rng()), LOOP, random_in_row, self.history, [here], passes=passes)


def renderer(view: str, form: str) -> Renderer:
    """One with some frames behind it."""
    make, k = FORMS[form]
    asked = Counter[str]()
    t = VIEWS[view].tracer
    of, chance = make(replace(t, scene=counted(t.scene, asked))), Live(rng())
    here, passes, X = Pixels(of, np.arange(REPLICAS * of.n)), replace(WHOLE, mutation=mutations(k)), None
    for _ in range(WARM):
        X = frame(here, chance, LOOP, random_in_row, X, [here] if X else (), passes=passes)
    assert X is not None
    return Renderer(of, k, asked, X)


def costs(view: str) -> Iterator[Row]:
    """Both forms over no mutations."""
    runs = {form: renderer(view, form) for form in FORMS}
    spent = {}
    for form, run in runs.items():
        run.asked.clear()
        run()
        spent[form] = rays(run.asked) / (REPLICAS * run.of.n)
    taken = cpu(runs, REPEATS)
    for form in ("two rays", "retraced"):
        yield Row(
            f"{form}: rays of a frame with 5 mutations over {spent['none']:.1f} without", spent[form] / spent["none"]
        )
        yield Row(f"{form}: CPU time, the same ratio", taken[form] / taken["none"])


def main() -> int:
    """Print all rows."""
    keep_freed_memory()
    return print_sections({view: partial(costs, view) for view in ("FS2, inset", "FS3, inset")})


if __name__ == "__main__":
    sys.exit(main())

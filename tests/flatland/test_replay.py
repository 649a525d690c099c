"""Random numbers have a name each: the chunk's stream, the call (frame and stage), and the column (replica and pixel).

So a run can be replayed, and two methods can be compared on the same numbers.
"""

from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from figures.engine import jobs
from flatland2d import SCENES
from restir_ref.batch import Array
from restir_ref.chance import Live
from restir_ref.integrals import Pixels
from restir_ref.loop import REAL_TIME, frame, random_in_row
from restir_ref.mis import CANONICAL_COVERS, WEIGHTS
from restir_ref.restir import shade
from restir_ref.transport.paths import Tracer
from restir_ref.transport.restir_pt import PathIntegrals
from tests.transport.paths import RULES

PIXELS, REPLICAS, FRAMES = 16, 4, 3


@dataclass(frozen=True)
class Recorded:
    """A chunk's generator that keeps what it gave out, call by call."""

    seed: int = 1
    chunk: int = 0
    drawn: list[Array] = field(default_factory=list)

    def random(self, shape) -> Array:
        self.drawn.append(self.rng.random(shape))
        return self.drawn[-1]

    def __post_init__(self) -> None:
        object.__setattr__(self, "rng", jobs.stream(self.seed, "REPLAY", self.chunk))


def film(rng, rule: str = "hybrid", across: str = "defensive", scene: str = "cornell") -> Array:
    """The last of three frames with temporal and spatial reuse, one value per column."""
    setting, chance = SCENES[scene](), Live(rng)
    of = PathIntegrals(Tracer(setting.scene, setting.pinhole(PIXELS), setting.depth, RULES[rule]))
    here, X = Pixels(of, np.arange(PIXELS * REPLICAS)), None
    preset = replace(REAL_TIME, across=across)
    for _ in range(FRAMES):
        X = frame(here, chance, preset, random_in_row, X, [here])
    return shade(X, here)[0]


@pytest.mark.claims("COM-A07", part="a chunk is replayed by its key")
def test_a_chunk_is_replayed_to_the_last_bit_by_seed_and_number_and_by_nothing_else() -> None:
    once, again = Recorded(), Recorded()
    assert film(once).tobytes() == film(again).tobytes()
    assert [each.tobytes() for each in once.drawn] == [each.tobytes() for each in again.drawn]
    for other in (Recorded(seed=2), Recorded(chunk=1)):
        assert not (film(other) == film(Recorded())).all()
        assert not np.isin(np.concatenate([each.ravel() for each in other.drawn]), once.drawn[0]).any()


OTHERS = {
    **{f"the {rule} shift": {"rule": rule} for rule in RULES},
    **{f"{name} weights": {"across": name} for name, mis in WEIGHTS.items() if mis.unbiased_for == CANONICAL_COVERS},
    "another scene": {"scene": "matte_cornell"},
}


@pytest.mark.claims("COM-A07", part="two methods on the same numbers")
@pytest.mark.parametrize("other", OTHERS.values(), ids=OTHERS)
def test_another_method_draws_the_same_number_for_every_frame_stage_replica_and_pixel(other) -> None:
    one, two = Recorded(), Recorded()
    film(one)
    film(two, **other)
    assert len(one.drawn) == len(two.drawn) > FRAMES
    assert all(np.array_equal(a, b) for a, b in zip(one.drawn, two.drawn, strict=True))
    assert all(each.shape[-1] == PIXELS * REPLICAS for each in one.drawn)


@pytest.mark.claims("COM-A07", part="two methods on the same numbers")
def test_pairs_on_the_same_numbers_differ_less_than_strangers() -> None:
    """The variance of the difference of two kinds of weights, with common and with independent numbers."""
    one = np.concatenate([film(Recorded(chunk=k)) for k in range(5)])
    common, apart = (
        np.concatenate([film(Recorded(chunk=k + first), across="pairwise") for k in range(5)]) for first in (0, 100)
    )
    assert 0 < np.var(one - common) < 0.5 * np.var(one - apart)


@dataclass(frozen=True, eq=False)
class Impatient(PathIntegrals):
    """A mistake: one more number is drawn if a null sample was."""

    def candidates(self, index, chance):
        for x, W in super().candidates(index, chance):
            if (x.F == 0).any():
                chance.uniform((1, len(index)))
            yield x, W


def test_a_draw_that_depends_on_samples_is_noticed() -> None:
    """Scenes differ in their null samples; right integrals draw by shape alone."""

    def calls(kind, scene: str) -> list[tuple[int, ...]]:
        rng, setting = Recorded(), SCENES[scene]()
        here = Pixels(kind(Tracer(setting.scene, setting.pinhole(2), 3, RULES["hybrid"])), np.arange(2))
        for _ in range(8):
            frame(here, Live(rng), REAL_TIME, random_in_row)
        return [each.shape for each in rng.drawn]

    assert calls(PathIntegrals, "cornell") == calls(PathIntegrals, "ajar")
    assert calls(Impatient, "cornell") != calls(Impatient, "ajar")

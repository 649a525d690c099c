"""Counting what a cache is asked: the same field, which says how often; what the cost of probes is measured in."""

from collections import Counter
from dataclasses import dataclass, replace

from restir_ref.batch import Array
from restir_ref.transport.cache.field import Field
from restir_ref.transport.cache.leaving import Cache
from restir_ref.transport.counting import counted as counted_rays

QUERIES = "probe queries"


@dataclass(frozen=True, eq=False)
class Queried:
    """The same field; asked[QUERIES] counts queries, one per column."""

    field: Field
    asked: Counter[str]

    @property
    def C(self) -> int:
        """Number of channels."""
        return self.field.C

    @property
    def spacing(self) -> Array:
        """Distance (d,) of neighbouring probes, scene units."""
        return self.field.spacing

    def irradiance(self, x: Array, n: Array, w: Array, b: Array) -> Array:
        """E+ (C, N), counted."""
        self.asked[QUERIES] += x.shape[-1]
        return self.field.irradiance(x, n, w, b)


def counted(c: Cache, asked: Counter[str]) -> Cache:
    """The cache and its scene, counting queries and rays into `asked`, and no longer into what they counted before."""
    plain = c.field.field if isinstance(c.field, Queried) else c.field
    return replace(c, scene=counted_rays(c.scene, asked), field=Queried(plain, asked))

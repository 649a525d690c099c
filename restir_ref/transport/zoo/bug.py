"""A bug of the transport: path integrals with one part replaced, to be used wherever `PathIntegrals` are."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

from restir_ref.integrals import Image
from restir_ref.transport.paths import Tracer


@dataclass(frozen=True)
class TransportBug:
    """A named deliberate error: how it gets into renderers, what it looks like, what it breaks, and who sees it.

    `wrong` makes the integrals that err.  `caught_by` are names of `CHECKS`; the tests measure them anew.
    """

    name: str
    story: str
    symptom: str
    breaks: str
    wrong: Callable[[Tracer], Image]
    caught_by: tuple[str, ...] = ()


def family(bugs: Iterable[TransportBug]) -> Mapping[str, TransportBug]:
    """The bugs by name."""
    return MappingProxyType({bug.name: bug for bug in bugs})

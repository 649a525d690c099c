"""A bug of the transport: path integrals with one part replaced, to be used wherever `PathIntegrals` are."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

from restir_ref.batch import Array
from restir_ref.integrals import Image
from restir_ref.transport.paths import Tracer


@dataclass(frozen=True)
class TransportBug:
    """A named deliberate error: how it gets into renderers, what it looks like, what it breaks, and who sees it.

    `wrong` makes the integrals that err.  `caught_by` names those of `CHECKS` that see it in a scene that suits
    it, and the tests measure that anew; the others stayed silent there.

    >>> from restir_ref.transport.proofs.zoo import TRANSPORT_BUGS
    >>> TRANSPORT_BUGS["distances swapped"].caught_by
    ('finite differences', 'change of variables', 'spread over pixels', 'mean of the image')
    """

    name: str
    story: str
    symptom: str
    breaks: str
    wrong: Callable[[Tracer], Image]
    caught_by: tuple[str, ...]


@dataclass(frozen=True)
class ModelBug:
    """A named deliberate error on a small model that is exact: how it gets in, what it looks like, what it breaks.

    `right` and `wrong` compute the exact relative bias of the model, (places, cells), without the error and with it.

    >>> from restir_ref.transport.proofs.zoo.cached import CACHE_BUGS
    >>> bug = CACHE_BUGS["no residual beside bounded geometry"]
    >>> float(abs(bug.right()).max()), float(bug.wrong().min().round(2))
    (0.0, -0.94)
    """

    name: str
    story: str
    symptom: str
    breaks: str
    right: Callable[[], Array]
    wrong: Callable[[], Array]


CHECKS: Mapping[str, str] = MappingProxyType(
    {
        "round trip": "T_ji(T_ij(x)) = x, F and all, and J_ij J_ji = 1",
        "re-tracing": "the tracer, given the primary sample u^y of y = T(x), finds y and what it carries",
        "finite differences": "J = |det du^y / du^x|",
        "change of variables": "E_x[p_hat(Tx) J W h(Tx)] = E_y[p_hat(y) W 1{T^-1 y defined} h(y)], h Talbot's weight in"
        " bins of J, reconnection index, length and technique",
        "spread over pixels": "standard deviation over pixels of the z-score of what reuse adds: 1 without bias",
        "mean of the image": "z of what reuse adds to the whole image",
        "disoccluded pixels": "z of what reuse adds to the pixels that the previous frame did not see",
    }
)
"""What one can hold against a transport: the first three path by path, the others over many samples."""


def family(bugs: Iterable[TransportBug]) -> Mapping[str, TransportBug]:
    """The bugs by name."""
    return MappingProxyType({bug.name: bug for bug in bugs})

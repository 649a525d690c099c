"""A bug of the zoo: the right loop with one part replaced, on a scene small enough to know its bias exactly."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

from restir_ref.batch import Array
from restir_ref.oracle.cells import Frame
from restir_ref.oracle.laws import bias_of
from restir_ref.oracle.scenes import Loop, Parts, Scene


@dataclass(frozen=True)
class Bug:
    """A named deliberate error: how it gets into renderers, what it looks like, what it breaks.

    `right` and `wrong` are made of the same parts but one.

    >>> from restir_ref.oracle.zoo import BUGS
    >>> BUGS["divided by M twice"].symptom
    'dark to 1/M, at every number of candidates'
    """

    name: str
    story: str
    symptom: str
    breaks: str
    scene: Callable[[], Scene]
    right: Parts
    wrong: Parts


def of(frame: type[Frame]) -> Parts:
    """The two-frame loop made of another kind of frame, for all shifts and targets."""
    return Parts(here=frame, near=frame)


def family(bugs: Iterable[Bug]) -> Mapping[str, Bug]:
    """The bugs by name."""
    return MappingProxyType({bug.name: bug for bug in bugs})


def exact_bias(loop: Loop, scene: Scene) -> Array:
    """Relative bias per cell of a loop on a scene, enumerated; (n, K).

    >>> from restir_ref.oracle.zoo import BUGS, exact_bias
    >>> bug = BUGS["Jacobian left out"]
    >>> scene = bug.scene()
    >>> right, wrong = (exact_bias(loop(scene), scene) for loop in (bug.right, bug.wrong))
    >>> bool(abs(right).max() < 1e-12), float(wrong.max().round(3))
    (True, 0.4)
    """
    return bias_of(loop, scene.v, scene.support)

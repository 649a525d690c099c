"""Path space as integrals: what ReSTIR PT plugs into the passes.  [GRIS 8]"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice

import numpy as np

from restir_ref.batch import Array, changed, rows
from restir_ref.chance import Chance
from restir_ref.integrals import Pixels, Shifted
from restir_ref.transport.paths import Path, Tracer, Tree, leaves, trace
from restir_ref.transport.record import record
from restir_ref.transport.shifts import shift_path
from restir_ref.transport.subtrees import of_leaf, one_of


@dataclass(frozen=True, eq=False)
class PathIntegrals:
    """The pixels' path integrals in primary sample space; p_hat is the mean of F over channels.

    >>> import numpy as np
    >>> from flatland2d import setting
    >>> from restir_ref import Live, Pixels, initial, shade, spatial
    >>> from restir_ref.loop import random_in_row
    >>> from restir_ref.transport.paths import Connectability, Tracer
    >>> from restir_ref.transport.restir_pt import PathIntegrals
    >>> room, chance = setting("crease"), Live(np.random.default_rng(1))
    >>> row = PathIntegrals(Tracer(room.scene, room.pinhole(32), 2, Connectability(roughness=0.2, distance=0.02)))
    >>> here = Pixels(row, np.arange(20 * row.n))
    >>> X = initial(here, chance)
    >>> Y = spatial(X, here, random_in_row(row, here.index, 3, 8, chance), chance)
    >>> bool(shade(Y, here).std() < shade(X, here).std())
    True
    """

    tracer: Tracer

    @property
    def n(self) -> int:
        """Number of pixels."""
        return self.tracer.sensor.n

    @property
    def shape(self) -> tuple[int, ...]:
        """Rows and columns of the image, or of each of its crops; (n,) for pixels in a row."""
        shape: tuple[int, ...] = getattr(self.tracer.sensor, "shape", (self.n,))
        return shape

    def candidates(self, index: Array, chance: Chance) -> Iterator[tuple[Path, Array]]:
        """One path tree, resampled to one of its leaves, which cover disjoint parts of the sample space."""
        tree = trace(self.tracer, chance.uniform((self.tracer.D, len(index))), index % self.n)
        k, nee, F = zip(*self.leaves(tree), strict=True)
        leaf, W = one_of(F, chance)
        yield record(self.tracer, tree, np.array(k)[leaf], np.array(nee)[leaf], of_leaf(F, leaf)), W

    def leaves(self, tree: Tree) -> Iterator[tuple[int, bool, Array]]:
        """(k, nee, F) of the leaves that count: all of them."""
        return leaves(tree)

    def target(self, index: Array, x: Path) -> Array:
        """p_hat = mean of F over channels, visibility and MIS weight included."""
        return np.asarray(x.F.mean(axis=0))

    def contribution(self, index: Array, x: Path) -> Array:
        """F = omega f / p, (C, N)."""
        return x.F

    def shift(self, x: Path, index: Array, to: Pixels) -> Shifted:
        """Replay and reconnect in the other image's scene, seen by its sensor."""
        there: PathIntegrals = to.of  # type: ignore[assignment]
        y, J = shift_path(there.tracer, x, to.index % there.n)
        return Shifted(y, J)

    def place(self, x: Path) -> Array:
        """The first numbers, which are the place on the film; (film, N)."""
        return rows(x, "u", slice(self.tracer.sensor.film_numbers))

    def displaced(self, x: Path, by: Array) -> Path:
        """The same numbers at another place of the film; not traced yet."""
        film = self.tracer.sensor.film_numbers
        place = (x.u[:film] + by) % 1
        return changed(x, u=np.concatenate([np.where(place < 1, place, 0), x.u[film:]]))


@dataclass(frozen=True, eq=False)
class ScatteredIntegrals(PathIntegrals):
    """The path integrals without k = 0, a light that the sensor's own ray meets: on fluence maps it hides the rest."""

    def leaves(self, tree: Tree) -> Iterator[tuple[int, bool, Array]]:
        """All but the first; no shift changes k."""
        return islice(leaves(tree), 1, None)


@dataclass(frozen=True, eq=False)
class ReconnectionAtX2(PathIntegrals):
    """The reconnection shift taken literally: y_1 joins x_2 or nothing does, for the rule RECONNECTION.  [GRIS 7.2]

    Where x_1 or x_2 is a mirror or glass the shift is undefined; `RECONNECTION` alone replays such
    vertices and reconnects behind them.
    """

    def shift(self, x: Path, index: Array, to: Pixels) -> Shifted:
        """Undefined unless x_2 is the reconnection vertex, a light point sampled from x_1, or not there at all."""
        y = super().shift(x, index, to)
        return Shifted(y.x, np.where((x.c == 2) | (x.k == 0) | ((x.k == 1) & x.nee), y.J, 0.0))

"""What the ends of paths ask of a cache: irradiance, at a surface point, for a direction.  [DDGIR Eq. 5]"""

from typing import Protocol

from restir_ref.batch import Array


class Field(Protocol):
    """Irradiance stored in space: what a query at a surface point tells.  [DDGIR Eq. 5]

    E+ is irradiance (radiance times directions); E+ / C_d, C_d = `ball_volume(d)`, is the cosine-prefiltered radiance:
    radiance 1 from everywhere gives E+ = C_d.
    """

    @property
    def C(self) -> int:
        """Number of channels."""

    @property
    def spacing(self) -> Array:
        """Distance (d,) of neighbouring probes along each axis, scene units."""

    def irradiance(self, x: Array, n: Array, w: Array, b: Array) -> Array:
        """E+ (C, N) in direction w (d, N) for a surface point x (d, N) with unit normal n (d, N) on the viewer's side.

        w = n for the diffuse term, w = w_i for the glossy one.  b (d, N) displaces the point at which corners and
        visibility are looked up (see `biases`); the wrap weight uses x and n themselves.
        """

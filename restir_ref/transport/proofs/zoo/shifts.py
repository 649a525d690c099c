"""Bugs in shifts of paths.  [GRIS 7]"""

from functools import partial

import numpy as np

from restir_ref.batch import Array, ratio
from restir_ref.transport.proofs.zoo.bug import TransportBug
from restir_ref.transport.proofs.zoo.domains import (
    Loosened,
    Refused,
    anything_goes,
    never_early,
    small,
    through_walls,
)
from restir_ref.transport.proofs.zoo.ends import End, Misvalued, Rescaled
from restir_ref.transport.vectors import power


def left_out(d: int, x: End, y: End) -> Array:
    """1 / J."""
    return ratio(x.A, y.A) * power(y.r / x.r, d - 1)


def inverted(d: int, x: End, y: End) -> Array:
    """1 / J^2."""
    return left_out(d, x, y) ** 2


def other_power(d: int, x: End, y: End) -> Array:
    """(r_x / r_y)^d for (r_x / r_y)^(d-1): the square of 3D in flatland."""
    return np.asarray(x.r / y.r)


def distances_swapped(d: int, x: End, y: End) -> Array:
    """(r_y / r_x)^(d-1) for (r_x / r_y)^(d-1)."""
    return power(y.r / x.r, 2 * (d - 1))


def no_cosines(d: int, x: End, y: End) -> Array:
    """|cos_x / cos_y|."""
    return np.asarray(x.cos / y.cos)


def no_lobe_probability(d: int, x: End, y: End) -> Array:
    """P_x / P_y at x_(c-1)."""
    return np.asarray(x.P / y.P)


def no_second_density(d: int, x: End, y: End) -> Array:
    """p_x / p_y of the direction leaving x_c."""
    return ratio(x.p_out, y.p_out)


def light_density_kept(d: int, x: End, y: End) -> Array:
    """The rival of a BSDF sample that meets a light is rated from x_k instead of y_k."""
    return ratio(y.p_all + y.p_light, y.p_all + x.p_light)


def mis_weight_kept(d: int, x: End, y: End) -> Array:
    """omega_x / omega_y."""
    return ratio(x.omega, y.omega)


def bsdf_kept(d: int, x: End, y: End) -> Array:
    """f / p at x_c as seen from x_(c-1) instead of y_(c-1)."""
    return ratio(x.beyond, y.beyond)


SHIFT_BUGS = (
    TransportBug(
        "geometric Jacobian left out",
        "The code has reused light samples so far, which need no Jacobian; then paths came.",
        "bright and dark where neighbours see different distances: corners, contacts, depth edges",
        "[GRIS Eq. 19, 52]",
        partial(Rescaled, factor=left_out),
        ("finite differences", "change of variables", "spread over pixels"),
    ),
    TransportBug(
        "inverted path Jacobian",
        "The reconnection's quotient is written with base and offset path exchanged.",
        "bright and dark where neighbours see different distances, more than without a Jacobian",
        "[GRIS Eq. 52, 54]",
        partial(Rescaled, factor=inverted),
        ("finite differences", "change of variables", "spread over pixels", "mean of the image"),
    ),
    TransportBug(
        "distance to the power of another dimension",
        "The squared distance of three dimensions is kept in flatland, or an area is taken for a solid angle.",
        "bright and dark near corners and contacts, where distances differ most",
        "[GRIS Eq. 52]",
        partial(Rescaled, factor=other_power),
        ("finite differences", "change of variables", "spread over pixels"),
    ),
    TransportBug(
        "distances swapped",
        "r_y over r_x for r_x over r_y: base and offset have changed roles between two papers.",
        "bright and dark near corners and contacts, where distances differ most",
        "[GRIS Eq. 52]",
        partial(Rescaled, factor=distances_swapped),
        ("finite differences", "change of variables", "spread over pixels", "mean of the image"),
    ),
    TransportBug(
        "cosines left out of the Jacobian",
        "Squared distances are remembered, the cosines at the reconnection vertex are not.",
        "bright and dark where light arrives at grazing angles",
        "[GRIS Eq. 52]",
        partial(Rescaled, factor=no_cosines),
        ("finite differences", "spread over pixels"),
    ),
    TransportBug(
        "lobe probability left out of the Jacobian",
        "The density of a direction is that of its lobe alone; choosing the lobe is forgotten.",
        "bright and dark outlines between materials of different lobes",
        "[GRIS Eq. 50, 54]",
        partial(Rescaled, factor=no_lobe_probability),
        ("finite differences", "spread over pixels"),
    ),
    TransportBug(
        "second density ratio left out",
        "The direction leaving the reconnection vertex stays the same, so its density seems to cancel; yet it depends"
        " on the direction arriving.",
        "nothing to be seen; glossy surfaces behind one more bounce are off by less than the noise",
        "[GRIS Eq. 54]",
        partial(Rescaled, factor=no_second_density),
        ("finite differences",),
    ),
    TransportBug(
        "light density of the base path kept",
        "A BSDF sample has met a light; its MIS weight is stored with the path, though the light's density as seen"
        " from the new vertex differs.",
        "slightly bright and dark close to lights",
        "[GRIS Eq. 49; 7.6]",
        partial(Misvalued, factor=light_density_kept),
        ("round trip", "re-tracing", "change of variables", "spread over pixels"),
    ),
    TransportBug(
        "MIS weight of the base path kept",
        "The end of the path is copied with its MIS weight, which depends on the direction arriving before it.",
        "slightly bright and dark close to lights and on glossy surfaces",
        "[GRIS Eq. 49; 7.6]",
        partial(Misvalued, factor=mis_weight_kept),
        ("round trip", "re-tracing", "change of variables"),
    ),
    TransportBug(
        "BSDF beyond the connection kept",
        "The radiance leaving the reconnection vertex is stored and taken for diffuse, as in ReSTIR GI.",
        "bright and dark wherever glossy surfaces are lit indirectly",
        "[GRIS 7.6, 9.3]",
        partial(Misvalued, factor=bsdf_kept),
        ("round trip", "re-tracing", "spread over pixels"),
    ),
    TransportBug(
        "no test for an earlier connection",
        "The offset path replays to the index where the base path reconnects, though it could have reconnected before.",
        "slightly bright and dark next to glossy surfaces",
        "[GRIS 7.4, 7.6]",
        partial(Loosened, before=never_early),
        ("re-tracing", "spread over pixels"),
    ),
    TransportBug(
        "connection tested for the base path only",
        "Roughness and distance are tested where the base path is recorded, and not again where it is shifted to.",
        "fireflies on glossy surfaces and in corners, hardly anything else",
        "[GRIS 7.3, 7.5]",
        partial(Loosened, at=anything_goes),
        ("re-tracing",),
    ),
    TransportBug(
        "connection through walls",
        "The visibility ray of the reconnection is saved, and the copied radiance shines through what is between.",
        "bright light leaks, dark beside them",
        "[GRIS 7.2]",
        partial(Loosened, at=through_walls),
        ("re-tracing", "change of variables", "spread over pixels"),
    ),
    TransportBug(
        "large Jacobians refused one way",
        "Shifts with a large Jacobian are refused against fireflies; their inverses, whose Jacobian is small, pass.",
        "dark where distances change, bright beside it, fewer fireflies",
        "[GRIS Def. 4.2, Eq. 35]",
        partial(Refused, allowed=small),
        ("round trip", "change of variables", "spread over pixels", "mean of the image"),
    ),
)

"""Behind `09_what_a_probe_knows`: volumes of probes in flatland, what a query is told, and where light leaks.

Every volume draws its rays from a fixed seed.
"""

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from figures.experiments.volumes import truth
from figures.report import style
from flatland2d import radiosity
from flatland2d.directions import MAPS
from flatland2d.probe_pictures import depth_picture, leaks, volume_picture
from flatland2d.probe_rooms import PROBE_ROOMS, probes
from flatland2d.scenes import SCENES, Setting
from notebooks.show import Table
from restir_ref import Live
from restir_ref.batch import Array
from restir_ref.transport.cache.biases import self_shadow
from restir_ref.transport.cache.converge import converge
from restir_ref.transport.cache.grid import distances
from restir_ref.transport.cache.maps import fetched
from restir_ref.transport.cache.update import Updating, update
from restir_ref.transport.cache.volume import Volume, Weighting, chebyshev, unlit, wrap
from restir_ref.transport.vectors import dot

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Picture

SEED = 1
ROOMS = ("open_room", "sunlit", "crease")
SPACINGS = (4, 8, 16)
HOW = Updating(rays=512)


def setting(room: str) -> Setting:
    """A room by its name."""
    return {**SCENES, **PROBE_ROOMS}[room]()


@cache
def volume(room: str, per_unit: float = 8) -> Volume:
    """A room's volume, updated until nothing changes by more than five percent."""
    return converge(empty(room, per_unit), setting(room).scene, HOW, Live(np.random.default_rng(SEED)), tolerance=0.05)


def empty(room: str, per_unit: float = 8) -> Volume:
    """Probes that have seen nothing yet."""
    of = setting(room)
    return unlit(of.scene, probes(of, per_unit), MAPS)


@cache
def young(room: str, frames: int) -> Volume:
    """After a few frames without memory, a = 0: a frame is a bounce."""
    v, chance = empty(room), Live(np.random.default_rng(SEED))
    for _ in range(frames):
        v = update(v, setting(room).scene, replace(HOW, hysteresis=0.0), chance)
    return v


# ---------------------------------------------------------------- pictures


def light(room: str, frames: str) -> "Picture":
    """What probes know of light after some frames: a lobe's radius in direction n is E(n)."""
    picture, axes = style.panels(1, 1, width=5.6, height=4.6)
    v = volume(room) if frames == "all" else young(room, int(frames))
    volume_picture(axes[0, 0], setting(room), v)
    axes[0, 0].set_title(f"{room}: {frames} frames")
    axes[0, 0].legend(loc="upper left", bbox_to_anchor=(1, 1))
    return picture


def distance(room: str) -> "Picture":
    """How far some probes see: the mean, and one standard deviation more and less, dotted."""
    picture, axes = style.panels(1, 1, width=5.6, height=4.6)
    v = volume(room)
    depth_picture(axes[0, 0], setting(room), v, np.flatnonzero(v.active)[::11].tolist())
    axes[0, 0].set_title(f"{room}: every 11th probe")
    axes[0, 0].legend(loc="upper left", bbox_to_anchor=(1, 1))
    return picture


def bound(r1: float = 0.5, deviation: float = 0.1) -> "Picture":
    """Chebyshev's bound, and its cube, for a wall at a mean distance r1."""
    picture, axes = style.panels(1, 1, width=5.0, height=3.0)
    v = np.linspace(0.3, 1, 200)
    r2 = r1**2 + deviation**2
    axes[0, 0].plot(v, chebyshev(v, np.full(200, r1), np.full(200, r2)), **style.nth(0, label="cubed, never below .05"))
    plain = np.where(v <= r1, 1, deviation**2 / (deviation**2 + (v - r1) ** 2))
    axes[0, 0].plot(v, plain, **style.nth(1, label="the bound itself"))
    axes[0, 0].set(xlabel="distance v of the point from the probe", ylabel="visibility", title="r1 = .5, deviation .1")
    axes[0, 0].legend()
    return picture


# ---------------------------------------------------------------- a query


def floor(x: Array) -> tuple[Array, Array]:
    """Points of the floor and their normals, (2, N) each."""
    return np.stack([x, np.zeros_like(x)]), np.repeat([[0.0], [1.0]], len(x), axis=1)


def asked(room: str, x: float, per_unit: float = 8) -> Table:
    """The four probes around a point of the floor: where they are, what each says, and how far it is believed."""
    v, (at, n), rows = volume(room, per_unit), floor(np.array([x])), []
    b = self_shadow(n, n, v.spacing)
    told = list(v.heard(at, n, b))
    whole = sum(float(weight[0]) for _, weight in told)
    for (probe, weight), (_, near) in zip(told, v.grid.corners(at + b), strict=True):
        place = v.grid.place(probe)
        away, to_point = distances(at + b - place)
        r1, r2 = fetched(v.r, probe, *v.maps.depth.fetch(to_point))
        E = fetched(v.E, probe, *v.maps.irradiance.fetch(n))[0]
        _, to_probe = distances(place - at)
        sees = bool(setting(room).scene.visible(at, place)[0] and (dot(n, place - at) > 0)[0])
        rows.append(
            (
                f"({place[0, 0]:.2f}, {place[1, 0]:.2f})", f"{near[0]:.2f}", f"{wrap(dot(n, to_probe))[0]:.2f}",
                f"{chebyshev(away, r1, r2)[0]:.2f}", f"{weight[0] / whole:.2f}", f"{E[0]:.2f}", "yes" if sees else "no",
            )
        )  # fmt: skip
    heads = ("probe", "multilinear", "wrap", "visibility", "share", "E(n)", "sees the point")
    return Table(heads, rows)


def irradiance(room: str, x: float, per_unit: float = 8) -> float:
    """What a query at a point of the floor is told."""
    return float(along(room, np.array([x]), per_unit)[0])


def along(room: str, x: Array, per_unit: float) -> Array:
    """What queries at points of the floor are told, (n,)."""
    v, (at, n) = volume(room, per_unit), floor(x)
    return np.asarray(v.irradiance(at, n, n, self_shadow(n, n, v.spacing))[0])


WEIGHTINGS: Mapping[str, Weighting] = MappingProxyType(
    {
        "as it is": Weighting(),
        "without visibility": Weighting(visibility=lambda v, r1, r2: np.ones_like(v)),
        "without wrap": Weighting(wrap=np.ones_like),
    }
)


def leaking(room: str) -> Table:
    """Of what is told all around the eye, the share that comes from probes that do not see the point."""
    rows = []
    for name, weighting in WEIGHTINGS.items():
        _, share = leaks(replace(volume(room), weighting=weighting), setting(room))
        rows.append((name, f"{100 * share.mean():.1f} %", f"{100 * (share > 0.5).mean():.1f} %"))
    return Table(("weights", "leaks, on average", "points where most leaks"), rows)


# ---------------------------------------------------------------- shadows

SHADOW = "lamp_beside_probe"
"""A small lamp over a table: the shadow on the floor beside it has a sharp edge."""


def strip(count: int = 160) -> "Picture":
    """The floor beside a table: the edge of its shadow is as wide as probes are apart."""
    picture, axes = style.panels(1, 1, width=6.4, height=3.2)
    x = np.linspace(0.61, 0.99, count)
    for k, per_unit in enumerate(SPACINGS):
        axes[0, 0].plot(x, along(SHADOW, x, per_unit), **style.nth(k, label=f"{per_unit} per unit"))
    axes[0, 0].plot(x, true_irradiance(x), **style.look("truth"))
    axes[0, 0].set(xlabel="x on the floor", ylabel="irradiance E", title="The table ends at .6, its shadow at .75")
    axes[0, 0].legend()
    return picture


def true_irradiance(x: Array) -> Array:
    """E at points of the floor beside the table, by radiosity; (n,)."""
    of = truth("FS12")
    return np.asarray(2 * radiosity.shares(of.s, of.p, *floor(x)) @ of.B)


def error(per_unit: float) -> float:
    """Mean error of the floor's irradiance beside the table, over its mean."""
    x = np.linspace(0.61, 0.99, 160)
    true = true_irradiance(x)
    return float(abs(along(SHADOW, x, per_unit) - true).mean() / true.mean())

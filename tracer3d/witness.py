"""An outside witness: scene, sensor and depth handed to Mitsuba 3, which shares no code with us.

What has to match, so that both estimate the same number for every pixel:

- Paths have at most depth + 1 edges; there is no roulette; a pixel's filter is a box.
- All surfaces but dielectrics have two sides; normals are those of the faces; lamps shine to their front.
- GGX has alpha = roughness^2 and no Fresnel term: a rough conductor of material `none`.  Its Smith term is
  separable there, G_1(o) G_1(i), and height-correlated here: .4% of the mean of CB3's inset.
- Sums of lobes are blends (1 - w) a + w b: the weights are divided out of the colours.
- Radiance passes interfaces with a factor eta^2 there, basic radiance without one here.  It cancels where eye
  and lamps are outside of all solids; other scenes are refused.

Floating point: Mitsuba has single precision, and starts rays 9e-5 (1 + largest coordinate) off a surface.  In a room
of size 1 beside the origin that is .1% of the radius of GlassBall3's ball, and .3% of its caustic; so scenes are moved
to the origin and enlarged.
"""

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType, ModuleType
from typing import Any

import numpy as np

from restir_ref.batch import Array
from restir_ref.guards import whole
from restir_ref.transport.lobes import KINDS, TINY
from restir_ref.transport.materials import ROUNDING
from restir_ref.transport.rays import arrive
from restir_ref.transport.scene import Scene
from tracer3d.sensors import Pinhole

Description = dict[str, Any]

NO_ROULETTE = 2**30
ENLARGED = 1000.0
NEAR = 1e-4
"""Distance from the eye at which Mitsuba's rays begin, in units of a room's height."""

Place = Callable[[Array], Array]
"""Where points (.., 3) of ours are in Mitsuba's space."""

BLACK = 0.0, 0.0, 0.0
SMOOTH, ROUGH = ("glass reflection", "glass transmission"), ("rough reflection", "rough transmission")


def mitsuba(variant: str) -> ModuleType:
    """Mitsuba 3 in one of its variants, with one thread, silent but for errors.

    Raises ImportError where it is not installed.
    """
    try:
        import drjit  # noqa: PLC0415
        import mitsuba as mi  # noqa: PLC0415
    except ImportError as missing:
        raise ImportError("the witness is Mitsuba 3: pip install -c constraints.txt -e '.[reference]'") from missing
    mi.set_variant(variant)
    mi.set_log_level(mi.LogLevel.Error)
    drjit.set_thread_count(1)
    found: ModuleType = mi
    return found


def rendered(mi: ModuleType, scene: Any, samples: int, seed: int) -> Array:
    """The picture of a loaded scene with so many paths per pixel, (3, rows, columns)."""
    whole(samples, 1, "the number of samples", "It counts paths per pixel.")
    image = np.array(mi.render(scene, spp=samples, seed=seed), dtype=float)
    return np.asarray(image.transpose(2, 0, 1))


def exported(mi: ModuleType, scene: Scene, sensor: Pinhole, depth: int, sampler: str = "independent") -> Description:
    """What `mi.load_dict` reads: the scene, seen by the sensor, up to `depth` scattering vertices.

    Raises ValueError, naming it, for what Mitsuba has not or has otherwise.
    """
    whole(depth, 1, "the path depth", "It counts scattering vertices; 1 is direct light.")
    _check(scene)
    place = _placed(scene)
    found: Description = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": depth + 1, "rr_depth": NO_ROULETTE},
        "sensor": _perspective(mi, sensor, sampler, place),
    }
    for kind in _groups(scene):
        found[f"facets {len(found)}"] = _mesh(mi, scene, kind, place)
    for k, (centre, radius) in enumerate(zip(scene.centres.T, scene.radii[:, 0], strict=True)):
        bsdf = material(scene, int(scene.material[scene.S + k]))
        ball = {"type": "sphere", "center": place(centre).tolist(), "radius": ENLARGED * float(radius)}
        found[f"ball {k}"] = {**ball, "bsdf": bsdf}
    return found


def _placed(scene: Scene) -> Place:
    """The middle of the scene's box goes to the origin."""
    points = np.concatenate([scene.corners.transpose(1, 0, 2).reshape(3, -1), scene.centres], axis=1)
    middle = (points.min(axis=1) + points.max(axis=1)) / 2
    return lambda x: np.asarray(ENLARGED * (x - middle))


def _check(scene: Scene) -> None:
    """Raise ValueError for channels that are not three, facets in one place, and lamps in a solid."""
    if (scene.space.d, scene.C) != (3, 3):
        raise ValueError(
            f"Mitsuba renders red, green and blue in 3 dimensions, but this scene has {scene.C} channels in "
            f"{scene.space.d}: give colours and emission three numbers."
        )
    together = getattr(scene.surfaces, "coincidence", None)
    if together is not None and together.others.size:
        raise ValueError(
            f"facet {together.others[0]} lies in the plane of another one and overlaps it, and Mitsuba meets either: "
            f"move one of them."
        )
    lit = np.flatnonzero(scene.emission[:, : scene.S].any(axis=0))
    v, _, met = arrive(scene, scene.corners.mean(axis=0)[:, lit], scene.normals[:, lit])
    inside = met & ~v.front & np.isin(v.material, transmitting(scene))
    if inside.any():
        raise ValueError(
            f"lamp {lit[int(np.argmax(inside))]} shines inside a solid that light passes: its radiance there is eta^2 "
            f"times the basic radiance that we count in; take the lamp out."
        )


def transmitting(scene: Scene) -> list[int]:
    """Materials that light passes."""
    through = [KINDS.index(kind) for kind in KINDS if kind.endswith("transmission")]
    table = scene.materials
    rows = np.isin(table.kind, through) & (table.weight.T.reshape(-1) > 0)
    return np.flatnonzero(rows.reshape(-1, table.L).any(axis=1)).tolist()


def _perspective(mi: ModuleType, sensor: Pinhole, sampler: str, place: Place) -> Description:
    """The crop of the film."""
    columns, rows = sensor.film
    film = {
        "type": "hdrfilm",
        "width": columns,
        "height": rows,
        "crop_offset_x": sensor.left,
        "crop_offset_y": sensor.top,
        "crop_width": sensor.width,
        "crop_height": sensor.height,
        "pixel_format": "rgb",
        "component_format": "float32",
        "rfilter": {"type": "box"},
    }
    eye, towards = (place(np.array(point, dtype=float)).tolist() for point in (sensor.eye, sensor.towards))
    look = mi.ScalarTransform4f().look_at(origin=eye, target=towards, up=[*sensor.up])
    return {
        "type": "perspective",
        "fov_axis": "x",
        "fov": float(np.degrees(2 * np.arctan(sensor.half))),
        "near_clip": ENLARGED * NEAR,
        "to_world": look,
        "film": film,
        "sampler": {"type": sampler},
    }


# ---------------------------------------------------------------- shapes

Kind = tuple[int, tuple[float, ...]]


def _kinds(scene: Scene) -> list[Kind]:
    """Material and emission of every facet."""
    emission = scene.emission[:, : scene.S].T.tolist()
    return [(int(m), tuple(e)) for m, e in zip(scene.material[: scene.S], emission, strict=True)]


def _groups(scene: Scene) -> list[Kind]:
    """Facets alike are one mesh, so that the two halves of a lamp are one lamp."""
    return list(dict.fromkeys(_kinds(scene)))


def _mesh(mi: ModuleType, scene: Scene, kind: Kind, place: Place) -> Any:
    """All facets of a kind, with corners of their own; no normals of vertices, so those of faces."""
    which = [k for k, each in enumerate(_kinds(scene)) if each == kind]
    corners = place(scene.corners[:, :, which].transpose(2, 0, 1).reshape(-1, 3))
    bsdf, emission = kind
    properties = mi.Properties()
    properties["bsdf"] = mi.load_dict(material(scene, bsdf))
    if any(emission):
        power = float(np.mean(emission)) * float(_areas(corners).sum())
        lamp = {"type": "area", "radiance": _rgb(emission), "sampling_weight": power}
        properties["emitter"] = mi.load_dict(lamp)
    found = mi.Mesh("facets", len(corners), len(which), props=properties)
    parameters = mi.traverse(found)
    parameters["vertex_positions"] = corners.reshape(-1)
    parameters["faces"] = np.arange(len(corners))
    parameters.update()
    return found


def _areas(corners: Array) -> Array:
    a, b, c = corners.reshape(-1, 3, 3).swapaxes(0, 1)
    return np.asarray(np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2)


# ---------------------------------------------------------------- materials

Part = tuple[str, Array, float]
"""A lobe: its kind, colour (3,), and alpha."""


def material(scene: Scene, index: int) -> Description:
    """A material for Mitsuba.  Raises ValueError, naming its lobes, for one that Mitsuba has not."""
    parts, t = _parts(scene, index), scene.materials
    kinds = [kind for kind, _, _ in parts]
    if set(kinds) <= set(SMOOTH) or set(kinds) <= set(ROUGH):
        return _dielectric(parts, float(t.eta[2 * index * t.L + 1]))
    unknown = [kind for kind in kinds if kind not in ONE_SIDED]
    if unknown:
        raise ValueError(
            f"material {index} has the lobes {', '.join(kinds)}, and Mitsuba has {unknown[0]!r} only as one of the "
            f"two of a dielectric: export a scene without it."
        )
    return {"type": "twosided", "bsdf": _blend(parts)}


def _parts(scene: Scene, index: int) -> list[Part]:
    """The lobes of a material that are not absent."""
    t = scene.materials
    rows = [row for row in range(index * t.L, (index + 1) * t.L) if t.weight[row % t.L, index] > 0]
    return [(KINDS[t.kind[row]], t.colour[:, row], float(t.alpha[row])) for row in rows]


def _dielectric(parts: Sequence[Part], eta: float) -> Description:
    """Reflection and transmission over one index and one roughness; what is not there is black."""
    kinds, alphas = [kind for kind, _, _ in parts], {alpha for _, _, alpha in parts}
    if len(set(kinds)) < len(kinds) or len(alphas) > 1:
        raise ValueError(
            f"the lobes {', '.join(kinds)} with alpha {sorted(alphas)} are no dielectric of Mitsuba's: it has one of "
            f"each, of one roughness."
        )
    colours = {kind.partition(" ")[2]: colour for kind, colour, _ in parts}
    found: Description = {
        "type": "dielectric",
        "int_ior": eta,
        "ext_ior": 1.0,
        "specular_reflectance": _rgb(colours.get("reflection", BLACK)),
        "specular_transmittance": _rgb(colours.get("transmission", BLACK)),
    }
    rough = {"type": "roughdielectric", "distribution": "ggx", "alpha": alphas.pop()}
    return {**found, **rough} if kinds[0] in ROUGH else found


def _blend(parts: Sequence[Part]) -> Description:
    """A sum of lobes as (1 - w) a + w b, weighted by their largest colours.

    Raises ValueError for a sum that would need a colour beyond 1.
    """
    weight = np.array([max(colour.max(), TINY) for _, colour, _ in parts])
    share = weight[0] / weight.sum()
    if weight.sum() > 1 + ROUNDING and len(parts) > 1:
        raise ValueError(
            f"the largest colours of {', '.join(kind for kind, _, _ in parts)} sum to {weight.sum():.4g}, and Mitsuba "
            f"blends colours of at most 1 each: make them darker."
        )
    (kind, colour, alpha), rest = parts[0], [(kind, colour / (1 - share), a) for kind, colour, a in parts[1:]]
    first = ONE_SIDED[kind](_rgb(np.minimum(colour / share, 1)), alpha)
    return {"type": "blendbsdf", "weight": 1 - share, "a": first, "b": _blend(rest)} if rest else first


def _lambert(colour: Description, alpha: float) -> Description:
    return {"type": "diffuse", "reflectance": colour}


def _ggx(colour: Description, alpha: float) -> Description:
    conductor = {"type": "roughconductor", "material": "none", "distribution": "ggx", "alpha": alpha}
    return {**conductor, "specular_reflectance": colour}


def _mirror(colour: Description, alpha: float) -> Description:
    return {"type": "conductor", "material": "none", "specular_reflectance": colour}


ONE_SIDED: Mapping[str, Callable[[Description, float], Description]] = MappingProxyType(
    {"lambert": _lambert, "ggx": _ggx, "mirror": _mirror}
)
"""Lobes that have a BSDF of their own, from colour and alpha."""


def _rgb(colour: Sequence[float] | Array) -> Description:
    return {"type": "rgb", "value": [float(c) for c in colour]}

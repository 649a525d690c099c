"""Fluence, the light from all directions at places of the plane: what makes pictures of flatland.

Small lights are rarely met by a random direction and near ones are badly sampled, so light that comes
directly is found both ways, with the balance heuristic; everything else is path tracing with
`FluenceMap` as its sensor.
"""

import numpy as np

from flatland2d.scenes import Setting
from flatland2d.sensors import FluenceMap
from restir_ref.batch import Array, ratio
from restir_ref.chance import Chance
from restir_ref.transport.paths import RECONNECTION, Tracer, Tree, leaves, trace
from restir_ref.transport.rays import light_pdf, sample_light
from restir_ref.transport.vectors import dot, norm


def fluence(t: Tracer, u: Array, pixel: Array) -> Array:
    """int L(x, w) dw at a place of each pixel, (C, N): direct light and all leaves with k >= 1; radiance x radians."""
    tree = trace(t, u, pixel)
    return np.asarray(direct(t, tree, pixel) + sum(F for k, _, F in leaves(tree) if k > 0))


def direct(t: Tracer, tree: Tree, pixel: Array) -> Array:
    """L_e V / (p_light + p) of a light point, drawn with the numbers of x_1, and of the traced ray; (C, N).

    Densities are per angle, 1 / (2 pi) for rays and p_A r / cos_y for light points.
    """
    x, _, weight = t.sensor.ray(pixel, tree.u[: t.sensor.numbers])
    light = sample_light(t.scene, *t.light_numbers(tree.u, 1))
    to = light.y - x
    r = norm(to)
    cos = np.maximum(ratio(-dot(light.n, to), r), 0) * t.scene.visible(x, light.y)
    sampled = light.emission * ratio(cos, r * light.pdf_area + cos / weight)
    met = tree.T[0] * tree.seen.bare / (1 + weight * light_pdf(t.scene, tree.x[0], tree.r[0]))
    return np.asarray(sampled + met)


def fluence_map(setting: Setting, columns: int, rows: int, samples: int, chance: Chance) -> Array:
    """Mean fluence of every pixel and channel, (rows, columns), row 0 at the bottom; directions are stratified."""
    sensor: FluenceMap = setting.fluence(columns, rows)
    t, total = Tracer(setting.scene, sensor, setting.depth, RECONNECTION), np.zeros(sensor.n)
    for k in range(samples):
        u = chance.uniform((t.D, sensor.n))
        u[2] = (k + u[2]) / samples
        total += fluence(t, u, np.arange(sensor.n)).mean(axis=0)
    return (total / samples).reshape(rows, columns)

"""What a scene file may say: its tables, their keys, and what each key holds."""

from collections.abc import Mapping
from types import MappingProxyType

from restir_ref.transport.lobes import KINDS
from tracer3d.scenes import INSET, PACE
from tracer3d.sensors import FILM, UP
from tracer3d.tables import (
    LARGEST,
    POINT,
    TABLE,
    TABLES,
    TEXT,
    Key,
    Kind,
    either,
    grey_or_colour,
    number,
    numbers,
    whole,
)

Keys = Mapping[str, Key]

LEAST = 1e-9
"""Shorter is no length."""

LENGTH = number("a positive number", LEAST)
COLOUR = grey_or_colour("a number from 0 to 1, or three of them", 1.0)
EMISSION = grey_or_colour("a number >= 0, or three of them", LARGEST)
STRETCH = either("", LENGTH, number("", high=-LEAST))
SCALE = either(
    "a number other than 0, or three of them", numbers("", 3, STRETCH), Kind("", lambda x: (STRETCH.read(x),) * 3)
)
TRIANGLE = numbers("three corners of three numbers each", 3, POINT)
RECTANGLE = numbers("four corners of three numbers each", 4, POINT)
EITHER = either("three corners or four, of three numbers each", TRIANGLE, RECTANGLE)
ZERO, ONE = (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)

FILE: Keys = MappingProxyType(
    {
        "title": Key(TEXT, ""),
        "depth": Key(whole("a whole number from 1 to 100", 1, 100), 4),
        "camera": Key(TABLE),
        "material": Key(TABLE),
        **{shape: Key(TABLES, ()) for shape in ("mesh", "sphere", "triangle", "rectangle", "light")},
    }
)

CAMERA: Keys = MappingProxyType(
    {
        "position": Key(POINT),
        "target": Key(POINT),
        "up": Key(POINT, UP),
        "field_of_view": Key(number("an angle from 0.01 to 179 degrees", 0.01, 179.0)),
        "crop": Key(
            numbers(
                f"a column and a row of the film, which has {FILM[0]} x {FILM[1]} pixels", 2, whole("", 0, FILM[0])
            ),
            tuple((pixels - INSET) // 2 for pixels in FILM),
        ),
        "motion": Key(numbers("two numbers of pixels per frame, to the right and up", 2, number("")), PACE),
    }
)

MATERIAL: Keys = MappingProxyType(
    {"lobes": Key(TABLES), "eta": Key(number("an index of refraction from 0.1 to 10", 0.1, 10.0), 1.5)}
)

SMOOTH: Keys = MappingProxyType(
    {"kind": Key(TEXT), "colour": Key(COLOUR), "weight": Key(number("a positive number", LEAST), None)}
)

ROUGH: Keys = MappingProxyType(
    {
        **SMOOTH,
        "roughness": Key(number("a perceptual roughness from 0.001 to 1 (0 is for mirror and glass)", 0.001, 1.0)),
    }
)

LOBE: Mapping[str, Keys] = MappingProxyType(
    {kind: ROUGH if kind == "ggx" or kind.startswith("rough ") else SMOOTH for kind in KINDS}
)
"""The keys of a lobe by its kind."""

SHAPES: Mapping[str, Keys] = MappingProxyType(
    {
        "mesh": MappingProxyType(
            {
                "file": Key(TEXT),
                "material": Key(TEXT),
                "units": Key(LENGTH, 1.0),
                "scale": Key(SCALE, ONE),
                "rotate": Key(numbers("three angles in degrees", 3, number("")), ZERO),
                "translate": Key(POINT, ZERO),
                "emission": Key(EMISSION, ()),
            }
        ),
        "sphere": MappingProxyType({"centre": Key(POINT), "radius": Key(LENGTH), "material": Key(TEXT)}),
        "triangle": MappingProxyType({"corners": Key(TRIANGLE), "material": Key(TEXT)}),
        "rectangle": MappingProxyType({"corners": Key(RECTANGLE), "material": Key(TEXT)}),
        "light": MappingProxyType({"corners": Key(EITHER), "material": Key(TEXT), "emission": Key(EMISSION)}),
    }
)

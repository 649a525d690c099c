"""Flatland: segments and circles in the plane, a pinhole row and a fluence map, on the transport of any dimension."""

from flatland2d.scenes import SCENES, setting
from flatland2d.sensors import FluenceMap, Pinhole, check_view
from flatland2d.space import PLANE

__all__ = ["PLANE", "SCENES", "FluenceMap", "Pinhole", "check_view", "setting"]

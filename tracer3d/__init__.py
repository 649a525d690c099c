"""Three dimensions: triangles and spheres, a pinhole whose images are crops of a film, on the general transport."""

from tracer3d.scenes import SCENES, setting
from tracer3d.sensors import Pinhole, check_view
from tracer3d.space import SOLID

__all__ = ["SCENES", "SOLID", "Pinhole", "check_view", "setting"]

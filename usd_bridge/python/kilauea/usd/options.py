"""What is asked of the flattening of one frame."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class FlattenOptions:
    """Choices made outside of the stage; None leaves the choice to the stage."""

    time: float | None = None
    """Time code; the start of the stage's range when absent, 0 without a range. Always a number
    in what `MaterialTable` and `LightTable` are given."""
    camera: str | None = None
    """Prim path, or the name of a camera."""
    settings: str | None = None
    """Path of a UsdRenderSettings prim."""
    purposes: frozenset[str] | None = None
    """Purposes to render besides `default`."""
    resolution: tuple[int, int] | None = None
    """Width and height in pixels."""
    image_width: int | None = None
    """Width in pixels; the height follows from the camera's aperture."""
    resolution_scale: float = 1.0
    """Factor on width and height."""
    pixel_aspect_ratio: float | None = None
    """Width of a pixel over its height."""
    mask: tuple[str, ...] = ()
    """Prims to open; everything when empty."""
    scene_lights: bool = True
    """False leaves out the stage's lights."""
    scene_materials: bool = True
    """False renders everything as if nothing were bound."""
    motion_blur: bool = True
    """False never blurs, whatever the shutter."""
    depth_of_field: bool = True
    """False renders with a pinhole, whatever the f-stop."""

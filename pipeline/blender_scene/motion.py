"""Motion keys as key frames: the shutter is open from one frame to the next."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import bpy
import numpy as np
from mathutils import Matrix, Quaternion

if TYPE_CHECKING:
    from exported import ExportedScene

OPENING_FRAME = 1
MOST_STEPS = 7
"""The highest `motion_steps` of Cycles, which stands for 2^7 intervals."""


def open_shutter(scene: ExportedScene) -> None:
    """Blur what moves, if anything in the scene does."""
    bpy.context.preferences.edit.keyframe_new_interpolation_type = "LINEAR"
    blender_scene = bpy.context.scene
    blender_scene.frame_set(OPENING_FRAME)
    if not scene.has_motion:
        return
    render = blender_scene.render
    render.use_motion_blur = True
    render.motion_blur_shutter = 1.0
    render.motion_blur_position = "START"
    blender_scene.cycles.rolling_shutter_type = "NONE"


def move(moving: bpy.types.Object, matrices: list[np.ndarray]) -> None:
    """Give an object its (4, 4) matrix, and key frames where there are several.

    Key frames are of translation, rotation and scale: shear is lost, and turns between keys are
    even where ours are along chords.
    """
    if len(matrices) == 1:
        moving.matrix_world = Matrix(matrices[0].tolist())
        return
    moving.rotation_mode = "QUATERNION"
    before: Quaternion | None = None
    for frame, matrix in zip(key_frames(len(matrices)), matrices, strict=True):
        location, rotation, scale = Matrix(matrix.tolist()).decompose()
        if before is not None and before.dot(rotation) < 0.0:
            rotation.negate()
        before = rotation
        moving.location, moving.rotation_quaternion, moving.scale = location, rotation, scale
        for channel in ("location", "rotation_quaternion", "scale"):
            moving.keyframe_insert(channel, frame=frame)
    set_steps(moving, len(matrices))


def deform(deforming: bpy.types.Object, keys: list[np.ndarray]) -> None:
    """Move an object's vertices through (n, 3) positions at each key."""
    if len(keys) == 1:
        return
    frames = key_frames(len(keys))
    for idx, positions in enumerate(keys):
        block = deforming.shape_key_add(name=f"key {idx}", from_mix=False)
        block.data.foreach_set("co", np.ascontiguousarray(positions, np.float32).ravel())
        if idx == 0:
            continue
        for other, frame in enumerate(frames):
            block.value = float(other == idx)
            block.keyframe_insert("value", frame=frame)
    set_steps(deforming, len(keys))


def set_steps(moving: bpy.types.Object, n_keys: int) -> None:
    """Sample an object at least at its keys."""
    steps = int(np.ceil(np.log2(n_keys - 1))) if n_keys > 2 else 1
    settings: Any = moving.cycles
    settings.use_motion_blur = True
    settings.use_deform_motion = True
    settings.motion_steps = min(max(steps, 1), MOST_STEPS)


def key_frames(n_keys: int) -> list[float]:
    """Return the frame of each key."""
    return [OPENING_FRAME + i / (n_keys - 1) for i in range(n_keys)]

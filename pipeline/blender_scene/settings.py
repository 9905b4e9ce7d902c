"""Cycles set to plain, unbiased path tracing with our depth, filter and seed."""

from __future__ import annotations

from typing import Any

import bpy

FILTERS = {"box": "BOX", "gaussian": "GAUSSIAN", "blackman-harris": "BLACKMAN_HARRIS"}
MAX_BOUNCES = 1024
"""The highest bounce count that Cycles accepts."""


def apply_settings(settings: dict[str, Any], *, samples: int, seed: int, guiding: bool) -> None:
    """Set the active scene up for a comparison: nothing clamped, blurred or stopped early."""
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    cycles = scene.cycles
    cycles.device = "CPU"
    cycles.samples = samples
    cycles.seed = seed
    cycles.use_adaptive_sampling = False
    cycles.use_denoising = False
    cycles.sample_clamp_direct = 0.0
    cycles.sample_clamp_indirect = 0.0
    cycles.blur_glossy = 0.0
    cycles.light_sampling_threshold = 0.0
    cycles.use_light_tree = True
    cycles.use_guiding = guiding
    cycles.caustics_reflective = True
    cycles.caustics_refractive = True
    cycles.min_light_bounces = 0
    cycles.min_transparent_bounces = 0
    # Tubes, not ribbons that face the camera.
    scene.cycles_curves.shape = "THICK"
    set_depth(cycles, settings["max_depth"])
    set_filter(cycles, settings)
    set_output(scene)
    threads = settings.get("threads", 0)
    scene.render.threads_mode = "FIXED" if threads else "AUTO"
    if threads:
        scene.render.threads = threads
    if settings.get("time_limit_secs"):
        cycles.time_limit = settings["time_limit_secs"]


def set_depth(cycles: bpy.types.PropertyGroup, max_depth: int) -> None:
    """Set every kind of bounce to the one total depth.

    Cycles does not count the bounce toward a light: its 0 is direct light, which is our 1. Our 0,
    emission alone, has no counterpart.
    """
    if max_depth < 1:
        raise ValueError("Cycles cannot render with a depth of 0: direct light is always in it")
    bounces = min(max_depth - 1, MAX_BOUNCES)
    cycles.max_bounces = bounces
    cycles.diffuse_bounces = bounces
    cycles.glossy_bounces = bounces
    cycles.transmission_bounces = bounces
    cycles.volume_bounces = bounces
    cycles.transparent_max_bounces = MAX_BOUNCES


def set_filter(cycles: bpy.types.PropertyGroup, settings: dict[str, Any]) -> None:
    """Use the same pixel filter; Cycles draws from it too, so pixels stay uncorrelated."""
    kind = settings["filter"]
    radius = settings.get("filter_radius")
    cycles.pixel_filter_type = FILTERS[kind]
    if kind == "box":
        if radius not in (None, 0.5):
            raise ValueError("the box filter of Cycles has a fixed radius of 0.5 pixels")
    elif kind == "gaussian":
        # Its support is three widths across; the shape is exp(-2 (2 x / radius)^2).
        cycles.filter_width = (radius or 1.5) / 1.5
    else:
        # Its support is two widths across.
        cycles.filter_width = radius or 1.5


def set_output(scene: bpy.types.Scene) -> None:
    """Write linear 32-bit float pixels, the background included."""
    render = scene.render
    render.film_transparent = False
    render.use_compositing = False
    render.use_sequencer = False
    render.use_file_extension = False
    render.use_persistent_data = False
    render.image_settings.file_format = "OPEN_EXR"
    render.image_settings.color_depth = "32"
    render.image_settings.color_mode = "RGBA"
    render.image_settings.exr_codec = "ZIP"
    scene.display_settings.display_device = "sRGB"
    scene.view_settings.view_transform = "Raw"
    scene.view_settings.look = "None"
    scene.view_settings.exposure = 0.0
    scene.view_settings.gamma = 1.0

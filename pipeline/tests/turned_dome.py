"""A dome whose image is so smooth that what it shows, and what it lights, is known for every turn.

Its radiance is linear in the direction, and each channel has an axis of the dome to itself: three
numbers tell the whole direction, so that nothing turned, mirrored or transposed looks right.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scene_writer import SceneWriter, camera, light

CONTRAST = 0.8
WIDTH, HEIGHT = 60, 30


def turned(seed: int) -> np.ndarray:
    """Turn about a random axis by a random angle."""
    axes, _ = np.linalg.qr(np.random.default_rng(seed).standard_normal((3, 3)))
    matrix = np.eye(4)
    matrix[:3, :3] = axes * np.linalg.det(axes)
    return matrix


TURNS = pytest.mark.parametrize(
    "world_from_dome",
    [np.eye(4), turned(1), turned(2), turned(3), turned(4) @ np.diag([-3.0, 3.0, 3.0, 1.0])],
    ids=["as it is", "turned", "turned otherwise", "turned again", "mirrored and scaled"],
)


def add_dome(writer: SceneWriter, world_from_dome: np.ndarray) -> None:
    """Light a scene by the dome alone."""
    texture = writer.texture((0, image()))
    writer.record["lights"] = [light({"type": "dome"}, world_from_dome, texture=texture)]


def image() -> np.ndarray:
    """Draw by USD's rule: the middle is +z, +x lies to the left of it, and the top is +y."""
    azimuth = (0.5 - (np.arange(WIDTH) + 0.5) / WIDTH) * 2.0 * math.pi
    height = ((np.arange(HEIGHT)[:, None] + 0.5) / HEIGHT - 0.5) * math.pi
    x, z = np.cos(height) * np.sin(azimuth), np.cos(height) * np.cos(azimuth)
    y = np.broadcast_to(np.sin(height), x.shape)
    return np.float32(1.0 + CONTRAST * np.stack([x, y, z], axis=2))


def look_at_it(writer: SceneWriter) -> None:
    """Look along -z through a window off the middle."""
    writer.record["camera"] = camera(np.eye(4), screen_window=[-0.5, -0.25, 0.5, 0.75])


def seen(world_from_dome: np.ndarray) -> np.ndarray:
    """Return what that camera sees at the middles of its eight by eight pixels."""
    offsets = (np.arange(8) + 0.5) / 8.0
    x, y = np.meshgrid(offsets - 0.5, 0.75 - offsets)
    directions = np.stack([x, y, np.full_like(x, -1.0)], axis=2)
    directions /= np.linalg.norm(directions, axis=2, keepdims=True)
    return 1.0 + CONTRAST * directions @ axes(world_from_dome)


def mean_over_cosines(world_from_dome: np.ndarray) -> np.ndarray:
    """Return what a white surface that faces +y reflects."""
    # The integral of the direction over a hemisphere, by the cosine, is 2/3 pi along its normal.
    return 1.0 + CONTRAST * 2.0 / 3.0 * axes(world_from_dome)[1]


def axes(world_from_dome: np.ndarray) -> np.ndarray:
    """Return the dome's axes in the world, as columns."""
    return world_from_dome[:3, :3] / np.linalg.norm(world_from_dome[:3, :3], axis=0)

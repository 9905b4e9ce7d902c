"""How LuxCore renders: the ways that it has of finding light."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from unsupported import UnsupportedError

if TYPE_CHECKING:
    from exported import ExportedScene, Raster


def render_properties(
    scene: ExportedScene, raster: Raster, engine: str, samples: int, seed: int, threads: int
) -> dict[str, Any]:
    """Return what an engine renders with, nothing clamped or adaptive, and the film.

    `path`, `hybrid` and `bidir` are unbiased. The first two go to our depth; of the others, each of
    the two subpaths that are joined does, so that few paths are longer.
    """
    settings = scene.settings
    if settings["filter"] != "box" or settings.get("filter_radius") not in (None, 0.5):
        raise UnsupportedError("pixel filters other than a box of one pixel")
    # LuxCore counts the camera's segment too.
    depth = settings["max_depth"] + 1
    return {
        "renderengine.seed": seed + 1,
        "native.threads.count": threads,
        "sampler.type": "SOBOL",
        "sampler.sobol.adaptive.strength": 0.0,
        "path.clamping.variance.maxvalue": 0.0,
        # No roulette: it counts in the weights of samples of lights, but not in those of paths that
        # meet lights by chance, so that together they have more than one.
        "path.russianroulette.cap": 1.0,
        "film.width": raster.width,
        "film.height": raster.height,
        "film.filter.type": "NONE",
        "film.imagepipelines.0.0.type": "NOP",
        "film.outputs.0.type": "RGB",
        "film.outputs.0.filename": "unused.exr",
        **WAYS[engine](samples, depth),
    }


def path(samples: int, depth: int) -> dict[str, Any]:
    """Paths from the camera."""
    return {
        "renderengine.type": "PATHCPU",
        "path.pathdepth.total": depth,
        "path.pathdepth.diffuse": depth,
        "path.pathdepth.glossy": depth,
        "path.pathdepth.specular": depth,
        "path.hybridbackforward.enable": False,
        "batch.haltspp": samples,
    }


def hybrid(samples: int, depth: int) -> dict[str, Any]:
    """Paths from the camera, and as many from lights for caustics that it sees straight."""
    return path(samples, depth) | {
        "path.hybridbackforward.enable": True,
        "path.hybridbackforward.partition": 0.5,
        "batch.haltspp": [samples, samples],
    }


def photongi(samples: int, depth: int) -> dict[str, Any]:
    """Paths that end in caches of photons: caustics, and all other light after a bounce."""
    return path(samples, depth) | {
        "path.photongi.photon.maxdepth": depth,
        "path.photongi.caustic.enabled": True,
        "path.photongi.indirect.enabled": True,
    }


def bidir(samples: int, depth: int) -> dict[str, Any]:
    """Paths from both sides, joined in every way."""
    return {
        "renderengine.type": "BIDIRCPU",
        "path.maxdepth": depth,
        "light.maxdepth": depth,
        "batch.haltspp": samples,
    }


def bidirvm(samples: int, depth: int) -> dict[str, Any]:
    """Paths from both sides, joined, and merged where they come near each other."""
    return bidir(samples, depth) | {
        "renderengine.type": "BIDIRVMCPU",
        # Each of its thousands of samplers takes that many pixels, one after the other: with more,
        # small images stay black in between.
        "sampler.sobol.bucketsize": 1,
    }


WAYS: dict[str, Callable[[int, int], dict[str, Any]]] = {
    "path": path,
    "hybrid": hybrid,
    "photongi": photongi,
    "bidir": bidir,
    "bidirvm": bidirvm,
}
"""By the name of the engine, from samples per pixel and depth."""

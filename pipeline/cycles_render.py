"""Renders an exported scene with Cycles: `cycles_render.py FOLDER OUT.exr`.

With `--batches N` the scene is built once and rendered with N seeds, one after the other, to
OUT.0.exr, OUT.1.exr and so on.

Runs in a Python that has `bpy`; `kilauea reference` sets one up and calls this.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
import time
from pathlib import Path
from typing import Any

import bpy

from blender_scene.camera import build_camera
from blender_scene.light import build_lights
from blender_scene.material import Materials
from blender_scene.motion import open_shutter
from blender_scene.placement import Placement
from blender_scene.settings import apply_settings
from blender_scene.world import build_world
from exported import ExportedScene, Raster
from peak_memory import peak_rss


def parse_arguments() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="what Scene.export wrote")
    parser.add_argument("out", type=Path, help="EXR to write, linear float RGBA")
    parser.add_argument("--samples", type=int, help="per pixel, instead of the scene's own")
    parser.add_argument("--seed", type=int, help="instead of the scene's own")
    parser.add_argument("--batches", type=int, metavar="N", help="renders, each with the next seed")
    parser.add_argument("--guiding", action="store_true", help="path guiding on")
    parser.add_argument("--stats", type=Path, help="JSON to write")
    return parser.parse_args()


def build_scene(scene: ExportedScene, raster: Raster) -> list[str]:
    """Fill the empty Blender scene; returns what could not be matched."""
    warnings: list[str] = []
    open_shutter(scene)
    build_camera(scene, raster)
    build_world(scene)
    build_lights(scene, warnings)
    Placement(scene, Materials(scene, warnings), warnings).build()
    return warnings


def render(out: Path) -> dict[str, Any]:
    """Render the active scene; returns the times (s) that Cycles took."""
    bpy.context.scene.render.filepath = str(out.resolve())
    start = time.perf_counter()
    bpy.ops.render.render(write_still=True)
    total = time.perf_counter() - start
    render_s = header_seconds(out, "render_time")
    return {"sync_s": max(total - render_s, 0.0), "render_s": render_s}


def render_all(out: Path, seed: int, batches: int | None) -> dict[str, Any]:
    """Render once, or as often as there are batches; returns the sums of the times (s)."""
    if batches is None:
        return render(out)
    sums = {"sync_s": 0.0, "render_s": 0.0}
    for idx in range(batches):
        bpy.context.scene.cycles.seed = seed + idx
        for name, seconds in render(out.with_suffix(f".{idx}.exr")).items():
            sums[name] += seconds
    return sums


def header_seconds(exr: Path, name: str) -> float:
    """Read a time that Cycles left in the EXR header, as hours:minutes:seconds."""
    with exr.open("rb") as file:
        header = file.read(1 << 16)
    pattern = rb"cycles\.[^\0]+\." + name.encode() + rb"\0string\0....([0-9:.]+)"
    found = re.search(pattern, header, re.DOTALL)
    if found is None:
        raise RuntimeError(f"{exr}: Cycles left no {name}")
    seconds = 0.0
    for part in found[1].decode().split(":"):
        seconds = 60.0 * seconds + float(part)
    return seconds


def main() -> int:
    """Run the command."""
    args = parse_arguments()
    start = time.perf_counter()
    scene = ExportedScene.open(args.folder)
    samples = args.samples or scene.settings["samples_per_pixel"]
    seed = scene.settings["seed"] if args.seed is None else args.seed
    bpy.ops.wm.read_factory_settings(use_empty=True)
    raster = Raster.of(scene)
    apply_settings(scene.settings, samples=samples, seed=seed, guiding=args.guiding)
    warnings = build_scene(scene, raster)
    build_s = time.perf_counter() - start
    times = render_all(args.out, seed, args.batches)
    for warning in warnings:
        print(f"cycles: {warning}", file=sys.stderr)
    if args.stats:
        stats = {
            "engine": f"Cycles {bpy.app.version_string}",
            "samples_per_pixel": samples,
            "seed": seed,
            "width": raster.width,
            "height": raster.height,
            "build_s": build_s,
            **times,
            "peak_rss": peak_rss(),
            "warnings": warnings,
        }
        args.stats.write_text(json.dumps(stats, indent=1), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""Imports a stage with Blender's own USD importer and lets Cycles take it over.

Only for the time and memory that this takes; its pictures are no reference, because the importer
guesses at lights and materials.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from pathlib import Path

import bpy

from peak_memory import peak_rss


def parse_arguments() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("stage", type=Path)
    parser.add_argument("--res", nargs=2, type=int, default=(16, 16), metavar=("W", "H"))
    parser.add_argument("--stats", type=Path, required=True, help="JSON to write")
    return parser.parse_args()


def main() -> int:
    """Run the command."""
    args = parse_arguments()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    start = time.perf_counter()
    if "FINISHED" not in bpy.ops.wm.usd_import(filepath=str(args.stage.resolve())):
        print(f"{args.stage}: not imported", file=sys.stderr)
        return 1
    load_s = time.perf_counter() - start

    scene = bpy.context.scene
    if scene.camera is None:
        scene.camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
        scene.collection.objects.link(scene.camera)
    scene.render.engine = "CYCLES"
    scene.cycles.samples = 1
    scene.render.resolution_x, scene.render.resolution_y = args.res
    with tempfile.TemporaryDirectory() as folder:
        scene.render.filepath = str(Path(folder) / "image.png")
        start = time.perf_counter()
        bpy.ops.render.render(write_still=True)
        build_s = time.perf_counter() - start
    stats = {
        "load_s": load_s,
        "build_s": build_s,
        "peak_rss": peak_rss(),
    }
    args.stats.write_text(json.dumps(stats), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())

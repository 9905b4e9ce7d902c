"""Renders an exported scene with Mitsuba: `mitsuba_render.py FOLDER OUT.exr`.

Covers what comparisons of speed and of diffuse transport need; what it does not cover ends it with
exit code 3 and a list, so that no comparison is made with another scene.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from pathlib import Path

# Dr.Jit needs LLVM 16 or newer and takes the system's; one in this environment goes before.
for library in sorted(Path(sys.prefix).glob("lib/libLLVM*.so*"))[:1]:
    os.environ.setdefault("DRJIT_LIBLLVM_PATH", str(library))

import drjit as dr  # noqa: E402
import mitsuba as mi  # noqa: E402

from exported import ExportedScene, Raster  # noqa: E402
from render_command import render_parser, write_stats  # noqa: E402

mi.set_variant("llvm_ad_rgb")

from mitsuba_scene.build import build_scene  # noqa: E402
from unsupported import UnsupportedError  # noqa: E402

SAMPLES_PER_LAUNCH = 1 << 25
"""Bounds the memory of one kernel launch."""


def parse_arguments() -> argparse.Namespace:
    """Read the command line."""
    parser = render_parser(__doc__)
    parser.add_argument(
        "--sampler", default="independent", choices=("independent", "multijitter", "ldsampler")
    )
    return parser.parse_args()


def render(scene: mi.Scene, raster: Raster, samples: int, seed: int) -> mi.TensorXf:
    """Average as many launches as memory asks for."""
    per_launch = max(1, min(samples, SAMPLES_PER_LAUNCH // (raster.width * raster.height)))
    total, done = None, 0
    while done < samples:
        n = min(per_launch, samples - done)
        image = n * mi.render(scene, spp=n, seed=seed * 65_537 + done)
        dr.eval(image)
        total = image if total is None else total + image
        done += n
    total = total / samples
    dr.eval(total)
    dr.sync_thread()
    return total


def main() -> int:
    """Run the command."""
    args = parse_arguments()
    start = time.perf_counter()
    exported = ExportedScene.open(args.folder)
    raster = Raster.of(exported)
    samples = args.samples or exported.settings["samples_per_pixel"]
    seed = exported.settings["seed"] if args.seed is None else args.seed
    if threads := exported.settings.get("threads", 0):
        dr.set_thread_count(threads)
    try:
        scene = build_scene(exported, raster, args.sampler)
    except UnsupportedError as error:
        print(f"mitsuba: unsupported: {error}", file=sys.stderr)
        return 3
    build_s = time.perf_counter() - start

    # A launch of its own compiles the kernel, so that the next one is rendering alone.
    start = time.perf_counter()
    render(scene, raster, 1, seed + 1)
    compile_s = time.perf_counter() - start
    start = time.perf_counter()
    image = render(scene, raster, samples, seed)
    render_s = time.perf_counter() - start

    mi.Bitmap(image).write(str(args.out))
    if args.stats:
        seconds = {"build_s": build_s, "compile_s": compile_s, "render_s": render_s}
        engine = f"Mitsuba {mi.__version__} {mi.variant()}"
        write_stats(args.stats, engine, raster, samples, seed, seconds)
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""Renders an exported scene with LuxCore: `luxcore_render.py FOLDER OUT.exr`.

Covers diffuse transport, mirrors and glass; what it does not cover ends it with exit code 3 and
the reason, so that no comparison is made with another scene.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import sys
import time

from exported import ExportedScene, Raster
from render_command import render_parser, write_stats

# After NumPy: LuxCore replaces the allocator, and NumPy would free what it did not allocate.
with contextlib.redirect_stdout(sys.stderr):
    import pyluxcore

from luxcore_scene.build import as_properties, build_scene
from luxcore_scene.engine import WAYS, render_properties
from unsupported import UnsupportedError

POLL_S = 0.01


def parse_arguments() -> argparse.Namespace:
    """Read the command line."""
    parser = render_parser(__doc__)
    parser.add_argument("--engine", default="path", choices=tuple(WAYS))
    return parser.parse_args()


def render(session: pyluxcore.RenderSession, pixels: int) -> float:
    """Render until the session's samples are done; returns those per pixel from the camera."""
    while not session.HasDone():
        time.sleep(POLL_S)
        session.UpdateStats()
    session.UpdateStats()

    def total(name: str) -> float:
        return session.GetStats().Get(f"stats.renderengine.total.{name}").GetFloat()

    # What is counted has those from lights in it.
    return total("samplecount") * total("samplesec.eye") / total("samplesec") / pixels


def main() -> int:
    """Run the command."""
    args = parse_arguments()
    start = time.perf_counter()
    exported = ExportedScene.open(args.folder)
    raster = Raster.of(exported)
    samples = args.samples or exported.settings["samples_per_pixel"]
    seed = exported.settings["seed"] if args.seed is None else args.seed
    threads = exported.settings.get("threads", 0) or len(os.sched_getaffinity(0))
    pyluxcore.Init()
    pyluxcore.SetLogHandler(lambda _: None)
    try:
        settings = render_properties(exported, raster, args.engine, samples, seed, threads)
        scene = build_scene(exported, raster)
    except UnsupportedError as error:
        print(f"luxcore: unsupported: {error}", file=sys.stderr)
        return 3
    build_s = time.perf_counter() - start

    start = time.perf_counter()
    session = pyluxcore.RenderSession(pyluxcore.RenderConfig(as_properties(settings), scene))
    session.Start()
    compile_s = time.perf_counter() - start
    start = time.perf_counter()
    taken = render(session, raster.width * raster.height)
    render_s = time.perf_counter() - start
    session.Stop()

    session.GetFilm().SaveOutput(
        str(args.out), pyluxcore.FilmOutputType.RGB, pyluxcore.Properties()
    )
    if args.stats:
        seconds = {"build_s": build_s, "compile_s": compile_s, "render_s": render_s}
        engine = f"LuxCore {pyluxcore.Version()} {args.engine}"
        write_stats(args.stats, engine, raster, taken, seed, seconds)
    return 0


if __name__ == "__main__":
    code = main()
    sys.stdout.flush()
    sys.stderr.flush()
    # Its threads outlive the interpreter's end, which may crash.
    os._exit(code)

"""`kilauea reference`: the same flattened frame through Blender's Cycles."""

from __future__ import annotations

import argparse
import dataclasses
import json
import tempfile
import time
from pathlib import Path
from typing import Any

import OpenImageIO as oiio

from kilauea import interrupt, request
from kilauea.arguments import subdivision_level
from kilauea.child import run_apart
from kilauea.clock import process_age
from kilauea.environments import CYCLES, pipeline_script
from kilauea.errors import KilaueaError, UsageError
from kilauea.output import write_text
from kilauea.payload import Frame
from kilauea.render import DEFAULTS, RenderOptions, build_scene, native, settings_record


def main(args: argparse.Namespace) -> int:
    """Run the command and return its exit code."""
    engine_settings = request.engine_settings(args)
    max_level = subdivision_level(args.complexity)
    verbosity, _ = request.verbosity(args.verbose)
    started = time.monotonic()
    stage = request.open_stage(args)
    frames = request.frames(args, stage.start_time)
    outputs, stats_files = request.output_files(args, stage, frames)
    refuse_other_formats(outputs)
    for frame_time, files, stats_file in zip(frames, outputs, stats_files, strict=True):
        options = dataclasses.replace(request.flatten_options(args), time=frame_time)
        frame = interrupt.run(lambda options=options: stage.flatten(options))
        load_secs = time.monotonic() - started
        request.report(frame, args.strict, verbosity)
        render_options = RenderOptions(files, engine_settings, max_level, args.timelimit)
        stats = render_frame(frame, render_options)
        stats["times"] |= {"load": load_secs, "total": process_age()}
        request.print_warnings(stats["warnings"], verbosity)
        if stats_file:
            write_text(Path(stats_file), json.dumps(stats, indent=2) + "\n")
        if verbosity >= 1:
            times = stats["times"]
            print(f"{', '.join(files)}  {stats['engine']}  {times['render']:.1f} s", flush=True)
        started = time.monotonic()
    return 0


def refuse_other_formats(outputs: list[list[str]]) -> None:
    """Raise where anything but EXR is asked for."""
    for name in (name for files in outputs for name in files):
        if Path(name).suffix.lower() != ".exr":
            raise UsageError(f"{name}: reference renders are written as .exr")


def render_frame(frame: Frame, options: RenderOptions) -> dict[str, Any]:
    """Render a frame with Cycles, write its files and return its statistics.

    Raises
    ------
    KilaueaError
        The engine refuses the scene, or Cycles cannot be run.
    """
    with tempfile.TemporaryDirectory(prefix="kilauea-") as name:
        folder = Path(name)
        settings = export_frame(frame, options, folder)
        stats = run_cycles(folder, folder / "cycles.exr")
        write_outputs(folder / "cycles.exr", settings, frame, stats, options.outputs)
    return {
        "engine": stats["engine"],
        "samples_per_pixel": stats["samples_per_pixel"],
        "times": {"build": stats["build_s"] + stats["sync_s"], "render": stats["render_s"]},
        "memory": {"peak_rss": stats["peak_rss"]},
        "stage": frame.stage,
        "frame": frame.time,
        "outputs": options.outputs,
        "warnings": stats["warnings"],
    }


def export_frame(frame: Frame, options: RenderOptions, folder: Path) -> dict[str, Any]:
    """Assemble a frame as for rendering and write it down; returns the settings used."""
    engine = native()
    settings = settings_record(frame, options)
    scene = build_scene(frame, options)
    try:
        interrupt.run(lambda: scene.export(str(folder), json.dumps({**DEFAULTS, **settings})))
    except (engine.SceneError, engine.RenderError) as error:
        raise KilaueaError(str(error)) from None
    return settings


def run_cycles(folder: Path, out: Path, *flags: str) -> dict[str, Any]:
    """Render an exported scene; returns the statistics of `cycles_render.py`."""
    stats = out.with_suffix(".json")
    run_apart(cycles_command(folder, out, stats, *flags), "render with Cycles")
    return json.loads(stats.read_text())


def cycles_command(folder: Path, out: Path, stats: Path, *flags: str) -> list[str]:
    """Return the command that renders an exported scene with Cycles."""
    script = pipeline_script("cycles_render.py")
    words = [CYCLES.python(), script, folder, out, "--stats", stats]
    return [*(str(word) for word in words), *flags]


def write_outputs(
    rendered: Path,
    settings: dict[str, Any],
    frame: Frame,
    stats: dict[str, Any],
    outputs: list[str],
) -> None:
    """Write the image with the display and data window that `kilauea render` gives it."""
    image = oiio.ImageBuf(str(rendered))
    if image.has_error:
        raise KilaueaError(f"{rendered}: {image.geterror()}")
    spec = image.specmod()
    width, height = settings["resolution"]
    window = settings.get("data_window")
    spec.x, spec.y = window["min"] if window else (0, 0)
    spec.full_x, spec.full_y, spec.full_width, spec.full_height = 0, 0, width, height
    spec.attribute("PixelAspectRatio", float(settings["pixel_aspect_ratio"]))
    spec.attribute("compression", "zip")
    spec.attribute("kilauea/stage", frame.stage)
    spec.attribute("kilauea/engine", stats["engine"])
    for output in outputs:
        if not image.write(output):
            raise KilaueaError(f"{output}: {image.geterror()}")

"""One frame through the engine: build, render, write, report."""

from __future__ import annotations

import importlib
import json
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from kilauea import interrupt, worker
from kilauea.clock import process_age
from kilauea.errors import KilaueaError
from kilauea.output import write_text
from kilauea.payload import Frame
from kilauea.progress import Progress, duration

if TYPE_CHECKING:
    from kilauea.ray_workers import RayWorkers

DEFAULTS: dict[str, Any] = {
    "resolution": [640, 360],
    "pixel_aspect_ratio": 1.0,
    "data_window": None,
    "samples_per_pixel": 64,
    "noise": None,
    "max_depth": 16,
    "integrator": "kilauea",
    "gi": "exact",
    "seed": 0,
    "filter": "blackman-harris",
    "filter_radius": None,
    "threads": 0,
    "time_limit_secs": None,
    "aovs": [],
    "texture_memory_bytes": 1 << 30,
    "shading": "inline",
    "shade_memory_bytes": 64 << 20,
    "specialize": True,
    "general": [],
}
"""As in `kilauea_scene::RenderSettings`."""

MAX_CHUNK_TRIANGLES = 65536
JOURNAL_SUFFIX = ".journal"
_POLL_SECS = 0.1
_SHORTEST_LIMIT_SECS = 0.001
_WRITE_SECS_PER_PIXEL = 1.5e-6
"""What an EXR with all layers takes on one idle core."""


@dataclass(slots=True)
class RenderOptions:
    """How a frame is rendered and where it goes."""

    outputs: list[str]
    settings: dict[str, Any] = field(default_factory=dict)
    """Fields of `kilauea_scene::RenderSettings` that stand over those of the stage."""
    max_subdivision_level: int = 4
    time_limit: float | None = None
    """Seconds since the command began."""
    begun: float = 0.0
    """When that was, as the age of the process in seconds."""
    frames_per_second: float = 24.0
    stats_file: str | None = None
    load_secs: float = 0.0
    """What opening and flattening the stage took."""
    verbosity: int = 2
    alfred: bool = False
    """Print `ALF_PROGRESS` lines."""
    workers: int | None = None
    """Render in so many processes, of which each has `settings.threads`."""
    links: str | None = None
    """`tls` between them, or `channels` of bytes where they are threads; TCP by default."""
    cluster: RayWorkers | None = None
    """Render on these machines instead."""
    crew: Any = None
    """A `kilauea._native.Crew` of workers that stay between frames."""
    metrics: Any = None
    """A `kilauea._native.MetricsServer` that shows the frame."""
    set: dict[str, Any] | None = None
    """How the scene is spread over sets of workers; none where each has all of it."""
    resume: bool = False
    """Go on from what workers had rendered when the same command was killed."""
    estimates: str | None = None
    """A file with what the pilot of the same frame told, which then has none."""
    save_estimates: str | None = None
    """A file for what its pilot tells."""

    @property
    def has_workers(self) -> bool:
        """Whether other processes render."""
        return self.workers is not None or self.cluster is not None


def native() -> Any:
    """Import the engine."""
    try:
        return importlib.import_module("kilauea._native")
    except ImportError as error:
        raise KilaueaError(f"the engine is not installed: {error}") from None


def settings_record(frame: Frame, options: RenderOptions) -> dict[str, Any]:
    """Merge defaults, the stage's settings and the command line's, later ones winning."""
    record = {**DEFAULTS, **frame.settings, **options.settings}
    if options.time_limit is not None:
        left = options.time_limit + options.begun - process_age()
        width, height = record["resolution"]
        writing = width * height * len(options.outputs) * _WRITE_SECS_PER_PIXEL
        record["time_limit_secs"] = max(left - writing, left / 4, _SHORTEST_LIMIT_SECS)
    return record


def build_scene(frame: Frame, options: RenderOptions) -> Any:
    """Assemble a frame and build what it takes to trace it.

    Raises
    ------
    KilaueaError
        The engine refuses the scene.
    """
    engine = native()
    try:
        # Workers build what they trace.
        make = engine.assemble_scene if options.has_workers else engine.build_scene
        return interrupt.run(lambda: make(frame, build_options(frame, options)))
    except (engine.SceneError, engine.RenderError) as error:
        raise KilaueaError(str(error)) from None


def build_options(frame: Frame, options: RenderOptions) -> str:
    """Return what a built scene depends on besides the frame, as the engine takes it."""
    settings = DEFAULTS | frame.settings | options.settings
    return json.dumps(
        {
            "resolution": settings["resolution"],
            "texture_memory_bytes": settings["texture_memory_bytes"],
            "max_subdivision_level": options.max_subdivision_level,
            "max_chunk_triangles": MAX_CHUNK_TRIANGLES,
        }
    )


def render_frame(
    frame: Frame,
    options: RenderOptions,
    scene_of: Callable[[Frame, RenderOptions], Any] = build_scene,
) -> dict[str, Any]:
    """Render a frame, write its files and return its statistics.

    `scene_of` builds the scene, or has it.

    Raises
    ------
    KilaueaError
        The engine refuses the scene, or the files cannot be written.
    """
    engine = native()
    try:
        scene = scene_of(frame, options)
        warnings = [*frame.warnings, *frame.notes, *scene.warnings()]
        metadata = {
            "stage": frame.stage,
            "frame": frame.time,
            "frames_per_second": options.frames_per_second,
            "camera": frame.camera["path"],
            "warnings": warnings + [f"missing: {m}" for m in frame.missing],
        }
        settings = json.dumps(settings_record(frame, options))
        job = scene.render(settings, json.dumps(metadata), *_sharing(options), **_told(options))
        if options.metrics is not None:
            options.metrics.watch(job)
        wait(job, Progress(options.verbosity >= 2, options.alfred), options.cluster)
        if options.save_estimates is not None:
            scene.save_estimates(job, settings, options.save_estimates)
        stats = interrupt.run(lambda: json.loads(job.finish(options.outputs)), interrupt.GRACE_SECS)
    except (engine.SceneError, engine.RenderError) as error:
        raise KilaueaError(str(error)) from None
    _complete(stats, frame, warnings, options)
    if options.stats_file:
        write_text(Path(options.stats_file), json.dumps(stats, indent=2) + "\n")
    return stats


def new_crew() -> Any:
    """Return what keeps workers between frames; they end with it."""
    return native().Crew()


def serve_metrics(address: str) -> Any:
    """Serve figures of frames that workers render at an address, until what this returns is gone.

    Raises
    ------
    KilaueaError
        Nobody can listen there.
    """
    engine = native()
    try:
        return engine.MetricsServer(address)
    except engine.RenderError as error:
        raise KilaueaError(str(error)) from None


def _journal(options: RenderOptions) -> str | None:
    """Return where results are kept until the image is written, for whoever is killed to go on.

    What is there from before is removed, unless it is to be gone on from. A frame that may be over
    before it is whole has no journal unless it is asked for, as it would leave it behind.
    """
    if not options.outputs or (options.time_limit is not None and not options.resume):
        return None
    journal = Path(options.outputs[0] + JOURNAL_SUFFIX)
    if not options.resume:
        try:
            journal.unlink(missing_ok=True)
        except OSError as error:
            raise KilaueaError(f"{journal}: {error.strerror}") from None
    return str(journal)


def _sharing(options: RenderOptions) -> list[Any]:
    """Return how the work is shared out, where other processes do it."""
    if not options.has_workers:
        return []
    sharing: dict[str, Any] = {"journal": _journal(options), "set": options.set}
    if options.cluster is None:
        sharing |= {"n_workers": options.workers, "tls": options.links == "tls"}
        sharing |= {"threads": None} if options.links == "channels" else {"command": worker.COMMAND}
    else:
        sharing |= {"n_workers": options.cluster.n_workers, "host": options.cluster.console_host}
    return [json.dumps(sharing), options.crew]


def _told(options: RenderOptions) -> dict[str, Any]:
    """Return where it is told what paths may know beforehand, if it is."""
    return {} if options.estimates is None else {"estimates": options.estimates}


def summary(stats: dict[str, Any], outputs: list[str]) -> str:
    """Describe a finished frame in one line."""
    times = stats.get("times", {})
    rays = stats.get("rays", {})
    parts = [", ".join(outputs) or "no file"]
    samples = stats.get("samples_per_pixel")
    if samples is not None:
        parts.append(f"{samples:g} samples")
    parts.append(duration(times["total"]) if times["total"] >= 60 else f"{times['total']:.1f} s")
    render_secs = times.get("render")
    if render_secs and rays:
        parts.append(f"{sum(rays.values()) / render_secs / 1e6:.2f} Mrays/s")
    return "  ".join(parts)


def wait(job: Any, progress: Progress, cluster: RayWorkers | None = None) -> None:
    """Show how far a render is until it has stopped; an interrupt cancels it."""
    try:
        while not job.wait(_POLL_SECS):
            if cluster is not None:
                cluster.serve(job)
            fraction, seconds_left = job.progress()
            progress.update(fraction, seconds_left, job.laggards())
    except KeyboardInterrupt:
        progress.close()
        interrupt.cancel(job)
    progress.close()


def _complete(
    stats: dict[str, Any], frame: Frame, warnings: list[str], options: RenderOptions
) -> None:
    """Add what only this side knows."""
    times = stats.setdefault("times", {})
    times["load"] = options.load_secs
    times["total"] = process_age() - options.begun
    stats["stage"] = frame.stage
    stats["frame"] = frame.time
    stats["outputs"] = options.outputs
    stats["warnings"] = list(dict.fromkeys((*warnings, *stats.get("warnings", ()))))
    stats["missing"] = frame.missing
    # One process, which traced no photons.
    stats.setdefault("photons", {"emitted": 0, "stored": 0})
    stats.setdefault("workers", [])
    stats.setdefault(
        "network", {"bytes_sent": 0, "bytes_received": 0, "messages": 0, "stale_messages": 0}
    )
    stats["date"] = time.strftime("%Y-%m-%dT%H:%M:%S%z")

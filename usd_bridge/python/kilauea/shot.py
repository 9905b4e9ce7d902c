"""The frames that a render command asks for, from an open stage to files."""

from __future__ import annotations

import argparse
import dataclasses
import sys
from typing import TYPE_CHECKING, Any

from kilauea import framespec, interrupt, request
from kilauea.arguments import subdivision_level
from kilauea.clock import process_age
from kilauea.errors import TimeLimitError, UsageError
from kilauea.payload import Frame
from kilauea.render import RenderOptions, build_options, build_scene, render_frame, summary

if TYPE_CHECKING:
    from kilauea.ray_workers import RayWorkers


class Made:
    """The last frame and what the engine built of it, for whoever wants the same again."""

    def __init__(self) -> None:
        self._frame: Frame | None = None
        self._frame_options: Any = None
        self._scene: Any = None
        self._scene_options: Any = None

    def forget(self) -> None:
        """Let go of both."""
        self._frame = self._scene = None

    def frame(self, stage: Any, options: Any) -> Frame:
        """Flatten a stage, if that was not the last thing flattened."""
        frame = self._frame
        if frame is None or options != self._frame_options:
            # Two scenes at a time may be more than there is memory for.
            self.forget()
            frame = interrupt.run(lambda: stage.flatten(options))
            self._frame, self._frame_options = frame, options
        return frame

    def scene(self, frame: Frame, options: RenderOptions) -> Any:
        """Build what it takes to trace the last frame, if it was not built that way."""
        wanted = (build_options(frame, options), options.has_workers)
        if self._scene is None or wanted != self._scene_options:
            self._scene = None
            self._scene = build_scene(frame, options)
            self._scene_options = wanted
        return self._scene


def render(
    args: argparse.Namespace, stage: Any, made: Made | None = None, begun: float = 0.0
) -> int:
    """Render the frames of a stage that the flags ask for.

    Parameters
    ----------
    args
        As `kilauea.arguments.add_render_options` parses them.
    stage
        The open stage.
    made
        What is there of earlier frames; what this leaves.
    begun
        When the command began, as the age of the process in seconds.

    Returns
    -------
    The exit code: 0, or that of a time limit before one full pass.
    """
    made = made or Made()
    cluster = _ray_workers(args)
    try:
        return _render(args, stage, made, begun, cluster)
    finally:
        if cluster is not None:
            cluster.close()


def _ray_workers(args: argparse.Namespace) -> RayWorkers | None:
    if args.workers is None and args.cluster is None and args.resume:
        raise UsageError("--resume goes on from what workers left: it needs --workers or --cluster")
    if args.workers is not None and args.cluster is not None:
        raise UsageError("--workers are of this machine, and --cluster has one on each: not both")
    has_workers = args.workers is not None or args.cluster is not None
    if _set(args) is not None and not has_workers:
        raise UsageError("a set is of workers: it needs --workers or --cluster")
    if args.cluster is None:
        return None
    from kilauea.ray_workers import RayWorkers

    return RayWorkers(args.cluster)


def _set(args: argparse.Namespace) -> dict[str, Any] | None:
    """Return how the scene is spread over sets of workers, if it is."""
    if args.set_size is not None and args.worker_memory is not None:
        raise UsageError("--set-size says how large sets are, or --worker-memory does: not both")
    if args.set_size is None and args.worker_memory is None:
        if args.broadcast is not None:
            raise UsageError("--broadcast is for sets: it needs --set-size or --worker-memory")
        return None
    size = (
        {"workers": args.set_size} if args.set_size is not None else {"memory": args.worker_memory}
    )
    # Machines are farther apart than processes of one: there, packing is faster than sending.
    packing = "plain" if args.cluster is None else "lz4"
    return {"size": size, "broadcast": args.broadcast or "culled", "packing": packing}


def _render(
    args: argparse.Namespace, stage: Any, made: Made, begun: float, cluster: RayWorkers | None
) -> int:
    settings = request.engine_settings(args)
    max_level = subdivision_level(args.complexity)
    verbosity, letters = request.verbosity(args.verbose)
    frames = request.frames(args, stage.start_time)
    outputs, stats_files = request.output_files(args, stage, frames)
    code = 0
    loaded_from = begun
    for frame_time, files, stats_file in zip(frames, outputs, stats_files, strict=True):
        frame = made.frame(
            stage, dataclasses.replace(request.flatten_options(args), time=frame_time)
        )
        load_secs = process_age() - loaded_from
        request.report(frame, args.strict, verbosity)
        if args.timelimit is not None and frame_time != frames[0]:
            _refuse_late_start(args.timelimit + begun, frame_time)
        options = RenderOptions(
            outputs=files,
            settings=settings,
            max_subdivision_level=max_level,
            time_limit=args.timelimit,
            begun=begun,
            frames_per_second=args.fps or stage.frames_per_second,
            stats_file=stats_file,
            load_secs=load_secs,
            verbosity=verbosity,
            alfred="a" in letters,
            workers=args.workers,
            cluster=cluster,
            set=_set(args),
            resume=args.resume,
        )
        stats = render_frame(frame, options, made.scene)
        said = {*frame.warnings, *frame.notes}
        request.print_warnings([w for w in stats["warnings"] if w not in said], verbosity)
        if verbosity >= 1:
            print(summary(stats, files), flush=True)
        if args.timelimit is not None and not stats.get("full_passes", 1):
            line = "the time limit came before one full pass; wrote what there was"
            print(f"kilauea: error: {line}", file=sys.stderr)
            code = TimeLimitError.exit_code
        loaded_from = process_age()
    return code


def _refuse_late_start(time_limit: float, frame: float) -> None:
    if process_age() >= time_limit:
        raise TimeLimitError(f"the time limit came before frame {framespec.format_frame(frame)}")

"""The frames that a render command asks for, from an open stage to files."""

from __future__ import annotations

import argparse
import dataclasses
import sys
from contextlib import ExitStack, closing
from typing import TYPE_CHECKING, Any

from kilauea import framespec, interrupt, request
from kilauea.arguments import subdivision_level
from kilauea.clock import process_age
from kilauea.errors import TimeLimitError, UsageError
from kilauea.payload import Frame
from kilauea.render import (
    RenderOptions,
    build_options,
    build_scene,
    new_crew,
    render_frame,
    serve_metrics,
    summary,
)

if TYPE_CHECKING:
    from kilauea.ray_workers import RayWorkers


class Made:
    """The last frame and what the engine built of it, for whoever wants the same again."""

    def __init__(self) -> None:
        self._frame: Frame | None = None
        self._frame_options: Any = None
        self._scene: Any = None
        self._scene_options: Any = None
        self._metrics: tuple[str, Any] | None = None
        self._crew: Any = None

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

    def crew(self) -> Any:
        """Return the workers that stay for the frames to come."""
        if self._crew is None:
            self._crew = new_crew()
        return self._crew

    def metrics(self, address: str | None) -> Any:
        """Return what serves figures at an address, which stays for the frames to come."""
        if address is None:
            return None
        if self._metrics is None or self._metrics[0] != address:
            # The address may be the same by another name.
            self._metrics = None
            server = serve_metrics(address)
            self._metrics = (address, server)
            print(f"kilauea: figures at http://{server.address}/metrics", file=sys.stderr)
        return self._metrics[1]


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
    _check_workers(args)
    _check_estimates(args)
    files = _Files.of(args, stage)
    is_last = made is None and len(files.frames) == 1
    made = made or Made()
    # After the last frame nobody needs them.
    crew = None if args.workers is None or is_last else made.crew()
    with ExitStack() as until_done:
        cluster = None
        if args.cluster is not None:
            from kilauea.ray_workers import RayWorkers

            cluster = until_done.enter_context(closing(RayWorkers(args.cluster)))
        return _render(args, stage, made, begun, files, crew, cluster)


@dataclasses.dataclass(frozen=True, slots=True)
class _Files:
    """Frames, and what each is written to."""

    frames: list[float]
    outputs: list[list[str]]
    stats: list[str | None]

    @classmethod
    def of(cls, args: argparse.Namespace, stage: Any) -> _Files:
        """Return those that flags ask for, once it is known that they can be written."""
        frames = request.frames(args, stage.start_time)
        if len(frames) > 1 and (args.estimates is not None or args.save_estimates is not None):
            raise UsageError("--estimates and --save-estimates are of one frame")
        return cls(frames, *request.output_files(args, stage, frames))


def _check_workers(args: argparse.Namespace) -> None:
    """Refuse flags about workers that do not go together."""
    if args.workers is None and args.cluster is None and args.resume:
        raise UsageError("--resume goes on from what workers left: it needs --workers or --cluster")
    if args.workers is not None and args.cluster is not None:
        raise UsageError("--workers are of this machine, and --cluster has one on each: not both")
    if args.links is not None and args.workers is None:
        raise UsageError("--links are between workers of this machine: it needs --workers")
    has_workers = args.workers is not None or args.cluster is not None
    if args.metrics is not None and not has_workers:
        raise UsageError("--metrics shows what workers do: it needs --workers or --cluster")
    if _set(args) is not None and not has_workers:
        raise UsageError("a set is of workers: it needs --workers or --cluster")


def _check_estimates(args: argparse.Namespace) -> None:
    """Refuse files of estimates where there is not one frame that they are of."""
    if args.estimates is None and args.save_estimates is None:
        return
    if args.workers is not None or args.cluster is not None:
        raise UsageError("--estimates and --save-estimates: workers keep what they learn")
    if args.integrator == "path":
        raise UsageError("--estimates and --save-estimates are of the integrator kilauea")


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
    args: argparse.Namespace,
    stage: Any,
    made: Made,
    begun: float,
    files: _Files,
    crew: Any,
    cluster: RayWorkers | None,
) -> int:
    settings = request.engine_settings(args)
    max_level = subdivision_level(args.complexity)
    verbosity, letters = request.verbosity(args.verbose)
    metrics = made.metrics(args.metrics)
    code = 0
    loaded_from = begun
    for frame_time, outputs, stats_file in zip(
        files.frames, files.outputs, files.stats, strict=True
    ):
        frame = made.frame(
            stage, dataclasses.replace(request.flatten_options(args), time=frame_time)
        )
        load_secs = process_age() - loaded_from
        request.report(frame, args.strict, verbosity)
        if args.timelimit is not None and frame_time != files.frames[0]:
            _refuse_late_start(args.timelimit + begun, frame_time)
        options = RenderOptions(
            outputs=outputs,
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
            links=args.links,
            cluster=cluster,
            crew=crew,
            metrics=metrics,
            set=_set(args),
            resume=args.resume,
            estimates=args.estimates,
            save_estimates=args.save_estimates,
        )
        stats = render_frame(frame, options, made.scene)
        said = {*frame.warnings, *frame.notes}
        request.print_warnings([w for w in stats["warnings"] if w not in said], verbosity)
        if verbosity >= 1:
            print(summary(stats, outputs), flush=True)
        if args.timelimit is not None and not stats.get("full_passes", 1):
            line = "the time limit came before one full pass; wrote what there was"
            print(f"kilauea: error: {line}", file=sys.stderr)
            code = TimeLimitError.exit_code
        loaded_from = process_age()
    return code


def _refuse_late_start(time_limit: float, frame: float) -> None:
    if process_age() >= time_limit:
        raise TimeLimitError(f"the time limit came before frame {framespec.format_frame(frame)}")

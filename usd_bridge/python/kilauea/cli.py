"""The `kilauea` command."""

from __future__ import annotations

import argparse
import dataclasses
import os
import sys
import traceback
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NoReturn

from kilauea import interrupt, request
from kilauea.arguments import (
    ArgumentParser,
    add_render_options,
    add_stage_options,
    drop_unknown_flags,
)
from kilauea.errors import KilaueaError, UsageError

_FLAGS_NOT_BUILT_YET = ("denoise",)


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command and return its exit code."""
    try:
        return _run(list(sys.argv[1:] if argv is None else argv))
    except KilaueaError as error:
        _print_error(str(error))
        return error.exit_code
    except KeyboardInterrupt:
        interrupt.leave()
    except BrokenPipeError:
        # The reader of stdout went away; there is nobody to tell.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except Exception as error:
        if os.environ.get("KILAUEA_TRACEBACK"):
            traceback.print_exc()
        _print_error(f"internal error: {type(error).__name__}: {error}")
        return 1


def _run(argv: list[str]) -> int:
    command = argv[0] if argv else ""
    parser = _parser(command)
    dropped: list[str] = []
    subparser = parser.commands.get(command)
    if command in ("render", "reference", "translate") and subparser:
        argv[1:], dropped = drop_unknown_flags(subparser, argv[1:])
    args = parser.parse_args(argv)
    for flag in (*dropped, *getattr(args, "ignored_flags", ())):
        request.print_warning(f"{flag} has no meaning here: ignored")
    return args.run(args)


class _MainParser(ArgumentParser):
    commands: dict[str, ArgumentParser]


def _parser(command: str) -> _MainParser:
    parser = _MainParser(
        prog="kilauea",
        description="Kilauea, a production renderer for USD.",
        epilog="Every option has a default in the environment: --max-depth in KILAUEA_MAX_DEPTH.",
    )
    parser.add_argument("--version", action=_Version, nargs=0, help="print the version and end")
    subparsers = parser.add_subparsers(
        required=True, metavar="COMMAND", parser_class=ArgumentParser
    )
    parser.commands = {}

    def add(name: str, run: Callable[[argparse.Namespace], int], text: str) -> ArgumentParser:
        sub = subparsers.add_parser(name, help=text, description=text)
        sub.set_defaults(run=run)
        parser.commands[name] = sub
        return sub

    add_render_options(add("render", _render, "render a stage to images"))
    translate = add("translate", _translate, "print what the engine would receive")
    add_stage_options(translate)
    translate.add("--dump", action="store_true", help="as JSON (what it does anyway)")
    compare = add("compare", _compare, "measure the difference of two images")
    compare.add_argument("a", metavar="A.exr")
    compare.add_argument("b", metavar="B.exr")
    add_render_options(add("reference", _reference, "render a stage with Cycles"))
    check = add("check", _check, "hold a stage against Cycles or an image, with a verdict")
    if command == "check":
        _optional("kilauea.check", "check").add_arguments(check)
    inspect = add("inspect", _inspect, "show what photons light or paths are told")
    if command == "inspect":
        _optional("kilauea.inspect", "inspect").add_arguments(inspect)
    console = add("console", _console, "keep a stage open and render it by command")
    if command == "console":
        _optional("kilauea.console", "console").add_arguments(console)
    add("worker", _worker, "render for a console, whose ticket is on standard input")
    cluster = add("cluster", _cluster, "look at the machines of a Ray cluster")
    if command == "cluster":
        _optional("kilauea.cluster_doctor", "cluster").add_arguments(cluster)
    bench = add("bench", _bench, "measure speed and error")
    if command == "bench":
        _optional("kilauea.bench", "bench").add_arguments(bench)
    return parser


def _render(args: argparse.Namespace) -> int:
    from kilauea import shot

    for flag in _FLAGS_NOT_BUILT_YET:
        if getattr(args, flag):
            request.print_warning(f"--{flag} is not built yet: ignored")
    return shot.render(args, request.open_stage(args))


def _console(args: argparse.Namespace) -> int:
    return _optional("kilauea.console", "console").main(args)


def _cluster(args: argparse.Namespace) -> int:
    return _optional("kilauea.cluster_doctor", "cluster").main(args)


def _worker(_args: argparse.Namespace) -> int:
    from kilauea import worker

    return worker.main()


def _translate(args: argparse.Namespace) -> int:
    from kilauea.dump import as_text

    verbosity, _ = request.verbosity(args.verbose)
    stage = request.open_stage(args)
    frames = [
        stage.flatten(dataclasses.replace(request.flatten_options(args), time=t))
        for t in request.frames(args, stage.start_time)
    ]
    for frame in frames:
        request.report(frame, args.strict, verbosity)
        print(as_text(frame))
    return 0


def _compare(args: argparse.Namespace) -> int:
    from kilauea.render import native

    for name in (args.a, args.b):
        if not Path(name).is_file():
            raise KilaueaError(f"{name} does not exist")
    engine = native()
    try:
        print(engine.compare(args.a, args.b))
    except (engine.RenderError, engine.SceneError, OSError, ValueError) as error:
        raise KilaueaError(str(error)) from None
    return 0


def _reference(args: argparse.Namespace) -> int:
    args.stage = request.stage_path(args)
    args.output = args.output or args.positional_output
    return _optional("kilauea.reference", "reference").main(args)


def _check(args: argparse.Namespace) -> int:
    return _optional("kilauea.check", "check").main(args)


def _inspect(args: argparse.Namespace) -> int:
    return _optional("kilauea.inspect", "inspect").main(args)


def _bench(args: argparse.Namespace) -> int:
    return _optional("kilauea.bench", "bench").main(args)


def _optional(module: str, command: str) -> Any:
    import importlib

    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        if error.name != module:
            raise KilaueaError(f"{command} needs a module that is missing: {error.name}") from None
        raise UsageError(f"{command} is not built yet") from None


def _print_error(line: str) -> None:
    print("kilauea: error: " + " ".join(line.split()), file=sys.stderr)


class _Version(argparse.Action):
    """Looks the version up only when asked, as that takes longer than to parse a command."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> NoReturn:
        from importlib import metadata

        try:
            version = metadata.version("kilauea")
        except metadata.PackageNotFoundError:
            version = "(not installed)"
        print(f"kilauea {version}")
        parser.exit()


if __name__ == "__main__":
    sys.exit(main())

"""`kilauea console`: a stage that stays open, and commands to it by prompt or socket.

What was flattened and built for one picture is there for the next one that needs the same, so only
what changed is done again.
"""

from __future__ import annotations

import argparse
import json
import shlex
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from kilauea import interrupt, request, shot
from kilauea.arguments import ArgumentParser, add_render_options
from kilauea.clock import process_age
from kilauea.errors import KilaueaError, UsageError

_PROMPT = "kilauea> "


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the subcommand's options."""
    parser.add_argument("stage", nargs="?", help="USD file to open")
    parser.add_argument("--mask", metavar="PRIM,PRIM", help="open these prims only")
    parser.add_argument(
        "--socket", metavar="FILE", help="take commands there, a line each, and answer in JSON"
    )


def main(args: argparse.Namespace) -> int:
    """Take commands until told to quit."""
    console = Console()
    if args.stage:
        console.open(args.stage, args.mask)
    if args.socket:
        from kilauea.console_socket import serve

        serve(Path(args.socket), console)
    else:
        _prompt(console)
    return 0


def _prompt(console: Console) -> None:
    """Read commands from standard input. An error ends no more than its command."""
    while not console.is_over:
        if sys.stdin.isatty():
            print(_PROMPT, end="", flush=True)
        line = sys.stdin.readline()
        if not line:
            break
        try:
            answer = console.run(line)
        except KilaueaError as error:
            print(f"kilauea: error: {error}", file=sys.stderr)
        except interrupt.Interrupted:
            print("kilauea: interrupted", file=sys.stderr)
        else:
            for name, value in answer.items():
                print(
                    f"{name}: {value}" if isinstance(value, str) else f"{name}: {json.dumps(value)}"
                )
        sys.stdout.flush()


class Console:
    """A stage with what was made of it, and the commands that it takes."""

    def __init__(self) -> None:
        self.is_over = False
        self._path = ""
        self._mask: str | None = None
        self._stage: Any = None
        self._made = shot.Made()
        self._commands: dict[str, tuple[str, Callable[[list[str]], dict[str, Any]]]] = {
            "open": ("STAGE: instead of the stage that is open", self._open),
            "render": ("-o FILES and other flags of kilauea render", self._render),
            "get": ("PRIM.ATTRIBUTE: its value", self._get),
            "set": ("PRIM.ATTRIBUTE VALUE, as USD writes it; no file is changed", self._set),
            "reload": ("read the files again; what was set stays", self._reload),
            "help": ("these lines", self._help),
            "quit": ("end", self._quit),
        }

    def run(self, line: str) -> dict[str, Any]:
        """Do what a line says and return what there is to say about it.

        Raises
        ------
        KilaueaError
            It could not be done. The console goes on.
        """
        try:
            words = shlex.split(line, comments=True)
        except ValueError as error:
            raise UsageError(f"cannot read {line.strip()!r}: {error}") from None
        if not words:
            return {}
        name, *rest = words
        if name not in self._commands:
            raise UsageError(f"unknown command {name!r}; there are {', '.join(self._commands)}")
        return self._commands[name][1](rest)

    def open(self, path: str, mask: str | None = None) -> None:
        """Open a stage instead of the one that is open."""
        args = _render_flags(["--mask", mask] if mask else [])
        args.stage = path
        stage = request.open_stage(args)
        self._made.forget()
        self._path, self._mask, self._stage = path, mask, stage

    def _open(self, words: list[str]) -> dict[str, Any]:
        (path,) = _exactly(1, words, "open STAGE")
        self.open(path)
        return {"stage": path}

    def _render(self, words: list[str]) -> dict[str, Any]:
        begun = process_age()
        stage = self._opened()
        args = _render_flags(words)
        # The first word that is no flag would be the stage.
        if args.stage:
            raise UsageError(f"{args.stage}: the stage that is open is rendered; see open")
        if args.mask:
            raise UsageError("--mask is an option of the console, as it says what is opened")
        code = shot.render(args, stage, self._made, begun)
        return {"exit_code": code, "seconds": round(process_age() - begun, 3)}

    def _get(self, words: list[str]) -> dict[str, Any]:
        (name,) = _exactly(1, words, "get PRIM.ATTRIBUTE")
        return {name: self._opened().value_text(name)}

    def _set(self, words: list[str]) -> dict[str, Any]:
        name, value = _exactly(2, words, "set PRIM.ATTRIBUTE VALUE")
        stage = self._opened()
        stage.set_value(name, value)
        self._made.forget()
        return {name: stage.value_text(name)}

    def _reload(self, words: list[str]) -> dict[str, Any]:
        _exactly(0, words, "reload")
        self._opened().reload()
        self._made.forget()
        return {"stage": self._path}

    def _help(self, _words: list[str]) -> dict[str, Any]:
        return {name: text for name, (text, _) in self._commands.items()}

    def _quit(self, words: list[str]) -> dict[str, Any]:
        _exactly(0, words, "quit")
        self.is_over = True
        return {}

    def _opened(self) -> Any:
        if self._stage is None:
            raise UsageError("no stage is open; see open")
        return self._stage


def _render_flags(words: list[str]) -> argparse.Namespace:
    parser = ArgumentParser(prog="render", add_help=False)
    add_render_options(parser)
    return parser.parse_args(words)


def _exactly(n: int, words: list[str], usage: str) -> list[str]:
    if len(words) != n:
        raise UsageError(f"it is: {usage}")
    return words

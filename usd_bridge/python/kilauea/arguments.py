"""The command line: Kilauea's flags, and those of husk and usdrecord that mean the same."""

from __future__ import annotations

import argparse
import os
import shlex
from collections.abc import Sequence
from typing import Any, NoReturn

from kilauea import aovs
from kilauea.errors import UsageError

ENVIRONMENT_PREFIX = "KILAUEA_"

MAX_SIDE = 65536
"""Pixels of a picture's longest side."""

BUILT_INTEGRATORS = ("kilauea", "path")
"""Choices of `--integrator`."""

SUBDIVISION_LEVELS = {"low": 0, "medium": 1, "high": 2, "veryhigh": 3}

# Flags of husk and usdrecord that mean nothing here, by how many values follow them.
# fmt: off
_SWITCHES = (
    "--fast-exit", "--autocrop", "--lock-random", "--disable-delegate-products",
    "--append-stdout", "--append-stderr", "--disableGpu", "--disableDrawMode",
    "--disableCameraLight", "--usd-trace", "--enableDomeLightVisibility",
    "--timelimit-nosave-partial", "--timelimit-image",
)
_WITH_VALUE = (
    "-R", "--renderer", "--delegate-options", "--restart-delegate", "--resolver-context",
    "--headlight", "--prerender-script", "--preframe-script", "--postframe-script",
    "--postrender-script", "--snapshot", "--snapshot-path", "--snapshot-suffix",
    "--snapshot-save-mode", "--exrmode", "--tile-index", "--tile-suffix", "--stdout",
    "--stderr", "--usd-chrome-file", "--bucket-size", "--bucket-order", "--image-mode",
    "--progressive-passes", "--convergence-mode", "--engine", "--dicingcamera",
    "--sessionLayer", "--resolver", "--colorCorrectionMode", "-color", "-rp",
    "--renderPassPrimPath", "--traceToFile", "--traceFormat", "--memstats",
)
# fmt: on
_IGNORED_FLAGS = {
    **dict.fromkeys(_SWITCHES, 0),
    **dict.fromkeys(_WITH_VALUE, 1),
    "--tile-count": 2,
}
_UNITS_OF_BYTES = {"": 1, "K": 1 << 10, "M": 1 << 20, "G": 1 << 30, "T": 1 << 40}
_SILENTLY_IGNORED = {"-R", "--renderer", "--disableGpu", "--fast-exit"}
_FALSE_WORDS = {"", "0", "false", "no", "off"}


class ArgumentParser(argparse.ArgumentParser):
    """Raises instead of exiting, and takes defaults from the environment."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(allow_abbrev=False, **kwargs)
        self.flags: dict[str, argparse.Action] = {}

    def error(self, message: str) -> NoReturn:
        """Raise a usage error with argparse's message."""
        raise UsageError(message)

    def add(self, *names: str, **kwargs: Any) -> argparse.Action:
        """Add an option whose default may be set by `KILAUEA_` and its name."""
        action = self.add_argument(*names, **kwargs)
        self.flags.update(dict.fromkeys(names, action))
        value = os.environ.get(ENVIRONMENT_PREFIX + action.dest.upper())
        if value is not None:
            action.default = _from_environment(action, value)
        return action


class _Ignore(argparse.Action):
    def __call__(self, _parser: Any, namespace: Any, _values: Any, flag: str | None = None) -> None:
        if flag not in _SILENTLY_IGNORED:
            namespace.ignored_flags = [*namespace.ignored_flags, flag]


def add_stage_options(parser: ArgumentParser) -> None:
    """Add what says which part of which stage is looked at, and from where."""
    parser.add_argument("stage", nargs="?", help="USD file")
    add = parser.add
    add("--usd-input", dest="usd_input", metavar="STAGE", help="USD file, as husk has it")
    add("-c", "--camera", "-cam", help="camera prim, or its name")
    add("-s", "--settings", "-rs", "--renderSettingsPrimPath", help="RenderSettings prim")
    add("-r", "--res", nargs=2, type=_side, metavar=("W", "H"), help="resolution in pixels")
    add("-S", "--res-scale", type=float, metavar="PERCENT", default=100.0, help="of width, height")
    add("-w", "--imageWidth", dest="image_width", type=int, help="width; height by the aperture")
    add("--pixel-aspect", type=float, metavar="RATIO", help="width of a pixel over its height")
    add("-f", "--frame", metavar="FRAME", help="first frame, or frames as in --frames")
    add("-n", "--frame-count", type=int, default=1, metavar="COUNT")
    add("-i", "--frame-inc", type=float, default=1.0, metavar="INCREMENT")
    add("--frames", metavar="SPEC", help="1,3,5 or 1:10 or 1:10x2")
    add("-d", "--defaultTime", dest="default_time", action="store_true", help="ignore frames")
    add("--purpose", "--purposes", dest="purposes", metavar="P,P", help="besides default")
    add("--complexity", help="low, medium, high, veryhigh, or the highest subdivision level")
    add("--mask", metavar="PRIM,PRIM", help="open these prims only")
    add("--disable-scene-materials", action="store_true", help="render as if nothing were bound")
    add("--disable-scene-lights", action="store_true", help="leave out the stage's lights")
    add("--disable-motionblur", dest="disable_motion_blur", action="store_true")
    add("--disable-dof", dest="disable_depth_of_field", action="store_true")
    add("--strict", action="store_true", help="missing or unsupported things are errors (exit 4)")
    add("-V", "--verbose", default="2", metavar="LEVEL", help="0 errors, 1 warnings, 2 progress")


def add_render_options(parser: ArgumentParser) -> None:
    """Add everything that `kilauea render` and `kilauea reference` take."""
    add_stage_options(parser)
    parser.add_argument("positional_output", nargs="?", metavar="OUTPUT", help="as -o")
    add = parser.add
    add("-o", "--output", metavar="FILES", help="OUT.exr,OUT.png with $F4, <F4>, %%04d or ####")
    add("--make-output-path", action="store_true", help="create missing folders")
    add("--fps", type=float, help="frames per second, for the header")
    add("-p", "--pixel-samples", type=positive, metavar="SAMPLES", help="samples per pixel")
    add("--timelimit", type=_seconds, metavar="SECONDS", help="for the whole command")
    add("--noise", type=_noise, metavar="THRESHOLD", help="stop where the image is this clean")
    add("--seed", type=int)
    add("--integrator", choices=BUILT_INTEGRATORS, help="kilauea by default")
    add("--save-estimates", metavar="FILE", help="keep what the pilot of kilauea told")
    add("--estimates", metavar="FILE", help="what it told of the same frame, in place of a pilot")
    add("--gi", choices=("exact", "consistent"), help="exact by default")
    add("--max-depth", type=_not_negative, metavar="BOUNCES", help="16 by default")
    add("-j", "--threads", type=int, default=0, help="0 all cores, -1 all but one; of each worker")
    add("--workers", type=positive, metavar="N", help="processes that render, on this machine")
    add(
        "--links",
        choices=("tcp", "tls", "channels"),
        help="between --workers; tcp by default; over channels they are threads of this process",
    )
    add("--metrics", metavar="ADDRESS", help="serve figures for Prometheus, as 127.0.0.1:9100")
    add("--set-size", type=positive, metavar="M", help="workers that share a scene between them")
    add("--worker-memory", type=_bytes, metavar="BYTES", help="of a scene, such as 4G: sets by it")
    add("--broadcast", choices=("culled", "full"), help="who of a set is asked; culled by default")
    add("--resume", action="store_true", help="go on from where workers were when this was killed")
    add(
        "--cluster",
        metavar="ADDRESS",
        help="render on the machines of a Ray cluster; auto, or host:port",
    )
    add("--shading", choices=("inline", "queued", "bytes"), help="how questions are answered")
    add("--shade-memory", type=positive, metavar="MIB", help="64 by default; where shades wait")
    add("--stats", metavar="OUT.json", help="what the render did and took")
    add("--filter", choices=("box", "gaussian", "blackman-harris"))
    add("--filter-radius", type=float, metavar="PIXELS")
    add("--aov", nargs="+", action="extend", metavar="NAME", help=", ".join(aovs.known()))
    add("--denoise", action="store_true")
    add("--texture-memory", type=positive, metavar="MIB", help="1024 by default")
    parser.set_defaults(ignored_flags=[])
    for flag, n_values in _IGNORED_FLAGS.items():
        action = parser.add_argument(
            flag, dest="_ignored", action=_Ignore, nargs=n_values, help=argparse.SUPPRESS
        )
        parser.flags[flag] = action


def drop_unknown_flags(parser: ArgumentParser, argv: Sequence[str]) -> tuple[list[str], list[str]]:
    """Split off flags of other renderers, each with its value: (kept, dropped flags)."""
    kept: list[str] = []
    dropped: list[str] = []
    pending = list(argv)
    while pending:
        word = pending.pop(0)
        flag = word.partition("=")[0]
        if not flag.startswith("--") or flag in (*parser.flags, "--", "--help"):
            kept.append(word)
            continue
        dropped.append(flag)
        if "=" not in word and pending and _is_flag_value(pending[0]):
            pending.pop(0)
    return kept, dropped


def subdivision_level(complexity: str | None) -> int:
    """Return the highest subdivision level; 4 unless asked otherwise."""
    if complexity is None:
        return 4
    if complexity in SUBDIVISION_LEVELS:
        return SUBDIVISION_LEVELS[complexity]
    try:
        level = int(float(complexity))
    except ValueError:
        level = -1
    if not 0 <= level <= 10:
        raise UsageError(f"complexity {complexity!r} is not low, medium, high, veryhigh or 0 to 10")
    return level


def comma_list(text: str | None) -> list[str]:
    """Split at commas and spaces."""
    return (text or "").replace(",", " ").split()


def _is_flag_value(word: str) -> bool:
    is_file = word.lower().endswith((".usd", ".usda", ".usdc", ".usdz", ".exr", ".png"))
    return not word.startswith("-") and not is_file


def _from_environment(action: argparse.Action, value: str) -> Any:
    if action.nargs == 0:
        return value.lower() not in _FALSE_WORDS
    convert = action.type if callable(action.type) else str
    try:
        values = [convert(word) for word in shlex.split(value)]
    except (ValueError, argparse.ArgumentTypeError) as error:
        name = ENVIRONMENT_PREFIX + action.dest.upper()
        raise UsageError(f"{name}={value!r} cannot be read: {error}") from None
    if action.choices is not None and any(v not in action.choices for v in values):
        raise UsageError(f"{ENVIRONMENT_PREFIX}{action.dest.upper()}={value!r} is not a choice")
    return values if action.nargs is not None else convert(value)


def _seconds(text: str) -> float:
    value = float(text)
    if not 0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text} is not a time in seconds")
    return value


def _bytes(text: str) -> int:
    number, unit = (text[:-1], text[-1].upper()) if text[-1:].isalpha() else (text, "")
    if unit not in _UNITS_OF_BYTES or not float(number) > 0:
        raise argparse.ArgumentTypeError(f"{text} is not a number of bytes, such as 500M or 4G")
    return int(float(number) * _UNITS_OF_BYTES[unit])


def _noise(text: str) -> float:
    value = float(text)
    if not 0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text} is not a relative error above zero")
    return value


def positive(text: str) -> int:
    """Read a whole number above zero."""
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text} is not positive")
    return value


def _side(text: str) -> int:
    value = int(text)
    if not 1 <= value <= MAX_SIDE:
        raise argparse.ArgumentTypeError(f"{text} is not 1 to {MAX_SIDE} pixels")
    return value


def _not_negative(text: str) -> int:
    value = int(text)
    if value < 0:
        raise argparse.ArgumentTypeError(f"{text} is negative")
    return value

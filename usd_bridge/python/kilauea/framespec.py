"""Which frames to render, and the file name of each."""

from __future__ import annotations

import re
from collections.abc import Sequence

from kilauea.errors import UsageError

MAX_FRAMES = 1_000_000

_RANGE = re.compile(r"^(?P<first>[^:x]+)(?::(?P<last>[^:x]+)(?:x(?P<step>[^:x]+))?)?$")
_PLACEHOLDER = re.compile(
    r"\$\{F(?P<braced>\d*)\}|\$F(?P<dollar>\d*)|<F(?P<angle>\d*)>|%(?P<printf>0?\d*)d"
    r"|(?P<hashes>#+)|(?P<index>\$N\b)"
)


def parse_frames(text: str) -> list[float]:
    """Parse `1,3,5`, `1:10` and `1:10x2`, alone or joined by commas."""
    frames: list[float] = []
    for part in text.split(","):
        match = _RANGE.match(part.strip())
        try:
            if match is None:
                raise ValueError
            first = float(match["first"])
            last = float(match["last"] or first)
            step = float(match["step"] or (1 if last >= first else -1))
            count = (last - first) / step
            if not 0 <= count < MAX_FRAMES:
                raise ValueError
        except (ValueError, ZeroDivisionError, OverflowError):
            raise UsageError(
                f"cannot read frames {part!r}: write 1,3,5 or 1:10 or 1:10x2"
            ) from None
        # A step of 0.1 must not lose the last frame to rounding.
        frames += [first + i * step for i in range(int(count + 1e-6) + 1)]
    return list(dict.fromkeys(frames))


def counted_frames(first: float, count: int, increment: float) -> list[float]:
    """Return `count` frames from `first` on."""
    if not 1 <= count <= MAX_FRAMES:
        raise UsageError(f"frame count {count} is not between 1 and {MAX_FRAMES}")
    return [first + i * increment for i in range(count)]


def expand(pattern: str, frame: float, index: int = 0) -> str:
    """Put the frame in place of `$F`, `$F4`, `<F4>`, `%04d` and `####`; `$N` counts from 1."""

    def replace(match: re.Match[str]) -> str:
        if match["index"]:
            return str(index + 1)
        if match["hashes"]:
            return format_frame(frame, len(match["hashes"]))
        digits = next((g for g in match.group("braced", "dollar", "angle", "printf") if g), "")
        return format_frame(frame, int(digits or 0))

    return _PLACEHOLDER.sub(replace, pattern)


def format_frame(frame: float, width: int = 0) -> str:
    """Write a frame with its whole part padded to `width` digits."""
    whole, _, fraction = f"{abs(frame):.6f}".partition(".")
    fraction = fraction.rstrip("0")
    sign = "-" if frame < 0 else ""
    return sign + whole.zfill(width - len(sign)) + (f".{fraction}" if fraction else "")


def output_files(patterns: Sequence[str], frames: Sequence[float]) -> list[list[str]]:
    """Return the files of each frame; several frames never share a file."""
    files = [[expand(p, f, i) for p in patterns] for i, f in enumerate(frames)]
    refuse_shared(files)
    return files


def refuse_shared(files: Sequence[Sequence[str]]) -> None:
    """Raise where two frames, or one frame twice, would write the same file."""
    seen: set[str] = set()
    for names in files:
        for name in names:
            if name in seen:
                raise UsageError(
                    f"{name} would be written more than once: put $F4 in the output's name"
                )
            seen.add(name)

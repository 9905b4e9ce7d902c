"""Where images go: checked before anything is rendered."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

from kilauea.errors import KilaueaError, UsageError

IMAGE_SUFFIXES = (".exr", ".png")
NULL_RASTER = "husk:null_raster"


def image_patterns(text: str) -> list[str]:
    """Split a comma list of image files, refusing formats that are not written."""
    patterns = [p.strip() for p in text.split(",") if p.strip() and p.strip() != NULL_RASTER]
    for pattern in patterns:
        if Path(pattern).suffix.lower() not in IMAGE_SUFFIXES:
            raise UsageError(f"{pattern}: images are written as {' or '.join(IMAGE_SUFFIXES)}")
    return patterns


def check_writable(files: Iterable[str], make_folders: bool) -> None:
    """Raise where a file cannot be written, making its folder first where asked to."""
    for name in files:
        path = Path(name)
        folder = path.parent
        if make_folders:
            try:
                folder.mkdir(parents=True, exist_ok=True)
            except OSError as error:
                raise KilaueaError(f"cannot make output folder {folder}: {error}") from None
        if not folder.is_dir():
            raise KilaueaError(f"output folder {folder} does not exist")
        if path.is_dir():
            raise KilaueaError(f"output {path} is a folder")
        if not os.access(path if path.exists() else folder, os.W_OK):
            raise KilaueaError(f"output {path} cannot be written")
        if not os.access(folder, os.W_OK):
            raise KilaueaError(f"output folder {folder} cannot be written")


def write_text(file: Path, text: str) -> None:
    """Write a text file whole or not at all."""
    partial = partial_name(file)
    try:
        partial.write_text(text, encoding="utf-8")
        partial.replace(file)
    except OSError as error:
        partial.unlink(missing_ok=True)
        raise KilaueaError(f"cannot write {file}: {error.strerror}") from None


def partial_name(path: Path) -> Path:
    """Return the name under which a file or folder is written before it takes its own."""
    return path.with_name(f".{path.name}.{os.getpid()}.partial")

"""The folder of a report: written beside and renamed, so that it is there whole or not at all."""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path

import numpy as np
import OpenImageIO as oiio

from kilauea.checking.errors import CannotCheckError
from kilauea.checking.images import Floats
from kilauea.checking.report.junit import as_junit
from kilauea.checking.report.page import as_page
from kilauea.checking.report.record import Subject, as_record
from kilauea.checking.run import Outcome
from kilauea.output import partial_name, write_text

RECORD = "check.json"
"""Also the mark of a folder that a former report left, and that a new one may replace."""


def check_replaceable(folder: Path, make_parents: bool) -> None:
    """Raise where a report cannot be written, before anything is rendered.

    Raises
    ------
    CannotCheckError
        The folder holds something else, or its parent does not exist or cannot be written.
    """
    parent = folder.absolute().parent
    if make_parents:
        try:
            parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise CannotCheckError(f"cannot make folder {parent}: {error.strerror}") from None
    if not parent.is_dir():
        raise CannotCheckError(f"output folder {parent} does not exist")
    if not os.access(parent, os.W_OK):
        raise CannotCheckError(f"output folder {parent} cannot be written")
    if folder.exists() and not folder.is_dir():
        raise CannotCheckError(f"report {folder} is a file")
    if folder.is_dir() and any(folder.iterdir()) and not (folder / RECORD).is_file():
        raise CannotCheckError(f"report {folder} exists and is no report: it is not replaced")


def write_report(folder: Path, outcome: Outcome, subject: Subject, seconds: float) -> None:
    """Write `index.html`, `check.json`, `junit.xml`, `ours.exr` and `reference.exr`."""
    partial = partial_name(folder.absolute())
    try:
        partial.mkdir()
        write_text(partial / RECORD, json.dumps(as_record(outcome, subject), indent=1) + "\n")
        write_text(partial / "index.html", as_page(outcome, subject))
        (partial / "junit.xml").write_bytes(as_junit(outcome, subject, seconds))
        write_image(partial / "ours.exr", outcome.light.ours.mean)
        write_image(partial / "reference.exr", outcome.light.reference.mean)
        if folder.is_dir():
            shutil.rmtree(folder)
        partial.rename(folder)
    except OSError as error:
        raise CannotCheckError(f"cannot write {folder}: {error.strerror}") from None
    finally:
        shutil.rmtree(partial, ignore_errors=True)


def write_image(file: Path, image: Floats) -> None:
    """Write linear light as a 32-bit EXR."""
    height, width = image.shape[:2]
    target = oiio.ImageBuf(oiio.ImageSpec(width, height, 3, oiio.FLOAT))
    target.set_pixels(oiio.ROI.All, np.ascontiguousarray(image, np.float32))
    if not target.write(str(file)):
        raise CannotCheckError(f"cannot write {file}: {target.geterror()}")

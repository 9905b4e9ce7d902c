"""Virtual environments of the engines that we compare with, made on first use.

They cannot share ours: `bpy` wants another NumPy and one particular Python.
"""

from __future__ import annotations

import fcntl
import os
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from kilauea.child import run_apart
from kilauea.errors import KilaueaError


@dataclass(frozen=True, slots=True)
class Environment:
    """A virtual environment with one package in it, and what that needs beside it."""

    folder: str
    """Name inside the cache."""
    package: str
    version: str
    python_version: tuple[int, int] | None
    """The only Python that has wheels; any when absent."""
    override: str
    """Environment variable that names a ready-made interpreter."""
    companions: tuple[tuple[str, str], ...] = ()
    """Packages and versions that it needs and does not ask for."""

    @property
    def requirements(self) -> list[str]:
        """What pip installs."""
        pinned = (*self.companions, (self.package, self.version))
        return [f"{package}=={version}" for package, version in pinned]

    def python(self) -> Path:
        """Return the interpreter, making the environment where there is none.

        Raises
        ------
        KilaueaError
            It cannot be made: no suitable Python, or pip failed.
        """
        if named := os.environ.get(self.override):
            if not Path(named).is_file():
                raise KilaueaError(f"{self.override}={named} does not exist")
            return Path(named)
        folder = cache_folder() / self.folder
        python = folder / "bin" / "python"
        if not self.is_complete():
            with _locked(folder.with_suffix(".lock")):
                # Another process may have made it while this one waited.
                if not self.is_complete():
                    self._make(folder, python)
        return python

    def is_complete(self) -> bool:
        """Whether the environment is there and pip has finished: it writes RECORD last."""
        packages = cache_folder() / self.folder
        return all(
            any(packages.glob(f"lib/python*/site-packages/{name}-{version}.dist-info/RECORD"))
            for name, version in (*self.companions, (self.package, self.version))
        )

    def _make(self, folder: Path, python: Path) -> None:
        named = ", ".join(self.requirements)
        print(f"kilauea: installing {named} in {folder} (once)", file=sys.stderr)
        shutil.rmtree(folder, ignore_errors=True)
        run_apart([self._base_python(), "-m", "venv", str(folder)], "make a virtual environment")
        install = [str(python), "-m", "pip", "install", "--quiet", *self.requirements]
        run_apart(install, f"install {named}")

    def _base_python(self) -> str:
        if self.python_version in (None, sys.version_info[:2]):
            return sys.executable
        name = f"python{self.python_version[0]}.{self.python_version[1]}"
        found = shutil.which(name)
        if found is None:
            raise KilaueaError(
                f"{self.package} needs {name}, which is not installed; or set {self.override}"
            )
        return found


CYCLES = Environment("reference-env", "bpy", "5.0.1", (3, 11), "KILAUEA_REFERENCE_PYTHON")
EMBREE = Environment("embree-env", "embreex", "4.4.0.post1", None, "KILAUEA_EMBREE_PYTHON")
"""The package holds Embree as a shared library, which is all that we use of it."""
_NUMPY = ("numpy", "2.4.6")
LUXCORE = Environment(
    "luxcore-env",
    "pyluxcore",
    "2.11.2",
    None,
    "KILAUEA_LUXCORE_PYTHON",
    companions=(_NUMPY,),
)
MITSUBA = Environment(
    "mitsuba-env",
    "mitsuba",
    "3.9.1",
    None,
    "KILAUEA_MITSUBA_PYTHON",
    companions=(_NUMPY, ("karellen_llvm_core", "23.1.4.post8")),
)
"""karellen_llvm_core holds libLLVM: Mitsuba needs 16 or newer, and distributions have older."""


def cache_folder() -> Path:
    """Return the folder of everything that can be made again."""
    named = os.environ.get("KILAUEA_CACHE")
    return Path(named) if named else Path.home() / ".cache" / "kilauea"


def pipeline_script(name: str) -> Path:
    """Return a script of the `pipeline` folder, which lies beside the package's checkout.

    Raises
    ------
    KilaueaError
        The package was installed without it.
    """
    named = os.environ.get("KILAUEA_PIPELINE")
    folder = Path(named) if named else Path(__file__).resolve().parents[3] / "pipeline"
    script = folder / name
    if not script.is_file():
        raise KilaueaError(f"{script} does not exist: set KILAUEA_PIPELINE to the pipeline folder")
    return script


@contextmanager
def _locked(path: Path) -> Iterator[None]:
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield

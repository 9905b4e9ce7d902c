"""The machines of a Ray cluster."""

from __future__ import annotations

import importlib
import logging
import socket
from collections.abc import Callable
from typing import Any, TypeVar

from kilauea.errors import KilaueaError, UsageError

T = TypeVar("T")

_REACH_SECS = 5.0


def connect(address: str) -> Any:
    """Join a cluster; return Ray, which `shutdown` leaves it with.

    Parameters
    ----------
    address
        As `ray.init` takes it: `auto`, or host and port of the head.

    Raises
    ------
    UsageError
        Ray is not installed.
    KilaueaError
        There is no cluster at that address.
    """
    ray = import_ray()
    try:
        _reach(address)
        ray.init(
            address=address, namespace="kilauea", log_to_driver=False, logging_level=logging.ERROR
        )
    except (OSError, ValueError, RuntimeError) as error:
        raise KilaueaError(f"no Ray cluster at {address}: {error}") from None
    return ray


def _reach(address: str) -> None:
    """Raise where nobody listens: Ray would try for minutes, and end the process."""
    host, colon, port = address.rpartition(":")
    if colon and port.isdecimal() and "/" not in host:
        socket.create_connection((host.strip("[]"), int(port)), _REACH_SECS).close()


def machines(ray: Any) -> list[dict[str, Any]]:
    """Return what Ray knows of the machines that are there."""
    return [node for node in ray.nodes() if node["Alive"]]


def on_each_machine(ray: Any, call: Callable[[], T], timeout_secs: float) -> list[T]:
    """Call a function on each machine, one after the other.

    Raises
    ------
    KilaueaError
        A machine does not answer in time, or the call fails there.
    """
    strategy = import_ray("util.scheduling_strategies").NodeAffinitySchedulingStrategy
    answers = []
    for node in machines(ray):
        here = strategy(node["NodeID"], soft=False)
        task = ray.remote(call).options(num_cpus=0, scheduling_strategy=here).remote()
        try:
            answers.append(ray.get(task, timeout=timeout_secs))
        except ray.exceptions.RayError as error:
            raise KilaueaError(f"{node['NodeManagerHostname']}: {gist(error)}") from None
    return answers


def import_ray(module: str = "") -> Any:
    """Import Ray, or one of its modules.

    Raises
    ------
    UsageError
        It is not installed.
    """
    try:
        return importlib.import_module(f"ray.{module}" if module else "ray")
    except ImportError:
        raise UsageError("--cluster needs Ray: pip install 'kilauea[cluster]'") from None


def gist(error: Exception) -> str:
    """Return what an error of Ray says, which is the last line below a traceback."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return lines[-1].partition(" Some common causes")[0] if lines else type(error).__name__

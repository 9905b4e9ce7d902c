"""Workers on the machines of a Ray cluster.

Ray says which machines there are, starts a process on each, starts it again elsewhere when a
machine dies, and keeps others out. What a frame is made of goes between the console and the workers
over links of their own, and no ray, pixel or scene passes through Ray.
"""

from __future__ import annotations

import importlib
import json
import logging
import socket
from collections.abc import Callable
from typing import Any, TypeVar

from kilauea.errors import KilaueaError, UsageError

T = TypeVar("T")

_REACH_SECS = 5.0
_PLACEMENT_SECS = 60.0
"""For machines to become free."""


class RayWorkers:
    """A worker on each machine of a cluster.

    Parameters
    ----------
    address
        As `ray.init` takes it: `auto`, or host and port of the head.

    Raises
    ------
    UsageError
        Ray is not installed.
    KilaueaError
        There is no cluster at that address, or its machines are taken.
    """

    def __init__(self, address: str) -> None:
        self._ray = connect(address)
        placement = _import("ray.util.placement_group")
        strategies = _import("ray.util.scheduling_strategies")
        cores = [int(node["Resources"].get("CPU", 0)) for node in machines(self._ray)]
        self.n_workers = sum(n >= 1 for n in cores)
        if not self.n_workers:
            raise KilaueaError(f"the Ray cluster at {address} has no machine with a CPU")
        # Each takes all that its machine has, and they are never two on one.
        bundles = [{"CPU": n} for n in cores if n >= 1]
        self._group = placement.placement_group(bundles, strategy="STRICT_SPREAD")
        if not self._group.wait(_PLACEMENT_SECS):
            raise KilaueaError(
                f"the Ray cluster at {address} has no {self.n_workers} machines free: {bundles}"
            )
        self._cores = [bundle["CPU"] for bundle in bundles]
        self._scheduling = strategies.PlacementGroupSchedulingStrategy
        self._actor_class = self._ray.remote(RenderNode)
        self._running: dict[Any, tuple[int, Any]] = {}

    @property
    def console_host(self) -> str:
        """Return the address at which workers reach this machine."""
        return _import("ray.util").get_node_ip_address()

    def start(self, ticket: str) -> None:
        """Start the worker that a ticket is for, on the machine of its rank or on a spare one."""
        fields = json.loads(ticket)
        bundle = fields["rank"] % len(self._cores)
        actor = self._actor_class.options(
            num_cpus=self._cores[bundle],
            scheduling_strategy=self._scheduling(self._group, bundle),
        ).remote()
        self._running[actor.work.remote(ticket)] = (fields["epoch"], actor)

    def serve(self, job: Any) -> None:
        """Start the workers that a job wants, and tell it of those that have ended."""
        for ticket in job.take_tickets():
            self.start(ticket)
        for epoch, reason in self.ended():
            job.worker_ended(epoch, reason)

    def ended(self) -> list[tuple[int, str]]:
        """Return the epochs whose workers have ended since this was last asked, and why."""
        if not self._running:
            return []
        done, _ = self._ray.wait(list(self._running), num_returns=len(self._running), timeout=0)
        ended = []
        for reference in done:
            epoch, _ = self._running.pop(reference)
            try:
                self._ray.get(reference)
            except self._ray.exceptions.RayError as error:
                ended.append((epoch, _reason(error)))
            else:
                ended.append((epoch, "it had nothing more to do"))
        return ended

    def close(self) -> None:
        """Give the machines back."""
        for _, actor in self._running.values():
            self._ray.kill(actor)
        _import("ray.util.placement_group").remove_placement_group(self._group)
        self._ray.shutdown()


class RenderNode:
    """An actor of Ray, in whose process the engine works."""

    def work(self, ticket: str) -> None:
        """Work for the console that a ticket names, until there is nothing to do."""
        importlib.import_module("kilauea._native").run_worker(ticket)


def connect(address: str) -> Any:
    """Join a cluster; return Ray, which `shutdown` leaves it with."""
    ray = _import("ray")
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
    strategy = _import("ray.util.scheduling_strategies").NodeAffinitySchedulingStrategy
    answers = []
    for node in machines(ray):
        here = strategy(node["NodeID"], soft=False)
        task = ray.remote(call).options(num_cpus=0, scheduling_strategy=here).remote()
        try:
            answers.append(ray.get(task, timeout=timeout_secs))
        except ray.exceptions.RayError as error:
            raise KilaueaError(f"{node['NodeManagerHostname']}: {_reason(error)}") from None
    return answers


def _import(module: str) -> Any:
    try:
        return importlib.import_module(module)
    except ImportError:
        raise UsageError("--cluster needs Ray: pip install 'kilauea[cluster]'") from None


def _reason(error: Exception) -> str:
    """Return what an error of Ray says, which is the last line below a traceback, and its gist."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return lines[-1].partition(" Some common causes")[0] if lines else type(error).__name__

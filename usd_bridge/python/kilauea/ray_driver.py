"""What speaks to Ray, in a process of its own, since Ray ends processes that it has lost.

Reads tickets of workers, one a line, and starts those workers; writes lines of JSON: once
`{"host": ..., "n_workers": ...}`, or `{"error": ..., "exit_code": ...}` and no more; then
`{"session": ..., "epoch": ..., "reason": ...}` for each worker that has ended. Gives the machines
back when its input ends.
"""

from __future__ import annotations

import importlib
import json
import os
import queue
import sys
import threading
import time
from dataclasses import dataclass
from typing import Any

from kilauea.errors import KilaueaError
from kilauea.ray_cluster import connect, gist, import_ray, machines

_PLACEMENT_SECS = 60.0
"""For machines to become free."""
_POLL_SECS = 0.1
_LOOK_SECS = 5.0
"""Between two looks at whether the node here is alive."""


class RenderNode:
    """An actor of Ray, in whose process the engine works; it keeps the scene of its last frame."""

    def __init__(self) -> None:
        self._worker = importlib.import_module("kilauea._native").Worker()

    def work(self, ticket: str) -> None:
        """Work for the console that a ticket names, until there is nothing to do."""
        self._worker.work(ticket)


@dataclass(frozen=True, slots=True, eq=False)
class Lent:
    """A `RenderNode`, and what it was given to do last."""

    actor: Any
    bundle: int
    session: int
    epoch: int


class Machines:
    """All machines of a cluster, with a worker on each.

    Parameters
    ----------
    address
        As `kilauea.ray_cluster.connect` takes it.

    Raises
    ------
    UsageError
        Ray is not installed.
    KilaueaError
        There is no cluster at that address, or its machines are taken.
    """

    def __init__(self, address: str) -> None:
        self._ray = connect(address)
        cores = [int(node["Resources"].get("CPU", 0)) for node in machines(self._ray)]
        # Each worker takes all that its machine has, and they are never two on one.
        self._cores = [n for n in cores if n >= 1]
        if not self._cores:
            raise KilaueaError(f"the Ray cluster at {address} has no machine with a CPU")
        bundles = [{"CPU": n} for n in self._cores]
        placement = import_ray("util.placement_group")
        self._group = placement.placement_group(bundles, strategy="STRICT_SPREAD")
        if not self._group.wait(_PLACEMENT_SECS):
            raise KilaueaError(
                f"the Ray cluster at {address} has no {len(bundles)} machines free: {bundles}"
            )
        strategies = import_ray("util.scheduling_strategies")
        self._scheduling = strategies.PlacementGroupSchedulingStrategy
        self._actor_class = self._ray.remote(RenderNode)
        self._node = self._ray.get_runtime_context().get_node_id()
        self._last: dict[int, Lent] = {}
        """By bundle of the placement group."""
        self._running: dict[Any, Lent] = {}
        """By what Ray calls their work."""

    def record(self) -> dict[str, Any]:
        """Return where workers reach this machine, and how many there are."""
        host = import_ray("util").get_node_ip_address()
        return {"host": host, "n_workers": len(self._cores)}

    def start(self, ticket: str) -> None:
        """Start the worker that a ticket is for, on the machine of its rank or on a spare one.

        One that had a part in an earlier frame goes on to this one.
        """
        fields = json.loads(ticket)
        bundle, session = fields["rank"] % len(self._cores), fields["session"]
        last = self._last.get(bundle)
        if last is not None and last.session == session:
            # It is for one that was lost, which may hang and hold its cores.
            self._ray.kill(last.actor)
            last = None
        actor = self._new_actor(bundle) if last is None else last.actor
        lent = self._last[bundle] = Lent(actor, bundle, session, fields["epoch"])
        self._running[actor.work.remote(ticket)] = lent

    def _new_actor(self, bundle: int) -> Any:
        here = self._scheduling(self._group, bundle)
        options = {"num_cpus": self._cores[bundle], "scheduling_strategy": here}
        return self._actor_class.options(**options).remote()

    def ended(self) -> list[dict[str, Any]]:
        """Return the workers that have ended since this was last asked, and why."""
        if not self._running:
            time.sleep(_POLL_SECS)
            return []
        all_running = list(self._running)
        done, _ = self._ray.wait(all_running, num_returns=len(all_running), timeout=_POLL_SECS)
        ended = []
        for reference in done:
            lent = self._running.pop(reference)
            try:
                self._ray.get(reference)
                reason = "it had nothing more to do"
            except self._ray.exceptions.RayError as error:
                reason = gist(error)
                if self._last.get(lent.bundle) is lent:
                    del self._last[lent.bundle]
            ended.append({"session": lent.session, "epoch": lent.epoch, "reason": reason})
        return ended

    def are_there(self) -> bool:
        """Whether Ray still has this machine, with which all that was started here ends."""
        return any(node["NodeID"] == self._node for node in machines(self._ray))

    def give_back(self) -> None:
        """Leave the cluster."""
        for last in self._last.values():
            self._ray.kill(last.actor)
        import_ray("util.placement_group").remove_placement_group(self._group)
        self._ray.shutdown()


def main(address: str) -> None:
    """Start workers at a cluster until there are no more tickets to come."""
    console = os.fdopen(os.dup(sys.stdout.fileno()), "w")
    # Ray prints now and then.
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())

    def write(message: dict[str, Any]) -> None:
        print(json.dumps(message), file=console, flush=True)

    try:
        cluster = Machines(address)
    except KilaueaError as error:
        write({"error": str(error), "exit_code": error.exit_code})
        return
    write(cluster.record())
    tickets: queue.SimpleQueue[str] = queue.SimpleQueue()
    threading.Thread(target=read, args=(tickets,), daemon=True).start()
    looked_at = time.monotonic()
    while True:
        while not tickets.empty():
            ticket = tickets.get()
            if not ticket:
                cluster.give_back()
                return
            cluster.start(ticket)
        for worker in cluster.ended():
            write(worker)
        if time.monotonic() > looked_at + _LOOK_SECS:
            if not cluster.are_there():
                return
            looked_at = time.monotonic()


def read(tickets: queue.SimpleQueue[str]) -> None:
    """Hand lines of the input on, and an empty one at its end."""
    for line in sys.stdin:
        tickets.put(line.strip())
    tickets.put("")


if __name__ == "__main__":
    main(sys.argv[1])

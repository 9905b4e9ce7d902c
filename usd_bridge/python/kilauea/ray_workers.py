"""Workers on the machines of a Ray cluster.

Ray says which machines there are, starts a process on each, starts it again elsewhere when a
machine dies, and keeps others out. What a frame is made of goes between the console and the workers
over links of their own, and no ray, pixel or scene passes through Ray. A cluster that breaks down
takes its driver with it, and so not the console.
"""

from __future__ import annotations

import json
import queue
import subprocess
import sys
import threading
from contextlib import suppress
from typing import Any

from kilauea.errors import KilaueaError, UsageError

_LEAVE_SECS = 10.0
"""For machines to be given back."""


class RayWorkers:
    """A worker on each machine of a cluster.

    Parameters and errors are those of `kilauea.ray_driver.Machines`.
    """

    def __init__(self, address: str) -> None:
        self._address = address
        # An interrupt is for the console, which then closes the driver's input.
        self._driver = subprocess.Popen(
            [sys.executable, "-m", "kilauea.ray_driver", address],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )
        self._messages: queue.SimpleQueue[dict[str, Any]] = queue.SimpleQueue()
        self._last_words = ""
        self._session: int | None = None
        self._running: set[int] = set()
        hearing = (self._listen, self._complain)
        self._hearing = [threading.Thread(target=hear, daemon=True) for hear in hearing]
        for thread in self._hearing:
            thread.start()
        first = self._messages.get()
        if "error" in first:
            self.close()
            kind = UsageError if first["exit_code"] == UsageError.exit_code else KilaueaError
            raise kind(first["error"])
        self.n_workers: int = first["n_workers"]
        self.console_host: str = first["host"]
        """The address at which workers reach this machine."""

    def serve(self, job: Any) -> None:
        """Have the workers started that a job wants, and tell it of those that have ended."""
        for ticket in job.take_tickets():
            self.start(ticket)
        while not self._messages.empty():
            message = self._messages.get()
            # Workers of earlier frames end now and then too; the last message is the driver's end.
            if "epoch" in message and message["session"] == self._session:
                self._running.discard(message["epoch"])
                job.worker_ended(message["epoch"], message["reason"])
        if self._driver.poll() is not None:
            # With it go all that it has started.
            for epoch in self._running:
                job.worker_ended(epoch, self._why_gone())
            self._running.clear()

    def start(self, ticket: str) -> None:
        """Have a worker started."""
        fields = json.loads(ticket)
        if fields["session"] != self._session:
            self._session = fields["session"]
            self._running.clear()
        self._running.add(fields["epoch"])
        # `serve` sees that there is nobody to read it.
        with suppress(BrokenPipeError):
            print(ticket, file=self._driver.stdin, flush=True)

    def close(self) -> None:
        """Give the machines back, which Ray does itself where it does not answer."""
        assert self._driver.stdin is not None
        with suppress(BrokenPipeError):
            self._driver.stdin.close()
        try:
            self._driver.wait(_LEAVE_SECS)
        except subprocess.TimeoutExpired:
            self._driver.kill()
            self._driver.wait()
            line = f"the Ray cluster at {self._address} does not answer; it was left"
            print(f"kilauea: warning: {line}", file=sys.stderr)
        for thread in self._hearing:
            thread.join()

    def _listen(self) -> None:
        assert self._driver.stdout is not None
        with self._driver.stdout as lines:
            for line in lines:
                self._messages.put(json.loads(line))
        self._messages.put({"error": self._why_gone(), "exit_code": KilaueaError.exit_code})

    def _complain(self) -> None:
        assert self._driver.stderr is not None
        with self._driver.stderr as lines:
            for line in lines:
                self._last_words = line.strip() or self._last_words

    def _why_gone(self) -> str:
        return f"the Ray cluster at {self._address} is gone: {self._last_words}"

"""A cluster of three of Ray's nodes, each on its own, on this machine."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from frames import cluster_of

N_NODES = 3


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    with cluster_of(N_NODES) as cluster:
        yield cluster.address

"""Estimate of a scene on a cluster; solidsph itself runs on one machine."""

from __future__ import annotations

from math import ceil

import attrs

from solidsph.costs.calibration import Calibration
from solidsph.costs.model import Prediction, step_seconds
from solidsph.errors import SceneError

# Limit of the search for a number of nodes.
_MOST_NODES = 1_000_000


@attrs.frozen
class Cluster:
    """Assumed cluster; its cores are as fast as this machine's."""

    cores: int = 64  # per node
    memory: float = 256.0  # per node [GiB]
    usable: float = 0.8  # fraction of the memory for arrays [-]
    bandwidth: float = 200.0  # memory bandwidth per node [GB/s]
    network: float = 12.5  # per node [GB/s]
    latency: float = 5.0  # per message [us]
    storage: float = 10.0  # of the whole cluster, for the record [GB/s]
    efficiency: float = 0.7  # parallel efficiency of a node's cores [-]

    def __attrs_post_init__(self) -> None:
        for field in attrs.fields(Cluster):
            value = getattr(self, field.name)
            number = isinstance(value, (int, float)) and not isinstance(value, bool)
            if not number or not value > 0:
                raise SceneError(
                    f"cluster: {field.name} must be a positive number, got {value!r}; "
                    f"the default is {field.default}"
                )


@attrs.frozen
class ClusterEstimate:
    """Estimated cost of a scene on a cluster."""

    nodes: int
    bytes_a_particle: float
    halo: int  # particles of other nodes that a node holds copies of
    exchanged: int  # bytes sent per node and step
    computing: float  # per step [s]
    exchanging: float  # per step [s]
    seconds: float  # whole run
    limit: str  # bottleneck of a step


def estimate_on_cluster(
    prediction: Prediction, machine: Calibration, cluster: Cluster
) -> ClusterEstimate:
    """Estimate the nodes and time for a run; each node has a cube of particles with a halo."""
    work = prediction.work
    d, n = work.dimension, work.particles
    each = (prediction.memory - machine.bare) / n
    room = cluster.usable * cluster.memory * 2**30
    nodes = min(_MOST_NODES, max(1, ceil(each * n / room)))
    while nodes < _MOST_NODES and each * _with_halo(n / nodes, nodes, work.cover, d) > room:
        nodes += max(1, nodes // 100)
    local = n / nodes
    share = _with_halo(local, nodes, work.cover, d) / n
    halo = share * n - local
    by_cores = step_seconds(work, machine, threads=1) * share / (cluster.cores * cluster.efficiency)
    by_memory = work.touched * share / (1e9 * cluster.bandwidth)
    computing = max(by_cores, by_memory)
    # Displacements are sent, forces received.
    exchanged = round(2 * 8 * d * halo)
    messages = 2 * (3**d - 1) if nodes > 1 else 0
    exchanging = exchanged / (1e9 * cluster.network) + messages * 1e-6 * cluster.latency
    recording = work.record_bytes / (1e9 * cluster.storage)
    waits = {"cores": by_cores, "memory bandwidth": by_memory, "network": exchanging}
    return ClusterEstimate(
        nodes=nodes,
        bytes_a_particle=each,
        halo=round(halo),
        exchanged=exchanged,
        computing=computing,
        exchanging=exchanging,
        seconds=prediction.compiling + work.evaluations * (computing + exchanging) + recording,
        limit=max(waits, key=lambda name: waits[name]),
    )


def _with_halo(local: float, nodes: int, reach: float, d: int) -> float:
    """Particles of a cube of `local` particles with its halo; a single node has no halo."""
    if nodes == 1:
        return local
    return float((local ** (1.0 / d) + 2.0 * reach) ** d)

"""How good the particles of a built scene are, as `solidsph explain` shows it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from solidsph.commands.console import Table
from solidsph.interfaces.body import Body
from solidsph.simulation import Simulation

_COLUMNS = {
    "nearest, least": "nearest neighbour: least [spacings]",
    "nearest, median": "median [spacings]",
    "nearest, greatest": "greatest [spacings]",
    "off the surface": "surface particles off the surface [spacings]",
    "volume": "volume off by",
    "centroid": "centroid off by [spacings]",
    "second moments": "second moments off by",
}
"""Columns of the table, and their headings."""


def quality_rows(simulation: Simulation) -> list[dict[str, Any]]:
    """One row a body: distances in spacings, moments relative to those of the shape.

    Moments are None where the shape gives none; the second ones are about the centroid, over their
    trace.
    """
    return [_of_body(body) for body in simulation.model.bodies]


def quality_text(rows: Sequence[dict[str, Any]]) -> Iterator[Table]:
    """The rows as a table."""
    if rows:
        yield Table.of("particles", rows, ("body", *_COLUMNS), _COLUMNS)


def _of_body(body: Body) -> dict[str, Any]:
    particles = body.particles
    real = ~particles.ghosts
    X, V, s = particles.positions[real], particles.volumes[real], particles.spacings[real]
    near, _ = cKDTree(X).query(X, 2)  # itself, and the nearest; infinite if it is alone
    nearest = np.asarray(near)[:, 1] / s
    outer = particles.area_vectors[real].any(axis=1)
    off = np.abs(body.shape.signed_distance(X[outer])) / s[outer]
    return {
        "body": body.name,
        "nearest, least": float(nearest.min()),
        "nearest, median": float(np.median(nearest)),
        "nearest, greatest": float(nearest.max()),
        "off the surface": float(off.max()) if len(off) else None,
        **_moments(body, X, V, float(s.min())),
    }


def _moments(body: Body, X: Any, V: Any, spacing: float) -> dict[str, float | None]:
    """Volume, centroid and second moments of the particles, beside those of the shape."""
    centre = V @ X / V.sum()
    exact = body.shape.moments(centre)
    volume = body.shape.volume() if exact is None else exact.volume
    found: dict[str, float | None] = {
        "volume": None if volume is None else float(V.sum()) / volume - 1.0,
        "centroid": None,
        "second moments": None,
    }
    if exact is not None:
        off = exact.first / exact.volume
        second = exact.second - exact.volume * np.outer(off, off)
        own = np.einsum("p,pi,pj->ij", V, X - centre, X - centre)
        found["centroid"] = float(np.linalg.norm(off)) / spacing
        found["second moments"] = float(np.abs(own - second).max() / np.trace(second))
    return found

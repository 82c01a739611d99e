"""The named faces of a built scene, as `solidsph explain` shows them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from solidsph.commands.console import Table
from solidsph.simulation import Simulation

_SHOWN = 20  # faces, unless all are asked for


def face_rows(simulation: Simulation) -> list[dict[str, Any]]:
    """Name, particles, area and centre of every face, the largest first."""
    pieces = simulation.model.pieces()
    X, bodies = simulation.particles.positions, list(simulation.particles.bodies)
    noise = 1e-12 * float(np.abs(X).max())
    each = np.stack([pieces.bodies, pieces.faces], axis=1)
    found = []
    for body, face in np.unique(each, axis=0).tolist():
        own = (pieces.bodies == body) & (pieces.faces == face) & (pieces.areas > 0.0)
        if not own.any():
            continue
        areas, owners = pieces.areas[own], pieces.owners[own]
        centre = areas @ X[owners] / areas.sum()
        found.append(
            {
                "face": ".".join([bodies[body]] * (len(bodies) > 1) + [pieces.names[face]]),
                "particles": len(owners),
                "area": float(areas.sum()),
                "centre": np.where(np.abs(centre) < noise, 0.0, centre).tolist(),
            }
        )
    return sorted(found, key=lambda row: -row["area"])


def face_text(faces: Sequence[dict[str, Any]], *, verbose: bool) -> Iterator[Table | str]:
    """The faces as a table, and how many it leaves out."""
    if not faces:
        return
    d = len(faces[0]["centre"])
    size = {1: "area [-]", 2: "length [m]", 3: "area [m^2]"}[d]
    shown = faces if verbose else faces[:_SHOWN]
    rows = [{**f, "centre": ", ".join(f"{x:.4g}" for x in f["centre"])} for f in shown]
    yield Table.of(
        "faces",
        rows,
        ("face", "particles", "area", "centre"),
        {"area": size, "centre": "centre [m]"},
    )
    if len(shown) < len(faces):
        yield f"{len(faces) - len(shown)} smaller faces are shown by -v"

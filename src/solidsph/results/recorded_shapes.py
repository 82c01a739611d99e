"""Shapes of the bodies of a recorded run."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from solidsph.errors import RecordError, SolidsphError
from solidsph.interfaces.shape import Shape
from solidsph.registry.construct import construct
from solidsph.scene.scene import Scene
from solidsph.system.files import relative_to


def recorded_shapes(scene: str, folder: str) -> Mapping[str, Shape]:
    """Shapes of all bodies, by name, from the scene in a record.

    Args:
        scene: TOML text.
        folder: where its relative paths begin.

    Raises:
        RecordError: they cannot be made, as of a scene that was composed of Python objects.
    """
    try:
        with relative_to(Path(folder) if folder else None):
            bodies = Scene.from_toml(scene, "the scene in the record").bodies
            return {name: construct("shapes", body.shape) for name, body in bodies.items()}
    except SolidsphError as cause:
        raise RecordError(
            f"values at points need the shapes of the bodies, and the record has none: {cause}; "
            "ask the Result of the run instead"
        ) from cause

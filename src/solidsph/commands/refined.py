"""solidsph cost --refine: the scene with the spacings that its error asks for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import attrs

from solidsph.commands.console import progress, progress_observers
from solidsph.errors import SceneError
from solidsph.scene.scene import Scene
from solidsph.simulation import Simulation
from solidsph.studies.by_error import RefinedScene, refined_by_error
from solidsph.studies.case import Case


def refined(wanted: Scene | Case, name: str, folder: Path, *, shown: bool) -> RefinedScene:
    """The scene that was asked for, refined where its error is large.

    Raises:
        SceneError: it is a case, which has parameters to refine it.
    """
    if not isinstance(wanted, Scene):
        raise SceneError(
            f"--refine is for a scene; the case {name!r} is refined by its parameters: give --axis"
        )
    with progress(shown) as display:

        def begin(run: str, simulation: Simulation) -> Sequence[object]:
            return progress_observers(display, f"{name}, {run}", simulation)

        return refined_by_error(wanted, folder, name=f"{name}-refined", begin=begin)


def refinement_facts(made: RefinedScene) -> Mapping[str, Any]:
    """What has been refined, for programs."""
    return {
        "scene": None if made.path is None else str(made.path),
        "expected gain": made.gain,
        "bodies": {name: attrs.asdict(one) for name, one in made.bodies.items()},
        "sentences": list(made.sentences),
    }

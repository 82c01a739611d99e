"""SceneData: the words of a scene, as plain data.

A scene holds names, numbers and formulas. In Python, objects may stand where a name would; such
a scene runs, and can be written to a file if its parts are registered.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import attrs

from solidsph.model.regions import EVERYWHERE, Where

PartLike: TypeAlias = str | Mapping[str, Any] | object
"""A registered name, a table with a `type` and parameters, or the part itself."""


@attrs.frozen
class BodyScene:
    """One body: where its material is and how finely it is resolved."""

    shape: PartLike
    spacing: float  # [m]
    discretisation: PartLike = "lattice"
    material: PartLike | None = None  # the scene's own if None
    tags: Mapping[str, Where] = attrs.field(factory=dict)  # named sets of its particles


@attrs.frozen
class ImposedScene:
    """A boundary or an effect, and the label of its account."""

    part: PartLike
    label: str | None = None


@attrs.frozen
class InitialScene:
    """Displacement and velocity at the start of some particles; a later entry overrides."""

    where: Where = EVERYWHERE
    displacement: Mapping[str, Any] | None = None  # {x = "0.2*X"} [m]
    velocity: Mapping[str, Any] | None = None  # [m/s]


@attrs.frozen
class StaticsScene:
    """That the scene is to be found in equilibrium instead of moving; see `statics.equilibrium`."""

    load_steps: int = 1  # to begin with
    tolerance: float = 1e-9  # imbalance over loads and reactions [-]
    max_iterations: int = 25  # of Newton's method in a load step


@attrs.frozen
class SleepScene:
    """That regions which nothing has reached cost nothing; see `solidsph.run.sleeping`."""

    tolerance: float = 1e-9  # of the largest speed, below which a region sleeps [-]
    slabs: int = 160  # regions across the longest side of the body


DEFAULT_INTEGRATOR = "velocity-verlet"

# No run of more steps ends; a scene that asks for them has its units wrong.
MOST_STEPS = 1e10

OFF = "off"
"""The `energy_tolerance` of a scene whose energies nobody is to judge."""


@attrs.frozen
class SceneData:
    """What a scene says, word by word."""

    bodies: Mapping[str, BodyScene]
    duration: float  # [s]
    title: str = ""
    kernel: PartLike = "modified-mollifier"
    cover: float | None = None  # support radius in particle spacings; the kernel's own if None [-]
    material: PartLike | None = None
    formulation: PartLike = "total-lagrangian"
    boundaries: Sequence[ImposedScene] = ()
    effects: Sequence[ImposedScene] = ()
    initial: Sequence[InitialScene] = ()
    integrator: PartLike | None = None  # None names none: then it is the default
    sleep: SleepScene | None = None  # regions that nothing has reached cost nothing
    statics: StaticsScene | None = None  # equilibrium at the end of the duration, not motion
    time_step_factor: float = 0.5  # of the CFL step
    time_step: float | None = None  # [s]; overrides the factor
    outputs: int = 200  # recorded states after the first
    engine: PartLike = "auto"
    energy_tolerance: float | str = 0.01  # energy residual over energy in play, or "off" [-]
    silence: Sequence[str] = ()  # names of warnings that are not to be shown

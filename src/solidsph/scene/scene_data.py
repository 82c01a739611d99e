"""SceneData: a scene as plain data.

A scene holds names, numbers and formulas. In Python, a part object may replace its name; such a
scene runs, and can be written to a file if its parts are registered.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import attrs

from solidsph.model.regions import EVERYWHERE, Where
from solidsph.scene.static_solver import AUTOMATIC

PartLike: TypeAlias = str | Mapping[str, Any] | object
"""A registered name, a table with a `type` and parameters, or the part itself."""


@attrs.frozen
class BodyScene:
    """One body: its shape, resolution and material."""

    shape: PartLike
    spacing: float | str | Mapping[str, Any]  # [m], a number, a formula of X, Y, Z, or {file = ...}
    discretisation: PartLike | None = None  # that of the scheme if None
    material: PartLike | None = None  # that of the scene if None
    tags: Mapping[str, Where] = attrs.field(factory=dict)  # named sets of its particles
    refine: Sequence[Mapping[str, Any]] = ()  # where it is finer; see `refine_entries`


@attrs.frozen
class ImposedScene:
    """A boundary or an effect, and the label of its account."""

    part: PartLike
    label: str | None = None


@attrs.frozen
class InitialScene:
    """Initial displacement and velocity of some particles; a later entry overrides."""

    where: Where = EVERYWHERE
    displacement: Mapping[str, Any] | None = None  # {x = "0.2*X"} [m]
    velocity: Mapping[str, Any] | None = None  # [m/s]


@attrs.frozen
class ProbeScene:
    """A measurement: a quantity at one place, which becomes columns of the history."""

    label: str | None = None  # the beginning of its columns; every probe has one
    quantity: str | None = None  # a name, with a component or without: "stress xy"
    point: Sequence[float] | None = None  # of the undeformed body [m]
    line: Mapping[str, Any] | None = None  # {from = [0, 0], to = [1, 0], count = 101}
    where: Where | None = None  # a part of the surface
    account: str | None = None  # the label of a boundary or an effect
    about: Sequence[float] | None = None  # point of a moment [m]; the origin if None
    body: str | None = None  # that contains the point or the line, where several touch

    @property
    def place(self) -> str:
        """Where it measures, in words."""
        found = []
        for name in ("point", "line", "where", "account", "about", "body"):
            value = getattr(self, name)
            if isinstance(value, Mapping):
                value = " ".join(f"{word} {part}" for word, part in value.items())
            if value is not None:
                found.append(f"{name} {value}")
        return ", ".join(found)


@attrs.frozen
class ReferenceScene:
    """What a column of the history should be; see `solidsph.studies.reference`."""

    quantity: str | None = None  # a column, or the label of a probe: "tip y", "peak tip y"
    value: float | str | None = None  # a number, or a formula, of the time t for a curve
    file: str | None = None  # with columns of times and values, in place of `value`
    source: str = ""
    tolerance: float = 0.01  # largest error with which a run passes [-]


@attrs.frozen
class StaticsScene:
    """Parameters of an equilibrium; see `statics.equilibrium`."""

    load_steps: int | None = None  # initial number; if None, as `static_solver.load_steps` says
    tolerance: float = 1e-9  # imbalance over loads and reactions [-]
    max_iterations: int = 25  # of Newton's method per load step
    solver: str = AUTOMATIC  # of its linear systems, one of `static_solver.SOLVERS`


@attrs.frozen
class SleepScene:
    """Parameters of sleeping regions; see `solidsph.run.sleeping`."""

    tolerance: float = 1e-9  # a region sleeps below this fraction of the largest speed [-]
    slabs: int = 160  # regions across the longest side of the body


RECOMMENDED = "recommended"
"""The scheme of a scene that names none; see `solidsph.scene.scheme`."""

DEFAULT_FACTOR = 0.6
"""The `time_step_factor` of a scene that names none.

A step of 1 / sqrt(2) of the critical one takes four steps to the fastest vibration, one of sqrt(3)
/ 2 three: there nonlinear forces feed it. At 0.7 the energy of a spinning square drifts by 3e-3 in
a thousand turns, at 0.6 by 3e-5. The critical step may fall by a quarter before the run cuts its
own. Errors hardly depend on it: the deflection of a swinging beam differs from that of a tenth of
the step by 3e-5 to 5e-5 of its largest at 0.3 to 0.95 of the critical step, the front of a suddenly
stopped bar is as sharp at any.
"""

# No run of more steps ends; a scene that asks for them has wrong units.
MOST_STEPS = 1e10

OFF = "off"
"""The `energy_tolerance` of a scene whose energies are not judged."""


DURATION_OF_EQUILIBRIA = 1.0
"""Duration of a scene with `statics` that gives none [s]."""


@attrs.frozen
class SceneData:
    """Everything that a scene specifies."""

    bodies: Mapping[str, BodyScene]
    duration: float  # [s]
    title: str = ""
    scheme: str = RECOMMENDED  # what chooses the parts that are None
    kernel: PartLike | None = None
    cover: float | None = None  # support radius [spacings]
    material: PartLike | None = None
    formulation: PartLike | None = None
    boundaries: Sequence[ImposedScene] = ()
    effects: Sequence[ImposedScene] = ()
    initial: Sequence[InitialScene] = ()
    probes: Sequence[ProbeScene] = ()
    references: Sequence[ReferenceScene] = ()
    integrator: PartLike | None = None
    sleep: SleepScene | None = None  # None: no region sleeps
    statics: StaticsScene | None = None  # None: a motion, no equilibrium
    time_step_factor: float = DEFAULT_FACTOR  # of the critical step, and at most of the CFL step
    time_step: float | None = None  # [s]; overrides the factor
    outputs: int = 200  # recorded states after the first
    engine: PartLike = "auto"
    energy_tolerance: float | str = 0.01  # energy residual over energy in play, or OFF [-]
    silence: Sequence[str] = ()  # names of warnings to suppress

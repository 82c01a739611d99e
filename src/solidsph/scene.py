"""Scene: what a user asks for, as plain data; TOML in and out.

A scene holds names, numbers and formulas. In Python, objects may stand where a name would; such
a scene runs, and can be written to a file if its parts are registered.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias

import attrs
import tomli_w

from solidsph.errors import SceneError
from solidsph.parts import describe
from solidsph.where import EVERYWHERE, Where

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
    """That regions which nothing has reached cost nothing; see `solidsph.asleep`."""

    tolerance: float = 1e-9  # of the largest speed, below which a region sleeps [-]
    slabs: int = 160  # regions across the longest side of the body


DEFAULT_INTEGRATOR = "velocity-verlet"

# No run of more steps ends; a scene that asks for them has its units wrong.
MOST_STEPS = 1e10

OFF = "off"
"""The `energy_tolerance` of a scene whose energies nobody is to judge."""


@attrs.frozen
class Scene:
    """Everything that a run depends on."""

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
    engine: str = "auto"
    energy_tolerance: float | str = 0.01  # energy residual over energy in play, or "off" [-]
    silence: Sequence[str] = ()  # names of warnings that are not to be shown

    @classmethod
    def read(cls, path: Path) -> Scene:
        """From a TOML file.

        Raises:
            SceneError: the file is missing, is not TOML, or says something unknown.
        """
        from solidsph.reading import text_of  # reading imports this module

        return cls.from_toml(text_of(path), str(path))

    @classmethod
    def from_toml(cls, text: str, origin: str = "scene") -> Scene:
        """From TOML text; `origin` is named in errors.

        Raises:
            SceneError: it is not TOML, or says something unknown. Then the scene is also looked
                through for whatever else is wrong with it, and all of it is told together.
        """
        from solidsph.reading import scene_of  # reading imports this module

        return scene_of(text, origin)

    def to_toml(self) -> str:
        """TOML text from which an equal scene is read.

        Raises:
            SceneError: the scene holds objects or functions that a file cannot.
        """
        return tomli_w.dumps(_table(self))


def _table(scene: Scene) -> dict[str, Any]:
    table: dict[str, Any] = {}
    if scene.title:
        table["title"] = scene.title
    table |= {"duration": scene.duration, "outputs": scene.outputs, "engine": scene.engine}
    if scene.energy_tolerance != attrs.fields(Scene).energy_tolerance.default:
        table["energy_tolerance"] = scene.energy_tolerance
    if scene.silence:
        table["silence"] = list(scene.silence)
    table["body"] = {name: _body_table(body) for name, body in scene.bodies.items()}
    table["kernel"] = _part(scene.kernel, "kernels")
    if scene.cover is not None:
        table["kernel"] = {**table["kernel"], "cover": scene.cover}
    if scene.material is not None:
        table["material"] = _part(scene.material, "materials")
    table["formulation"] = _part(scene.formulation, "formulations")
    if scene.statics is None:
        step = (
            {"time_step_factor": scene.time_step_factor}
            if scene.time_step is None
            else {"time_step": scene.time_step}
        )
        integrator = _part(scene.integrator or DEFAULT_INTEGRATOR, "integrators")
        table["integrator"] = {**integrator, **step}
    else:
        table["statics"] = attrs.asdict(scene.statics)
    if scene.sleep is not None:
        table["sleep"] = attrs.asdict(scene.sleep)
    for key, kind, entries in (
        ("boundary", "boundaries", scene.boundaries),
        ("effect", "effects", scene.effects),
    ):
        rows = [
            {**_part(one.part, kind), **({"label": one.label} if one.label else {})}
            for one in entries
        ]
        if rows:
            table[key] = rows
    if scene.initial:
        table["initial"] = [
            {k: _writable(v, f"initial.{k}") for k, v in attrs.asdict(one).items() if v is not None}
            for one in scene.initial
        ]
    return table


def _body_table(body: BodyScene) -> dict[str, Any]:
    table: dict[str, Any] = {
        "shape": _part(body.shape, "shapes"),
        "spacing": body.spacing,
        "discretisation": _part(body.discretisation, "discretisations"),
    }
    if body.material is not None:
        table["material"] = _part(body.material, "materials")
    if body.tags:
        table["tags"] = {tag: _writable(where, f"tags.{tag}") for tag, where in body.tags.items()}
    return table


def _part(part: PartLike, kind: str) -> dict[str, Any]:
    if isinstance(part, str):
        return {"type": part}
    if isinstance(part, Mapping):
        written: dict[str, Any] = _writable(part, kind)
        return written
    return describe(kind, part)


def _writable(value: Any, what: str) -> Any:
    if isinstance(value, Mapping):
        return {k: _writable(v, f"{what}.{k}") for k, v in value.items() if v is not None}
    if isinstance(value, (list, tuple)):
        return [_writable(v, what) for v in value]
    if hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, (bool, int, float, str)):
        return value
    raise SceneError(
        f"{what} = {value!r} cannot be written to a file; state it as a number, a name or a formula"
    )

"""SceneBuilder: a scene said in words, one method a word."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, Literal, Self

import attrs

from solidsph.errors import BuildError, SceneError
from solidsph.model.fields import Component
from solidsph.model.regions import EVERYWHERE, Where
from solidsph.scene.scene import Scene
from solidsph.scene.scene_data import (
    BodyScene,
    ImposedScene,
    InitialScene,
    PartLike,
    SleepScene,
    StaticsScene,
)


class SceneBuilder(ABC):
    """Collects a scene in words. Every method returns the builder.

    Where a part is asked for by name, parameters follow as keywords; any part object that keeps
    its interface may stand in place of the name.
    """

    def __init__(self, scene: Scene | None = None) -> None:
        self._bodies: dict[str, BodyScene] = dict(scene.bodies) if scene else {}
        self._boundaries = list(scene.boundaries) if scene else []
        self._effects = list(scene.effects) if scene else []
        self._initial = list(scene.initial) if scene else []
        collections = ("bodies", "boundaries", "effects", "initial")
        fields = [field.name for field in attrs.fields(Scene) if field.name not in collections]
        self._values: dict[str, Any] = {n: getattr(scene, n) for n in fields} if scene else {}

    def title(self, title: str) -> Self:
        """A line that says what the scene is."""
        self._values["title"] = title
        return self

    def body(
        self,
        name: str,
        *,
        shape: PartLike,
        spacing: float,
        discretisation: PartLike = "lattice",
        material: PartLike | None = None,
        tags: Mapping[str, Where] | None = None,
    ) -> Self:
        """Add a body; `spacing` in metres, `tags` name sets of its particles."""
        if name in self._bodies:
            raise SceneError(f"two bodies are called {name!r}; give each a name of its own")
        self._bodies[name] = BodyScene(shape, spacing, discretisation, material, dict(tags or {}))
        return self

    def kernel(self, kernel: PartLike, *, cover: float | None = None, **parameters: Any) -> Self:
        """Choose the kernel and its cover, the support radius in particle spacings."""
        self._values["kernel"] = _part(kernel, parameters)
        if cover is not None:
            self._values["cover"] = cover
        return self

    def material(self, material: PartLike, **parameters: Any) -> Self:
        """The material of every body that names none of its own."""
        self._values["material"] = _part(material, parameters)
        return self

    def formulation(self, formulation: PartLike, **parameters: Any) -> Self:
        """Choose the formulation, with its gradient and divergence."""
        self._values["formulation"] = _part(formulation, parameters)
        return self

    def boundary(self, boundary: PartLike, *, label: str | None = None, **parameters: Any) -> Self:
        """Add a boundary handler; its account is called `label`."""
        self._boundaries.append(ImposedScene(_part(boundary, parameters), label))
        return self

    def effect(self, effect: PartLike, *, label: str | None = None, **parameters: Any) -> Self:
        """Add an effect; its account is called `label`."""
        self._effects.append(ImposedScene(_part(effect, parameters), label))
        return self

    def initial(
        self,
        *,
        where: Where = EVERYWHERE,
        displacement: Mapping[str, Component] | None = None,
        velocity: Mapping[str, Component] | None = None,
    ) -> Self:
        """Set displacement [m] and velocity [m/s] at the start; a later call overrides."""
        self._initial.append(InitialScene(where, displacement, velocity))
        return self

    def integrator(
        self,
        integrator: PartLike,
        *,
        time_step_factor: float | None = None,
        time_step: float | None = None,
        **parameters: Any,
    ) -> Self:
        """Choose the integrator, and the step as a factor of the CFL step or in seconds."""
        self._values["integrator"] = _part(integrator, parameters)
        if time_step_factor is not None:
            self._values["time_step_factor"] = time_step_factor
        if time_step is not None:
            self._values["time_step"] = time_step
        return self

    def statics(
        self, *, load_steps: int = 1, tolerance: float = 1e-9, max_iterations: int = 25
    ) -> Self:
        """Find the equilibrium under the loads at the end of the duration, instead of a motion."""
        self._values["statics"] = StaticsScene(load_steps, tolerance, max_iterations)
        return self

    def sleep(self, *, tolerance: float = 1e-9, slabs: int = 160) -> Self:
        """Let regions sleep that nothing has reached, or that have come to rest."""
        self._values["sleep"] = SleepScene(tolerance, slabs)
        return self

    def duration(self, duration: float) -> Self:
        """How long to simulate [s]."""
        self._values["duration"] = duration
        return self

    def outputs(self, count: int) -> Self:
        """How many states to record after the first."""
        self._values["outputs"] = count
        return self

    def engine(self, engine: PartLike, **parameters: Any) -> Self:
        """Which engine carries out the sums; "auto" chooses."""
        self._values["engine"] = _part(engine, parameters) if parameters else engine
        return self

    def energy_tolerance(self, tolerance: float | Literal["off"]) -> Self:
        """How large the energy residual may be, over the energy in play, for a run to be sound."""
        self._values["energy_tolerance"] = tolerance
        return self

    def silence(self, *names: str) -> Self:
        """Warnings that are not to be shown, by the names that `solidsph explain` gives them."""
        self._values["silence"] = (*self._values.get("silence", ()), *names)
        return self

    def scene(self) -> Scene:
        """What has been said so far, as data.

        Raises:
            BuildError: no body or no duration was given.
        """
        problems = []
        if not self._bodies:
            problems.append("there is no body; add one with .body(name, shape=..., spacing=...)")
        if "duration" not in self._values:
            problems.append("there is no duration; add .duration(seconds)")
        if problems:
            raise BuildError(problems)
        return Scene(
            bodies=self._bodies,
            boundaries=tuple(self._boundaries),
            effects=tuple(self._effects),
            initial=tuple(self._initial),
            **self._values,
        )

    @abstractmethod
    def build(self) -> object:
        """Make every part, check every pair of them, and assemble the simulation."""


def _part(part: PartLike, parameters: Mapping[str, Any]) -> PartLike:
    if isinstance(part, str):
        return {"type": part, **parameters}
    if isinstance(part, Mapping):
        return {**part, **parameters}
    if parameters:
        raise SceneError(
            f"parameters {', '.join(parameters)} given beside the object {part!r}; set them on it"
        )
    return part

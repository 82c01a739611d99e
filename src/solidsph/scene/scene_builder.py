"""SceneBuilder: a scene specified by method calls."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any, Literal, Self

import attrs

from solidsph.errors import BuildError, SceneError
from solidsph.model.fields import Component
from solidsph.model.regions import EVERYWHERE, Where
from solidsph.scene.scene import Scene
from solidsph.scene.scene_data import (
    DURATION_OF_EQUILIBRIA,
    BodyScene,
    ImposedScene,
    InitialScene,
    PartLike,
    ProbeScene,
    SleepScene,
    StaticsScene,
)
from solidsph.scene.static_solver import AUTOMATIC


class SceneBuilder(ABC):
    """Builder of a scene. Every method returns the builder.

    The parameters of a part that is given by name follow as keywords. A part object may replace
    its name.
    """

    def __init__(self, scene: Scene | None = None) -> None:
        self._values: dict[str, Any] = {}
        if scene is not None:
            self._values = {f.name: getattr(scene, f.name) for f in attrs.fields(Scene)}

    def title(self, title: str) -> Self:
        """Describe the scene in one line."""
        return self._set(title=title)

    def body(
        self,
        name: str,
        *,
        shape: PartLike,
        spacing: float | str | Mapping[str, Any],
        discretisation: PartLike | None = None,
        material: PartLike | None = None,
        tags: Mapping[str, Where] | None = None,
        refine: Sequence[Mapping[str, Any]] = (),
    ) -> Self:
        """Add a body; `spacing` in metres, `tags` name sets of its particles.

        The spacing may be a formula of X, Y and Z; `{"file": path}`, a list of places and
        spacings; or "given" by the particles themselves. Each entry of `refine` is a mapping with
        `where`, a face or a condition, the `spacing` there, and the distance `over` which that of
        the body returns; or with `by`, "curvature" and its `angle` [degrees] or "thickness" and a
        number `across`, and the `least` spacing, maybe `over`.
        """
        bodies = self._values.get("bodies", {})
        if name in bodies:
            raise SceneError(f"two bodies are called {name!r}; give each its own name")
        body = BodyScene(
            shape, spacing, discretisation, material, dict(tags or {}), tuple(map(dict, refine))
        )
        return self._set(bodies={**bodies, name: body})

    def scheme(self, scheme: str) -> Self:
        """Choose the scheme, which names the parts that the scene does not."""
        return self._set(scheme=scheme)

    def kernel(self, kernel: PartLike, *, cover: float | None = None, **parameters: Any) -> Self:
        """Choose the kernel and its cover, the support radius in particle spacings."""
        return self._set(kernel=_part(kernel, parameters))._set_given(cover=cover)

    def material(self, material: PartLike, **parameters: Any) -> Self:
        """Choose the material of every body that has none of its own."""
        return self._set(material=_part(material, parameters))

    def formulation(self, formulation: PartLike, **parameters: Any) -> Self:
        """Choose the formulation, with its gradient and divergence."""
        return self._set(formulation=_part(formulation, parameters))

    def boundary(self, boundary: PartLike, *, label: str | None = None, **parameters: Any) -> Self:
        """Add a boundary handler; `label` names its account."""
        return self._append("boundaries", ImposedScene(_part(boundary, parameters), label))

    def effect(self, effect: PartLike, *, label: str | None = None, **parameters: Any) -> Self:
        """Add an effect; `label` names its account."""
        return self._append("effects", ImposedScene(_part(effect, parameters), label))

    def initial(
        self,
        *,
        where: Where = EVERYWHERE,
        displacement: Mapping[str, Component] | None = None,
        velocity: Mapping[str, Component] | None = None,
    ) -> Self:
        """Set initial displacement [m] and velocity [m/s]; a later call overrides."""
        return self._append("initial", InitialScene(where, displacement, velocity))

    def probe(
        self,
        *,
        label: str,
        quantity: str,
        point: Sequence[float] | None = None,
        line: Mapping[str, Any] | None = None,
        where: Where | None = None,
        account: str | None = None,
        about: Sequence[float] | None = None,
        body: str | None = None,
    ) -> Self:
        """Add a measurement; its columns of the history begin with `label`."""
        entry = ProbeScene(label, quantity, point, line, where, account, about, body)
        return self._append("probes", entry)

    def integrator(
        self,
        integrator: PartLike | None = None,
        *,
        time_step_factor: float | None = None,
        time_step: float | None = None,
        **parameters: Any,
    ) -> Self:
        """Choose the integrator, and the step as a factor of the critical step or in seconds.

        Without an integrator it is that of the scheme.
        """
        if integrator is not None:
            self._set(integrator=_part(integrator, parameters))
        return self._set_given(time_step_factor=time_step_factor, time_step=time_step)

    def statics(
        self,
        *,
        load_steps: int | None = None,
        tolerance: float = 1e-9,
        max_iterations: int = 25,
        solver: str = AUTOMATIC,
    ) -> Self:
        """Find the equilibrium under the loads at the end of the duration, instead of a motion."""
        return self._set(statics=StaticsScene(load_steps, tolerance, max_iterations, solver))

    def sleep(self, *, tolerance: float = 1e-9, slabs: int = 160) -> Self:
        """Do not step regions that no wave has reached, or that have come to rest."""
        return self._set(sleep=SleepScene(tolerance, slabs))

    def duration(self, duration: float) -> Self:
        """Set the simulated time [s]; with `statics` it is 1 s unless given."""
        return self._set(duration=duration)

    def outputs(self, count: int) -> Self:
        """Set the number of recorded states after the first."""
        return self._set(outputs=count)

    def engine(self, engine: PartLike, **parameters: Any) -> Self:
        """Choose the engine that evaluates the sums over neighbours; "auto" chooses by size."""
        return self._set(engine=_part(engine, parameters) if parameters else engine)

    def energy_tolerance(self, tolerance: float | Literal["off"]) -> Self:
        """Set the largest energy residual of a sound run, as a fraction of the energy in play."""
        return self._set(energy_tolerance=tolerance)

    def silence(self, *names: str) -> Self:
        """Suppress warnings by the names that `solidsph explain` lists."""
        return self._set(silence=(*self._values.get("silence", ()), *names))

    def scene(self) -> Scene:
        """The scene as data.

        Raises:
            BuildError: the scene has no body or no duration.
        """
        problems = []
        if not self._values.get("bodies"):
            problems.append("there is no body; add one with .body(name, shape=..., spacing=...)")
        if not {"duration", "statics"} & set(self._values):
            problems.append("there is no duration; add .duration(seconds)")
        if problems:
            raise BuildError(problems)
        return Scene(**{"duration": DURATION_OF_EQUILIBRIA, **self._values})

    @abstractmethod
    def build(self) -> object:
        """Make every part, check that the parts fit each other, and assemble the simulation."""

    def _set(self, **values: Any) -> Self:
        self._values |= values
        return self

    def _set_given(self, **values: Any) -> Self:
        return self._set(**{name: value for name, value in values.items() if value is not None})

    def _append(self, name: str, entry: object) -> Self:
        return self._set(**{name: (*self._values.get(name, ()), entry)})


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

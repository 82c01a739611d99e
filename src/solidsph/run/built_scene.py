"""BuiltScene: a checked scene in discrete form."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from math import ceil
from pathlib import Path
from typing import TYPE_CHECKING, Self

import attrs
import numpy as np
import pluggy
from numpy.typing import ArrayLike

from solidsph.errors import BuildError, DivergedError, SceneError
from solidsph.interfaces.boundary import BoundaryHandler
from solidsph.interfaces.discrete_model import DiscreteModel
from solidsph.interfaces.effect import Effect
from solidsph.interfaces.engine import Engine
from solidsph.interfaces.history import HistoryMaterial
from solidsph.interfaces.integrator import Integrator
from solidsph.interfaces.plan import Plan
from solidsph.interfaces.terms import Load, Observation, Term
from solidsph.model.particles import Particles, State, read_only
from solidsph.registry.registry import Entry
from solidsph.run.dynamics import Dynamics
from solidsph.run.outcome import Result
from solidsph.run.restart_point import RestartPoint
from solidsph.run.safe_step import SafeStep
from solidsph.scene.scene import Scene
from solidsph.scene.scene_data import PartLike
from solidsph.scene.scheme import completed
from solidsph.scene.static_solver import load_steps
from solidsph.system import html

if TYPE_CHECKING:
    from solidsph.probes.values import Values


@attrs.frozen(eq=False, repr=False)
class BuiltScene(ABC):
    """Everything that a run needs. A run does not change it, so it can be repeated."""

    scene: Scene
    model: DiscreteModel
    dynamics: Dynamics
    terms: Sequence[Term]
    handlers: Mapping[str, BoundaryHandler]
    effects: Mapping[str, Effect]
    integrator: Integrator
    engine: Engine
    initial: State
    steps: int
    parts: tuple[Entry, ...]  # every plugin used
    manager: pluggy.PluginManager
    halvings: int = 0  # of the step of the scene
    probes: Sequence[Term] = ()  # which only report
    safe: SafeStep | None = None  # at the start; None if nothing vibrates, or nothing moves

    @abstractmethod
    def run(
        self,
        *,
        record: Path | str | None = None,
        observers: Sequence[object] = (),
        since: RestartPoint | None = None,
        progress: bool | None = None,
    ) -> Result:
        """Find the equilibrium if the scene has [statics], else follow the motion."""

    def halved(self) -> Self:
        """A copy with half the step."""
        dynamics = attrs.evolve(self.dynamics, step_size=0.5 * self.step_size)
        halvings = self.halvings + 1
        return attrs.evolve(self, dynamics=dynamics, steps=2 * self.steps, halvings=halvings)

    @property
    def particles(self) -> Particles:
        """The reference configuration."""
        return self.dynamics.particles

    @property
    def step_size(self) -> float:
        """Time step [s]."""
        return self.dynamics.step_size

    @property
    def remembers(self) -> bool:
        """True if a material has internal variables."""
        return any(isinstance(body.material, HistoryMaterial) for body in self.model.bodies)

    @property
    def load_steps(self) -> int:
        """Load steps that an equilibrium begins with."""
        statics = self.scene.statics
        return load_steps(statics.load_steps if statics else None, remembers=self.remembers)

    def start(self) -> State:
        """Initial state with imposed motions, accelerations and accounts."""
        positions = self.dynamics.place(self.initial.time, self.initial.positions)
        velocities = self.dynamics.carry(self.initial.time, self.initial.velocities)
        state = attrs.evolve(self.initial, positions=positions, velocities=velocities)
        with np.errstate(all="ignore"):  # as in the steps that follow
            return self.integrator.start(state, self.dynamics, self.step_size)

    @property
    def plan(self) -> Plan:
        """How the engine would compute the motion, by the kinds of the parts."""
        return self.dynamics.internal.plan(self.dynamics, self.integrator)

    def load_of(self, effect: str) -> Load:
        """Bound load of the effect with the label `effect`."""
        (load,) = (load for load in self.dynamics.loads if load.label == effect)
        return load

    def extended(self, steps: int) -> Self:
        """A copy that runs `steps` steps in total, with the same step size and earlier outputs.

        Raises:
            SceneError: the scene has more steps.
        """
        if steps < self.steps:
            raise SceneError(f"{steps} steps in total are fewer than the {self.steps} of the scene")
        return attrs.evolve(self, steps=steps)

    def output_steps(self) -> tuple[int, ...]:
        """Steps at which the state is observed: evenly spaced, the last included."""
        # In steps of the original size, so that halving them changes no time.
        size = 2**self.halvings
        original, steps = round(self.scene.duration / self.step_size) // size, self.steps / size
        count = min(self.scene.outputs, original)
        marks = np.linspace(0, original, count + 1)[1:]
        if steps > original:  # extended
            interval = original / count
            further = np.arange(count + 1, ceil(steps / interval)) * interval
            marks = np.concatenate([marks, further])
        whole = np.append(size * np.rint(marks).astype(np.int64), self.steps)
        return tuple(int(step) for step in np.unique(whole) if step <= self.steps)

    def observe(self, state: State) -> Observation:
        """Observation of a state.

        Raises:
            DivergedError: a volume has vanished or turned inside out.
        """
        observation = self.dynamics.observe(read_only(state))
        inverted = ~(observation.volume_ratios > 0.0) & ~self.particles.ghosts
        if inverted.any():
            raise self.diverged(state, "the volume has vanished or turned inside out")
        return observation

    def values_at(self, state: State, points: ArrayLike, body: str | None = None) -> Values:
        """Displacement, velocity, F and stress of a state at any points of the reference bodies.

        Args:
            state: of this scene.
            points: reference positions, (m, d) or (d,) [m].
            body: the body, where several touch; the one in which a point is deepest if None.

        Raises:
            SceneError: a point lies outside of every body.
        """
        from solidsph.probes.values import cauchy_stress, values_at  # loaded only when asked for

        return values_at(
            {own.name: own.shape for own in self.model.bodies},
            self.particles,
            points,
            body,
            positions=state.positions,
            velocities=state.velocities,
            stress=lambda chosen: cauchy_stress(self.dynamics.observe(state), chosen),
        )

    def __repr__(self) -> str:
        title = f"{self.scene.title!r}: " if self.scene.title else ""
        steps = "an equilibrium" if self.scene.statics else f"{self.steps} steps"
        return f"{type(self).__name__}({title}{self.particles.count} particles, {steps})"

    def _repr_html_(self) -> str:
        """Table for notebooks."""
        scene, statics = completed(self.scene), self.scene.statics
        acting = [entry.label or _name(entry.part) for entry in (*scene.boundaries, *scene.effects)]
        own = [body.material or scene.material for body in scene.bodies.values()]
        materials = dict.fromkeys(_name(material) for material in own)
        known = {
            "particles": self.particles.count,
            "dimensions": self.particles.dimension,
            "kernel": _name(scene.kernel),
            "material": ", ".join(materials),
            "formulation": _name(scene.formulation),
            "boundaries and effects": ", ".join(acting) or "none",
            "probes": ", ".join(probe.label for probe in self.probes) or "none",
            "engine": _name(scene.engine),
        }
        if statics is None:
            known |= {"duration [s]": scene.duration, "steps": self.steps}
            known |= {"step size [s]": self.step_size, "outputs": len(self.output_steps())}
        else:
            known |= {"load steps": self.load_steps}
        spacings = self.particles.spacings
        bodies = [
            {
                "body": name,
                "shape": _name(body.shape),
                "spacing [m]": spacings[place].min(),
                "particles": place.stop - place.start,
            }
            for (name, body), place in zip(
                scene.bodies.items(), self.particles.bodies.values(), strict=True
            )
        ]
        title = scene.title or "Simulation"
        return html.heading(title) + html.of_rows(bodies) + html.of_values(known)

    def diverged(self, state: State, cause: str) -> DivergedError:
        """The error of a motion that cannot continue from `state`, after the hook of failures."""
        try:
            with np.errstate(all="ignore"):
                J = np.linalg.det(self.dynamics.observe(state).deformation_gradients)
        except (BuildError, ValueError):  # at such positions nothing may have neighbours
            J = np.full(self.particles.count, np.nan)
        real = np.flatnonzero(~self.particles.ghosts)
        finite = np.isfinite(J[real])
        # The first particle whose volume ratio is not finite, or else the most compressed one.
        worst = real[np.argmin(finite)] if not finite.all() else real[np.argmin(J[real])]
        error = DivergedError(
            step=state.step,
            time=state.time,
            particle=int(worst),
            volume_ratio=float(J[worst]),
            cause=cause,
        )
        self.manager.hook.solidsph_failure(simulation=self, state=state, error=error)
        return error


def _name(part: PartLike | None) -> str:
    """Name of a part, as a scene gives it."""
    if isinstance(part, Mapping):
        return str(part.get("type", ""))
    return part if isinstance(part, str) else type(part).__name__

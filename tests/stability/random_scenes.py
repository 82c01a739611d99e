"""Small bodies in motion, of parts drawn from the registry, and whether they stay bounded."""

from __future__ import annotations

import warnings
from collections import Counter
from collections.abc import Mapping, Sequence
from math import sqrt
from random import Random
from typing import Any, final

import attrs
import numpy as np
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from solidsph import Simulation
from solidsph.errors import BuildError, DivergedError, SceneError
from solidsph.interfaces.terms import EnergyTerm, Observation
from solidsph.registry import registry
from solidsph.run.energy import kinetic_energy, strain_energy
from solidsph.run.hooks import implementation
from solidsph.scene.scene_builder import SceneBuilder

STEPS = 200
REFUSED, BOUNDED = "refused", "bounded"

# Leapfrog's energy swings: where a step is 0.8 of the critical one, by 1 / (1 - 0.8^2) in the
# fastest motion. What is unstable is beyond any number in so many steps.
LARGEST = 3.0

# Of the modulus: strains that rounding makes, squared.
ROUNDING = 1e-20

_ANGLE = [[0.0, 0.0], [1.0, 0.0], [1.0, 0.4], [0.4, 0.4], [0.4, 1.0], [0.0, 1.0]]

SHAPES: Mapping[int, Sequence[tuple[Mapping[str, Any], float]]] = {
    1: [({"type": "interval", "length": 1.0}, 1.0 / 60.0)],
    2: [
        ({"type": "box", "lengths": [1.0, 0.6]}, 0.08),
        ({"type": "disc", "radius": 0.5, "centre": [0.5, 0.5]}, 0.09),
        (
            {
                "type": "polygon",
                "vertices": [[0, 0], [1, 0], [1, 0.4], [0.4, 0.4], [0.4, 1], [0, 1]],
            },
            0.08,
        ),
    ],
    3: [
        ({"type": "box", "lengths": [1.0, 0.7, 0.7]}, 0.17),
        ({"type": "ball", "radius": 0.5, "centre": [0.5, 0.5, 0.5]}, 0.17),
    ],
}
"""Bodies and spacings [m] by dimension: 60 to 300 particles."""

# Its forces are no derivative of an energy: beside a surface and among scattered particles some
# motions grow at any step, by a rate that does not depend on it.
_UNSTABLE = ("plain",)

# Those that act between bodies, and those whose examples suit another body than these.
_BETWEEN = ("contact", "joint")
_OWN_VALUES: Mapping[str, Mapping[str, Any]] = {
    "rigid-wall": {"point": {"x": -0.01}, "normal": {"x": 1.0}},
    "heat": {
        "conductivity": 50.0,
        "heat_capacity": 500.0,
        "expansion": 1e-4,
        "initial": "10*sin(4*X)",
    },
    "bond-failure": {"critical_stretch": 0.05},
}

# What drives a body, so that its work is put in; all others only store, pass on or take away.
_DRIVES = ("body-force", "heat")


@final
@attrs.frozen
class Words:
    """A scene in words."""

    seed: int  # that it was drawn from
    dimension: int
    shape: Mapping[str, Any]
    spacing: float  # [m]
    discretisation: Any
    kernel: str
    cover: float  # [spacings]
    gradient: Any
    divergence: str
    material: Mapping[str, Any]
    effects: Sequence[Mapping[str, Any]]
    integrator: str
    held: bool
    speed: float  # in speeds of the slowest wave
    waves: int  # half waves along the body

    @property
    def slowest(self) -> float:
        """Speed of shear waves over that of pressure waves [-]; 1 where neither is known.

        At a Poisson's ratio of 0.4999 it is 1/71: at three hundredths of the fastest wave a body
        would be strained by 2, which turns laws of finite energy at J = 0 inside out at any step.
        """
        nu = self.material.get("poissons_ratio")
        return 1.0 if nu is None else sqrt((1.0 - 2.0 * nu) / (2.0 * (1.0 - nu)))

    def scene(self, duration: float, speed: float, step: Mapping[str, float]) -> SceneBuilder:
        """The scene; `speed` of its particles in m/s, `step` in words of the integrator."""
        axes = "xyz"[: self.dimension]
        phases = {axis: f"{speed!r}*sin({self.waves}*pi*X + {k})" for k, axis in enumerate(axes)}
        builder = (
            Simulation.builder()
            .body(
                "body",
                shape=self.shape,
                spacing=self.spacing,
                discretisation=self.discretisation,
            )
            .kernel(self.kernel, cover=self.cover)
            .formulation("total-lagrangian", gradient=self.gradient, divergence=self.divergence)
            .material(self.material)
            .integrator(self.integrator, **step)
            .initial(velocity=phases)
            .energy_tolerance("off")  # it is judged here
            .duration(duration)
            .outputs(20)
        )
        for effect in self.effects:
            builder = builder.effect(effect, label=effect["type"])
        if self.held:
            builder = builder.boundary("clamp", where=f"X < {1.2 * self.spacing!r}")
        return builder


def words() -> st.SearchStrategy[Words]:
    """Any combination of parts, each as likely as any other.

    Hypothesis draws one number: drawn one by one, most parts would be the first of their kind.
    """
    return st.integers(0, 2**64 - 1).map(drawn)


def drawn(seed: int) -> Words:
    """One combination of parts."""
    rng = Random(seed)
    d = rng.choice((1, 2, 3))
    shape, spacing = rng.choice(SHAPES[d])
    effects = [name for name in registry.names("effects") if name not in _BETWEEN]
    return Words(
        seed=seed,
        dimension=d,
        shape=shape,
        spacing=spacing,
        discretisation=_discretisation(rng, d),
        kernel=rng.choice(registry.names("kernels")),
        cover=rng.randint(15, 55) / 10.0,
        gradient=rng.choice(registry.names("gradients")),
        divergence=rng.choice([n for n in registry.names("divergences") if n not in _UNSTABLE]),
        material=_material(rng),
        effects=[_example("effects", name) for name in rng.sample(effects, rng.randint(0, 2))],
        integrator=rng.choice(registry.names("integrators")),
        held=rng.random() < 0.5,
        speed=rng.choice((0.001, 0.01, 0.03)),
        waves=rng.randint(0, 3),
    )


def _discretisation(rng: Random, dimension: int) -> Any:
    """In rows, fitted to the body, jittered."""
    rows: list[Any] = ["lattice", {"type": "lattice", "on_boundary": True}]
    if dimension > 1:
        rows.append("conforming-lattice")
    chosen = rng.choice(rows)
    if rng.random() < 0.5:
        amplitude, seed = rng.choice((0.05, 0.15, 0.3)), rng.randint(0, 99)
        chosen = {"type": "jittered", "of": chosen, "amplitude": amplitude, "seed": seed}
    return {"type": "fitted-moments", "of": chosen} if rng.random() < 0.5 else chosen


def _material(rng: Random) -> Mapping[str, Any]:
    """Any material, by its example; where it has Poisson's ratio, also nearly incompressible."""
    table = dict(_example("materials", rng.choice(registry.names("materials"))))
    if "poissons_ratio" in table:
        table["poissons_ratio"] = rng.choice((0.0, 0.3, 0.49, 0.4999))
    return table


def _example(kind: str, name: str) -> Mapping[str, Any]:
    own = _OWN_VALUES.get(name, registry.load(kind, name).example)
    return {"type": name, **own}


@attrs.define
class Ledger:
    """The most energy there was, over what was there at the start and has been put in since."""

    drives: Sequence[str]
    least: float = 0.0  # energy that is rounding [J]
    put_in: float = 0.0  # [J]
    worst: float = 0.0
    when: int = 0  # step of the worst

    @implementation
    def solidsph_step_end(self, simulation: Simulation, observation: Observation) -> None:
        with np.errstate(all="ignore"):
            self._add(simulation, observation)

    def _add(self, simulation: Simulation, observation: Observation) -> None:
        stores = [term for term in simulation.terms if isinstance(term, EnergyTerm)]
        energy = kinetic_energy(observation) + strain_energy(observation)
        energy += sum(float(np.sum(term.energies(observation))) for term in stores)
        if observation.state.step == 0:
            self.put_in = energy + self.least
        work = observation.state.work
        driven = sum(max(0.0, work.get(name, 0.0)) for name in self.drives)
        share = energy / (self.put_in + driven)
        if not share <= self.worst:  # also where it is no number
            self.worst, self.when = share, observation.state.step


def outcome(scene: Words, **step: float) -> str:
    """REFUSED at the build, BOUNDED, or what went wrong.

    Args:
        step: words of the integrator; the default step without any.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # a part may say that it suits no scene
        try:
            trial = scene.scene(1.0, 0.0, step).build()
            body = trial.model.bodies[0]
            # The step is that of the scene; the speed is in speeds of its own slowest waves.
            speed = scene.speed * scene.slowest * body.material.wave_speed
            simulation = scene.scene(STEPS * trial.step_size, speed, step).build()
        except (BuildError, SceneError):
            return REFUSED
        modulus = float(body.masses.sum()) * body.material.wave_speed**2
        ledger = Ledger(_DRIVES, least=ROUNDING * modulus)
        try:
            simulation.run(observers=[ledger])
        except DivergedError as failure:
            return f"diverged at step {failure.step}: {failure.cause}"
    if ledger.worst <= LARGEST:
        return BOUNDED
    return f"{ledger.worst:.3g} times the energy put in at step {ledger.when}"


def campaign(count: int) -> tuple[Counter[str], list[str]]:
    """Outcomes of so many scenes, and what to know of each that is neither bounded nor refused."""
    counts: Counter[str] = Counter()
    wrong: list[str] = []

    # Scenes are small as they are: to make those that fail smaller would take the longest.
    @settings(max_examples=count, phases=[Phase.generate], database=None)
    @given(words())
    def tried(scene: Words) -> None:
        found = outcome(scene)
        counts[found if found in (REFUSED, BOUNDED) else "wrong"] += 1
        if found not in (REFUSED, BOUNDED):
            wrong.append(f"{found}: {scene}")

    tried()
    return counts, wrong

"""What each effect and material costs: a step with it over a step without, in one run.

    python benchmarks/effects.py                       8 000 particles in 3D, some minutes
    python benchmarks/effects.py --particles 100000 heat contact

A block on a lattice, clamped at one end and thrown to the side, by the compiled engine on one
thread. Each scene runs some steps first, which compile, and then takes turns with the plain one;
processor time. The last column is what a step may cost at most, and what costs more is told below.
"""

from __future__ import annotations

import argparse
import sys
import time
import warnings
from collections.abc import Callable, Mapping
from statistics import median
from typing import Any

import attrs
import numba
from table import Table

from solidsph import Simulation, SolidsphError
from solidsph.scene.scene_builder import SceneBuilder
from solidsph.testing.examples import example_part

REPEATS = 5
RUBBER = {"youngs_modulus": 1e6, "poissons_ratio": 0.3, "density": 1e3}

# Steps before those that are timed, and time of a sample [s].
WARM, SAMPLE = 20, 0.4


# Speed of the end of a block that is drawn out [m/s].
_PULL = 0.3

Addition = Callable[[SceneBuilder, float], SceneBuilder]
"""What is added to the plain block, of a spacing [m]."""


@attrs.frozen
class Scene:
    """A block with something added, and the most that its step may cost."""

    add: Addition
    most: float


def _effect(name: str, **parameters: Any) -> Addition:
    return lambda builder, spacing: builder.effect(name, **parameters)


def _material(name: str, **changed: Any) -> Addition:
    """With the values that the part holds for `solidsph check`, some of them changed."""
    law = attrs.evolve(example_part("materials", name), **changed)
    return lambda builder, spacing: builder.material(law)


def _pressed(builder: SceneBuilder, spacing: float) -> SceneBuilder:
    return builder.boundary("pressure", where="right", pressure=10.0)


def _apart(builder: SceneBuilder, spacing: float) -> SceneBuilder:
    """Another block, of eight particles, that nothing meets."""
    small = {"type": "box", "lengths": [2.0 * spacing] * 3, "origin": [5.0, 5.0, 5.0]}
    return builder.body("small", shape=small, spacing=spacing).effect("contact")


def _touching(friction: float) -> Addition:
    """Another block of the same size, against whose side it is thrown."""
    other = {"type": "box", "lengths": [1.0, 1.0, 1.0], "origin": [0.0, 1.0, 0.0]}
    return lambda builder, spacing: builder.body("other", shape=other, spacing=spacing).effect(
        "contact", friction=friction
    )


def _drawn(law: str) -> Addition:
    """Drawn out so fast, of a metal so soft, that nearly all particles flow in every step."""
    material = _material(law, yield_stress=10.0)
    return lambda builder, spacing: (
        material(builder, spacing)
        .boundary("prescribed-motion", where="right", displacement={"x": f"{_PULL:g}*t"})
        .initial(where="block", velocity={"x": f"{_PULL:g}*X"})
    )


def _breaking(builder: SceneBuilder, spacing: float) -> SceneBuilder:
    """Stretched ever faster towards the right, where bonds fail in every step."""
    return builder.effect("bond-failure", critical_stretch=0.02).initial(
        where="block", velocity={"x": "0.5*X*X"}
    )


PLAIN = "plain"
SCENES: Mapping[str, Scene] = {
    PLAIN: Scene(lambda builder, spacing: builder, 1.0),
    "mooney-rivlin": Scene(_material("mooney-rivlin"), 1.2),
    "holzapfel-ogden": Scene(_material("holzapfel-ogden"), 1.5),
    "viscoelastic": Scene(_material("viscoelastic"), 1.5),
    "j2-plasticity, elastic": Scene(_material("j2-plasticity"), 1.8),
    "j2-plasticity, flowing": Scene(_drawn("j2-plasticity"), 1.8),
    "johnson-cook, elastic": Scene(_material("johnson-cook"), 2.5),
    "johnson-cook, flowing": Scene(_drawn("johnson-cook"), 2.5),
    "body-force": Scene(_effect("body-force", acceleration={"z": -9.81}), 1.05),
    "mass-damping": Scene(_effect("mass-damping", rate=1.0), 1.05),
    "dynamic-relaxation": Scene(_effect("dynamic-relaxation"), 1.1),
    "rigid-wall far away": Scene(_effect("rigid-wall", normal={"z": 1.0}, point={"z": -5.0}), 1.05),
    "pressure": Scene(_pressed, 1.1),
    "hourglass-control": Scene(_effect("hourglass-control"), 1.6),
    "artificial-viscosity": Scene(_effect("artificial-viscosity"), 1.6),
    "heat": Scene(_effect("heat", conductivity=1.0, heat_capacity=1e3), 1.8),
    "kelvin-voigt": Scene(_effect("kelvin-voigt", time=1e-5), 1.7),
    "bond-failure": Scene(_effect("bond-failure", critical_stretch=0.5), 2.0),
    "bond-failure, failing": Scene(_breaking, 2.0),
    "contact, apart": Scene(_apart, 1.05),
    "contact": Scene(_touching(0.0), 1.3),
    "contact with friction": Scene(_touching(0.3), 1.4),
}


def built(scene: Scene, particles: int) -> Simulation:
    side = round(particles ** (1.0 / 3.0))
    spacing = 1.0 / side
    builder = (
        Simulation.builder()
        .scheme("corrected")
        .body("block", shape={"type": "box", "lengths": [1.0, 1.0, 1.0]}, spacing=spacing)
        .material("neo-hookean", **RUBBER)
        .boundary("clamp", where="left")
        .initial(where="block", velocity={"y": "0.1*X"})
        .engine("compiled")
        .duration(1e3)
    )
    return scene.add(builder, spacing).build()


@attrs.define(slots=False)
class Runner:
    """A simulation that goes on from sample to sample."""

    simulation: Simulation
    steps: int = 1  # a sample
    samples: list[float] = attrs.field(factory=list)  # processor time of a step and particle [s]

    def __attrs_post_init__(self) -> None:
        self.loop = self.simulation.time_loop()
        self.state = self.simulation.start()
        self._timed(WARM)
        self.steps = max(WARM, int(SAMPLE / self._timed(WARM)))

    def sample(self) -> None:
        self.samples.append(self._timed(self.steps) / self.simulation.particles.count)

    def _timed(self, steps: int) -> float:
        started = time.process_time()
        self.state = self.loop.advance(self.state, self.state.step + steps)
        return (time.process_time() - started) / steps


def row(name: str, particles: int, plain: Runner) -> tuple[str, ...]:
    scene = SCENES[name]
    try:
        runner = Runner(built(scene, particles))
        for _ in range(REPEATS):
            plain.sample()
            runner.sample()
    except SolidsphError as failure:
        return name, str(failure).split("\n")[0], "", ""
    own, usual = (median(one.samples[-REPEATS:]) for one in (runner, plain))
    return name, f"{1e9 * own:.0f}", f"{own / usual:.2f}", f"{scene.most:g}"


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("scenes", nargs="*", default=list(SCENES), metavar="SCENE")
    parser.add_argument("--particles", type=int, default=8000)
    wanted = parser.parse_args()
    warnings.simplefilter("ignore", UserWarning)
    numba.set_num_threads(1)
    plain = Runner(built(SCENES[PLAIN], wanted.particles))
    found = []
    for name in wanted.scenes:
        found.append(row(name, wanted.particles, plain))
        print(*found[-1], file=sys.stderr, flush=True)
    columns = ("scene", "ns a particle and step", "times the plain step", "at most")
    print(
        Table(f"Effects and materials, {wanted.particles} particles", columns, tuple(found)).text()
    )
    over = [name for name, _, times, most in found if times and float(times) > float(most)]
    print(f"\nAbove what they may cost: {', '.join(over) or 'none'}")


if __name__ == "__main__":
    main()

"""What each effect and material costs: a step with it over a step without, in one run.

    python benchmarks/effects.py                       8 000 particles in 3D, some minutes
    python benchmarks/effects.py --particles 100000 heat contact
    python benchmarks/effects.py --dimension 2 --threads 2

A block on a lattice, clamped at one end and thrown to the side, by the compiled engine. Each scene
runs some steps first, which compile, and then takes turns with the plain one: processor time of one
thread, or time on the wall of more. The last column is what a step may cost at most, and what costs
more is told below.
"""

from __future__ import annotations

import argparse
import sys
import time
import warnings
from collections.abc import Callable, Mapping
from functools import cache
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


@attrs.frozen
class Block:
    """The body that something is added to."""

    dimension: int
    spacing: float  # [m]

    def box(self, size: float, origin: float, along: float | None = None) -> dict[str, Any]:
        """A cube or square of a `size`, at an `origin` along all axes, or `along` the first [m]."""
        first = origin if along is None else along
        return {
            "type": "box",
            "lengths": [size] * self.dimension,
            "origin": [first, *[origin] * (self.dimension - 1)],
        }

    def beside(self) -> dict[str, Any]:
        """Another block of the same size, on the side to which the block is thrown."""
        return {**self.box(1.0, 0.0), "origin": [0.0, 1.0, 0.0][: self.dimension]}


Addition = Callable[[SceneBuilder, Block], SceneBuilder]
"""What is added to the plain block."""


def _nothing(builder: SceneBuilder, block: Block) -> SceneBuilder:
    return builder


@attrs.frozen
class Scene:
    """A block with something added, and the most that its step may cost."""

    add: Addition
    most: float
    beside: Addition = _nothing  # what its price is measured against


def _effect(name: str, **parameters: Any) -> Addition:
    return lambda builder, block: builder.effect(name, **parameters)


def _material(name: str, **changed: Any) -> Addition:
    """With the values that the part holds for `solidsph check`, some of them changed."""
    law = attrs.evolve(example_part("materials", name), **changed)
    return lambda builder, block: builder.material(law)


def _pressed(builder: SceneBuilder, block: Block) -> SceneBuilder:
    return builder.boundary("pressure", where="right", pressure=10.0)


def _disordered(builder: SceneBuilder, block: Block) -> SceneBuilder:
    (body,) = (scene := builder.scene()).bodies.values()
    jittered = {"type": "jittered-lattice", "amplitude": 0.2, "seed": 1}
    body = attrs.evolve(body, discretisation=jittered)
    return Simulation.builder(attrs.evolve(scene, bodies={"block": body}))


def _apart(builder: SceneBuilder, block: Block) -> SceneBuilder:
    """Another block, of a few particles, that nothing meets."""
    small = block.box(2.0 * block.spacing, 5.0)
    return builder.body("small", shape=small, spacing=block.spacing).effect("contact")


def _touching(friction: float) -> Addition:
    """Another block of the same size, against whose side it is thrown."""
    return lambda builder, block: _two_blocks(builder, block).effect("contact", friction=friction)


def _two_blocks(builder: SceneBuilder, block: Block) -> SceneBuilder:
    return builder.body("other", shape=block.beside(), spacing=block.spacing)


def _joined(builder: SceneBuilder, block: Block) -> SceneBuilder:
    return _two_blocks(builder, block).effect("joint")


def _balls(builder: SceneBuilder, block: Block) -> SceneBuilder:
    """Two more, of half the size, of which one flies into the other."""
    round_ = {"type": "disc" if block.dimension == 2 else "ball", "radius": 0.25}
    for name, away in (("first", 0.0), ("second", 0.5)):
        centre = [5.0 + away, *[5.0] * (block.dimension - 1)]
        builder = builder.body(name, shape={**round_, "centre": centre}, spacing=block.spacing)
    return builder.initial(where="first", velocity={"x": 0.1})


def _balls_in_contact(builder: SceneBuilder, block: Block) -> SceneBuilder:
    return _balls(builder, block).effect("contact", between=[["first", "second"]])


def _drawn(law: str) -> Addition:
    """Drawn out so fast, of a metal so soft, that nearly all particles flow in every step."""
    material = _material(law, yield_stress=10.0)
    return lambda builder, block: (
        material(builder, block)
        .boundary("prescribed-motion", where="right", displacement={"x": f"{_PULL:g}*t"})
        .initial(where="block", velocity={"x": f"{_PULL:g}*X"})
    )


def _breaking(builder: SceneBuilder, block: Block) -> SceneBuilder:
    """Stretched ever faster towards the right, where bonds fail in every step."""
    return builder.effect("bond-failure", critical_stretch=0.02).initial(
        where="block", velocity={"x": "0.5*X*X"}
    )


PLAIN = "plain"
SCENES: Mapping[str, Scene] = {
    PLAIN: Scene(_nothing, 1.0),
    "jittered particles": Scene(_disordered, 2.3),
    "joint": Scene(_joined, 1.2),
    "mooney-rivlin": Scene(_material("mooney-rivlin"), 1.2),
    "holzapfel-ogden": Scene(_material("holzapfel-ogden"), 1.5),
    "viscoelastic": Scene(_material("viscoelastic"), 1.5),
    "j2-plasticity, elastic": Scene(_material("j2-plasticity"), 1.8),
    "j2-plasticity, flowing": Scene(_drawn("j2-plasticity"), 1.8),
    "johnson-cook, elastic": Scene(_material("johnson-cook"), 2.5),
    "johnson-cook, flowing": Scene(_drawn("johnson-cook"), 2.5),
    "body-force": Scene(_effect("body-force", acceleration={"y": -9.81}), 1.05),
    "mass-damping": Scene(_effect("mass-damping", rate=1.0), 1.05),
    "dynamic-relaxation": Scene(_effect("dynamic-relaxation"), 1.1),
    "rigid-wall far away": Scene(_effect("rigid-wall", normal={"y": 1.0}, point={"y": -5.0}), 1.05),
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
    "contact with itself": Scene(_effect("contact", itself=["block"]), 1.3),
    "contact of balls": Scene(_balls_in_contact, 1.3, _balls),
}


def built(add: Addition, particles: int, dimension: int) -> Simulation:
    block = Block(dimension, 1.0 / round(particles ** (1.0 / dimension)))
    builder = (
        Simulation.builder()
        .scheme("corrected")
        .body("block", shape=block.box(1.0, 0.0), spacing=block.spacing)
        .material("neo-hookean", **RUBBER)
        .boundary("clamp", where="left")
        .initial(where="block", velocity={"y": "0.1*X"})
        .engine("compiled")
        .duration(1e3)
    )
    return add(builder, block).build()


@attrs.define(slots=False)
class Runner:
    """A simulation that goes on from sample to sample."""

    simulation: Simulation
    clock: Callable[[], float]
    steps: int = 1  # a sample
    samples: list[float] = attrs.field(factory=list)  # time of a step and particle [s]

    def __attrs_post_init__(self) -> None:
        self.loop = self.simulation.time_loop()
        self.state = self.simulation.start()
        self._timed(WARM)
        self.steps = max(WARM, int(SAMPLE / self._timed(WARM)))

    def sample(self) -> None:
        self.samples.append(self._timed(self.steps) / self.simulation.particles.count)

    def _timed(self, steps: int) -> float:
        started = self.clock()
        self.state = self.loop.advance(self.state, self.state.step + steps)
        return (self.clock() - started) / steps


def row(name: str, runner: Callable[[Addition], Runner]) -> tuple[str, ...]:
    scene = SCENES[name]
    try:
        one, usual = runner(scene.add), runner(scene.beside)
        for _ in range(REPEATS):
            usual.sample()
            one.sample()
    except SolidsphError as failure:
        return name, str(failure).split("\n")[0], "", ""
    times = median(one.samples[-REPEATS:]), median(usual.samples[-REPEATS:])
    return name, f"{1e9 * times[0]:.0f}", f"{times[0] / times[1]:.2f}", f"{scene.most:g}"


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("scenes", nargs="*", default=list(SCENES), metavar="SCENE")
    parser.add_argument("--particles", type=int, default=8000)
    parser.add_argument("--dimension", type=int, default=3, choices=(2, 3))
    parser.add_argument("--threads", type=int, default=1)
    wanted = parser.parse_args()
    warnings.simplefilter("ignore", UserWarning)
    numba.set_num_threads(wanted.threads)
    clock = time.process_time if wanted.threads == 1 else time.perf_counter

    @cache
    def runner(add: Addition) -> Runner:
        return Runner(built(add, wanted.particles, wanted.dimension), clock)

    found = []
    for name in wanted.scenes:
        found.append(row(name, runner))
        print(*found[-1], file=sys.stderr, flush=True)
    columns = ("scene", "ns a particle and step", "times the plain step", "at most")
    title = (
        f"Effects and materials, {wanted.particles} particles in {wanted.dimension}D, "
        f"{wanted.threads} thread{'s' if wanted.threads > 1 else ''}"
    )
    print(Table(title, columns, tuple(found)).text())
    over = [name for name, _, times, most in found if times and float(times) > float(most)]
    print(f"\nAbove what they may cost: {', '.join(over) or 'none'}")


if __name__ == "__main__":
    main()

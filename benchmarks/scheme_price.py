"""What the recommended scheme costs beside the gradient `corrected`: building, a step, a second.

    python benchmarks/scheme_price.py [PARTICLES ALONG A SIDE ...]

A cube in motion, on the same particles and threads; 22 and 46 along a side by default. Builds are
processor time, once each, after one that compiles. Read the ratios.
"""

from __future__ import annotations

import sys
import time
import warnings

import attrs
from table import Table
from timing import alternately

from solidsph import Simulation

REPEATS = 7
GRADIENTS = ("corrected", "consistent")


@attrs.frozen
class Made:
    """A built cube, and the processor time of building it [s]."""

    simulation: Simulation
    seconds: float

    def evaluate(self) -> None:
        state = self.simulation.start()
        self.simulation.dynamics.respond(0.0, state.positions, state.velocities)


def cube(side: int, gradient: str) -> Made:
    rubber = {"youngs_modulus": 1e6, "poissons_ratio": 0.3, "density": 1e3}
    builder = (
        Simulation.builder()
        .body("cube", shape={"type": "box", "lengths": [1.0, 1.0, 1.0]}, spacing=1.0 / (side - 1))
        .material("neo-hookean", **rubber)
        .formulation("total-lagrangian", gradient=gradient)
        .initial(velocity={"x": "0.1*sin(3*Y)"})
        .engine("compiled")
        .outputs(1)
        .duration(1e-3)
    )
    started = time.process_time()
    simulation = builder.build()
    return Made(simulation, time.process_time() - started)


def rows(side: int) -> list[tuple[str, ...]]:
    made = {gradient: cube(side, gradient) for gradient in GRADIENTS}
    steps = alternately({key: one.evaluate for key, one in made.items()}, REPEATS)
    plain = made["corrected"]
    found = []
    for gradient, one in made.items():
        times = (
            one.seconds / plain.seconds,
            steps[gradient] / steps["corrected"],
            plain.simulation.step_size / one.simulation.step_size,
        )
        of_a_second = times[1] * times[2]
        count = one.simulation.particles.count
        cells = (f"{count}", gradient, f"{one.seconds:.1f}", *(f"{x:.2f}" for x in times))
        found.append((*cells, f"{of_a_second:.2f}"))
    return found


def main() -> None:
    warnings.simplefilter("ignore", UserWarning)
    sides = [int(word) for word in sys.argv[1:]] or [22, 46]
    for gradient in GRADIENTS:
        cube(8, gradient).evaluate()  # compiles
    columns = ("particles", "gradient", "build, s", "build", "a step", "steps", "a second")
    found = tuple(row for side in sides for row in rows(side))
    print(Table("Price of the scheme, times the gradient `corrected`", columns, found).text())


if __name__ == "__main__":
    main()

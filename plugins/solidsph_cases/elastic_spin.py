"""A free square that spins."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import ceil, pi
from pathlib import Path
from typing import Any, ClassVar, final

import attrs
import numpy as np
from scipy.spatial import cKDTree

from solidsph.maths.arrays import Array
from solidsph.registry.parameters import check_positive, number
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.simulation import Simulation
from solidsph.studies.case import Case, Measurement, Trial
from solidsph_cases._compare import FINISHED
from solidsph_cases._energy import total_energy
from solidsph_cases._scheme import check_count, with_scheme

SIDE = 1.0  # [m]
DENSITY = 1100.0  # [kg/m^3]
ANGULAR_VELOCITY = 105.0  # at the start [rad/s]

# Outputs a turn, and in all, which bounds the record: the phases of a long run fall anywhere.
_OUTPUTS_A_TURN = 20
_MOST_OUTPUTS = 500

# The square is never squeezed to half its length, so particles this close have clumped.
_CLOSEST = 0.5  # spacings


@final
@attrs.frozen
class ElasticSpin(Case):
    """A soft square starts as if it were rigid, stretches in its own rotation, and breathes.

    Nothing acts on it and nothing damps it. Its angular momentum must stay to rounding, since the
    forces derive from an energy that no rotation changes; its energy wavers with the square of the
    time step and must not drift; and its particles must not clump.
    """

    title: ClassVar[str] = "A free elastic square that spins"
    source: ClassVar[str] = "conservation of angular momentum and energy"
    sweep: ClassVar[Mapping[str, Sequence[Any]]] = {
        "across": (11, 21),
        "time_step_factor": (0.1, 0.2, 0.4),
        "gradient": ("quadratic", "corrected"),
    }
    trials: ClassVar[Mapping[str, Trial]] = {
        "1000 turns": Trial({"turns": 1000.0, "across": 11}, {"turns": 5.0}),
    }

    turns: float = number(default=10.0)  # duration, in turns of the rigid square
    across: int = 21  # particles along a side
    kernel: str = "cubic-spline"
    cover: float = number(default=2.2)  # [spacings]
    gradient: str = "quadratic"
    hourglass: float = number(default=0.5)  # strength [-]; 0 names none
    engine: str = "auto"
    integrator: str = "central-difference"
    time_step_factor: float = number(default=0.4)  # of the CFL step
    momentum_tolerance: float = number(default=1e-10)  # relative change that passes [-]
    energy_tolerance: float = number(default=1e-3)  # relative drift that passes [-]

    def __attrs_post_init__(self) -> None:
        check_count("elastic-spin", "across", self.across, 5)
        check_positive("elastic-spin", "turns", self.turns, "turns")

    def accuracy(self, measurements: Sequence[Measurement]) -> Measurement:
        """The drift of energy; angular momentum is kept to rounding at any cost."""
        return measurements[1]

    def scenes(self) -> Mapping[str, Scene]:
        w = ANGULAR_VELOCITY
        builder = with_scheme(
            Simulation.builder()
            .title(self.title)
            .body(
                "square",
                shape={
                    "type": "box",
                    "lengths": [SIDE, SIDE],
                    "origin": [-0.5 * SIDE, -0.5 * SIDE],
                },
                spacing=SIDE / (self.across - 1),
                discretisation={
                    "type": "fitted-moments",
                    "of": {"type": "lattice", "on_boundary": True},
                },
            )
            .material("neo-hookean", youngs_modulus=17e6, poissons_ratio=0.3, density=DENSITY)
            .initial(velocity={"x": f"-{w!r}*Y", "y": f"{w!r}*X"})
            .integrator(self.integrator, time_step_factor=self.time_step_factor)
            .duration(self.turns * 2.0 * pi / w)
            .outputs(min(_MOST_OUTPUTS, ceil(_OUTPUTS_A_TURN * self.turns))),
            self,
        )
        return {"spin": builder.scene()}

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        record = records["spin"]
        finished = record.outcome == FINISHED
        momentum = angular_momentum(record)
        change = float(np.abs(momentum / momentum[0] - 1.0).max())
        drift = abs(energy_drift(record))
        closest = float(smallest_distance(record).min())
        over = f"over {self.turns:g} turns"
        return [
            Measurement(
                quantity=f"largest relative change of angular momentum {over}",
                value=change,
                unit="1",
                reference=0.0,
                source="isotropy of space",
                error=change,
                passed=finished and change <= self.momentum_tolerance,
            ),
            Measurement(
                quantity=f"relative drift of energy {over}",
                value=drift,
                unit="1",
                reference=0.0,
                source="a symplectic scheme wavers, and does not drift",
                error=drift,
                passed=finished and drift <= self.energy_tolerance,
            ),
            Measurement(
                quantity="smallest distance of neighbours",
                value=closest,
                unit="spacings",
                verdict="clumped" if closest < _CLOSEST else "apart",
                passed=finished and closest >= _CLOSEST,
            ),
        ]

    def draw(self, records: Mapping[str, Record], folder: Path) -> Sequence[Path]:
        from solidsph_cases._spin_picture import draw_spin

        path = folder / "elastic-spin.png"
        draw_spin(records["spin"], self.title, path)
        return [path]


def angular_momentum(record: Record) -> Array:
    """About the origin at every time, (t,) [kg m^2/s per metre]."""
    masses = DENSITY * record.particles.volumes
    x, v = record.positions[:], record.field("velocity")[:]
    result: Array = (x[..., 0] * v[..., 1] - x[..., 1] * v[..., 0]) @ masses
    return result


def energy_drift(record: Record) -> float:
    """Change of the energy along the straight line that fits it best, over its start [-]."""
    total = total_energy(record)
    times = record.times - record.times.mean()
    slope = float(times @ total / (times @ times))
    return slope * float(np.ptp(record.times)) / float(total[0])


def smallest_distance(record: Record) -> Array:
    """Of any two particles at every time, (t,) [spacings]."""
    spacing = float(record.particles.spacings[0])
    closest = []
    for positions in record.positions:
        distances = np.asarray(cKDTree(positions).query(positions, 2)[0])
        closest.append(distances[:, 1].min() / spacing)
    return np.array(closest)

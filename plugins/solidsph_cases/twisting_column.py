"""A column held at its foot that starts to twist."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import ceil, pi
from pathlib import Path
from typing import Any, ClassVar, final

import attrs
import numpy as np

from solidsph.maths.arrays import Array
from solidsph.registry.parameters import check_positive, number
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.simulation import Simulation
from solidsph.studies.case import Case, Curves, Measurement, Trial
from solidsph_cases._compare import FINISHED
from solidsph_cases._energy import energy_kept, smallest_volume_ratio
from solidsph_cases._scheme import check_count, with_scheme

SIDE, HEIGHT = 1.0, 6.0  # [m]
DENSITY, YOUNGS_MODULUS = 1100.0, 17e6  # [kg/m^3], [Pa]

# At 400 rad/s corners are faster than waves: the law stiffens so much that the step must be a
# tenth, and so twisted a column writhes, so that its axis need not stay.
_FAST: Mapping[str, Any] = {"time_step_factor": 0.03, "axis_tolerance": 0.1}

_SOURCE = "its foot can do no work; what twists one way must have been twisted the other"


@final
@attrs.frozen
class TwistingColumn(Case):
    """v = Omega sin(pi Z / (2 H)) (-Y, X, 0) at the start, of a rubber column of 1 x 1 x 6 m.

    It winds itself up by more than a turn at the higher rates, and unwinds. The foot is held, so
    that it takes angular momentum; energy is kept, since what is held does not move. By symmetry
    the axis of the column stays where it is, which no scheme knows beforehand.
    """

    title: ClassVar[str] = "A twisting column"
    source: ClassVar[str] = "Lee, Gil & Bonet (2013): E 17 MPa, rho 1100, nu 0.45 and 0.495"
    sweep: ClassVar[Mapping[str, Sequence[Any]]] = {
        "across": (4, 6, 8),
        "gradient": ("quadratic", "corrected"),
    }
    trials: ClassVar[Mapping[str, Trial]] = {
        **{
            f"{rate:g} rad/s, nu {nu:g}": Trial(
                {"rate": rate, "poissons_ratio": nu}, {"across": 4, "duration": 0.05}
            )
            for nu in (0.45, 0.495)
            for rate in (30.0, 105.0, 200.0)
        },
        "400 rad/s, nu 0.495": Trial(
            {"rate": 400.0, "poissons_ratio": 0.495, **_FAST}, {"across": 4, "duration": 0.05}
        ),
        "400 rad/s, nu 0.45": Trial(
            {"rate": 400.0, "poissons_ratio": 0.45, **_FAST},
            {"across": 4, "time_step_factor": 0.1},
            known="corners are faster than waves, and the run diverges even at a tenth of the "
            "step; 200 rad/s come through",
        ),
    }

    across: int = 6  # particles along each side of the square
    rate: float = number(default=105.0)  # Omega [rad/s]
    poissons_ratio: float = number(default=0.45)
    duration: float = number(default=0.3)  # [s]
    kernel: str = "cubic-spline"
    cover: float = number(default=2.2)  # [spacings]
    gradient: str = "quadratic"
    hourglass: float = number(default=0.5)  # strength [-]; 0 names none
    engine: str = "auto"
    integrator: str = "central-difference"
    time_step_factor: float = number(default=0.3)  # of the CFL step
    energy_tolerance: float = number(default=0.01)  # largest change that passes [-]
    axis_tolerance: float = number(default=0.01)  # sway of the axis over the side that passes [-]

    def __attrs_post_init__(self) -> None:
        check_count("twisting-column", "across", self.across, 3)
        check_positive("twisting-column", "duration", self.duration, "s")
        check_positive("twisting-column", "rate", self.rate, "rad/s")

    def scenes(self) -> Mapping[str, Scene]:
        profile = f"{self.rate!r}*sin({0.5 * pi / HEIGHT!r}*Z)"
        builder = (
            Simulation.builder()
            .title(self.title)
            .body(
                "column",
                shape={
                    "type": "box",
                    "lengths": [SIDE, SIDE, HEIGHT],
                    "origin": [-0.5 * SIDE, -0.5 * SIDE, 0.0],
                },
                spacing=SIDE / (self.across - 1),
                discretisation={
                    "type": "fitted-moments",
                    "of": {"type": "lattice", "on_boundary": True},
                },
            )
            .material(
                "neo-hookean",
                youngs_modulus=YOUNGS_MODULUS,
                poissons_ratio=self.poissons_ratio,
                density=DENSITY,
            )
            .boundary("clamp", where="front")
            .initial(velocity={"x": f"-{profile}*Y", "y": f"{profile}*X"})
            .integrator(self.integrator, time_step_factor=self.time_step_factor)
            .duration(self.duration)
            .outputs(ceil(400.0 * self.duration))
        )
        return {"column": with_scheme(builder, self).scene()}

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        record = records["column"]
        done = record.outcome == FINISHED
        sway = float(self.sway(record).max() / SIDE)
        angles = self.angles(record)
        return [
            energy_kept(record, self.energy_tolerance),
            Measurement(
                quantity="largest sway of the axis over the side",
                value=sway,
                unit="1",
                reference=0.0,
                source="symmetry",
                error=sway,
                passed=done and sway <= self.axis_tolerance,
            ),
            smallest_volume_ratio(record),
            Measurement(
                quantity="largest twist of the top",
                value=float(np.degrees(angles.max())),
                unit="degrees",
                source=_SOURCE,
                passed=done,
            ),
        ]

    def sway(self, record: Record) -> Array:
        """Distance of the centre of mass from the axis at every time, (t,) [m]."""
        masses = record.particles.volumes / record.particles.volumes.sum()
        centre = np.einsum("n,tni->ti", masses, record.positions[:])
        sway: Array = np.hypot(centre[:, 0], centre[:, 1])
        return sway

    def angles(self, record: Record) -> Array:
        """Twist of the top about the axis at every time, (t,) [rad]."""
        X = record.particles.positions
        top = np.flatnonzero(
            (X[:, 2] > HEIGHT * (1.0 - 1e-6)) & (np.hypot(X[:, 0], X[:, 1]) > 0.4 * SIDE)
        )
        x = record.positions[:][:, top]
        start = np.arctan2(X[top, 1], X[top, 0])
        turned = np.unwrap(np.arctan2(x[..., 1], x[..., 0]) - start, axis=0)
        angles: Array = turned.mean(axis=1)
        return angles

    def draw(self, records: Mapping[str, Record], folder: Path) -> Sequence[Path]:
        from solidsph_cases._column_picture import draw_column

        path = folder / "twisting-column.png"
        draw_column(records["column"], self.angles(records["column"]), self.title, path)
        return [path]

    def curves(self, records: Mapping[str, Record]) -> Mapping[str, Curves]:
        record = records["column"]
        return {
            "twisting-column": {
                "time [s]": record.times,
                "twist of the top [rad]": self.angles(record),
            }
        }

"""A copper bar that is shot at a wall."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, final

import attrs
import numpy as np

from solidsph.maths.arrays import Array, Mask
from solidsph.registry.parameters import check_positive, number
from solidsph.results.record import Record
from solidsph.run.energy import KINETIC, RESIDUAL
from solidsph.scene.scene import Scene
from solidsph.simulation import Simulation
from solidsph.studies.case import Case, Curves, Measurement
from solidsph_builtin.materials.j2_plasticity import J2Plasticity
from solidsph_cases._compare import FINISHED
from solidsph_cases._scheme import check_count, with_scheme

RADIUS, LENGTH = 3.2e-3, 32.4e-3  # [m]
COPPER = J2Plasticity(
    youngs_modulus=117e9,
    poissons_ratio=0.35,
    density=8930.0,
    yield_stress=0.4e9,
    hardening=0.1e9,
)

# What published finite element and particle codes find for this bar after 80 us.
FINAL_LENGTH, FOOT_RADIUS = (21.4e-3, 21.5e-3), (7.0e-3, 7.2e-3)  # [m]
_PUBLISHED = "range of published codes at 80 us"
_DURATION = 80e-6

_WALL = "wall"
PLASTIC_STRAIN = "plastic strain"


@final
@attrs.frozen
class TaylorBar(Case):
    """A cylinder of copper meets a rigid, frictionless wall head on, Taylor (1948).

    The foot slides on the wall and does not leave it, so that the wall could pull; a measurement
    says until when it does. At the foot the bar is flattened to a tenth of its height, by
    which its particles come so close that the stable step is some tenth of the one at the start.

    Hourglass control is a spring, and does not know that the metal has yielded: at its usual
    strength it holds the foot together, which costs 0.4 mm of its radius with four particles along
    it.
    """

    title: ClassVar[str] = "A Taylor bar"
    source: ClassVar[str] = "Taylor (1948); the copper bar by which codes are compared, at 227 m/s"
    sweep: ClassVar[Mapping[str, Sequence[Any]]] = {
        "across": (2, 3, 4, 5),
        "gradient": ("corrected", "quadratic"),
    }
    across: int = 5  # particles along a radius, the one on the axis left out
    velocity: float = number(default=227.0)  # of impact [m/s]
    duration: float = number(default=_DURATION)  # [s]
    kernel: str = "cubic-spline"
    cover: float = number(default=2.2)  # [spacings]
    gradient: str = "corrected"
    hourglass: float = number(default=0.05)  # strength [-]; 0 names none
    engine: str = "compiled"
    integrator: str = "central-difference"
    time_step_factor: float = number(default=0.12)  # of the CFL step at the start
    tolerance: float = number(default=0.005)  # how far off the published range passes [-]
    energy_tolerance: float = number(default=1e-3)  # of the energy at the start [-]

    def __attrs_post_init__(self) -> None:
        check_count("taylor-bar", "across", self.across, 2)
        for name, unit in (("velocity", "m/s"), ("duration", "s"), ("tolerance", "1")):
            check_positive("taylor-bar", name, getattr(self, name), unit)

    def scenes(self) -> Mapping[str, Scene]:
        builder = (
            Simulation.builder()
            .title(self.title)
            .body(
                "bar",
                shape={"type": "cylinder", "radius": RADIUS, "length": LENGTH},
                spacing=RADIUS / self.across,
                discretisation="conforming-lattice",
            )
            .material(
                "j2-plasticity",
                **{
                    name: getattr(COPPER, name)
                    for name in (
                        "youngs_modulus",
                        "poissons_ratio",
                        "density",
                        "yield_stress",
                        "hardening",
                    )
                },
            )
            .boundary("clamp", where="base", axes=["z"], label=_WALL)
            .initial(where="not base", velocity={"z": -self.velocity})
            .integrator(self.integrator, time_step_factor=self.time_step_factor)
            .duration(self.duration)
            .outputs(80)
        )
        return {"bar": with_scheme(builder, self).scene()}

    @property
    def is_known(self) -> bool:
        """Whether something is published at these parameters."""
        return self.velocity == 227.0 and self.duration == _DURATION

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        record = records["bar"]
        done = record.outcome == FINISHED
        rim = self.rim_radii(record)[-1]
        history = record.history
        residual = float(np.abs(history[RESIDUAL]).max() / history[KINETIC][0])
        force = history[f"{_WALL} reaction z [N]"]
        strain = float(record.field(PLASTIC_STRAIN)[-1].max())
        return [
            self._ranged(record, "final length", float(self.lengths(record)[-1]), FINAL_LENGTH),
            self._ranged(record, "foot radius, mean", float(rim.mean()), FOOT_RADIUS),
            Measurement(
                quantity="difference of the largest and the smallest foot radius",
                value=1e3 * float(np.ptp(rim)),
                unit="mm",
                source="the lattice has four axes and the bar none",
                passed=done,
            ),
            Measurement(
                quantity="largest equivalent plastic strain",
                value=strain,
                unit="1",
                source="at the centre of the foot",
                passed=done,
            ),
            Measurement(
                quantity="largest residual of the energy ledger over the energy at the start",
                value=residual,
                unit="1",
                reference=0.0,
                source="all plastic work is dissipated, and the wall does none",
                error=residual,
                passed=done and residual <= self.energy_tolerance,
            ),
            Measurement(
                quantity="time after which the wall only pushes",
                value=1e6 * float(record.times[force < 0.0].max(initial=0.0)),
                unit="us",
                source="a real wall does not pull; this one does while the impact rings",
                passed=done,
            ),
        ]

    def _ranged(
        self, record: Record, quantity: str, value: float, published: tuple[float, float]
    ) -> Measurement:
        if not self.is_known:
            return Measurement(quantity, 1e3 * value, "mm", passed=record.outcome == FINISHED)
        least, most = published
        off = max(least - value, value - most, 0.0) / least
        within = "within the range" if off == 0.0 else f"{100.0 * off:.2g} % off the range"
        return Measurement(
            quantity=quantity,
            value=1e3 * value,
            unit="mm",
            reference=1e3 * 0.5 * (least + most),
            source=f"{_PUBLISHED}, {1e3 * least:g} to {1e3 * most:g} mm",
            error=abs(2.0 * value / (least + most) - 1.0),
            verdict=within if record.outcome == FINISHED else record.outcome,
            passed=record.outcome == FINISHED and off <= self.tolerance,
        )

    def lengths(self, record: Record) -> Array:
        """Mean height of the end at every time, (t,) [m]."""
        end = self._at_height(record, LENGTH)
        heights: Array = record.positions[:][:, end, 2].mean(axis=1)
        return heights

    def rim_radii(self, record: Record) -> Array:
        """Distances from the axis of the particles around the foot at every time, (t, k) [m]."""
        X = record.particles.positions
        rim = self._at_height(record, 0.0) & (np.hypot(X[:, 0], X[:, 1]) > RADIUS * (1.0 - 1e-6))
        x = record.positions[:][:, rim]
        radii: Array = np.hypot(x[..., 0], x[..., 1])
        return radii

    def _at_height(self, record: Record, height: float) -> Mask:
        Z = record.particles.positions[:, 2]
        at: Mask = np.abs(Z - height) < 1e-6 * LENGTH
        return at

    def draw(self, records: Mapping[str, Record], folder: Path) -> Sequence[Path]:
        from solidsph_cases._taylor_picture import draw_bar

        record, path = records["bar"], folder / "taylor-bar.png"
        curves = (self.lengths(record), self.rim_radii(record).mean(axis=1))
        ranges = (FINAL_LENGTH, FOOT_RADIUS) if self.is_known else None
        draw_bar(record, *curves, ranges, RADIUS / self.across, self.title, path)
        return [path]

    def curves(self, records: Mapping[str, Record]) -> Mapping[str, Curves]:
        record = records["bar"]
        return {
            "taylor-bar": {
                "time [s]": record.times,
                "length [m]": self.lengths(record),
                "foot radius [m]": self.rim_radii(record).mean(axis=1),
            }
        }

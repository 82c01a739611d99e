"""A copper bar that is shot at a wall."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import final

import attrs
import numpy as np

from solidsph.maths.arrays import Array, Mask
from solidsph.registry.parameters import number
from solidsph.results.record import Record
from solidsph.run.energy import KINETIC, RESIDUAL
from solidsph.scene.scene import Scene
from solidsph.simulation import Simulation
from solidsph.studies.case import Case, Curves, Measurement
from solidsph_builtin.materials.j2_plasticity import J2Plasticity
from solidsph_cases._compare import finished, vanishing
from solidsph_cases._scene import check_all_positive, check_count
from solidsph_cases.drawing.fields import scatter
from solidsph_cases.drawing.sheet import Bar, Mark, Panel, Sheet, level, line, mark

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

_STEP = 0.3  # of the critical step [-]

_WALL = "wall"
PLASTIC_STRAIN = "plastic strain"

_SHOWN = (0.0, 0.125, 0.375, 1.0)  # when the bar is drawn, in parts of the duration


@final
@attrs.frozen
class TaylorBar(Case):
    """A cylinder of copper meets a rigid, frictionless wall head on, Taylor (1948).

    The foot slides on the wall and does not leave it, so that the wall could pull; a measurement
    says until when it does. At the foot the bar is flattened to a tenth of its height, by
    which its particles come so close that the stable step is some tenth of the one at the start.
    """

    title = "A Taylor bar"
    source = "Taylor (1948); the copper bar by which codes are compared, at 227 m/s"
    studies = {
        "time_step_factor": "energy that the ledger misses in the impact: 0.17 % at 0.5 of the "
        "critical step, 0.11 % at 0.4, 0.06 % at 0.3, where the case asks for 0.1 %",
    }
    sweep = {"across": (2, 3, 4), "gradient": ("consistent", "quadratic", "corrected")}

    across: int = 3  # particles along a radius, the one on the axis left out
    velocity: float = number(default=227.0)  # of impact [m/s]
    duration: float = number(default=_DURATION)  # [s]
    tolerance: float = number(default=0.005)  # how far off the published range passes [-]
    energy_tolerance: float = number(default=1e-3)  # of the energy at the start [-]

    def __attrs_post_init__(self) -> None:
        check_count("taylor-bar", "across", self.across, 2)
        check_all_positive("taylor-bar", self, velocity="m/s", duration="s", tolerance="1")

    def scenes(self) -> Mapping[str, Scene]:
        names = ("youngs_modulus", "poissons_ratio", "density", "yield_stress", "hardening")
        builder = (
            Simulation.builder()
            .title(self.title)
            .body(
                "bar",
                shape={"type": "cylinder", "radius": RADIUS, "length": LENGTH},
                spacing=RADIUS / self.across,
            )
            .material("j2-plasticity", **{name: getattr(COPPER, name) for name in names})
            .boundary("clamp", where="base", axes=["z"], label=_WALL)
            .initial(where="not base", velocity={"z": -self.velocity})
            .integrator(time_step_factor=_STEP)
            .duration(self.duration)
            .outputs(80)
        )
        return {"bar": builder.scene()}

    @property
    def is_known(self) -> bool:
        """True if something is published at these parameters."""
        return self.velocity == 227.0 and self.duration == _DURATION

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        record = records["bar"]
        done, rim, history = finished(record), self.rim_radii(record)[-1], record.history
        force = history[f"{_WALL} reaction z [N]"]
        return [
            self._ranged(record, "final length", float(self.lengths(record)[-1]), FINAL_LENGTH),
            self._ranged(record, "foot radius, mean", float(rim.mean()), FOOT_RADIUS),
            Measurement(
                "difference of the largest and the smallest foot radius",
                1e3 * float(np.ptp(rim)),
                "mm",
                source="the lattice has four axes and the bar none",
                passed=done,
            ),
            Measurement(
                "largest equivalent plastic strain",
                float(record.field(PLASTIC_STRAIN)[-1].max()),
                "1",
                source="at the centre of the foot",
                passed=done,
            ),
            vanishing(
                record,
                "largest residual of the energy ledger over the energy at the start",
                float(np.abs(history[RESIDUAL]).max() / history[KINETIC][0]),
                self.energy_tolerance,
                "all plastic work is dissipated, and the wall does none",
            ),
            Measurement(
                "time after which the wall only pushes",
                1e6 * float(record.times[force < 0.0].max(initial=0.0)),
                "us",
                source="a real wall does not pull; this one does while the impact rings",
                passed=done,
            ),
        ]

    def _ranged(
        self, record: Record, quantity: str, value: float, published: tuple[float, float]
    ) -> Measurement:
        done = finished(record)
        if not self.is_known:
            return Measurement(quantity, 1e3 * value, "mm", passed=done)
        least, most = published
        off = max(least - value, value - most, 0.0) / least
        within = "within the range" if off == 0.0 else f"{100.0 * off:.2g} % off the range"
        return Measurement(
            quantity,
            1e3 * value,
            "mm",
            reference=1e3 * 0.5 * (least + most),
            source=f"{_PUBLISHED}, {1e3 * least:g} to {1e3 * most:g} mm",
            error=abs(2.0 * value / (least + most) - 1.0),
            verdict=within if done else record.outcome,
            passed=done and off <= self.tolerance,
        )

    def lengths(self, record: Record) -> Array:
        """Mean height of the end at every time, (t,) [m]."""
        end = _at_height(record, LENGTH)
        return np.asarray(record.positions[:][:, end, 2].mean(axis=1))

    def rim_radii(self, record: Record) -> Array:
        """Distances from the axis of the particles around the foot at every time, (t, k) [m]."""
        X = record.particles.positions
        rim = _at_height(record, 0.0) & (np.hypot(X[:, 0], X[:, 1]) > RADIUS * (1.0 - 1e-6))
        x = record.positions[:][:, rim]
        return np.asarray(np.hypot(x[..., 0], x[..., 1]))

    def pictures(self, records: Mapping[str, Record]) -> Mapping[str, Sheet]:
        """Particles near a plane through the axis, coloured by plastic strain, at four times; the
        length and the radius of the foot over time, with the published ranges."""
        record = records["bar"]
        strains = record.field(PLASTIC_STRAIN)
        cut = np.abs(record.particles.positions[:, 1]) < 0.3 * RADIUS / self.across
        range_ = {"vmin": 0.0, "vmax": float(strains[-1].max())}
        frames = []
        for k in (round(part * (len(record.times) - 1)) for part in _SHOWN):
            x = 1e3 * record.positions[k][cut][:, [0, 2]]
            frames.append(
                Panel(
                    scatter(x, strains[k][cut], "inferno", s=9, **range_),
                    level(0.0, color="0.5", linewidth=1.0, zorder=0),
                    title=f"{1e6 * record.times[k]:.0f} us",
                    x="x [mm]",
                    y="z [mm]",
                    same_y="z",
                    aspect="equal",
                    xlim=(-8.0, 8.0),
                    ylim=(-1.0, 33.5),
                )
            )
        curves = self.curves(records)["taylor-bar"]
        length = self._history(curves, "length [m]", "length [mm]", FINAL_LENGTH, False)
        radius = self._history(
            curves, "foot radius [m]", "mean foot radius [mm]", FOOT_RADIUS, True
        )
        title = f"{self.title}: {record.particles.count} particles"
        rows = [[*frames, *[history] * 3] for history in (length, radius)]
        bars = [Bar("equivalent plastic strain", [frames[-1]])]
        return {"taylor-bar": Sheet(rows, (12.5, 5.5), title, bars=bars)}

    def _history(
        self, curves: Curves, column: str, label: str, published: tuple[float, float], below: bool
    ) -> Panel:
        marks: list[Mark] = [line(1e6 * curves["time [s]"], 1e3 * curves[column])]
        if self.is_known:
            low, high = (1e3 * end for end in published)
            words = {"xycoords": ("axes fraction", "data"), "fontsize": 8, "color": "tab:blue"}
            place = (0.02, low if below else high)
            va = "top" if below else "bottom"
            marks += [
                mark("axhspan", low, high, color="tab:blue", alpha=0.3),
                mark("annotate", "published at the end", place, va=va, **words),
            ]
        return Panel(*marks, x="time [us]", y=label)

    def curves(self, records: Mapping[str, Record]) -> Mapping[str, Curves]:
        record = records["bar"]
        return {
            "taylor-bar": {
                "time [s]": record.times,
                "length [m]": self.lengths(record),
                "foot radius [m]": self.rim_radii(record).mean(axis=1),
            }
        }


def _at_height(record: Record, height: float) -> Mask:
    return np.asarray(np.abs(record.particles.positions[:, 2] - height) < 1e-6 * LENGTH)

"""A sheet with a hole, pulled suddenly, and pulled slowly until it comes to rest."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from math import ceil
from typing import final

import attrs
import numpy as np

from solidsph.errors import SceneError
from solidsph.maths.arrays import Array
from solidsph.maths.tensors import largest_principal
from solidsph.registry.parameters import number
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.scene.scene_builder import SceneBuilder
from solidsph.studies.case import Case, Curves, Measurement
from solidsph_cases import _motion_pictures as motion
from solidsph_cases._compare import compared, finished, vanishing
from solidsph_cases._scene import check_all_positive
from solidsph_cases._sheet import (
    EXTENSION,
    MATERIAL,
    PEAK,
    SOURCE,
    at_hole,
    check_hole,
    extensions,
    is_known,
    largest_stresses,
    peak_distance,
    quarter,
    sheet,
)
from solidsph_cases.drawing.sheet import Sheet

SUDDEN, RAMPED, REST = "sudden", "ramped", "rest"

# Of the same sheet suddenly loaded and undamped, by finite elements and by spectral ones
# (tests/helpers/spectral_sheet.py).
FIRST_MAXIMUM = 0.1152  # mean u_x of the loaded edge over W
ITS_TIME = 9.61  # [W / c_p]
# Largest principal Cauchy stress in 20 W / c_p [Pa]. Fronts are jumps, and what they add at the
# hole depends on the mesh: 43.6, 42.0, 42.8 and 42.4 MPa on 72, 128, 200 and 288 elements.
LARGEST = 42.5e6
_SPECTRAL = "spectral elements of the fourth order, the same law and load, undamped"
_WATCHED = 20.0  # [W / c_p]

_KIRSCH = "Kirsch (1898): 3 at a small hole under a small load; twice that in one undamped mode"
_NEWTON = "equilibrium of the same particles by Newton's method"
_PAPER = "60 MPa"

# Of largest stresses at twenty particles to the width.
_PEAK_TOLERANCE = 0.15

# At rest the motion that is left is exp(-damping / 2 * settling), some 1e-6, of the extension.
_AT_REST = 1e-4

_OUTPUTS = 20  # in the time W / c_p, of the sudden load
_OUTPUTS_AT_REST = 4  # the same of the ramped one


@final
@attrs.frozen
class SheetInMotion(Case):
    """The paper's sheet, a quarter of it, loaded from rest: its waves, and where they end.

    Suddenly loaded and undamped it swings, and never comes to rest. Loaded over many crossings of
    the wave and damped, it comes to rest where a solution of equilibrium says. The paper does not
    say which of the two its figures show, nor how large the hole is: its largest stress, 60 MPa, is
    held against both. At rest no hole up to 0.7 W reaches it, by far; in the first swing of the
    undamped sheet it takes one of more than 0.6 W. With a larger hole it is softer and comes to
    rest later: up to 0.7 W, with a damping of 0.3 and 100 crossings to settle.

    """

    title = "A sheet with a hole, in motion"
    source = "Ismail & Reddy, section 5.4, Figs. 16 to 18"
    figures = ("fig-16", "fig-17", "fig-18")
    sweep = {
        "spacing": (0.2, 0.1, 1.0 / 15.0, 0.05),
        "gradient": ("consistent", "quadratic", "corrected"),
    }

    hole_ratio: float = number(default=0.2)  # radius of the hole over W
    spacing: float = number(default=0.05)  # of particles [m]
    width: float = number(default=1.0)  # W, side of the quarter [m]
    traction: float = number(default=5e6)  # on the undeformed edge [Pa]
    duration: float = number(default=30.0)  # of the sudden load [W / c_p]
    ramp: float = number(default=30.0)  # how long the slow load grows [W / c_p]
    settling: float = number(default=50.0)  # and how long it stays [W / c_p]
    damping: float = number(default=0.5)  # rate of mass damping, then [c_p / W]
    tolerance: float = number(default=0.02)  # largest error that passes [-]
    peak_tolerance: float = number(default=0.1)  # of the stress at rest, as in `sheet-convergence`

    def __attrs_post_init__(self) -> None:
        check_all_positive(
            "sheet-in-motion",
            self,
            width="m",
            spacing="m",
            traction="Pa",
            ramp="crossings",
            settling="crossings",
            damping="one over a crossing",
        )
        check_hole("sheet-in-motion", self.hole_ratio, self.width, self.spacing)
        if not self.duration >= _WATCHED:
            raise SceneError(
                f"case 'sheet-in-motion': duration must be at least {_WATCHED:g} W / c_p, in which "
                f"the sheet swings out and back once, got {self.duration}"
            )

    @property
    def radius(self) -> float:
        """Of the hole [m]."""
        return self.hole_ratio * self.width

    @property
    def crossing(self) -> float:
        """Time in which a small pressure wave crosses the quarter, W / c_p [s]."""
        return self.width / MATERIAL.wave_speed

    @property
    def known(self) -> bool:
        """True if there is a reference."""
        return is_known(self.hole_ratio, self.traction)

    def scenes(self) -> Mapping[str, Scene]:
        S, slow = self.traction, self.ramp + self.settling
        ramp = f"{S!r}*min(t/{self.ramp * self.crossing!r}, 1)"
        return {
            SUDDEN: self._moving(S, self.duration, _OUTPUTS).scene(),
            RAMPED: self._moving(ramp, slow, _OUTPUTS_AT_REST)
            .effect("mass-damping", rate=self.damping / self.crossing)
            .scene(),
            REST: _pulled(self._sheet(), S).duration(1.0).statics().scene(),
        }

    def _sheet(self) -> SceneBuilder:
        return sheet(
            title=self.title,
            square=quarter,
            hole_ratio=self.hole_ratio,
            width=self.width,
            spacing=self.spacing,
        )

    def _moving(self, traction: float | str, crossings: float, outputs: int) -> SceneBuilder:
        duration, outputs = crossings * self.crossing, ceil(outputs * crossings)
        return _pulled(self._sheet(), traction).duration(duration).outputs(outputs)

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        return [*self._extension(records), *self._stress(records)]

    def _extension(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        sudden, ramped, rest = records[SUDDEN], records[RAMPED], records[REST]
        time, maximum = first_maximum(sudden.times / self.crossing, extensions(sudden))
        still = float(extensions(rest)[-1])
        miss = np.linalg.norm(ramped.positions[-1] - rest.positions[-1], axis=1).max() / still
        reached = float(extensions(ramped)[-1]) / self.width
        distance = vanishing(
            ramped,
            "ramped and damped: largest distance from equilibrium over its u_x",
            *(float(miss), _AT_REST, _NEWTON),
            verdict="at rest" if miss <= _AT_REST else "NOT at rest",
        )

        def compare(
            record: Record, quantity: str, value: float, unit: str, reference: float
        ) -> Measurement:
            known = reference if self.known else None
            return compared(record, quantity, value, unit, known, SOURCE, self.tolerance)

        quantity = "sudden: first maximum of the loaded edge's mean u_x over W"
        ratio = "overshoot: first maximum of u_x over that at rest"
        end = "ramped and damped: mean u_x at the end over W"
        return [
            compare(sudden, quantity, maximum / self.width, "1", FIRST_MAXIMUM),
            compare(sudden, "sudden: time of it", time, "W/c_p", ITS_TIME),
            compare(ramped, end, reached, "1", EXTENSION),
            attrs.evolve(distance, passed=distance.passed and finished(rest)),
            compare(sudden, ratio, maximum / still, "1", FIRST_MAXIMUM / EXTENSION),
        ]

    def _stress(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        sudden, ramped, known = records[SUDDEN], records[RAMPED], self.known
        top = at_hole(ramped, self.radius, 90.0)
        final, still = (
            float(largest_principal(record.field("cauchy_stress")[-1])[top])
            for record in (ramped, records[REST])
        )
        watched = sudden.times <= (_WATCHED + 1e-6) * self.crossing
        largest = float(largest_stresses(sudden)[watched].max())
        compare = partial(compared, unit="MPa")
        at_rest = compare(
            ramped,
            "ramped and damped: principal Cauchy stress at (0, a)",
            1e-6 * final,
            reference=1e-6 * PEAK if known else None,
            source=SOURCE,
            tolerance=self.peak_tolerance,
        )
        ever = compare(
            sudden,
            f"sudden: largest principal Cauchy stress in {_WATCHED:g} W/c_p",
            1e-6 * largest,
            reference=1e-6 * LARGEST if known else None,
            source=_SPECTRAL,
            tolerance=_PEAK_TOLERANCE,
        )
        quantity, ratio = "that over the same at equilibrium", final / still
        return [
            _beside_paper(at_rest, final),
            compared(ramped, quantity, ratio, "1", 1.0, _NEWTON, self.tolerance),
            peak_distance(ramped, self.radius, known),
            _beside_paper(ever, largest),
            _beside_kirsch("at rest", final / self.traction, 3.0, ramped),
            _beside_kirsch("suddenly loaded", largest / self.traction, 6.0, sudden),
        ]

    def pictures(self, records: Mapping[str, Record]) -> Mapping[str, Sheet]:
        """The problem, the sheet at rest and how it comes there, and the waves."""
        sudden, ramped = records[SUDDEN], records[RAMPED]
        rest = float(extensions(records[REST])[-1]) / self.width
        where = motion.Quarter(self.radius, self.width, self.crossing, self.traction)
        levels = (EXTENSION, PEAK) if self.known else (rest, None)
        return {
            "fig-16-sheet": motion.problem(sudden, where),
            "fig-17-final-stress": motion.final_stress(sudden, ramped, where, *levels),
            "fig-18-waves": motion.waves(sudden, where),
        }

    def curves(self, records: Mapping[str, Record]) -> Mapping[str, Curves]:
        tables = {}
        for name in (SUDDEN, RAMPED):
            record = records[name]
            top = at_hole(record, self.radius, 90.0)
            stresses = record.field("cauchy_stress")[:]
            tables[f"{name}-history"] = {
                "time [W/c_p]": record.times / self.crossing,
                "mean u_x of the loaded edge over W [1]": extensions(record) / self.width,
                "largest principal Cauchy stress [Pa]": largest_stresses(record),
                "principal Cauchy stress at (0, a) [Pa]": largest_principal(stresses[:, top]),
            }
        return tables


def _pulled(builder: SceneBuilder, traction: float | str) -> SceneBuilder:
    return builder.boundary("traction", where="right", traction={"x": traction})


def _beside_paper(measured: Measurement, stress: float) -> Measurement:
    """The same beside what the paper says."""
    factor = f"the paper's is {60e6 / stress:.1f} times that"
    words = ", ".join(word for word in (measured.verdict, factor) if word)
    return attrs.evolve(measured, verdict=words, paper=_PAPER)


def _beside_kirsch(when: str, factor: float, theory: float, record: Record) -> Measurement:
    """How much more than at a small hole the stress is concentrated; the two need not agree."""
    more = "more by the size of the hole and by large strains"
    return Measurement(
        f"{when}: largest principal Cauchy stress over the traction",
        factor,
        "1",
        reference=theory,
        source=_KIRSCH,
        error=abs(factor / theory - 1.0),
        verdict=more if factor > theory else "less than at a small hole",
        passed=finished(record),
        paper="60 MPa under 5 MPa: 12",
    )


def first_maximum(times: Array, values: Array) -> tuple[float, float]:
    """Time and value of the top of the first swing of `values` (t,).

    Shorter waves ride on it: its time is that of the parabola through the highest hundredth, its
    value the largest.
    """
    highest = np.maximum.accumulate(values)
    back = np.flatnonzero((values < 0.7 * highest) & (highest > 0.5 * values.max()))
    swing = slice(0, int(back[0]) if len(back) else len(values))
    times, values = times[swing], values[swing]
    largest = float(values.max())
    near = values > 0.99 * largest
    if near.sum() < 3:
        return float(times[np.argmax(values)]), largest
    middle = float(times[near].mean())
    a, b, _ = np.polyfit(times[near] - middle, values[near], 2)
    return (middle - 0.5 * float(b / a) if a < 0.0 else middle), largest

"""A sheet with a hole at rest, at ever smaller spacings: in rows and without any."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import final

import attrs
import numpy as np

from solidsph.errors import SceneError
from solidsph.maths.arrays import Array
from solidsph.registry.parameters import number
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.scene.scene_data import PartLike
from solidsph.studies.case import Case, Curves, Measurement
from solidsph.studies.scene_words import changed
from solidsph_cases._compare import compared, finished
from solidsph_cases._scene import check_all_positive, check_count
from solidsph_cases._sheet import (
    EXTENSION,
    PEAK,
    SOURCE,
    check_hole,
    extensions,
    is_known,
    largest_stresses,
    peak_distance,
    quarter,
    rows_along,
    sheet,
)
from solidsph_cases.drawing.convergence import by_spacing, errors_panel
from solidsph_cases.drawing.fields import LARGEST_STRESS, quarter_circle, quarter_particles
from solidsph_cases.drawing.sheet import Panel, Sheet, level, line, mark

_COVER = 3.0  # of rows along the hole [spacings]
ROWS_ALONG, NO_ROWS = "rows along the hole", "no rows"
ARRANGEMENTS = (ROWS_ALONG, "rows up to the hole", NO_ROWS)


@final
@attrs.frozen
class SheetConvergence(Case):
    """The convergence study that the authors ask for, on a quarter of the sheet.

    Three arrangements of particles: rows that follow the hole, rows that end at it with the
    outermost particles moved onto it, and the same with every particle inside moved at random.
    Of each the error against a quasi-static solution, which must fall at every refinement.
    """

    title = "A sheet with a hole at rest: convergence"
    source = "Ismail & Reddy, section 5.4: a convergence analysis should be completed"
    figures = ("section-5.4-convergence",)
    studies = {
        "discretisation": "arrangements of particles are what is compared",
        "gradient": "the recommended one for all of them: particles that a scene arranges by "
        "itself would get a linear one",
        "cover": "where rows that follow the hole spread, particles need more of their neighbours",
    }
    sweep = {
        "across": ((5, 10), (10, 15), (15, 20), (20, 30)),
        "gradient": ("consistent", "quadratic", "corrected"),
    }

    hole_ratio: float = number(default=0.2)  # radius of the hole over W
    across: Sequence[int] = (20, 30, 40)  # spacings along W, growing
    width: float = number(default=1.0)  # W, side of the quarter [m]
    traction: float = number(default=5e6)  # on the undeformed edge [Pa]
    jitter: float = number(default=0.2)  # of the particles without rows [spacings]
    seed: int = 1  # of their random numbers
    tolerance: float = number(default=0.005)  # largest error of the displacement that passes [-]
    peak_tolerance: float = number(default=0.05)  # largest error of the stress that passes [-]

    def __attrs_post_init__(self) -> None:
        check_all_positive("sheet-convergence", self, width="m", traction="Pa")
        for count in self.across:
            check_count("sheet-convergence", "each of across", count, 2)
            check_hole("sheet-convergence", self.hole_ratio, self.width, self.width / count)
        if len(self.across) < 2 or not np.all(np.diff(self.across) > 0):
            raise SceneError(
                "case 'sheet-convergence': across must be two numbers or more, each larger than "
                f"the one before, got {list(self.across)}"
            )

    @property
    def radius(self) -> float:
        """Of the hole [m]."""
        return self.hole_ratio * self.width

    @property
    def known(self) -> bool:
        """True if there is a reference."""
        return is_known(self.hole_ratio, self.traction)

    @property
    def spacings(self) -> Array:
        """Over W, one for each of `across`, (k,) [-]."""
        return 1.0 / np.array(self.across, dtype=np.float64)

    def scenes(self) -> Mapping[str, Scene]:
        return {
            _scene_name(name, count): self._scene(name, count)
            for name in ARRANGEMENTS
            for count in self.across
        }

    def _scene(self, name: str, count: int) -> Scene:
        spacing = self.width / count
        discretisation: PartLike | None = None
        if name == ROWS_ALONG:
            discretisation = rows_along(quarter, self.hole_ratio, self.width, spacing)
        if name == NO_ROWS:
            moved = {"amplitude": self.jitter, "seed": self.seed}
            discretisation = {"type": "jittered", "of": "fitted", **moved}
        scene = (
            sheet(
                title=f"{self.title}: {name}, spacing W/{count}",
                square=quarter,
                hole_ratio=self.hole_ratio,
                width=self.width,
                spacing=spacing,
                discretisation=discretisation,
            )
            .boundary("traction", where="right", traction={"x": self.traction})
            .formulation("total-lagrangian", gradient="consistent")
            .duration(1.0)
            .statics()
            .scene()
        )
        return changed(scene, "cover", _COVER) if name == ROWS_ALONG else scene

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        measured = []
        for name in ARRANGEMENTS:
            runs = self._runs(records, name)
            for count, record in zip(self.across, runs, strict=True):
                measured += [
                    compared(
                        record,
                        f"{name}, W/{count}: mean u_x of the loaded edge over W",
                        float(extensions(record)[-1]) / self.width,
                        *("1", EXTENSION if self.known else None, SOURCE, self.tolerance),
                    ),
                    self._peak(record, f"{name}, W/{count}"),
                ]
            if self.known:
                measured.append(self._order(records, name))
        return measured

    def accuracy(self, measurements: Sequence[Measurement]) -> Measurement:
        """The displacement in rows along the hole, the finest ones."""
        start = f"{ROWS_ALONG}, W/{self.across[-1]}: mean"
        return next(m for m in measurements if m.quantity.startswith(start))

    def _runs(self, records: Mapping[str, Record], name: str) -> list[Record]:
        return [records[_scene_name(name, count)] for count in self.across]

    def _peak(self, record: Record, name: str) -> Measurement:
        """The largest stress, and whether it is where it must be."""
        distance = peak_distance(record, self.radius, self.known)
        found = compared(
            record,
            f"{name}: largest principal Cauchy stress",
            1e-6 * largest_stresses(record)[-1],
            "MPa",
            *(1e-6 * PEAK if self.known else None, SOURCE, self.peak_tolerance),
        )
        words = (found.verdict, f"{distance.value:.1f} spacings from (0, a)")
        verdict = ", ".join(word for word in words if word)
        return attrs.evolve(found, verdict=verdict, passed=found.passed and distance.passed)

    def errors(self, records: Mapping[str, Record], name: str) -> Array:
        """Relative errors of the displacement, one for each of `across`, (k,)."""
        values = np.array([extensions(record)[-1] for record in self._runs(records, name)])
        return np.abs(values / self.width / EXTENSION - 1.0)

    def _order(self, records: Mapping[str, Record], name: str) -> Measurement:
        errors = self.errors(records, name)
        falls = bool(np.all(np.diff(errors) < 0.0))
        return Measurement(
            f"{name}: order of the displacement's error in the spacing",
            float(-np.polyfit(np.log(self.across), np.log(errors), 1)[0]),
            "1",
            verdict="falls at every refinement" if falls else "does NOT fall at every refinement",
            passed=falls and finished(*self._runs(records, name)),
        )

    def pictures(self, records: Mapping[str, Record]) -> Mapping[str, Sheet]:
        """The arrangements near the hole at the coarsest spacing, the errors, and the stresses."""
        coarsest = (self._runs(records, name)[0] for name in ARRANGEMENTS)
        above = [self._arrangement(*pair) for pair in zip(ARRANGEMENTS, coarsest, strict=True)]
        rows = [[one for one in above for _ in "xx"]]
        if self.known:
            errors, peaks = {}, {}
            for name in ARRANGEMENTS:
                runs = self._runs(records, name)
                errors[name] = 100.0 * self.errors(records, name)
                peaks[name] = np.array([1e-6 * largest_stresses(record)[-1] for record in runs])
            ticks = [f"1/{count}" for count in self.across]
            peak = 1e-6 * PEAK
            style = {"color": "0.4", "linewidth": 3.0, "alpha": 0.4, "zorder": 0}
            error = errors_panel(
                self.spacings,
                errors,
                (1, 2),
                ticks,
                "spacing / W",
                "error of the edge's mean u_x [%]",
            )
            stress = Panel(
                *by_spacing(self.spacings, peaks, ticks),
                level(peak, f"reference: {peak:.2f} MPa", **style),
                x="spacing / W",
                y=f"{LARGEST_STRESS} [MPa]",
                ylim=(0.8 * peak, 1.2 * peak),
            )
            rows.append([error] * 3 + [stress] * 3)
        title = f"{self.title}, radius of the hole {self.hole_ratio:g} W"
        size = (11.0, 8.6 if self.known else 4.2)
        return {"section-5.4-convergence": Sheet(rows, size, title)}

    def _arrangement(self, name: str, record: Record) -> Panel:
        shown = min(1.0, 2.5 * self.hole_ratio)
        return Panel(
            *quarter_particles(record, self.width),
            line(*quarter_circle(self.hole_ratio), linewidth=0.8),
            mark("set_aspect", "equal"),
            title=f"{name}: {record.particles.count} particles",
            x="X / W",
            y="Y / W" if name == ROWS_ALONG else "",
            xlim=(-0.04 * shown, shown),
            ylim=(-0.04 * shown, shown),
        )

    def curves(self, records: Mapping[str, Record]) -> Mapping[str, Curves]:
        if not self.known:
            return {}
        table = {"spacing over W [1]": self.spacings}
        for name in ARRANGEMENTS:
            runs = self._runs(records, name)
            table[f"{name}: error of u_x [1]"] = self.errors(records, name)
            peaks = [largest_stresses(record)[-1] for record in runs]
            table[f"{name}: largest principal Cauchy stress [Pa]"] = np.array(peaks)
        return {"errors": table}


def _scene_name(arrangement: str, count: int) -> str:
    return f"{arrangement.replace(' ', '-')}-{count}"

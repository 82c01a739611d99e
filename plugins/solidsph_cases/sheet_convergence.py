"""A sheet with a hole at rest, at ever smaller spacings: in rows and without any."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, final

import attrs
import numpy as np

from solidsph.errors import SceneError
from solidsph.maths.arrays import Array
from solidsph.registry.parameters import check_positive, number
from solidsph.maths.tensors import largest_principal
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.scene.scene_data import PartLike
from solidsph.studies.case import Case, Curves, Measurement
from solidsph_cases._compare import FINISHED, compared
from solidsph_cases._scheme import check_count, with_scheme
from solidsph_cases._sheet import (
    EXTENSION,
    PEAK,
    SOURCE,
    check_hole,
    extensions,
    is_known,
    peak_distance,
    quarter,
    rows_along,
)


@final
@attrs.frozen
class SheetConvergence(Case):
    """The convergence study that the authors ask for, on a quarter of the sheet.

    Three arrangements of particles: rows that follow the hole, rows that end at it with the
    outermost particles moved onto it, and the same with every particle inside moved at random.
    Of each the error against a quasi-static solution, which must fall at every refinement.
    """

    title: ClassVar[str] = "A sheet with a hole at rest: convergence"
    source: ClassVar[str] = (
        "Ismail & Reddy, section 5.4: a convergence analysis should be completed"
    )
    figures: ClassVar[tuple[str, ...]] = ("section-5.4-convergence",)
    sweep: ClassVar[Mapping[str, Sequence[Any]]] = {
        "across": ((5, 10), (10, 15), (15, 20), (20, 30)),
        "gradient": ("consistent", "quadratic", "corrected"),
    }

    hole_ratio: float = number(default=0.2)  # radius of the hole over W
    across: Sequence[int] = (20, 30, 40)  # spacings along W, growing
    width: float = number(default=1.0)  # W, side of the quarter [m]
    traction: float = number(default=5e6)  # on the undeformed edge [Pa]
    jitter: float = number(default=0.2)  # of the particles without rows [spacings]
    seed: int = 1  # of their random numbers
    kernel: str = "modified-mollifier"
    cover: float = number(default=3.0)  # [spacings]
    gradient: str = "consistent"
    hourglass: float = number(default=0.5)  # strength [-]; 0 names none
    engine: str = "auto"
    tolerance: float = number(default=0.01)  # largest error of the displacement that passes [-]
    peak_tolerance: float = number(default=0.1)  # largest error of the stress that passes [-]

    def __attrs_post_init__(self) -> None:
        for name, unit in (("width", "m"), ("traction", "Pa")):
            check_positive("sheet-convergence", name, getattr(self, name), unit)
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
    def arrangements(self) -> Mapping[str, Sequence[PartLike]]:
        """Discretisations by the name of the arrangement, one for each of `across`."""
        W = self.width
        jittered = {
            "type": "jittered",
            "of": "conforming-lattice",
            "amplitude": self.jitter,
            "seed": self.seed,
        }
        return {
            "rows along the hole": [rows_along(self.hole_ratio, W, W / n) for n in self.across],
            "rows up to the hole": ["conforming-lattice" for _ in self.across],
            "no rows": [jittered for _ in self.across],
        }

    def scenes(self) -> Mapping[str, Scene]:
        found = {}
        for name, discretisations in self.arrangements.items():
            for count, discretisation in zip(self.across, discretisations, strict=True):
                builder = (
                    quarter(self.hole_ratio, self.width, self.width / count, discretisation)
                    .title(f"{self.title}: {name}, spacing W/{count}")
                    .boundary("traction", where="right", traction={"x": self.traction})
                    .duration(1.0)
                    .statics()
                )
                found[_scene_name(name, count)] = with_scheme(builder, self).scene()
        return found

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        measured = []
        known = is_known(self.hole_ratio, self.traction)
        for name in self.arrangements:
            for count in self.across:
                record = records[_scene_name(name, count)]
                measured.append(
                    compared(
                        record,
                        f"{name}, W/{count}: mean u_x of the loaded edge over W",
                        float(extensions(record)[-1]) / self.width,
                        "1",
                        EXTENSION if known else None,
                        SOURCE,
                        self.tolerance,
                    )
                )
                measured.append(self._peak(record, f"{name}, W/{count}", known))
            if known:
                measured.append(self._order(records, name))
        return measured

    def accuracy(self, measurements: Sequence[Measurement]) -> Measurement:
        """The displacement in rows along the hole, the finest ones."""
        name, finest = next(iter(self.arrangements)), self.across[-1]
        return next(m for m in measurements if m.quantity.startswith(f"{name}, W/{finest}: mean"))

    def _peak(self, record: Record, name: str, known: bool) -> Measurement:
        """The largest stress, and whether it is where it must be."""
        stress = largest_principal(record.field("cauchy_stress")[-1])
        distance = peak_distance(record, self.radius, known)
        found = compared(
            record,
            f"{name}: largest principal Cauchy stress",
            1e-6 * stress.max(),
            "MPa",
            1e-6 * PEAK if known else None,
            SOURCE,
            self.peak_tolerance,
        )
        words = (found.verdict, f"{distance.value:.1f} spacings from (0, a)")
        return attrs.evolve(
            found,
            verdict=", ".join(word for word in words if word),
            passed=found.passed and distance.passed,
        )

    def errors(self, records: Mapping[str, Record], name: str) -> Array:
        """Relative errors of the displacement, one for each of `across`, (k,)."""
        values = [extensions(records[_scene_name(name, n)])[-1] for n in self.across]
        return np.abs(np.array(values) / self.width / EXTENSION - 1.0)

    def peaks(self, records: Mapping[str, Record], name: str) -> Array:
        """Largest principal Cauchy stresses, one for each of `across`, (k,) [Pa]."""
        stresses = [records[_scene_name(name, n)].field("cauchy_stress")[-1] for n in self.across]
        return np.array([largest_principal(one).max() for one in stresses])

    def _order(self, records: Mapping[str, Record], name: str) -> Measurement:
        errors = self.errors(records, name)
        falls = bool(np.all(np.diff(errors) < 0.0))
        return Measurement(
            quantity=f"{name}: order of the displacement's error in the spacing",
            value=float(-np.polyfit(np.log(self.across), np.log(errors), 1)[0]),
            unit="1",
            verdict="falls at every refinement" if falls else "does NOT fall at every refinement",
            passed=falls
            and all(records[_scene_name(name, n)].outcome == FINISHED for n in self.across),
        )

    def draw(self, records: Mapping[str, Record], folder: Path) -> Sequence[Path]:
        from solidsph_cases._convergence_picture import draw_convergence

        path = folder / "section-5.4-convergence.png"
        names = list(self.arrangements)
        known = is_known(self.hole_ratio, self.traction)
        draw_convergence(
            {name: records[_scene_name(name, self.across[0])] for name in names},
            {name: self.errors(records, name) for name in names if known},
            {name: self.peaks(records, name) for name in names},
            PEAK,
            1.0 / np.array(self.across, dtype=np.float64),
            radius=self.radius,
            width=self.width,
            title=f"{self.title}, radius of the hole {self.hole_ratio:g} W",
            path=path,
        )
        return [path]

    def curves(self, records: Mapping[str, Record]) -> Mapping[str, Curves]:
        if not is_known(self.hole_ratio, self.traction):
            return {}
        table = {"spacing over W [1]": 1.0 / np.array(self.across, dtype=np.float64)}
        for name in self.arrangements:
            table[f"{name}: error of u_x [1]"] = self.errors(records, name)
            table[f"{name}: largest principal Cauchy stress [Pa]"] = self.peaks(records, name)
        return {"errors": table}


def _scene_name(arrangement: str, count: int) -> str:
    return f"{arrangement.replace(' ', '-')}-{count}"

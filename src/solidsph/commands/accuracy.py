"""solidsph run --accuracy: the scene at the spacing that a search finds, with error bars."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, final

import attrs

from solidsph.commands.console import Table, sweep_progress
from solidsph.commands.cost_options import goal_of, seconds
from solidsph.commands.limit_tables import ESTIMATED, limit_rows, measured_table, with_warnings
from solidsph.results.error_bars import ErrorBar, write_error_bars
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.studies.cost import SweepSetup, find_best
from solidsph.studies.point import Point
from solidsph.studies.processes import Processes
from solidsph.studies.reference import Reference
from solidsph.studies.scene_case import SceneCase
from solidsph.studies.search import SearchResult
from solidsph.studies.variant import with_settings

_KEPT = "; what the search has run is kept, and the same command goes on from there"


@final
@attrs.frozen
class Accurate:
    """What the search for an accuracy has found."""

    wanted: str  # as it was asked for
    case: SceneCase
    result: SearchResult

    @property
    def best(self) -> Point | None:
        """The point that was chosen."""
        return self.result.point

    @property
    def scene(self) -> Scene:
        """The scene to run."""
        assert self.best is not None
        (scene,) = with_settings(self.case, self.best.settings).scenes().values()
        return scene

    @property
    def sentence(self) -> str:
        """What the search found, and what it spent."""
        spent = f"{self.result.sure}; the search took {self.result.spent:.3g} s of runs"
        if self.best is None:
            return f"{self.wanted} is not reached: {spent}"
        return f"{self.wanted} asked for, with {self.best.brief()}: {spent}"

    @property
    def facts(self) -> Mapping[str, Any]:
        """The same for programs."""
        return {
            "asked for": self.wanted,
            "found": None if self.best is None else dict(self.best.settings),
            "error": None if self.best is None else self.best.error,
            "tried": [{**p.settings, "error": p.error, "time [s]": p.time} for p in self.tried],
            "spent [s]": self.result.spent,
            "sure": self.result.sure,
            "estimated": limit_rows(self.result.limits),
        }

    @property
    def tried(self) -> Sequence[Point]:
        """All points of the search."""
        return self.result.tried

    def text(self) -> Iterator[Table | str]:
        """For people, where nothing was found."""
        judged = any(point.finished for point in self.tried)
        if judged:
            rows = [[p.label(), 100.0 * p.error, p.time, p.outcome] for p in self.tried]
            yield Table("tried", ["configuration", "error [%]", "time [s]", "outcome"], rows)
        else:
            yield from measured_table(self.tried)
        yield from with_warnings(ESTIMATED, limit_rows(self.result.limits))
        yield self.sentence
        remedy = "; ask for less, or give it more time by --longest" if judged else ""
        yield f"the scene itself was not run{remedy}"

    def write_bars(self, path: Path) -> Sequence[Mapping[str, Any]]:
        """Write the error bars into the record of the run, and give them as rows of a table."""
        limits = {limit.quantity: limit for limit in self.result.limits}
        if not limits:  # the scene has references
            return []
        assert self.best is not None
        bars, rows = {}, []
        with Record(path) as record:
            for quantity in self.case.quantities:
                limit, value = limits[quantity.name], quantity.value(record)
                error = limit.error(value, self.best.settings)
                bar = ErrorBar(value, error * limit.scale, limit.warning)
                bars[quantity.name] = bar
                rows.append(
                    {
                        "quantity": quantity.name,
                        "value": value,
                        "+-": bar.bar,
                        "+- [%]": 100.0 * error,
                        "warning": bar.warning,
                    }
                )
        write_error_bars(path, bars)
        return rows


def accurate(
    name: str,
    scene: Scene,
    wanted: str,
    *,
    of: Sequence[str],
    longest: str,
    folder: Path,
    shown: bool,
) -> Accurate:
    """Search for the quickest spacing of a scene that has an accuracy.

    Args:
        name: of the target, for the display.
        scene: its spacing is where the search begins.
        wanted: the accuracy, such as "1%".
        of: columns or probes; all probes if empty.
        longest: predicted time above which nothing is run.
        folder: of the points, so that the same command need not run them again.
        shown: whether progress is.

    Raises:
        SceneError: a text cannot be read.
    """
    goal = goal_of(wanted, None)
    assert goal is not None
    case = SceneCase.of(scene, of)
    with sweep_progress(name, shown) as watch:
        setup = SweepSetup(Processes(1), folder, 1, watch)
        try:
            result = find_best(case, goal, None, setup, longest=seconds(longest, "--longest"))
        except KeyboardInterrupt as interruption:
            interruption.add_note(_KEPT)  # there is no record yet
            raise
    return Accurate(wanted, case, result)


def beside_references(path: Path, references: Sequence[Reference]) -> Sequence[Mapping[str, Any]]:
    """Rows of a table: what a record has beside what it should have."""
    if not references:
        return []
    with Record(path) as record:
        measured = [reference.measurement(record) for reference in references]
    return [
        {
            "quantity": m.quantity,
            "value": m.value,
            "reference": m.reference,
            "error": m.error,
            "source": m.source,
            "as expected": m.passed,
        }
        for m in measured
    ]

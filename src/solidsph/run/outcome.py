"""Outcome and result of a run."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import attrs
from numpy.typing import ArrayLike

from solidsph.errors import SceneError
from solidsph.model.particles import State
from solidsph.system import html

if TYPE_CHECKING:
    from solidsph.probes.values import Values

FINISHED, INTERRUPTED = "finished", "interrupted"
"""Outcomes of a completed run, and of one interrupted by the user."""

UNSOUND = "unsound"
"""First word of the outcome of a completed run whose energies do not balance."""


def is_over(outcome: str) -> bool:
    """Whether a run with this outcome is complete, sound or not."""
    return outcome == FINISHED or outcome.startswith(UNSOUND)


@attrs.frozen(eq=False, repr=False)
class Result:
    """Result of a run."""

    state: State  # the last one
    record: Path | None  # the file written, if any
    seconds: float  # wall time, compilation and record included [s]
    effort: Mapping[str, Any]  # further costs: "quantity [unit]" -> number or bool
    final: Mapping[str, float] = attrs.field(factory=dict)  # columns of the last output
    notes: Sequence[str] = ()  # events of the run, as in the record
    _values_at: Callable[[State, ArrayLike, str | None], Values] | None = None
    _plot: Callable[[str, str], Any] | None = None  # of its record

    def at(self, points: ArrayLike, *, body: str | None = None) -> Values:
        """Displacement, velocity, F and stress at any points of the undeformed bodies, at the end.

        By interpolation of the second order up to the surface.

        Args:
            points: reference positions, (m, d) or (d,) [m].
            body: the body, where several touch; the one in which a point is deepest if None.

        Raises:
            SceneError: a point lies outside of every body.
        """
        if self._values_at is None:
            raise SceneError(
                "this result has come without its simulation; read values at points from its "
                "record, with Record.at"
            )
        return self._values_at(self.state, points, body)

    def plot(self, what: str = "motion", field: str = "cauchy_stress") -> Any:
        """A picture of the record, a figure of Matplotlib: as `Record.plot`.

        Raises:
            SceneError: the run was not recorded.
            RecordError: there is no such picture or field, or no probe.
        """
        if self._plot is None:
            raise SceneError("this run has no record to plot; run it with record = ...")
        return self._plot(what, field)

    def __repr__(self) -> str:
        where = "" if self.record is None else f", record {str(self.record)!r}"
        return f"Result(t = {self.state.time:.6g} s after {self.seconds:.3g} s{where})"

    def _repr_html_(self) -> str:
        """Table for notebooks."""
        known = {"wall time [s]": self.seconds, **self.effort}
        if self.record is not None:
            known["record"] = str(self.record)
        return (
            html.heading("Result", "; ".join(self.notes))
            + html.of_values(known)
            + (html.heading("at the end") + html.of_values(self.final) if self.final else "")
        )

    def __getstate__(self) -> dict[str, Any]:
        """All but the simulation, which does not travel between processes."""
        kept = {field.name: getattr(self, field.name) for field in attrs.fields(type(self))}
        return {**kept, "_values_at": None, "_plot": None}

    def __setstate__(self, kept: Mapping[str, Any]) -> None:
        for name, value in kept.items():
            object.__setattr__(self, name, value)

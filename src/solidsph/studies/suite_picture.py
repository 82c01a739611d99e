"""Picture of a suite of hard cases: wall time and grade of every trial."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure
from matplotlib.patches import Patch

from solidsph.studies.suite import Grade, Verdict

# Distinct in grey too.
_LOOKS: Mapping[Grade, Mapping[str, Any]] = {
    Grade.STABLE: {"facecolor": "0.75", "hatch": ""},
    Grade.DEGRADED: {"facecolor": "white", "hatch": "//"},
    Grade.FAILED: {"facecolor": "0.35", "hatch": ""},
}


def draw_suite(verdicts: Sequence[Verdict], title: str, path: Path) -> None:
    """Draw a bar for every trial; those that must fail are marked, unexpected ones bold."""
    figure = Figure(figsize=(11.0, 1.2 + 0.27 * len(verdicts)), layout="constrained")
    axes = figure.add_subplot()
    for row, v in enumerate(verdicts):
        axes.barh(row, v.seconds, edgecolor="black", linewidth=0.8, **_LOOKS[v.grade])
        mark = " (must fail)" if v.must_fail else " (known)" if v.known else ""
        axes.annotate(
            f"{v.grade.value}{mark}" + ("" if v.as_expected else ": NOT as expected"),
            (v.seconds, row),
            xytext=(4, 0),
            textcoords="offset points",
            va="center",
            fontsize=8,
            fontweight="normal" if v.as_expected else "bold",
        )
    axes.set_yticks(range(len(verdicts)), [f"{v.case}: {v.trial}" for v in verdicts])
    axes.tick_params(axis="y", labelsize=8)
    axes.invert_yaxis()
    axes.margins(x=0.2, y=0.01)
    axes.set_xlabel("wall time [s]")
    axes.legend(
        handles=[
            Patch(edgecolor="black", label=grade.value, **look) for grade, look in _LOOKS.items()
        ],
        loc="lower right",
        frameon=False,
    )
    figure.suptitle(title, fontsize=12)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=150)

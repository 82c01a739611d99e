"""Progress of a sweep or a search in a notebook."""

from __future__ import annotations

from typing import final

from solidsph.studies.sweep import StatusCallback, SweepStatus, ignore_status
from solidsph.system.progress_display import ProgressDisplay, progress_display, time_left


@final
class SweepProgress:
    """Callback that shows how many configurations have been run, and the last one."""

    def __init__(self, display: ProgressDisplay) -> None:
        self._display = display
        self._count = 0  # of all sweeps: a search is several

    def __call__(self, status: SweepStatus) -> None:
        done = status.total - status.remaining
        part = done / status.total if status.total else 1.0
        if status.point is None:
            self._display.show(part, time_left(status.seconds_left))
            return
        self._count += 1
        note = f"{self._count} run, the last with {status.point.label() or 'nothing changed'}"
        if status.remaining:
            self._display.show(part, f"{note}, {time_left(status.seconds_left)}")
        else:
            self._display.close(part, note)


def default_watch() -> StatusCallback:
    """In a notebook a display, elsewhere nothing."""
    display = progress_display("configurations")
    return ignore_status if display is None else SweepProgress(display)

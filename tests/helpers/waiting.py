"""Waiting for other processes: for what they do, never for how long they take."""

from __future__ import annotations

import time
from collections.abc import Callable

HANG = 1800.0
"""A test that waits for so long hangs [s]. It is the only limit of time in these tests, and half an
hour, so that no machine is too slow or too busy."""


def wait_for(condition: Callable[[], object]) -> None:
    """Return once the condition holds.

    Raises:
        TimeoutError: it never does.
    """
    end = time.monotonic() + HANG
    while not condition():
        if time.monotonic() > end:
            raise TimeoutError("the test hangs: what it waits for does not come")
        time.sleep(0.01)

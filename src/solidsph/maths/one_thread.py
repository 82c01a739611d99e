"""Linear algebra of many small steps, on one thread."""

from __future__ import annotations

from contextlib import AbstractContextManager
from functools import cache
from typing import cast

from threadpoolctl import ThreadpoolController


def one_thread() -> AbstractContextManager[object]:
    """Within it, libraries of linear algebra use one thread.

    Where steps are small and cores are busy, threads wait for each other a hundred times as long as
    they work.
    """
    return cast("AbstractContextManager[object]", _libraries().limit(limits=1))


@cache
def _libraries() -> ThreadpoolController:
    return ThreadpoolController()

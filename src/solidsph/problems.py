"""Problems: everything that is wrong with a scene, found before any of it is reported."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from typing import TypeVar

from solidsph.blame import told
from solidsph.errors import BuildError, PluginError, SolidsphError
from solidsph.registry import Entry

T = TypeVar("T")


_MEMORY = "there is not enough memory for so many particles or pairs; use a larger spacing"


class Problems:
    """Collects problems, each with its remedy, until it makes no sense to look further."""

    def __init__(self, used: Collection[Entry] = ()) -> None:
        self._found: list[str] = []
        self._used = used  # plugins that may be at fault; it may grow

    def add(self, problems: Iterable[str]) -> None:
        """Note some problems."""
        self._found += problems

    def attempt(self, make: Callable[..., T], *arguments: object) -> T | None:
        """The value of `make(*arguments)`, or None with its problem noted."""
        try:
            return make(*arguments)
        except BuildError as cause:
            self.add(cause.problems)
        except SolidsphError as cause:
            self.add([str(cause)])
        except MemoryError:
            self.add([_MEMORY])
        except Warning:  # where the user has asked for warnings to be errors
            raise
        except Exception as cause:  # a plugin's code may fail in any way
            owner = type(getattr(make, "__self__", make))
            otherwise = f"{owner.__module__}.{owner.__qualname__}"
            raise PluginError(told(cause, self._used, otherwise)) from cause
        return None

    def stop_if_any(self) -> None:
        """Raise BuildError with all problems noted so far, if there are any."""
        if self._found:
            raise BuildError(self._found)

    def settled(self, value: T | None) -> T:
        """A value that an attempt has made; raises BuildError with its problems if it has not."""
        if value is None:
            self.stop_if_any()
            raise AssertionError("an attempt gave no value and noted no problem")
        return value

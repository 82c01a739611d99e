"""A bare scene, measured at each of its spacings: its rows of the table, and what is wrong."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from functools import cache
from math import isnan, nan
from typing import final

import attrs

from solidsph.errors import SolidsphError
from tests.bare.registry import SCENES
from tests.bare.scene import Bare

HEADING = f"{'scene':29}{'error of':24}particles across: error [%] (bar)"


@final
@attrs.frozen
class Study:
    """What was measured of a scene."""

    scene: Bare
    errors: Mapping[int, Mapping[str, float]]  # by particles across, then by error
    failures: Mapping[int, str]  # why there are none
    seconds: float

    @classmethod
    def of(cls, scene: Bare) -> Study:
        """Measure a scene; what cannot be built or solved is a failure of its spacing alone."""
        errors: dict[int, Mapping[str, float]] = {}
        failures: dict[int, str] = {}
        start = time.perf_counter()
        for across in scene.across:
            try:
                errors[across] = scene.measure(across)
            except SolidsphError as failure:
                failures[across] = f"{type(failure).__name__}: {failure}"
        return cls(scene, errors, failures, time.perf_counter() - start)

    def history(self, name: str) -> Mapping[int, float]:
        """One of its errors by particles across; nan where there is none."""
        return {n: self.errors.get(n, {}).get(name, nan) for n in self.scene.across}

    def faults(self) -> Iterator[str]:
        """Everything that does not pass, in words."""
        for across, failure in self.failures.items():
            yield f"{across} across: {failure}"
        for name, bars in self.scene.bars.items():
            found = self.history(name)
            for across, bar in bars.items():
                if across not in self.failures and not abs(found[across]) <= bar:
                    off = f"{name} is off by {_percent(found[across])}"
                    yield f"{across} across: {off}, bar {_percent(bar)}"
            if name in self.scene.unordered:
                continue
            for (coarse, before), (fine, after) in zip(
                list(found.items())[:-1], list(found.items())[1:], strict=True
            ):
                if isnan(before) or isnan(after):
                    continue
                if abs(after) >= abs(before) and abs(after) > self.scene.floor:
                    yield (
                        f"{name} does not fall: {_percent(before)} at {coarse}, "
                        f"{_percent(after)} at {fine} across"
                    )

    def rows(self) -> Iterator[str]:
        """Rows of the table, one for each error that has a bar."""
        for i, (name, bars) in enumerate(self.scene.bars.items()):
            cells = []
            for across, error in self.history(name).items():
                cell = f"{across}: {'failed' if isnan(error) else _percent(error)}"
                cells.append(cell + (f" ({_percent(bars[across])})" if across in bars else ""))
            label = self.scene.name if i == 0 else ""
            yield f"{label:29}{name:24}" + "".join(f"{cell:26}" for cell in cells).rstrip()


@cache
def studied(name: str) -> Study:
    """The study of a registered scene, once a process."""
    return Study.of(SCENES[name])


def _percent(share: float) -> str:
    return "exact" if abs(share) < 1e-6 else f"{100.0 * share:.3g}"

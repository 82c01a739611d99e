"""The last row of the history of a run that nobody records."""

from __future__ import annotations

from collections.abc import Mapping
from typing import final

from solidsph.interfaces.terms import Observation
from solidsph.results.output_fields import history
from solidsph.run.built_scene import BuiltScene
from solidsph.run.energy import kinetic_energy, strain_energy
from solidsph.run.hooks import implementation


@final
class LastRow:
    """Keeps the last output of a run, to give the columns that a record would have of it."""

    def __init__(self) -> None:
        self._initial_energy = 0.0  # [J]
        self._last: tuple[BuiltScene, Observation] | None = None

    @implementation
    def solidsph_step_end(self, simulation: BuiltScene, observation: Observation) -> None:
        if self._last is None:
            self._initial_energy = kinetic_energy(observation) + strain_energy(observation)
        self._last = simulation, observation

    def columns(self) -> Mapping[str, float]:
        """Columns "quantity [unit]" at the last output; empty if there was none."""
        if self._last is None:
            return {}
        simulation, observation = self._last
        terms = (*simulation.terms, *simulation.probes)
        return history(observation, self._initial_energy, terms)

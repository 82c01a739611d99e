"""Watchdog: an observer that looks for symptoms, stops a run that is lost, and says why."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import attrs

from solidsph.errors import DivergedError, RecordError
from solidsph.interfaces.terms import Observation
from solidsph.model.particles import State
from solidsph.run.accounts import Accounts
from solidsph.run.hooks import implementation
from solidsph.watch.crowding import CollapsingNeighbours
from solidsph.watch.hourglass import StoredBesides
from solidsph.watch.soundness import allowed, part_of_play
from solidsph.watch.speed import FasterThanSound
from solidsph.watch.symptom import Finding, Grade, Symptom
from solidsph.watch.volume import VanishingVolume

if TYPE_CHECKING:
    from solidsph.maths.arrays import Array
    from solidsph.run.built_scene import BuiltScene

SYMPTOMS: Sequence[Symptom] = (
    VanishingVolume(),
    FasterThanSound(),
    CollapsingNeighbours(),
    StoredBesides(),
)
"""What is looked for unless something else is asked for."""

_ACCOUNTS = "watchdog accounts"


@attrs.frozen(eq=False)
class Good:
    """An output at which nothing was wrong, and what listeners keep of it."""

    state: State
    kept: Mapping[str, Array]


class Watchdog:
    """Looks at every output of a run; a failure stops it with the particle, cause and remedy.

    A recorded run that is stopped leaves its last sound output as a checkpoint, and a picture of
    what surrounds the particle, at `picture`.

    Attributes:
        findings: time [s] and finding, of every output that had one.
        good: the last output without any finding and whose energies add up; or if there is none,
            without a failure.

    Args:
        symptoms: what to look for.
        picture: the file to draw a failure to, if one is wanted.
        told: called with the time [s] of every finding, and the finding.
    """

    def __init__(
        self,
        symptoms: Sequence[Symptom] = SYMPTOMS,
        *,
        picture: Path | None = None,
        told: Callable[[float, Finding], None] = lambda time, finding: None,
    ) -> None:
        self.findings: list[tuple[float, Finding]] = []
        self.good: Good | None = None
        self._symptoms = tuple(symptoms)
        self._picture = picture
        self._told = told
        self._accounts = Accounts()
        self._looked: dict[Symptom, int] = {}  # the step of the last look
        self._is_clean = False  # whether nothing at all was wrong with `good`

    @implementation(tryfirst=True)  # what it cannot use is told before the record is taken over
    def solidsph_resume(
        self, simulation: BuiltScene, observation: Observation, kept: Mapping[str, Array]
    ) -> None:
        if _ACCOUNTS in kept:
            self._accounts = Accounts.from_array(kept[_ACCOUNTS])
        else:  # nobody watched until here
            self._accounts.add(observation)
        self.good, self._is_clean = Good(observation.state, kept), True

    @implementation
    def solidsph_step_end(self, simulation: BuiltScene, observation: Observation) -> None:
        self._accounts.add(observation)
        looks = (
            one.look(simulation, observation, self._accounts)
            for one in self._symptoms
            if self._is_due(one, simulation, observation.state.step)
        )
        found = [one for one in looks if one is not None]
        state = observation.state
        self.findings += [(state.time, one) for one in found]
        for one in found:
            self._told(state.time, one)
        for one in found:
            if one.grade is Grade.FAILURE:
                raise self._failed(simulation, observation, one)
        is_clean = not found and part_of_play(simulation, self._accounts) <= allowed(simulation)
        if is_clean or not self._is_clean:
            kept: dict[str, Array] = {}
            simulation.manager.hook.solidsph_keep(simulation=simulation, kept=kept)
            self.good, self._is_clean = Good(state, kept), is_clean

    def _is_due(self, symptom: Symptom, simulation: BuiltScene, step: int) -> bool:
        due = step - self._looked.get(symptom, 0) >= symptom.steps_between
        if due or step == simulation.steps:
            self._looked[symptom] = step
            return True
        return False

    @implementation
    def solidsph_keep(self, simulation: BuiltScene, kept: dict[str, Array]) -> None:
        kept[_ACCOUNTS] = self._accounts.to_array()

    @implementation
    def solidsph_failure(self, simulation: BuiltScene, state: State, error: DivergedError) -> None:
        # The run has found out for itself; what it does not know is what came before.
        if self.findings:
            time, before = self.findings[-1]
            error.remedy = before.remedy
            error.cause += f" (before, at t = {time:.6g} s: {before.cause})"
        self._draw(simulation, state, error)

    def _failed(
        self, simulation: BuiltScene, observation: Observation, found: Finding
    ) -> DivergedError:
        state = observation.state
        error = DivergedError(
            step=state.step,
            time=state.time,
            particle=found.particle,
            volume_ratio=float(observation.volume_ratios[found.particle]),
            cause=found.cause,
            remedy=found.remedy,
        )
        self._draw(simulation, state, error)
        return error

    def _draw(self, simulation: BuiltScene, state: State, error: DivergedError) -> None:
        if self._picture is None:
            return
        from solidsph.watch.picture import draw_failure  # brings matplotlib with it

        try:
            draw_failure(simulation, state, error, self._picture)
        except (OSError, RecordError):
            return  # a picture that cannot be written must not hide what it would have shown

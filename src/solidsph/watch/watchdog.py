"""Watchdog: an observer that looks for symptoms, stops a run that has failed, and says why."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import attrs

from solidsph.errors import DivergedError, RecordError
from solidsph.interfaces.terms import Observation
from solidsph.maths.arrays import Array
from solidsph.model.particles import State
from solidsph.run.accounts import Accounts
from solidsph.run.built_scene import BuiltScene
from solidsph.run.hooks import implementation
from solidsph.watch.collapsing_neighbours import CollapsingNeighbours
from solidsph.watch.faster_than_sound import FasterThanSound
from solidsph.watch.hourglass_energy import HourglassEnergy
from solidsph.watch.passing_through import PassingThrough
from solidsph.watch.soundness import residual_share, tolerance
from solidsph.watch.symptom import Finding, Grade, Symptom
from solidsph.watch.vanishing_volume import VanishingVolume

SYMPTOMS: Sequence[Symptom] = (
    VanishingVolume(),
    FasterThanSound(),
    CollapsingNeighbours(),
    HourglassEnergy(),
    PassingThrough(),
)
"""Symptoms that are looked for by default."""

_ACCOUNTS = "watchdog accounts"


@attrs.frozen(eq=False)
class SoundOutput:
    """An output at which nothing was wrong, and the arrays that observers keep of it."""

    state: State
    kept: Mapping[str, Array]
    halvings: int  # of the step with which it was reached


class Watchdog:
    """Looks at every output of a run; a failure stops it with the particle, cause and remedy.

    A recorded run that is stopped leaves its last sound output as a checkpoint, and a picture of
    the particle's surroundings, at `picture`.

    Attributes:
        findings: time [s] and finding, of every output that had one.
        last_sound: the last output without a finding and with energies that add up; or if there is
            none, without a failure.
        simulation: what ran last, whose step may be shorter than at the start.

    Args:
        symptoms: what to look for.
        picture: the file to draw a failure to, if one is wanted.
        on_finding: called with the time [s] of every finding, and the finding.
    """

    def __init__(
        self,
        symptoms: Sequence[Symptom] = SYMPTOMS,
        *,
        picture: Path | None = None,
        on_finding: Callable[[float, Finding], None] = lambda time, finding: None,
    ) -> None:
        self.findings: list[tuple[float, Finding]] = []
        self.last_sound: SoundOutput | None = None
        self.simulation: BuiltScene | None = None
        self._symptoms = tuple(symptoms)
        self._picture = picture
        self._on_finding = on_finding
        self._accounts = Accounts()
        self._looked: dict[Symptom, int] = {}  # the step of the last look
        self._is_clean = False  # whether nothing at all was wrong with `last_sound`

    @implementation(tryfirst=True)  # an unusable checkpoint is reported before the record changes
    def solidsph_resume(
        self, simulation: BuiltScene, observation: Observation, kept: Mapping[str, Array]
    ) -> None:
        self.simulation = simulation
        if _ACCOUNTS in kept:
            self._accounts = Accounts.from_array(kept[_ACCOUNTS])
        else:  # the earlier run had no watchdog
            self._accounts.add(observation)
        sound = SoundOutput(observation.state, kept, simulation.halvings)
        self.last_sound, self._is_clean = sound, True

    @implementation
    def solidsph_step_end(self, simulation: BuiltScene, observation: Observation) -> None:
        self.simulation = simulation
        self._accounts.add(observation)
        state = observation.state
        looks = (
            symptom.look(simulation, observation, self._accounts)
            for symptom in self._symptoms
            if self._is_due(symptom, simulation, state.step)
        )
        findings = [finding for finding in looks if finding is not None]
        self.findings += [(state.time, finding) for finding in findings]
        for finding in findings:
            self._on_finding(state.time, finding)
        for finding in findings:
            if finding.grade is Grade.FAILURE:
                raise self._failed(simulation, observation, finding)
        adds_up = residual_share(simulation, self._accounts) <= tolerance(simulation)
        is_clean = adds_up and not findings
        if is_clean or not self._is_clean:
            kept: dict[str, Array] = {}
            simulation.manager.hook.solidsph_keep(simulation=simulation, kept=kept)
            self.last_sound = SoundOutput(state, kept, simulation.halvings)
            self._is_clean = is_clean

    def _is_due(self, symptom: Symptom, simulation: BuiltScene, step: int) -> bool:
        due = step - self._looked.get(symptom, 0) >= symptom.steps_between
        if due or step == simulation.steps:
            self._looked[symptom] = step
            return True
        return False

    @implementation
    def solidsph_keep(self, kept: dict[str, Array]) -> None:
        kept[_ACCOUNTS] = self._accounts.to_array()

    @implementation
    def solidsph_failure(self, simulation: BuiltScene, state: State, error: DivergedError) -> None:
        self.simulation = simulation
        # The run has failed by itself; what it does not know is what came before.
        if self.findings:
            time, before = self.findings[-1]
            error.remedy = before.remedy
            error.cause += f" (before, at t = {time:.6g} s: {before.cause})"
        self._draw(simulation, state, error)

    def _failed(
        self, simulation: BuiltScene, observation: Observation, finding: Finding
    ) -> DivergedError:
        error = DivergedError(
            step=observation.state.step,
            time=observation.state.time,
            particle=finding.particle,
            volume_ratio=float(observation.volume_ratios[finding.particle]),
            cause=finding.cause,
            remedy=finding.remedy,
        )
        self._draw(simulation, observation.state, error)
        return error

    def _draw(self, simulation: BuiltScene, state: State, error: DivergedError) -> None:
        if self._picture is None:
            return
        from solidsph.watch.picture import draw_failure  # brings matplotlib with it

        try:
            draw_failure(simulation, state, error, self._picture)
        except (OSError, RecordError):
            return  # a picture that cannot be written must not hide the error that it shows

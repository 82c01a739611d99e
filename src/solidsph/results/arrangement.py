"""Arrangement: a scene before it runs, as a picture shows it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import final

import attrs

from solidsph.interfaces.discrete_model import DiscreteModel
from solidsph.interfaces.marks import Mark
from solidsph.scene.scene_data import ProbeScene


@final
@attrs.frozen(eq=False)
class Arrangement:
    """Bodies, and what is imposed on them and measured."""

    title: str
    model: DiscreteModel
    marks: Mapping[str, Sequence[Mark]]  # of boundaries, effects and initial values, by label
    probes: Sequence[ProbeScene]

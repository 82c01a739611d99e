"""Cases run on the recommended scheme: what their scenes name of it is what they say they study."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import attrs
import pytest

from solidsph import Case, Measurement, Simulation
from solidsph.registry import registry
from solidsph.results.record import Record
from solidsph.scene.scene import Scene
from solidsph.studies.scene_words import WORDS, changed, named
from solidsph.studies.variant import with_settings


def named_by(case: Case) -> set[str]:
    """Words of the scheme in the scenes of a case as it is."""
    return {word for scene in case.scenes().values() for word in named(scene)}


def undeclared(cls: type[Case]) -> set[str]:
    """Words that a case names in its scenes, or in trials that must come through, unsaid."""
    trials = [trial for trial in cls.trials.values() if not trial.must_fail]
    hard = [with_settings(cls(), trial.settings) for trial in trials]
    return set().union(*map(named_by, [cls(), *hard])) - set(cls.studies)


# Every case that is installed, a third party's too.
@pytest.mark.parametrize("name", registry.names("cases"))
def test_a_case_names_no_more_of_the_scheme_than_it_studies(name: str) -> None:
    cls = registry.load("cases", name)
    assert undeclared(cls) == set(), "say in `studies` why, or leave it to the scheme"
    assert all(cls.studies.values())
    # Nor does it claim more than it names.
    every = [cls(), *(with_settings(cls(), trial.settings) for trial in cls.trials.values())]
    used = set()
    for case in every:
        used |= named_by(case)
    assert set(cls.studies) <= used


@attrs.frozen
class Bar(Case):
    """A bar at rest with whatever words a test adds."""

    title: ClassVar[str] = "a bar"
    source: ClassVar[str] = "nothing"
    words: Mapping[str, Any] = attrs.field(factory=dict)

    def scenes(self) -> Mapping[str, Scene]:
        scene = (
            Simulation.builder()
            .body("bar", shape={"type": "interval", "length": 1.0}, spacing=0.1)
            .material("linear-elastic", youngs_modulus=1.0, poissons_ratio=0.3, density=1.0)
            .duration(1.0)
            .scene()
        )
        for word, value in self.words.items():
            scene = changed(scene, word, value)
        return {"bar": scene}

    def measure(self, records: Mapping[str, Record]) -> Sequence[Measurement]:
        return []


VALUES = {
    "scheme": "paper",
    "discretisation": "lattice",
    "kernel": "gaussian",
    "cover": 3.0,
    "formulation": "updated-lagrangian",
    "gradient": "corrected",
    "divergence": "plain",
    "hourglass": 0.5,
    "integrator": "central-difference",
    "time_step_factor": 0.5,
    "time_step": 1e-3,
}


@pytest.mark.parametrize("word", VALUES)
def test_every_word_of_the_scheme_is_noticed(word: str) -> None:
    assert named_by(Bar()) == set()
    assert word in named_by(Bar({word: VALUES[word]}))
    assert WORDS[word].read(Bar({word: VALUES[word]}).scenes()["bar"]) == VALUES[word]


def test_a_word_by_its_side_is_not_named() -> None:
    assert named_by(Bar({"gradient": "corrected"})) == {"gradient"}
    assert named_by(Bar({"hourglass": 0.5})) == {"hourglass"}
    # What is taken away is not named.
    (scene,) = Bar({"hourglass": 0.5}).scenes().values()
    assert named(changed(scene, "hourglass", 0.0)) == frozenset()
    # Nor is what is no part of a scheme.
    assert named_by(Bar({"body-force.acceleration": {"x": 1.0}, "engine": "matrix"})) == set()

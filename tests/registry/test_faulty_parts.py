"""A part that is wrong is named, with its distribution and what was expected."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from solidsph import BuildError, PluginError, Simulation
from solidsph.errors import PartWarning
from solidsph.run.hooks import implementation
from solidsph.scene.scene_builder import SceneBuilder
from solidsph.testing import checks
from tests.helpers import faulty
from tests.helpers.faulty import SOFT, bed
from tests.helpers.scenes import box


def thrown(builder: SceneBuilder) -> SceneBuilder:
    return builder.initial(velocity={"x": "X"}).duration(5e-3).outputs(4)


def with_particles(name: str, value: Any) -> SceneBuilder:
    return thrown(box(2, 5, discretisation=faulty.Odd(name, value)))


REFUSED = {
    "bind returns None": (thrown(box(2, 5)).effect(faulty.BindsNothing()), "returned None"),
    "bind returns text": (thrown(box(2, 5)).effect(faulty.BindsText()), "returned 'springs'"),
    "no damping rate": (bed(damping=None), "damping_rate is None"),
    "a negative rate": (bed(damping=-1.0), "damping_rate is -1.0"),
    "a rate that is no number": (bed(damping="fast"), "damping_rate is 'fast'"),
    "a force that broadcasts": (bed(kind=faulty.Broadcast), r"shape \(2,\)"),
    "energies that broadcast": (bed(kind=faulty.OneForAll), r"shape \(\)"),
    "no wave speed": (thrown(box(2, 5)).material(faulty.Weightless(**SOFT)), "wave_speed is nan"),
    "a negative volume": (with_particles("volumes", -1.0), "volume of particle 3 is -1"),
    "a volume of zero": (with_particles("volumes", 0.0), "volume of particle 3 is 0"),
    "a place nowhere": (with_particles("positions", np.inf), "positions of particle 3"),
    "no spacing": (with_particles("spacings", np.nan), "spacings of particle 3"),
    "no particles": (
        thrown(box(2, 5, discretisation=faulty.NoParticles("volumes", 0.0))),
        "must return Particles",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
@pytest.mark.filterwarnings("ignore::solidsph.errors.PartWarning")
def test_what_cannot_be_used_is_refused_at_the_build(name: str) -> None:
    builder, told = REFUSED[name]
    with pytest.raises(BuildError, match=told) as caught:
        builder.build()
    assert "Assembler" not in str(caught.value)


FAILING = {
    "a report that is no number": (bed(kind=faulty.NoNumber), "is not finite"),
    "a report that writes positions": (bed(kind=faulty.Writes), "faulty:Bed.*read-only"),
    "a report that writes masses": (bed(kind=faulty.WritesMasses), "faulty:Bed.*read-only"),
    "an error inside a step": (bed(kind=faulty.Fails), "faulty:Bed.*ZeroDivisionError"),
    "time stands still": (
        thrown(box(2, 5)).integrator(faulty.StandsStill()),
        "StandsStill.*from step 0, t = 0 s, to step 0",
    ),
    "time is set to zero": (thrown(box(2, 5)).integrator(faulty.BackToZero()), "BackToZero.*t = 0"),
    "time runs backwards": (thrown(box(2, 5)).integrator(faulty.Backwards()), "Backwards.*t = -"),
}


@pytest.mark.parametrize("name", FAILING)
@pytest.mark.filterwarnings("ignore::solidsph.errors.PartWarning")
def test_what_fails_in_the_run_is_named(name: str, tmp_path: Path) -> None:
    builder, told = FAILING[name]
    with pytest.raises(PluginError, match=told):
        builder.build().run(record=tmp_path / "run.h5")


@pytest.mark.parametrize(
    ("builder", "told"),
    [
        (thrown(box(2, 5)).material(faulty.HalfTheStress(**SOFT)), "HalfTheStress.*stress"),
        (bed(kind=faulty.HalfOfIt), "the stored energy changes by"),
        (bed(declared=0.1, stiffness=1e6), "stiffness_rate is 15.8"),
        (thrown(box(2, 5)).integrator(faulty.BackToZero()), "BackToZero.*bookkeeping"),
    ],
)
def test_the_first_use_asks_cheap_properties(builder: SceneBuilder, told: str) -> None:
    with pytest.warns(PartWarning, match=told):
        builder.build()


def test_sound_parts_are_used_without_a_word() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        bed().build().run()
        box(2, 5).build()


def test_half_of_an_energy_is_not_certified() -> None:
    (energy,) = [one for one in checks("effects") if one.__name__ == "stored_energy"]
    assert energy(faulty.Bed()).measured == "force from its energy"
    assert "differs from the energy's derivative" in energy(faulty.Bed(faulty.HalfOfIt)).measured
    assert not energy(faulty.Bed(faulty.HalfOfIt)).passed
    assert not energy(faulty.Bed(faulty.OneForAll)).passed


class Meddler:
    """An observer that writes where it should look."""

    def __init__(self, name: str) -> None:
        self._name = name

    @implementation
    def solidsph_step_end(self, simulation: Simulation, observation: Any) -> None:
        thing: Any = observation
        for part in self._name.split("."):
            thing = getattr(thing, part)
        thing[:] = 0.0


@pytest.mark.parametrize(
    "name",
    [
        "state.positions",
        "state.velocities",
        "state.accelerations",
        "masses",
        "particles.positions",
        "particles.volumes",
    ],
)
def test_observers_look_and_do_not_write(name: str) -> None:
    with pytest.raises(ValueError, match="read-only"):
        thrown(box(2, 5)).build().run(observers=[Meddler(name)])

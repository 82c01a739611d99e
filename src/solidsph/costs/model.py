"""The cost model: from a run's work and a machine's calibration to seconds and bytes."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from math import ceil

import attrs

from solidsph.costs import terms
from solidsph.costs.calibration import Calibration
from solidsph.costs.coefficients import COEFFICIENTS
from solidsph.costs.terms import CostTerm, Yard
from solidsph.costs.work import Loop, Work
from solidsph.interfaces.plan import Compilation, SumMethod

# Not in the fit yet, which will bring them when it is next made: what a step takes more with a
# constant force, or one by a particle's own motion, over the particles that it acts on.
_APART = {
    "compiled step loaded particle 1D": 1.1,
    "compiled step loaded particle 2D": 1.5,
    "compiled step loaded particle 3D": 2.5,
}

# Ways that form their weights at every evaluation: what is not known is not taken to be so dear.
_ANEW = (SumMethod.PRODUCTS_ANEW, SumMethod.FORMULAS, SumMethod.WEIGHTS)


@attrs.frozen
class Built:
    """What the build of a scene took, seen from outside."""

    seconds: float
    peak: int  # of the process until then [bytes]
    left: int  # in use when it was done [bytes]


@attrs.frozen
class Prediction:
    """What a run is expected to take."""

    work: Work
    build: float  # [s]; measured, if the scene was built to be looked at
    compiling: float  # [s]
    steps: float  # all of them, in time or of Newton's method [s]
    outputs: float  # observations and their record [s]
    memory: int  # peak of the process [bytes]
    measured_build: bool

    @property
    def seconds(self) -> float:
        """From the beginning of the build to the end of the run."""
        return self.build + self.run_seconds

    @property
    def run_seconds(self) -> float:
        """Of the run, its build not counted."""
        return self.compiling + self.steps + self.outputs

    @property
    def parts(self) -> Mapping[str, float]:
        """Seconds by what they are spent on."""
        return {
            "build": self.build,
            "compile": self.compiling,
            "steps": self.steps,
            "outputs": self.outputs,
        }

    @property
    def limit(self) -> str:
        """What takes most of the time."""
        return max(self.parts, key=lambda name: self.parts[name])


def predicted(
    work: Work,
    machine: Calibration,
    *,
    built: Built | None = None,
    compiled: Collection[Compilation] = (),
    besides: float = 0.0,
) -> Prediction:
    """What a run of this work takes on this machine.

    Args:
        work: counted, or estimated.
        machine: its calibration.
        built: what the build took, if there was one; otherwise it is predicted too.
        compiled: what this process has compiled before.
        besides: seconds of every evaluation that `work` does not count, since they were timed.
    """
    new = attrs.evolve(work, compilations=work.compilations - frozenset(compiled))
    return Prediction(
        work=work,
        build=_seconds(terms.build_terms(new), machine) if built is None else built.seconds,
        compiling=_seconds(terms.compile_terms(new), machine),
        steps=_stepping(work, machine) + work.evaluations * besides,
        outputs=work.outputs * _seconds(terms.output_terms(work), machine)
        + _seconds(terms.start_terms(work), machine),
        memory=_memory(new, machine, built),
        measured_build=built is not None,
    )


def step_seconds(work: Work, machine: Calibration, threads: int | None = None) -> float:
    """Time of one step, by as many threads as there are cores, or by so many [s]."""
    count = machine.threads if threads is None else threads
    single = _seconds(terms.step_terms(work), machine)
    shared = _seconds(terms.shared_terms(work), machine)
    # No step is faster than memory: what is touched is read, where a copy reads and writes.
    copying = machine.copying if count == 1 else machine.copying_shared
    return max(single - shared + shared / terms.together(count), 0.5 * copying * work.touched)


def _stepping(work: Work, machine: Calibration) -> float:
    if work.loop is Loop.NEWTON and work.statics is not None:
        return work.statics.iterations * _seconds(terms.iteration_terms(work), machine)
    return work.evaluations * step_seconds(work, machine)


def _memory(work: Work, machine: Calibration, built: Built | None) -> int:
    run = _sum(terms.run_memory(work), machine)
    if built is not None:
        return max(built.peak, built.left + ceil(run))
    build = _sum(terms.build_memory(work), machine)
    # Beside the engine's arrays there are the particles and the first state.
    arrays = 8 * work.particles * (5 * work.dimension + 4)
    left = _sum(terms.left_memory(work), machine) + work.held + arrays
    return machine.bare + ceil(max(build, left + run))


def _seconds(some: Iterable[CostTerm], machine: Calibration) -> float:
    return _sum(some, machine)


def _sum(some: Iterable[CostTerm], machine: Calibration) -> float:
    return sum(coefficient(one.name) * one.count * _unit(one.yard, machine) for one in some)


def coefficient(name: str) -> float:
    """The coefficient of that name, or of what is most like it among those that were measured.

    Sums in single precision are like those in double; of a way that is not known, like the dearest
    that compiled loops or arrays have in that dimension.
    """
    if name in COEFFICIENTS:
        return COEFFICIENTS[name]
    if name in _APART:
        return _APART[name]
    words = [word for word in name.split() if not word.startswith("float")]
    if " ".join(words) in COEFFICIENTS:
        return COEFFICIENTS[" ".join(words)]
    several = [
        COEFFICIENTS.get(" ".join([way.name, *words[1:]]), 0.0)
        for way in SumMethod
        if words[0] in SumMethod.__members__ and way not in _ANEW
    ]
    return max(several, default=0.0)


def _unit(yard: Yard, machine: Calibration) -> float:
    return 1.0 if yard is Yard.BYTES else float(getattr(machine, yard.value))

"""Cost model: time and memory of a run from its work and the calibration of a machine."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from math import ceil

import attrs

from solidsph.costs import terms
from solidsph.costs.calibration import Calibration
from solidsph.costs.coefficients import COEFFICIENTS
from solidsph.costs.terms import CostTerm
from solidsph.costs.work import Loop, Work
from solidsph.interfaces.plan import Compilation, SumMethod

# Not part of the fit yet: the additional cost of a step per particle on which a constant or
# pointwise force acts, and
_UNFITTED = {
    "compiled step loaded particle 1D": 1.1,
    "compiled step loaded particle 2D": 1.5,
    "compiled step loaded particle 3D": 2.5,
    # Of equilibria by iteration: a new tangent and its coarse spaces, and the preconditioner with
    # each product. 2700 to 31 000 particles took 1.4e4 to 2.6e4, and 160 to 180 each time.
    "linearised particle 1D": 1.8e4,
    "linearised particle 2D": 1.8e4,
    "linearised particle 3D": 1.8e4,
    "preconditioned particle 1D": 170.0,
    "preconditioned particle 2D": 170.0,
    "preconditioned particle 3D": 170.0,
}

# Ways that form their weights at every evaluation, too expensive to stand for an unknown way.
_ANEW = (SumMethod.PRODUCTS_ANEW, SumMethod.FORMULAS, SumMethod.WEIGHTS)


# Evaluations of the forces by which a motion's build finds its step: the mean of `run.safe_step`.
_OF_THE_STEP = 15


@attrs.frozen
class Built:
    """Measured cost of a build."""

    seconds: float
    peak: int  # largest memory of the process until its end [bytes]
    left: int  # in use at its end [bytes]


@attrs.frozen
class Prediction:
    """Predicted time and memory of a run."""

    work: Work
    build: float  # [s]; measured if the scene was built
    compiling: float  # [s]
    steps: float  # all time steps, or iterations of Newton's method [s]
    outputs: float  # observation and record [s]
    memory: int  # peak of the process [bytes]
    measured_build: bool

    @property
    def seconds(self) -> float:
        """Time from the beginning of the build to the end of the run [s]."""
        return self.build + self.run_seconds

    @property
    def run_seconds(self) -> float:
        """Time of the run without its build [s]."""
        return self.compiling + self.steps + self.outputs

    @property
    def parts(self) -> Mapping[str, float]:
        """Time by stage [s]."""
        return {
            "build": self.build,
            "compile": self.compiling,
            "steps": self.steps,
            "outputs": self.outputs,
        }

    @property
    def limit(self) -> str:
        """Stage that takes most of the time."""
        return max(self.parts, key=lambda name: self.parts[name])


def predict(
    work: Work,
    machine: Calibration,
    *,
    built: Built | None = None,
    compiled: Collection[Compilation] = (),
    extra: float = 0.0,
) -> Prediction:
    """Predict the time and memory of a run.

    Args:
        work: counted or estimated.
        machine: calibration of the machine.
        built: measured cost of the build; predicted if None.
        compiled: functions that this process has compiled already.
        extra: measured time per evaluation of what `work` does not count [s].
    """
    new = attrs.evolve(work, compilations=work.compilations - frozenset(compiled))
    return Prediction(
        work=work,
        build=_building(new, machine, extra) if built is None else built.seconds,
        compiling=_total(terms.compile_terms(new), machine),
        steps=_stepping(work, machine) + work.evaluations * extra,
        outputs=work.outputs * _total(terms.output_terms(work), machine)
        + _total(terms.start_terms(work), machine),
        memory=_memory(new, machine, built),
        measured_build=built is not None,
    )


def step_seconds(work: Work, machine: Calibration, threads: int | None = None) -> float:
    """Predicted time of one step [s], on all threads of the machine by default."""
    count = machine.threads if threads is None else threads
    single = _total(terms.step_terms(work), machine)
    shared = _total(terms.shared_terms(work), machine)
    # Memory bandwidth is a lower bound; a copy both reads and writes, hence the factor.
    copying = machine.copying if count == 1 else machine.copying_shared
    return max(single - shared + shared / terms.speedup(count), 0.5 * copying * work.touched)


def _building(work: Work, machine: Calibration, extra: float) -> float:
    seconds = _total(terms.build_terms(work), machine)
    if work.loop is not Loop.NEWTON:
        seconds += _OF_THE_STEP * (step_seconds(work, machine) + extra)
    return seconds


def _stepping(work: Work, machine: Calibration) -> float:
    if work.loop is Loop.NEWTON and work.statics is not None:
        statics = work.statics
        seconds = statics.iterations * _total(terms.iteration_terms(work), machine)
        if statics.products:  # each is two passes over the neighbours, as an evaluation
            once = step_seconds(work, machine) + _total(terms.product_terms(work), machine)
            seconds += statics.products * once
        return seconds
    return work.evaluations * step_seconds(work, machine)


def _memory(work: Work, machine: Calibration, built: Built | None) -> int:
    run = _total(terms.run_memory(work), machine)
    if built is not None:
        return max(built.peak, built.left + ceil(run))
    build = _total(terms.build_memory(work), machine)
    # Particles and initial state, beside the engine's arrays.
    arrays = 8 * work.particles * (5 * work.dimension + 4)
    left = _total(terms.left_memory(work), machine) + work.held + arrays
    return machine.bare + ceil(max(build, left + run))


def _total(several: Iterable[CostTerm], machine: Calibration) -> float:
    return sum(coefficient(t.name) * t.count * t.unit.size(machine) for t in several)


def coefficient(name: str) -> float:
    """Coefficient `name`, or the closest one that was measured.

    Single precision falls back on double precision, and an unknown way on the most expensive one
    of its kind and dimension.
    """
    if name in COEFFICIENTS:
        return COEFFICIENTS[name]
    if name in _UNFITTED:
        return _UNFITTED[name]
    words = [word for word in name.split() if not word.startswith("float")]
    if " ".join(words) in COEFFICIENTS:
        return COEFFICIENTS[" ".join(words)]
    candidates = [
        COEFFICIENTS.get(" ".join([way.name, *words[1:]]), 0.0)
        for way in SumMethod
        if words[0] in SumMethod.__members__ and way not in _ANEW
    ]
    return max(candidates, default=0.0)

"""Smoothed Particle Hydrodynamics for nonlinear solid mechanics."""

from solidsph.errors import (
    BuildError,
    BusyError,
    ConvergenceError,
    DivergedError,
    ForkError,
    PluginError,
    RecordError,
    SceneError,
    SolidsphError,
    UnsoundError,
)
from solidsph.interfaces.boundary import BoundaryHandler
from solidsph.interfaces.discretisation import Discretisation
from solidsph.interfaces.divergence import Divergence
from solidsph.interfaces.effect import Effect
from solidsph.interfaces.formulation import Formulation
from solidsph.interfaces.gradient import Gradient
from solidsph.interfaces.integrator import Integrator
from solidsph.interfaces.kernel import Kernel
from solidsph.interfaces.material import Material
from solidsph.interfaces.shape import Shape
from solidsph.model.particles import Particles, State
from solidsph.results.record import Record
from solidsph.resumption import resume
from solidsph.run.outcome import Result
from solidsph.scene.scene import Scene
from solidsph.simulation import Simulation
from solidsph.studies.case import Case, Measurement

solve = Simulation.run
"""The run as a function: `solve(simulation)`."""

carry_out = solve
"""The former name of `solve`."""

__all__ = [
    "BoundaryHandler",
    "BuildError",
    "BusyError",
    "Case",
    "ConvergenceError",
    "Discretisation",
    "DivergedError",
    "Divergence",
    "Effect",
    "ForkError",
    "Formulation",
    "Gradient",
    "Integrator",
    "Kernel",
    "Material",
    "Measurement",
    "Particles",
    "PluginError",
    "Record",
    "RecordError",
    "Result",
    "Scene",
    "SceneError",
    "Shape",
    "Simulation",
    "SolidsphError",
    "State",
    "UnsoundError",
    "carry_out",
    "resume",
    "solve",
]

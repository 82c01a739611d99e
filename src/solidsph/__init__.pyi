from .errors import (
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
from .interfaces.boundary import BoundaryHandler
from .interfaces.discretisation import Discretisation
from .interfaces.divergence import Divergence
from .interfaces.effect import Effect
from .interfaces.formulation import Formulation
from .interfaces.gradient import Gradient
from .interfaces.integrator import Integrator
from .interfaces.kernel import Kernel
from .interfaces.material import Material
from .interfaces.shape import Shape
from .model.particles import Particles, State
from .results.record import Record
from .resumption import resume
from .run.outcome import Result
from .scene.scene import Scene
from .simulation import Simulation, carry_out, solve
from .studies.case import Case, Measurement

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

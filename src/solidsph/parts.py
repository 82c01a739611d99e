"""Everything that the author of a part imports, in one place.

An interface to keep, what a part is given and what it hands back, the words of pointwise formulas,
and numbers as scenes state them. `docs/authors.md` has an example of every kind of part.
"""

from solidsph.errors import BuildError, PluginError, SceneError
from solidsph.interfaces.body import Body
from solidsph.interfaces.boundary import BoundaryHandler
from solidsph.interfaces.compilable_terms import (
    LinearExtension,
    PairLoad,
    PointwiseLoad,
    ScheduledConstraint,
    ScheduledLoad,
)
from solidsph.interfaces.deformation_load import DeformationLoad
from solidsph.interfaces.discrete_model import DiscreteModel
from solidsph.interfaces.discretisation import Discretisation
from solidsph.interfaces.divergence import Divergence, PointwiseDivergence
from solidsph.interfaces.effect import Effect, Need
from solidsph.interfaces.engine import Engine, InternalForces, StressFields
from solidsph.interfaces.equation_of_motion import EquationOfMotion, Response
from solidsph.interfaces.forces_modifier import ForcesModifier
from solidsph.interfaces.formulation import Configuration, Formulation
from solidsph.interfaces.graded_discretisation import GradedDiscretisation
from solidsph.interfaces.gradient import Gradient, PointwiseGradient
from solidsph.interfaces.history import History, HistoryMaterial
from solidsph.interfaces.integrator import Integrator, PointwiseIntegrator
from solidsph.interfaces.kernel import Kernel
from solidsph.interfaces.law import Law, memory_name
from solidsph.interfaces.marks import (
    Arrows,
    Held,
    Links,
    Mark,
    Plane,
    field_arrows,
    largest_arrows,
    marks_of,
)
from solidsph.interfaces.material import Material
from solidsph.interfaces.memory import Memory
from solidsph.interfaces.pair_table import PairTable
from solidsph.interfaces.plan import (
    BodySize,
    Compilation,
    CompilationUnit,
    Operations,
    Plan,
    SumMethod,
)
from solidsph.interfaces.row_weights import RowWeights
from solidsph.interfaces.shape import Moments, Shape, Surface
from solidsph.interfaces.smoothing_kernel import SmoothingKernel, smoothing_kernel
from solidsph.interfaces.subset import Subset
from solidsph.interfaces.terms import (
    Constraint,
    EnergyTerm,
    FieldTerm,
    GhostConstraint,
    Load,
    Observation,
    StressTerm,
    SurfaceLoad,
    Term,
)
from solidsph.interfaces.time_loop import StepError, TimeLoop
from solidsph.maths.arrays import Array, Indices, Mask, Scalar, Tensor, Vector
from solidsph.maths.dilatation import GREEN, LOGARITHMIC, POWER, SMALL, Dilatation
from solidsph.maths.tensors import (
    add,
    cauchy_stress,
    cofactor,
    components_first,
    contraction,
    determinant,
    dot,
    green_lagrange,
    identity,
    inverse,
    inverse_transpose,
    particles_first,
    product,
    right_cauchy_green,
    scale,
    scaled,
    small_strain,
    trace,
    transpose,
)
from solidsph.model.fields import Component, VectorField, scheduled_forces
from solidsph.model.neighbours import Pairs, neighbour_pairs
from solidsph.model.particles import Face, Particles, State
from solidsph.model.regions import AXES, EVERYWHERE, Where
from solidsph.model.spacing import SpacingField
from solidsph.registry.construct import construct
from solidsph.registry.parameters import check_positive, formula, number, optional_number
from solidsph.results.record import Record
from solidsph.run.built_scene import BuiltScene
from solidsph.run.cfl_step import lattice_frequency
from solidsph.run.hooks import implementation as hookimpl
from solidsph.scene.scene import Scene
from solidsph.scene.scene_builder import SceneBuilder
from solidsph.studies.case import Case, Curves, Measurement, Trial
from solidsph.studies.one_scene_case import OneSceneCase
from solidsph.system.encoding import decoded
from solidsph.system.files import content, located

__all__ = [
    "AXES",
    "EVERYWHERE",
    "GREEN",
    "LOGARITHMIC",
    "POWER",
    "SMALL",
    "Array",
    "Arrows",
    "Body",
    "BodySize",
    "BoundaryHandler",
    "BuildError",
    "BuiltScene",
    "Case",
    "Compilation",
    "CompilationUnit",
    "Component",
    "Configuration",
    "Constraint",
    "Curves",
    "DeformationLoad",
    "Dilatation",
    "DiscreteModel",
    "Discretisation",
    "Divergence",
    "Effect",
    "EnergyTerm",
    "Engine",
    "EquationOfMotion",
    "Face",
    "FieldTerm",
    "ForcesModifier",
    "Formulation",
    "GhostConstraint",
    "GradedDiscretisation",
    "Gradient",
    "Held",
    "History",
    "HistoryMaterial",
    "Indices",
    "Integrator",
    "InternalForces",
    "Kernel",
    "Law",
    "LinearExtension",
    "Links",
    "Load",
    "Mark",
    "Mask",
    "Material",
    "Measurement",
    "Memory",
    "Moments",
    "Need",
    "Observation",
    "OneSceneCase",
    "Operations",
    "PairLoad",
    "PairTable",
    "Pairs",
    "Particles",
    "Plan",
    "Plane",
    "PluginError",
    "PointwiseDivergence",
    "PointwiseGradient",
    "PointwiseIntegrator",
    "PointwiseLoad",
    "Record",
    "Response",
    "RowWeights",
    "Scalar",
    "Scene",
    "SceneBuilder",
    "SceneError",
    "ScheduledConstraint",
    "ScheduledLoad",
    "Shape",
    "SmoothingKernel",
    "SpacingField",
    "State",
    "StepError",
    "StressFields",
    "StressTerm",
    "Subset",
    "SumMethod",
    "Surface",
    "SurfaceLoad",
    "Tensor",
    "Term",
    "TimeLoop",
    "Trial",
    "Vector",
    "VectorField",
    "Where",
    "add",
    "cauchy_stress",
    "check_positive",
    "cofactor",
    "components_first",
    "construct",
    "content",
    "contraction",
    "decoded",
    "determinant",
    "dot",
    "field_arrows",
    "formula",
    "green_lagrange",
    "hookimpl",
    "identity",
    "inverse",
    "inverse_transpose",
    "largest_arrows",
    "lattice_frequency",
    "located",
    "marks_of",
    "memory_name",
    "neighbour_pairs",
    "number",
    "optional_number",
    "particles_first",
    "product",
    "right_cauchy_green",
    "scale",
    "scaled",
    "scheduled_forces",
    "small_strain",
    "smoothing_kernel",
    "trace",
    "transpose",
]

"""Equilibria, natural frequencies and stable steps of the discrete system that runs use."""

from solidsph.statics.critical_step import StableStep, critical_step, highest_frequency
from solidsph.statics.equilibrium import EquilibriumResult, LoadStep, equilibrium
from solidsph.statics.modes import Modes, frequencies
from solidsph.statics.run import run_statics
from solidsph.statics.stiff import Stiff, StiffInSteps
from solidsph.statics.tangent import tangent

__all__ = [
    "EquilibriumResult",
    "LoadStep",
    "Modes",
    "StableStep",
    "Stiff",
    "StiffInSteps",
    "critical_step",
    "equilibrium",
    "frequencies",
    "highest_frequency",
    "run_statics",
    "tangent",
]

"""Smoothed Particle Hydrodynamics for nonlinear solid mechanics.

Names are loaded when they are first used (`lazy_loader`); `__init__.pyi` says from where.
"""

import logging

import lazy_loader

logging.getLogger(__name__).addHandler(logging.NullHandler())  # who uses it says what is shown

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

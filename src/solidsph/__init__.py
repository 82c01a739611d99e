"""Smoothed Particle Hydrodynamics for nonlinear solid mechanics.

Names are loaded when they are first used (`lazy_loader`); `__init__.pyi` says from where.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

"""Smoothed Particle Hydrodynamics for nonlinear solid mechanics."""

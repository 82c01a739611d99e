"""Wendland kernels for solidsph."""

from solidsph_wendland.wendland_c2 import WendlandC2

__all__ = ["WendlandC2"]

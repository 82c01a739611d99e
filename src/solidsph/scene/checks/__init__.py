"""Checks of a scene and its parts. Each yields problems, each with its remedy."""

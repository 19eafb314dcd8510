"""Continuous refinement of plans of many pushes."""

from .refine import Refined, improvements, refine

__all__ = ["Refined", "improvements", "refine"]

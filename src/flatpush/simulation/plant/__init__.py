"""Any fingers against an object, quasi-statically, step by step: compiled, with a plain twin."""

from .plant import MODES, OUTCOMES, Plant, PlantRun, PlantRuns, PlantState

__all__ = ["MODES", "OUTCOMES", "Plant", "PlantRun", "PlantRuns", "PlantState"]

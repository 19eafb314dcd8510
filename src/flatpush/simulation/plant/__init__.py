"""Any fingers against an object, quasi-statically, step by step, interpreted or compiled."""

from .codes import MODES, OUTCOMES
from .plant import Plant, PlantRun, PlantRuns, PlantState

__all__ = ["MODES", "OUTCOMES", "Plant", "PlantRun", "PlantRuns", "PlantState"]

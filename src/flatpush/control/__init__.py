"""Keeping a push on its way: measurements, learning while pushing, receding horizon."""

from .learning import SteeringBelief, SteeringEstimate
from .measurement import Command, Measurement
from .sensor import AbstractSensor, Camera, SimulatedSensor

__all__ = [
    "AbstractSensor",
    "Camera",
    "Command",
    "Measurement",
    "SimulatedSensor",
    "SteeringBelief",
    "SteeringEstimate",
]

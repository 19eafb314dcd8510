"""Keeping a push on its way: measurements, learning while pushing, receding horizon."""

from .controller import ARRIVED, AbstractController, ControllerState
from .learning import SteeringBelief, SteeringEstimate
from .measurement import Command, Measurement
from .sensor import AbstractSensor, Camera, SimulatedSensor

__all__ = [
    "ARRIVED",
    "AbstractController",
    "AbstractSensor",
    "Camera",
    "Command",
    "ControllerState",
    "Measurement",
    "SimulatedSensor",
    "SteeringBelief",
    "SteeringEstimate",
]

"""Keeping a push on its way: controllers, the loop around them, and what a controller learns while it pushes.

Closing a loop of your own takes a controller, a sensor and a plant; see docs/control.md, "Your own loop".
"""

from .horizon.controller import HorizonController
from .laws.gains import Gains
from .laws.linearisation import PostureController, TrackingController
from .laws.path_following import PathController
from .laws.reference import AbstractReference, PathReference
from .laws.steering_model import SteeringModel
from .learning.belief import SteeringBelief, SteeringEstimate
from .loop.closed_loop import ClosedLoopRun, Table, World, drive, limits_used
from .loop.controller import ARRIVED, AbstractController, ControllerState
from .loop.limits import Limits
from .loop.measurement import Command, Measurement
from .loop.sensor import AbstractSensor, Camera, SensorState, SimulatedSensor
from .tracking.learning_controller import LearningController
from .tracking.plan_controller import PlanController
from .tracking.replanning_controller import ReplanningController

__all__ = [
    "ARRIVED",
    "AbstractController",
    "AbstractReference",
    "AbstractSensor",
    "Camera",
    "ClosedLoopRun",
    "Command",
    "ControllerState",
    "Gains",
    "HorizonController",
    "LearningController",
    "Limits",
    "Measurement",
    "PathController",
    "PathReference",
    "PlanController",
    "PostureController",
    "ReplanningController",
    "SensorState",
    "SimulatedSensor",
    "SteeringBelief",
    "SteeringEstimate",
    "SteeringModel",
    "Table",
    "TrackingController",
    "World",
    "drive",
    "limits_used",
]

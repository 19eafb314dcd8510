"""What the horizon controller remembers from tick to tick."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

import numpy as np

from ...geometry.pose import Array
from ..learning.friction_bounds import FrictionBounds
from ..loop.controller import ControllerState
from ..loop.measurement import Measurement
from .contact_car import ContactCar
from .push_knowledge import Steering
from .push_path import PushPath

if TYPE_CHECKING:
    from .landings import Landing
    from .surroundings import Thoughts

Phase = Literal["look", "transit", "push", "resume", "retreat"]


@dataclass(frozen=True, eq=False)
class LearningWindow:
    """Where a stretch began that is to be learned from, and what has happened since.

    Attributes:
        angle: of the object then [rad], with its standard deviation sd. tip: of the finger in O then.
        way: ∫ of the contact point's velocity in O since, shape (2,) [m], the drift of the flat point taken off.
        ratios: |tangential| / normal force that the turns since asked for.
        hand: X_WE at the end of the push.
    """

    angle: float
    sd: float
    tip: Array
    way: Array = field(default_factory=lambda: np.zeros(2))
    ratios: tuple[float, ...] = ()
    hand: Array | None = None


@dataclass(frozen=True, eq=False)
class HorizonState(ControllerState):
    """Of HorizonController.

    Attributes:
        phase: "look" at the object at rest, "transit" to a contact, "push", "resume" (the finger has lost the edge and
            comes back to it), "retreat".
        since: frames exposed before this do not count while looking [s]; frames: poses seen since.
        believed: the newest frame with the pose as it is believed, or what was known at the last landing.
        expected: X_WO at the last tick, if no frame came since.
        stops: still to go to (x, y, θ, height), the next first.
        push: which option; target: X_WO where it shall end. tip: centre of the finger in O, smoothed,
            and its gap to the edge [m].
        car: of the contact now; landed: the radius of that where it landed. rest: of the push [m];
            allowed: it ends after this at the latest [m].
        path, passed: of the push among things, and the number of its pose that was passed.
        thoughts, thought: of where to land next among things, and how many parts of that are done.
        stuck: how often no path was found since the last.
        landings, resumes: how many there were, of the latter in this push. stopped: how many pushes ended because the
            object or the finger would have come too near to something.
        failures: how often the finger slipped, or lost the edge too often, at every option. forgiven: whether they were
            forgotten since the last push that came to its end.
        steering: of every option. bounds: of the friction between finger and object. window: see LearningWindow.
    """

    phase: Phase = "look"
    since: float = -np.inf
    frames: tuple[Array, ...] = ()
    believed: Measurement | None = None
    expected: Array | None = None
    stops: tuple[Array, ...] = ()
    push: int = -1
    target: Array | None = None
    tip: Array | None = None
    gap: float = 0.0
    car: ContactCar | None = None
    landed: float = np.inf
    rest: float = np.inf
    allowed: float = np.inf
    path: PushPath | None = None
    passed: int = 0
    thoughts: "Thoughts[Landing | str] | None" = None
    thought: int = 0
    stuck: int = 0
    landings: int = 0
    resumes: int = 0
    stopped: int = 0
    failures: tuple[int, ...] = ()
    forgiven: bool = False
    steering: tuple[Steering, ...] = ()
    bounds: FrictionBounds = field(default_factory=FrictionBounds)
    window: LearningWindow | None = None

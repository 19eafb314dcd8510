"""What a controller is told and what it answers."""

from dataclasses import dataclass, replace

import numpy as np

from ...geometry.pose import Array


@dataclass(frozen=True, eq=False)
class Measurement:
    """One frame: where object and pusher were when it was exposed.

    Attributes:
        time: of the exposure [s]; the frame may arrive later.
        object: X_WO as seen, shape (3,) [m, m, rad].
        pusher: X_WE at the same time, from the robot's own log, shape (3,).
        body: name of the object that was seen; "" where there is only one.
    """

    time: float
    object: Array
    pusher: Array
    body: str = ""

    @property
    def finite(self) -> bool:
        """Whether every number of it is finite."""
        return bool(
            np.isfinite(self.time)
            and np.shape(self.object) == (3,)
            and np.shape(self.pusher) == (3,)
            and np.all(np.isfinite(self.object))
            and np.all(np.isfinite(self.pusher))
        )

    def with_hand_turned(self, by: float) -> "Measurement":
        """With the pusher turned farther by an angle [rad]."""
        pusher = np.array(self.pusher, dtype=float)
        pusher[2:] += by
        return replace(self, pusher=pusher)


@dataclass(frozen=True, eq=False)
class Command:
    """What the pusher shall do until the next command.

    Attributes:
        velocity: (vx, vy, yaw rate) of the pusher E in W, shape (3,) [m/s, m/s, rad/s].
        height: above the table [m]; 0 is on it.
    """

    velocity: Array
    height: float = 0.0


STOP = Command(np.zeros(3))

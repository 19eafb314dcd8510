"""Two fingers carry the object: where it is in the hand is known from the contacts and the mean of what was seen."""

from dataclasses import dataclass, replace

import numpy as np

from ...geometry import Outline, compose, pose_error, relative
from ...geometry.pose import Array
from ..laws.linearisation import TrackingController
from ..laws.path_following import PathController
from ..loop.frames import hand
from ..loop.measurement import Command, Measurement
from .law_runner import AbstractLawRunner, RunnerState

# The place at which it landed counts as so many frames: the object was seen so often before.
KNOWN = 10
# The mean of the last frames, over so long [s], tells whether the object has slipped in the hand: then it is off the
# mean of all by more than so many standard deviations of its own noise, and the frames from before are forgotten.
MEMORY, SLIPPED = 2.0, 5.0
# Steps of Newton's method towards touching fingers.
ROUNDS = 3


@dataclass(frozen=True, eq=False, kw_only=True)
class CarriedState(RunnerState):
    """Of CarriedController.

    Attributes:
        grasp: X_EO, the mean of what was seen, shape (3,); touching: the same with both fingers on the outline.
        count: of the frames in the mean. newest: exposure of the last of them [s].
        late: X_EO, the mean of what was seen of late, shape (3,).
    """

    grasp: Array
    touching: Array
    count: float
    newest: float
    late: Array


@dataclass(frozen=True, eq=False)
class CarriedController(AbstractLawRunner[CarriedState]):
    """Runs the law of one push with the pose of an object that two fingers hold.

    Fingers that stick carry the object along, so that the hand's own pose, which is known far better than what a camera
    sees, tells where it is: X_WO = X_WE X_EO. X_EO does not change, so all frames of it are averaged; and both fingers
    touch, which leaves one of its three numbers to the camera.

    Args:
        inner: the law. outline: of the object. tips: centres of the fingertips in E, shape (2, 2).
        tip_radius: [m]. noise: of a frame, see AbstractController.
    """

    inner: TrackingController | PathController
    outline: Outline
    tips: Array
    tip_radius: float
    noise: tuple[float, float] = (0.0003, float(np.deg2rad(0.3)))

    def start(self, time: float = 0.0) -> CarriedState:
        planned = relative(self.inner.model.pusher, np.zeros(3))
        return CarriedState(
            inner=self.inner.start(time),
            grasp=planned,
            touching=planned,
            count=KNOWN,
            newest=time,
            late=planned,
        )

    def noticed(self, state: CarriedState, frame: Measurement) -> CarriedState:
        if frame.time < state.newest:
            return state
        seen, count = relative(frame.pusher, frame.object), state.count + 1
        share = max(1 / count, min(1.0, (frame.time - state.newest) / MEMORY))
        grasp = np.asarray(state.grasp + pose_error(seen, state.grasp) / count)
        late = np.asarray(state.late + share * pose_error(seen, state.late))
        # A mean that takes a share of each frame scatters by √(share / 2) of a frame.
        sd = np.sqrt(0.5 * share) * np.array([self.noise[0], self.noise[0], self.noise[1]])
        if np.any(np.abs(pose_error(late, grasp)) > SLIPPED * sd):
            grasp, count = late, 1 / share
        return replace(
            state, grasp=grasp, touching=self._touching(grasp), count=count, newest=frame.time, late=late
        )

    def act(self, state: CarriedState, time: float) -> tuple[CarriedState, Command]:
        assert state.seen.frame is not None
        pose = compose(hand(state.seen.frame, state.seen.told, time), state.touching)
        below = replace(state.inner, seen=state.seen)
        return self.ran(state, *self.inner.follow(below, pose, time))  # type: ignore[arg-type]

    def _touching(self, grasp: Array) -> Array:
        """The pose nearest to a grasp X_EO at which both fingertips touch, angles counted by the object's size."""
        found, weight = np.array(grasp), np.array([1.0, 1.0, 2 / self.outline.size])
        for _ in range(ROUNDS):
            rows, gaps = [], []
            c, s = np.cos(found[2]), np.sin(found[2])
            for tip in self.tips:
                p = np.array([[c, s], [-s, c]]) @ (tip - found[:2])  # the tip in O
                near = self.outline.nearest(p)
                n = near.normal
                if near.corner and near.distance > 1e-9:
                    n = (near.point - p) / near.distance
                away = float((near.point - p) @ n)  # a tip that overlaps is on the other side
                m = np.array([[c, -s], [s, c]]) @ n  # inward normal in E
                arm = tip - found[:2]
                # Moving the object by d and turning it by a moves the outline at the tip by m . (d + a perp(arm)).
                rows.append([*m, m[0] * -arm[1] + m[1] * arm[0]])
                gaps.append(away - self.tip_radius)
            J = np.array(rows) / weight
            step = -np.linalg.pinv(J, rcond=1e-3) @ np.array(gaps) / weight
            found = found + step
        return found if np.all(np.isfinite(found)) else np.array(grasp)

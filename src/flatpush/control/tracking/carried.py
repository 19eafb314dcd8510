"""Two fingers carry the object: where it is in the hand is known from the contacts and the mean of what was seen."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...geometry import Outline, compose, pose_error, relative
from ...geometry.pose import Array
from ..laws.linearisation import TrackingController
from ..laws.path_following import PathController
from ..loop.frames import hand, mean_pose
from ..loop.measurement import Command, Measurement
from .law_runner import AbstractLawRunner, RunnerState

# The mean of the last frames, over so long [s], tells whether the object has slipped in the hand: then it is off the
# mean of all by more than so many standard deviations of its own noise, and the frames from before are forgotten.
MEMORY, SLIPPED = 2.0, 5.0
# What was known at a landing counts as at most so many frames.
MOST = 1e6
# Steps of Newton's method towards touching fingers.
ROUNDS = 3


@dataclass(frozen=True, eq=False)
class KnownPose:
    """X_WO of an object at rest as it is known.

    Attributes:
        pose: shape (3,) [m, m, rad]. covariance: of its errors in W, shape (3, 3).
    """

    pose: Array
    covariance: Array

    @classmethod
    def of_look(cls, poses: Sequence[Array], noise: tuple[float, float]) -> "KnownPose":
        """Of frames of the object at rest, with the noise of one [m, rad]."""
        return cls(mean_pose(poses), np.diag([noise[0], noise[0], noise[1]]) ** 2 / len(poses))

    def seen(self, look: "KnownPose") -> "KnownPose":
        """With a look that knew nothing of this: the mean of both by their covariances.

        Where the look is off by more than both can be wrong the object was moved since, and the look is all.
        """
        innovation = pose_error(look.pose, self.pose)
        S = self.covariance + look.covariance
        if float(innovation @ np.linalg.solve(S, innovation)) > SLIPPED**2:
            return look
        gain = np.linalg.solve(S, self.covariance).T
        return KnownPose(self.pose + gain @ innovation, self.covariance - gain @ self.covariance)


@dataclass(frozen=True, eq=False, kw_only=True)
class CarriedState(RunnerState):
    """Of CarriedController.

    Attributes:
        grasp: X_EO, the mean of what was seen, shape (3,); touching: the same with both fingers on the outline.
        held: X_EO that is steered by, shape (3,): touching, as far as it is known beyond its own noise.
        count: of the frames in the mean, what was known at the landing included. newest: exposure of the last [s].
        late: X_EO, the mean of what was seen of late, shape (3,).
    """

    grasp: Array
    touching: Array
    held: Array
    count: float
    newest: float
    late: Array


@dataclass(frozen=True, eq=False)
class CarriedController(AbstractLawRunner[CarriedState]):
    """Runs the law of one push with the pose of an object that two fingers hold.

    Fingers that stick carry the object along, so that the hand's own pose, which is known far better than what a camera
    sees, tells where it is: X_WO = X_WE X_EO. X_EO does not change, so all frames of it are averaged; and both fingers
    touch, which leaves one of its three numbers to the camera. What was known of it at the landing counts as so many
    frames as would know it as well. It is steered by a place in the hand that follows the mean only where
    that is off it by more than one standard deviation of the mean, and by what is more: less is noise.

    Args:
        inner: the law. outline: of the object. tips: centres of the fingertips in E, shape (2, 2).
        tip_radius: [m]. friction: between fingertip and object. noise: of a frame, see AbstractController.
    """

    inner: TrackingController | PathController
    outline: Outline
    tips: Array
    tip_radius: float
    friction: float
    noise: tuple[float, float] = (0.0003, float(np.deg2rad(0.3)))

    def start(self, time: float = 0.0) -> CarriedState:
        """As if it had landed where one frame saw the object."""
        return self.landed(time, np.diag(self._sd) ** 2)

    def landed(self, time: float, covariance: Array) -> CarriedState:
        """The state before a push that begins where the object is known to be, up to a covariance (3, 3) in E."""
        planned = relative(self.inner.model.pusher, np.zeros(3))
        J, _ = self._contacts(planned)
        # The fingers close the gaps; as they do the object may slip along them, by about the friction's share.
        slip = self.friction**2 * float(np.max(np.diag(J @ covariance @ J.T))) / self.noise[0] ** 2
        spread = self._spread(planned, covariance) + slip
        count = self._spread(planned, np.diag(self._sd) ** 2) / max(spread, 1 / MOST)
        return CarriedState(
            inner=self.inner.start(time),
            grasp=planned,
            touching=planned,
            held=planned,
            count=count,
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
        if np.any(np.abs(pose_error(late, grasp)) > SLIPPED * np.sqrt(0.5 * share) * self._sd):
            grasp, count = late, 1 / share
        touching = self._touching(grasp)
        off = pose_error(touching, state.held)
        known = float(np.linalg.norm(off / self._sd)) * np.sqrt(count)  # in standard deviations of the mean
        held = np.asarray(state.held + max(0.0, 1 - 1 / known) * off) if known > 0 else state.held
        return replace(
            state, grasp=grasp, touching=touching, held=held, count=count, newest=frame.time, late=late
        )

    def act(self, state: CarriedState, time: float) -> tuple[CarriedState, Command]:
        assert state.seen.frame is not None
        pose = compose(hand(state.seen.frame, state.seen.told, time), state.held)
        below = replace(state.inner, seen=state.seen)
        return self.ran(state, *self.inner.follow(below, pose, time))  # type: ignore[arg-type]

    def known(self, state: CarriedState, here: Array) -> KnownPose:
        """Of the object, with the hand at X_WE."""
        free = self._free(state.touching) * self._sd
        return KnownPose(compose(here, state.touching), turned(free @ free.T / state.count, float(here[2])))

    @property
    def _sd(self) -> Array:
        """Of a frame, shape (3,) [m, m, rad]."""
        return np.array([self.noise[0], self.noise[0], self.noise[1]])

    def _spread(self, grasp: Array, covariance: Array) -> float:
        """Variance of what the fingers leave free of a grasp, each number counted by the noise of a frame."""
        T = self._free(grasp)
        return float(np.trace(T @ covariance @ T.T / self._sd**2))

    def _free(self, grasp: Array) -> Array:
        """What is left of an error of a grasp when both fingertips touch, shape (3, 3)."""
        J, _ = self._contacts(grasp)
        return np.eye(3) - np.linalg.pinv(J / self._weight, rcond=1e-3) @ J / self._weight[:, None]

    @property
    def _weight(self) -> Array:
        """Of the numbers of an error, in metres: an angle counts by how far it moves the ends of the object."""
        return np.array([1.0, 1.0, 0.5 * self.outline.size])

    def _touching(self, grasp: Array) -> Array:
        """The pose nearest to a grasp X_EO at which both fingertips touch, angles counted by the object's size."""
        found = np.array(grasp)
        for _ in range(ROUNDS):
            J, gaps = self._contacts(found)
            found = found - np.linalg.pinv(J / self._weight, rcond=1e-3) @ gaps / self._weight
        return found if np.all(np.isfinite(found)) else np.array(grasp)

    def _contacts(self, grasp: Array) -> tuple[Array, Array]:
        """How gaps between fingertips and outline grow with a grasp X_EO, shape (k, 3), and the gaps (k,) [m]."""
        rows, gaps = [], []
        c, s = np.cos(grasp[2]), np.sin(grasp[2])
        for tip in self.tips:
            p = np.array([[c, s], [-s, c]]) @ (tip - grasp[:2])  # the tip in O
            near = self.outline.nearest(p)
            n = near.normal
            if near.corner and near.distance > 1e-9:
                n = (near.point - p) / near.distance
            away = float((near.point - p) @ n)  # a tip that overlaps is on the other side
            m = np.array([[c, -s], [s, c]]) @ n  # inward normal in E
            arm = tip - grasp[:2]
            # Moving the object by d and turning it by a moves the outline at the tip by m . (d + a perp(arm)).
            rows.append([*m, m[0] * -arm[1] + m[1] * arm[0]])
            gaps.append(away - self.tip_radius)
        return np.array(rows), np.array(gaps)


def turned(covariance: Array, angle: float) -> Array:
    """The covariance (3, 3) of a pose (x, y, θ), in axes turned by -angle [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return np.asarray(R @ covariance @ R.T)

"""What is answered: a plan of pushes and transits, and the rollout of one."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np

from ..errors import InputError
from ..geometry.pose import Array
from .certificate import Certificate
from .scene import Scene

FARTHEST = 1e3  # fingertips from their hand, by the object's size: a turn moves them by as many steps of a simulation


@dataclass(frozen=True, eq=False)
class Arc:
    """A piece of a push in which the object keeps one body twist.

    Attributes:
        turn: left (counter-clockwise), straight or right.
        twist: body twist in O at O's origin (vx, vy, ω), shape (3,) [m/s, m/s, rad/s], averaged over the arc:
            exp(duration · twist) is its displacement.
        duration: with the time law's stops [s].
        cost: in the unit of the plan's cost [m or s].
    """

    turn: Literal["left", "straight", "right"]
    twist: Array
    duration: float
    cost: float


@dataclass(frozen=True, eq=False)
class PushSegment:
    """The object pushed at one place. Samples are dense enough for straight interpolation (0.05 mm, 0.05°).

    Attributes:
        push: name of the push.
        word: such as "LSR".
        arcs: in order; those of no length are left out.
        times: from 0, shape (n,) [s].
        object: poses X_WO, shape (n, 3) [m, m, rad].
        pusher: poses X_WE, shape (n, 3) [m, m, rad].
        fingers: fingertip centres in E, shape (1 or 2, 2) [m].
    """

    push: str
    word: str
    arcs: tuple[Arc, ...]
    times: Array
    object: Array
    pusher: Array
    fingers: Array
    kind: Literal["push"] = "push"


@dataclass(frozen=True, eq=False)
class SlideSegment:
    """The object pushed by one finger that goes straight, whatever the contact does: it sticks, slides or lets go.

    Attributes:
        push: name of the slide.
        times: from 0, shape (n,) [s].
        object: poses X_WO as the plant rolls them out, shape (n, 3) [m, m, rad].
        pusher: poses X_WE, shape (n, 3) [m, m, rad].
        fingers: fingertip centre in E, shape (1, 2) [m].
        end: X_WO that is predicted after it, shape (3,).
        sensitivity: how far it ends elsewhere, as in Certificate.sensitivity [m/m, m/rad, m, m/m].
    """

    push: str
    times: Array
    object: Array
    pusher: Array
    fingers: Array
    end: Array
    sensitivity: Mapping[str, float]
    kind: Literal["slide"] = "slide"


@dataclass(frozen=True, eq=False)
class TransitSegment:
    """The pusher alone.

    Attributes:
        times: from 0, shape (n,) [s].
        pusher: poses X_WE, shape (n, 3) [m, m, rad].
        height: above the table, 0 being on it, shape (n,) [m].
    """

    times: Array
    pusher: Array
    height: Array
    kind: Literal["transit"] = "transit"


TableSegment = PushSegment | SlideSegment
Segment = TableSegment | TransitSegment


@dataclass(frozen=True, eq=False)
class Plan:
    """A plan; its attributes are the keys of the plan document.

    Attributes:
        status: "solved" or "no_plan".
        scene: the scene as resolved: the pushes listed, every default filled in.
        cost: [m], or [s] where scene.planning.cost is "time"; nan without a plan.
        duration: [s].
        segments: pushes, slides and transits in order; empty when start and goal are equal.
        certificate: what was proved or measured; None without a plan.
        reason: why there is no plan, and what to try.
        scene_digest: of the scene it was saved with, see documents.scene_digest; empty before that and in older plans.
        run: version, planning time [s] and, in a file, what the scene was read from ("read"); not part of what two
            plans are compared by.
    """

    status: Literal["solved", "no_plan"]
    scene: Scene
    cost: float = float("nan")
    duration: float = 0.0
    segments: tuple[Segment, ...] = ()
    certificate: Certificate | None = None
    reason: str = ""
    scene_digest: str = ""
    run: Mapping[str, float | str | list[str] | Mapping[str, float] | None] = field(default_factory=dict)

    @property
    def pushes(self) -> tuple[PushSegment, ...]:
        """The segments in which fingers stick, in order."""
        return tuple(s for s in self.segments if isinstance(s, PushSegment))

    @property
    def slides(self) -> tuple[SlideSegment, ...]:
        """The segments in which a finger may slide, in order."""
        return tuple(s for s in self.segments if isinstance(s, SlideSegment))

    @property
    def on_table(self) -> tuple[TableSegment, ...]:
        """Pushes and slides in order: the segments in which the object moves."""
        return tuple(s for s in self.segments if not isinstance(s, TransitSegment))

    def check_motion(self) -> None:
        """Refuses a plan that nobody can follow.

        Raises:
            InputError: for a plan without a solution, and for a push or slide without motion or with fingers far away.
        """
        if self.status != "solved":
            raise InputError("there is no plan to follow", hint=self.reason)
        for i, segment in enumerate(self.segments):
            if isinstance(segment, TransitSegment):
                continue
            if len(segment.times) < 2 or (isinstance(segment, PushSegment) and not segment.arcs):
                raise InputError(
                    f"the push {segment.push!r} has no motion",
                    key=f"segments[{i}]",
                    hint="The plan is damaged; plan anew.",
                )
            check_fingers(segment.fingers, self.scene.object.outline.size, f"segments[{i}].fingers")

    def save(self, path: str | Path) -> None:
        """Writes the plan document (JSON, SI), whole or not at all."""
        from ..documents.plan_file import save_plan

        save_plan(self, path)

    def final_pose(self) -> Array:
        """Where the plan leaves the object, X_WO, shape (3,)."""
        moved = self.on_table
        return moved[-1].object[-1] if moved else np.asarray(self.scene.start, dtype=float)

    @property
    def goal_pose(self) -> Array:
        """The goal X_WO, shape (3,); where it leaves the angle open, with that of the plan's end."""
        if not self.scene.free_angle:
            return self.scene.goal_pose
        return np.array([*self.scene.goal_pose[:2], self.final_pose()[2]])


def check_fingers(tips: Array, size: float, key: str = "") -> None:
    """Refuses fingertips (k, 2) [m] that are farther from their hand than FARTHEST times an object's size [m]."""
    if np.max(np.hypot(tips[:, 0], tips[:, 1])) > FARTHEST * size:
        raise InputError(
            f"a fingertip is at most {FARTHEST:g} times the object's size from the hand's origin",
            key=key,
            value=tips.tolist(),
        )


@dataclass(frozen=True, eq=False)
class Rollout:
    """What the simulator saw.

    Attributes:
        final_pose: X_WO at the end, shape (3,).
        times: from the start of the plan, shape (n,) [s].
        object, pusher: poses X_WO and X_WE, shape (n, 3) [m, m, rad].
        modes: contact mode of each sample ("sticking", "sliding_left", …; "rest" in a transit).
        outcome: "completed", "passed a corner", "lost contact" (no finger touches at the end of a push), or why the
            simulation stopped: "jammed", "grasped".
        seed: number that the perturbation was drawn from; None for the nominal run.
    """

    final_pose: Array
    times: Array
    object: Array
    pusher: Array
    modes: tuple[str, ...]
    outcome: str
    seed: int | None = None

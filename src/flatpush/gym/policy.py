"""Our planner as a policy for flatpush/Push-v0: the baseline."""

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError
from ..geometry.pose import Array
from ..planning.sliding import slide_planner
from ..planning.sliding.exact import SlidePlan, SlidePush
from .task import PushTask

NEAR = 1e-6  # a place is reached within this [m]


class PushPolicy:
    """One finger that plans pushes which stick or slide as they will, makes one, looks, and plans again.

    It sees the state, and knows the task's scene, not what differs from it.

    Args:
        task: whose states it sees.

    Raises:
        InputError: for two fingers.
    """

    def __init__(self, task: PushTask) -> None:
        if task.turns:
            raise InputError("the policy pushes with one finger", key="fingers", value=2)
        scene = task.scene
        self.task = task
        self.planner = slide_planner(replace(scene, pusher=replace(scene.pusher, transit="planar")))
        self.planner.pusher = None  # its samples need no times
        self.reset()

    def reset(self) -> None:
        """Forgets its plan, for a new episode."""
        self._places: list[Array] = []
        self._rest: tuple[SlidePush, ...] = ()
        self.plans = 0

    def look(self) -> None:
        """Drops the push that it is making: the object is somewhere else."""
        self._places = []

    def act(self, state: ArrayLike) -> Array:
        """The action (2,) in a state.

        Raises:
            InputError: for what is no state of the task's.
        """
        given, names = np.asarray(state, dtype=float), self.task.names
        if given.shape != (len(names),) or not np.all(np.isfinite(given)):
            raise InputError(
                f"a state is {len(names)} finite numbers: {', '.join(names)}",
                value=state,
                hint="Make the environment with observation='state'.",
            )
        x, y, sine, cosine, *others = given.tolist()
        seen, tip = np.array([x, y, np.arctan2(sine, cosine)]), np.array(others[:2])
        goal = np.array([*others[2:4], np.arctan2(others[4], others[5])])
        step = self.task.scene.pusher.speed / self.task.rate
        # The last place of a push ends it; those before are passed.
        while self._places and np.linalg.norm(self._places[0] - tip) < NEAR:
            self._places.pop(0)
        if not self._places:
            self._plan(seen, tip, goal)
        if not self._places:
            return np.zeros(2)
        way = self._places[0] - tip
        return way / max(float(np.linalg.norm(way)), step)

    def _plan(self, seen: Array, tip: Array, goal: Array) -> None:
        found: SlidePlan | None = None
        if self._rest:
            found = self.planner.continued(self._rest, seen, goal, tip)
        if found is None:
            found = self.planner.plan(seen, goal, tip=tip)
            self.plans += 1
        self._rest = found.pushes[1:]
        if found.pushes:
            push = found.pushes[0]
            around = [] if push.way is None else list(push.way[1:])
            self._places = [np.array(p) for p in (*around, push.tip[-1])]

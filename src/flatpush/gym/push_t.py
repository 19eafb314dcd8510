"""Push-T: a planner as its policy, from nothing but the law of pushing.

The environment gym_pusht/PushT-v0 moves a T by a disc that follows commands. Its T keeps no velocity from one substep
to the next and has mass 1 and moment 3000 px² about its centre of gravity, and no friction with the disc: that is a
quasi-static object whose limit surface is the ellipsoid fx² + fy² + τ²/3000 = 1, and a frictionless finger.
Lengths here are metres, a thousandth of the environment's pixels.
"""

from collections.abc import Iterator
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike
from shapely import Polygon, affinity

from ..errors import InputError
from ..friction import Ellipsoid
from ..geometry import compose, inverse, relative, transform
from ..geometry.pose import Array
from ..planning.sliding import Sequence, SlideLibrary, SlideSearch, slide_library
from ..problem import Object
from ..simulation.plant import Plant
from .agent import Agent
from .kernels import shortest_clear

PIXEL = 1e-3  # [m]
SCALE = 0.030  # the T is drawn with it [m]
BAR = ((-2 * SCALE, 0.0), (2 * SCALE, SCALE))  # lower left and upper right corners
STEM = ((-SCALE / 2, SCALE), (SCALE / 2, 4 * SCALE))
BOXES = np.array([BAR, STEM])
CENTRE_OF_GRAVITY = (0.0, 1.5 * SCALE)  # mean of both parts' centres, as the environment sets it
MOMENT = 3000 * PIXEL**2  # by mass [m²]
TIP = 0.015
ROOM = 0.512
WALLS = (0.0075, 0.5035)  # the T stays between: walls at 7 and 504 px, half a pixel off
GOAL = np.array([0.256, 0.256, np.pi / 4])
SOLVED = 0.95  # of the goal's area covered
# How the disc follows commands, by the environment's names: see Agent; control_hz: of the control steps [Hz].
LAW = {"k_p": 100.0, "k_v": 20.0, "dt": 0.01, "control_hz": 10.0}

WITHIN = 0.0022  # sequences whose farthest point misses the goal by less are tried [m]
ENOUGH = 0.955  # coverage that a sequence must promise
CLEAR = 0.001  # of the disc from the T on its way to a push
BEFORE = 0.002  # the disc starts so far from the T, measured along its normal
TOUCHING = 2e-4  # the disc may have sunk so far into the T after a push
PATIENCE = 20  # control steps that the T may need to come between the walls
LEAST_STEPS = 4  # of a push and the way to it
LENGTHS = np.array([3, 5, 8, 12, 18, 25, 35, 50, 70, 100, 140]) * PIXEL
DIRECTIONS = np.deg2rad(np.arange(-60, 61, 15))
GRID = 17  # first commands of a way around the T, in each coordinate
AT_RANDOM = 3000  # pairs of first commands, drawn once


class Environment(Protocol):
    """What is used of a Gymnasium environment."""

    @property
    def unwrapped(self) -> Any: ...


def tee() -> Object:
    """The T, in the frame of the environment's body, without friction at its sides."""
    (left, low), (right, high) = BAR
    (inner, _), (outer, top) = STEM
    corners = [
        (left, low),
        (right, low),
        (right, high),
        (outer, high),
        (outer, top),
        (inner, top),
        (inner, high),
    ]
    surface = Ellipsoid(np.diag([1.0, 1.0, 1 / MOMENT]))
    return Object([*corners, (left, high)], friction=0.0, surface=surface, name="T")


class PushTPolicy:
    """Plans up to four sliding pushes, makes the first, looks and plans again.

    Args:
        env: gym_pusht/PushT-v0 with obs_type "state", or None: only its law is needed.

    >>> policy = PushTPolicy()
    >>> command = policy.act([100.0, 100.0, 300.0, 300.0, 0.5])  # agent x, y; T x, y, angle, as observed
    >>> command.shape, bool(np.all((command >= 0) & (command <= 512)))
    ((2,), True)
    """

    def __init__(self, env: Environment | None = None) -> None:
        if env is not None:
            check_environment(env)
        stiffness, damping, dt, rate = LAW.values()
        self.agent = Agent(stiffness, damping, dt, round(1 / (dt * rate)), ROOM)
        thing = tee()
        plant = Plant(thing, [[0.0, 0.0]], TIP, surface=thing.surface, cof=CENTRE_OF_GRAVITY)
        self.slides: SlideLibrary = slide_library(
            thing, plant, directions=DIRECTIONS, lengths=LENGTHS, before=BEFORE
        )
        self.search = SlideSearch(self.slides)
        side = np.linspace(0.0, ROOM, GRID)
        grid = np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 1, 2)
        pairs = np.random.default_rng(0).uniform(0.0, ROOM, (AT_RANDOM, 2, 2))
        self._first_commands = (np.empty((1, 0, 2)), grid, pairs)
        self.reset()

    def reset(self) -> None:
        """Forgets what it was about to do. Call it when an episode begins."""
        self._todo: list[Array] = []
        self._waited = 0
        self.plans = 0

    def act(self, observation: ArrayLike) -> Array:
        """The command (2,) [px] for an observed state: agent x, y, T x, y [px] and the T's angle [rad].

        The agent is taken to be at rest where an episode begins; after each push it is.

        Raises:
            InputError: if the observation is no such state.
        """
        state = np.asarray(observation, dtype=float)
        if state.shape != (5,) or not np.all(np.isfinite(state)):
            raise InputError(
                "an observation is five finite numbers: agent x, y, T x, y and angle",
                value=observation,
                hint="Make the environment with obs_type='state'.",
            )
        agent, pose = state[:2] * PIXEL, state[2:] * [PIXEL, PIXEL, 1.0]
        if not self._todo:
            if not _between_walls(pose) and self._waited < PATIENCE:  # the walls push it in
                self._waited += 1
                return state[:2]
            self._waited = 0
            self._todo = list(self._first_push(agent, pose))
        return self._todo.pop(0) / PIXEL

    def _first_push(self, agent: Array, pose: Array) -> Array:
        """Commands (m, 2) of the first push of the quickest sequence found; to stay, if nothing can be done."""
        self.plans += 1
        goal = relative(pose, GOAL)
        quickest = self._quickest(agent, pose, self.search.sequences(goal, WITHIN), ENOUGH)
        if quickest is None:
            quickest = self._quickest(agent, pose, self.search.approaches(goal), 0.0)
        return agent[None] if quickest is None else quickest

    def _quickest(
        self, agent: Array, pose: Array, sequences: Iterator[Sequence], coverage: float
    ) -> Array | None:
        """Of sequences that promise a coverage, the commands of the quickest one's first push.

        Without a promise the first that can be made.
        """
        best, commands = np.inf, None
        for sequence in sequences:
            if LEAST_STEPS * len(sequence.pushes) >= best:
                break  # longer ones come later
            poses = [pose]
            for k in sequence.pushes:
                poses.append(compose(poses[-1], self.slides.displacement[k]))
            if not all(map(_between_walls, poses[1:])) or (coverage and _coverage(poses[-1]) < coverage):
                continue
            made = self._made(agent, poses, sequence, best)
            if made is not None:
                best, commands = made
                if not coverage:
                    break
        return commands

    def _made(
        self, agent: Array, poses: list[Array], sequence: Sequence, below: float
    ) -> tuple[int, Array] | None:
        """Control steps of a sequence and the commands of its first push, if it can be made in fewer than so many.

        The poses are the T's before each push.
        """
        library, steps, first = self.slides, 0, None
        for done, (k, pose) in enumerate(zip(sequence.pushes, poses, strict=False), start=1):
            begin, end = transform(pose, library.begin[k]), transform(pose, library.end[k])
            if not self.agent.allowed(np.stack([begin, end])):
                return None
            push = self.agent.straight(begin, end)
            rest = LEAST_STEPS * (len(sequence.pushes) - done)
            if push is None or steps + LEAST_STEPS + len(push) - 2 + rest >= below:
                return None
            there = self._around(agent, pose, begin)
            if there is None:
                return None
            steps += len(there) + len(push)
            if steps + rest >= below:
                return None
            agent = end
            if first is None:
                first = np.concatenate([there, push])
        assert first is not None
        return steps, first

    def _around(self, agent: Array, pose: Array, target: Array) -> Array | None:
        """The fewest commands from rest to rest at a target on which the disc keeps clear of the T: two to four."""
        room = min(CLEAR, float(_gap(pose, agent)) - TIP - TOUCHING)  # it may begin at the T
        for begun in self._first_commands:
            laws = self.agent.laws(begun.shape[1])
            k = shortest_clear(*laws, agent, target, begun, ROOM, pose, BOXES, TIP + room)
            if k >= 0:
                return self.agent.way(agent, target, begun[k])
        return None


def check_environment(env: Environment) -> None:
    """Refuses an environment whose law is another.

    Raises:
        InputError: naming what differs.
    """
    inner = env.unwrapped
    wanted = {"obs_type": "state", **LAW, "success_threshold": SOLVED}
    for name, value in wanted.items():
        found = getattr(inner, name, None)
        if found != value:
            raise InputError(
                "the environment is gym_pusht/PushT-v0 of gym-pusht 0.1 with obs_type='state'",
                key=name,
                value=found,
                hint=f"There it is {value!r}.",
            )
    if getattr(inner, "damping", None) or getattr(inner, "block_cog", None) is not None:
        raise InputError(
            "the T keeps no velocity and its own centre of gravity (damping and block_cog are None)"
        )


def _gap(pose: Array, points: Array) -> Array:
    """Distances of points (..., 2) from the T at a pose; 0 inside."""
    local = transform(inverse(pose), points)
    gaps = [np.linalg.norm(local - np.clip(local, *box), axis=-1) for box in BOXES]
    return np.minimum(*gaps)


def _placed(pose: Array) -> Polygon:
    turned = affinity.rotate(_SHAPE, pose[2], origin=(0.0, 0.0), use_radians=True)
    return affinity.translate(turned, pose[0], pose[1])


def _coverage(pose: Array) -> float:
    return float(_TARGET.intersection(_placed(pose)).area / _TARGET.area)


def _between_walls(pose: Array) -> bool:
    corners = transform(pose, _CORNERS)
    return bool(corners.min() >= WALLS[0] and corners.max() <= WALLS[1])


_CORNERS = tee().outline.vertices
_SHAPE = Polygon(_CORNERS)
_TARGET = _placed(GOAL)

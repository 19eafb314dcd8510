"""A tool in the physics cell: its drives follow the targets, its fingers push the object, MuJoCo decides the rest."""

import math
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...control.loop.limits import turn_within
from ...errors import InputError, MissingExtra
from ...geometry.pose import Array
from ...problem import Plan
from ..addresses import Address
from ..arms import ARMS, Arm
from ..course import alike, planned
from ..robot import Limits, OutOfLimits, RobotFault, State
from ..simulated import DryRun, Unknown, home_of
from .model import DAMPING, FOOT, STEP, STIFFNESS, Physics, cell_xml, height_of

LIMITS = Limits(period=0.004, deviation=0.005)
# The joints at the beginning are the object's, those at the end the tool's.
OBJECT, TOOL = slice(0, 3), slice(-4, None)
# The drives are led by this much of the speed, so that their damping does not hold the tool back [s].
LEAD = DAMPING / STIFFNESS
PICTURE = (960, 1280)
Picture = NDArray[np.uint8]
# Where Linux says that there is a display.
DISPLAYS = ("DISPLAY", "WAYLAND_DISPLAY")
# The arms that it has.
HELD_BY = ("irb120", "fr3", "ur5e")


def load() -> ModuleType:
    """MuJoCo, drawing without a display where there is none.

    Raises:
        MissingExtra: if it is not installed.
    """
    if "DISPLAY" not in os.environ:
        os.environ.setdefault("MUJOCO_GL", "egl")
    try:
        import mujoco
    except ImportError:
        raise MissingExtra('the physics cell needs MuJoCo: pip install "flatpush[sim]"') from None
    return mujoco


class CellRobot(DryRun):
    """A position-controlled tool and the object of a plan in MuJoCo.

    Args:
        plan: whose object and fingers it has. unknown: in what they differ. table: friction of the feet.
        arm: that holds the tool; None: drives along x, y, z and about z.
        home: of the tool. limits: what may be asked for.

    Raises:
        MissingExtra: without MuJoCo.
        OutOfLimits: for a plan, or a home behind its first pose, out of the arm's reach: with segment, time and limit.
        InputError: for fingers that would not pass over the object when they are lifted.
    """

    def __init__(
        self,
        plan: Plan,
        unknown: Unknown | None = None,
        *,
        table: float | None = None,
        arm: Arm | None = None,
        home: ArrayLike | None = None,
        limits: Limits = LIMITS,
    ) -> None:
        unknown, scene = unknown or Unknown(), plan.scene
        if arm is not None:
            # Heights of E count from the middle of the object, which is above the table.
            arm = replace(arm, height=height_of(scene) / 2 + FOOT)
            limits = replace(limits, arm=arm)
        if home is None:
            home = home_of(plan)
            low, high = limits.yaws(home)
            home[3] += turn_within(low - home[3], high - home[3], *alike(plan))
        super().__init__(home, limits)
        self._mujoco, self._arm = load(), arm
        if height_of(scene) / 2 + scene.pusher.lift - scene.pusher.tip_radius < height_of(scene):
            raise InputError(
                "the fingertips do not pass over the object", key="pusher.lift", value=scene.pusher.lift
            )
        rng = np.random.default_rng(unknown.seed)
        start, tool = unknown.draw(rng)
        friction = scene.object.friction if unknown.friction is None else unknown.friction
        physics = Physics(friction, tool=(float(tool[0]), float(tool[1])))
        if table is not None:
            physics = Physics(friction, table, physics.tool)
        self._model = self._mujoco.MjModel.from_xml_string(
            cell_xml(scene, plan.on_table[0].fingers, physics, arm)
        )
        self._data = self._mujoco.MjData(self._model)
        if arm is not None and arm.unreachable(self._pose):
            # What of the plan is out of reach says more than that the place behind its first pose is.
            planned(plan, yaw=float(self._pose[3])).check(limits)
            raise OutOfLimits(f"approach, 0.00 s: {arm.unreachable(self._pose)}")
        self._data.qpos[OBJECT] = scene.start_pose + start
        self._data.ctrl[:] = self._drives(self._pose)
        self._data.qpos[-len(self._data.ctrl) :] = self._data.ctrl
        # Where the tool was sent last, and its drives there.
        self._held, self._drawn = self._pose, np.array(self._data.ctrl)
        self._mujoco.mj_forward(self._model, self._data)
        self._body, self._site = self._data.body("tool"), np.zeros(6)

    @property
    def object(self) -> Array:
        """X_WO, shape (3,)."""
        return np.array(self._data.qpos[OBJECT])

    def state(self) -> State:
        self._check()
        if self._arm is None:
            return State(np.array(self._data.qpos[TOOL]), np.array(self._data.qvel[TOOL]), self.clock.now())
        kind = self._mujoco.mjtObj.mjOBJ_XBODY
        self._mujoco.mj_objectVelocity(self._model, self._data, kind, self._body.id, self._site, 0)
        yaw = math.atan2(self._body.xmat[3], self._body.xmat[0])
        yaw = self._held[3] + math.remainder(yaw - self._held[3], 2 * math.pi)
        pose = np.array([*self._body.xpos, yaw])
        return State(pose, np.array([*self._site[3:], self._site[2]]), self.clock.now())

    def _drives(self, pose: Array) -> Array:
        """Where the drives are for a pose of the tool."""
        return pose if self._arm is None else self._arm.joints(pose)

    def stop(self) -> None:
        self._target = None

    def picture(self, path: str | os.PathLike[str]) -> None:
        """Draws the cell as it is now, as a .png."""
        from PIL import Image

        with self.pictures(*PICTURE) as drawn:
            Image.fromarray(drawn()).save(Path(path))

    @contextmanager
    def pictures(self, height: int, width: int) -> Iterator[Callable[[], Picture]]:
        """Draws the cell as it is whenever it is asked to, (height, width, 3), from where it sees the beginning."""
        camera = self._mujoco.MjvCamera()
        camera.lookat[:2] = 0.5 * (self.object[:2] + self._body.xpos[:2])
        camera.distance, camera.azimuth, camera.elevation = (0.35 if self._arm is None else 1.1), 60.0, -30.0
        with self._mujoco.Renderer(self._model, height, width) as renderer:

            def drawn() -> Picture:
                renderer.update_scene(self._data, camera)
                return np.array(renderer.render())

            yield drawn

    @contextmanager
    def viewer(self) -> Iterator[Callable[[], None]]:
        """A window, drawn anew whenever it is asked to.

        Raises:
            InputError: where there is no display.
        """
        if not any(os.environ.get(name) for name in DISPLAYS) and sys.platform == "linux":
            raise InputError("there is no display for a window", hint="--film cell.gif makes a film instead.")
        from mujoco import viewer

        with viewer.launch_passive(self._model, self._data) as shown:
            yield shown.sync

    def _advance(self, until: float) -> None:
        steps = round((until - self.clock.now()) / STEP)
        begin, target, before = self.clock.now(), self._target, self._held
        moving = 0
        if target is not None and target.time > begin:
            moving = min(steps, round((target.time - begin) / STEP))
            share = min(1.0, (until - begin) / (target.time - begin))
            end = target.pose if share == 1 else before + share * (target.pose - before)
            here, there = self._drawn, self._drives(end)
            rate = (there - here) / max(moving, 1)
            leads = here + (np.arange(1, moving + 1)[:, None] + LEAD / STEP) * rate
            step, model, data, ctrl = self._mujoco.mj_step, self._model, self._data, self._data.ctrl
            for lead in leads:
                ctrl[:] = lead
                step(model, data)
            self._held, self._drawn = end, there
        if moving < steps:
            self._data.ctrl[:] = self._drawn
            self._mujoco.mj_step(self._model, self._data, steps - moving)
        if self._data.warning.number.any():
            raise RobotFault("the physics of the cell is unstable")


def mujoco(address: Address, plan: Plan) -> CellRobot:
    """`mujoco://tool?noise=MM,DEG&start=MM,MM,DEG&tool=MM&friction=μ&table=μ&seed=N`, `mujoco://irb120` (fr3, ur5e)"""
    if address.host not in ("", "tool", *HELD_BY):
        raise InputError(
            "the physics cell has no such arm",
            value=address.text,
            hint=f"There are mujoco://tool, {', '.join(f'mujoco://{name}' for name in HELD_BY)}.",
        )
    arm = None
    if address.host in HELD_BY:
        arm = ARMS[address.host].placed(address.base if any(address.base) else None)
    limits, unknown = address.limits(LIMITS), Unknown.of(address)
    (table,) = address.numbers("table", 1, (np.nan,), least=0)
    address.check_used(port=False)
    return CellRobot(plan, unknown, table=None if np.isnan(table) else table, arm=arm, limits=limits)

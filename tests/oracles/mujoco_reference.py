"""An object on feet and round fingers with an imposed motion in MuJoCo, built to be quasi-static.

The object moves in the plane. Every foot slides up and down in it on its own and carries exactly its own weight, so the
pressure is known. Fingers are spheres at half height in a hand so heavy that nothing slows it down.
"""

from collections.abc import Sequence

import mujoco
import numpy as np

import flatpush as fp

SPEED, START, STEP = 0.01, 0.02, 5e-5  # [m/s], [m/s²], [s]
HEIGHT, GRAVITY, HEAVY = 0.02, 300.0, 1e6
# A contact that slides at v with the rate b is lifted by the friction μ b v in MuJoCo's soft cones; where that is not
# far below the acceleration that presses it on, it hops. So the table is slippery and gravity strong: μ g counts.
FOOT, LIGHT = 0.1, 0.002  # mass of a foot of mean load, and of everything else [kg]
FOOT_RATE, SIDE_RATE = 1e4, 200.0  # b at a foot, μ b at a finger [1/s]
FLOOR = 0.02
ON_AN_ARC = 201  # poses


def _body(thing: fp.Object, boxes: Sequence[tuple[float, float, float, float]]) -> tuple[str, str]:
    """Assets and geoms of the object: a cylinder, boxes (xmin, ymin, xmax, ymax), or one convex prism."""
    common = 'contype="0" conaffinity="0"'
    if thing.outline.is_circle:
        x, y = thing.outline.centre
        return "", (
            f'<geom name="side0" type="cylinder" size="{thing.outline.radius} {HEIGHT / 2}" pos="{x} {y} 0" {common}/>'
        )
    if boxes:
        return "", "".join(
            f'<geom name="side{k}" type="box" size="{(c - a) / 2} {(d - b) / 2} {HEIGHT / 2}"'
            f' pos="{(a + c) / 2} {(b + d) / 2} 0" {common}/>'
            for k, (a, b, c, d) in enumerate(boxes)
        )
    corners = [(x, y, z) for z in (-HEIGHT / 2, HEIGHT / 2) for x, y in thing.outline.vertices]
    centre = np.mean(corners, axis=0)
    vertices = " ".join(f"{v:.12g}" for c in corners for v in np.subtract(c, centre))
    place = " ".join(f"{v:.12g}" for v in centre)
    return (
        f'<mesh name="prism" vertex="{vertices}"/>',
        f'<geom name="side0" type="mesh" mesh="prism" pos="{place}" {common}/>',
    )


def _pair(first: str, second: str, friction: float, rate: float) -> str:
    solid = 'solref="0.003 1" solimp="0.9999 0.9999 0.001"'
    if not friction:
        return f'<pair geom1="{first}" geom2="{second}" condim="1" {solid}/>'
    return (
        f'<pair geom1="{first}" geom2="{second}" condim="3" friction="{friction} {friction} 0 0 0"'
        f' {solid} solreffriction="0 {-rate}"/>'
    )


def _model(
    thing: fp.Object,
    tips: np.ndarray,
    radius: float,
    boxes: Sequence[tuple[float, float, float, float]],
    step: float,
) -> mujoco.MjModel:
    assets, geoms = _body(thing, boxes)
    places, weights = thing.support.feet
    loads = weights / np.mean(weights)
    feet = "".join(
        f'<body pos="{x} {y} {-HEIGHT / 2}"><joint type="slide" axis="0 0 1"/>'
        f'<geom name="foot{k}" type="sphere" size="0.001" mass="{FOOT * load}" contype="0" conaffinity="0"/></body>'
        for k, ((x, y), load) in enumerate(zip(places, loads, strict=True))
    )
    fingers = "".join(
        f'<geom name="tip{i}" type="sphere" size="{radius}" mass="{HEAVY}" pos="{x} {y} 0" contype="0"'
        ' conaffinity="0"/>'
        for i, (x, y) in enumerate(tips)
    )
    floor = "".join(_pair("floor", f"foot{k}", FLOOR, FOOT_RATE) for k in range(len(loads)))
    sides = "".join(
        _pair(f"side{k}", f"tip{i}", thing.friction, SIDE_RATE / max(thing.friction, 1e-9))
        for k in range(max(len(boxes), 1))
        for i in range(len(tips))
    )
    model = mujoco.MjModel.from_xml_string(f"""
<mujoco>
  <compiler inertiafromgeom="auto" boundmass="1e-9" boundinertia="1e-12"/>
  <option timestep="{step}" cone="elliptic" solver="Newton" tolerance="1e-12" iterations="100" impratio="1"
    gravity="0 0 -{GRAVITY}" integrator="Euler"/>
  <asset>{assets}</asset>
  <worldbody>
    <geom name="floor" type="plane" size="1 1 1" pos="0 0 {-HEIGHT / 2 - 0.001}" contype="0" conaffinity="0"/>
    <body name="object"><joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/>
      <joint type="hinge" axis="0 0 1"/>
      <inertial pos="0 0 0" mass="{LIGHT}" diaginertia="1e-6 1e-6 1e-6"/>
      {geoms}{feet}</body>
    <body name="hand"><joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/>
      <joint type="hinge" axis="0 0 1" armature="{HEAVY}"/>{fingers}</body>
  </worldbody>
  <contact>{floor}{sides}</contact>
</mujoco>""")
    model.stat.meaninertia = FOOT  # what the solver's tolerance is relative to: not the hand
    return model


class Reference:
    """The object, and fingers that a hand moves as it is told.

    Args:
        thing: on feet. tips: fingertip centres in the frame of the hand, shape (k, 2). radius: theirs [m].
        boxes: of which the object consists, if it is not convex.
        speed: of the fastest fingertip [m/s]. step: of time [s].
    """

    def __init__(
        self,
        thing: fp.Object,
        tips: np.ndarray,
        radius: float,
        boxes: Sequence[tuple[float, float, float, float]] = (),
        speed: float = SPEED,
        step: float = STEP,
    ) -> None:
        self.tips, self.speed, self.step = np.asarray(tips, dtype=float), speed, step
        self._model = _model(thing, self.tips, radius, boxes, step)
        self._data = mujoco.MjData(self._model)

    def follow(self, pose: np.ndarray, hands: np.ndarray) -> np.ndarray:
        """Poses X_WO of the object (n, 3), which was at rest, as its hand is at poses X_WE (n, 3), straight between."""
        model, data = self._model, self._data
        mujoco.mj_resetData(model, data)
        data.qpos[:3], data.qpos[-3:] = pose, hands[0]
        inertia = np.zeros((model.nv, model.nv))
        found, pace, spare = [np.array(pose)], 0.0, 0.0
        for move in np.diff(hands, axis=0):
            left = float(np.max(np.hypot(*move[:2]) + abs(move[2]) * np.hypot(*self.tips.T)))
            direction = move / max(left, 1e-12)
            while left > 1e-12:
                # The hand sets out gently, so that the object's inertia shows nowhere.
                gains = START if pace < self.speed else 0.0
                part = min(left, (self.speed**2 - pace**2) / (2 * START)) if gains else left
                lasts = (np.sqrt(pace**2 + 2 * START * part) - pace) / START if gains else part / pace
                mujoco.mj_forward(model, data)
                mujoco.mj_fullM(model, data, inertia)
                data.qvel[-3:] = pace * direction
                data.qfrc_applied[-3:] = inertia[-3:, -3:] @ (gains * direction)
                steps, spare = divmod(spare + lasts / self.step, 1.0)
                mujoco.mj_step(model, data, nstep=int(steps))
                left, pace = left - part, min(pace + gains * lasts, self.speed)
                if self.speed - pace < 1e-9:
                    pace = self.speed
            found.append(np.array(data.qpos[:3]))
        return np.array(found)


def push(
    thing: fp.Object,
    start: np.ndarray,
    tips: np.ndarray,
    radius: float,
    *,
    length: float,
    angle: float | None = None,
    centre: np.ndarray | None = None,
    boxes: Sequence[tuple[float, float, float, float]] = (),
) -> np.ndarray:
    """Where the object is, X_WO (3,), after fingers at tips (k, 2) went straight or about a centre, at SPEED.

    Args:
        length: of the straight way, or of the arc that the first fingertip makes, counter-clockwise if positive [m].
        angle: of the straight way [rad]. centre: of the arc instead, shape (2,).
        boxes: of which the object consists, if it is not convex.
    """
    if angle is not None:
        hands = np.array([[0.0, 0.0, 0.0], [length * np.cos(angle), length * np.sin(angle), 0.0]])
    else:
        assert centre is not None
        turns = np.linspace(0.0, length / float(np.hypot(*(tips[0] - centre))), ON_AN_ARC)
        c, s = np.cos(turns), np.sin(turns)
        x, y = centre
        hands = np.column_stack([x - c * x + s * y, y - s * x - c * y, turns])
    return Reference(thing, tips, radius, boxes).follow(start, hands)[-1]

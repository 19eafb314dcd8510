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
    return (
        f'<pair geom1="{first}" geom2="{second}" condim="3" friction="{friction} {friction} 0 0 0"'
        f' solref="0.003 1" solimp="0.9999 0.9999 0.001" solreffriction="0 {-rate}"/>'
    )


def _model(
    thing: fp.Object,
    tips: np.ndarray,
    radius: float,
    centre_or_angle: np.ndarray | float,
    boxes: Sequence[tuple[float, float, float, float]],
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
    joint = (
        f'<joint type="slide" axis="{np.cos(centre_or_angle)} {np.sin(centre_or_angle)} 0"/>'
        if np.ndim(centre_or_angle) == 0
        else f'<joint type="hinge" pos="{centre_or_angle[0]} {centre_or_angle[1]} 0"/>'
    )
    floor = "".join(_pair("floor", f"foot{k}", FLOOR, FOOT_RATE) for k in range(len(loads)))
    sides = "".join(
        _pair(f"side{k}", f"tip{i}", thing.friction, SIDE_RATE / thing.friction)
        for k in range(max(len(boxes), 1))
        for i in range(len(tips))
    )
    model = mujoco.MjModel.from_xml_string(f"""
<mujoco>
  <compiler inertiafromgeom="auto" boundmass="1e-9" boundinertia="1e-12"/>
  <option timestep="{STEP}" cone="elliptic" solver="Newton" tolerance="1e-12" iterations="100" impratio="1"
    gravity="0 0 -{GRAVITY}" integrator="Euler"/>
  <asset>{assets}</asset>
  <worldbody>
    <geom name="floor" type="plane" size="1 1 1" pos="0 0 {-HEIGHT / 2 - 0.001}" contype="0" conaffinity="0"/>
    <body name="object"><joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/>
      <joint type="hinge" axis="0 0 1"/>
      <inertial pos="0 0 0" mass="{LIGHT}" diaginertia="1e-6 1e-6 1e-6"/>
      {geoms}{feet}</body>
    <body name="hand">{joint}{fingers}</body>
  </worldbody>
  <contact>{floor}{sides}</contact>
</mujoco>""")
    model.stat.meaninertia = FOOT  # what the solver's tolerance is relative to: not the hand
    return model


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
        model, rate = _model(thing, tips, radius, angle, boxes), SPEED
    else:
        assert centre is not None
        model, rate = _model(thing, tips, radius, centre, boxes), SPEED / float(np.hypot(*(tips[0] - centre)))
    data = mujoco.MjData(model)
    data.qpos[:3] = start
    # The hand sets out gently, so that the object's inertia shows nowhere.
    inertia = np.zeros((model.nv, model.nv))
    mujoco.mj_forward(model, data)
    mujoco.mj_fullM(model, data, inertia)
    begin = SPEED / START  # [s], in which it goes half as far as later
    data.qfrc_applied[-1] = np.sign(length) * rate / begin * inertia[-1, -1]
    mujoco.mj_step(model, data, nstep=round(begin / STEP))
    data.qfrc_applied[-1] = 0.0
    data.qvel[-1] = np.sign(length) * rate
    mujoco.mj_step(model, data, nstep=round((abs(length) / SPEED - 0.5 * begin) / STEP))
    return np.array(data.qpos[:3])

"""The physics cell in MuJoCo's language: a table, an object on feet that carry its support's pressure, and a tool."""

from dataclasses import dataclass

import numpy as np

from ...friction.patches import patches
from ...geometry import Outline
from ...geometry.pose import Array
from ...problem import Scene
from ..arms import ARMS, Arm
from .arms import fr3, irb120, ur5e

# The object is so high, but at most this share of the lift [m]; fingertips are balls at half of that.
HEIGHT, OF_LIFT = 0.02, 0.6
MASS, BODY = 0.3, 0.02  # of the object [kg], and the share that its feet do not carry
FOOT = 0.001  # radius of a foot [m]
# About so many for a spread pressure, and those at its rim; an outline of many corners has no more than this. Each foot
# costs as much as a finger, and what is lost of ρ by joining neighbours is below 2 %.
FEET, MOST_FEET = 8, 16
TABLE = 0.3  # friction between feet and table
TIP_MASS = 0.3  # of a finger [kg]
STEM = 0.08  # length of a finger [m]
# Of the tool's drives: stiffness [N/m] and damping [N s/m]; of the turning drive by LEVER² [N m/rad].
# It has the inertia of a finger at LEVER: MuJoCo finds contact forces without the damping that its integrator adds, so
# a tip without inertia counted as spun by every change of its turn rate, and kicked the object away.
STIFFNESS, DAMPING, LEVER = 4e4, 400.0, 0.03
STEP = 0.001  # [s]
# Time constants [s] and impedances of contacts. MuJoCo's cone lifts what slides: a stiff foot hops, carries now nothing
# and now twice its share, and each time the fingers slip a little, always to the same side. So feet are soft.
AT_FOOT, FOOT_SOFT = 0.05, "0.9 0.9"
AT_TIP, TIP_SOFT = 0.01, "0.99 0.999"
# Pieces are joined while their union fills its hull to this part.
CONVEX = 1e-6
# An outline is drawn within this of its own [m].
OUTLINE_TOLERANCE = 2e-5


@dataclass(frozen=True)
class Physics:
    """What differs from the scene.

    Attributes:
        friction: at the fingertips. table: of the feet. tool: the fingertips are off by this in E (x, y) [m].
        feet: about so many for a spread pressure.
    """

    friction: float
    table: float = TABLE
    tool: tuple[float, float] = (0.0, 0.0)
    feet: int = FEET


def height_of(scene: Scene) -> float:
    """Of the object [m]."""
    return min(HEIGHT, OF_LIFT * scene.pusher.lift)


def cell_xml(scene: Scene, tips: Array, physics: Physics, arm: Arm | None = None) -> str:
    """The model: joints object-x, -y, -turn, a slide for each foot, and tool-x, -y, -z, -turn, in this order.

    The object moves in the plane. Every foot slides up and down on its own and carries exactly its own weight, so
    that the pressure on the table is known. Heights count from the middle of the object.

    Args:
        tips: of the fingertips in E, shape (k, 2).
        arm: holds the tool; its joints stand in the place of the tool's.
    """
    thing, high = scene.object, height_of(scene)
    places, loads = joined(*patches(thing.support.pressure, physics.feet)[:2], MOST_FEET)
    places = places + thing.support.centre
    assets, sides, names = _body(thing.outline, high)
    feet = "".join(
        f'<body pos="{x:.9g} {y:.9g} {-high / 2}"><joint type="slide" axis="0 0 1"/>'
        f'<geom name="foot{k}" type="sphere" size="{FOOT}" mass="{(1 - BODY) * MASS * load:.9g}" {_SHY}/></body>'
        for k, ((x, y), load) in enumerate(zip(places, loads, strict=True))
    )
    radius = max(scene.pusher.tip_radius, 1e-4)
    fingers = "".join(
        f'<geom name="tip{i}" type="sphere" size="{radius}" mass="{TIP_MASS}" rgba="0.2 0.2 0.25 1"'
        f' pos="{x:.9g} {y:.9g} 0" {_SHY}/>'
        f'<geom type="capsule" size="{radius}" fromto="{x:.9g} {y:.9g} 0 {x:.9g} {y:.9g} {STEM}" mass="0"'
        f' rgba="0.6 0.6 0.65 1" {_SHY}/>'
        for i, (x, y) in enumerate(tips + np.array(physics.tool))
    )
    floor = "".join(_pair("floor", f"foot{k}", physics.table, AT_FOOT, FOOT_SOFT) for k in range(len(loads)))
    touch = "".join(
        _pair(name, f"tip{i}", physics.friction, AT_TIP, TIP_SOFT) for name in names for i in range(len(tips))
    )
    drives = "".join(
        f'<position joint="tool-{axis}" kp="{STIFFNESS * scale:g}" kv="{DAMPING * scale:g}"/>'
        for axis, scale in (("x", 1.0), ("y", 1.0), ("z", 1.0), ("turn", LEVER**2))
    )
    holder = f"""<body name="tool" gravcomp="1"><joint name="tool-x" type="slide" axis="1 0 0"/>
<joint name="tool-y" type="slide" axis="0 1 0"/><joint name="tool-z" type="slide" axis="0 0 1"/>
<joint name="tool-turn" type="hinge" axis="0 0 1" armature="{TIP_MASS * LEVER**2}"/>{fingers}</body>"""
    if arm is not None:
        more, holder, drives = MODELS[arm.name](arm, fingers, -high / 2 - FOOT)
        assets += more
    cx, cy = thing.cof
    return f"""<mujoco model="flatpush cell">
<compiler boundmass="1e-9" boundinertia="1e-9"/>
<option timestep="{STEP}" cone="elliptic" solver="Newton" jacobian="sparse" impratio="20"
 integrator="implicitfast" tolerance="1e-10"/>
<visual><global offwidth="1280" offheight="960"/><headlight ambient="0.35 0.35 0.35" diffuse="0.25 0.25 0.25"/>
<map znear="0.01"/></visual>
<statistic extent="0.4" center="0 0 0"/>
<asset>{assets}</asset>
<worldbody>
<light pos="0.3 -0.4 1" dir="-0.3 0.4 -1" diffuse="0.35 0.35 0.35" specular="0 0 0"/>
<geom name="floor" type="plane" size="0.6 0.6 0.1" pos="0 0 {-high / 2 - FOOT}" rgba="0.85 0.84 0.8 1" {_SHY}/>
<body name="object"><joint name="object-x" type="slide" axis="1 0 0"/><joint name="object-y" type="slide" axis="0 1 0"/>
<joint name="object-turn" type="hinge" axis="0 0 1"/>
<inertial pos="{cx:.9g} {cy:.9g} 0" mass="{BODY * MASS}" diaginertia="1e-6 1e-6 1e-6"/>{sides}{feet}</body>
{holder}
</worldbody>
<contact>{floor}{touch}</contact><actuator>{drives}</actuator>
</mujoco>"""


MODELS = {ARMS["irb120"].name: irb120, ARMS["fr3"].name: fr3, ARMS["ur5e"].name: ur5e}
_SHY = 'contype="0" conaffinity="0"'  # touches only what a pair names


def _pair(first: str, second: str, friction: float, time: float, soft: str) -> str:
    return (
        f'<pair geom1="{first}" geom2="{second}" condim="3" friction="{friction:.9g} {friction:.9g} 0 0 0"'
        f' solref="{time} 1" solimp="{soft} 0.0005"/>'
    )


def _body(outline: Outline, high: float) -> tuple[str, str, list[str]]:
    """Assets and geoms of the object, and the geoms' names: a cylinder, or prisms over the outline's convex pieces."""
    look = f'rgba="0.27 0.47 0.67 1" mass="0" {_SHY}'
    if outline.is_circle:
        x, y = outline.centre
        return (
            "",
            f'<geom name="side0" type="cylinder" size="{outline.radius} {high / 2}" pos="{x} {y} 0" {look}/>',
            ["side0"],
        )
    assets, geoms, names = "", "", []
    for k, piece in enumerate(convex_pieces(outline.vertices)):
        corners = " ".join(f"{x:.9g} {y:.9g} {z}" for z in (-high / 2, high / 2) for x, y in piece)
        assets += f'<mesh name="prism{k}" vertex="{corners}"/>'
        geoms += f'<geom name="side{k}" type="mesh" mesh="prism{k}" {look}/>'
        names.append(f"side{k}")
    return assets, geoms, names


def joined(places: Array, loads: Array, most: int) -> tuple[Array, Array]:
    """Loads at places (n, 2), (n,) as so many at most: those are joined where they balance whose joining takes least
    from the second moments."""
    places, loads = np.array(places), np.array(loads)
    while len(loads) > most:
        apart = np.sum((places[:, None] - places[None]) ** 2, axis=2)
        lost = apart * np.multiply.outer(loads, loads) / np.add.outer(loads, loads)
        np.fill_diagonal(lost, np.inf)
        i, j = sorted(np.unravel_index(np.argmin(lost), lost.shape))
        both = loads[i] + loads[j]
        places[i] = (loads[i] * places[i] + loads[j] * places[j]) / both
        loads[i] = both
        places, loads = np.delete(places, j, axis=0), np.delete(loads, j)
    return places, loads


def convex_pieces(vertices: Array) -> list[Array]:
    """A simple polygon as few convex ones: its triangles, joined while they stay convex; corners (n, 2) of each."""
    import shapely

    whole = shapely.Polygon(vertices).simplify(OUTLINE_TOLERANCE)
    pieces = list(shapely.constrained_delaunay_triangles(whole).geoms)
    joined = True
    while joined:
        joined = False
        for i in range(len(pieces)):
            for j in range(i + 1, len(pieces)):
                if pieces[i].touches(pieces[j]):
                    both = pieces[i].union(pieces[j])
                    if (
                        both.geom_type == "Polygon"
                        and both.convex_hull.area - both.area <= CONVEX * whole.area
                    ):
                        pieces[i], joined = both.convex_hull, True
                        del pieces[j]
                        break
            if joined:
                break
    return [np.array(piece.exterior.coords)[:-1] for piece in pieces]

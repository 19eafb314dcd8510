"""Whatever is wrong with a scene is refused in one message that names file, key, value, rule and a hint."""

import copy
import json
import warnings
from pathlib import Path
from typing import Any

import pytest
import yaml

from flatpush.documents import load_scene, parse_scene
from flatpush.errors import InputError

GOOD: dict[str, Any] = {
    "flatpush": "scene/1",
    "units": {"length": "mm", "angle": "deg"},
    "object": {
        "name": "triangle",
        "outline": [[19.667, -9.5], [19.667, 19.0], [-39.333, -9.5]],
        "support": "uniform",
        "friction": 0.3,
    },
    "pusher": {"fingers": 2, "spacing": 18, "tip_radius": 2.5},
    "pushes": [{"name": "long edge", "at": [0, -9.5]}, {"name": "hypotenuse", "edge": 1, "along": 0.4}],
    "start": [30, 50, 45],
    "goal": [0, 0, 0],
    "workspace": {"bounds": [-225, -127, 225, 127]},
}
NAN, INF = float("nan"), float("inf")
FEET = "object.support.points"

# What is changed ("-key": removed), and what the message then holds besides the name of the file.
CASES: list[tuple[str, dict[str, Any], list[str]]] = [
    # versions and keys
    ("no version", {"-flatpush": 0}, ["flatpush: this key is missing", "flatpush: scene/1"]),
    ("misspelt version key", {"-flatpush": 0, "flatpsh": "scene/1"}, ["flatpush:", "'flatpsh'"]),
    (
        "newer version",
        {"flatpush": "scene/2"},
        ["flatpush: this flatpush reads scene/1, got 'scene/2'", "newer"],
    ),
    ("a plan", {"flatpush": "plan/1"}, ["got 'plan/1'", "This is a plan"]),
    ("missing start", {"-start": 0}, ["start: this key is missing", "[x, y, angle]"]),
    ("missing outline", {"-object.outline": 0}, ["object.outline: this key is missing", "{circle: r}"]),
    ("missing friction", {"-object.friction": 0}, ["object.friction: this key is missing", "Coulomb"]),
    (
        "missing along",
        {"pushes": [{"edge": 1}]},
        ["pushes[0].along: this key is missing", "place on the edge"],
    ),
    ("unknown key", {"gaol": [1, 2, 3]}, ["gaol: unknown key, got [1, 2, 3]", "Did you mean 'goal'?"]),
    (
        "unknown instead of missing",
        {"-goal": 0, "gaol": 3},
        ["gaol: unknown key, got 3", "Did you mean 'goal'?"],
    ),
    ("unknown inside", {"pusher.tipradius": 3}, ["pusher.tipradius: unknown key, got 3", "'tip_radius'"]),
    ("unknown, nothing near", {"units.mass": "kg"}, ["units.mass: unknown key", "Known keys: length, angle"]),
    (
        "unknown form",
        {"object.outline": {"cirle": 4}},
        ["object.outline.cirle: unknown key, got 4", "'circle'"],
    ),
    (
        "unknown in a push",
        {"pushes": [{"at": [0, -9.5], "normal": [0, 0]}]},
        ["pushes[0].normal: unknown key"],
    ),
    ("both forms", {"pushes": [{"at": [0, -9.5], "edge": 1}]}, ["pushes[0]: a push takes only one of", "at"]),
    # values of the wrong kind
    ("NaN", {"start": [1, NAN, 2]}, ["start[1]: a finite number is needed, got nan", "[x, y, angle]"]),
    ("infinite", {"goal": [1, 2, INF]}, ["goal[2]: a finite number is needed, got inf"]),
    ("text for a number", {"start": [1, "2", 3]}, ["start[1]: a number is needed, got '2'", "quotes"]),
    ("with a unit", {"pusher.spacing": "18 mm"}, ["pusher.spacing: a number is needed, got '18 mm'", "unit"]),
    ("boolean for a number", {"goal": [0, True, 0]}, ["goal[1]: a number is needed, got True"]),
    ("boolean for a count", {"pusher.fingers": True}, ["pusher.fingers: a whole number is needed, got True"]),
    (
        "nothing for a number",
        {"object.friction": None},
        ["object.friction: a number is needed, nothing is given"],
    ),
    (
        "word for a boolean",
        {"pusher.turns": "no"},
        ["pusher.turns: true or false is needed, got 'no'", "false"],
    ),
    ("number for a text", {"object.name": 12}, ["object.name: a text is needed, got 12", "quotes"]),
    ("list for a mapping", {"object": [1]}, ["object: a mapping", "got [1]", "{outline: ..."]),
    ("number for a list", {"start": 3}, ["start: a list is needed, got 3", "[x, y, angle]"]),
    ("two for a pose", {"start": [1, 2]}, ["start: at least 3 entries are needed, not 2", "[x, y, angle]"]),
    (
        "four for a pose",
        {"goal": [1, 2, 3, 4]},
        ["goal: at most 3 entries are needed, not 4", "[x, y, angle]"],
    ),
    ("unknown unit", {"units.length": "inch"}, ["units.length: 'm', 'cm' or 'mm' is needed, got 'inch'"]),
    (
        "misspelt word",
        {"planning": {"model": "exect"}},
        ["planning.model:", "got 'exect'", "Did you mean 'exact'?"],
    ),
    (
        "fraction for a count",
        {"planning": {"iterations": 1e4}},
        ["planning.iterations: a whole number", "10000.0"],
    ),
    (
        "no iteration",
        {"planning": {"iterations": 0}},
        ["planning.iterations: a number of at least 1", "got 0"],
    ),
    ("huge number", {"start": [1e300, 0, 0]}, ["start[0]: a number of at most 1e+09 is needed, got 1e+300"]),
    ("endless number", {"start": [10**400, 0, 0]}, ["start[0]: a finite number is needed"]),
    # outlines
    ("two corners", {"object.outline": [[0, 0], [1, 0]]}, ["object.outline: an outline has at least three"]),
    (
        "one place",
        {"object.outline": [[1, 1] for _ in range(4)]},
        ["object.outline: an outline has at least three different"],
    ),
    (
        "no corners",
        {"object.outline": []},
        ["object.outline: an outline is a list of [x, y] corners, got []"],
    ),
    (
        "no area",
        {"object.outline": [[0, 0], [9, 0], [4, 0]]},
        ["object.outline: an outline encloses an area"],
    ),
    ("crossing", {"object.outline": [[0, 0], [9, 9], [9, 0], [0, 8]]}, ["object.outline:", "cross", "order"]),
    (
        "three coordinates",
        {"object.outline": [[0, 0, 0], [1, 0, 0], [0, 1, 0]]},
        ["object.outline[0]: at most 2"],
    ),
    (
        "no radius",
        {"object.outline": {"circle": 0}},
        ["object.outline.circle: a number greater than 0", "got 0"],
    ),
    (
        "two outlines",
        {"object.outline": {"circle": 9, "file": "a.svg"}},
        ["object.outline: an outline takes only"],
    ),
    (
        "a name for a file",
        {"object.outline": "part.svg"},
        ["object.outline: an outline does not", "{file: part.svg}"],
    ),
    (
        "no such drawing",
        {"object.outline": {"file": "no.svg"}},
        ["object.outline.file: ", "no.svg: the file cannot be read", "got 'no.svg'"],
    ),
    (
        "unknown drawing",
        {"object.outline": {"file": "part.png"}},
        ["object.outline.file: ", "part.png: a drawing is an .svg or .dxf file"],
    ),
    # pushes
    ("no pushes", {"pushes": []}, ["pushes: at least 1 entries are needed, not 0", "auto"]),
    ("off the outline", {"pushes": [{"at": [0, -12]}]}, ["pushes[0].at: the point is 2.5 off", "[0, -9.5]"]),
    ("inside", {"pushes": [{"at": [0, 0]}]}, ["pushes[0].at: the point is", "1 %", "nearest point"]),
    (
        "at a corner",
        {"pushes": [{"at": [19.667, 19]}]},
        ["pushes[0].at:", "corner, got [19.667, 19]", "normal"],
    ),
    ("edge's corner", {"pushes": [{"edge": 0, "along": 1}]}, ["pushes[0].along:", "corner, got 1", "normal"]),
    (
        "beyond the edge",
        {"pushes": [{"edge": 0, "along": 1.2}]},
        ["pushes[0].along: a number of at most 1", "1.2"],
    ),
    (
        "no such edge",
        {"pushes": [{"edge": 3, "along": 0.5}]},
        ["pushes[0].edge: edges count from 0 to 2, got 3"],
    ),
    (
        "negative edge",
        {"pushes": [{"edge": -1, "along": 0.5}]},
        ["pushes[0].edge: a number of at least 0", "-1"],
    ),
    (
        "edge of a circle",
        {"object.outline": {"circle": 20}, "pushes": [{"edge": 1, "along": 0.5}]},
        ["pushes[0].edge: edges count from 0 to 0, got 1", "circle"],
    ),
    (
        "same name",
        {"pushes": [{"name": "a", "at": [0, -9.5]}, {"name": "a", "at": [5, -9.5]}]},
        ["pushes[1].name: two pushes have this name, got 'a'", "of its own"],
    ),
    ("no name", {"pushes": [{"name": "", "at": [0, -9.5]}]}, ["pushes[0].name: an empty text", "got ''"]),
    (
        "fingers overlap",
        {"pushes": [{"at": [0, -9.5], "spacing": 3}]},
        ["pushes[0].spacing: the fingers overlap"],
    ),
    (
        "no spacing",
        {"pusher": {"fingers": 1}, "pushes": [{"at": [0, -9.5], "fingers": 2}]},
        ["pushes[0].spacing: two fingers need a positive spacing, got 0", "to the pusher"],
    ),
    (
        "two fingers that do not turn",
        {"pusher": {"turns": False}, "pushes": [{"at": [0, -9.5], "fingers": 2, "spacing": 18}]},
        ["pushes[0].fingers: two fingers that cannot turn", "Use one finger"],
    ),
    # pusher
    (
        "pusher without spacing",
        {"pusher": {"fingers": 2}},
        ["pusher.spacing: two fingers need a positive spacing"],
    ),
    ("pusher's overlap", {"pusher.spacing": 4}, ["pusher.spacing: the fingers overlap, got 4", "tip_radius"]),
    (
        "three fingers",
        {"pusher.fingers": 3},
        ["pusher.fingers: a number of at most 2 is needed, got 3", "1 or 2"],
    ),
    ("no speed", {"pusher.speed": 0}, ["pusher.speed: a number greater than 0 is needed, got 0"]),
    # friction
    ("negative friction", {"object.friction": -0.1}, ["object.friction: a number of at least 0", "got -0.1"]),
    (
        "unknown support",
        {"object.support": "unifrom"},
        ["object.support:", "got 'unifrom'", "mean 'uniform'?"],
    ),
    (
        "negative weight",
        {"object.support": {"points": [[0, 0, 1], [9, 0, 1], [0, 9, -1]]}},
        ["object.support: "],
    ),
    (
        "no weight",
        {"object.support": {"points": [[0, 0, 0], [9, 0, 0]]}},
        ["object.support:", "positive sum"],
    ),
    (
        "one foot",
        {"object.support": {"points": [[3, 4, 1]]}},
        ["object.support:", "two different places", "turning"],
    ),
    ("foot without weight", {"object.support": {"points": [[3, 4]]}}, [f"{FEET}[0]: at least 3", "weight"]),
    (
        "surface not symmetric",
        {"object.surface": {"ellipsoid": [[1, 0, 0.5], [0, 1, 0], [0, 0, 1]]}},
        ["object.surface: the matrix of an ellipsoid is symmetric", "3 × 3"],
    ),
    (
        "surface not definite",
        {"object.surface": {"ellipsoid": [[1, 0, 0], [0, -1, 0], [0, 0, 1]]}},
        ["object.surface:", "positive definite"],
    ),
    ("few coefficients", {"object.surface": {"quartic": [1] * 14}}, ["object.surface.quartic: at least 15"]),
    (
        "no such surface",
        {"object.surface": {"file": "no.json"}},
        ["object.surface.file: ", "no.json: the file cannot be read"],
    ),
    # units
    (
        "degrees as radians",
        {"units": {"length": "mm"}, "start": [30, 50, 45]},
        ["start[2]:", "got 45", "angle: deg"],
    ),
    ("many turns", {"goal": [0, 0, 721]}, ["goal[2]: an angle of a pose is within two turns", "got 721"]),
    (
        "object larger than its table",
        {"workspace.bounds": [-0.2, -0.1, 0.2, 0.1]},
        ["workspace.bounds: the object, 65.52 mm long, is larger than the workspace", "Check the units"],
    ),
    # workspace and planning
    (
        "bounds the wrong way",
        {"workspace.bounds": [5, 0, -5, 9]},
        ["workspace.bounds:", "[xmin, ymin, xmax, ymax]"],
    ),
    (
        "obstacle crosses itself",
        {"workspace.obstacles": [[[0, 0], [9, 0], [0, 9]], [[0, 0], [9, 9], [9, 0], [0, 8]]]},
        ["workspace.obstacles[1]:", "cross"],
    ),
    (
        "round obstacle without size",
        {"workspace.obstacles": [{"circle": 0, "centre": [9, 9]}]},
        ["workspace.obstacles[0].circle: a number greater than 0"],
    ),
    (
        "round obstacle without end",
        {"workspace.obstacles": [{"circle": float("inf"), "centre": [9, 9]}]},
        ["workspace.obstacles[0].circle:", "finite"],
    ),
    (
        "round obstacle somewhere",
        {"workspace.obstacles": [{"circle": 3}]},
        ["workspace.obstacles[0].centre:"],
    ),
    (
        "no such contact of two fingers",
        {"planning": {"two_finger": "cones"}},
        ["planning.two_finger:", "cone", "middle"],
    ),
    (
        "whole margin",
        {"planning": {"margin": {"friction": 1}}},
        ["planning.margin.friction: a number less than 1"],
    ),
    (
        "no tolerance",
        {"planning": {"goal_tolerance": [0, 1, 1]}},
        ["planning.goal_tolerance[0]:", "greater than 0"],
    ),
    (
        "wide tolerance",
        {"planning": {"goal_tolerance": [1, 1, 400]}},
        ["planning.goal_tolerance[2]:", "half a turn"],
    ),
]


def changed(changes: dict[str, Any]) -> dict[str, Any]:
    document = copy.deepcopy(GOOD)
    for path, value in changes.items():
        *parents, key = path.removeprefix("-").split(".")
        place = document
        for parent in parents:
            place = place[parent]
        if path.startswith("-"):
            del place[key]
        else:
            place[key] = value
    return document


def refusal(path: Path) -> InputError:
    with pytest.raises(InputError) as caught:
        load_scene(path)
    return caught.value


@pytest.mark.parametrize("kind", ["yaml", "json"])
@pytest.mark.parametrize(("changes", "words"), [case[1:] for case in CASES], ids=[case[0] for case in CASES])
def test_scene_is_refused(tmp_path: Path, kind: str, changes: dict[str, Any], words: list[str]) -> None:
    path = tmp_path / f"scene.{kind}"
    document = changed(changes)
    path.write_text(yaml.safe_dump(document, allow_unicode=True) if kind == "yaml" else json.dumps(document))
    error = refusal(path)
    assert str(error).startswith(f"{path}: ")
    for word in words:
        assert word in str(error)
    assert error.rule
    assert error.hint
    assert len(str(error)) < 500
    assert "\n" not in str(error)


def test_the_unchanged_scene_is_accepted(tmp_path: Path) -> None:
    path = tmp_path / "scene.json"
    path.write_text(json.dumps(GOOD))
    assert load_scene(path).object.name == "triangle"


def test_only_the_first_of_many_errors_is_told_with_their_number(tmp_path: Path) -> None:
    path = tmp_path / "scene.json"
    path.write_text(json.dumps(changed({"start": [1, "x", 3], "goal": 5, "object.friction": -1})))
    assert "2 more to correct" in str(refusal(path))


def test_collinear_feet_are_accepted_with_a_warning(tmp_path: Path) -> None:
    path = tmp_path / "scene.json"
    path.write_text(json.dumps(changed({"object.support": {"points": [[-9, 0, 1], [0, 0, 1], [9, 0, 1]]}})))
    with pytest.warns(UserWarning, match="one line"):
        load_scene(path)


def test_valid_oddities_are_accepted(tmp_path: Path) -> None:
    """Repeated corners, no friction, and whole numbers for numbers are no errors."""
    path = tmp_path / "scene.json"
    corners = [[0, 0], [20, 0], [20, 0], [20, 10], [0, 10], [0, 0]]
    document = changed(
        {"object.outline": corners, "object.friction": 0, "pushes": [{"edge": 3, "along": 0.5}]}
    )
    path.write_text(json.dumps(document))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        scene = load_scene(path)
    assert scene.object.outline.vertices.shape == (4, 2)
    assert scene.object.friction == 0
    # Edges count as written: edge 3 runs from (20, 10) to (0, 10) although a corner before it stands twice.
    assert scene.pushes[0].at.point.tolist() == [0.01, 0.01]


def test_a_list_that_no_scene_has_is_refused_before_each_of_its_entries():
    """10 MB of numbers for an outline took over a minute: each was an error of its own."""
    document = {"flatpush": "scene/1", "object": {"outline": [1.5] * 200_000}}
    with pytest.raises(InputError, match="at most 100000 entries, not 200000") as failure:
        parse_scene(document)
    assert failure.value.key == "object.outline"


@pytest.mark.parametrize("key", ["object.outline", "workspace.obstacles"])
def test_more_corners_than_can_be_worked_with_are_refused(key):
    """describe took minutes with 95,000 of them."""
    corners = [[0.001 * k, 0.001 * k * k] for k in range(11_000)]
    several, few = (corners * 2, corners) if key == "object.outline" else ([corners, corners], [corners])
    outer, inner = key.split(".")
    with pytest.raises(InputError, match="at most 20000 corners, not 22000") as failure:
        parse_scene({"flatpush": "scene/1", outer: {inner: several}})
    assert failure.value.key == key
    with pytest.raises(InputError, match="this key is missing"):
        parse_scene({"flatpush": "scene/1", outer: {inner: few}})

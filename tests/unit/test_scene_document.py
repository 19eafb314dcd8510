"""Scene documents: units, forms, defaults, the round trip, the template, the examples and the schema."""

import json
import re
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from flatpush.documents import (
    load_scene,
    load_surface,
    parse_scene,
    plan_schema,
    read_mapping,
    save_surface,
    scene_document,
    scene_schema,
    scene_template,
)
from flatpush.documents.number_lists import number_lists
from flatpush.documents.reading import mapping_of
from flatpush.documents.refusals import descriptions
from flatpush.documents.schema import FOLDER
from flatpush.errors import InputError
from flatpush.friction.ellipsoid import Ellipsoid
from flatpush.friction.quartic import Quartic
from flatpush.friction.support import Support
from flatpush.geometry import Outline
from flatpush.problem import Object, Planning, Push, Pusher, Scene, Workspace

ROOT = Path(__file__).parents[2]
EXAMPLES = sorted((ROOT / "examples").glob("*.yaml"))
TRIANGLE = [[19.667, -9.5], [19.667, 19.0], [-39.333, -9.5]]


def scene_in(units: dict[str, str], per_mm: float, degree: float, **more: Any) -> Scene:
    """One and the same scene, written in other units."""

    def lengths(values: Any) -> Any:
        return (np.array(values) * per_mm).tolist()

    return parse_scene(
        {
            "flatpush": "scene/1",
            "units": units,
            "object": {
                "outline": lengths(TRIANGLE),
                "friction": 0.3,
                "support": {
                    "points": [[*lengths(p), w] for p, w in (((1, 2), 1), ((9, 4), 2), ((-5, 1), 1))]
                },
            },
            "pusher": {
                "fingers": 2,
                **{
                    k: lengths(v)
                    for k, v in (("spacing", 18), ("tip_radius", 2), ("speed", 30), ("lift", 40))
                },
                **{k: lengths(v) for k, v in (("acceleration", 90), ("approach", 3))},
            },
            "pushes": [{"at": lengths([0, -9.5]), "spacing": lengths(12)}, {"edge": 1, "along": 0.4}],
            "start": [*lengths([30, 50]), 45 * degree],
            "goal": [*lengths([-3, 5]), -90 * degree],
            "workspace": {
                "bounds": lengths([-200, -100, 200, 100]),
                "obstacles": [
                    lengths([[80, 0], [90, 0], [85, 9]]),
                    {"circle": lengths(12), "centre": lengths([-40, 70])},
                ],
            },
            "planning": {
                "switch_cost": lengths(25),
                "margin": {"friction": 0.1, "clearance": lengths(4)},
                "goal_tolerance": [*lengths([1, 2]), 3 * degree],
                **more,
            },
        }
    )


@pytest.mark.parametrize(
    ("units", "per_mm", "degree"),
    [
        ({"length": "mm", "angle": "deg"}, 1.0, 1.0),
        ({"length": "cm", "angle": "rad"}, 0.1, np.pi / 180),
        ({"length": "m"}, 1e-3, np.pi / 180),
        ({}, 1e-3, np.pi / 180),
    ],
)
def test_every_number_follows_the_units(units: dict[str, str], per_mm: float, degree: float) -> None:
    scene = scene_in(units, per_mm, degree)
    close = {"rtol": 1e-14, "atol": 1e-17}
    np.testing.assert_allclose(scene.object.outline.vertices, np.array(TRIANGLE) / 1000, **close)
    np.testing.assert_allclose(scene.object.cof, [0.0035, 0.00275], rtol=1e-14)
    p = scene.pusher
    lengths = (p.spacing, p.tip_radius, p.speed, p.acceleration, p.approach, p.lift)
    np.testing.assert_allclose(lengths, (0.018, 0.002, 0.03, 0.09, 0.003, 0.04), **close)
    assert not isinstance(scene.pushes, str)
    np.testing.assert_allclose([push.spacing for push in scene.pushes], [0.012, 0.018], **close)
    np.testing.assert_allclose(scene.pushes[0].at.point, [0, -0.0095], atol=1e-17)
    np.testing.assert_allclose(scene.pushes[1].at.point, [-0.003933, 0.0076], rtol=1e-13)
    np.testing.assert_allclose(scene.start, [0.03, 0.05, np.pi / 4], **close)
    np.testing.assert_allclose(scene.goal, [-0.003, 0.005, -np.pi / 2], **close)
    np.testing.assert_allclose(scene.workspace.bounds, [-0.2, -0.1, 0.2, 0.1], **close)
    corners, disc = scene.workspace.obstacles
    np.testing.assert_allclose(corners.vertices[2], [0.085, 0.009], **close)
    np.testing.assert_allclose([disc.radius, *disc.centre], [0.012, -0.04, 0.07], **close)
    plan = scene.planning
    np.testing.assert_allclose(plan.goal_tolerance, [0.001, 0.002, np.pi / 60], **close)
    np.testing.assert_allclose([plan.switching, plan.clearance], [0.025, 0.004], **close)
    assert plan.friction_margin == 0.1


def test_whole_millimetres_become_the_nearest_metres() -> None:
    """9 * 0.001 is 0.009000000000000001; a plan should hold 0.009."""
    scene = parse_scene(minimal(start=[9, 18, 0], goal=[36, 72, 0]))
    assert scene.start_pose.tolist() == [0.009, 0.018, 0.0]
    corners = [[0, 0], [9, 0], [0, 18]]
    outline = parse_scene(minimal(object={"outline": corners, "friction": 0.3})).object.outline
    assert outline.vertices.tolist() == [[0.0, 0.0], [0.009, 0.0], [0.0, 0.018]]


def test_a_switching_cost_in_seconds_has_no_length() -> None:
    scene = scene_in({"length": "mm", "angle": "deg"}, 1.0, 1.0, cost="time", switch_cost=2)
    assert scene.planning.switching == 2.0


def minimal(**changes: Any) -> dict[str, Any]:
    thing = {"outline": {"circle": 40}, "friction": 0.3}
    return {
        "flatpush": "scene/1",
        "units": {"length": "mm"},
        "object": thing,
        "start": [60, 20, 1],
        "goal": [0, 0, 0],
        **changes,
    }


def test_defaults_are_the_same_lengths_in_every_unit() -> None:
    """The contract: the defaults shown for a file in mm hold whatever a file's units are."""
    for unit in ("m", "cm", "mm"):
        scene = parse_scene(minimal(units={"length": unit}))
        assert scene.pusher == Pusher(1, 0.0, 0.0025, 0.02, 0.1, 0.002, True, "lift", 0.03)
        tolerance = (0.0005, 0.0005, float(np.deg2rad(0.5)))
        assert scene.planning == Planning(
            "exact", "cone", "flat", 0.03, 0.2, 0.0, tolerance, False, 0, 10000, 5.0
        )
        assert scene.pushes == "auto"
        assert scene.workspace.bounds is None
    assert parse_scene(minimal(planning={"cost": "pusher"})).planning.switching == 0.0


def test_pushes_on_a_circle() -> None:
    pushes = [{"at": [0, 40.2]}, {"edge": 0, "along": 0.5}, {"edge": 0, "along": 0.0}]
    scene = parse_scene(minimal(pushes=pushes))
    assert not isinstance(scene.pushes, str)
    points = [push.at.point for push in scene.pushes]
    np.testing.assert_allclose(points, [[0, 0.04], [-0.04, 0], [0.04, 0]], atol=1e-17)
    np.testing.assert_allclose(scene.pushes[1].at.normal, [1, 0], atol=1e-15)
    assert [push.name for push in scene.pushes] == ["push 1", "push 2", "push 3"]


def test_changes_take_the_place_of_what_is_written(tmp_path: Path) -> None:
    path = tmp_path / "scene.json"
    path.write_text(json.dumps(minimal(planning={"seed": 3, "model": "local"})))
    scene = load_scene(path, {"start": [10, 20, 2], "planning": {"seed": 7}})
    assert scene.start_pose.tolist() == [0.01, 0.02, 2.0]
    assert (scene.planning.seed, scene.planning.model) == (7, "local")
    with pytest.raises(InputError, match=r"start\[2\].*degrees"):
        load_scene(path, {"start": [10, 20, 90]})


def test_yaml_means_what_it_looks_like(tmp_path: Path) -> None:
    """YAML 1.1 reads 1e-3 as text, on as true, 010 as eight and 1:30 as ninety."""
    path = tmp_path / "scene.yaml"
    path.write_text(
        "a: [1e-3, -2E5, .5, 1., 010, +3]\nb: [on, no, 1:30, 0x10, '5', 1_000]\nc: [true, ~, .5e1]\n"
    )
    assert read_mapping(path) == {
        "a": [0.001, -2e5, 0.5, 1.0, 10, 3],
        "b": ["on", "no", "1:30", "0x10", "5", "1_000"],
        "c": [True, None, 5.0],
    }


@pytest.mark.parametrize("flow", [False, None, True])
def test_long_lists_of_numbers_in_yaml_are_read_as_json_and_mean_the_same(flow, monkeypatch):
    """A scene of 95,000 corners took 2.7 s of CPU to refuse, half of it for the events of its numbers."""
    corners = [[0.5 * k, -3] for k in range(300)]
    text = yaml.safe_dump(
        {
            "object": {"outline": corners, "friction": 0.3},
            "points": [[-1e-7, k] for k in range(400)],
            "z": [1, 2],
        },
        default_flow_style=flow,
    )
    assert [len(found.values(int)) for found in number_lists(text)] == [300, 400]
    quick = mapping_of(text, "scene.yaml")
    assert quick == yaml.safe_load(text)
    monkeypatch.setattr("flatpush.documents.reading.number_lists", lambda text: [])
    assert mapping_of(text, "scene.yaml") == quick


LONG = str([[0.5 * k, -3] for k in range(300)])


@pytest.mark.parametrize(
    "text",
    [
        f"a: '{LONG}'",
        f"a: |\n  {LONG}\nb: 1",
        f"a: 1  # {LONG}",
        f"a: {LONG[:-1]}, .5, +3, 010]",
        f"a: {LONG[:-1]}, ]",
        f"a: [{LONG}, word, {LONG}]",
        f"a:\n- {LONG}\n- {LONG}",
        f"a:\n- {{b: {LONG}, c: 1}}",
        "a:\n- 7\n" + "- [1, 2.5]\n" * 300,
        "a:\n" + "- [1, 2.5]\n" * 300 + "- word\n",
        "a:\n" + "- - 1\n  - 2.5\n" * 300 + "b: 3\n",
        "a:\n  b:\n" + "  - - 1\n    - 2.5\n" * 300 + "  - - 1\n    - 2\n    - 3\n",
        "a:\n" + "- - - 1\n    - 2\n" + "  - - 1\n    - 2.5\n" * 300,
    ],
)
def test_what_only_looks_like_a_long_list_of_numbers_is_read_as_yaml(text, monkeypatch):
    quick = mapping_of(text)
    monkeypatch.setattr("flatpush.documents.reading.number_lists", lambda text: [])
    assert mapping_of(text) == quick


def test_what_is_wrong_beside_a_long_list_of_numbers_is_named_with_its_place():
    for text, words in (
        (f"a: {LONG}\nb: 1\nb: 2", "b: this key stands twice"),
        (f"a: {LONG}\nb: [1\nc: 2", "line 3"),
        (f"a: {LONG}: 3", "line 1, column"),
        (f"? {LONG}\n: 3", "a key is a word"),
        (f"a: !!str {LONG}", "tags"),
        (f"a: {'[' * 70}{LONG}{']' * 70}", "at most 60 levels"),
        (f"a: [{'1,' * 600}1]", "a: a list has at most 600 entries"),
    ):
        with pytest.raises(InputError) as failure:
            mapping_of(text, longest=600)
        assert words in str(failure.value)


def test_json_and_yaml_are_told_apart(tmp_path: Path) -> None:
    for name, text in (
        ("scene", '{"a": 1}'),
        ("scene.yaml", "{a: 1}"),
        ("scene.txt", "a: 1"),
        ("s.json", '{"a":1}'),
    ):
        (tmp_path / name).write_text(text, encoding="utf-8-sig")
        assert read_mapping(tmp_path / name) == {"a": 1}


FORMS: list[Any] = [
    "uniform",
    "outline",
    {"points": [[1.1, 2.3, 0.7], [0.1, -7.7, 1], [-5.3, 1.9, 0.111]]},
    {"disc": 12.3},
    {"ring": 12.3, "centre": [0.1, 0.7]},
    {"polygon": [[-3.3, -1], [5.1, -2], [0.3, 7.7]]},
    {"outline": [[-3.3, -1], [5.1, -2], [0.3, 7.7]]},
]


@pytest.mark.parametrize("support", FORMS)
@pytest.mark.parametrize("outline", [TRIANGLE, {"circle": 39.7}, {"circle": 39.7, "centre": [0.1, 0.3]}])
def test_a_scene_reads_back_to_itself_exactly(support: Any, outline: Any) -> None:
    thing = {"outline": outline, "friction": 0.3, "support": support}
    pushes = [{"edge": 0, "along": 0.377, "fingers": 2, "spacing": 11.1}, {"edge": 0, "along": 0.1}]
    scene = parse_scene(minimal(object=thing, pushes=pushes))
    document = json.loads(json.dumps(scene_document(scene)))
    again = parse_scene(document)
    assert scene_document(again) == document
    assert_same(scene, again)


def assert_same(a: Scene, b: Scene) -> None:
    assert np.array_equal(a.object.outline.vertices, b.object.outline.vertices)
    assert np.array_equal(a.object.outline.centre, b.object.outline.centre)
    assert a.object.outline.radius == b.object.outline.radius
    assert np.array_equal(a.object.cof, b.object.cof)
    twist = [0.3, -0.7, 11.0]
    assert np.array_equal(a.object.support.wrench(twist), b.object.support.wrench(twist))
    assert (a.object.friction, a.object.name) == (b.object.friction, b.object.name)
    assert (a.pusher, a.planning) == (b.pusher, b.planning)
    assert np.array_equal(a.start_pose, b.start_pose)
    assert np.array_equal(a.goal_pose, b.goal_pose)
    assert a.workspace.bounds == b.workspace.bounds
    for x, y in zip(a.workspace.obstacles, b.workspace.obstacles, strict=True):
        assert np.array_equal(x.vertices, y.vertices)
        assert (*x.centre, x.radius) == (*y.centre, y.radius)
    for p, q in zip(a.pushes, b.pushes, strict=True):
        if isinstance(p, Push) and isinstance(q, Push):
            assert (p.name, p.fingers, p.spacing, p.at.edge, p.at.along) == (
                q.name,
                q.fingers,
                q.spacing,
                q.at.edge,
                q.at.along,
            )
            assert np.array_equal(p.at.point, q.at.point)
            assert np.array_equal(p.at.normal, q.at.normal)


@settings(max_examples=60, deadline=None)
@given(
    st.lists(
        st.tuples(st.floats(-70, 70), st.floats(-70, 70), st.floats(0.01, 9)),
        min_size=3,
        max_size=7,
        unique=True,
    ),
    st.lists(st.tuples(st.integers(0, 6), st.floats(0.01, 0.99)), min_size=1, max_size=4),
    st.floats(-720, 720),
)
def test_any_scene_reads_back_exactly(feet: list[Any], places: list[Any], angle: float) -> None:
    """A star-shaped outline with pushes anywhere on it and any feet, in mm and degrees."""
    turns = np.arange(7) * 2 * np.pi / 7
    radii = 20 + np.abs([f[0] for f in (feet * 7)[:7]])
    outline = np.stack([radii * np.cos(turns), radii * np.sin(turns)], axis=-1)
    spread = np.ptp([f[:2] for f in feet], axis=0)
    points = [*feet, (100, 0, 1.0), (0, 100, 1.0)] if min(spread) < 1 else [*feet, (100, -100, 0.5)]
    document = minimal(
        units={"length": "mm", "angle": "deg"},
        object={"outline": outline, "friction": 0.3, "support": {"points": points}},
        pushes=[{"edge": edge, "along": along} for edge, along in places],
        start=(1 / 3, 0.1, angle),
    )
    scene = parse_scene(document)
    assert_same(scene, parse_scene(json.loads(json.dumps(scene_document(scene)))))


def test_scenes_built_in_python_can_be_written() -> None:
    """Also with supports that no word stands for; their points come back to rounding."""
    outline = Outline.polygon(np.array(TRIANGLE) / 1000)
    supports = [
        Support.points([(0, 0), (0.01, 0), (0, 0.02)], [1, 2, 3]),
        Support.disc(0.01, (0.001, 0)),
        Support.ring(0.01),
        Support.polygon(outline.vertices),
        Support.outline([(0, 0), (0.01, 0), (0, 0.02)]),
    ]
    for support in supports:
        at = outline.nearest((0.001, -0.0095))
        scene = Scene(
            Object(outline, support, 0.3),
            start=(0, 0, 1),
            pushes=(Push("a", at, 1),),
            workspace=Workspace((-1, -1, 1, 1)),
        )
        document = scene_document(scene)
        again = parse_scene(document)
        np.testing.assert_allclose(again.object.cof, scene.object.cof, atol=1e-17)
        assert scene_document(again) == document
    assert document["object"]["support"]["outline"][1] == pytest.approx([0.01, 0])
    scene = Scene(Object(outline, Support.polygon(outline.vertices), 0.3), start=(0, 0, 1))
    assert scene_document(scene)["object"]["support"] == "uniform"


def test_a_scene_in_python_refuses_degrees_too() -> None:
    with pytest.raises(InputError, match="degrees"):
        Scene(Object(Outline.circle(0.04)), start=(0, 0, 90))


def test_surfaces(tmp_path: Path) -> None:
    matrix = [[1.0, 0.1, 0.0], [0.1, 1.3, 2.0], [0.0, 2.0, 2500.0]]
    coefficients = [1.0, 1, 1, 0, 0, 0, 0, 0, 0, 2, 2, 2, 0, 0, 0]
    for surface, name, values in (
        (Ellipsoid(np.array(matrix)), "ellipsoid", matrix),
        (Quartic(np.array(coefficients)), "quartic", coefficients),
    ):
        save_surface(surface, tmp_path / "surface.json")
        assert json.loads((tmp_path / "surface.json").read_text(encoding="utf-8")) == {
            "flatpush": "surface/1",
            name: values,
        }
        assert type(load_surface(tmp_path / "surface.json")) is type(surface)
        for form in ({name: values}, {"file": "surface.json"}):
            document = minimal(object={"outline": {"circle": 40}, "friction": 0.3, "surface": form})
            scene = parse_scene(document, str(tmp_path / "scene.yaml"))
            assert scene_document(scene)["object"]["surface"] == {name: values}
            again = parse_scene(scene_document(scene))
            assert scene_document(again) == scene_document(scene)


@pytest.mark.parametrize(
    ("document", "words"),
    [
        ({"flatpush": "surface/1"}, "either an ellipsoid or a quartic"),
        ({"flatpush": "surface/1", "ellipsoid": np.eye(3).tolist(), "quartic": [1] * 15}, "either"),
        (
            {"flatpush": "surface/2", "ellipsoid": np.eye(3).tolist()},
            "flatpush: this flatpush reads surface/1 here",
        ),
        ({"flatpush": "surface/1", "elipsoid": []}, "Did you mean 'ellipsoid'"),
        ({"flatpush": "surface/1", "ellipsoid": (-np.eye(3)).tolist()}, "ellipsoid: .*positive definite"),
        ({"flatpush": "surface/1", "quartic": [-1.0] * 15}, "surface.json: quartic: "),
    ],
)
def test_bad_surface_files(tmp_path: Path, document: Any, words: str) -> None:
    path = tmp_path / "surface.json"
    path.write_text(json.dumps(document))
    with pytest.raises(InputError, match=words) as caught:
        load_surface(path)
    assert str(path) in str(caught.value)


def test_the_template_loads_and_names_every_key(tmp_path: Path) -> None:
    path = tmp_path / "scene.yaml"
    path.write_text(scene_template())
    scene = load_scene(path)
    assert scene.object.name == "triangle"
    assert len(scene.pushes) == 3
    for key in descriptions(scene_schema()):
        assert re.search(rf"\b{key.rsplit('.', 1)[-1]}\b", scene_template()), key
    # Also what stands in comments is right.
    active = scene_template().replace("# workspace:", "workspace:").replace("#   ", "  ")
    path.write_text(active)
    assert len(load_scene(path).workspace.obstacles) == 2


def test_the_template_states_the_defaults() -> None:
    document = yaml.safe_load(scene_template())
    stated = parse_scene(document)
    for key in ("speed", "acceleration", "approach", "turns", "transit", "lift"):
        del document["pusher"][key]
    del document["planning"]
    assert parse_scene(document).pusher == stated.pusher
    assert parse_scene(document).planning == stated.planning


def test_the_reference_names_every_key() -> None:
    text = (ROOT / "docs" / "scene.md").read_text(encoding="utf-8")
    for key in descriptions(scene_schema()):
        assert re.search(rf"`[^`\n]*\b{key.rsplit('.', 1)[-1]}\b", text), key


def test_the_examples_are_there() -> None:
    names = {path.stem for path in EXAMPLES}
    assert names >= {
        "triangle",
        "triangle_one_finger",
        "rectangle_three_feet",
        "rectangle_boundary",
        "butterfly",
    }
    assert names >= {"disc", "l_shape", "t_shape", "bracket", "workshop"}


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_examples_load_and_fit_the_schema(path: Path) -> None:
    validator = jsonschema.Draft202012Validator(scene_schema())
    validator.validate(read_mapping(path))
    scene = load_scene(path)
    document = scene_document(scene)
    validator.validate(document)
    assert_same(scene, parse_scene(document))
    assert path.read_text(encoding="utf-8").startswith("# ")


def test_the_butterfly_is_drawn_as_it_says() -> None:
    outline = load_scene(ROOT / "examples" / "butterfly.yaml").object.outline.vertices
    t = 2 * np.pi * (np.arange(48) + 0.5) / 48
    shape = (1 - 0.12 * np.cos(4 * t)) * np.array([np.cos(t), np.sin(t)])
    shape *= np.array([[0.01442], [0.0195]]) / shape.max(axis=1, keepdims=True)
    np.testing.assert_allclose(outline, shape.T, atol=0.6e-6)


def test_the_shipped_schemas_are_current() -> None:
    """python -c "from flatpush.documents.schema import write_schemas; write_schemas()" renews them."""
    for name, schema in (("scene", scene_schema()), ("plan", plan_schema())):
        jsonschema.Draft202012Validator.check_schema(schema)
        assert json.loads((FOLDER / f"{name}.schema.json").read_text(encoding="utf-8")) == schema


def test_the_schema_refuses_what_the_reader_refuses() -> None:
    validator = jsonschema.Draft202012Validator(scene_schema())
    good = minimal()
    validator.validate(good)
    for change in (
        {"gaol": 1},
        {"start": [1, 2]},
        {"pushes": []},
        {"pushes": [{"at": [0, 1], "edge": 1}]},
        {"start": "x"},
    ):
        assert not validator.is_valid({**good, **change}), change


def test_arrays_tuples_and_numpy_numbers_are_plain_values() -> None:
    document = minimal(
        object={"outline": np.array(TRIANGLE), "friction": np.float64(0.3)},
        start=np.array([1.0, 2.0, 0.5]),
        goal=(np.int64(1), 2, 0.5),
        planning={"seed": np.int64(3)},
    )
    scene = parse_scene(document)
    assert scene.goal_pose.tolist() == [0.001, 0.002, 0.5]
    assert scene.planning.seed == 3

"""The picture of the pushes of a scene."""

import itertools
import re
from xml.etree import ElementTree

import numpy as np
import pytest
from PIL import Image
from tests.drawn_plans import (
    LEFT,
    RIGHT,
    TRIANGLE,
    boxes_overlap,
    make_plan,
)

from flatpush.errors import InputError
from flatpush.geometry import Outline
from flatpush.planning.options import push_option
from flatpush.problem import (
    Object,
    Planning,
    Push,
    Scene,
)
from flatpush.view import PushSketch, describe_figure
from flatpush.view.drawing import Line
from flatpush.view.plan_figure import cone_length
from flatpush.view.push_figure import draw_sketches, sense
from flatpush.view.sketches import _drive


def sketch(refusal="", **changes):
    nan = np.full(2, np.nan)
    centres = {
        "left_centre": LEFT,
        "right_centre": RIGHT,
        "flat_point": np.array([0, 0.0375]),
        "straight": np.array([0, 1.0]),
    }
    if refusal:
        centres = dict.fromkeys(centres, nan)
    values = {
        "name": "long edge",
        "contact_points": np.array([[-0.009, -0.0095], [0.009, -0.0095]]),
        "normal": np.array([0.0, 1.0]),
        "fingertips": np.array([[-0.009, -0.012], [0.009, -0.012]]),
        "tip_radius": 0.0025,
        "friction": 0.3,
        "cof": np.zeros(2),
        "force_left": np.array([-0.3, 1.0]),
        "force_right": np.array([0.3, 1.0]),
        "motion_left": np.array([-0.4, 1.0]),
        "motion_right": np.array([0.4, 1.0]),
        **centres,
        "refusal": refusal,
    }
    return PushSketch(**{**values, **changes})


def drawn(sketches, tmp_path):
    path = tmp_path / "pushes.svg"
    describe_figure(make_plan().scene, sketches, path)
    return path.read_text()


def test_a_sketch_shows_both_rays_and_the_flat_point(tmp_path):
    text = drawn([sketch()], tmp_path)
    ElementTree.fromstring(text)
    assert "#c2189b" in text  # clockwise ray
    assert "#e3000f" in text  # flat point
    assert text == drawn([sketch()], tmp_path)


def test_a_refused_push_shows_its_reason_instead(tmp_path):
    text = drawn([sketch(refusal="off by 4.1 deg")], tmp_path)
    assert "#c2189b" not in text
    assert "off by 4.1 deg" in re.sub(r"<[^!].*?>", "", text)  # glyphs carry their text as a comment


def test_every_number_of_pushes_fits(tmp_path):
    path = tmp_path / "pushes.png"
    heights = []
    for count in (1, 3):
        describe_figure(make_plan().scene, [sketch()] * count, path)
        with Image.open(path) as image:
            heights.append(image.size[1])
    assert heights[1] > 2 * heights[0]


def test_far_and_single_contacts_are_drawn(tmp_path):
    far = sketch(left_centre=1e2 * LEFT, right_centre=1e2 * RIGHT)
    single = sketch(contact_points=np.array([[0.0, -0.0095]]), fingertips=np.array([[0.0, -0.012]]))
    ElementTree.fromstring(drawn([far, single], tmp_path))
    discs = drawn([sketch()], tmp_path).count("<circle")
    assert drawn([far], tmp_path).count("<circle") == discs - 2  # its turning centres lie off the page
    assert (
        drawn([single], tmp_path).count("<circle") == discs - 4
    )  # a fingertip and its contact, in two panels


def test_the_drawing_of_an_outline_is_shown_with_what_was_left_out(tmp_path):
    from flatpush.documents import load_scene, outline_note

    (tmp_path / "part.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" width="100mm" height="100mm" viewBox="0 0 100 100">'
        '<rect x="10" y="10" width="60" height="40"/><circle cx="30" cy="30" r="5"/>'
        '<path d="M 0 90 H 90" stroke="#000"/></svg>'
    )
    (tmp_path / "scene.yaml").write_text(
        "flatpush: scene/1\nunits: {length: mm, angle: deg}\nobject: {outline: {file: part.svg,"
        " origin: centroid}, friction: 0.3}\nstart: [0, 0, 0]\ngoal: [50, 0, 0]\n"
    )
    scene, note = load_scene(tmp_path / "scene.yaml"), outline_note(tmp_path / "scene.yaml")
    page = draw_sketches(scene, [sketch(refusal="off")], note)
    said = " ".join(t.text for t in page.texts())
    for words in (
        "the drawing",
        "x of O",
        "inside the outline (a hole)",
        "an open line",
        "unit of the drawing",
    ):
        assert words in said
    grey = [
        item.points for _, item in page.items() if isinstance(item, Line) and item.look.stroke == "#9a9a9a"
    ]
    assert sorted(len(points) > 2 for points in grey) == [False, True]  # the open line, the hole
    plain = draw_sketches(scene, [sketch(refusal="off")])
    assert plain.height < page.height
    assert "the drawing" not in {t.text for t in plain.texts()}


def test_a_cone_in_a_notch_is_as_long_as_the_object_is_deep():
    """The middle of two contacts in the notch of an L lies off the object; its cone was drawn 5 mm long."""
    corners = 1e-3 * np.array([(0, 0), (60, 0), (60, 20), (20, 20), (20, 60), (0, 60)])
    scene = Scene(Object(Outline.polygon(corners), friction=0.3), (0, 0, 0))
    length = cone_length(scene, np.array([0.025, 0.025]), [1.3 * np.pi])
    assert length == pytest.approx(
        min(0.4 * scene.object.outline.size, 0.025 / np.sin(0.3 * np.pi)), rel=1e-6
    )
    assert cone_length(scene, np.array([0.03, 0.0]), [np.pi / 2]) == pytest.approx(0.02)


def test_centres_of_a_curve_are_told_apart_by_their_sense():
    """A centre to the left of a push along +y is of a counter-clockwise turn."""
    centres = np.array([[-0.2, 0.03], [-9.0, 0.03], [np.nan, np.nan], [9.0, 0.03], [0.2, 0.03]])
    assert sense(sketch(centres=centres)).tolist() == [1.0, 1.0, 0.0, -1.0, -1.0]


def test_the_pushing_direction_stands_upright_on_the_arm_from_its_rotation_centre():
    """Fig. 1: u lies in the motion cone; half as tight a turn of a Dubins car is about a centre twice as far away."""
    thing = Object(Outline.polygon(TRIANGLE), "uniform", 0.3)
    push = Push("long edge", thing.outline.nearest((0.0, -0.0095)))
    scene = Scene(thing, (0, 0, 0), pushes=(push,), planning=Planning(model="ellipsoid"))
    car = push_option(scene, push, margin=0.0).car
    u, centre = _drive(car, push.at.point)
    assert u @ (centre - push.at.point) == pytest.approx(0.0, abs=1e-12)
    assert np.linalg.norm(centre - car.flat_point) == pytest.approx(2 * car.radius, rel=1e-6)
    assert (centre - car.flat_point) @ (car.left_centre - car.flat_point) > 0
    left, right = car.contact.motion_cone(car.surface)
    assert np.cross([*right, 0], [*u, 0])[2] > 0 > np.cross([*left, 0], [*u, 0])[2]


def test_a_sketch_names_u_and_its_texts_do_not_overlap():
    drive = sketch(drive=np.array([0.2, 1.0]), drive_centre=np.array([-0.06, 0.0]))
    page = draw_sketches(make_plan().scene, [drive, sketch(refusal="off by 4.1 deg")])
    texts = page.texts()
    assert [t.text for t in texts].count("u") == 1
    assert "u: a push to the left" in {t.text for t in texts}
    assert "darker: whatever the pressure" not in {t.text for t in texts}  # nothing of that kind is drawn
    for one, other in itertools.combinations(texts, 2):
        assert not boxes_overlap(one.box, other.box), (one.text, other.text)


def test_sketches_are_refused_in_other_formats_and_without_a_push(tmp_path):
    with pytest.raises(InputError, match=r"\.svg or \.png"):
        describe_figure(make_plan().scene, [sketch()], tmp_path / "pushes.gif")
    with pytest.raises(InputError, match="at least one push"):
        describe_figure(make_plan().scene, [], tmp_path / "pushes.svg")

"""flatpush view as a user meets it: the page in headless Chromium."""

import base64
import time
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from tests.extras import extra
from tests.live_browser import DROP, TABLET
from tests.live_pages import SCENE
from tests.waiting import until

pytestmark = pytest.mark.slow
pytest.importorskip("uvicorn", reason=extra("page"))
pytest.importorskip("starlette", reason=extra("page"))


def test_the_start_is_dragged_and_the_plan_follows(page):
    before, unit = page.scene["start"], page.js("return flatpush.table.view.unit")
    x, y = page.middle("#start .body")
    page.drag((x, y), (x + 100, y - 40), drop=False)
    page.wait("flatpush.latencies.length > 0")  # a path before the button is let go
    page.mouse("mouseReleased", x + 100, y - 40)
    page.settle()
    after = page.scene["start"]
    assert after == pytest.approx([before[0] + 100 * unit, before[1] + 40 * unit, before[2]], abs=0.02)
    first = page.plan["motion"]["object"][0]
    assert first[:2] == pytest.approx(after[:2], abs=1e-3)
    assert page.plan["proved"]
    assert page.text("title").startswith("triangle: ")
    assert page.text("cost").endswith(" mm")
    page.click("undo")
    page.settle()
    assert page.scene["start"] == before
    page.click("redo")
    page.settle()
    assert page.scene["start"] == after


def test_the_goal_is_turned_about_its_middle(page):
    before = page.middle("#goal .body")
    x, y = page.middle("#goal .handle .see")
    hub = page.js(
        "const m = document.querySelector('#goal path:nth-child(2)');"
        "const p = m.getPointAtLength(0).matrixTransform(m.getScreenCTM()); return [p.x, p.y];"
    )
    reach = x - hub[0]
    page.drag((x, y), (hub[0], hub[1] - reach))
    pose = page.scene["goal"]
    assert pose[2] == pytest.approx(90, abs=1)
    assert pose[:2] == pytest.approx([0, 0], abs=0.01)  # the middle of this triangle is its origin
    x, y, turn = page.plan["motion"]["object"][-1]
    assert (x, y) == pytest.approx((0, 0), abs=0.01)
    assert page.js("return Math.cos(arguments[0])", turn) == pytest.approx(0, abs=0.02)
    assert before != page.middle("#goal .body")


def test_an_obstacle_is_added_blocks_is_moved_and_removed(page):
    from selenium.webdriver.common.keys import Keys

    page.press("a")
    page.settle()
    assert len(page.scene["workspace"]["obstacles"]) == 1
    assert page.plan["status"] == "solved"
    assert "clearance" in dict(page.plan["proved"])
    page.drag(page.middle("#obstacles .body"), page.middle("#goal .body"))
    # The last path stays, pale, however many places are refused on the way.
    assert page.js("return document.querySelectorAll('#plan.stale .flat').length") > 0
    assert "at the goal the object overlaps obstacle 0" in page.text("reason")
    named = "return [...document.querySelectorAll('#table .blamed')].map((node) => node.dataset.item)"
    assert page.js(named) == ["obstacle:0", "goal"]
    assert page.text("cost") == "–"
    page.press("r")
    corners = page.scene["workspace"]["obstacles"][0]
    assert len({round(x) for x, _ in corners}) == 4  # it stands askew
    page.press(Keys.DELETE)
    page.settle()
    assert page.scene["workspace"]["obstacles"] == []
    assert page.plan["status"] == "solved"
    assert page.js(named) == []


def test_a_gap_that_is_too_narrow_is_shown_where_it_is(page):
    """Between two walls, a foot apart: the widest disc that gets through touches both."""
    walls = [[[-400, y], [400, y], [400, y + 5], [-400, y + 5]] for y in (-150, 145)]
    walls += [
        [[-30, -145], [-25, -145], [-25, -12], [-30, -12]],
        [[-30, 6], [-25, 6], [-25, 145], [-30, 145]],
    ]
    page.js(
        "flatpush.model.change((scene) => { scene.start = [-150, 0, 0]; scene.goal = [100, 0, 0];"
        f" scene.workspace = {{bounds: [-400, -150, 400, 150], obstacles: {walls}}}; }})"
    )
    page.wait("document.querySelector('#places .narrow')")
    ring = page.js(
        "const n = document.querySelector('#places .narrow');"
        "return ['cx', 'cy', 'r'].map((name) => Number(n.getAttribute(name)))"
    )
    assert -30 <= ring[0] <= -25
    assert ring[1:] == pytest.approx([-3.0, 9.0], abs=0.1)
    named = page.js("return [...document.querySelectorAll('.blamed')].map((node) => node.dataset.item)")
    assert named == ["obstacle:2", "obstacle:3"]
    assert "the widest way" in page.js("return document.querySelector('#places .narrow title').textContent")


def test_a_corner_of_an_obstacle_is_moved_and_one_is_put_between(page):
    page.press("a")
    page.settle()
    square = page.scene["workspace"]["obstacles"][0]
    x, y = page.middle('#handles [data-part="corner:2"] .see')
    page.drag((x, y), (x + 20, y - 20))
    moved = page.scene["workspace"]["obstacles"][0]
    assert [k for k in range(4) if moved[k] != square[k]] == [2]
    x, y = page.middle('#handles [data-part="edge:0"] .see')
    page.drag((x, y), (x, y + 15))
    assert len(page.scene["workspace"]["obstacles"][0]) == 5


def test_a_drawing_is_dropped_and_the_link_brings_it_back(page):
    """The file arrives as a browser hands it over; the drop itself is made in the page."""
    drawing = '<svg xmlns="http://www.w3.org/2000/svg" width="60mm" height="40mm" viewBox="0 0 60 40">'
    drawing += '<path d="M5 5H55V35Z"/></svg>'
    page.js(DROP, "wedge.svg", drawing)
    page.wait("flatpush.model.scene.object.name === 'wedge'")
    page.settle()
    assert page.scene["pushes"] == "auto"
    assert len(page.scene["object"]["outline"]) == 3
    assert page.text("title").startswith("wedge: ")
    page.wait("location.hash.length > 100")
    time.sleep(0.5)  # the link is written a moment after the last change
    link, scene = page.browser.current_url, page.scene
    page.js(DROP, "notes.pdf", "nothing")
    page.wait("!document.getElementById('banner').hidden")
    assert "no kind of file" in page.text("banner")
    assert page.scene == scene
    page.open(link=link)
    assert page.scene == scene
    assert page.text("title").startswith("wedge: ")


def test_files_of_other_kinds_are_dropped_and_each_is_undone(page):
    from PIL import Image

    picture = np.full((120, 160), 255, np.uint8)
    picture[30:90, 30:130] = 0
    mask = BytesIO()
    Image.fromarray(picture).save(mask, "png")
    disc = (Path(__file__).parents[1] / "data" / "drawings" / "bulge.dxf").read_bytes()
    scenes = [page.scene]
    for name, content, wide, high in (
        ("disc.dxf", disc, 40, 40),
        ("mask.png", mask.getvalue(), 50, 30),
        ("scene.yaml", SCENE.encode(), 59, 29),
    ):
        page.js(
            DROP.replace("arguments[1]", "Uint8Array.from(atob(arguments[1]), (c) => c.charCodeAt(0))"),
            name,
            base64.b64encode(content).decode(),
        )
        if name.endswith(".png"):
            page.wait("document.getElementById('pixel').open")
            page.js("document.getElementById('pixelsize').value = 0.5")
            page.browser.find_element("css selector", "#pixel .main").click()
        page.wait(f"document.getElementById('banner').textContent.startsWith('{name}: ')")
        page.settle()
        scenes.append(page.scene)
        outline = np.array(page.js("return flatpush.model.scene.object.outline"))
        assert np.ptp(outline, axis=0) == pytest.approx([wide, high], abs=0.5)
        assert page.plan["status"] == "solved", page.plan.get("reason")
    for scene in scenes[-2::-1]:
        page.click("undo")
        assert page.scene == scene
    page.click("redo")
    page.settle()
    assert page.scene == scenes[1]


def test_what_is_saved_can_be_planned_and_verified(page):
    import flatpush as fp

    for what, name in (("scene", "triangle.yaml"), ("plan", "triangle.json"), ("figure", "triangle.svg")):
        page.js(
            "const s = document.getElementById('save'); s.value = arguments[0]; s.dispatchEvent(new Event('change'));",
            what,
        )
        file = page.browser.downloads / name
        page.wait_for(file)
    assert fp.load_scene(page.browser.downloads / "triangle.yaml").object.name == "triangle"
    assert fp.verify(fp.load_plan(page.browser.downloads / "triangle.json")).ok
    assert (page.browser.downloads / "triangle.svg").read_text(encoding="utf-8").startswith("<svg")


def test_an_outline_is_drawn_by_clicking(page):
    page.click("draw")
    box = page.browser.find_element("id", "table").rect
    for dx, dy in ((200, 300), (320, 300), (320, 380), (200, 380)):
        for kind in ("mousePressed", "mouseReleased"):
            page.mouse(kind, box["x"] + dx, box["y"] + dy)
    from selenium.webdriver.common.keys import Keys

    page.press(Keys.ENTER)
    page.settle()
    unit = page.js("return flatpush.table.view.unit")
    outline = page.scene["object"]["outline"]
    wide, high = (max(p[k] for p in outline) - min(p[k] for p in outline) for k in (0, 1))
    assert (wide, high) == pytest.approx((120 * unit, 80 * unit), abs=0.1)
    assert page.plan["status"] == "solved"


def test_the_mechanics_of_a_push_that_is_clicked_go_with_the_object(page):
    page.browser.find_element("css selector", '#pushes [data-push="1"]').click()
    page.wait("document.querySelectorAll('#mechanics > *').length > 4")
    assert "friction cone" in page.text("hint")
    assert page.js("return flatpush.mechanics.shown.push") == page.plan["traces"][1]["name"]
    page.js("flatpush.player.show(0.7 * flatpush.player.duration)")
    same = "return ['mechanics', 'object'].map((id) => document.getElementById(id).getAttribute('transform'))"
    one, other = page.js(same)
    assert one == other
    page.js("flatpush.model.select('')")
    assert page.js("return document.querySelectorAll('#mechanics > *').length") == 0
    assert page.text("hint") == ""


def test_the_pointer_is_a_finger_that_pushes(page):
    page.press("p")
    assert page.text("push") == "Push by hand"
    before = page.scene["start"]
    body = page.browser.find_element("css selector", "#hand .body").rect
    x, y = body["x"] - 25, body["y"] + body["height"] / 2
    page.mouse("mousePressed", x, y)
    for k in range(1, 16):
        page.mouse("mouseMoved", x + 8 * k, y)
        time.sleep(0.05)
    page.wait("Math.abs(flatpush.hand.object[0] - flatpush.model.scene.start[0]) > 3")
    assert page.js(
        "return flatpush.hand.rows.some((row) => row[3] === 'sticks' || row[3].startsWith('slides'))"
    )
    page.mouse("mouseReleased", x + 120, y)
    assert page.scene["start"] == before
    pushed = page.js("return flatpush.hand.object")
    page.js(
        "const s = document.getElementById('save'); s.value = 'run'; s.dispatchEvent(new Event('change'));"
    )
    file = page.browser.downloads / "pushed-by-hand.csv"
    page.wait_for(file)
    from flatpush.documents.robot_log import load_robot_log

    (run,) = load_robot_log(file).runs
    assert 1e3 * run.poses[-1, :2] == pytest.approx(pushed[:2], abs=1.0)
    page.click("here")
    page.settle()
    assert page.scene["start"][:2] == pytest.approx(pushed[:2], abs=0.01)
    assert page.plan["motion"]["object"][0][:2] == pytest.approx(pushed[:2], abs=0.01)
    assert not page.browser.find_element("id", "hand").is_displayed()


def test_a_finger_on_a_tablet_drags_the_goal(page):
    page.open(TABLET, touch=True)
    before, unit = page.scene["goal"], page.js("return flatpush.table.view.unit")
    x, y = page.middle("#goal .body")

    def touch(kind, x, y):
        points = [] if kind == "touchEnd" else [{"x": x, "y": y}]
        page.browser.execute_cdp_cmd("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    for kind, k in (("touchStart", 0), ("touchMove", 30), ("touchMove", 60), ("touchEnd", 60)):
        touch(kind, x, y - k)
    page.settle()
    assert page.scene["goal"] == pytest.approx([before[0], before[1] + 60 * unit, 0], abs=0.05)


def test_the_wrench_of_the_arc_that_is_played_sits_on_the_limit_surface(page):
    page.browser.find_element("css selector", '#pushes [data-push="0"]').click()
    page.wait("flatpush.mechanics.shown")
    shares = []
    for arc, told in enumerate(page.js("return flatpush.mechanics.shown.arcs")):
        page.js(
            "const s = flatpush.player.motion.segments.find((part) => part.number === 1);"
            "flatpush.player.show(s.turns[arguments[0]].end - 0.01)",
            arc,
        )
        x, y, z = told["wrench"]
        seen = page.js(
            "const c = document.querySelector('#surfacemesh circle.wrench');"
            "return [Number(c.getAttribute('cx')), Number(c.getAttribute('cy'))];"
        )
        around, up = np.radians([page.js("return Number(document.getElementById('around').value)"), 22])
        right = -x * np.sin(around) + y * np.cos(around)
        above = z * np.cos(up) - np.sin(up) * (x * np.cos(around) + y * np.sin(around))
        assert seen == pytest.approx([right, -above], abs=1e-6)
        shares.append(page.text("wrench"))
        assert page.js("return document.querySelector('#mechanics .drive').getAttribute('d').length") > 10
    assert len(set(shares)) == len(
        {tuple(a["wrench"]) for a in page.js("return flatpush.mechanics.shown.arcs")}
    )
    page.js("flatpush.player.show(0)")  # before it lands
    assert page.text("wrench").startswith("no wrench")
    page.js("flatpush.model.select('')")
    assert not page.browser.find_element("id", "surface").is_displayed()


def test_two_hundred_runs_are_told_as_they_finish_and_the_page_does_not_wait(page):
    page.press("m")
    page.wait("flatpush.many.told")
    page.js("document.getElementById('start').focus()")
    page.press("r")  # while they run the plan still follows
    page.wait("flatpush.many.told === null")
    page.settle()
    assert page.plan["motion"]["object"][0][2] == pytest.approx(-np.pi / 4, abs=1e-4)
    page.press("m")
    counts = set()

    def done():
        counts.add(page.js("return flatpush.many.told ? flatpush.many.told.done : 0"))
        return 200 in counts

    until(done, pause=0)
    assert page.text("runsdone").startswith("200 of 200 runs: ")
    assert counts - {0, 200}
    assert page.js("return document.querySelectorAll('#tube .band').length") >= 2
    errors = page.js("return flatpush.many.told.errors")
    assert f"worst {errors[2]['distance']:.2f} mm" in page.text("runserrors").replace("<0.01", "0.00")
    page.click("runsclear")
    assert page.js("return document.getElementById('tube').children.length") == 0

"""flatpush view as a user meets it: the page in headless Chromium."""

import base64
import itertools
import json
import os
import signal
import subprocess
import time
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from tests.extras import extra
from tests.live_pages import EXAMPLES, SCENE
from tests.live_server import PATIENCE, Served
from tests.waiting import until

pytestmark = pytest.mark.slow
pytest.importorskip("uvicorn", reason=extra("page"))
pytest.importorskip("starlette", reason=extra("page"))

CUT = """
return [...document.querySelectorAll('#panel, #panel > section')].filter((n) => n.scrollWidth > n.clientWidth)
  .map((n) => `${n.id} ${n.ariaLabel}: ${n.scrollWidth} of ${n.clientWidth}`);
"""
DESK, TABLET, PHONE = (1280, 720), (820, 1180), (390, 844)
COLUMNS = "object,start_id,run_id,t,obj_x_mm,obj_y_mm,obj_theta_rad,pusher_x_mm,pusher_y_mm,pusher_theta_rad,action_id"
# A file of a name and a text, as a browser hands it over.
DROP = (
    "const data = new DataTransfer(); data.items.add(new File([arguments[1]], arguments[0]));"
    "document.dispatchEvent(new DragEvent('drop', {dataTransfer: data, bubbles: true, cancelable: true}));"
)


@pytest.fixture
def page(browser, server):
    """The page at a size of the window, with its first plan."""
    found = Page(browser, server)
    yield found
    messages = [json.loads(entry["message"])["message"] for entry in browser.get_log("performance")]
    asked = [m["params"]["request"]["url"] for m in messages if m["method"] == "Network.requestWillBeSent"]
    asked += [m["params"]["url"] for m in messages if m["method"] == "Network.webSocketCreated"]
    local = ("data:", "blob:", "about:", f"http://{server.host}/", f"ws://{server.host}/")
    assert [url for url in asked if not url.startswith(local)] == []
    assert browser.get_log("browser") == []


class Page:
    def __init__(self, browser, server):
        self.browser, self.server = browser, server
        for log in ("browser", "performance"):
            browser.get_log(log)
        self.open()

    def resize(self, size, touch=False):
        metrics = {"width": size[0], "height": size[1], "deviceScaleFactor": 1, "mobile": touch}
        self.browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
        self.browser.execute_cdp_cmd("Emulation.setTouchEmulationEnabled", {"enabled": touch})

    def open(self, size=DESK, touch=False, link=None):
        self.resize(size, touch)
        self.browser.get("about:blank")
        self.browser.get(link or self.server.link)
        self.wait("window.flatpush && flatpush.answered > 0")
        self.settle()

    def js(self, code, *arguments):
        return self.browser.execute_script(code, *arguments)

    def wait(self, condition, patience=PATIENCE):
        from selenium.webdriver.support.ui import WebDriverWait

        WebDriverWait(self.browser, patience, 0.05).until(lambda _: self.js(f"return Boolean({condition})"))

    def wait_for(self, file):
        until(file.exists, PATIENCE)

    def settle(self):
        self.wait("!flatpush.busy")

    def middle(self, selector):
        return self.js(
            "const box = document.querySelector(arguments[0]).getBoundingClientRect();"
            "return [box.x + box.width / 2, box.y + box.height / 2];",
            selector,
        )

    def mouse(self, kind, x, y, clicks=1):
        event = {"type": kind, "x": x, "y": y, "button": "left", "buttons": 1, "clickCount": clicks}
        self.browser.execute_cdp_cmd("Input.dispatchMouseEvent", event)

    def drag(self, start, end, steps=12, drop=True):
        self.mouse("mousePressed", *start)
        for k in range(1, steps + 1):
            self.mouse("mouseMoved", *(a + (b - a) * k / steps for a, b in zip(start, end, strict=True)))
        if drop:
            self.mouse("mouseReleased", *end)
            self.settle()

    def press(self, *keys):
        self.browser.switch_to.active_element.send_keys(*keys)

    def click(self, name):
        self.browser.find_element("id", name).click()

    def text(self, name):
        return self.browser.find_element("id", name).text

    @property
    def scene(self):
        return self.js("return flatpush.model.scene")

    @property
    def plan(self):
        return self.js("return flatpush.model.plan")


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


def test_space_plays_and_the_arrows_nudge(page):
    from selenium.webdriver.common.keys import Keys

    page.js("document.getElementById('speed').value = 8")
    page.press(" ")
    page.wait("flatpush.player.now > 1")
    page.press(" ")
    assert page.text("play") == "Play"
    x, y, _ = page.js("return flatpush.player.state(flatpush.player.now).object")
    shown = page.js(
        "const m = document.getElementById('object').transform.baseVal.consolidate().matrix; return [m.e, m.f];"
    )
    assert shown == pytest.approx([x, y], abs=1e-3)
    page.press(Keys.END)
    assert page.text("time").split(" s of ")[0] == page.text("time").split(" s of ")[1].removesuffix(" s")
    page.js("document.getElementById('start').focus()")
    page.press(Keys.ARROW_RIGHT)
    page.press(Keys.SHIFT, Keys.ARROW_UP)
    page.settle()
    assert page.scene["start"] == [-119, 70, -60]
    page.press("?")
    assert page.browser.find_element("id", "keys").is_displayed()
    assert "undo" in page.text("keylist")
    page.press(Keys.ESCAPE)


def test_sliders_and_numbers_say_the_same_and_change_the_plan(page):
    cost = page.text("cost")
    page.js(
        "const s = document.getElementById('object-friction-slider'); s.value = 0.6;"
        "s.dispatchEvent(new Event('input')); s.dispatchEvent(new Event('change'));"
    )
    page.settle()
    assert page.js("return document.getElementById('object-friction').value") == "0.6"
    assert page.scene["object"]["friction"] == 0.6
    assert page.text("cost") != cost
    page.js(
        "const s = document.getElementById('pusher-spacing'); s.value = 1; s.dispatchEvent(new Event('input'));"
    )
    page.settle()
    assert "pusher.spacing: the fingers overlap" in page.text("reason")


def test_every_slider_and_choice_changes_its_own_number_of_the_scene_and_is_undone(page):
    ids = page.js(
        "return [...document.querySelectorAll('#sliders input[type=range], #sliders select')].map((n) => n.id)"
    )
    assert len(ids) == 9
    for name in ids:
        before, answers = page.scene, page.js("return flatpush.answered")
        value = page.js(
            "const n = document.getElementById(arguments[0]);"
            "if (n.matches('select')) n.selectedIndex = (n.selectedIndex + 1) % n.options.length;"
            "else n.value = Number(n.value) + 2 * Number(n.step);"
            "if (!n.matches('select')) n.dispatchEvent(new Event('input'));"
            "n.dispatchEvent(new Event('change'));"
            "return n.value;",
            name,
        )
        key = name.removesuffix("-slider").split("-")
        changed = page.scene
        for step in key:
            changed = changed[step]
        assert str(changed) == value, name
        if name.endswith("-slider"):
            assert page.js("return document.getElementById(arguments[0]).value", "-".join(key)) == value
        page.wait(f"flatpush.answered > {answers}")
        page.settle()
        assert page.plan["status"] == "solved" or page.text("reason"), name
        page.click("undo")
        page.settle()
        assert page.scene == before, name


def test_every_key_that_is_listed_does_what_is_said_of_it(page):
    from selenium.webdriver.common.keys import Keys

    listed = page.js("return [...document.querySelectorAll('#keylist dt')].map((n) => n.textContent.trim())")
    scene, now = "JSON.stringify(flatpush.model.scene)", "flatpush.player.now"
    view = "document.getElementById('table').getAttribute('viewBox')"
    focus = "document.activeElement.id"
    # Of each line of the list: what is pressed in turn, and what each changes.
    does = {
        "Space": [(" ", "flatpush.player.playing")] * 2,
        "← → ↑ ↓": [(k, scene) for k in (Keys.ARROW_LEFT, Keys.ARROW_RIGHT, Keys.ARROW_UP, Keys.ARROW_DOWN)],
        "R": [("r", scene), (Keys.SHIFT + "r" + Keys.NULL, scene), (Keys.ALT + "r" + Keys.NULL, scene)],
        ", .": [(".", now), (",", now)],
        "Home End": [(Keys.END, now), (Keys.HOME, now)],
        "A": [("a", scene)],
        "Delete": [(Keys.DELETE, scene)],
        "P": [("p", "flatpush.hand.on"), (Keys.ESCAPE, "flatpush.hand.on")],
        "C": [("c", "flatpush.feedback.on"), ("c", "flatpush.feedback.on")],
        "M": [("m", "Boolean(flatpush.many.told)")],
        "D": [("d", "Boolean(flatpush.table.sketch)"), (Keys.ESCAPE, "Boolean(flatpush.table.sketch)")],
        "Tab": [(Keys.TAB, focus)],
        "+ −": [("+", view), ("-", view)],
        "F": [("+", view), ("f", view)],
        "Ctrl Z": [(Keys.CONTROL + "z" + Keys.NULL, scene)],
        "Ctrl Shift Z": [(Keys.CONTROL + Keys.SHIFT + "z" + Keys.NULL, scene)],
        "?": [("?", "Boolean(document.querySelector('dialog[open]'))")],
    }
    assert sorted(listed) == sorted(does)
    for line, presses in does.items():
        if line in ("← → ↑ ↓", "R", "Tab"):
            page.js("document.getElementById('start').focus()")
        for key, what in presses:
            before = page.js(f"return {what}")
            page.press(key)
            page.wait(f"JSON.stringify({what}) !== {json.dumps(json.dumps(before))}")
            page.settle()


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


def test_nothing_is_cut_off_and_every_control_has_a_name(page):
    """Of the example of which the most is proved: its certificate has the longest words."""
    page.js(DROP, "anywhere.yaml", (EXAMPLES / "anywhere.yaml").read_text(encoding="utf-8"))
    page.wait("document.getElementById('proved').textContent.includes('from every start')")
    page.settle()
    for size in (DESK, (1000, 700), TABLET, PHONE):
        page.resize(size)
        wide, high = page.js(
            "const page = document.documentElement; return [page.scrollWidth, page.scrollHeight];"
        )
        assert (wide, high) == size
        assert page.js(CUT) == []
        table = page.browser.find_element("id", "table").rect
        assert table["width"] * table["height"] > 0.35 * size[0] * size[1]
        boxes = page.js(
            "const all = 'header button:not([hidden]), header select, footer button, footer select';"
            "return [...document.querySelectorAll(all)].map((n) => {"
            " const b = n.getBoundingClientRect(); return [n.id, b.left, b.top, b.right, b.bottom]; });"
        )
        across = page.js("const t = document.querySelector('.tools'); return t.scrollWidth - t.clientWidth;")
        for name, left, top, right, bottom in boxes:
            assert left >= 0, name
            assert right <= size[0] + across, name  # on a telephone the tools are a strip that is drawn along
            assert bottom - top >= 24, name
        assert across == 0 or size == PHONE
        for one, other in itertools.combinations(boxes, 2):
            assert one[3] <= other[1] or other[3] <= one[1] or one[4] <= other[2] or other[4] <= one[2]
    tree = page.browser.execute_cdp_cmd("Accessibility.getFullAXTree", {})["nodes"]
    roles = {"button", "slider", "spinbutton", "combobox", "checkbox"}
    controls = [n for n in tree if not n["ignored"] and n["role"]["value"] in roles]
    assert len(controls) > 25
    assert [n["role"]["value"] for n in controls if not n["name"]["value"].strip()] == []


def test_a_lost_connection_is_said_and_taken_up_again(page):
    page.js("flatpush.connection.wait = 1000; flatpush.connection.socket.close()")
    page.wait("!document.getElementById('banner').hidden")
    assert "connection is lost" in page.text("banner")
    page.js("document.getElementById('start').focus()")
    page.press("r")
    page.wait("document.getElementById('banner').hidden")
    page.settle()
    assert page.scene["start"][2] == -45
    assert page.plan["motion"]["object"][0][2] == pytest.approx(page.js("return -Math.PI / 4"), abs=1e-4)


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


def test_numbers_that_are_none_are_refused_in_words_and_a_planner_that_dies_is_replaced(page):
    for name in ("camera-delay", "runs-position"):
        page.js("document.getElementById(arguments[0]).value = ''", name)
    page.press("c")
    page.wait("!flatpush.feedback.on")
    assert page.text("followed") == "delay: a finite number is needed, got [None]"
    page.press("m")
    page.wait("document.getElementById('runsdone').textContent.startsWith('position: a finite')")
    page.js("document.getElementById('camera-delay').value = 0.1")
    page.press("c")
    page.wait("flatpush.feedback.live.times.length > 2")
    command = ["ps", "-o", "pid=", "--ppid", str(page.server.process.pid)]
    (worker,) = subprocess.run(
        command, capture_output=True, text=True, check=True, timeout=PATIENCE
    ).stdout.split()
    os.kill(int(worker), signal.SIGKILL)
    page.wait("!flatpush.feedback.on")
    assert page.text("followed") == "The planner ended, and with it this run."
    page.wait("!flatpush.busy && flatpush.answered > 1")
    assert page.plan["status"] == "solved"
    page.open()  # in the middle of a drag
    x, y = page.middle("#start .body")
    page.drag((x, y), (x + 60, y), drop=False)
    page.open()
    page.mouse("mouseReleased", x, y)
    assert page.plan["status"] == "solved"


# ---- a stored plan and a recorded run ----

BLOCK = """
flatpush: scene/1
units: {length: mm, angle: deg}
object: {name: block, outline: [[-25, -20], [25, -20], [25, 20], [-25, 20]], friction: 0.4}
pusher: {fingers: 1, tip_radius: 3}
start: [-30, 3, 0]
goal: [0, 0, 0]
planning: {iterations: 1}
"""


@pytest.fixture(scope="module")
def stored(tmp_path_factory):
    """A plan, and a server that shows a run of it."""
    import flatpush as fp
    from flatpush.documents import mapping_of, parse_scene

    folder = tmp_path_factory.mktemp("stored")
    plan = fp.plan(parse_scene(mapping_of(BLOCK)))
    plan.save(folder / "block.json")
    rows = [COLUMNS]
    rows += [f"block,,,{k / 10},{-30 + k},3,0,{-58 + k},3,0,1" for k in range(31)]
    (folder / "run.csv").write_text("\n".join([*rows, "# ended: done", ""]), encoding="utf-8")
    with Served(str(folder / "run.csv"), "--scene", str(folder / "block.json"), "--port", "0") as found:
        yield plan, found


@pytest.fixture
def recording(browser, stored):
    found = Page(browser, stored[1])
    yield found
    assert browser.get_log("browser") == []


def test_a_stored_plan_and_a_recorded_run_are_shown_until_something_is_changed(recording, stored):
    page, (plan, _) = recording, stored
    assert page.text("subtitle").endswith("stored and verified")
    assert page.text("spent") == "stored"
    assert page.text("cost") == f"{1e3 * plan.cost:.1f} mm"
    assert page.text("recordingended") == "It ended: done."
    page.js("flatpush.player.show(1.5)")
    assert page.js("return flatpush.player.state(1.5).object") == pytest.approx([-15, 3, 0])
    x, y = page.js(
        "const b = document.getElementById('run').getBBox(); return [b.x + b.width, b.y + b.height / 2];"
    )
    assert (x, y) == pytest.approx((0, 3), abs=1e-3)  # the way of its middle
    page.press("\ue00c")  # Escape: the plan again
    assert page.js("return flatpush.player.duration") == pytest.approx(plan.duration, abs=1e-3)
    page.js("document.getElementById('start').focus()")
    page.press("r")
    page.settle()
    assert "stored" not in page.text("subtitle")
    page.click("undo")
    page.settle()
    assert page.text("subtitle").endswith("stored and verified")


def test_a_log_that_is_dropped_is_played_with_the_scene_that_is_shown(recording, stored):
    page, rows = recording, [COLUMNS]
    rows += [f"block,,,{k / 10},{-20 + 2 * k},-5,0.2,{-48 + 2 * k},-5,0,1" for k in range(11)]
    page.js(DROP, "other.csv", "\n".join([*rows, "# ended: stopped", ""]))
    page.wait("document.getElementById('recordingended').textContent === 'It ended: stopped.'")
    assert page.js("return flatpush.player.state(0.5).object") == pytest.approx([-10, -5, 0.2])
    assert page.js("return flatpush.player.duration") == pytest.approx(1.0)
    page.js(DROP, "empty.csv", rows[0] + "\n")
    page.wait("document.getElementById('banner').textContent.includes('empty.csv')")
    assert page.js("return flatpush.player.duration") == pytest.approx(1.0)  # what was there stays
    page.press("\ue00c")  # Escape: the plan again
    assert page.js("return flatpush.player.duration") == pytest.approx(stored[0].duration, abs=1e-3)


def test_the_object_is_shoved_in_mid_push_and_the_horizon_controller_lands_again(recording):
    page = recording
    page.js(
        "document.getElementById('controller').value = 'horizon'; document.getElementById('speed').value = 8;"
    )
    page.press("c")
    page.wait("flatpush.feedback.live.segments.some((part) => part.text === 'push, sticks')")
    page.js("flatpush.feedback.pause()")
    page.wait("!flatpush.feedback.waiting")
    landings = page.js("return flatpush.feedback.moves")
    before, unit = page.js("return flatpush.feedback.pose"), page.js("return flatpush.table.view.unit")
    x, y = page.middle("#object .body")
    page.mouse("mousePressed", x, y)
    page.mouse("mouseMoved", x - 8 / unit, y - 40 / unit)
    page.js("flatpush.feedback.pause()")
    page.wait(f"flatpush.feedback.pose[1] > {before[1] + 39}")
    page.mouse("mouseReleased", x - 8 / unit, y - 40 / unit)
    page.wait("!flatpush.feedback.on", 4 * PATIENCE)
    assert page.text("followed").startswith("Arrived after ")
    assert page.js("return flatpush.feedback.moves") > landings
    x, y, _ = page.js("return flatpush.feedback.pose")
    assert np.hypot(x, y) < 2.5
    assert page.js("return flatpush.player.now") == page.js(
        "return flatpush.player.duration"
    )  # nothing jumps
    page.js(
        "const s = document.getElementById('save'); s.value = 'run'; s.dispatchEvent(new Event('change'));"
    )
    file = page.browser.downloads / "run.csv"
    page.wait_for(file)
    from flatpush.documents.robot_log import load_robot_log

    (run,) = load_robot_log(file).runs
    assert run.object == "block"
    assert 1e3 * run.poses[-1, :2] == pytest.approx([x, y], abs=1.0)
    page.browser.find_element("id", "follow").click()
    page.wait("flatpush.feedback.live.times.length > 2")
    page.press("a")  # another scene: the run ends in words
    assert page.text("followed") == "The scene was changed, and the run ended."
    page.settle()

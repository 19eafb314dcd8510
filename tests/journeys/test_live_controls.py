"""The controls of the live page: keys, sliders, names, and what happens when something fails."""

import itertools
import json
import os
import signal
import subprocess

import pytest
from tests.extras import extra
from tests.live_browser import CUT, DESK, DROP, PHONE, TABLET
from tests.live_pages import EXAMPLES
from tests.live_server import PATIENCE

pytestmark = pytest.mark.slow
pytest.importorskip("uvicorn", reason=extra("page"))
pytest.importorskip("starlette", reason=extra("page"))


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


def test_nothing_is_cut_off_and_every_control_has_a_name(page):
    """Of the example of which the most is proved: its certificate has the longest words."""
    page.js(DROP, "anywhere.yaml", (EXAMPLES / "anywhere.yaml").read_text(encoding="utf-8"))
    page.wait("document.getElementById('proved').textContent.includes('from every start')")
    page.settle()
    page.js("flatpush.model.change((scene) => { scene.start = [-203.98, -131.25, -155.3]; })")
    page.settle()
    poses = (
        "return [...document.querySelectorAll('#poses input[type=number]')]"
        ".filter((n) => n.scrollWidth > n.clientWidth).map((n) => n.value)"
    )
    for size in (DESK, (1000, 700), TABLET, PHONE):
        page.resize(size)
        wide, high = page.js(
            "const page = document.documentElement; return [page.scrollWidth, page.scrollHeight];"
        )
        assert (wide, high) == size
        assert page.js(CUT) == []
        assert page.js(poses) == []
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

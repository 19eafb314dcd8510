"""The page of a plan in a real browser: headless Chromium, driven by selenium."""

import itertools
import json
from pathlib import Path

import numpy as np
import pytest
from tests.extras import extra

import flatpush as fp
from flatpush.view import save_figure

pytestmark = pytest.mark.slow
pytest.importorskip("selenium.webdriver", reason=extra("test"))
DESK, PHONE = (1280, 720), (390, 844)
TRIANGLE = 1e-3 * np.array([[19.667, -9.5], [19.667, 19.0], [-39.333, -9.5]])


@pytest.fixture(scope="module")
def plan():
    thing = fp.Object(TRIANGLE, friction=0.3, name="triangle")
    push = fp.Push("long edge", thing.outline.nearest((0.0, -0.0095)), 2, 0.018)
    planning = fp.Planning(model="ellipsoid", two_finger="middle")
    scene = fp.Scene(
        thing, (-0.12, 0.06, -1.0), pusher=fp.Pusher(2, 0.018), pushes=(push,), planning=planning
    )
    found = fp.plan(scene)
    assert found.status == "solved"
    return found


@pytest.fixture
def page(browser, plan, tmp_path):
    """Opens the page of the plan at a size of the window, paused at the start."""
    save_figure(plan, tmp_path / "plan.html")
    address = (tmp_path / "plan.html").as_uri()

    def opened(size=DESK, touch=False, at="#t=0"):
        metrics = {"width": size[0], "height": size[1], "deviceScaleFactor": 1, "mobile": touch}
        browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
        browser.execute_cdp_cmd("Emulation.setTouchEmulationEnabled", {"enabled": touch})
        browser.get("about:blank")
        for log in ("browser", "performance"):
            browser.get_log(log)
        browser.get(address + at)
        return browser

    return opened


def time_shown(browser):
    return float(browser.find_element("id", "time").text.split(" s")[0])


def press(browser, key):
    browser.switch_to.active_element.send_keys(key)


def wait(browser, condition, seconds=10):
    from selenium.webdriver.support.ui import WebDriverWait

    WebDriverWait(browser, seconds).until(lambda _: condition())


def test_it_plays_by_itself_fetches_nothing_and_says_no_error(page):
    browser = page(at="")
    wait(browser, lambda: time_shown(browser) > 0.3)
    assert browser.find_element("id", "play").text == "Pause"
    messages = [json.loads(entry["message"])["message"] for entry in browser.get_log("performance")]
    asked = [m["params"]["request"]["url"] for m in messages if m["method"] == "Network.requestWillBeSent"]
    assert [url.split(":")[0] for url in asked] == ["file"]
    assert browser.get_log("browser") == []


def test_every_key_does_what_the_page_says(page, plan):
    from selenium.webdriver.common.keys import Keys

    browser = page()
    assert time_shown(browser) == 0
    press(browser, Keys.END)
    assert time_shown(browser) == pytest.approx(plan.duration, abs=0.01)
    assert browser.find_element("id", "pose").text == "object x 0.0 mm, y 0.0 mm, θ 0.0°"
    press(browser, Keys.ARROW_LEFT)
    assert time_shown(browser) == pytest.approx(0.99 * plan.duration, abs=0.02)
    press(browser, Keys.HOME)
    assert time_shown(browser) == 0
    starts = np.cumsum([0.0, *(s.times[-1] for s in plan.segments)])
    seen = []
    for _ in starts[1:]:
        press(browser, ".")
        seen.append(time_shown(browser))
    np.testing.assert_allclose(seen, np.unique(starts)[1:][: len(seen)], atol=0.011)
    press(browser, ",")
    assert time_shown(browser) == pytest.approx(starts[-2], abs=0.011)
    press(browser, Keys.HOME)
    press(browser, "+")
    assert browser.execute_script("return document.getElementById('speed').value") == "2"
    press(browser, "-")
    press(browser, " ")
    wait(browser, lambda: time_shown(browser) > 0.2)
    press(browser, " ")
    stopped = time_shown(browser)
    assert browser.find_element("id", "play").text == "Play"
    assert time_shown(browser) == stopped


def test_the_object_on_the_screen_is_where_the_plan_has_it(page, plan):
    """Asked of the browser: the corners of the drawn object, in millimetres of the drawing."""
    moment = 0.5 * plan.duration
    browser = page(at=f"#t={moment}")
    corners = browser.execute_script(
        "const shape = document.querySelector('#object .shape'), from = document.getElementById('table');"
        "const there = from.getScreenCTM().inverse().multiply(shape.getScreenCTM());"
        "return shape.getAttribute('d').match(/-?[\\d.]+ -?[\\d.]+/g).map((pair) => {"
        "  const [x, y] = pair.split(' ').map(Number), p = new DOMPoint(x, y).matrixTransform(there);"
        "  return [p.x, -p.y]; });"
    )
    before = 0.0
    for segment in plan.segments:
        if segment.kind == "push" and before <= moment <= before + segment.times[-1]:
            pose = [np.interp(moment - before, segment.times, column) for column in segment.object.T]
        before += segment.times[-1]
    turn = np.array([[np.cos(pose[2]), -np.sin(pose[2])], [np.sin(pose[2]), np.cos(pose[2])]])
    np.testing.assert_allclose(corners, 1e3 * (TRIANGLE @ turn.T + pose[:2]), atol=0.02)


@pytest.mark.parametrize("size", [DESK, PHONE])
def test_it_fits_the_screen_and_letters_can_be_read(page, size):
    browser = page(size)
    wide, high = browser.execute_script(
        "const page = document.documentElement; return [page.scrollWidth, page.scrollHeight];"
    )
    assert wide <= size[0]
    assert high <= size[1]
    texts = browser.execute_script(
        "return [...document.querySelectorAll('svg text')].map((t) => { const b = t.getBoundingClientRect();"
        " return [t.textContent, b.left, b.top, b.right, b.bottom]; });"
    )
    assert {"start", "goal"} <= {text[0] for text in texts}
    for text, left, top, right, bottom in texts:
        assert bottom - top >= 11, text
        assert left >= 0, text
        assert right <= size[0], text
    for one, other in itertools.combinations((t for t in texts if t[0] not in ("start", "goal")), 2):
        apart = one[3] <= other[1] or other[3] <= one[1] or one[4] <= other[2] or other[4] <= one[2]
        assert apart, (one, other)
    table = browser.find_element("id", "table").rect
    assert table["height"] > 0.45 * size[1]


def test_fingers_on_a_touch_screen_play_pause_and_scrub(page, plan):
    browser = page(PHONE, touch=True)

    def touch(kind, x, y):
        points = [] if kind == "touchEnd" else [{"x": x, "y": y}]
        browser.execute_cdp_cmd("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    def middle(name):
        box = browser.find_element("id", name).rect
        return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2

    touch("touchStart", *middle("table"))
    touch("touchEnd", 0, 0)
    wait(browser, lambda: browser.find_element("id", "play").text == "Pause")
    touch("touchStart", *middle("play"))
    touch("touchEnd", 0, 0)
    wait(browser, lambda: browser.find_element("id", "play").text == "Play")
    box = browser.find_element("id", "scrub").rect
    assert box["height"] >= 40
    for kind, share in (("touchStart", 0.2), ("touchMove", 0.5), ("touchMove", 0.75), ("touchEnd", 0.75)):
        touch(kind, box["x"] + share * box["width"], box["y"] + box["height"] / 2)
    wait(browser, lambda: abs(time_shown(browser) / plan.duration - 0.75) < 0.05)


@pytest.mark.parametrize("size", [DESK, PHONE])
def test_pushes_have_numbers_that_do_not_hide_each_other(browser, tmp_path, size):
    plan = fp.plan(fp.load_scene(Path(__file__).parents[2] / "examples" / "triangle.yaml"))
    assert len(plan.pushes) > 1
    save_figure(plan, tmp_path / "plan.html")
    metrics = {"width": size[0], "height": size[1], "deviceScaleFactor": 1, "mobile": False}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
    browser.get((tmp_path / "plan.html").as_uri() + "#t=0")
    discs = browser.execute_script(
        "return [...document.querySelectorAll('.number')].map((n) => { const b = n.firstChild.getBoundingClientRect();"
        " const letters = n.querySelector('text').getBoundingClientRect().height;"
        " return [n.textContent, b.left, b.top, b.right, b.bottom, letters]; });"
    )
    assert [disc[0] for disc in discs] == [str(k + 1) for k in range(len(plan.pushes))]
    middles = [((left + right) / 2, (top + bottom) / 2) for _, left, top, right, bottom, _ in discs]
    for _, left, _, right, _, letters in discs:
        assert right - left >= 18
        assert letters >= 11
        assert left >= 0
        assert right <= size[0]
    for (x, y), (u, v) in itertools.combinations(middles, 2):
        assert np.hypot(x - u, y - v) >= 20

"""The live page with a stored plan or a recorded run."""

import numpy as np
import pytest
from tests.extras import extra
from tests.live_browser import COLUMNS, DROP, Page
from tests.live_server import PATIENCE, Served

pytestmark = pytest.mark.slow
pytest.importorskip("uvicorn", reason=extra("page"))
pytest.importorskip("starlette", reason=extra("page"))

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

"""The live page in headless Chromium, for its tests: what a user's hands and eyes do."""

from tests.live_server import PATIENCE
from tests.waiting import until

DESK, TABLET, PHONE = (1280, 720), (820, 1180), (390, 844)
CUT = """
return [...document.querySelectorAll('#panel, #panel > section')].filter((n) => n.scrollWidth > n.clientWidth)
  .map((n) => `${n.id} ${n.ariaLabel}: ${n.scrollWidth} of ${n.clientWidth}`);
"""
# The header of a recorded run.
COLUMNS = "object,start_id,run_id,t,obj_x_mm,obj_y_mm,obj_theta_rad,pusher_x_mm,pusher_y_mm,pusher_theta_rad,action_id"
# A file of a name and a text, as a browser hands it over.
DROP = (
    "const data = new DataTransfer(); data.items.add(new File([arguments[1]], arguments[0]));"
    "document.dispatchEvent(new DragEvent('drop', {dataTransfer: data, bubbles: true, cancelable: true}));"
)


class Page:
    """The page of a server in a browser, with its first plan."""

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

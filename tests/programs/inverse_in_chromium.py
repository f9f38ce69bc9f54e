#!/usr/bin/env python3
"""Opens the pages around a simulated Inverse3 in headless Chromium, 400 and 1400 pixels wide: the page of the hand
of `tpm hil serve`, which is dragged, the page of the served session beyond the end of its phases, and the page of a
client, `tpm hil run --device inverse3`, whose tool moves with the hand. Each fits and says SIMULATED DEVICE.

    inverse_in_chromium.py TPM [FOLDER]        # keeps screenshots in FOLDER
"""

import json
import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from page_in_chromium import CannotStart, Chromium, PageChanged

PATIENCE_S = 120.0
SOFT = {"E1": "10 Pa", "E2": "10 Pa", "Eprime": "10 Pa", "eta1": "20 Pa s"}
FELT = {"E1": "2 kPa", "E2": "2 kPa", "Eprime": "2 kPa", "eta1": "4e3 Pa s"}  # below 49 N/m: its delay is unknown


def session(title, material, hold):
    return {
        "title": title,
        "model": {"kind": "element", "scene": {"organ": {"kind": "star", "spacing": "30 mm"}, "material": material}},
        "rate": "500 Hz",
        "limits": {"force": "3 N", "watchdog": "16 ms", "cycle_timeout": "1 s", "late_cycles": 1000},
        "start": {"limit": "60 s"},
        "indentations": {"depths": ["4 mm"], "rates": ["10 mm/s"], "hold": hold, "rest": "0.1 s"},
    }


SERVED = session("a hand that is served", SOFT, "0.1 s")
SERVED["virtual_device"] = {"arm_set_point": "-4 mm"}
RUN = session("a client that is looked at", FELT, "30 s")

WORDS = """document.readyState !== "complete" ? "null" : JSON.stringify({
  texts: Object.fromEntries([...document.querySelectorAll("[id]")].filter(e => !e.children.length)
                            .map(e => [e.id, e.textContent])),
  said: document.body.innerText,
  boxes: Object.fromEntries([...document.querySelectorAll("h1, h2, button, canvas, .badge, #instruction, #clock, td")]
    .map((e, i) => [i + " " + e.tagName + " " + (e.id || e.textContent).slice(0, 30), e])
    .map(([k, e]) => { const words = document.createRange(); words.selectNodeContents(e);
                       return [k, e, (/^H/.test(e.tagName) ? words : e).getBoundingClientRect()]; }).filter(([k, e, r]) => r.width > 0)
    .map(([k, e, r]) => [k, [r.left, r.top, r.right, r.bottom, e.tagName === "CANVAS" || e.scrollWidth <= e.clientWidth + 1]])),
  pad: (e => e ? (r => [r.left, r.top, r.width, r.height])(e.getBoundingClientRect()) : null)(document.getElementById("pad")),
  wide: document.documentElement.clientWidth,
  overflow: document.documentElement.scrollWidth > document.documentElement.clientWidth})"""


class ProgramEnded(AssertionError):
    """A program ended before it said what was expected."""


class Program:
    """A tpm beside the test; it ends with it."""

    def __init__(self, *words):
        self.process = subprocess.Popen([str(w) for w in words], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                                        text=True)
        self.said = ""

    def told(self, pattern):
        while not (found := re.search(pattern, self.said)):
            line = self.process.stderr.readline()
            if not line:
                raise ProgramEnded(f"expected {pattern}, was told: {self.said}")
            self.said += line
        return found.groups()

    def close(self):
        self.process.terminate()
        self.process.wait()
        self.process.stderr.close()


def look(chromium):
    """What the page shows; None while it is loaded."""
    try:
        answer = chromium.call("Runtime.evaluate", expression=WORDS)
    except PageChanged:
        return None
    assert "exceptionDetails" not in answer, answer
    return json.loads(answer["result"]["value"])


def until(chromium, met, what):
    """The page as soon as it is as meant; a busy machine has two minutes for it."""
    seen, end = None, time.monotonic() + PATIENCE_S
    while time.monotonic() < end:
        seen = look(chromium)
        if seen and met(seen):
            return seen
        time.sleep(0.1)
    raise AssertionError((what, seen))


def overlapping(boxes):
    """Headings, buttons and badges that lie over each other."""
    names = [n for n in boxes if n.split()[1] in ("H1", "H2", "BUTTON", "SPAN")]
    pairs = [(a, b) for i, a in enumerate(names) for b in names[i + 1:]]
    return [(a, b) for a, b in pairs
            if min(boxes[a][2], boxes[b][2]) - max(boxes[a][0], boxes[b][0]) > 1
            and min(boxes[a][3], boxes[b][3]) - max(boxes[a][1], boxes[b][1]) > 1]


def fits(chromium, name, folder, met):
    for wide in (1400, 400):
        chromium.call("Emulation.setDeviceMetricsOverride", width=wide, height=900, deviceScaleFactor=1, mobile=False)
        # A page that draws on a canvas fits a moment after its window has changed.
        time.sleep(0.3)
        seen = until(chromium, lambda s: met(s) and not s["overflow"] and wide - 20 <= s["wide"] <= wide, (name, wide))  # a bar to scroll
        if folder:
            chromium.picture(Path(folder) / f"{name}_{wide}.png")
        outside = {k: b for k, b in seen["boxes"].items() if b[0] < 0 or b[2] > seen["wide"] + 0.5}
        assert not outside, (name, wide, outside)
        assert not overlapping(seen["boxes"]), (name, wide, overlapping(seen["boxes"]))
        assert "SIMULATED DEVICE" in seen["said"], (name, wide)


def drag(chromium, to_mm):
    """The mouse takes the hand along z, from where it is."""
    left, top, size, _ = look(chromium)["pad"]
    x, y = left + 0.5 * size, lambda mm: top + (0.5 - mm / 120.0) * size
    mouse = {"button": "left", "buttons": 1, "clickCount": 1}
    chromium.call("Input.dispatchMouseEvent", type="mousePressed", x=x, y=y(4.0), **mouse)
    for i in range(1, 9):
        chromium.call("Input.dispatchMouseEvent", type="mouseMoved", x=x, y=y(4.0 + (to_mm - 4.0) * i / 8), **mouse)
        time.sleep(0.05)
    chromium.call("Input.dispatchMouseEvent", type="mouseReleased", x=x, y=y(to_mm), **mouse)


def z_of(seen):
    return float(seen["texts"]["at"].split(",")[2])


def pressed(chromium, wanted):
    """The buttons of the grip as the server tells them, once they are as wanted."""
    asks = "fetch('/devices').then(a => a.json()).then(d => JSON.stringify(d.wireless_verse_grip[0].state.buttons))"
    end = time.monotonic() + PATIENCE_S
    while time.monotonic() < end:
        answer = chromium.call("Runtime.evaluate", expression=asks, awaitPromise=True)
        seen = json.loads(answer["result"]["value"])
        if seen == wanted:
            return
        time.sleep(0.1)
    raise AssertionError((seen, wanted))


def press(chromium):
    """The mouse holds button b of the grip down, and lets it go."""
    box, = [b for k, b in look(chromium)["boxes"].items() if k.endswith(" BUTTON b")]
    mouse = {"x": (box[0] + box[2]) / 2, "y": (box[1] + box[3]) / 2, "button": "left", "clickCount": 1}
    up = {"a": False, "b": False, "c": False}
    chromium.call("Input.dispatchMouseEvent", type="mousePressed", buttons=1, **mouse)
    pressed(chromium, {**up, "b": True})
    chromium.call("Input.dispatchMouseEvent", type="mouseReleased", buttons=0, **mouse)
    pressed(chromium, up)


def check_hand(chromium, address, folder):
    def at_rest(s):  # connected a moment before the first state is shown
        texts = s["texts"]
        return texts["link"] == "connected" and texts["at"].count(",") == 2 and abs(z_of(s) - 4.0) < 0.5

    chromium.open(address)
    until(chromium, at_rest, "the hand at rest")
    press(chromium)
    drag(chromium, -6.0)
    fits(chromium, "hand", folder, lambda s: z_of(s) < -4.0)
    assert not chromium.complaints(), chromium.complaints()


def check_served(chromium, address, folder):
    chromium.open(address)
    beyond = re.compile(r"^0:(\d\d\.\d) of 0:\1, held for 0:\d\d\.\d$")
    seen = until(chromium, lambda s: beyond.match(s["texts"]["clock"]), "beyond the phases")
    assert seen["texts"]["phase"] == "The phases are over", seen["texts"]
    assert "client" in seen["texts"]["instruction"] and not seen["texts"]["next"], seen["texts"]
    fits(chromium, "served", folder, lambda s: beyond.match(s["texts"]["clock"]))
    assert not chromium.complaints(), chromium.complaints()


# With what a session ends, or is refused by the check before it, on a machine that stalls; and how the page begins to say so.
STALLED = re.compile(r"watchdog|overrun storm|cycle timeout|unplugged|communication error|connection lost|oscillation|energy given to the hand|"
                     r"too fast for the device|position jumped|damped for too long|stall|missed|late")
OVER = ("stopped", "connection lost")


def check_client(hand, client, tpm, served, name, folder):
    """Whether a session of a client could be looked at to its end: a machine that stalls ends it, or refuses it."""
    client.events.clear()  # the page of the session before lost its program
    run = Program(tpm, "hil", "run", name / "run.json", "--device", "inverse3", "--inverse-port", served[0],
                  "--inverse-events-port", served[1], "--page", "0", "--page-wait", "120 s", "-o", name / "r.tpmrec", "--overwrite")

    def ended(seen):
        """Whether the session is over, which nothing but a stall is a reason for here."""
        status = seen["texts"]["status"]
        assert not status.startswith("stopped") or STALLED.search(status), status
        return status.startswith(OVER)

    try:
        try:
            client.open(run.told(r"page: (http://\S+)")[0])
        except ProgramEnded as e:
            if not STALLED.search(str(e)):
                raise
            return False
        # The hand rises into the air, and goes down when the session has begun.
        drag(hand, 4.0)
        until(client, lambda s: s["texts"].get("status", "").startswith(("running", *OVER)), "the session begins")
        drag(hand, -5.0)
        pushed = re.compile(r"^0\.\d*[1-9]\d* N$")
        seen = until(client, lambda s: ended(s) or pushed.match(s["texts"]["commanded"]), "the force of the tissue")
        if ended(seen):
            return False
        assert "SIMULATED" in seen["texts"]["identity"], seen["texts"]
        assert seen["texts"]["title"] == RUN["title"], seen["texts"]
        fits(client, "client", folder, lambda s: True)  # also the page of a session that a stall has just ended
        if ended(look(client)):
            return False
        assert not client.complaints(), client.complaints()
        return True
    finally:
        client.call("Page.navigate", url="about:blank")  # it asks no program that is gone
        run.close()


def main():
    program = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if not program:
        print("SKIPPED: there is no Chromium (Debian: chromium)")
        sys.exit(77)
    tpm, folder = sys.argv[1], sys.argv[2] if len(sys.argv) > 2 else None
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name:
        name = Path(name)
        (name / "served.json").write_text(json.dumps(SERVED))
        (name / "run.json").write_text(json.dumps(RUN))
        try:
            hand, page = Chromium(program, name / "hand"), Chromium(program, name / "page")
        except CannotStart as e:
            print(f"SKIPPED: Chromium does not run on this machine: {e}")
            sys.exit(77)
        serve = Program(tpm, "hil", "serve", name / "served.json", "--port", "0", "--events-port", "0", "--page", "0")
        try:
            served = serve.told(r"ws://localhost:(\d+), events at ws://localhost:(\d+)")
            check_hand(hand, serve.told(r"hand: (http://\S+)")[0], folder)
            check_served(page, serve.told(r"page: (http://\S+)")[0], folder)
            if not any(check_client(hand, page, tpm, served, name, folder) for _ in range(5)):
                print("SKIPPED: this machine stalled in each of five sessions of a client")
                sys.exit(77)
        finally:
            serve.close()
            hand.close()
            page.close()
    print("looked at the hand, the served session and a client")


if __name__ == "__main__":
    main()

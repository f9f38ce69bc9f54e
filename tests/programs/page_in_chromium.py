#!/usr/bin/env python3
"""Opens the page of sessions in headless Chromium and watches it: numbers change, phases follow each other,
the tissue and the curves move, a tool that slides does so with the arrow of its force beside it, and nothing
but this machine is asked.

    page_in_chromium.py TPM [SESSION.json [SCREENSHOT.png SECONDS]]
"""

import base64
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

SESSION = {
    "title": "a session that is looked at",
    "model": {"kind": "element", "scene": {
        "organ": {"kind": "star", "spacing": "30 mm"},
        "material": {"E1": "12 kPa", "E2": "12 kPa", "Eprime": "12 kPa", "eta1": "2.4e4 Pa s"}}},
    "rate": "500 Hz",
    "limits": {"watchdog": "16 ms", "cycle_timeout": "1 s", "late_cycles": 1000},
    "virtual_device": {"least_watchdog": "1 s"},
    "indentations": {"depths": ["4 mm"], "rates": ["2 mm/s"], "hold": "2 s", "rest": "1 s"},
    "creep": {"loads": ["0.2 N"], "hold": "2 s", "rest": "1 s"},
}

SLIDE = {
    "title": "a slide that is looked at",
    "model": {"kind": "surface", "scene": {
        "organ": {"kind": "liver", "count": 60},
        "material": {"E1": "12 kPa", "E2": "12 kPa", "Eprime": "12 kPa", "eta1": "2.4e4 Pa s"},
        "anchors": [{"kind": "far_side", "fraction": 0.3}]}},
    "rate": "500 Hz",
    "limits": SESSION["limits"],
    "virtual_device": SESSION["virtual_device"],
    "slides": {"depths": ["4 mm"], "direction": [1, 0, 0], "distance": "25 mm", "rate": "10 mm/s", "rest": "1 s"},
}

LOOK = """document.readyState !== "complete" || !document.getElementById("served") ? "null" : JSON.stringify({
  texts: Object.fromEntries(["title", "device", "status", "phase", "instruction", "tool_depth", "commanded", "clock",
                             "target_depth", "target_force", "served"]
                            .map(id => [id, document.getElementById(id).textContent])),
  tool: document.getElementById("scene").dataset.tool, force: document.getElementById("scene").dataset.force,
  received: Number(document.body.dataset.received || 0),
  ink: ["scene", "depth_plot", "force_plot"].map(id => {
    const c = document.getElementById(id), d = c.getContext("2d").getImageData(0, 0, c.width, c.height).data;
    let sum = 0;
    for (let i = 0; i < d.length; i += 4) sum = (31 * sum + d[i] + 3 * d[i + 1] + 7 * d[i + 2] + 11 * d[i + 3]) % 1000000007;
    return sum; }),
  overflow: document.documentElement.scrollWidth > document.documentElement.clientWidth})"""


# Phases of the sessions take a second and more; a look every 0.2 s sees each of them.
MOST_BETWEEN_LOOKS_S = 0.9


class ChromiumEnded(RuntimeError):
    pass


class CannotStart(RuntimeError):
    """Chromium ended before it answered anything, so that nothing was learnt of the page."""


# What Chromium answers to a question that it was asked while one page went and the next came.
CHANGED = ("Inspected target navigated or closed", "Execution context was destroyed.", "Cannot find context with specified id")


class PageChanged(RuntimeError):
    """The page of the question is no longer shown."""


class Chromium:
    """Spoken to over a pair of pipes, messages that end with a zero."""

    def __init__(self, program, folder):
        to_it, self.to = os.pipe()
        self.back, from_it = os.pipe()
        os.set_inheritable(to_it, True)
        os.set_inheritable(from_it, True)
        command = [program, "--headless", "--no-sandbox", "--disable-gpu", "--remote-debugging-pipe",
                   "--disable-dev-shm-usage", "--disable-quic", "--disable-sync", f"--user-data-dir={folder}", "--window-size=1100,900", "--no-first-run",
                   "--disable-background-networking", "--disable-component-update", "about:blank"]
        # Chromium reads from descriptor 3 and writes to 4. Bash, as Debian's sh takes no number above 9.
        self.said = tempfile.TemporaryFile()
        self.process = subprocess.Popen(
            ["bash", "-c", f'exec "$@" 3<&{to_it} 4>&{from_it}', "bash", *command], pass_fds=(to_it, from_it),
            stdout=self.said, stderr=self.said)
        os.close(to_it)
        os.close(from_it)
        self.count, self.session, self.events, self.rest = 0, None, [], b""
        try:
            self.call("Browser.getVersion")
        except (BrokenPipeError, ChromiumEnded) as e:
            code = self.process.wait()
            self.said.seek(0)
            said = self.said.read().decode(errors="replace").strip().splitlines()
            raise CannotStart(f"{program} ended with {code} before it answered: {' | '.join(said[-5:])}") from e

    def message(self):
        while b"\0" not in self.rest:
            got = os.read(self.back, 1 << 20)
            if not got:
                raise ChromiumEnded("Chromium has ended")
            self.rest += got
        text, self.rest = self.rest.split(b"\0", 1)
        return json.loads(text)

    def call(self, method, **parameters):
        self.count += 1
        request = {"id": self.count, "method": method, "params": parameters}
        if self.session:
            request["sessionId"] = self.session
        os.write(self.to, json.dumps(request).encode() + b"\0")
        while True:
            message = self.message()
            if message.get("id") == self.count:
                if "error" in message:
                    kind = PageChanged if message["error"].get("message") in CHANGED else RuntimeError
                    raise kind(f"{method}: {message['error']}")
                return message["result"]
            self.events.append(message)

    def open(self, address):
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self.session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        self.call("Emulation.setDeviceMetricsOverride", width=1100, height=800, deviceScaleFactor=1, mobile=False)
        for domain in ("Runtime", "Network", "Page", "Log"):
            self.call(f"{domain}.enable")
        self.call("Page.navigate", url=address)

    def awaited(self, expression, seconds, missing):
        """The value of an expression once it is true; another page may be loaded meanwhile."""
        start = time.monotonic()
        while True:
            try:
                answer = self.call("Runtime.evaluate", expression=expression, returnByValue=True)
                assert "exceptionDetails" not in answer, answer
                if answer["result"].get("value"):
                    return answer["result"]["value"]
            except PageChanged:
                pass  # the question went to the page before
            assert time.monotonic() - start < seconds, f"{missing}: {self.complaints()}"
            time.sleep(0.05)

    def look(self):
        """What the page shows; None while it is loaded."""
        try:
            answer = self.call("Runtime.evaluate", expression=LOOK)
        except PageChanged:
            return None
        assert "exceptionDetails" not in answer, answer
        return json.loads(answer["result"]["value"])

    def picture(self, file):
        Path(file).write_bytes(base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"]))

    def complaints(self):
        found = [e["params"] for e in self.events if e.get("method") in ("Runtime.exceptionThrown", "Log.entryAdded")]
        return [c for c in found if "entry" not in c or c["entry"]["level"] == "error"]

    def asked(self):
        return {e["params"]["request"]["url"] for e in self.events if e.get("method") == "Network.requestWillBeSent"}

    def close(self):
        self.process.terminate()
        self.process.wait()
        for end in (self.to, self.back):
            os.close(end)
        self.said.close()


def begun(tpm, session, folder):
    process = subprocess.Popen(
        [tpm, "hil", "run", session, "--clock", "real", "--page", "0", "--page-wait", "120 s", "--page-keep", "120 s",
         "-o", folder / "r.tpmrec"], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    line = process.stderr.readline()
    assert line.startswith("page: http://127.0.0.1:"), line
    return process, line.split()[1]


def watched(chromium, address, seconds, shot):
    """What the page shows, again and again until the session is over, and the longest time between two looks in s."""
    chromium.open(address)
    seen, start, pictured = [], time.monotonic(), shot is None
    longest, last = 0.0, None
    while time.monotonic() - start < seconds:
        look = chromium.look()
        if look is None:  # not loaded yet
            time.sleep(0.02)
            continue
        longest, last = max(longest, time.monotonic() - (last or time.monotonic())), time.monotonic()
        seen.append(look)
        state = look["texts"]["status"]
        if not pictured and time.monotonic() - start > shot[1]:
            chromium.picture(shot[0])
            return seen, longest
        if state == "finished" or state.startswith("stopped"):
            time.sleep(0.6)
            seen.append(chromium.look() or seen[-1])
            if not pictured:
                chromium.picture(shot[0])
            break
        time.sleep(0.2)
    assert seen, f"the page does not load: {chromium.complaints()}"
    return seen, longest


def check_tool(running, slides):
    """Where the tool and the arrow of its force were drawn."""
    tools = [tuple(map(int, s["tool"].split(","))) for s in running if s["tool"]]
    arrows = [(tool, tuple(map(int, s["force"].split(","))))
              for tool, s in zip(tools, (s for s in running if s["tool"])) if s["force"]]
    assert len(arrows) >= 4, arrows
    for tool, (x, y, end_x, end_y) in arrows:
        assert 0 < x - tool[0] < 120 and y == tool[1], (tool, x, y)
        assert end_y < y, "the force pushes the hand out"
    aside = max(x for x, _ in tools) - min(x for x, _ in tools)
    if slides:
        assert aside >= 20 and len({x for x, _ in tools}) >= 5, tools
        assert any(abs(end_x - x) >= 3 for _, (x, _, end_x, _) in arrows), arrows
    else:
        assert aside <= 3 and max(y for _, y in tools) > min(y for _, y in tools), tools


def check(seen, address, chromium, session):
    running = [s for s in seen if s["texts"]["status"] == "running"]
    assert len(running) >= 5, [s["texts"] for s in seen]

    def different(name):
        return len({s["texts"][name] for s in running})

    for name in ("clock", "tool_depth", "commanded", "target_depth"):
        assert different(name) >= 4, (name, [s["texts"][name] for s in running])
    assert different("phase") >= 3 and different("instruction") >= 3, [s["texts"]["phase"] for s in running]
    for k, canvas in enumerate(("scene", "depth_plot", "force_plot")):
        assert len({s["ink"][k] for s in running}) >= 4, canvas
    check_tool(running, "slides" in session)
    last = seen[-1]
    assert last["received"] > len(running), last
    assert last["texts"]["device"] == "SIMULATED DEVICE", last
    assert last["texts"]["title"] == session["title"], last
    assert last["texts"]["status"] == "finished", last
    assert "Let go of the device" in last["texts"]["instruction"], last
    assert not last["overflow"]
    assert not chromium.complaints(), chromium.complaints()
    strangers = [url for url in chromium.asked() if not url.startswith((address, "data:"))]
    assert not strangers, strangers


# The longest words that a session's file, a device and an end can have, with and without places to break; then what does
# not fit, is cut or lies over another part.
LONG_WORDS = """(() => {
  const sentence = "no message of the device for 1.003 s at cycle 12345; expected one within the cycle timeout of 1 s, set as limits.cycle_timeout; ".repeat(2);
  const name = "liver_of_specimen_17_under_the_instrument_".repeat(5), root = document.documentElement, wide = root.clientWidth;
  const kept = [scene, state], phase = {...scene.phases[0], name, instruction: sentence};
  const found = [];
  const look = how => {
    const parts = [...document.querySelectorAll("#title, #device, #identity, #status, #shown, #note, #guide > *, .row > *, #flags > *, h2")];
    const guide = document.getElementById("guide"), frame = guide.getBoundingClientRect();
    const boxes = parts.map(e => {
      const words = document.createRange(); words.selectNodeContents(e);
      const {left, right, top, bottom} = words.getBoundingClientRect(), scrolls = guide.contains(e);  // what scrolls is seen in its frame
      return [e.id || e.textContent.slice(0, 20), e, {left, right, top: scrolls ? Math.max(top, frame.top) : top, bottom: scrolls ? Math.min(bottom, frame.bottom) : bottom}];
    }).filter(([, e, box]) => box.right > box.left && box.bottom > box.top);
    for (const [id, e, box] of boxes) {
      if (box.left < -0.5 || box.right > wide + 0.5) found.push(how + ": outside: " + id);
      if (getComputedStyle(e).overflowX !== "visible" && e.scrollWidth > e.clientWidth + 1) found.push(how + ": cut: " + id);
    }
    const alone = boxes.filter(([, e]) => !e.matches(".row, #flags"));
    alone.forEach(([id, e, a], i) => { for (const [other, , b] of alone.slice(i + 1))
      if (Math.min(a.right, b.right) - Math.max(a.left, b.left) > 1 && Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top) > 1) found.push(how + ": " + id + " lies over " + other); });
    if (guide.scrollHeight > guide.clientHeight + 1 && getComputedStyle(guide).overflowY !== "auto") found.push(how + ": the guide is cut");
    if (root.scrollWidth > wide) found.push(how + ": the page is " + root.scrollWidth + " px wide");
  };
  for (const text of [name, sentence]) {
    scene = {...kept[0], title: text, phases: kept[0].phases.map(() => ({...phase, name: text})), device: {...kept[0].device, name: text, serial: text},
             tissue: {...kept[0].tissue, shown: text}};
    showScene();
    showState({...kept[1], over: false, cause: "none", begun: true, phase: 0, time_s: 0, flags: Object.fromEntries(Object.keys(kept[1].flags).map(k => [k, true]))});
    look("running");
    showState({...kept[1], over: false, cause: "none", begun: false, place: text});
    look("waiting");
    showState({...kept[1], over: true, cause: "connection lost", detail: text});
    look("ended");
  }
  [scene, state] = kept;
  showScene(); showState(state);
  return found.join(", "); })()"""


def check_long_words(chromium):
    for wide in (1400, 1100, 400):
        chromium.call("Emulation.setDeviceMetricsOverride", width=wide, height=900, deviceScaleFactor=1, mobile=False)
        time.sleep(0.3)
        answer = chromium.call("Runtime.evaluate", expression=LONG_WORDS)
        assert "exceptionDetails" not in answer, answer
        assert answer["result"]["value"] == "", (wide, answer["result"]["value"])


def attempt(tpm, program, told, given, shot):
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name:
        folder = Path(name)
        (folder / "session.json").write_text(json.dumps(told))
        session, address = begun(tpm, given or folder / "session.json", folder)
        chromium = Chromium(program, folder / "profile")
        try:
            seen, longest = watched(chromium, address, 120.0, shot)
            # A machine that stalls for longer than the loop allows ends the session, and the page says so; one that lets
            # Chromium wait shows too few of its states.
            stalled = seen[-1]["texts"]["status"].startswith(("stopped: watchdog", "stopped: overrun", "stopped: cycle timeout"))
            stalled = stalled or longest > MOST_BETWEEN_LOOKS_S
            if shot is None and not stalled:
                check(seen, address, chromium, told)
            if shot is None and seen[-1]["received"]:
                check_long_words(chromium)
            print(f"{told['title']}: {seen[-1]['texts']['status']}, at most {longest:.2f} s between two looks", flush=True)
            return stalled, len(seen)
        finally:
            chromium.close()
            session.terminate()
            session.wait()


def main():
    program = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if not program:
        print("SKIPPED: there is no Chromium (Debian: chromium)")
        sys.exit(77)
    given = sys.argv[2] if len(sys.argv) > 2 else None
    shot = (sys.argv[3], float(sys.argv[4])) if len(sys.argv) > 4 else None
    try:  # alone, before any session: what breaks later is a failure
        with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name:
            Chromium(program, name).close()
    except CannotStart as e:
        print(f"SKIPPED: Chromium does not run on this machine: {e}")
        sys.exit(77)
    for told in [SESSION] if given else [SESSION, SLIDE]:
        for _ in range(8):
            stalled, looks = attempt(sys.argv[1], program, told, given, shot)
            if not stalled:
                print(f"looked {looks} times at {given or told['title']}")
                break
        else:
            print("SKIPPED: this machine stalled in each of eight sessions")
            sys.exit(77)


if __name__ == "__main__":
    main()

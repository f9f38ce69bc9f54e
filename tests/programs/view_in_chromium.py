#!/usr/bin/env python3
"""Opens pages of `tpm view` in headless Chromium: the organ is turned with mouse and keys, time is scrubbed,
values are read and compared with the file, a recording of a million samples stays usable, nothing is asked of
a network, and no page is wider than its window.

    view_in_chromium.py TPM [PICTURE.png]
"""

import json
import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import h5py
from page_in_chromium import CannotStart, Chromium

MATERIAL = {"E1": "12 kPa", "E2": "12 kPa", "Eprime": "12 kPa", "eta1": "2.4e5 Pa s", "A0": "12.56 mm^2", "l0": "1 mm"}
ORGAN = {"kind": "liver", "count": 424, "layers": 2, "spacing": "20 mm", "seed": 1}
HELD = [{"kind": "far_side", "fraction": 0.3}]
SCENE = {"title": "a <b>liver</b> </script> that is looked at", "organ": ORGAN, "material": MATERIAL, "anchors": HELD,
         "protocol": {"kind": "ramp_hold", "depth": "8 mm", "rate": "4 mm/s", "hold": "10 s"}}
SESSION = {"title": "a million cycles", "model": {"kind": "condensed",
                                                  "scene": {"organ": ORGAN, "material": MATERIAL, "anchors": HELD}},
           "rate": "4 kHz", "indentations": {"depths": ["2 mm", "8 mm"], "rates": ["4 mm/s"], "hold": "50 s", "rest": "75 s"}}


class Page:
    def __init__(self, chromium, file):
        self.chromium, self.file = chromium, file
        chromium.events.clear()
        chromium.open(file.as_uri())
        start = time.monotonic()
        self.ready("the page")
        self.seconds = time.monotonic() - start

    def ready(self, what):
        self.chromium.awaited("document.body && document.body.dataset.ready == 'yes'", 240, f"{what} does not get ready")

    def js(self, expression):
        answer = self.chromium.call("Runtime.evaluate", expression=expression, returnByValue=True)
        assert "exceptionDetails" not in answer, answer
        return answer["result"].get("value")

    def text(self, name):
        return self.js(f"document.getElementById('{name}').textContent")

    def box(self, name):
        return self.js(f"(b => [b.left, b.top, b.width, b.height])(document.getElementById('{name}').getBoundingClientRect())")

    def mouse(self, kind, x, y, buttons=0):
        self.chromium.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left" if kind != "mouseMoved" else "none",
                           buttons=buttons, clickCount=1)

    def key(self, key):
        for kind in ("keyDown", "keyUp"):
            self.chromium.call("Input.dispatchKeyEvent", type=kind, key=key)
        self.frame()

    def frame(self):
        self.chromium.call("Runtime.evaluate", awaitPromise=True,
                           expression="new Promise(r => requestAnimationFrame(() => requestAnimationFrame(r)))")

    def ink(self, name):
        return self.js(f"""(c => {{ const d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data; let s = 0;
            for (let i = 0; i < d.length; i += 4) s = (31 * s + d[i] + 3 * d[i + 1] + 7 * d[i + 2]) % 1000000007;
            return s; }})(document.getElementById('{name}'))""")

    def scrub(self, part):
        self.js(f"(t => {{ t.value = String(Math.round({part} * Number(t.max))); t.dispatchEvent(new Event('input')); }})"
                "(document.getElementById('time'))")
        self.frame()

    def check_whole(self):
        """Fits into narrow and wide windows, asked nothing, complained of nothing."""
        for width in (400, 1400):
            self.chromium.call("Emulation.setDeviceMetricsOverride", width=width, height=900, deviceScaleFactor=1, mobile=False)
            self.frame()
            wide = self.js("document.documentElement.scrollWidth")
            assert wide <= width, f"{self.file.name} is {wide} px wide in a window of {width} px"
        assert not self.chromium.complaints(), self.chromium.complaints()
        strangers = [u for u in self.chromium.asked() if not u.startswith((self.file.as_uri(), "data:", "about:"))]
        assert not strangers, strangers


def numbers(text):
    return [float(n) for n in re.findall(r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?", text.replace("\u2212", "-"))]


def said_of_sphere(text):
    found = re.search(r"Sphere (\d+).*?position (.*?) mm; displacement (\S+) mm \((.*?)\)(?:; force of the bonds on the sphere (\S+) N)?", text)
    assert found, text
    return int(found[1]), numbers(found[2]), numbers(found[3])[0], numbers(found[4]), found[5] and numbers(found[5])[0]


def check_sphere(page, result):
    """What the page reads of a sphere is what the file holds, to the digits that are shown."""
    state = int(page.js("document.getElementById('scene').dataset.state"))
    number, position, size, moved, force = said_of_sphere(page.text("sphere_said"))
    with h5py.File(result) as file:
        step = file[f"steps/{state:05}"]
        want = step["position_m"][number - 1] * 1e3
        shift = step["displacement_m"][number - 1] * 1e3
        pull = np.linalg.norm(step["force_N"][number - 1])
    np.testing.assert_allclose(position, want, rtol=1e-4, atol=1e-6)
    np.testing.assert_allclose(moved, shift, rtol=1e-4, atol=1e-6)
    np.testing.assert_allclose(size, np.linalg.norm(shift), rtol=1e-4, atol=1e-6)
    np.testing.assert_allclose(force, pull, rtol=1e-4, atol=1e-9)
    return number, state


def check_turning(page):
    left, top, width, height = page.box("scene")
    eye, ink = page.js("document.getElementById('scene').dataset.eye"), page.ink("scene")
    x, y = left + 0.5 * width, top + 0.5 * height
    page.mouse("mousePressed", x, y, 1)
    for k in range(1, 6):
        page.mouse("mouseMoved", x + 20 * k, y + 6 * k, 1)
    page.mouse("mouseReleased", x + 100, y + 30)
    page.frame()
    turned = page.js("document.getElementById('scene').dataset.eye")
    assert turned != eye and page.ink("scene") != ink, (eye, turned)
    page.js("document.getElementById('scene').focus()")
    for key in ("ArrowLeft", "ArrowUp", "+"):
        before = page.ink("scene")
        page.key(key)
        assert page.ink("scene") != before, key
    assert page.js("document.getElementById('scene').dataset.eye") != turned


def check_peak(page, result):
    """A simulation opens at its largest force, the tool (or the push) drawn where the file has it."""
    with h5py.File(result) as file:
        times, force = file["curve/time_s"][:], file["curve/force_N"][:]
        states = file["steps/time_s"][:]
        peak = times[np.argmax(np.abs(force))]
        assert page.js("now") == peak, (page.js("now"), peak)
        state = int(page.js("document.getElementById('scene').dataset.state"))
        assert abs(states[state] - peak) == np.abs(states - peak).min(), (states[state], peak)
        assert page.js("document.getElementById('scene').dataset.axes") == "x,y,z"
        told = page.js("document.getElementById('scene').dataset.tool")
        if "tools" not in file:
            assert told == "push", told
            return
        want = file[f"steps/{state:05}/tools/position_m"][:]
        np.testing.assert_allclose(np.array(page.js("Array.from(organ.toolPlaces)")).reshape(len(states), -1, 3)[state], want, rtol=1e-6)
        x, y, radius = (float(v) for v in told.split(";")[0].split(","))
        sphere = [float(v) for v in page.js("document.getElementById('scene').dataset.chosen").split(",")]
        # The ball touches the contact sphere: their centres are drawn at most both radii apart.
        assert np.hypot(x - sphere[0], y - sphere[1]) <= radius + page.js("organ.o.radius_m * organ.seen[3 * organ.chosen + 2]") + 2


def look_at_result(chromium, tpm, folder, picture):
    (folder / "scene.json").write_text(json.dumps(SCENE))
    result = folder / "result.h5"
    subprocess.run([tpm, "simulate", folder / "scene.json", "-o", result], check=True, capture_output=True)
    subprocess.run([tpm, "view", result, "-o", folder / "result.html"], check=True, capture_output=True)
    page = Page(chromium, folder / "result.html")
    assert page.text("title") == SCENE["title"], page.text("title")
    assert page.text("badge") == "SIMULATED", page.text("badge")
    check_peak(page, result)
    check_turning(page)
    seen = set()
    for part in (0.0, 0.1, 0.5, 1.0):
        page.scrub(part)
        number, state = check_sphere(page, result)
        seen.add((state, page.ink("scene"), page.text("time_said")))
    assert len(seen) == 4, seen
    # Another sphere, by the mouse: the contact sphere is where it is drawn; then by key and by number.
    page.js("document.getElementById('number').value = '5'; document.getElementById('number').dispatchEvent(new Event('input'))")
    assert check_sphere(page, result)[0] == 5
    left, top, width, height = page.box("scene")
    for x in (0.45, 0.55, 0.6):
        page.mouse("mouseMoved", left + x * width, top + 0.5 * height)
    assert check_sphere(page, result)[0] != 5
    chosen = check_sphere(page, result)[0]
    page.js("document.getElementById('scene').focus()")
    page.key("n")
    assert check_sphere(page, result)[0] == chosen % 424 + 1
    page.js("(c => { c.value = 'force'; c.dispatchEvent(new Event('change')); })(document.getElementById('colour'))")
    assert check_sphere(page, result)[1] == state
    check_cursor(page, result)
    if picture:
        page.scrub(0.3)
        chromium.call("Emulation.setDeviceMetricsOverride", width=1300, height=980, deviceScaleFactor=1, mobile=False)
        page.js("(c => { c.value = 'displacement'; c.dispatchEvent(new Event('change')); })(document.getElementById('colour'))")
        page.frame()
        chromium.picture(picture)
    page.check_whole()


def look_at_tool(chromium, tpm, folder, picture):
    contact = {"kind": "ball", "radius": "6 mm"}
    (folder / "ball.json").write_text(json.dumps({**SCENE, "contacts": [contact]}))
    result = folder / "ball.h5"
    subprocess.run([tpm, "simulate", folder / "ball.json", "-o", result], check=True, capture_output=True)
    subprocess.run([tpm, "view", result, "-o", folder / "ball.html"], check=True, capture_output=True)
    page = Page(chromium, folder / "ball.html")
    check_peak(page, result)
    for width in (400, 1400) if picture else ():
        chromium.call("Emulation.setDeviceMetricsOverride", width=width, height=900, deviceScaleFactor=1, mobile=False)
        page.frame()
        chromium.picture(picture.replace(".png", f"_{width}.png"))
    page.check_whole()


def look_at_grasp(chromium, tpm, folder, picture):
    """Two plates: the force and the depth of each stand in the plots by name, and no name covers another."""
    plate = {"kind": "punch", "radius": "30 mm"}
    grasp = {"title": "grasped", "organ": {"kind": "block", "cells": [2, 2, 2], "spacing": "10 mm", "lattice": "cubic"},
             "material": {"E1": "12 kPa", "E2": "12 kPa", "Eprime": "12 kPa", "eta1": "48 kPa s"},
             "anchors": [{"kind": "half_space", "point": ["0 mm", "0 mm", "1 mm"], "normal": [0, 0, -1], "slides": True},
                         {"kind": "spheres", "spheres": [11, 14]}],
             "contacts": [{**plate, "at": [f"{x} mm", "10 mm", "10 mm"], "direction": [push, 0, 0],
                           "protocol": {"kind": "ramp_hold", "depth": depth, "rate": "1 mm/s", "hold": "1 s"}}
                          for x, push, depth in ((0, 1, "1 mm"), (20, -1, "0.5 mm"))], "outputs": {"count": 9}}
    (folder / "grasp.json").write_text(json.dumps(grasp))
    result = folder / "grasp.h5"
    subprocess.run([tpm, "simulate", folder / "grasp.json", "-o", result], check=True, capture_output=True)
    subprocess.run([tpm, "view", result, "-o", folder / "grasp.html"], check=True, capture_output=True)
    page = Page(chromium, folder / "grasp.html")
    names = ["contact 1: punch", "contact 2: punch"]
    with h5py.File(result) as file:
        want = {"depth": [1e3 * file[f"{group}/depth_m"][:] for group in ("curve", "contacts/2")],
                "contact force": [file[f"{group}/force_N"][:] for group in ("curve", "contacts/2")]}
    for quantity, curves in want.items():
        plot = f"plots.find(p => p.d.title === '{quantity}')"
        assert page.js(f"{plot}.series.map(s => s.label)") == names, page.js(f"{plot}.series.map(s => s.label)")
        for k, curve in enumerate(curves):
            np.testing.assert_allclose(page.js(f"Array.from({plot}.series[{k}].y)"), curve, rtol=1e-12)
    assert page.js("plots.find(p => p.d.title === 'dissipated energy').series.length") == 1
    for width in (400, 1400):
        chromium.call("Emulation.setDeviceMetricsOverride", width=width, height=900, deviceScaleFactor=1, mobile=False)
        page.frame()
        drawn = json.loads(page.js("document.getElementById('scene').dataset.names"))
        (a, y, w), (b, z, v) = drawn
        assert abs(y - z) >= 16 or a + w <= b or b + v <= a, drawn
        if picture:
            chromium.picture(picture.replace(".png", f"_grasp_{width}.png"))
    page.check_whole()


def check_cursor(page, result):
    """The curve of the force, read by key and mouse."""
    with h5py.File(result) as file:
        times, force = file["curve/time_s"][:], file["curve/force_N"][:]
    index = page.js("[...document.querySelectorAll('.plot h2')].findIndex(h => h.textContent.startsWith('contact force'))")
    page.js(f"document.getElementById('plot-{index}').focus()")
    page.key("Home")
    for k in range(1, 4):
        page.key("ArrowRight")
        said = numbers(page.text(f"reading-{index}"))
        np.testing.assert_allclose([said[0], said[-1]], [times[k], force[k]], rtol=1e-4, atol=1e-9)
    left, top, width, height = page.box(f"plot-{index}")
    page.mouse("mouseMoved", left + 0.5 * width, top + 0.5 * height)
    page.frame()
    said = numbers(page.text(f"reading-{index}"))
    k = int(np.argmin(np.abs(times - said[0])))
    assert 0.3 * times[-1] < said[0] < 0.7 * times[-1], said
    np.testing.assert_allclose(said[-1], force[k], rtol=1e-4)


def look_at_recording(chromium, tpm, folder):
    (folder / "session.json").write_text(json.dumps(SESSION))
    recording, rows = folder / "s.tpmrec", folder / "rows.h5"
    subprocess.run([tpm, "hil", "run", folder / "session.json", "--clock", "virtual", "-o", recording], check=True, capture_output=True)
    told = json.loads(subprocess.run([tpm, "view", recording, "-o", folder / "s.html", "--format", "json"], check=True,
                                     capture_output=True).stdout)
    assert told["samples"] >= 1_000_000 and told["samples_per_value"] == 1, told
    subprocess.run([tpm, "hil", "export", recording, "-o", rows], check=True, capture_output=True)
    recording.unlink()
    with h5py.File(rows) as file:
        force = file["rows/commanded_N"][:]
        depth = file["rows/tool_depth_m"][:]
        times = file["rows/time_s"][:]
    page = Page(chromium, folder / "s.html")
    assert page.text("badge") == "SIMULATED DEVICE", page.text("badge")
    # It opens when the hand felt most, the organ with it.
    peak = times[np.argmax(np.abs(force))]
    assert peak > 0.0 and np.isclose(page.js("now"), peak, rtol=0, atol=1e-9), (page.js("now"), peak)
    assert page.js("D.phases[document.getElementById('phases').selectedIndex].name") in page.text("phase_said")
    state = int(page.js("document.getElementById('scene').dataset.state"))
    states = np.array(page.js("Array.from(organ.times)"))
    assert abs(states[state] - peak) == np.abs(states - peak).min(), (states[state], peak)
    pictures = set()
    start = time.monotonic()
    for part in np.linspace(0.0, 1.0, 9):
        page.scrub(part)
        pictures.add((page.ink("scene"), page.text("time_said")))
        said = numbers(page.text("reading-0").split(";")[0])
        k = int(said[1]) - 1
        np.testing.assert_allclose(said[0], times[k], rtol=1e-6, atol=1e-9)
        shown = numbers(page.text("reading-0").split(";")[1])[-1]
        np.testing.assert_allclose(shown, 1e3 * depth[k], rtol=1e-4, atol=1e-5)
    assert len({t for _, t in pictures}) == 9 and len({i for i, _ in pictures}) >= 4, pictures
    scrubbed = time.monotonic() - start
    # A peak of one sample is drawn: the largest depth stands in the pyramid and in the picture's heights.
    most = page.js("plots[0].series[0].pyramid.range(0, plots[0].series[0].x.length)[1]")
    np.testing.assert_allclose(most, 1e3 * depth.max(), rtol=1e-6)
    for first, last in ((17, 1000), (123, 77_777), (5, len(depth) - 3)):
        low, high = page.js(f"plots[0].series[0].pyramid.range({first}, {last})")
        np.testing.assert_allclose([low, high], [1e3 * depth[first:last].min(), 1e3 * depth[first:last].max()], rtol=1e-6)
    assert "no peak is left out" in page.js("plots[0].said.textContent")
    page.js("for (let k = 0; k < 20; ++k) plots[0].zoom(0.5); plots[0].draw()")
    assert "every value in view" in page.js("plots[0].said.textContent")
    page.check_whole()
    print(f"{told['samples']} samples, page of {told['bytes']} bytes: ready after {page.seconds:.1f} s, scrubbed 9 times in {scrubbed:.1f} s")


def look_at_fit(chromium, tpm, folder):
    times = np.linspace(0, 12, 241)
    depth = np.minimum(2.0 * times, 4.0)
    rise = np.minimum(times, 2.0)
    force = 0.06 * depth + 0.045 * 4.0 * (np.exp(-(times - rise) / 2.0) - np.exp(-times / 2.0))
    force += 2e-4 * np.random.default_rng(1).standard_normal(len(times))
    lines = [f"{t:.4f},{d:.5f},{f:.6f}" for t, d, f in zip(times, depth, force)]
    (folder / "synthetic.csv").write_text("time [s],depth [mm],force [N]\n" + "\n".join(lines) + "\n")
    fit = [tpm, "fit", folder / "synthetic.csv", "--laws", "linear-1"]
    subprocess.run([*fit, "--folder", folder / "fitted"], check=True, capture_output=True)
    (folder / "answer.json").write_bytes(subprocess.run([*fit, "--folder", folder / "fitted_again", "--format", "json"], check=True, capture_output=True).stdout)
    law = json.loads((folder / "fitted/law.json").read_text())["parameters"]
    for name, source in (("law", "fitted/law.json"), ("figures", "fitted/figures.json"), ("answer", "answer.json")):
        subprocess.run([tpm, "view", folder / source, "-o", folder / f"{name}.html"], check=True, capture_output=True)
        page = Page(chromium, folder / f"{name}.html")
        assert page.js("plots.length") >= 2, name
        assert page.js("plots[0].canvas.focus(), plots[0].reading.textContent") != ""
        page.js("plots[0].move(5.0)")
        assert abs(numbers(page.text("reading-0"))[0] - 5.0) < 0.1 or name == "answer", page.text("reading-0")
        if name == "answer":
            answer = json.loads((folder / "answer.json").read_text())
            lead = page.js("document.getElementById('lead') ? document.getElementById('lead').textContent : document.body.textContent")
            remarks = [one["text"] for one in (*answer["remarks"], *answer["fit"]["remarks"])]
            for words in (*answer["summary"], *remarks):
                assert lead.count(words) == 1, (words, lead)
        if name == "law":
            for words in (f"{law['tau1_s']:.6g}", "std. error", "95 % interval", "N/m"):
                assert words in page.text("table"), page.text("table")
        page.check_whole()


def look_at_names(chromium, tpm, folder):
    """Places that have names and no number: the names stand at the axis and in the reading, at any width; the page is of
    figures, under their title, with the note that is drawn below them."""
    axes = {"x": {"quantity": "", "unit": "", "names": ["peak force", "force at end of hold", "relaxation ratio"]},
            "y": {"quantity": "E, of the measured value", "unit": "%"}}
    series = [{"kind": "line", "label": "no error", "provenance": "assumed", "x": [0.5, 3.5], "y": [0, 0]},
              {"kind": "points", "label": "E", "x": [1, 2, 3], "y": [-2.5, 1.0, 0.5]}]
    figures = {"figures": [{"name": "named", "title": "Model error", "caption": "By quantity.", "note": "a note",
                            "panels": [{**axes, "series": series}]}]}
    (folder / "figures.json").write_text(json.dumps(figures))
    subprocess.run([tpm, "view", folder / "figures.json", "-o", folder / "named.html"], check=True, capture_output=True)
    page = Page(chromium, folder / "named.html")
    assert (page.text("badge"), page.text("title")) == ("FIGURES", "Model error"), (page.text("badge"), page.text("title"))
    assert page.js("plots[0].name()") == "Model error: E, of the measured value, %", page.js("plots[0].name()")
    assert page.text("reading-0").startswith("peak force"), page.text("reading-0")
    assert "By quantity. a note" in page.js("document.body.textContent")
    for width in (400, 1400):
        chromium.call("Emulation.setDeviceMetricsOverride", width=width, height=900, deviceScaleFactor=1, mobile=False)
        page.frame()
        drawn = page.js("""(() => {
            const g = plots[0].canvas.getContext('2d'), write = g.fillText, seen = [];
            g.fillText = (text, x, y) => { const w = g.measureText(text).width, a = g.textAlign; seen.push([text, a === 'center' ? x - w / 2 : a === 'right' ? x - w : x, y, w]); write.call(g, text, x, y); };
            plots[0].draw(); delete g.fillText;
            return seen.filter(([text]) => plots[0].d.x.names.includes(text)); })()""")
        assert [text for text, *_ in drawn] == axes["x"]["names"], (width, drawn)
        assert all(x >= 0 and x + w <= page.js("plots[0].width") for _, x, _, w in drawn), (width, drawn)
        for i, (_, x, y, w) in enumerate(drawn):
            assert all(abs(y - b) > 10 or x + w <= a or a + c <= x for _, a, b, c in drawn[i + 1:]), (width, drawn)
    page.check_whole()


def look_at_lines(chromium, tpm, folder):
    """A line of many values that begins late is not drawn before; names of all series fit into a narrow window; an axis
    ends where the figure's does, and the page says what is beyond."""
    late, early = np.linspace(50, 100, 4000), np.linspace(0, 100, 50)
    axes = {"x": {"quantity": "time", "unit": "s"}, "y": {"quantity": "force", "unit": "N", "lower": 0.0, "upper": 30.0}}
    series = [{"kind": "points", "label": "readings that were fitted", "x": list(early), "y": [5.0] * 49 + [900.0]},
              {"kind": "points", "label": "readings that were not fitted", "x": list(early), "y": [3.0] * 50},
              {"kind": "line", "label": "the law that was found", "x": list(late), "y": list(10 + 0.2 * (late - 50))}]
    figures = {"figures": [{"name": "late", "title": "late", "panels": [{**axes, "series": series}]}]}
    (folder / "figures.json").write_text(json.dumps(figures))
    subprocess.run([tpm, "view", folder / "figures.json", "-o", folder / "late.html"], check=True, capture_output=True)
    page = Page(chromium, folder / "late.html")
    said = page.js("[sized(2.02e-4, 'N', 5), sized(-3.5e-8, 'm', 5), sized(0.25, 'N', 5), sized(1e-4, '%', 5), sized(2, '', 5)]")
    assert said == ["202 uN", "\u221235 nm", "0.25 N", "1.0000e\u22124 %", "2"], said
    for width in (400, 1400):
        chromium.call("Emulation.setDeviceMetricsOverride", width=width, height=900, deviceScaleFactor=1, mobile=False)
        page.frame()
        page.js("plots[0].draw()")
        ends = page.js("(g => plots[0].labels.map(([s, x]) => x + 16 + g.measureText(s.label).width))(plots[0].canvas.getContext('2d'))")
        assert len(ends) == 3 and max(ends) <= page.js("plots[0].width"), (width, ends)
        drawn = page.js("""(() => {
            const p = plots[0], c = p.canvas, ratio = c.width / p.width, d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;
            const [r, g, b] = [1, 3, 5].map(i => parseInt(p.series[2].colour.slice(i, i + 2), 16)), n = [0, 0];
            for (let y = Math.ceil(ratio * p.frame.T); y < c.height; ++y) for (let x = 0; x < c.width; ++x) {
              const i = 4 * (y * c.width + x);
              if (Math.abs(d[i] - r) + Math.abs(d[i + 1] - g) + Math.abs(d[i + 2] - b) < 12) ++n[x / ratio < p.X(50) - 3 ? 0 : 1];
            }
            return n; })()""")
        assert drawn[0] == 0 and drawn[1] > 10, (width, drawn)
        assert page.js("plots[0].y[1]") < 33.0 and "above 30" in page.js("plots[0].said.textContent"), page.js("plots[0].y")
    page.check_whole()


def look_at_long_words(chromium, tpm, folder):
    """Names of files, titles and labels as long as a user can make them, with and without places to break, in figures, in a
    law and in a list of results: the page fits, what is drawn stays on its canvas, and what is cut there can be read."""
    there = folder / "long"
    there.mkdir()
    for number, long in enumerate(("specimen_17_of_the_second_series_under_the_instrument_" * 4, "specimen 17 of the second series " * 7)):
        by_name = {"x": {"quantity": "", "unit": "", "names": [long + "a", long + "b", "short"]}, "y": {"quantity": long, "unit": "N"}}
        across = {"x": {"quantity": long, "unit": "mm"}, "y": {"quantity": "recording", "unit": "", "names": [long + "a", long + "b"]}}
        panels = [{**by_name, "series": [{"kind": "points", "label": long, "x": [1, 2, 3], "y": [1.0, 2.0, 3.0]}]},
                  {**across, "series": [{"kind": "points", "label": long, "x": [1.0, 2.0], "y": [1, 2]},
                                        {"kind": "line", "label": "b", "x": [0.0, 3.0], "y": [1, 2]}]}]
        figures = {"figures": [{"name": "long", "title": long, "caption": long, "note": long, "panels": panels}]}
        file = there / f"{long[:200]}{number}.json"
        file.write_text(json.dumps(figures))
        subprocess.run([tpm, "view", file, "-o", folder / f"long{number}.html"], check=True, capture_output=True)
        page = Page(chromium, folder / f"long{number}.html")
        for width in (400, 1400):
            chromium.call("Emulation.setDeviceMetricsOverride", width=width, height=900, deviceScaleFactor=1, mobile=False)
            page.frame()
            outside = page.js("""(() => {
                const out = [];
                for (const p of plots) {
                  const g = p.canvas.getContext('2d'), write = g.fillText;
                  g.fillText = (text, x, y) => { const w = g.measureText(text).width, a = g.textAlign, left = a === 'center' ? x - w / 2 : a === 'right' ? x - w : x;
                    if (left < -1 || left + w > p.width + 1) out.push([text, left, left + w]); write.call(g, text, x, y); };
                  p.draw(); delete g.fillText;
                }
                for (const e of document.querySelectorAll('h1, h2, p, td, th, .badge, select')) {
                  const r = e.getBoundingClientRect();
                  if (r.width > 0 && (r.left < 0 || r.right > innerWidth)) out.push([e.tagName, r.left, r.right]);
                }
                return out; })()""")
            assert not outside, (width, outside)
            assert page.js(f"plots.every(p => p.canvas.title.includes({json.dumps(long)}))"), page.js("plots.map(p => p.canvas.title)")
        page.check_whole()
    subprocess.run([tpm, "view", there, "-o", folder / "long.html"], check=True, capture_output=True)
    Page(chromium, folder / "long.html").check_whole()


def look_at_folder(chromium, tpm, folder):
    """Several results on one page: a list names them, each is shown when its name is clicked; a sweep, which is not
    shown, is named with the command that draws it, on the page, in the text and in the JSON."""
    there = folder / "results"
    there.mkdir()
    (folder / "sweep.json").write_text(json.dumps({
        "model": "single_contact", "indentation": {"kind": "step_hold"}, "outputs": ["peak_force"],
        "axes": [{"parameter": "depth", "from": "1 mm", "to": "2 mm", "count": 2}]}))
    for name, depth in (("shallow", "2 mm"), ("deep", "4 mm")):
        protocol = {"kind": "ramp_hold", "depth": depth, "rate": "4 mm/s", "hold": "1 s"}
        (folder / "short.json").write_text(json.dumps({**SCENE, "title": name, "protocol": protocol, "outputs": {"count": 3}}))
        subprocess.run([tpm, "simulate", folder / "short.json", "-o", there / f"{name}.h5"], check=True, capture_output=True)
    subprocess.run([tpm, "sweep", folder / "sweep.json", "-o", there / "mysweep.h5"], check=True, capture_output=True)
    view = [tpm, "view", there, "-o", folder / "results.html"]
    text = subprocess.run(view, check=True, capture_output=True, text=True).stdout
    told = json.loads(subprocess.run([*view, "--format", "json"], check=True, capture_output=True).stdout)
    words = f"{there / 'mysweep.h5'}: is the result of a sweep; expected tpm sweep plot {there / 'mysweep.h5'}"
    assert f"not shown: {words}\n" in text and "deep.h5: simulation: deep\n" in text, text
    assert told["kind"] == "folder" and [Path(r["file"]).name for r in told["results"]] == ["deep.h5", "shallow.h5"], told
    assert [one["message"] for one in told["not_shown"]] == [words], told
    page = Page(chromium, folder / "results.html")
    assert page.js("[...document.querySelectorAll('#contents a')].map(a => a.textContent)") == ["deep.h5", "shallow.h5"]
    assert words in page.text("contents"), page.text("contents")
    most = {}
    for k, name in enumerate(("deep", "shallow"), 1):
        if k > 1:
            page.js(f"delete document.body.dataset.ready; document.querySelectorAll('#contents a')[{k - 1}].click()")
            page.ready("the second result")
        assert page.text("title") == name, page.text("title")
        assert page.js("document.querySelector('#contents [aria-current]').textContent") == f"{name}.h5"
        most[name] = page.js("Math.max(...plots[0].main.y)")
    np.testing.assert_allclose([most["deep"], most["shallow"]], [4.0, 2.0], rtol=1e-6)
    page.check_whole()


def look_at_study(chromium, tpm, folder, picture):
    """A folder of folders of fits, a validation, a simulation, a session and recordings: each is listed under its kind and
    shown as alone; recordings are named with the command that fits them."""
    study = folder / "study"
    for name in ("day/a_fit", "day/b_fit"):
        shutil.copytree(folder / "fitted", study / name)
    validated = subprocess.run([tpm, "validate", folder / "fitted/law.json", folder / "synthetic.csv", "--require", "50%",
                                "--folder", study / "checked"], capture_output=True, text=True)
    assert validated.returncode in (0, 1), validated.stderr  # 1: not adequate, which is shown, too
    shutil.copy(folder / "ball.h5", study)
    (study / "recordings").mkdir()
    for name in ("1.csv", "2.csv"):
        shutil.copy(folder / "synthetic.csv", study / "recordings" / name)
    press = {"depths": ["2 mm"], "rates": ["4 mm/s"], "hold": "1 s", "rest": "1 s"}
    (folder / "press.json").write_text(json.dumps({**SESSION, "title": "one press", "indentations": press}))
    subprocess.run([tpm, "hil", "run", folder / "press.json", "--clock", "virtual", "-o", study / "press.tpmrec"], check=True,
                   capture_output=True)
    view = [tpm, "view", study, "-o", folder / "study.html"]
    told = json.loads(subprocess.run([*view, "--format", "json"], check=True, capture_output=True).stdout)
    assert [r["kind"] for r in told["results"]] == ["fit", "fit", "validation", "simulation", "recording"], told
    words = f"{study / 'recordings'}: holds 2 tables, no result of tpm; expected tpm fit {study / 'recordings'}, if they are recordings"
    assert [one["message"] for one in told["not_shown"]] == [words], told
    page = Page(chromium, folder / "study.html")
    assert page.js("[...document.querySelectorAll('#contents h2')].map(h => h.textContent)") == \
        ["Fits", "Validations", "Simulations", "Sessions", "Not shown"]
    assert page.js("[...document.querySelectorAll('#contents a')].map(a => a.textContent)") == \
        ["day/a_fit", "day/b_fit", "checked", "ball.h5", "press.tpmrec"]
    assert words in page.text("contents"), page.text("contents")
    for k, badge in enumerate(("FIT", "FIT", "VALIDATION", "SIMULATED", "SIMULATED DEVICE"), 1):
        if k > 1:
            page.js(f"delete document.body.dataset.ready; document.querySelectorAll('#contents a')[{k - 1}].click()")
            page.ready(f"result {k}")
        assert page.text("badge") == badge, (k, page.text("badge"))
        if badge == "VALIDATION":  # what is required of each quantity has one name and one colour
            assert page.js("plots[0].labels.filter(([s]) => s.label === 'requirement').length") == 1
            assert page.js("new Set(plots[0].series.filter(s => s.label === 'requirement').map(s => s.colour)).size") == 1
            assert page.text("reading-0").count("requirement") == 1, page.text("reading-0")
        # As the file alone is shown.
        subprocess.run([tpm, "view", told["results"][k - 1]["file"], "-o", folder / "alone.html"], check=True, capture_output=True)
        alone = json.loads(re.search(r'id="description">(.*?)</script>', (folder / "alone.html").read_text()).group(1))
        assert json.loads(page.js("JSON.stringify(D)")) == alone, badge
        assert page.js("plots.length") == len(alone["plots"]) > 0, badge
        assert page.js("[...document.querySelectorAll('th')].every(h => h.textContent !== '')"), badge
        for width in (400, 1400) if picture else ():
            chromium.call("Emulation.setDeviceMetricsOverride", width=width, height=900, deviceScaleFactor=1, mobile=False)
            page.frame()
            chromium.picture(picture.replace(".png", f"_study_{k}_{width}.png"))
        page.check_whole()


def main():
    program = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if not program:
        print("SKIPPED: there is no Chromium (Debian: chromium)")
        sys.exit(77)
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name:
        folder = Path(name)
        try:
            chromium = Chromium(program, folder / "profile")
        except CannotStart as e:
            print(f"SKIPPED: Chromium does not run on this machine: {e}")
            sys.exit(77)
        try:
            look_at_result(chromium, sys.argv[1], folder, sys.argv[2] if len(sys.argv) > 2 else None)
            look_at_tool(chromium, sys.argv[1], folder, sys.argv[2] if len(sys.argv) > 2 else None)
            look_at_grasp(chromium, sys.argv[1], folder, sys.argv[2] if len(sys.argv) > 2 else None)
            look_at_recording(chromium, sys.argv[1], folder)
            look_at_fit(chromium, sys.argv[1], folder)
            look_at_names(chromium, sys.argv[1], folder)
            look_at_lines(chromium, sys.argv[1], folder)
            look_at_long_words(chromium, sys.argv[1], folder)
            look_at_folder(chromium, sys.argv[1], folder)
            look_at_study(chromium, sys.argv[1], folder, sys.argv[2] if len(sys.argv) > 2 else None)
        finally:
            chromium.close()
    print("looked at a result, a grasp, a recording, three files of a fit, a folder and a study")


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""`decant live` in a real browser: headless Chromium looks, tilts, types, drags, closes, and sees what a user sees.

    page_test.py DECANT [unittest options]

Needs Chromium and its driver, and selenium. DECANT_SCREENSHOTS names a folder for a picture of each page.
"""

import asyncio
import functools
import io
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest
from pathlib import Path

import h5py
import numpy as np
import websocket
from PIL import Image
from selenium import webdriver
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.ui import Select

HERE = Path(__file__).parent
DECANT = "build/release/bin/decant"


class Live:
    """One `decant live` on the scene of two small cups, and what it says at first."""

    def __init__(self, *options, scene=HERE / "cups.json"):
        self.keep = Path(tempfile.mkdtemp(prefix="decant-live-"))
        self.process = subprocess.Popen([DECANT, "live", scene, "--backend", "hash", "--executor", "host",
                                         "--keep", self.keep, *options], stdout=subprocess.PIPE, text=True)
        self.address = self.process.stdout.readline().strip()
        self.hint = self.process.stdout.readline()

    def end(self):
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
        status = self.process.wait(20)
        shutil.rmtree(self.keep)
        self.process.stdout.close()
        return status


class Tunnel:
    """Another port of this machine that leads to the one of `decant live`, as `ssh -L` makes it."""

    def __init__(self, port):
        self.loop = asyncio.new_event_loop()
        threading.Thread(target=self.loop.run_forever, daemon=True).start()
        starting = asyncio.start_server(functools.partial(self.join, port), "127.0.0.1", 0)
        self.server = asyncio.run_coroutine_threadsafe(starting, self.loop).result()
        self.port = self.server.sockets[0].getsockname()[1]

    async def join(self, port, near_in, near_out):
        far_in, far_out = await asyncio.open_connection("127.0.0.1", port)
        await asyncio.gather(self.carry(near_in, far_out), self.carry(far_in, near_out))

    async def carry(self, source, sink):
        while data := await source.read(1 << 16):
            sink.write(data)
            await sink.drain()
        sink.close()

    def end(self):
        self.loop.call_soon_threadsafe(self.server.close)


def browser():
    options = webdriver.ChromeOptions()
    options.binary_location = shutil.which("chromium")
    for one in ("--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--use-angle=swiftshader",
                "--enable-unsafe-swiftshader", "--window-size=1000,700"):
        options.add_argument(one)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    return webdriver.Chrome(service=Service(shutil.which("chromedriver")), options=options)


class PageTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.browser = browser()

    @classmethod
    def tearDownClass(cls):
        cls.browser.quit()

    def setUp(self):
        self.live = Live()
        self.browser.get(self.live.address)
        self.until(lambda: self.js("live.drawn") > 2 and self.js("live.status !== null"), "pictures are drawn")

    def tearDown(self):
        if folder := os.environ.get("DECANT_SCREENSHOTS"):
            self.browser.save_screenshot(str(Path(folder) / f"{self.id().rsplit('.')[-1]}.png"))
        troubles = [one["message"] for one in self.browser.get_log("browser") if "WebSocket" not in one["message"]]
        self.browser.get("about:blank")
        self.assertEqual(self.live.end(), 128 + signal.SIGINT)
        self.assertEqual(troubles, [])

    def js(self, expression):
        return self.browser.execute_script(f"return {expression}")

    def until(self, condition, what, seconds=60):
        start = time.monotonic()
        while not condition():
            if time.monotonic() - start > seconds:
                self.fail(f"not within {seconds} s: {what}; messages: {self.messages()!r}")
            time.sleep(0.05)

    def find(self, name):
        return self.browser.find_element(By.ID, name)

    def messages(self):
        return self.find("messages").text

    def type(self, name, text):
        self.find(name).send_keys(Keys.CONTROL, "a")
        self.find(name).send_keys(text, Keys.ENTER)

    def particle_pixels(self):
        """Pixels of the drawing that are much brighter or more colorful than containers are."""
        image = Image.open(io.BytesIO(self.find("canvas").screenshot_as_png)).convert("RGB")
        colors = np.asarray(image).astype(int)
        return int((colors.max(axis=2) - colors.min(axis=2) > 60).sum())

    def test_particles_are_drawn_and_move(self):
        self.assertEqual(self.js("live.scene.particles"), 192)
        self.assertGreater(self.particle_pixels(), 2000)
        first = self.js("[live.picture.substep, Array.from(live.picture.particles.slice(0, 400))]")
        self.until(lambda: self.js("live.picture.substep") > first[0] + 100, "the run goes on")
        self.assertNotEqual(self.js("Array.from(live.picture.particles.slice(0, 400))"), first[1])
        self.assertIn("substeps/s", self.find("rates").text)
        self.assertIn("192 fluid", self.find("device").text)

    def test_a_tilted_cup_pours(self):
        self.assertEqual(self.js("live.status.mass.receiver"), 0)
        self.browser.execute_script("element('tilt-source').value = 130;"
                                    "element('tilt-source').dispatchEvent(new Event('input'))")
        self.until(lambda: "source" in self.js("live.status.by_hand"), "the hand is at work")
        self.until(lambda: self.js("live.status.mass.receiver") > 0.01, "10 g in the receiver", 120)
        self.assertGreater(self.js("live.status.degrees.source"), 60)
        self.assertAlmostEqual(self.js("Object.values(live.status.mass).reduce((a, b) => a + b)"), 0.041472, 6)
        self.find("schedule-source").click()
        self.until(lambda: not self.js("live.status.by_hand"), "the schedule has it again", 120)
        self.assertLess(self.js("live.status.degrees.source"), 11)

    def test_a_cup_is_dragged(self):
        # Where the source is drawn: found by what the pointer looks like there.
        canvas = self.find("canvas")
        width, height = canvas.size["width"], canvas.size["height"]
        for x in range(-4 * width // 10, 0, 20):
            ActionChains(self.browser).move_to_element_with_offset(canvas, x, -height // 8).perform()
            if canvas.value_of_css_property("cursor") == "ew-resize":
                break
        else:
            self.fail("no cup under the pointer")
        ActionChains(self.browser).click_and_hold().move_by_offset(60, 0).release().perform()
        self.until(lambda: self.js("live.status.degrees.source") > 5, "the cup turns")
        self.assertEqual(list(self.js("live.status.by_hand")), ["source"])

    def test_a_bad_value_is_refused_with_the_scenes_own_text(self):
        self.type("viscosity", "-1")
        self.until(lambda: "fluid.viscosity = -1" in self.messages(), "the bound is told")
        self.assertEqual(self.find("viscosity").get_attribute("value"), "0.05")
        self.type("gx", "down")
        self.until(lambda: "is no number" in self.messages(), "no number")
        self.type("spacing", "0.1")
        self.until(lambda: "wall_thickness" in self.messages(), "the scene's rule is told")
        self.type("backend", "teapot")
        self.until(lambda: "--backend = teapot" in self.messages(), "no such backend")
        before = self.js("live.picture.substep")
        self.until(lambda: self.js("live.picture.substep") > before, "the run goes on")

    def test_values_change_in_the_run_or_start_it_anew(self):
        self.until(lambda: self.js("live.picture.substep") > 50, "the run is under way")
        self.type("viscosity", "0.2")
        self.until(lambda: self.js("live.scene.viscosity") == 0.2, "another viscosity")
        self.assertGreater(self.js("live.picture.substep"), 50)
        self.type("backend", "list")
        self.until(lambda: self.js("live.scene.backend") == "list", "another backend")
        self.type("rebuild", "7")
        self.until(lambda: self.js("live.scene.backend") == "list:rebuild=7", "another interval")
        self.assertGreater(self.js("live.picture.substep"), 50)
        self.type("level-0", "0.02")
        self.until(lambda: self.js("live.scene.particles") == 96, "another fill")
        self.assertIn("starts anew", self.messages())
        self.until(lambda: self.js("live.picture.n") == 96, "96 are drawn")

    def test_pause_step_and_reset(self):
        self.find("pause").click()
        self.until(lambda: self.js("live.status.paused"), "paused")
        self.until(lambda: self.js("live.status.substep === live.picture.substep"), "at rest")
        before = self.js("live.picture.substep")
        self.find("step").click()
        self.until(lambda: self.js("live.picture.substep") == before + 1, "one substep")
        time.sleep(0.3)
        self.assertEqual(self.js("live.picture.substep"), before + 1)
        self.find("reset").click()
        self.until(lambda: self.js("live.picture.substep") == 0, "the start")

    def test_looking_back(self):
        self.until(lambda: self.js("past.pictures.length") > 20, "pictures are kept")
        self.browser.execute_script("element('time').value = 3; element('time').dispatchEvent(new Event('input'))")
        self.assertIn("looking back", self.find("shown").text)
        shown = self.js("past.pictures[Number(element('time').value)].picture.time")
        drawn = self.js("live.drawn")
        self.until(lambda: self.js("live.drawn") > drawn + 5, "pictures go on coming")
        self.assertEqual(self.js("past.pictures[Number(element('time').value)].picture.time"), shown)
        self.find("now").click()
        self.assertNotIn("looking back", self.find("shown").text)

    def test_colors(self):
        for by, unit in (("density", "kg/m³"), ("pressure", "Pa"), ("region", ""), ("speed", "m/s")):
            Select(self.find("color")).select_by_value(by)
            self.until(lambda by=by: self.js("live.legend").startswith(by), f"by {by}")
            self.assertEqual(self.find("unit").text, unit)
        Select(self.find("color")).select_by_value("score")
        self.until(lambda: self.js("live.scores") and self.js("live.scores.largest") > 0, "scores")
        self.assertLess(self.js("live.scores.largest"), 1)

    def test_two_tabs_see_the_same_and_a_closed_one_leaves_the_run_alone(self):
        first = self.browser.current_window_handle
        self.browser.switch_to.new_window("window")
        self.browser.get(self.live.address)
        self.until(lambda: self.js("live.drawn") > 2, "the second page draws")
        Select(self.find("color")).select_by_value("density")
        self.find("pause").click()
        self.until(lambda: self.js("live.status.paused") and self.js("live.legend").startswith("density"), "both here")
        self.until(lambda: self.js("live.status.substep === live.picture.substep"), "at rest")
        second = self.js("[live.picture.substep, Array.from(live.picture.particles)]")
        self.browser.close()
        self.browser.switch_to.window(first)
        self.until(lambda: self.js("live.status.paused") and self.js("live.legend").startswith("density"), "and there")
        self.until(lambda: self.js("[live.picture.substep, Array.from(live.picture.particles)]") == second, "the same")
        self.find("pause").click()
        self.until(lambda: self.js("live.picture.substep") > second[0] + 50, "the run goes on")

    def test_an_instant_is_kept_and_judged(self):
        self.find("judge").click()
        self.until(lambda: self.js("element('verdict').dataset.verdict || ''") == "pass", "a verdict", 180)
        self.assertIn("rows: pass", self.find("verdict").text)
        (kept,) = self.live.keep.glob("*.h5")
        told = subprocess.run([DECANT, "conform", kept, "--backend", "hash", "--executor", "host"], capture_output=True)
        self.assertEqual(told.returncode, 0, told.stdout)

    def test_a_kept_instant_is_where_another_run_starts(self):
        self.until(lambda: self.js("live.picture.substep") > 200, "the run is under way")
        self.find("keep").click()
        self.until(lambda: "decant conform" in self.find("verdict").text, "the file", 120)
        (kept,) = self.live.keep.glob("*.h5")
        with h5py.File(kept) as file:
            position = file["state/position"][:]
        again = Live("--paused", scene=kept)
        try:
            self.browser.get(again.address)
            self.until(lambda: self.js("live.drawn") > 0, "it is drawn")
            self.assertEqual(self.js("live.picture.substep"), int(kept.stem.split("-")[-1]))
            drawn = np.array(self.js("Array.from(live.picture.particles)")).reshape(-1, 4)[:, :3] / 65535
            least, extent = (np.array(self.js(f"Array.from(live.picture.{one})")) for one in ("min", "extent"))
            np.testing.assert_allclose(least + extent * drawn, position, atol=1e-5)
        finally:
            self.browser.get("about:blank")
            again.end()

    def test_the_end_of_the_run_is_told(self):
        self.live.process.send_signal(signal.SIGINT)
        self.until(lambda: "The run has ended" in self.messages(), "the end")

    def test_through_a_tunnel(self):
        own, token = re.match(r"http://127.0.0.1:(\d+)/(\w+)/", self.live.address).groups()
        tunnel = Tunnel(int(own))
        try:
            for name in ("localhost", "127.0.0.1"):
                self.browser.get(f"http://{name}:{tunnel.port}/{token}/")
                self.until(lambda: self.js("live.drawn") > 2, "pictures come through the tunnel")
        finally:
            tunnel.end()

    def test_other_origins_and_wrong_tokens_are_refused(self):
        socket = self.live.address.replace("http", "ws") + "socket"
        host = re.match(r"ws://([^/]*)/", socket).group(1)
        for address, headers in ((socket, {"origin": "http://example.org"}), (socket, {"host": "example.org"}),
                                 (f"ws://{host}/{'0' * 32}/socket", {})):
            with self.assertRaises(websocket.WebSocketBadStatusException):
                websocket.create_connection(address, **headers)
        own = websocket.create_connection(socket, origin=f"http://{host}")
        self.assertEqual(json.loads(own.recv())["type"], "scene")
        own.close()
        self.assertIn(f"ssh -N -L {host.split(':')[1]}:", self.live.hint)


if __name__ == "__main__":
    if len(sys.argv) > 1 and not sys.argv[1].startswith("-"):
        DECANT = str(Path(sys.argv.pop(1)).resolve())
    if not (shutil.which("chromium") and shutil.which("chromedriver")):
        print("page_test.py: no Chromium with its driver here", file=sys.stderr)
        sys.exit(77)
    unittest.main()

"""The base class of the tests of the tuning page: a scene, a server and a browser."""

import atexit
import pathlib
import shutil
import sys
import tempfile
import time
import unittest

from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.keys import Keys

from tune_session import Page, Server, browser, wait

PROGRAM, SOURCE = sys.argv[1], pathlib.Path(sys.argv[2])

SCENE = '''// A small fountain, with comments that must stay.
{
  "version": 1,
  "bodies": [
    {"name": "ground", "motion": "static", "shape": {"type": "plane"}},   // the floor
    {"name": "ball", "shape": {"type": "sphere", "radius": 0.4}, "position": [0.0, 0.40, 0]}
  ],
  "emitters": [
    {"name": "jet", "rate": 4.0e2, "speed": {"mean": 4, "deviation": 0.5}, "radius": 0.03,
     "overlap": true, "surface": {"type": "disc", "position": [0, 0.1, 1.2], "radius": 0.05},
     "look": {"color": "#4080ff"}}
  ],
  "camera": {"type": "static", "eye": [0, 1.5, 5], "target": [0, 0.8, 0]},
  "render": {"size": [320, 180]},
  "output": {"fps": 20, "duration": 1}
}
'''


class Case(unittest.TestCase):
    scene_text = SCENE
    driver = None  # one browser for all classes

    @classmethod
    def setUpClass(cls):
        if not Case.driver:
            Case.driver = browser()
            atexit.register(Case.driver.quit)

    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix='offstage-tune-'))
        self.scene = self.folder / 'fountain.json'
        self.scene.write_bytes(self.scene_text.encode())
        self.driver.get_log('browser')  # forgets the errors that other tests caused
        self.server = Server(PROGRAM, self.scene)
        self.page = Page(self.driver, self.server.address)
        wait(lambda: self.page.js('return tuneStore.writer === tuneStore.tab'), what='the right to write')

    def tearDown(self):
        self.driver.get('about:blank')
        self.server.kill()
        shutil.rmtree(self.folder)

    def keys(self, *keys):
        ActionChains(self.driver).send_keys(*keys).perform()

    def command(self, *keys):
        actions = ActionChains(self.driver).key_down(Keys.CONTROL)
        for key in keys[:-1]:
            actions.key_down(key)
        actions.send_keys(keys[-1])
        for key in keys[:-1]:
            actions.key_up(key)
        actions.key_up(Keys.CONTROL).perform()
        self.settle()

    def settle(self):
        """Waits until the server has answered all requests of the page."""
        time.sleep(0.05)
        self.page.idle()

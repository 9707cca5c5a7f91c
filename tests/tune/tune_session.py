"""Runs `offstage tune` and a headless browser with its page, for the tests and the benchmark."""

import atexit
import os
import shutil
import signal
import subprocess
import tempfile
import time

from selenium import webdriver
from selenium.webdriver.chrome.options import Options
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.by import By


def wait(condition, seconds=30, what='a condition'):
    """Repeats condition() until its value is true, and returns it; fails after `seconds`."""
    end = time.monotonic() + seconds
    while True:
        value = condition()
        if value:
            return value
        if time.monotonic() > end:
            raise AssertionError(f'{what} did not come true in {seconds} s')
        time.sleep(0.05)  # each question costs several milliseconds of the browser


class Server:
    """`offstage tune SCENE` as a child process."""

    def __init__(self, program, scene, *options):
        self.process = subprocess.Popen([program, 'tune', str(scene), '--no-open', *options], stdout=subprocess.PIPE,
                                        stderr=subprocess.PIPE, text=True)
        self.address = self.process.stdout.readline().strip()
        if not self.address:
            raise AssertionError(self.process.stderr.read())

    def memory_mb(self):
        with open(f'/proc/{self.process.pid}/status') as status:
            return next(int(line.split()[1]) / 1024 for line in status if line.startswith('VmRSS'))

    def cpu_s(self):
        """CPU time of the server so far [s]."""
        with open(f'/proc/{self.process.pid}/stat') as stat:
            fields = stat.read().rsplit(')', 1)[1].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf('SC_CLK_TCK')

    def children(self):
        with open(f'/proc/{self.process.pid}/task/{self.process.pid}/children') as children:
            return children.read().split()

    def interrupt(self, seconds=10):
        self.process.send_signal(signal.SIGINT)
        return self.process.wait(seconds)

    def kill(self):
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        self.process.stdout.close()
        self.process.stderr.close()


def browser(width=1280, height=800, dark=False):
    profile = tempfile.mkdtemp(prefix='offstage-chromium-')
    atexit.register(shutil.rmtree, profile, ignore_errors=True)
    options = Options()
    options.binary_location = shutil.which('chromium') or shutil.which('chromium-browser') or ''
    for argument in ('--headless=new', '--no-sandbox', '--disable-dev-shm-usage', '--disable-gpu', '--hide-scrollbars',
                     '--force-device-scale-factor=1', f'--window-size={width},{height}', '--remote-debugging-pipe',
                     '--user-data-dir=' + profile):
        options.add_argument(argument)
    if dark:
        options.add_argument('--force-dark-mode')
    options.set_capability('goog:loggingPrefs', {'browser': 'ALL'})
    driver = webdriver.Chrome(service=Service(shutil.which('chromedriver')), options=options)
    driver.set_script_timeout(30)
    set_size(driver, width, height)
    return driver


def set_size(driver, width, height):
    driver.execute_cdp_cmd('Emulation.setDeviceMetricsOverride',
                           {'width': width, 'height': height, 'deviceScaleFactor': 1, 'mobile': False})


def set_dark(driver, dark):
    driver.execute_cdp_cmd('Emulation.setEmulatedMedia',
                           {'features': [{'name': 'prefers-color-scheme', 'value': 'dark' if dark else 'light'}]})


class Page:
    """The page in a tab of the browser, with functions for what a user sees and does."""

    def __init__(self, driver, address):
        self.driver = driver
        self.open(address)

    def open(self, address):
        self.driver.get(address)
        wait(lambda: self.js('return document.body.dataset.ready'), what='the page')

    def js(self, script, *arguments):
        return self.driver.execute_script(script, *arguments)

    def find(self, selector):
        return self.driver.find_element(By.CSS_SELECTOR, selector)

    def all(self, selector):
        return self.driver.find_elements(By.CSS_SELECTOR, selector)

    def click(self, selector):
        self.find(selector).click()

    def idle(self):
        wait(lambda: self.js('return window.tuneIdle()'), what='the end of the requests')

    def text(self):
        return self.js('return tuneStore.doc.text')

    def film(self):
        return self.js('return tuneStore.doc.film')

    def pixels(self):
        """A checksum of the pixels of the canvas."""
        return self.js('''const c = document.getElementById('film'); const d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;
            let a = 0; for (let i = 0; i < d.length; i += 4) a = (a * 31 + d[i] * 7 + d[i + 1] * 3 + d[i + 2]) % 4294967291; return a;''')

    def wait_for_frame(self, frame=None, seconds=60, film=None):
        """Waits until the canvas shows this frame (or any frame) of the edited version, or of the film `film`."""
        wait(lambda: self.js('''const c = document.getElementById('film').dataset;
            return c.film === (arguments[1] ?? tuneStore.doc.film) && (arguments[0] === null ? c.frame > 0 : Number(c.frame) === arguments[0]);''', frame, film),
            seconds, f'frame {frame}')

    def select(self, path):
        self.js('document.querySelector(`#tree [data-path="${arguments[0]}"]`).click()', path)

    def type_value(self, key, name, value):
        field = self.find(f'#controls .row[data-key="{key}"] input[aria-label="{name}"]')
        self.js('arguments[0].scrollIntoView({block: "center"}); arguments[0].focus(); arguments[0].value = arguments[1]; arguments[0].dispatchEvent(new Event("change"))', field, str(value))
        self.idle()

    def row(self, key):
        """The row of a key among the controls, scrolled into view."""
        row = wait(lambda: self.all(f'#controls .row[data-key="{key}"]'), what=f'the control of {key}')[0]
        self.js('arguments[0].scrollIntoView({block: "center"})', row)
        return row

    def open_group(self, path):
        """Opens a group of keys and the groups that contain it."""
        steps = path.split('/')
        for i in range(4, len(steps) + 1):
            group = '/'.join(steps[:i])
            self.js('const d = document.querySelector(`#controls details[data-path="${arguments[0]}"]`); if (d && !d.open) d.open = true', group)
            wait(lambda: self.js('return document.querySelector(`#controls details[data-path="${arguments[0]}"]`)?.open', group), what=group)

    def value(self, path):
        return self.js('return arguments[0].slice(1).split("/").reduce((v, s) => v?.[s], tuneStore.value)', path)

    def set_text(self, text):
        self.js('const t = document.getElementById("text"); t.value = arguments[0]; t.dispatchEvent(new Event("input"))', text)
        wait(lambda: self.text() == text, what='the text')

    def errors(self):
        """The errors in the console of the browser."""
        return [entry for entry in self.driver.get_log('browser') if entry['level'] == 'SEVERE']

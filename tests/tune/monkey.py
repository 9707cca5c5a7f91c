#!/usr/bin/python3
"""Uses the tuning page at random ("monkey test"). usage: monkey.py PROGRAM SOURCE_DIR SECONDS [SEED]

Random controls, text edits, seeks, undo, saves, overlays, versions and reloads of the page. Fails on an error of the
browser or the server, on memory use beyond the bounds, and on child processes that remain."""

import pathlib
import random
import shutil
import sys
import tempfile
import time

from tune_session import Page, Server, browser, wait

PROGRAM, SOURCE, SECONDS = sys.argv[1], pathlib.Path(sys.argv[2]), float(sys.argv[3])
SEED = int(sys.argv[4]) if len(sys.argv) > 4 else 20260101
MOST_SERVER_MB, MOST_PAGE_MB = 1600, 400

# The actions of a user, as a script in the page: sent one by one through WebDriver they would leave the page idle most of the time.
ACTIONS = r'''
const pick = list => list[Math.floor(random() * list.length)];
const fire = (target, type, more = {}) => target?.dispatchEvent(new PointerEvent(type, {bubbles: true, cancelable: true, button: 0, pointerId: 1, ...more}));
const key = (target, k, more = {}) => target?.dispatchEvent(new KeyboardEvent('keydown', {bubbles: true, cancelable: true, key: k, ...more}));
const actions = {
  select: () => pick([...document.querySelectorAll('#tree .item')])?.click(),
  type: () => { const f = pick([...document.querySelectorAll('#controls .number input')]); if (f) { f.value = String(Number(f.value) * (0.5 + random()) || random()); f.dispatchEvent(new Event('change')); } },
  arrow: () => key(pick([...document.querySelectorAll('#controls .track')]), pick(['ArrowLeft', 'ArrowRight'])),
  choose: () => { const s = pick([...document.querySelectorAll('#controls select')]); if (s) { s.value = pick([...s.options]).value; s.dispatchEvent(new Event('change')); } },
  toggle: () => pick([...document.querySelectorAll('#controls input[type=checkbox], #controls summary')])?.click(),
  reset: () => pick([...document.querySelectorAll('#controls .reset')])?.click(),
  seek: () => key(document.body, pick(['ArrowLeft', 'ArrowRight', 'Home', 'End', ' '])),
  undo: () => key(document.body, 'z', {ctrlKey: true, shiftKey: random() < 0.4}),
  save: () => key(document.body, 's', {ctrlKey: true}),
  text: () => { const t = document.getElementById('text'), at = Math.floor(random() * t.value.length); t.value = t.value.slice(0, at) + pick(['1', ' ', '\n', '}', '"', '//']) + t.value.slice(at + Math.floor(random() * 2)); t.dispatchEvent(new Event('input')); },
  mend: () => key(document.body, 'z', {ctrlKey: true}),
  mute: () => pick([...document.querySelectorAll('#tree .item button')])?.click(),
  bar: () => pick([...document.querySelectorAll('#bar button:not(:disabled), #transport button, #compare-tools button, #stage-tools button')])?.click(),
  panel: () => pick([...document.querySelectorAll('#popover button, #popover input')])?.click(),
  zoom: () => document.getElementById('stage').dispatchEvent(new WheelEvent('wheel', {deltaY: random() * 400 - 200, bubbles: true, cancelable: true})),
};
let state = arguments[0] >>> 0;
const random = () => { state = (state * 1664525 + 1013904223) >>> 0; return state / 4294967296; };
const done = arguments[arguments.length - 1], end = performance.now() + arguments[1];
let count = 0;
const next = () => {
  if (performance.now() > end) { done(count); return; }
  const name = pick(Object.keys(actions));
  window.lastAction = name;
  actions[name]();
  count++;
  setTimeout(next, 20 + random() * 120);
};
next();
'''


def main():
    rng = random.Random(SEED)
    folder = pathlib.Path(tempfile.mkdtemp(prefix='offstage-monkey-'))
    scene = folder / 'campfire.json'
    shutil.copy(SOURCE / 'demos/templates/campfire.json', scene)
    server = Server(PROGRAM, scene)
    driver = browser()
    try:
        page = Page(driver, server.address)
        wait(lambda: page.js('return tuneStore.writer === tuneStore.tab'))
        page.js('window.confirm = () => true; navigator.clipboard.readText = () => Promise.resolve(""); navigator.clipboard.writeText = () => Promise.resolve()')
        count, most = 0, 0
        end = time.monotonic() + SECONDS
        while time.monotonic() < end:
            count += driver.execute_async_script(ACTIONS, rng.randrange(2**31), 4000)
            most = max(most, server.memory_mb())
            if most > MOST_SERVER_MB:
                raise AssertionError(f'the server takes {most:.0f} MB')
            held = page.js('return tuneMemory()')
            heap = page.js('return performance.memory.usedJSHeapSize / 1048576')
            if held['bytes'] > held['most'] or held['decoded'] > 12 or heap > MOST_PAGE_MB:
                raise AssertionError(f'the page takes {held}, heap {heap:.0f} MB')
            if rng.random() < 0.2:
                driver.refresh()
                wait(lambda: page.js('return document.body.dataset.ready'))
            # Random texts are often refused, with these codes. Every other error in the console is a failure.
            errors = [e for e in page.errors() if not any(f'status of {code}' in e['message'] for code in (404, 409, 422, 423))]
            if errors:
                raise AssertionError(errors)
            if server.process.poll() is not None:
                raise AssertionError('the server has ended: ' + server.process.stderr.read())
        if server.children():
            raise AssertionError('the server still has child processes')
        code = server.interrupt()
        if code != 130:
            raise AssertionError(f'exit code {code}')
        print(f'{count} actions in {SECONDS:g} s, seed {SEED}: server at most {most:.0f} MB, page {heap:.0f} MB')
    finally:
        driver.quit()
        server.kill()
        shutil.rmtree(folder)


main()

#!/usr/bin/python3
"""Measures how soon the film shows a moved slider, on the real page. usage: tune_latency.py PROGRAM SOURCE_DIR [ROUNDS] [--first]

The sprinkler scene at 640x360. For each round a slider moves one step; the time to the first new picture on the canvas
and the rate of new pictures in the following two seconds are measured inside the page. Prints medians, the processor time
of the server, and the load average, since other work on the machine has an effect. --first: the server and the browser
have priority over all other processes (real-time scheduling, which needs permission), which gives nearly the times of an idle machine."""

import os
import pathlib
import statistics
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent / 'tune'))
from tune_session import Page, Server, browser  # noqa: E402

MEASURE = r'''
const done = arguments[arguments.length - 1], canvas = document.getElementById('film'), track = document.querySelector('#controls .row[data-key="rate"] .track');
const pen = canvas.getContext('2d'), draw = pen.drawImage.bind(pen), before = tuneStore.doc.film, start = performance.now();
let first = 0, count = 0;
pen.drawImage = (...all) => { draw(...all); if (tuneStore.doc.film !== before && canvas.dataset.film !== before) { first ||= performance.now() - start; count++; } };
track.dispatchEvent(new KeyboardEvent('keydown', {key: arguments[0], bubbles: true, cancelable: true}));
const finish = () => { pen.drawImage = draw; done([first, (count - 1) / ((performance.now() - start - first) / 1000)]); };
const poll = () => first && performance.now() - start - first > 2000 || performance.now() - start > 15000 ? finish() : setTimeout(poll, 20);
poll();
'''


def main():
    arguments = [a for a in sys.argv[1:] if a != '--first']
    program, source = arguments[0], pathlib.Path(arguments[1])
    rounds = int(arguments[2]) if len(arguments) > 2 else 9
    if '--first' in sys.argv:
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(5))
    server = Server(program, source / 'demos/scenes/sprinkler.json', '--size', '640x360')
    driver = browser()
    try:
        page = Page(driver, server.address)
        page.wait_for_frame(1, 60)
        page.select('/emitters/0')
        page.js('document.getElementById("scrub").focus()')
        page.js('document.body.dispatchEvent(new KeyboardEvent("keydown", {key: "End", bubbles: true}))')
        results = []
        for i in range(rounds):
            time.sleep(1)
            before = server.cpu_s()
            first, rate = driver.execute_async_script(MEASURE, 'ArrowRight')
            results.append((first, rate, server.cpu_s() - before, os.getloadavg()[0]))
            print('round {}: first picture after {:.0f} ms, then {:.1f} a second; server {:.2f} s of processor time, load {:.1f}'.format(i + 1, *results[-1]), flush=True)
        medians = [statistics.median(column) for column in zip(*results)]
        print('median: first picture after {:.0f} ms, then {:.1f} a second; server {:.2f} s of processor time, load {:.1f}'.format(*medians))
    finally:
        driver.quit()
        server.kill()


main()

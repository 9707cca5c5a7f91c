#!/usr/bin/python3
"""How soon a slider shows in the film, through the real page. usage: tune_latency.py PROGRAM SOURCE_DIR [ROUNDS]

The sprinkler scene at 640x360. For each round a slider moves one step; the time to the first new picture on the canvas
and the rate of new pictures in the following two seconds are measured inside the page. Prints medians."""

import pathlib
import statistics
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent / 'tune'))
from sitting import Page, Server, browser, wait  # noqa: E402

MEASURE = r'''
const done = arguments[arguments.length - 1], canvas = document.getElementById('film'), track = document.querySelector('#controls .row[data-key="rate"] .track');
const pen = canvas.getContext('2d'), draw = pen.drawImage.bind(pen), before = tuneStore.doc.film, start = performance.now();
let first = 0, count = 0;
pen.drawImage = (...all) => { draw(...all); if (tuneStore.doc.film !== before && canvas.dataset.film !== before) { first ||= performance.now() - start; count++; } };
track.dispatchEvent(new KeyboardEvent('keydown', {key: arguments[0], bubbles: true, cancelable: true}));
const finish = () => { pen.drawImage = draw; done([first, count / ((performance.now() - start - first) / 1000)]); };
const poll = () => first && performance.now() - start - first > 2000 || performance.now() - start > 15000 ? finish() : setTimeout(poll, 20);
poll();
'''


def main():
    program, source = sys.argv[1], pathlib.Path(sys.argv[2])
    rounds = int(sys.argv[3]) if len(sys.argv) > 3 else 9
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
            results.append(driver.execute_async_script(MEASURE, 'ArrowRight'))
            print(f'round {i + 1}: first picture after {results[-1][0]:.0f} ms, then {results[-1][1]:.1f} a second', flush=True)
        print(f'median: first picture after {statistics.median(r[0] for r in results):.0f} ms, '
              f'then {statistics.median(r[1] for r in results):.1f} a second')
    finally:
        driver.quit()
        server.kill()


main()

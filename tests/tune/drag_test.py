#!/usr/bin/python3
"""Pictures of the tuning page during a drag, in a real browser.   usage: drag_test.py PROGRAM SOURCE_DIR [unittest arguments]

Runs alone, because it counts the pictures that the program draws while the pointer moves.
"""

import sys
import unittest

from page_case import Case, SCENE


class Drag(Case):
    def changes_and_films_of_a_drag(self, element):
        """Moves the pointer for about 3 s; counts the changes that start a film, and the films that it shows."""
        return self.driver.execute_async_script('''
            const [target, done] = arguments, box = target.getBoundingClientRect(), x = box.left + box.width / 2, y = box.top + box.height / 2;
            const canvas = document.getElementById('film'), films = new Set([canvas.dataset.film]), fetch_ = window.fetch;
            const start = performance.now();
            let changes = 0, moves = 0;
            const starts = (url, {body} = {}) => /edit$/.test(url) || /view$/.test(url) && 'camera' in JSON.parse(body);
            window.fetch = (...all) => { changes += starts(...all); return fetch_(...all); };
            target.setPointerCapture = () => {};
            const send = (type, dx) => target.dispatchEvent(new PointerEvent(type, {clientX: x + dx, clientY: y, button: 0, pointerId: 1, bubbles: true}));
            send('pointerdown', 0);
            const timer = setInterval(() => {
              films.add(canvas.dataset.film);
              send('pointermove', 5 + ++moves % 40);
              if (performance.now() - start < 3000) return;
              clearInterval(timer);
              send('pointerup', 5 + moves % 40);
              window.fetch = fetch_;
              done([changes, films.size - 1]);
            }, 16);''', element)

    def test_the_film_follows_the_pointer_during_a_drag(self):
        self.page.set_text(SCENE.replace('[320, 180]', '[640, 360]'))  # drawing takes longer than showing
        self.page.wait_for_frame(1)
        self.page.select('/emitters/0')
        for element in (self.page.row('rate').find_element('css selector', '.track'), self.page.find('#stage')):
            changes, films = self.changes_and_films_of_a_drag(element)
            self.settle()
            self.assertGreater(films, 2)
            self.assertGreater(2 * films, changes, 'most changes of a drag had a picture')


if __name__ == '__main__':
    unittest.main(argv=[sys.argv[0], *sys.argv[3:]], verbosity=2)

#!/usr/bin/python3
"""The tuning page in a real browser. usage: page_test.py PROGRAM SOURCE_DIR [unittest arguments]"""

import json
import os
import socket
import subprocess
import sys
import time
import unittest
import urllib.error
import urllib.request

from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.keys import Keys

from page_case import Case, PROGRAM, SCENE
from tune_session import Page, Server, set_size, wait


def get(address, headers=None):
    """Status and text of a request."""
    try:
        with urllib.request.urlopen(urllib.request.Request(address, headers=headers or {}), timeout=10) as answer:
            return answer.status, answer.read().decode('utf-8', 'replace')
    except urllib.error.HTTPError as error:
        return error.code, error.read().decode('utf-8', 'replace')


class Editing(Case):
    def test_a_typed_value_changes_the_picture_and_only_its_own_bytes(self):
        page = self.page
        page.wait_for_frame(1)
        page.js('document.getElementById("scrub").focus()')
        self.keys(Keys.END)
        page.wait_for_frame(20)
        before = page.pixels()
        page.select('/emitters/0')
        page.type_value('rate', 'rate', 2500)
        page.wait_for_frame(20)
        self.assertNotEqual(before, page.pixels())
        self.assertEqual(page.text(), SCENE.replace('4.0e2', '2500'))
        self.assertEqual(self.scene.read_text(), SCENE, 'nothing is saved before it is asked for')
        self.command('s')
        self.assertEqual(self.scene.read_bytes(), SCENE.replace('4.0e2', '2500').encode())
        self.assertEqual(page.errors(), [])

    def test_a_missing_key_is_inserted_with_the_indentation_of_its_object(self):
        self.page.select('/emitters/0')
        self.page.type_value('lifespan', 'lifespan', 1.5)
        self.assertIn('     "look": {"color": "#4080ff"},\n     "lifespan": 1.5}', self.page.text())
        self.page.click('#controls .row[data-key="lifespan"] .reset')
        self.page.idle()
        self.assertEqual(self.page.text(), SCENE)

    def test_one_drag_is_one_undo_step_and_undo_brings_the_frames_back_at_once(self):
        page = self.page
        page.wait_for_frame(1)
        film = page.film()
        page.select('/emitters/0')
        track = page.find('#controls .row[data-key="rate"] .track')
        page.js('arguments[0].scrollIntoView({block: "center"})', track)
        actions = ActionChains(self.driver).move_to_element(track).click_and_hold()
        for _ in range(6):
            actions.move_by_offset(6, 0)
        actions.release().perform()
        page.idle()
        self.assertNotEqual(page.text(), SCENE)
        self.command('z')
        self.assertEqual(page.text(), SCENE)
        self.assertEqual(page.film(), film)
        page.wait_for_frame(1, seconds=10)
        self.command(Keys.SHIFT, 'z')
        self.assertNotEqual(page.text(), SCENE)

    def test_a_text_with_an_error_keeps_the_last_film_and_shows_the_place(self):
        page = self.page
        page.wait_for_frame(1)
        film = page.film()
        page.set_text(SCENE.replace('"radius": 0.03', '"radius": -1'))
        self.assertEqual(page.film(), film)
        self.assertIn('line 9', page.find('#problems').text)
        self.assertEqual(page.all('.gutter .bad')[0].text, '9')
        page.select('/emitters/0')
        self.assertIn('must be greater than', page.find('#controls .row[data-key="radius"] .error').text)
        page.set_text(SCENE.replace('"radius": 0.03', '"radius": 0.03,,'))
        self.assertTrue(page.find('#problems').is_displayed())
        page.set_text(SCENE)
        self.assertFalse(page.find('#problems').is_displayed())
        self.assertEqual(page.all('.gutter .bad'), [])

    def test_a_preset_is_added_and_its_parts_can_be_changed(self):
        page = self.page
        page.click('#add-button')
        wait(lambda: page.all('[data-preset="fountain"]'))
        page.click('[data-preset="fountain"]')
        wait(lambda: page.js('return tuneStore.value.effects?.[0]?.preset') == 'fountain')
        wait(lambda: page.js('const d = [...document.querySelectorAll("#controls details")].find(d => d.textContent.includes("Jet")); if (d) d.open = true; return !!d'))
        wait(lambda: page.all('[data-path="/effects/0/overrides/jet/rate"]'))
        page.type_value('rate', 'rate', 500)
        self.assertIn('"overrides": {"jet": {"rate": 500}}', page.text())
        self.assertEqual(page.js('return tuneStore.doc.errors'), [])

    def presets_arrive(self):
        self.driver.execute_async_script("const done = arguments[0]; import('./page/store.js').then(m => { m.store.presets = window.presets; m.emit('presets'); done(); })")

    def without_presets(self):
        wait(lambda: self.page.js('return tuneStore.presets.length'))
        self.page.js('window.presets = tuneStore.presets; tuneStore.presets = []')

    def test_presets_that_arrive_late_are_added_to_the_open_list(self):
        page = self.page
        self.without_presets()
        page.click('#add-button')
        self.assertEqual(page.all('[data-preset]'), [])
        self.presets_arrive()
        page.click('[data-preset="fountain"]')
        wait(lambda: page.js('return tuneStore.value.effects?.[0]?.preset') == 'fountain')

    def test_presets_that_arrive_late_only_redraw_controls_that_show_them(self):
        page = self.page
        page.set_text(SCENE.replace('"bodies"', '"effects": [{"preset": "fountain", "position": [0, 0, 3]}],\n  "bodies"', 1))
        self.without_presets()
        page.select('/emitters/0')
        row = page.row('rate')
        self.presets_arrive()
        self.assertTrue(row.is_displayed())  # an error if the row was removed
        self.without_presets()
        page.select('/effects/0')
        self.assertEqual(page.all('[data-path="/effects/0/overrides/jet"]'), [])
        self.presets_arrive()
        self.assertEqual(len(page.all('[data-path="/effects/0/overrides/jet"]')), 1)

    def test_the_controls_are_kept_when_the_event_stream_connects(self):
        self.page.select('/emitters/0')
        row = self.page.row('rate')
        self.driver.execute_async_script("const done = arguments[0]; import('./page/store.js').then(m => { m.on('writer', done); m.emit('connected'); })")
        self.assertTrue(row.is_displayed())  # an error if the row was removed


class EmptyStage(Case):
    scene_text = '{\n  "version": 1\n}\n'

    def test_a_fountain_is_built_from_a_preset_on_an_empty_stage(self):
        page = self.page
        self.assertIn('The scene has no objects yet', page.find('#controls').text)
        page.wait_for_frame(1)
        page.js('document.querySelector("#controls .empty button").click()')
        self.assertTrue(wait(lambda: page.js('return document.querySelector(`[data-preset="fountain"] img`)?.naturalWidth')), 'its picture')
        page.click('[data-preset="fountain"]')
        wait(lambda: page.value('/effects/0/preset') == 'fountain')
        wait(lambda: page.js('return tuneStore.selection[0]') == '/effects/0')
        page.wait_for_frame(1)
        self.command('s')
        self.assertEqual(json.loads(self.scene.read_text()), {'version': 1, 'effects': [{'preset': 'fountain', 'position': [0, 0, 0]}]})
        self.assertEqual(page.errors(), [])


class Looking(Case):
    def test_the_state_on_the_page_is_that_of_simulate(self):
        page = self.page
        wait(lambda: page.all('#final-state'), 60, 'the whole film')
        told = subprocess.run([PROGRAM, 'simulate', str(self.scene), '-q'], capture_output=True, check=True, text=True)
        self.assertEqual(page.find('#final-state').get_attribute('data-hash'), json.loads(told.stdout)['state_hash'])

    def test_the_visible_frame_is_refined_while_nothing_changes(self):
        self.page.set_text(SCENE.replace('[320, 180]', '[640, 360]'))  # so that the first picture is seen
        wait(lambda: self.page.js('return document.getElementById("film").dataset.detail') == 'preview', 60)
        wait(lambda: self.page.js('return document.getElementById("film").dataset.detail') == 'final', 60)

    def test_playing_and_stepping_make_no_undo_steps(self):
        page = self.page
        wait(lambda: page.js('return tuneStore.film.phase') == 'complete', 60)
        page.js('document.getElementById("stage").focus()')
        self.keys(Keys.ARROW_RIGHT, Keys.ARROW_RIGHT)
        page.wait_for_frame(3)
        self.keys(' ')
        wait(lambda: page.js('return tuneStore.frame') > 5)
        self.keys(' ')
        self.assertFalse(page.js('return tuneStore.playing'))
        self.assertFalse(page.find('#undo').is_enabled())

    def test_a_click_selects_the_object_under_the_pointer(self):
        page = self.page
        page.wait_for_frame(1)
        box = page.find('#film').rect
        ball = (0.5, 0.5 + (0.8 - 0.4) / 5 / (2 * 0.36397))  # where the camera sees the ball
        ActionChains(self.driver).move_to_element_with_offset(
            page.find('#film'), int((ball[0] - 0.5) * box['width']), int((ball[1] - 0.5) * box['height'])).click().perform()
        wait(lambda: page.js('return tuneStore.selection') == ['/bodies/1'], 10, 'the ball')

    def test_orbiting_is_a_view_until_it_is_written_to_the_scene(self):
        page = self.page
        page.wait_for_frame(1)
        before = page.pixels()
        film = page.film()
        stage = page.find('#stage')
        ActionChains(self.driver).move_to_element_with_offset(stage, -200, 40).click_and_hold().move_by_offset(80, 10).release().perform()
        wait(lambda: page.film() != film)
        page.wait_for_frame(1)
        wait(lambda: page.pixels() != before, what='another view')
        self.assertEqual(page.text(), SCENE)
        self.assertTrue(page.js('return tuneStore.doc.saved'))
        page.click('#camera-write')
        wait(lambda: page.text() != SCENE)
        self.assertNotEqual(page.js('return tuneStore.value.camera.eye'), [0, 1.5, 5])

    def test_versions_are_compared_side_by_side_as_a_wipe_and_alternating(self):
        page = self.page
        page.wait_for_frame(1)
        page.click('#pin')
        wait(lambda: page.js('return tuneStore.doc.pinned'))
        page.set_text(SCENE.replace('[0, 1.5, 5]', '[0, 3, 3]'))
        page.wait_for_frame(1)
        page.click('[data-mode="off"]')
        alone = wait(page.pixels)
        page.click('[data-mode="wipe"]')
        wait(lambda: page.pixels() != alone, 10, 'the wipe')
        page.click('[data-mode="side"]')
        wait(lambda: page.js('return document.getElementById("film").width') == 640)
        page.click('[data-mode="turns"]')
        seen = set()
        wait(lambda: seen.add(page.pixels()) or len(seen) > 1, 10, 'both in turns')
        page.click('#versions-button')
        wait(lambda: len(page.all('.version')) == 2)

    def test_a_selected_object_is_dragged_in_its_plane(self):
        page = self.page
        page.wait_for_frame(1)
        page.select('/bodies/1')
        # The marks are rebuilt with each frame, so an element could be gone by now; its position remains valid.
        at = wait(lambda: page.js('''const ring = document.querySelector("#marks .handle")?.getBoundingClientRect(), stage = document.getElementById("stage").getBoundingClientRect();
            return ring && [ring, stage].map(r => [r.x + r.width / 2, r.y + r.height / 2]).reduce((a, b) => [Math.round(a[0] - b[0]), Math.round(a[1] - b[1])])'''))
        ActionChains(self.driver).move_to_element_with_offset(page.find('#stage'), *at).click_and_hold() \
            .move_by_offset(40, 0).move_by_offset(40, 0).release().perform()
        self.settle()
        x, y, z = page.value('/bodies/1/position')
        self.assertGreater(x, 0.3)
        self.assertAlmostEqual(y, 0.4, delta=1e-3)
        self.command('z')
        self.assertEqual(page.text(), SCENE, 'one drag is one undo step')

    def test_a_newer_change_ends_the_older_run(self):
        page = self.page
        page.set_text(SCENE.replace('"duration": 1', '"duration": 60').replace('4.0e2', '9000'))
        page.wait_for_frame(1)
        page.set_text(SCENE.replace('4.0e2', '30'))
        wait(lambda: page.js('return tuneStore.film.phase') == 'complete', 60)
        told = subprocess.run([PROGRAM, 'simulate', '-', '-q'], input=page.text(), capture_output=True, check=True, text=True)
        self.assertEqual(page.find('#final-state').get_attribute('data-hash'), json.loads(told.stdout)['state_hash'])

    def test_figures_follow_the_playhead_and_a_click_on_a_plot_seeks(self):
        page = self.page
        wait(lambda: page.js('return tuneStore.film.phase') == 'complete', 60)
        particles = page.find('#plots figure')
        ActionChains(self.driver).move_to_element(particles.find_element('css selector', 'canvas')).click().perform()
        frame = wait(lambda: page.js('return tuneStore.frame > 5 && tuneStore.frame'))
        told = page.js('return fetch(tuneStore.base + "api/figures").then(r => r.json())')[frame - 1]
        self.assertGreater(told['particles'], 0)
        wait(lambda: particles.find_element('css selector', '.value').text == str(told['particles']), 10)
        page.js('[...document.querySelectorAll("#facts button")].find(b => b.textContent === "Statistics").click()')
        self.assertIn('state_hash', page.find('#popover .statistics').text)

    def test_a_warning_leads_to_its_object_and_line(self):
        page = self.page
        page.set_text(SCENE.replace('"version": 1,', '"version": 1, "materials": [{"name": "unused"}],')
                      .replace('"radius": 0.4}, "position"', '"radius": 0.4}, "velocity": [3e4, 0, 0], "position"'))
        # The list is rebuilt with each frame, so an element could be gone by now; its texts remain valid.
        texts = 'return [...document.querySelectorAll("#facts .notes .problem")].map(p => p.textContent)'
        wait(lambda: len(page.js(texts)) == 2, 60, 'the warnings')
        shown = page.js(texts)
        self.assertIn('line 3', shown[0])
        self.assertIn("'unused'", shown[0])
        self.assertIn('line 6', shown[1])
        self.assertIn("'ball'", shown[1])
        page.js('document.querySelectorAll("#facts .notes .problem")[1].click()')
        self.assertEqual(page.js('return tuneStore.selection'), ['/bodies/1'])

    def test_an_earlier_version_can_be_restored_and_shows_its_picture(self):
        page = self.page
        page.wait_for_frame(1)
        page.set_text(SCENE.replace('4.0e2', '90'))
        page.wait_for_frame(1)
        page.click('#versions-button')
        first = wait(lambda: len(page.all('.version')) == 2 and page.all('.version')[1])
        wait(lambda: page.js('return arguments[0].querySelector("img")?.naturalWidth', first) == 320, 10, 'its picture')
        page.js('arguments[0].querySelector("button").click()', first)
        wait(lambda: page.text() == SCENE)

    def test_overlays_are_drawn_and_do_not_change_the_scene(self):
        page = self.page
        wait(lambda: page.js('return tuneStore.film.phase') == 'complete', 60)
        film = page.film()
        page.click('#overlays-button')
        page.click('[data-overlay="velocities"]')
        wait(lambda: page.film() != film)
        page.click('[data-overlay="emitters"]')
        wait(lambda: page.all('#marks .emitter'))
        self.assertEqual(page.text(), SCENE)

    def test_a_sweep_shows_a_picture_per_value_and_a_click_sets_the_value(self):
        page = self.page
        page.wait_for_frame(1)
        page.select('/emitters/0')
        page.js('document.querySelector(`#controls .row[data-key="rate"] [aria-label^=Sweep]`).click()')
        field = page.find('#popover .text')
        field.clear()
        field.send_keys('100, 900', Keys.ENTER)
        wait(lambda: len(page.all('.cell img')) == 2, 60, 'two pictures')
        page.all('.cell')[1].click()
        wait(lambda: page.text() == SCENE.replace('4.0e2', '900'))


class TheFile(Case):
    def test_a_change_of_the_file_is_loaded_if_the_page_has_no_changes(self):
        other = SCENE.replace('4.0e2', '77')
        new = self.folder / 'new'
        new.write_text(other)
        os.replace(new, self.scene)  # as editors save files
        wait(lambda: self.page.text() == other, 10)
        self.assertTrue(self.page.js('return tuneStore.doc.saved'))

    def test_a_change_of_the_file_is_not_overwritten_by_changes_on_the_page(self):
        page = self.page
        page.set_text(SCENE.replace('4.0e2', '500'))
        other = SCENE.replace('4.0e2', '77')
        self.scene.write_text(other)
        wait(lambda: page.find('#banner').is_displayed(), 10)
        self.command('s')
        self.assertEqual(self.scene.read_text(), other)
        page.click('#show-both')
        self.assertIn('500', page.find('.both .differs').text)
        self.keys(Keys.ESCAPE)
        page.click('#keep-own')
        page.idle()
        self.command('s')
        self.assertEqual(self.scene.read_text(), SCENE.replace('4.0e2', '500'))

    def test_windows_line_ends_are_kept(self):
        crlf = SCENE.replace('\n', '\r\n').encode()
        self.scene.write_bytes(crlf)
        wait(lambda: '\r\n' in self.page.text(), 10)
        self.page.select('/emitters/0')
        self.page.type_value('rate', 'rate', 12)
        self.command('s')
        self.assertEqual(self.scene.read_bytes(), crlf.replace(b'4.0e2', b'12'))


class Connections(Case):
    def test_a_second_tab_is_read_only_until_it_takes_over(self):
        first = self.driver.current_window_handle
        self.driver.switch_to.new_window('tab')
        second = Page(self.driver, self.server.address)
        wait(lambda: second.find('#banner').is_displayed())
        status = second.js('''return fetch(tuneStore.base + 'api/undo', {method: 'POST', body: '{}', headers: {'Content-Type': 'application/json', 'X-Tab': tuneStore.tab}}).then(r => r.status)''')
        self.assertEqual(status, 423)
        second.click('#banner button')
        wait(lambda: second.js('return tuneStore.writer === tuneStore.tab'))
        second.set_text(SCENE.replace('4.0e2', '60'))
        self.driver.switch_to.window(first)
        wait(lambda: self.page.text() == SCENE.replace('4.0e2', '60'))
        self.driver.switch_to.window(self.driver.window_handles[1])
        self.driver.close()
        self.driver.switch_to.window(first)

    def test_eight_tabs_work_and_a_ninth_is_refused(self):
        first = self.driver.current_window_handle
        for _ in range(7):
            self.driver.switch_to.new_window('tab')
            Page(self.driver, self.server.address)
            wait(lambda: self.driver.execute_script('return tuneStore.writer !== ""'))
        self.driver.switch_to.new_window('tab')
        self.driver.get(self.server.address)
        self.assertIn('more are not allowed', self.driver.page_source)
        for handle in self.driver.window_handles:
            if handle != first:
                self.driver.switch_to.window(handle)
                self.driver.close()
        self.driver.switch_to.window(first)
        wait(lambda: get(self.server.address)[0] == 200, 10, 'room after tabs were closed')

    def test_twenty_reloads_leave_one_stream(self):
        for _ in range(20):
            self.driver.refresh()
        wait(lambda: self.page.js('return document.body.dataset.ready'))
        wait(lambda: self.page.js('return tuneStore.writer === tuneStore.tab'), 10)
        self.page.wait_for_frame(1)

    def test_the_end_of_the_server_is_reported_and_unsaved_text_is_recovered(self):
        port = self.server.address.split(':')[2].split('/')[0]
        changed = SCENE.replace('4.0e2', '61')
        self.page.set_text(changed)
        self.server.kill()
        wait(lambda: self.page.find('#gone').is_displayed(), 15)
        self.server = Server(PROGRAM, self.scene, '--port', port)
        self.page.open(self.server.address)
        wait(lambda: self.page.all('.toast button'), 10)
        self.page.click('.toast button')
        wait(lambda: self.page.text() == changed)

    def test_ctrl_c_while_frames_stream_ends_everything(self):
        self.page.set_text(SCENE.replace('4.0e2', '3000'))
        self.assertEqual(self.server.children(), [])
        start = time.monotonic()
        self.assertEqual(self.server.interrupt(), 130)
        self.assertLess(time.monotonic() - start, 5)


class Safety(Case):
    def test_the_token_the_host_and_the_origin_are_checked(self):
        address = self.server.address
        port = address.split(':')[2].split('/')[0]
        self.assertEqual(get(f'http://127.0.0.1:{port}/')[0], 403)
        self.assertEqual(get(f'http://127.0.0.1:{port}/{"0" * 32}/api/state')[0], 403)
        self.assertEqual(get(address + 'api/state', {'Host': f'evil.example:{port}'})[0], 403)
        self.assertEqual(get(address + 'api/state', {'Origin': 'http://evil.example'})[0], 403)
        self.assertEqual(get(address + 'api/state')[0], 200)
        self.assertEqual(get(address + 'page/../../../etc/passwd')[0], 404)
        self.assertEqual(get(address + 'api/undo')[0], 404, 'a GET changes nothing')

    def test_changes_need_json(self):
        request = urllib.request.Request(self.server.address + 'api/undo', data=b'{}', headers={'Content-Type': 'text/plain'})
        with self.assertRaises(urllib.error.HTTPError) as refused:
            urllib.request.urlopen(request, timeout=10)
        self.assertEqual(refused.exception.code, 415)

    def test_the_server_listens_on_the_loopback_interface_only(self):
        with socket.socket() as other:
            other.settimeout(2)
            outside = subprocess.run(['hostname', '-I'], capture_output=True, text=True).stdout.split()
            outside = [a for a in outside if not a.startswith('127.') and ':' not in a]
            if not outside:
                self.skipTest('this machine has no other address')
            port = int(self.server.address.split(':')[2].split('/')[0])
            self.assertNotEqual(other.connect_ex((outside[0], port)), 0)


class Narrow(Case):
    def test_a_narrow_window_shows_one_panel_at_a_time(self):
        set_size(self.driver, 480, 900)
        try:
            self.page.click('[data-show="text"]')
            self.assertTrue(self.page.find('#right').is_displayed())
            self.assertFalse(self.page.find('#left').is_displayed())
            self.assertLessEqual(self.page.js('return document.documentElement.scrollWidth'), 480)
        finally:
            set_size(self.driver, 1280, 800)


if __name__ == '__main__':
    unittest.main(argv=[sys.argv[0], *sys.argv[3:]], verbosity=2)

#!/usr/bin/python3
"""Every kind of control of the tuning page, in a real browser. usage: controls_test.py PROGRAM SOURCE_DIR [unittest arguments]"""

import json
import math
import sys
import time
import unittest

from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.keys import Keys

from page_case import Case, SCENE
from tune_session import set_dark, wait

CURVES = SCENE.replace('"look": {"color": "#4080ff"}', '"look": {"color": "#4080ff", "size_over_age": [[0, 1], [1, 2]],\n'
                       '       "color_over_age": [[0, [1, 1, 1, 1]], [1, [1, 0, 0, 0]]]}')
MATERIALS = SCENE.replace('  "bodies"', '  "materials": [{"name": "grey"}, {"name": "red", "color": "#ff0000"}],\n  "bodies"')


class Numbers(Case):
    def drag(self, element, distance, steps=6, key=None):
        actions = ActionChains(self.driver).move_to_element(element)
        if key:
            actions.key_down(key)
        actions.click_and_hold()
        for _ in range(steps):
            actions.move_by_offset(distance / steps, 0)
        actions.release()
        if key:
            actions.key_up(key)
        actions.perform()
        self.settle()

    def track(self, key):
        return self.page.row(key).find_element('css selector', '.track')

    def test_shift_drags_ten_times_finer(self):
        self.page.select('/emitters/0')
        ratios = []
        for key in (None, Keys.SHIFT):
            self.drag(self.track('rate'), 30, key=key)
            ratios.append(math.log(self.page.value('/emitters/0/rate') / 400))
            self.command('z')
            self.assertEqual(self.page.text(), SCENE)
        self.assertAlmostEqual(ratios[0] / ratios[1], 10, delta=1.5)

    def test_arrows_on_a_logarithmic_slider_move_by_a_fixed_ratio(self):
        self.page.select('/emitters/0')
        self.page.js('arguments[0].focus()', self.track('rate'))
        self.keys(Keys.ARROW_RIGHT)
        self.settle()
        self.assertEqual(self.page.value('/emitters/0/rate'), 420)
        self.page.type_value('rate', 'rate', 4000)
        self.page.js('arguments[0].focus()', self.track('rate'))
        self.keys(Keys.ARROW_RIGHT)
        self.settle()
        self.assertEqual(self.page.value('/emitters/0/rate'), 4200)

    def test_typed_values_exceed_the_slider_but_not_the_schema(self):
        page = self.page
        page.select('/emitters/0')
        reach = float(self.track('rate').get_attribute('aria-valuemax'))
        page.type_value('rate', 'rate', reach * 3)
        self.assertEqual(page.value('/emitters/0/rate'), reach * 3)
        page.type_value('radius', 'radius', -5)
        self.assertGreater(page.value('/emitters/0/radius'), 0)
        self.assertEqual(page.js('return tuneStore.doc.errors'), [])

    def test_defaults_are_dimmed_and_a_key_can_be_reset(self):
        page = self.page
        page.select('/emitters/0')
        self.assertIn('default', page.row('lifespan').get_attribute('class'))
        self.assertNotIn('default', page.row('rate').get_attribute('class'))
        page.js('document.querySelector("#controls .row[data-key=rate] .reset").click()')
        self.settle()
        self.assertNotIn('"rate"', page.text())
        self.assertIn('default', page.row('rate').get_attribute('class'))

    def test_a_number_varies_in_four_ways(self):
        page = self.page
        page.select('/emitters/0')
        for mode, keys in (('constant', None), ('range', ['range']), ('spread', ['deviation', 'mean']), ('curve', ['curve'])):
            page.js('const s = document.querySelector("#controls .row[data-key=speed] select.mode"); s.value = arguments[0]; s.dispatchEvent(new Event("change"))', mode)
            self.settle()
            value = page.value('/emitters/0/speed')
            self.assertEqual(sorted(value) if isinstance(value, dict) else None, keys)
            self.assertEqual(page.js('return tuneStore.doc.errors'), [])

    def test_the_new_seed_button_stays_in_its_place_while_the_film_is_simulated(self):
        page = self.page
        place = wait(lambda: page.all('#new-seed'), what='the button')[0].rect
        wait(lambda: 'Film complete' in page.find('#facts').text, what='the end of the film')
        self.assertEqual(page.find('#new-seed').rect, place)

    def test_the_new_seed_button_changes_the_seed_and_the_film(self):
        page = self.page
        page.wait_for_frame(1)
        button = page.find('#new-seed')
        wait(lambda: button.is_enabled(), what='permission to write')
        film = page.film()
        button.click()
        wait(lambda: page.film() != film)
        self.assertEqual(page.find('#new-seed'), button, 'a button that is replaced loses clicks')
        self.assertIn('"seed": ', page.text())
        self.command('z')
        self.assertEqual(page.text(), SCENE)


class Curves(Case):
    scene_text = CURVES

    def setUp(self):
        super().setUp()
        self.page.select('/emitters/0')
        self.page.open_group('/emitters/0/look')

    def move_point(self, selector, dx, dy):
        ActionChains(self.driver).move_to_element(self.page.all(selector)[-1]).click_and_hold() \
            .move_by_offset(dx / 2, dy / 2).move_by_offset(dx / 2, dy / 2).release().perform()
        self.settle()

    def test_a_point_of_a_curve_is_dragged_added_and_removed(self):
        page, path = self.page, '/emitters/0/look/size_over_age'
        page.row('size_over_age')
        self.move_point('[data-key="size_over_age"] .dot', -30, 20)
        moved = page.value(path)
        self.assertLess(moved[1][0], 1)
        self.assertLess(moved[1][1], 2)
        self.command('z')
        self.assertEqual(page.text(), CURVES, 'one drag is one undo step')
        svg = page.row('size_over_age').find_element('css selector', 'svg')
        ActionChains(self.driver).move_to_element(svg).double_click().perform()
        self.settle()
        self.assertEqual(len(page.value(path)), 3)
        page.js('document.querySelector("[data-key=size_over_age] svg").focus()')
        self.keys(Keys.DELETE)
        self.settle()
        self.assertEqual(page.value(path), [[0, 1], [1, 2]])

    def test_a_colour_over_age_is_dragged_and_changed(self):
        page, path = self.page, '/emitters/0/look/color_over_age'
        page.row('color_over_age')
        self.move_point('[data-key="color_over_age"] .stop', -40, 0)
        self.assertLess(page.value(path)[1][0], 1)
        page.js('const c = document.querySelector("[data-key=color_over_age] input[type=color]"); c.value = "#00ff00"; c.dispatchEvent(new Event("input")); c.dispatchEvent(new Event("change"))')
        self.settle()
        self.assertEqual([round(x, 3) for x in page.value(path)[1][1][:3]], [0, 1, 0])
        self.assertEqual(page.js('return tuneStore.doc.errors'), [])

    def test_a_curve_is_copied_as_scene_json_and_pasting_replaces(self):
        page = self.page
        page.row('size_over_age')
        page.js('''const data = new DataTransfer(), svg = document.querySelector("[data-key=size_over_age] svg"); svg.focus();
            svg.dispatchEvent(new ClipboardEvent("copy", {clipboardData: data, bubbles: true, cancelable: true})); window.copied = data.getData("text/plain")''')
        self.assertEqual(json.loads(page.js('return copied')), [[0, 1], [1, 2]])
        page.js('''const data = new DataTransfer(); data.setData("text/plain", "[[0, 3], [0.5, 1], [1, 0]]");
            document.querySelector("[data-key=size_over_age] svg").dispatchEvent(new ClipboardEvent("paste", {clipboardData: data, bubbles: true, cancelable: true}))''')
        self.settle()
        self.assertEqual(page.value('/emitters/0/look/size_over_age'), [[0, 3], [0.5, 1], [1, 0]])

    def test_a_value_of_another_form_is_shown_as_json(self):
        page = self.page
        page.set_text(CURVES.replace('[[0, 1], [1, 2]]', '{"curve": 7}'))
        self.assertEqual(len(page.row('size_over_age').find_elements('css selector', 'textarea.json')), 1)
        self.assertIn('must be', page.row('size_over_age').find_element('css selector', '.error').text)
        page.set_text(CURVES)
        self.assertEqual(len(page.row('size_over_age').find_elements('css selector', 'svg')), 1)
        self.assertEqual(page.errors(), [])


class Choices(Case):
    scene_text = MATERIALS

    def choose(self, key, value):
        self.page.js('const s = document.querySelector(`#controls .row[data-key="${arguments[0]}"] select`); s.value = arguments[1]; s.dispatchEvent(new Event("change"))', key, value)
        self.settle()

    def test_names_of_other_objects_are_drop_down_lists_that_follow_a_rename(self):
        page = self.page
        page.select('/bodies/1')
        options = page.js('return [...document.querySelector("#controls .row[data-key=material] select").options].map(o => o.value)')
        self.assertEqual(options, ['', 'grey', 'red'])
        self.choose('material', 'red')
        self.assertEqual(page.value('/bodies/1/material'), 'red')
        page.select('/materials/1')
        page.js('document.querySelector("#tree .chosen").focus()')
        self.keys(Keys.F2)
        self.keys('crimson', Keys.ENTER)
        wait(lambda: page.value('/bodies/1/material') == 'crimson')
        self.assertEqual(page.js('return tuneStore.doc.errors'), [])

    def test_several_objects_are_changed_together(self):
        page = self.page
        page.select('/bodies/0')
        page.js('document.querySelector(`#tree [data-path="/bodies/1"]`).dispatchEvent(new MouseEvent("click", {ctrlKey: true, bubbles: true}))')
        self.assertIn('2 objects', page.find('#controls h2').text)
        self.choose('material', 'grey')
        self.assertEqual([page.value(f'/bodies/{i}/material') for i in (0, 1)], ['grey', 'grey'])
        self.command('z')
        self.assertEqual(page.text(), MATERIALS)

    def test_enums_booleans_vectors_orientation_and_colours(self):
        page = self.page
        page.select('/bodies/1')
        self.choose('motion', 'static')
        page.js('document.querySelector("#controls .row[data-key=collides] input").click()')
        self.settle()
        page.type_value('position', 'position x', 1.25)
        page.type_value('orientation', 'orientation angle', 30)
        self.assertEqual(page.value('/bodies/1'), {'name': 'ball', 'shape': {'type': 'sphere', 'radius': 0.4}, 'position': [1.25, 0.4, 0],
                                                   'motion': 'static', 'collides': False, 'orientation': {'axis': [0, 1, 0], 'angle_deg': 30}})
        page.select('/materials/1')
        page.js('const c = document.querySelector("#controls .row[data-key=color] input[type=color]"); c.value = "#0000ff"; c.dispatchEvent(new Event("input")); c.dispatchEvent(new Event("change"))')
        self.settle()
        self.assertEqual(page.value('/materials/1/color'), '#0000ff')
        self.assertEqual(page.js('return tuneStore.doc.errors'), [])

    def test_the_search_finds_keys_that_the_text_does_not_have(self):
        page = self.page
        page.select('/emitters/0')
        page.js('document.body.focus()')
        page.js('const s = document.getElementById("search"); s.value = "linear drag"; s.dispatchEvent(new Event("input"))')
        self.assertEqual([r.get_attribute('data-key') for r in page.all('#controls .row')], ['linear_drag'])
        self.assertEqual(page.js('return [...document.querySelectorAll("#tree .item")].map(i => i.dataset.path)'), ['/emitters/0', '/bodies/0', '/bodies/1'])


class Objects(Case):
    def test_objects_are_duplicated_renamed_muted_and_deleted(self):
        page = self.page
        page.select('/emitters/0')
        page.js('document.querySelector("#tree .chosen").focus()')
        self.command('d')
        wait(lambda: page.js('return tuneStore.selection[0]') == '/emitters/1')
        self.assertEqual(page.value('/emitters/1/name'), 'jet_2')
        page.js('document.querySelector("#tree .chosen").focus()')
        self.keys(Keys.F2)
        self.keys('second', Keys.ENTER)
        wait(lambda: page.value('/emitters/1/name') == 'second')
        film = page.film()
        page.js('document.querySelector(`[data-path="/emitters/1"] button`).click()')
        wait(lambda: page.film() != film, what='a film without the muted emitter')
        self.assertEqual(page.js('return tuneStore.doc.muted'), ['emitters/second'])
        self.keys(Keys.DELETE)  # the focus has stayed in the tree since the rename
        wait(lambda: page.text() == SCENE, what='the text as it was')

    def test_the_tree_keeps_the_focus_and_a_name_while_the_scene_changes(self):
        page = self.page
        page.select('/emitters/0')
        page.js('document.querySelector("#tree .chosen").focus()')
        page.set_text(SCENE.replace('4.0e2', '300'))
        self.assertEqual(page.js('return document.activeElement.dataset.path'), '/emitters/0')
        self.keys(Keys.F2)
        self.keys('wat')
        self.scene.write_text(SCENE.replace('4.0e2', '300').replace('"fps": 20', '"fps": 25'))
        page.js('tuneStore.doc')
        wait(lambda: page.find('#banner').is_displayed() or '"fps": 25' in page.text())
        self.keys('er', Keys.ENTER)
        wait(lambda: page.value('/emitters/0/name') == 'water')

    def test_changes_faster_than_the_server_lose_nothing(self):
        page = self.page
        page.select('/emitters/0')
        page.js('''const item = document.querySelector("#tree .chosen"); item.focus();
            for (let i = 0; i < 3; i++) item.dispatchEvent(new KeyboardEvent("keydown", {key: "d", ctrlKey: true, bubbles: true, cancelable: true}))''')
        wait(lambda: len(page.value('/emitters')) == 4)
        self.settle()
        self.assertEqual([e['name'] for e in page.value('/emitters')], ['jet', 'jet_2', 'jet_3', 'jet_4'])
        page.js('for (let i = 0; i < 3; i++) document.body.dispatchEvent(new KeyboardEvent("keydown", {key: "z", ctrlKey: true, bubbles: true, cancelable: true}))')
        self.settle()
        self.assertEqual(page.text(), SCENE)

    def test_undo_treats_unsent_text_as_a_step(self):
        page = self.page
        changed = SCENE.replace('4.0e2', '55')
        page.js('''const t = document.getElementById("text"); t.focus(); t.value = arguments[0]; t.dispatchEvent(new Event("input"));
            t.dispatchEvent(new KeyboardEvent("keydown", {key: "z", ctrlKey: true, bubbles: true, cancelable: true}))''', changed)
        time.sleep(0.5)
        self.settle()
        self.assertEqual(page.text(), SCENE)
        self.assertEqual(page.js('return [document.getElementById("text").value, document.activeElement.id]'), [SCENE, 'text'])
        self.command(Keys.SHIFT, 'z')
        self.assertEqual(page.text(), changed)

    def test_objects_are_copied_as_scene_json_and_pasting_replaces(self):
        page = self.page
        page.select('/bodies/1')
        page.js('''document.querySelector("#tree .chosen").focus(); const data = new DataTransfer();
            document.activeElement.dispatchEvent(new ClipboardEvent("copy", {clipboardData: data, bubbles: true, cancelable: true})); window.copied = data.getData("text/plain")''')
        self.assertEqual(json.loads(page.js('return copied'))['shape'], {'type': 'sphere', 'radius': 0.4})
        page.js('''const data = new DataTransfer(); data.setData("text/plain", '{"name": "other", "shape": {"type": "box"}}');
            document.activeElement.dispatchEvent(new ClipboardEvent("paste", {clipboardData: data, bubbles: true, cancelable: true}))''')
        self.settle()
        self.assertEqual(page.value('/bodies/1'), {'name': 'ball', 'shape': {'type': 'box'}})

    def test_the_text_the_tree_and_the_controls_show_the_same_object(self):
        page = self.page
        page.js('const t = document.getElementById("text"), at = t.value.indexOf("ball"); t.focus(); t.setSelectionRange(at, at); t.dispatchEvent(new MouseEvent("click", {bubbles: true}))')
        self.assertEqual(page.js('return tuneStore.selection'), ['/bodies/1'])
        self.assertEqual(page.find('#controls h2').text, 'ball')
        page.select('/emitters/0')
        band = page.js('return parseFloat(document.querySelector(".band").style.top)')
        self.assertGreater(band, 0)


class Appearance(Case):
    def test_the_palette_follows_the_preference_of_the_browser(self):
        colours = []
        for dark in (False, True):
            set_dark(self.driver, dark)
            colours.append(self.page.js('return getComputedStyle(document.body).backgroundColor'))
        set_dark(self.driver, False)
        brightness = [sum(int(c) for c in colour[4:-1].split(',')) for colour in colours]
        self.assertGreater(brightness[0], 600)
        self.assertLess(brightness[1], 150)


if __name__ == '__main__':
    unittest.main(argv=[sys.argv[0], *sys.argv[3:]], verbosity=2)

// Editors for numbers over time or age, and for colours over age, with points that can be dragged.

import {el, clamp, drag, newGroup} from './dom.js';
import {colourField, css, toRgba, fromRgba} from './colour.js';
import {numberField} from './number.js';

const kWidth = 240, kHeight = 96;

/** {element, set}: keys [[x, y], ...] with ascending x. Double click adds a point, Delete removes it. */
export function curveField({value, limits = {}, unit = '', overAge = false, name, change}) {
  let keys = value.map(k => [...k]), chosen = 0;
  const svg = el('svg', {class: 'curve', viewBox: `0 0 ${kWidth} ${kHeight}`, preserveAspectRatio: 'none', tabindex: 0, 'aria-label': name + ': curve'});
  const fields = el('div', {class: 'curve-fields'});
  const element = el('div', {class: 'curve-box'}, svg, fields);
  let box = bounds();

  function bounds() {
    const xs = keys.map(k => k[0]), ys = keys.map(k => k[1]);
    const top = Math.max(...ys, limits.max !== undefined && Number.isFinite(limits.max) && limits.max <= 10 ? limits.max : -Infinity);
    const bottom = Math.min(...ys, limits.min === 0 ? 0 : Infinity);
    const room = (top - bottom || Math.abs(top) || 1) * 0.25;
    return {x0: overAge ? 0 : Math.min(0, ...xs), x1: overAge ? 1 : Math.max(1, ...xs) * (xs.length > 1 ? 1 : 1), y0: bottom === 0 ? 0 : bottom - room, y1: top + room};
  }
  const toX = x => 6 + (x - box.x0) / (box.x1 - box.x0 || 1) * (kWidth - 12);
  const toY = y => kHeight - 6 - (y - box.y0) / (box.y1 - box.y0 || 1) * (kHeight - 12);
  const fromScreen = event => {
    const r = svg.getBoundingClientRect();
    const u = ((event.clientX - r.left) / r.width * kWidth - 6) / (kWidth - 12), v = 1 - ((event.clientY - r.top) / r.height * kHeight - 6) / (kHeight - 12);
    return [box.x0 + u * (box.x1 - box.x0), box.y0 + v * (box.y1 - box.y0)];
  };
  const tidy = x => Number(x.toPrecision(3));
  function draw() {
    const points = keys.map(k => `${toX(k[0])},${toY(k[1])}`);
    const line = [`${toX(box.x0)},${toY(keys[0][1])}`, ...points, `${toX(box.x1)},${toY(keys.at(-1)[1])}`].join(' ');
    svg.replaceChildren(el('polyline', {points: line, class: 'curve-line'}), ...keys.map((k, i) => {
      const dot = el('circle', {cx: toX(k[0]), cy: toY(k[1]), r: i === chosen ? 6 : 5, class: 'dot' + (i === chosen ? ' chosen' : '')});
      dot.addEventListener('pointerdown', event => { event.stopPropagation(); move(event, i); });
      return dot;
    }));
    fields.replaceChildren(
      numberField({value: keys[chosen][0], limits: overAge ? {min: 0, max: 1} : {min: -Infinity, max: Infinity}, small: true, name: name + ' time', unit: overAge ? 'age' : 's', change: (x, g) => place(chosen, x, keys[chosen][1], g)}).element,
      numberField({value: keys[chosen][1], limits, small: true, name: name + ' value', unit, change: (y, g) => place(chosen, keys[chosen][0], y, g)}).element,
      el('button', {class: 'quiet', title: 'Remove this point', disabled: keys.length < 2, onclick: () => remove(chosen)}, 'Remove point'));
  }
  function place(i, x, y, group) {
    const gap = 1e-3 * (box.x1 - box.x0 || 1);
    const low = i > 0 ? keys[i - 1][0] + gap : overAge ? 0 : -Infinity, high = i + 1 < keys.length ? keys[i + 1][0] - gap : overAge ? 1 : Infinity;
    let value = clamp(y, limits.min ?? -Infinity, limits.max ?? Infinity);
    if (limits.openMin && value <= limits.min) value = limits.min + 1e-6;
    keys[i] = [clamp(x, low, high), value];
    draw();
    change(keys.map(k => [...k]), group);
  }
  function move(event, i) {
    chosen = i;
    svg.focus();
    const group = newGroup();
    draw();
    const held = {currentTarget: svg, pointerId: event.pointerId, clientX: event.clientX, clientY: event.clientY};
    drag(held, e => { const [x, y] = fromScreen(e); place(i, tidy(x), tidy(y), group); }, () => { box = bounds(); draw(); });
  }
  function remove(i) {
    if (keys.length < 2) return;
    keys.splice(i, 1);
    chosen = Math.min(chosen, keys.length - 1);
    draw();
    change(keys.map(k => [...k]), newGroup());
  }
  svg.addEventListener('dblclick', event => {
    const [x, y] = fromScreen(event).map(tidy);
    if (keys.some(k => Math.abs(k[0] - x) < 1e-9)) return;
    chosen = keys.filter(k => k[0] < x).length;
    keys.splice(chosen, 0, [clamp(x, overAge ? 0 : -Infinity, overAge ? 1 : Infinity), clamp(y, limits.min ?? -Infinity, limits.max ?? Infinity)]);
    draw();
    change(keys.map(k => [...k]), newGroup());
  });
  svg.addEventListener('keydown', event => { if (event.key === 'Delete' || event.key === 'Backspace') { event.preventDefault(); remove(chosen); } });
  draw();
  return {element, set(next) {
    if (JSON.stringify(next) === JSON.stringify(keys)) return;
    keys = next.map(k => [...k]);
    chosen = Math.min(chosen, keys.length - 1);
    box = bounds();
    draw();
  }};
}

/** {element, set}: [[age, colour], ...]. */
export function rampField({value, name, change}) {
  let keys = value.map(k => [...k]), chosen = 0, colour = null;
  const bar = el('div', {class: 'ramp', tabIndex: 0, 'aria-label': name + ': colours over age', title: 'Double click adds a colour'});
  const fields = el('div', {class: 'curve-fields'});
  const element = el('div', {class: 'curve-box'}, bar, fields);
  const send = group => change(keys.map(k => [...k]), group);

  function drawBar() {
    const stops = keys.map(([age, c]) => `${css(c)} ${age * 100}%`);
    bar.style.setProperty('--ramp', `linear-gradient(to right, ${stops.length > 1 ? stops.join(', ') : `${css(keys[0][1])}, ${css(keys[0][1])}`})`);
    bar.replaceChildren(...keys.map(([age, c], i) => {
      const stop = el('div', {class: 'stop' + (i === chosen ? ' chosen' : ''), style: `left:${age * 100}%;--c:${css(c)}`});
      stop.addEventListener('pointerdown', event => {
        event.stopPropagation();
        chosen = i;
        bar.focus();
        const group = newGroup(), width = bar.getBoundingClientRect().width, start = keys[i][0];
        draw();
        drag({currentTarget: bar, pointerId: event.pointerId, clientX: event.clientX, clientY: event.clientY}, (e, dx) => setAge(i, start + dx / width, group));
      });
      return stop;
    }));
  }
  function setAge(i, age, group) {
    const low = i > 0 ? keys[i - 1][0] + 0.001 : 0, high = i + 1 < keys.length ? keys[i + 1][0] - 0.001 : 1;
    keys[i][0] = Number(clamp(age, low, high).toFixed(3));
    draw();
    send(group);
  }
  function draw() {
    drawBar();
    colour = colourField({value: keys[chosen][1], name: name + ' colour', change: (c, g) => { keys[chosen][1] = c; drawBar(); send(g); }});
    fields.replaceChildren(
      numberField({value: keys[chosen][0], limits: {min: 0, max: 1}, small: true, unit: 'age', name: name + ' age', change: (x, g) => setAge(chosen, x, g)}).element,
      colour.element,
      el('button', {class: 'quiet', disabled: keys.length < 2, title: 'Remove this colour', onclick: () => remove()}, 'Remove colour'));
  }
  function remove() {
    if (keys.length < 2) return;
    keys.splice(chosen, 1);
    chosen = Math.min(chosen, keys.length - 1);
    draw();
    send(newGroup());
  }
  bar.addEventListener('keydown', event => { if (event.key === 'Delete' || event.key === 'Backspace') { event.preventDefault(); remove(); } });
  bar.addEventListener('dblclick', event => {
    const r = bar.getBoundingClientRect(), age = Number(clamp((event.clientX - r.left) / r.width, 0, 1).toFixed(3));
    if (keys.some(k => k[0] === age)) return;
    chosen = keys.filter(k => k[0] < age).length;
    const a = toRgba(keys[Math.max(0, chosen - 1)][1]), b = toRgba(keys[Math.min(keys.length - 1, chosen)][1]);
    keys.splice(chosen, 0, [age, fromRgba(a.map((x, i) => (x + b[i]) / 2), keys[0][1])]);
    draw();
    send(newGroup());
  });
  draw();
  return {element, set(next) {
    if (JSON.stringify(next) === JSON.stringify(keys)) return;
    keys = next.map(k => [...k]);
    chosen = Math.min(chosen, keys.length - 1);
    draw();
  }};
}

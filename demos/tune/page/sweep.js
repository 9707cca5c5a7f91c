// Sweep of a value: enter values, run, and see a contact sheet; a click on a picture sets its value.

import {el, popover, newGroup} from './dom.js';
import {store, on, send, setValue, alike} from './store.js';
import {numberText} from './jsonc.js';
import {label} from './schema.js';

const tidy = x => Number(x.toPrecision(3));

/** The part of a value that a sweep changes: the mean, a range, a whole curve, or one component of a vector. */
function around(value, component) {
  if (Array.isArray(value)) return {centre: value[component], with: x => value.map((y, i) => i === component ? x : y)};
  if (value?.axis) return {centre: value.angle_deg, with: x => ({...value, angle_deg: x})};
  if (typeof value === 'number') return {centre: value, with: x => x};
  if (value?.mean !== undefined) return {centre: value.mean, with: x => ({...value, mean: x})};
  if (value?.range) { const half = (value.range[1] - value.range[0]) / 2; return {centre: (value.range[0] + value.range[1]) / 2, with: x => ({range: [tidy(x - half), tidy(x + half)]})}; }
  const first = value?.curve?.[0]?.[1] || 1;
  return {centre: first, with: x => ({curve: (value?.curve ?? [[0, 1]]).map(([t, v]) => [t, tidy(v * x / first)])})};
}

function proposed(centre, limits, whole) {
  const factors = [0.35, 0.6, 0.8, 1, 1.5, 2.5];
  const all = centre === 0 ? [0, 0.2, 0.4, 0.6, 0.8, 1] : factors.map(f => tidy(centre * f));
  const inside = all.map(x => Math.min(limits.max ?? Infinity, Math.max(limits.min ?? -Infinity, x))).map(x => whole ? Math.round(x) : x);
  return [...new Set(inside)].filter(x => !(limits.openMin && x <= limits.min));
}

let current = null;
export function openSweep(anchor, path, d, value) {
  const component = Array.isArray(value) && el('select', {'aria-label': 'Component', onchange: propose}, value.map((_, i) => el('option', {value: i}, 'xyzw'[i] ?? String(i + 1))));
  const form = () => around(value, Number(component ? component.value : 0));
  const values = el('input', {type: 'text', class: 'text', spellcheck: false, 'aria-label': 'Values'});
  function propose() { values.value = proposed(form().centre, d.limits ?? {}, d.whole).map(numberText).join(', '); }
  propose();
  const sheet = el('div', {class: 'sheet'}), note = el('p', {class: 'help'}, `Simulates each value up to frame ${store.frame}. Click a picture to take its value.`);
  const run = el('button', {class: 'primary', onclick: start}, 'Run');
  popover(anchor, `Sweep ${label(d.key).toLowerCase()}${d.unit ? ` [${d.unit}]` : ''}`, el('div', {class: 'stack'}, el('div', {class: 'inline'}, component, values, run), note, sheet), true);
  const closed = () => { document.getElementById('popover').removeEventListener('closed', closed); if (current) { send('sweep', {paths: [], values: []}); current = null; } };
  setTimeout(() => document.getElementById('popover').addEventListener('closed', closed));
  values.addEventListener('keydown', event => { if (event.key === 'Enter') start(); });

  async function start() {
    const numbers = values.value.split(/[\s,;]+/).filter(Boolean).map(Number).filter(Number.isFinite).slice(0, 36);
    if (!numbers.length) { note.textContent = 'Enter numbers, separated by commas.'; return; }
    const made = form(), texts = numbers.map(x => JSON.stringify(made.with(x)));
    sheet.replaceChildren(...numbers.map(x => el('button', {class: 'cell waiting', onclick: () => setValue(path, made.with(x), d.key, newGroup())}, el('span', {class: 'picture'}), el('span', {class: 'caption'}, numberText(x)))));
    const {status, body} = await send('sweep', {paths: alike(path), values: texts, frame: store.frame});
    if (status !== 200) { note.textContent = body.error; return; }
    current = {sweep: body.sweep, cells: [...sheet.children]};
  }
}

on('cell', cell => {
  if (cell.sweep !== current?.sweep) return;
  const box = current.cells[cell.index];
  box.classList.remove('waiting');
  if (cell.fault) { box.querySelector('.picture').textContent = cell.fault; box.classList.add('bad'); return; }
  box.querySelector('.picture').replaceChildren(el('img', {src: `${store.base}cell/${cell.sweep}/${cell.index}`, alt: ''}));
  box.querySelector('.caption').append(el('small', {}, ` ${cell.particles} particles`));
});

// A control for each kind of value. Each is {element, set(value)} and calls change(value, group).

import {el, newGroup} from './dom.js';
import {store, listOf} from './store.js';
import {numberField} from './number.js';
import {colourField} from './colour.js';
import {curveField, rampField} from './curve.js';
import {parse, valueOf, toText} from './jsonc.js';

const isNumber = v => typeof v === 'number', isList = (v, item, size) => Array.isArray(v) && v.every(item) && (size === undefined || v.length === size);
const isColour = v => typeof v === 'string' || isList(v, isNumber) && (v.length === 3 || v.length === 4);
const isPair = item => k => Array.isArray(k) && k.length === 2 && isNumber(k[0]) && item(k[1]);
const isPlain = v => !!v && typeof v === 'object' && !Array.isArray(v);
const kFits = {
  number: isNumber, boolean: v => typeof v === 'boolean', string: v => typeof v === 'string', names: v => isList(v, x => typeof x === 'string'),
  enum: (v, d) => d.values.includes(v), vector: (v, d) => isList(v, isNumber, d.size), colour: isColour, curve: v => isList(v, isPair(isNumber)), colour_ramp: v => isList(v, isPair(isColour)),
  orientation: v => isList(v, isNumber, 4) || isPlain(v) && isList(v.axis, isNumber, 3) && isNumber(v.angle_deg),
  varying: v => isNumber(v) || isPlain(v) && (isList(v.range, isNumber, 2) || isList(v.curve, isPair(isNumber)) && v.curve.length > 0 || isNumber(v.mean) && Object.values(v).every(isNumber)),
};
/**
 * Whether a value has a form that its control can show. Other values, which are errors in the text, are shown as JSON.
 */
export const fits = (d, value) => value === undefined || (kFits[d.kind]?.(value, d) ?? true);

/** The form of a value, such as constant or curve. If it changes, the control is created again. */
export function modeOf(d, value) {
  if (!fits(d, value)) return 'other';
  if (d.kind === 'varying') return varyingMode(value);
  if (d.kind === 'orientation') return Array.isArray(value) ? 'quaternion' : 'axis';
  if (d.kind === 'curve' || d.kind === 'colour_ramp' || d.kind === 'colour') return value === undefined || value?.length === 0 ? 'none' : 'some';
  if (d.kind === 'number' || d.kind === 'vector') return value === undefined ? 'none' : 'some';
  if (d.kind === 'numbers' || d.kind === 'names') return 'list';
  return '';
}
const varyingMode = value => typeof value === 'number' ? 'constant' : value?.range ? 'range' : value?.curve ? 'curve' : value === undefined ? 'none' : 'spread';

export function fieldFor(d, value, context) {
  const make = !fits(d, value) ? jsonField : {
    number: numberKind, varying: varyingField, boolean: booleanField, enum: enumField, string: stringField, names: namesField, vector: vectorField,
    orientation: orientationField, colour: colourKind, curve: curveKind, colour_ramp: rampKind, rate: rateField,
  }[d.kind] ?? jsonField;
  return make(d, value, context);
}

const missing = (d, {change, sample}, start) => ({
  element: el('button', {class: 'quiet', onclick: () => change(start ?? sample())}, 'Set a value'), set() {}});

function numberKind(d, value, context) {
  if (typeof value !== 'number') return missing(d, context);
  return numberField({value, limits: d.limits, whole: d.whole, unit: d.unit, name: d.key, change: context.change});
}

function booleanField(d, value, {change}) {
  const box = el('input', {type: 'checkbox', checked: !!value, 'aria-label': d.key, onchange: () => change(box.checked, newGroup())});
  return {element: el('label', {class: 'switch'}, box, el('span', {})), set(v) { box.checked = !!v; }};
}

function enumField(d, value, {change}) {
  const box = el('select', {'aria-label': d.key, onchange: () => change(box.value, newGroup())}, d.values.map(v => el('option', {value: v}, String(v).replace(/_/g, ' '))));
  box.value = value;
  return {element: box, set(v) { if (v !== undefined) box.value = v; }};
}

const namesIn = targets => targets.flatMap(list => listOf(list).map((o, i) => o?.name || `${list.slice(0, -1).replace(/ie$/, 'y')}_${i}`));

function stringField(d, value, {change}) {
  if (!d.targets.length) {
    const box = el('input', {type: 'text', class: 'text', value: value ?? '', spellcheck: false, 'aria-label': d.key, onchange: () => change(box.value, newGroup())});
    return {element: box, set(v) { if (document.activeElement !== box) box.value = v ?? ''; }};
  }
  const box = el('select', {'aria-label': d.key, onchange: () => change(box.value, newGroup())});
  const fill = v => {
    const names = [...new Set(['', ...namesIn(d.targets), v ?? ''])];
    box.replaceChildren(...names.map(n => el('option', {value: n}, n || '(none)')));
    box.value = v ?? '';
  };
  fill(value);
  return {element: box, set: fill};
}

function namesField(d, value, {change}) {
  const element = el('div', {class: 'chips'});
  let now = [];
  const draw = v => {
    now = v ?? [];
    const left = namesIn(d.targets).filter(n => !now.includes(n));
    const add = el('select', {'aria-label': `Add to ${d.key}`, onchange: () => add.value && change([...now, add.value], newGroup())}, el('option', {value: ''}, 'Add …'), left.map(n => el('option', {value: n}, n)));
    element.replaceChildren(...now.map(n => el('span', {class: 'chip'}, n, el('button', {class: 'icon quiet', 'aria-label': `Remove ${n}`, onclick: () => change(now.filter(x => x !== n), newGroup())}, '×'))), left.length ? add : '');
  };
  draw(value);
  return {element, set: draw};
}

function vectorField(d, value, context) {
  if (!Array.isArray(value)) return missing(d, context);
  let now = [...value];
  const names = d.size <= 4 && d.unit !== '' || d.size === 3 ? ['x', 'y', 'z', 'w'] : [];
  const fields = now.map((x, i) => numberField({value: x, limits: d.limits, whole: d.whole, small: true, name: `${d.key} ${names[i] ?? i + 1}`, unit: names[i] ?? '', change: (v, g) => {
    now = now.map((y, k) => k === i ? v : y);
    context.change(now, g);
  }}));
  const element = el('div', {class: 'vector'}, fields.map(f => f.element), d.unit ? el('span', {class: 'unit'}, d.unit) : null);
  return {element, set(v) { if (Array.isArray(v)) { now = [...v]; v.forEach((x, i) => fields[i]?.set(x)); } }};
}

function orientationField(d, value, context) {
  if (Array.isArray(value)) {
    const turn = turnOf(value);
    return orientationField(d, turn, context);
  }
  let now = value ?? {axis: [0, 1, 0], angle_deg: 0};
  const axis = vectorField({key: d.key + ' axis', size: 3, unit: '', limits: {min: -Infinity, max: Infinity}}, now.axis, {change: (v, g) => { if (v.some(x => x !== 0)) { now = {...now, axis: v}; context.change(now, g); } }});
  const angle = numberField({value: now.angle_deg, limits: {min: -360, max: 360}, unit: '°', name: d.key + ' angle', change: (v, g) => { now = {...now, angle_deg: v}; context.change(now, g); }});
  return {element: el('div', {class: 'stack'}, angle.element, axis.element), set(v) {
    now = Array.isArray(v) ? turnOf(v) : v ?? now;
    axis.set(now.axis);
    angle.set(now.angle_deg);
  }};
}
function turnOf([w, x, y, z]) {
  const size = Math.hypot(x, y, z), tidy = v => Number(v.toFixed(4));
  return size < 1e-9 ? {axis: [0, 1, 0], angle_deg: 0} : {axis: [x, y, z].map(v => tidy(v / size)), angle_deg: tidy(2 * Math.atan2(size, w) * 180 / Math.PI)};
}

function colourKind(d, value, context) {
  if (value === undefined) return missing(d, context, '#ffffff');
  return colourField({value, name: d.key, change: context.change});
}
function rampKind(d, value, context) {
  if (!value?.length) return missing(d, context, [[0, [1, 1, 1, 1]], [1, [1, 1, 1, 0]]]);
  return rampField({value, name: d.key, change: context.change});
}
function curveKind(d, value, context) {
  if (!value?.length) return missing(d, context, [[0, 1], [1, 1]]);
  return curveField({value, limits: d.limits, unit: d.unit, overAge: d.overAge, name: d.key, change: context.change});
}

/** Distributions: a constant, a mean with a deviation, a range, or a curve over time. */
function varyingField(d, value, context) {
  const mode = varyingMode(value);
  if (mode === 'none') return missing(d, context);
  const mean = mode === 'constant' ? value : mode === 'range' ? (value.range[0] + value.range[1]) / 2 : mode === 'curve' ? value.curve[0][1] : value.mean;
  const fresh = {
    constant: () => mean, spread: () => ({mean, deviation: tidy(Math.abs(mean) * 0.2)}),
    range: () => ({range: [tidy(mean * 0.7), tidy(mean * 1.3)].sort((a, b) => a - b)}),
    curve: () => ({curve: [[0, mean], [store.doc?.scene ? tidy(store.doc.scene.frames / store.doc.scene.fps) : 1, mean]]}),
  };
  const choose = el('select', {class: 'mode', 'aria-label': `${d.key}: how it varies`, onchange: () => context.change(fresh[choose.value](), newGroup())},
    [['constant', 'constant'], ['spread', 'mean ± deviation'], ['range', 'between two'], ['curve', 'over time']].map(([v, text]) => el('option', {value: v, selected: v === mode}, text)));
  const body = varyingBody(mode, d, value, context);
  return {element: el('div', {class: 'stack'}, choose, body.element), set: v => { if (varyingMode(v) === mode) body.set(v); }};
}
const tidy = x => Number(x.toPrecision(3));

function varyingBody(mode, d, value, {change}) {
  const number = (name, start, limits, take) => numberField({value: start, limits, unit: d.unit, name: `${d.key} ${name}`.trim(), change: take});
  if (mode === 'constant') {
    const field = number('', value, d.limits, change);
    return {element: field.element, set: v => field.set(v)};
  }
  if (mode === 'curve') {
    const field = curveField({value: value.curve, limits: d.limits, unit: d.unit, name: d.key, change: (keys, g) => change({curve: keys}, g)});
    return {element: field.element, set: v => field.set(v.curve)};
  }
  let now = structuredClone(value);
  if (mode === 'range') {
    const put = (i, x, g) => { now.range[i] = x; now.range[1 - i] = i === 0 ? Math.max(x, now.range[1]) : Math.min(x, now.range[0]); change(structuredClone(now), g); };
    const fields = [0, 1].map(i => number(i ? 'to' : 'from', now.range[i], d.limits, (x, g) => put(i, x, g)));
    return {element: labelled(['from', 'to'], fields), set: v => { now = structuredClone(v); fields.forEach((f, i) => f.set(v.range[i])); }};
  }
  const keys = ['mean', 'deviation', ...['min', 'max'].filter(k => k in value)];
  const fields = keys.map(k => number(k, now[k] ?? 0, k === 'deviation' ? {min: 0, max: Infinity} : d.limits, (x, g) => { now = {...now, [k]: x}; change(now, g); }));
  return {element: labelled(keys, fields), set: v => { now = structuredClone(v); keys.forEach((k, i) => fields[i].set(v[k] ?? 0)); }};
}
const labelled = (names, fields) => el('div', {class: 'stack'}, names.map((n, i) => el('div', {class: 'sub'}, el('span', {class: 'sub-name'}, n), fields[i].element)));

function rateField(d, value, {change}) {
  const box = el('input', {type: 'text', class: 'text', value: String(value ?? ''), 'aria-label': d.key, onchange: () => change(box.value.includes('/') || !Number.isFinite(Number(box.value)) ? box.value : Number(box.value), newGroup())});
  return {element: box, set(v) { if (document.activeElement !== box) box.value = String(v ?? ''); }};
}

function jsonField(d, value, {change}) {
  const box = el('textarea', {class: 'json', rows: 2, spellcheck: false, 'aria-label': d.key, value: value === undefined ? '' : toText(value)});
  box.addEventListener('change', () => {
    const root = parse(box.value);
    box.classList.toggle('bad', !root);
    if (root) change(valueOf(root), newGroup());
  });
  return {element: box, set(v) { if (document.activeElement !== box) box.value = v === undefined ? '' : toText(v); }};
}

// The controls of the selected object, generated from the schema.

import {byId, el, newGroup, toast} from './dom.js';
import {store, on, emit, setValue, removeValue, select, listOf} from './store.js';
import {find, valueOf, stepsOf, joined, toText} from './jsonc.js';
import * as schema from './schema.js';
import {fieldFor, modeOf} from './fields.js';
import {nameOf, setKeySearch, setRowValue} from './tree.js';
import {openSweep} from './sweep.js';

const panel = byId('controls');
const open = new Set();  // paths of the groups that are open
let rows = [], signature = '', shownPath = null;

setRowValue(path => valueOf(find(store.root, path)) ?? rows.find(r => r.path === path)?.usual);
setKeySearch((path, query) => {
  const description = schema.at(stepsOf(path), store.value);
  const value = valueOf(find(store.root, path));
  return description?.kind === 'object' && !description.free && schema.keysOf(schema.objectFor(description, value)).some(d => found(d, query));
});
const found = (d, query) => d.key.replace(/_/g, ' ').includes(query.replace(/_/g, ' ')) || d.help.toLowerCase().includes(query);

/** The values of the keys that an object omits; for an emitter with a preset, those of the preset. */
function presetOf(value, steps) {
  const emitters = name => store.presets.find(p => p.name === name)?.preset.emitters ?? [];
  if (steps[0] === 'emitters' && steps.length === 2 && value?.preset) {
    const [preset, part] = value.preset.split('/');
    return part ? emitters(preset).find(e => e.name === part) : emitters(preset)[0];
  }
  return undefined;
}

/** The parts of an effect, as descriptions of emitters and forces, with the preset's values as defaults. */
function effectParts(effect) {
  const preset = store.presets.find(p => p.name === effect?.preset)?.preset;
  if (!preset) return [];
  const part = (list, o) => ({...schema.itemOf(schema.rootKey(list)), key: o.name, help: `${list.slice(0, -1)} of the preset`, unit: '', below: o});
  return [...(preset.emitters ?? []).map(e => part('emitters', e)), ...(preset.forces ?? []).map(f => part('forces', f))];
}

/** A text that changes when other controls are needed, but not when only their values change. */
function signatureOf(description, value, path, below) {
  if (description.kind === 'object' && !description.free && (open.has(path) || path === shownPath)) {
    const object = schema.objectFor(description, value ?? below);
    return (value ?? below)?.type + '{' + schema.keysOf(object).map(d => d.key + ':' + signatureOf(d, value?.[d.key], joined(path, d.key), below?.[d.key])).join() + '}';
  }
  if (description.kind === 'list' && open.has(path)) return '[' + (value ?? []).map((v, i) => signatureOf(schema.itemOf(description), v, joined(path, i))).join() + ']';
  return `${modeOf(description, value ?? below ?? description.fallback)}${open.has(path)}${value === undefined ? '' : 'own'}`;
}

export function drawControls(force = false) {
  const path = store.selection.at(-1);
  const description = path !== undefined && store.root ? schema.at(stepsOf(path), store.value) : null;
  if (!description) return drawEmpty();
  const value = valueOf(find(store.root, path));
  shownPath = path;
  const query = byId('search').value.trim().toLowerCase();
  const now = path + '|' + query + '|' + store.selection.length + signatureOf(description, value, path, presetOf(value, stepsOf(path))) + (value?.preset ? value.preset + store.presets.length : '');
  if (now === signature && !force) return refresh();
  const top = signature.startsWith(path + '|') ? panel.scrollTop : 0, focus = panel.contains(document.activeElement) ? document.activeElement.getAttribute('aria-label') : null;
  signature = now;
  rows = [];
  panel.replaceChildren(heading(path, description, value), ...objectRows(path, description, presetOf(value, stepsOf(path)), query));
  if (stepsOf(path)[0] === 'effects' && stepsOf(path).length === 2)
    for (const part of effectParts(value)) panel.append(group(joined(joined(path, 'overrides'), part.key), part, part.below));
  panel.scrollTop = top;
  if (focus) [...panel.querySelectorAll('[aria-label]')].find(e => e.getAttribute('aria-label') === focus)?.focus({preventScroll: true});
  refresh();
}

function drawEmpty() {
  signature = '';
  rows = [];
  const empty = store.root && !schema.kLists.some(l => listOf(l).length);
  panel.replaceChildren(el('div', {class: 'empty'}, empty
    ? el('div', {}, el('p', {}, 'The scene has no objects yet.'), el('button', {class: 'primary', onclick: () => byId('add-button').click()}, 'Add an object'))
    : el('p', {}, 'Select an object above, in the picture or in the text to see its controls.')));
}

function heading(path, description, value) {
  const types = schema.typesOf(description), many = store.selection.length;
  const head = el('div', {class: 'heading'}, el('h2', {}, many > 1 ? `${many} objects` : nameOf(path)));
  if (many > 1) head.append(el('p', {class: 'help'}, `Changes apply to all of them. Shown: ${nameOf(path)}.`));
  if (types && types.length > 1) head.append(typeSelect(path, types, value));
  return head;
}

function typeSelect(path, types, value) {
  return el('select', {'aria-label': 'Kind', class: 'type', onchange: event => setValue(path, {...(value?.name ? {name: value.name} : {}), type: event.target.value}, 'kind')},
    types.map(t => el('option', {value: t, selected: t === (value?.type ?? types[0])}, t.replace(/_/g, ' '))));
}

function objectRows(path, description, below, query = '') {
  if (description.kind !== 'object') return [fieldRow(path, {...description, key: description.key || stepsOf(path).at(-1)}, undefined)];
  if (description.free) return [];
  const value = valueOf(find(store.root, path)) ?? below;
  const keys = schema.keysOf(schema.objectFor(description, value));
  const shown = query && keys.some(d => found(d, query)) ? keys.filter(d => found(d, query)) : keys;
  const own = shown.filter(d => !(d.key === 'overrides' && stepsOf(path)[0] === 'effects'));
  return own.map(d => {
    const place = joined(path, d.key), under = below?.[d.key];
    return d.kind === 'object' || d.kind === 'list' ? group(place, d, under) : fieldRow(place, d, under);
  });
}

function group(path, d, below) {
  const box = el('details', {class: 'group', open: open.has(path), 'data-path': path});
  const value = () => valueOf(find(store.root, path));
  const now = value(), mark = el('span', {class: 'summary'}, summaryOf(d, now ?? below));
  box.append(el('summary', {title: d.help}, el('span', {class: 'label'}, schema.label(d.key)), mark));
  box.addEventListener('toggle', () => { if (box.open === open.has(path)) return; box.open ? open.add(path) : open.delete(path); drawControls(true); });
  if (now !== undefined) box.querySelector('summary').append(resetButton(path, d));
  rows.push({path, set: v => { mark.textContent = summaryOf(d, v ?? below); }});
  if (!open.has(path)) return box;
  box.append(d.help ? el('p', {class: 'help'}, d.help) : '');
  if (d.kind === 'list') box.append(...listItems(path, d, now ?? below ?? []));
  else if (now === undefined && below === undefined && d.fallback === undefined)
    box.append(el('button', {class: 'quiet', onclick: () => setValue(path, {}, d.key)}, `Add ${schema.label(d.key).toLowerCase()}`));
  else {
    const types = schema.typesOf(d);
    if (types && types.length > 1) box.append(typeSelect(path, types, now ?? below));
    box.append(...objectRows(path, d, now === undefined || !now.type || now.type === below?.type ? below : undefined));
  }
  return box;
}

function listItems(path, d, items) {
  const item = schema.itemOf(d);
  const boxes = items.map((_, i) => group(joined(path, i), {...item, key: items[i].name || items[i].type || `${d.key} ${i + 1}`, help: ''}, undefined));
  const types = schema.typesOf(item);
  const add = () => {
    const value = types ? {type: types[0]} : Object.fromEntries(schema.requiredOf(item.object ?? {}).map(k => [k, sample(schema.keysOf(item.object).find(x => x.key === k))]));
    open.add(joined(path, items.length));
    setValue(joined(path, items.length), value, `add ${d.key}`);
  };
  return [...boxes, el('button', {class: 'quiet', onclick: add}, `Add to ${schema.label(d.key).toLowerCase()}`)];
}

/** The initial value of a new key. */
export function sample(d) {
  if (!d) return 0;
  if (d.fallback !== undefined) return d.fallback;
  if (d.kind === 'vector') return Array(d.size).fill(d.nonzero ? 1 : 0);
  if (d.kind === 'number' || d.kind === 'varying') return Math.max(d.limits?.min > -Infinity ? d.limits.min : 0, d.limits?.openMin ? 1 : 0);
  if (d.kind === 'boolean') return true;
  if (d.kind === 'enum') return d.values[0];
  if (d.kind === 'names' || d.kind === 'numbers' || d.kind === 'list') return [];
  if (d.kind === 'object') return d.choices ? {type: schema.typesOf(d)[0]} : {};
  return d.targets?.length ? listOf(d.targets[0])[0]?.name ?? '' : '';
}

function summaryOf(d, value) {
  if (d.kind === 'list') return value?.length ? String(value.length) : 'none';
  if (value === undefined) return d.fallback === undefined ? 'none' : '';
  return value?.type ? value.type.replace(/_/g, ' ') : '';
}

function resetButton(path, d) {
  return el('button', {class: 'icon quiet reset', title: d.fallback !== undefined ? `Back to the default: ${toText(d.fallback)}` : 'Remove', 'aria-label': `Reset ${d.key}`,
    onclick: event => { event.preventDefault(); event.stopPropagation(); removeValue(path, `reset ${d.key}`); }}, '↺');
}

function fieldRow(path, d, below) {
  const row = el('div', {class: 'row', 'data-key': d.key, 'data-path': path});
  const name = el('label', {class: 'label', title: d.help}, schema.label(d.key));
  const change = (value, g) => setValue(path, value, d.key, g ?? newGroup());
  const current = () => valueOf(find(store.root, path)) ?? below ?? d.fallback;
  const field = fieldFor(d, current(), {change, path, sample: () => sample(d)});
  const usual = below ?? d.fallback;
  const tools = el('span', {class: 'row-tools'});
  const quaternion = d.kind === 'orientation' && Array.isArray(current());
  if (['number', 'varying', 'vector', 'orientation'].includes(d.kind) && !quaternion)
    tools.append(el('button', {class: 'icon quiet', title: 'Try several values (sweep)', 'aria-label': `Sweep ${d.key}`, onclick: event => openSweep(event.currentTarget, path, d, current() ?? sample(d))}, '▦'));
  tools.append(resetButton(path, d));
  const error = el('p', {class: 'error', hidden: true});
  row.append(el('div', {class: 'row-head'}, name, tools), field.element, el('p', {class: 'help'}, d.help + (d.unit ? ` [${d.unit}]` : '')), error);
  rows.push({path, element: row, error, usual, set: value => {
    row.classList.toggle('default', value === undefined);
    field.set(value ?? usual);
  }});
  return row;
}

/** Writes new values into the existing controls. */
function refresh() {
  const errors = store.doc?.errors ?? [];
  for (const one of rows) {
    one.set(valueOf(find(store.root, one.path)));
    if (!one.error) continue;
    const mine = errors.filter(p => p.path === one.path || p.path.startsWith(one.path + '/'));
    one.error.hidden = !mine.length;
    one.error.textContent = mine.map(p => p.what).join(' ');
    one.element.classList.toggle('bad', mine.length > 0);
  }
}

/** Opens the groups that contain a path, and scrolls to its row. */
export function reveal(path) {
  const steps = stepsOf(path);
  if (steps.length < 1) return;
  const lists = schema.kLists.includes(steps[0]);
  const object = '/' + steps.slice(0, lists ? 2 : 1).join('/');
  if (!find(store.root, object) && lists) return;
  for (let i = lists ? 3 : 2; i < steps.length; i++) open.add('/' + steps.slice(0, i).join('/'));
  if (store.selection.at(-1) !== object) select([object]); else drawControls();
  panel.querySelector(`[data-path="${CSS.escape(path)}"]`)?.scrollIntoView({block: 'nearest'});
}

on('document selection search presets', () => drawControls());

// The objects of the scene as a tree, with the commands on objects.

import {byId, el, popover, toast} from './dom.js';
import {store, on, emit, edit, editLater, setValue, select, view, isWriter, listOf} from './store.js';
import {find, toText, parse, valueOf, stepsOf, pathOf} from './jsonc.js';
import {kLists, kSettings, label, at} from './schema.js';

const tree = byId('tree');

export const nameOf = path => {
  const steps = stepsOf(path), value = valueOf(find(store.root, path));
  if (steps.length === 1) return label(steps[0]);
  return value?.name || value?.preset || value?.type && `${value.type} ${steps[1]}` || `${steps[0].replace(/ies$/, 'y').replace(/s$/, '')} ${steps[1]}`;
};
const muteKey = path => { const [list, i] = stepsOf(path); return `${list}/${store.value[list]?.[i]?.name || i}`; };
const isMuted = path => (store.doc?.muted ?? []).includes(muteKey(path));
const kMutable = ['emitters', 'effects', 'forces', 'bodies', 'particles', 'cloths', 'springs', 'joints', 'articulations', 'lights', 'overlays'];

export function objectPaths() {
  const paths = [];
  for (const list of kLists)
    listOf(list).forEach((_, i) => paths.push(`/${list}/${i}`));
  return paths;
}

function iconButton(text, title, run) {
  return el('button', {class: 'icon quiet', title, 'aria-label': title, onclick: event => { event.stopPropagation(); run(event); }}, text);
}

// A row is kept as long as its object exists, together with the focus and a name being typed; only differences are
// updated.
const rows = new Map();  // by path, or by the text of a heading
let renaming = null;     // {path, input}

function makeRow(path) {
  const own = stepsOf(path).length > 1, mutable = own && kMutable.includes(stepsOf(path)[0]);
  const name = el('span', {class: 'name'}), mark = el('span', {class: 'mark'}, '●');
  const muter = mutable && iconButton('', '', () => mute(path));
  const element = el('div', {role: 'treeitem', 'data-path': path, onclick: event => choose(path, event), ondblclick: () => own && rename(path)},
    name, mark, muter, own && iconButton('⋯', 'Duplicate, rename, copy, delete', event => menu(path, event.currentTarget)));
  return {element, update(problems) {
    const chosen = store.selection.includes(path), muted = mutable && isMuted(path), under = p => p === path || p.startsWith(path + '/');
    const bad = problems.errors.some(under), warned = !bad && problems.warnings.some(under);
    element.className = 'item' + (chosen ? ' chosen' : '') + (muted ? ' muted' : '');
    element.tabIndex = chosen ? 0 : -1;
    element.setAttribute('aria-selected', String(chosen));
    if (renaming?.path !== path) { name.textContent = nameOf(path); name.title = nameOf(path); }
    mark.hidden = !bad && !warned;
    mark.className = 'mark ' + (bad ? 'bad' : 'warn');
    mark.title = bad ? 'has an error' : 'has a warning';
    if (!mutable) return;
    muter.textContent = muted ? '○' : '◉';
    muter.title = muted ? 'Muted: not simulated. Click to unmute' : 'Mute: leave it out of the simulation';
    muter.setAttribute('aria-label', muted ? 'Unmute' : 'Mute');
  }};
}
function makeHeading() {
  const name = el('span', {}), count = el('span', {class: 'count'});
  return {element: el('div', {class: 'list-name'}, name, count), set(text, n) { name.textContent = text; count.textContent = n ?? ''; }};
}
const kept = (key, make) => { if (!rows.has(key)) rows.set(key, make(key)); return rows.get(key); };

export function drawTree() {
  if (!store.root) return;
  const query = byId('search').value.trim().toLowerCase();
  const problems = {errors: (store.doc?.errors ?? []).map(p => p.path), warnings: (store.doc?.warnings ?? []).map(p => p.path)};
  const now = [];
  const add = (title, count, paths) => {
    const heading = kept(title, makeHeading);
    heading.set(title, count);
    now.push(title, ...paths);
  };
  for (const list of kLists) {
    const items = store.value[list];
    if (!Array.isArray(items) || !items.length) continue;
    const paths = items.map((_, i) => `/${list}/${i}`).filter(p => !query || matches(p, query));
    if (paths.length) add(label(list), String(items.length), paths);
  }
  add('Scene', null, kSettings.map(k => '/' + k).filter(p => !query || matches(p, query)));
  const focused = tree.contains(document.activeElement) ? [...tree.children].indexOf(document.activeElement.closest('.item')) : -1;
  if (renaming && !now.includes(renaming.path)) renaming = null;
  for (const key of [...rows.keys()]) if (!now.includes(key)) { rows.get(key).element.remove(); rows.delete(key); }
  now.forEach((key, i) => {
    const row = kept(key, makeRow);
    row.update?.(problems);
    if (tree.children[i] !== row.element) tree.insertBefore(row.element, tree.children[i] ?? null);
  });
  const none = !now.some(key => key.startsWith('/'));
  tree.querySelector('.empty')?.remove();
  if (none) tree.append(el('p', {class: 'empty'}, 'No object or key matches.'));
  if (focused >= 0 && !tree.contains(document.activeElement)) [...tree.children].slice(focused).concat(...tree.children).find(e => e.classList.contains('item'))?.focus({preventScroll: true});
}

function matches(path, query) {
  const has = value => value && typeof value === 'object' && Object.entries(value).some(([k, v]) => k.replace(/_/g, ' ').includes(query.replace(/_/g, ' ')) || has(v));
  return nameOf(path).toLowerCase().includes(query) || has(valueOf(find(store.root, path))) || emitSearch(path, query);
}
// The controls know the keys that the text omits.
let searchKeys = () => false;
export function setKeySearch(f) { searchKeys = f; }
const emitSearch = (path, query) => searchKeys(path, query);

function choose(path, event) {
  const now = store.selection;
  if (event.ctrlKey || event.metaKey) select(now.includes(path) ? now.filter(p => p !== path) : [...now, path]);
  else if (event.shiftKey && now.length) {
    const all = [...tree.querySelectorAll('.item')].map(i => i.dataset.path);
    const [a, b] = [all.indexOf(now.at(-1)), all.indexOf(path)].sort((x, y) => x - y);
    select(all.slice(a, b + 1).filter(p => p !== path).concat(path));
  } else select([path]);
  tree.querySelector(`[data-path="${CSS.escape(path)}"]`)?.focus();
}

export function mute(path) {
  const key = muteKey(path), now = store.doc.muted;
  view({muted: now.includes(key) ? now.filter(k => k !== key) : [...now, key]});
}

function freeName(taken, name) {
  const stem = name.replace(/_?\d+$/, '');
  for (let i = 2; ; i++) if (!taken.has(`${stem}_${i}`)) return `${stem}_${i}`;
}

/** Adds copies at the end of their lists, as one step, and selects them. */
export function duplicate(paths) {
  const copies = paths.map(p => { const [list, i] = stepsOf(p); return [list, structuredClone(store.value[list][i])]; });
  return addAll(copies, `duplicate ${paths.map(nameOf).join(', ')}`);
}
export const addTo = (list, value, what) => addAll([[list, value]], what);

/** Adds objects at the end of their lists, with unused names, and selects them. */
async function addAll(objects, what) {
  let added = [];
  const ok = await editLater(() => {
    added = [];
    const length = {}, taken = {};
    const ops = objects.map(([list, object]) => {
      const value = structuredClone(object), names = taken[list] ??= new Set(listOf(list).map(o => o?.name));
      if (value.name && names.has(value.name)) value.name = freeName(names, value.name);
      names.add(value.name);
      length[list] = (length[list] ?? listOf(list).length - 1) + 1;
      const path = `/${list}/${length[list]}`;
      added.push(path);
      return {set: path, value: toText(value, kIndent)};
    });
    return {ops, label: what, paths: added};
  });
  if (!ok) return;
  select(added);
  tree.querySelector(`[data-path="${CSS.escape(added.at(-1))}"]`)?.scrollIntoView({block: 'nearest'});
}
const kIndent = 4;  // indentation of the items of a list of objects

export function remove(paths) {
  const objects = paths.map(p => ({path: p, name: valueOf(find(store.root, p))?.name})), names = paths.map(nameOf).join(', ');
  editLater(() => {
    const now = objects.map(o => pathNow(o)).filter(Boolean).sort((a, b) => Number(stepsOf(b)[1]) - Number(stepsOf(a)[1]));
    return now.length ? {ops: now.map(p => ({remove: p})), label: `delete ${names}`, paths: now} : null;
  });
  select([]);
}
/** Returns the path of an object after the changes that were sent before; null if it was removed. */
function pathNow({path, name}) {
  if (!name) return path;
  const list = stepsOf(path)[0], i = listOf(list).findIndex(o => o?.name === name);
  return i < 0 ? null : `/${list}/${i}`;
}

/** Returns the paths of all strings that refer to an object by its name. */
function references(name, own, node = store.root, steps = []) {
  if (node.type === 'object') return node.members.flatMap(m => references(name, own, m.node, [...steps, m.key]));
  if (node.type === 'array') return node.items.flatMap((n, i) => references(name, own, n, [...steps, i]));
  if (node.type !== 'string' || node.value !== name) return [];
  const keySteps = typeof steps.at(-1) === 'number' ? steps.slice(0, -1) : steps;
  return at(keySteps, store.value)?.targets?.includes(stepsOf(own)[0]) ? [pathOf(steps)] : [];
}

function rename(path) {
  const item = tree.querySelector(`[data-path="${CSS.escape(path)}"]`), object = valueOf(find(store.root, path));
  if (!item || !object || !isWriter() || renaming) return;
  const before = object.name;
  const input = el('input', {value: before ?? nameOf(path), 'aria-label': 'New name', spellcheck: false});
  renaming = {path, input};
  item.querySelector('.name').replaceChildren(input);
  input.focus();
  input.select();
  const finish = (take, keep) => {
    if (renaming?.input !== input) return;
    renaming = null;
    const name = input.value.trim();
    drawTree();
    if (keep) item.focus({preventScroll: true});
    if (!take || !name || name === before) return;
    editLater(() => {
      const own = pathNow({path, name: before});
      if (!own) return null;
      const ops = [{set: own + '/name', value: JSON.stringify(name)}];
      if (before) for (const place of references(before, own)) ops.push({set: place, value: JSON.stringify(name)});
      return {ops, label: `rename ${before ?? ''} to ${name}`, paths: [own + '/name']};
    });
  };
  input.addEventListener('keydown', event => { event.stopPropagation(); if (event.key === 'Enter') finish(true, true); if (event.key === 'Escape') finish(false, true); });
  input.addEventListener('blur', () => finish(true, false));
  for (const type of ['click', 'dblclick']) input.addEventListener(type, event => event.stopPropagation());
}

// --- Copy and paste, as scene JSON ---
const kNoClipboard = 'The browser does not allow this page to use the clipboard. Ctrl+C and Ctrl+V work.';
const textOf = paths => toText(paths.length === 1 ? valueOf(find(store.root, paths[0])) : paths.map(p => valueOf(find(store.root, p))));

function copyObjects(paths) {
  navigator.clipboard.writeText(textOf(paths)).then(() => toast('Copied as scene JSON.'), () => toast(kNoClipboard));
}
const fromClipboard = take => navigator.clipboard.readText().then(take, () => toast(kNoClipboard));

function parsed(text) {
  const node = parse(text.trim());
  if (!node) toast('The clipboard does not hold scene JSON.');
  return node ? valueOf(node) : undefined;
}
const isObject = v => v !== null && typeof v === 'object' && !Array.isArray(v);

/** Replaces objects by those in the text, one by one. Each keeps its name, so that references to it stay valid. */
function pasteOver(paths, text) {
  const value = parsed(text);
  if (value === undefined) return;
  const values = Array.isArray(value) ? value : [value];
  if (!values.every(isObject)) return toast('The clipboard holds a value, not an object.');
  if (values.length !== 1 && values.length !== paths.length) return toast(`The clipboard holds ${values.length} objects; select as many to replace them.`);
  const ops = paths.map((p, i) => {
    const name = valueOf(find(store.root, p))?.name, next = values.length === 1 ? values[0] : values[i];
    return {set: p, value: toText(name ? {...next, name} : next, kIndent)};
  });
  edit(ops, `paste over ${paths.map(nameOf).join(', ')}`, paths);
}
function pasteNew(list, text) {
  const value = parsed(text), values = Array.isArray(value) ? value : [value];
  if (value === undefined) return;
  if (!values.every(isObject)) return toast('The clipboard holds a value, not an object.');
  addAll(values.map(v => [list, v]), 'paste');
}

/**
 * The target of Ctrl+C and Ctrl+V at the current focus: the value of a control, the selected objects, or null for plain
 * text.
 */
function clipTarget() {
  const focus = document.activeElement, row = focus?.closest?.('#controls .row');
  if (!focus || focus.matches('input:not([type=checkbox]):not([type=color]), textarea, select')) return null;
  if (row) return {row: row.dataset.path, key: row.dataset.key};
  return tree.contains(focus) && store.selection.length ? {objects: store.selection} : null;
}
addEventListener('copy', event => {
  const target = clipTarget();
  if (!target || !getSelection().isCollapsed) return;
  const value = target.row && rowValue(target.row);
  event.clipboardData.setData('text/plain', target.row ? toText(value) : textOf(target.objects));
  event.preventDefault();
  toast('Copied as scene JSON.');
});
addEventListener('paste', event => {
  const target = clipTarget();
  if (!target || !isWriter()) return;
  event.preventDefault();
  const text = event.clipboardData.getData('text/plain');
  if (target.objects) return pasteOver(target.objects, text);
  const value = parsed(text);
  if (value !== undefined) setValue(target.row, value, `paste ${target.key}`);
});
// The controls know the defaults of values that the text omits.
let rowValue = path => valueOf(find(store.root, path));
export function setRowValue(f) { rowValue = f; }

function menu(path, anchor) {
  const many = store.selection.includes(path) && store.selection.length > 1 ? store.selection : [path];
  const entry = (text, run, title) => el('button', {class: 'entry', title, onclick: () => { close(); if (many.every(p => find(store.root, p))) run(); }}, text);  // an object may have been removed meanwhile
  const close = popover(anchor, nameOf(path), el('div', {class: 'menu'},
    entry(many.length > 1 ? `Duplicate ${many.length} objects` : 'Duplicate', () => duplicate(many)), entry('Rename', () => rename(path)),
    entry('Copy', () => copyObjects(many), 'As scene JSON (Ctrl+C)'), entry('Paste over', () => fromClipboard(text => pasteOver(many, text)), 'Replace it by the scene JSON in the clipboard (Ctrl+V)'),
    entry('Paste as new', () => fromClipboard(text => pasteNew(stepsOf(path)[0], text)), 'Add the scene JSON in the clipboard to the same list'),
    entry('Show in the text', () => emit('show-text', path)), entry(many.length > 1 ? `Delete ${many.length} objects` : 'Delete', () => remove(many))));
}

tree.addEventListener('keydown', event => {
  const all = [...tree.querySelectorAll('.item')], at = all.findIndex(i => i.dataset.path === store.selection.at(-1));
  const step = {ArrowDown: 1, ArrowUp: -1}[event.key], path = store.selection.at(-1);
  if (event.target.tagName === 'INPUT') return;
  if (step) {
    const next = all[Math.min(all.length - 1, Math.max(0, at + step))];
    choose(next.dataset.path, event.shiftKey ? {ctrlKey: true} : {});
    event.preventDefault();
    event.stopPropagation();
  } else if (event.key === 'F2' && path && stepsOf(path).length > 1) rename(path);
  else if (event.key === 'Delete' && store.selection.every(p => stepsOf(p).length > 1) && path) remove(store.selection);
  else if ((event.ctrlKey || event.metaKey) && event.key === 'd' && path && stepsOf(path).length > 1) { event.preventDefault(); duplicate(store.selection.filter(p => stepsOf(p).length > 1)); }
});

on('document selection', drawTree);
byId('search').addEventListener('input', () => { drawTree(); emit('search'); });

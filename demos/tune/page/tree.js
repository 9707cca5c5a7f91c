// The objects of the scene as a tree, and what can be done with them.

import {byId, el, popover, toast} from './dom.js';
import {store, on, emit, edit, select, view, isWriter} from './store.js';
import {find, toText, parse, valueOf, stepsOf} from './jsonc.js';
import {kLists, kSettings, label} from './schema.js';

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
    (store.value[list] ?? []).forEach?.((_, i) => paths.push(`/${list}/${i}`));
  return paths;
}

function iconButton(text, title, run) {
  return el('button', {class: 'icon quiet', title, 'aria-label': title, onclick: event => { event.stopPropagation(); run(event); }}, text);
}

function row(path, depth, problems) {
  const chosen = store.selection.includes(path), muted = isMuted(path);
  const bad = problems.errors.some(p => p === path || p.startsWith(path + '/')), warned = problems.warnings.some(p => p === path || p.startsWith(path + '/'));
  const item = el('div', {
    class: 'item' + (chosen ? ' chosen' : '') + (muted ? ' muted' : ''), role: 'treeitem', tabIndex: chosen ? 0 : -1, 'aria-selected': String(chosen),
    'data-path': path, style: `--depth:${depth}`,
    onclick: event => choose(path, event), ondblclick: () => stepsOf(path).length > 1 && rename(path),
  }, el('span', {class: 'name'}, nameOf(path)), bad ? el('span', {class: 'mark bad', title: 'has an error'}, '●') : warned ? el('span', {class: 'mark warn', title: 'has a warning'}, '●') : null);
  if (stepsOf(path).length > 1 && kMutable.includes(stepsOf(path)[0]))
    item.append(iconButton(muted ? '○' : '◉', muted ? 'Muted: the film leaves it out. Click to bring it back' : 'Mute: leave it out of the film', () => mute(path)));
  if (stepsOf(path).length > 1) item.append(iconButton('⋯', 'Duplicate, rename, copy, delete', event => menu(path, event.currentTarget)));
  return item;
}

export function drawTree() {
  if (!store.root) return;
  const query = byId('search').value.trim().toLowerCase();
  const problems = {errors: (store.doc?.errors ?? []).map(p => p.path), warnings: (store.doc?.warnings ?? []).map(p => p.path)};
  const rows = [];
  for (const list of kLists) {
    const items = store.value[list];
    if (!Array.isArray(items) || !items.length) continue;
    const paths = items.map((_, i) => `/${list}/${i}`).filter(p => !query || matches(p, query));
    if (!paths.length) continue;
    rows.push(el('div', {class: 'list-name'}, label(list), el('span', {class: 'count'}, String(items.length))));
    rows.push(...paths.map(p => row(p, 1, problems)));
  }
  rows.push(el('div', {class: 'list-name'}, 'Scene'));
  rows.push(...kSettings.map(k => '/' + k).filter(p => !query || matches(p, query)).map(p => row(p, 1, problems)));
  tree.replaceChildren(...rows);
  if (!rows.some(r => r.classList.contains('item'))) tree.append(el('p', {class: 'empty'}, 'Nothing of that name.'));
}

function matches(path, query) {
  const has = value => value && typeof value === 'object' && Object.entries(value).some(([k, v]) => k.replace(/_/g, ' ').includes(query.replace(/_/g, ' ')) || has(v));
  return nameOf(path).toLowerCase().includes(query) || has(valueOf(find(store.root, path))) || emitSearch(path, query);
}
// The controls know the keys that the text does not have.
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

function freeName(list, name) {
  const taken = new Set((store.value[list] ?? []).map(o => o.name));
  const stem = name.replace(/_?\d+$/, '');
  for (let i = 2; ; i++) if (!taken.has(`${stem}_${i}`)) return `${stem}_${i}`;
}

export function duplicate(path) {
  const [list, i] = stepsOf(path), value = structuredClone(store.value[list][i]);
  if (value.name) value.name = freeName(list, value.name);
  addTo(list, value, `duplicate ${nameOf(path)}`);
}

/** Adds an object at the end of a list and selects it. */
export async function addTo(list, value, what) {
  const index = (store.value[list] ?? []).length, indent = store.root.members.find(m => m.key === list)?.node.items.length ? 4 : 4;
  if (await edit([{set: `/${list}/${index}`, value: toText(value, indent)}], what, [`/${list}/${index}`]))
    select([`/${list}/${index}`]);
}

export function remove(paths) {
  const sorted = [...paths].sort((a, b) => Number(stepsOf(b)[1]) - Number(stepsOf(a)[1]));
  const names = paths.map(nameOf).join(', ');
  edit(sorted.map(p => ({remove: p})), `delete ${names}`, paths);
  select([]);
}

/** Strings elsewhere that name the object. */
function references(name, own, node = store.root, path = '', key = '') {
  if (node.type === 'object') return node.members.flatMap(m => references(name, own, m.node, `${path}/${m.key}`, m.key));
  if (node.type === 'array') return node.items.flatMap((n, i) => references(name, own, n, `${path}/${i}`, key));
  if (node.type !== 'string' || path.startsWith(own + '/name') || /^(name|description|text|file|texture|type|preset|style)$/.test(key)) return [];
  return node.value === name ? [path] : [];
}

function rename(path) {
  const item = tree.querySelector(`[data-path="${CSS.escape(path)}"] .name`), [list, i] = stepsOf(path), before = store.value[list][i].name;
  if (!item || !isWriter()) return;
  const input = el('input', {value: before ?? nameOf(path), 'aria-label': 'New name', spellcheck: false});
  item.replaceChildren(input);
  input.focus();
  input.select();
  let over = false;
  const finish = take => {
    if (over) return;
    over = true;
    const name = input.value.trim();
    drawTree();
    if (!take || !name || name === before) return;
    const ops = [{set: path + '/name', value: JSON.stringify(name)}];
    if (before) for (const place of references(before, path)) ops.push({set: place, value: JSON.stringify(name)});
    edit(ops, `rename ${before ?? ''} to ${name}`, [path + '/name']);
  };
  input.addEventListener('keydown', event => { event.stopPropagation(); if (event.key === 'Enter') finish(true); if (event.key === 'Escape') finish(false); });
  input.addEventListener('blur', () => finish(true));
  input.addEventListener('click', event => event.stopPropagation());
}

export function copyObjects(paths) {
  const text = toText(paths.length === 1 ? valueOf(find(store.root, paths[0])) : paths.map(p => valueOf(find(store.root, p))));
  navigator.clipboard.writeText(text).then(() => toast('Copied as scene JSON.'), () => toast('The browser did not allow copying.'));
}
export async function pasteOver(path) {
  let value = null;
  try { value = valueOf(parse(await navigator.clipboard.readText())); } catch { return toast('The browser did not allow pasting.'); }
  if (!value || typeof value !== 'object') return toast('The clipboard holds no scene JSON.');
  const name = valueOf(find(store.root, path))?.name;
  if (name && !Array.isArray(value)) value.name = name;
  edit([{set: path, value: toText(value, 4)}], `paste over ${nameOf(path)}`, [path]);
}

function menu(path, anchor) {
  const many = store.selection.includes(path) && store.selection.length > 1 ? store.selection : [path];
  const entry = (text, run, title) => el('button', {class: 'entry', title, onclick: () => { close(); run(); }}, text);
  const close = popover(anchor, nameOf(path), el('div', {class: 'menu'},
    entry('Duplicate', () => many.forEach(duplicate)), entry('Rename', () => rename(path)),
    entry('Copy', () => copyObjects(many), 'As scene JSON'), entry('Paste over', () => pasteOver(path), 'Replace it by the scene JSON in the clipboard'),
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
  else if ((event.ctrlKey || event.metaKey) && event.key === 'c' && path) copyObjects(store.selection);
  else if ((event.ctrlKey || event.metaKey) && event.key === 'v' && path) pasteOver(path);
  else if ((event.ctrlKey || event.metaKey) && event.key === 'd' && path && stepsOf(path).length > 1) { event.preventDefault(); duplicate(path); }
});

on('document selection', drawTree);
byId('search').addEventListener('input', () => { drawTree(); emit('search'); });

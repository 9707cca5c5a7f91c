// Interaction with the picture: moving the camera, selecting and dragging objects, and the marks of emitters and
// positions.

import {byId, el, oncePerFrame, newGroup, toast} from './dom.js';
import {store, on, send, view as setView, select, edit, isWriter, listOf} from './store.js';
import {find, valueOf, stepsOf, toText} from './jsonc.js';
import {view, comparing} from './viewer.js';
import {objectPaths, nameOf} from './tree.js';

const stage = byId('stage'), canvas = byId('film'), marks = byId('marks');
export const local = {emitters: false};

// --- Vectors ---
const add = (a, b, s = 1) => a.map((x, i) => x + s * b[i]);
const sub = (a, b) => a.map((x, i) => x - b[i]);
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const length = a => Math.hypot(...a);
const unit = a => { const n = length(a) || 1; return a.map(x => x / n); };
const tidy = a => a.map(x => Number(x.toFixed(3)));

/** The screen rectangle of the edited version's picture; in the side-by-side view it is the right one. */
function pictureBox() {
  const box = canvas.getBoundingClientRect(), half = box.width / 2;
  return comparing() === 'side' ? new DOMRect(box.left + half, box.top, half, box.height) : box;
}

function frameOf(camera) {
  const forward = unit(sub(camera.target, camera.eye));
  const up = Math.abs(forward[1]) > 0.999 ? [0, 0, -1] : [0, 1, 0];
  const right = unit(cross(forward, up));
  return {forward, right, up: cross(right, forward), scale: Math.tan(camera.fov * Math.PI / 360), shape: canvas.width / canvas.height / (comparing() === 'side' ? 2 : 1)};
}
/** The position of a world point in the picture, from 0 to 1; null behind the camera. */
function project(point, camera) {
  const f = frameOf(camera), d = sub(point, camera.eye), z = dot(d, f.forward);
  if (z < 0.01) return null;
  return [0.5 + dot(d, f.right) / (z * f.scale * f.shape) / 2, 0.5 - dot(d, f.up) / (z * f.scale) / 2];
}
function rayAt(x, y, camera) {
  const f = frameOf(camera);
  return unit(add(add(f.forward, f.right, (2 * x - 1) * f.scale * f.shape), f.up, (1 - 2 * y) * f.scale));
}
function onPlane(ray, eye, point, normal) {
  const slope = dot(ray, normal);
  const t = Math.abs(slope) < 1e-6 ? -1 : dot(sub(point, eye), normal) / slope;
  return t > 0 ? add(eye, ray, t) : null;
}

// --- Where objects are ---
/** The path and value of an object's position; null if it has no position that can be dragged. */
export function placeOf(path) {
  const steps = stepsOf(path), value = valueOf(find(store.root, path));
  if (!value || steps.length !== 2) return null;
  if (steps[0] === 'emitters') return {path: path + '/surface/position', at: value.surface?.position ?? [0, 0, 0], free: !value.body && value.surface?.type !== 'mesh'};
  if (!['bodies', 'effects', 'cloths', 'articulations', 'lights'].includes(steps[0]) || (steps[0] === 'lights' && value.type === 'sun')) return null;
  if (!value.position && (value.type === 'sun' || value.shape?.type === 'plane')) return null;
  return {path: path + '/position', at: value.position ?? [0, 0, 0], free: steps[0] === 'bodies' ? true : !value.body};
}
/**
 * The position in world coordinates according to the text. For an emitter on a body, the body's initial position is
 * used.
 */
function worldPlace(path) {
  const place = placeOf(path);
  if (!place) return null;
  const owner = valueOf(find(store.root, path))?.body;
  const body = owner && listOf('bodies').find(b => b?.name === owner);
  return body ? add(place.at, body.position ?? [0, 0, 0]) : place.at;
}

export const drawMarks = oncePerFrame(() => {
  const camera = view.camera, whole = canvas.getBoundingClientRect(), box = pictureBox(), shapes = [];
  marks.setAttribute('viewBox', `0 0 ${whole.width} ${whole.height}`);
  const screen = p => { const q = camera && project(p, camera); return q && [box.left - whole.left + q[0] * box.width, q[1] * box.height]; };
  if (camera && local.emitters)
    listOf('emitters').forEach((e, i) => shapes.push(...emitterMark(e, `/emitters/${i}`, screen)));
  for (const path of store.selection) {
    const place = worldPlace(path), at = place && screen(place);
    if (!at) continue;
    shapes.push(el('circle', {cx: at[0], cy: at[1], r: 9, class: 'handle'}), el('circle', {cx: at[0], cy: at[1], r: 2.5, class: 'handle-dot'}));
  }
  marks.replaceChildren(...shapes);
});

function emitterMark(emitter, path, screen) {
  const centre = worldPlace(path), s = emitter.surface ?? {}, n = unit(s.direction ?? [0, 1, 0]);
  const a = unit(cross(n, Math.abs(n[1]) > 0.9 ? [1, 0, 0] : [0, 1, 0])), b = cross(n, a);
  const round = s.type === 'disc' || s.type === 'sphere', rx = round ? s.radius ?? 0.5 : (s.size?.[0] ?? 1) / 2, ry = round ? rx : (s.size?.[1] ?? 1) / 2;
  const ring = Array.from({length: round ? 24 : 4}, (_, i) => {
    const t = round ? i / 24 * 2 * Math.PI : 0, [u, v] = round ? [Math.cos(t) * rx, Math.sin(t) * rx] : [[rx, ry], [-rx, ry], [-rx, -ry], [rx, -ry]][i];
    return screen(add(add(centre, a, u), b, v));
  });
  const speed = typeof emitter.speed === 'number' ? emitter.speed : emitter.speed?.mean ?? 1;
  const from = screen(centre), to = screen(add(centre, emitter.direction?.some(Boolean) ? unit(emitter.direction) : n, 0.15 + 0.05 * speed));
  const shapes = [];
  if (!['mesh', 'face'].includes(s.type) && ring.every(Boolean)) shapes.push(el('polygon', {points: ring.map(p => p.join()).join(' '), class: 'emitter'}));
  if (from && to) shapes.push(el('line', {x1: from[0], y1: from[1], x2: to[0], y2: to[1], class: 'emitter'}), el('circle', {cx: to[0], cy: to[1], r: 3, class: 'emitter-tip'}));
  return shapes;
}

// --- The camera of the view ---
let looking = null;
const sendCamera = oncePerFrame(() => { if (looking) setView({camera: {eye: looking.eye, target: looking.target}}); });
function look(camera) {
  looking = camera;
  view.camera = {...view.camera, ...camera};
  drawMarks();
  sendCamera();
}
on('document', () => {
  const own = store.doc.camera;
  if (!own) looking = null;
  for (const id of ['camera-reset', 'camera-write']) byId(id).hidden = !own;
  drawMarks();
});
byId('camera-reset').addEventListener('click', () => setView({camera: null}));
byId('camera-write').addEventListener('click', async () => {
  if (!store.doc.camera) return;
  const now = store.value.camera ?? {}, keep = ['fov_deg', 'focal_mm', 'aperture', 'focus', 'focus_on'];
  const camera = {type: 'static', eye: tidy(store.doc.camera.eye), target: tidy(store.doc.camera.target), ...Object.fromEntries(keep.filter(k => k in now).map(k => [k, now[k]]))};
  // The field of view of these cameras comes from the model file or from keyframes.
  if (!('focal_mm' in now) && (now.type === 'model' || now.keyframes?.some(k => 'fov_deg' in k))) camera.fov_deg = tidy([view.camera.fov])[0];
  if (await edit([{set: '/camera', value: toText(camera)}], 'camera', ['/camera'])) { setView({camera: null}); toast('The camera was written to the scene.'); }
});

function orbit(start, dx, dy) {
  const d = sub(start.eye, start.target), r = length(d);
  const angle = Math.atan2(d[0], d[2]) - dx * 0.008, pitch = Math.min(1.5, Math.max(-1.5, Math.asin(d[1] / r) + dy * 0.008));
  return {target: start.target, eye: add(start.target, [Math.sin(angle) * Math.cos(pitch) * r, Math.sin(pitch) * r, Math.cos(angle) * Math.cos(pitch) * r])};
}
function pan(start, dx, dy) {
  const f = frameOf(start), size = pictureBox(), step = 2 * f.scale * length(sub(start.target, start.eye)) / size.height;
  const by = add(f.right.map(x => -x * dx * step), f.up, dy * step);
  return {eye: add(start.eye, by), target: add(start.target, by)};
}

function shareAt(event) {
  const box = pictureBox();
  return [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height];
}

/** The selected object whose mark is under the pointer. */
function grabbed(event) {
  const [x, y] = shareAt(event), box = pictureBox();
  return view.camera && store.selection.find(path => {
    const place = placeOf(path), at = place?.free && project(worldPlace(path), view.camera);
    return at && Math.hypot((at[0] - x) * box.width, (at[1] - y) * box.height) < 14;
  });
}

stage.addEventListener('contextmenu', event => event.preventDefault());
stage.addEventListener('pointerdown', event => {
  if (!view.camera || event.target.closest('button')) return;
  stage.focus({preventScroll: true});
  stage.setPointerCapture(event.pointerId);
  const camera = {...view.camera}, start = [event.clientX, event.clientY], held = event.button === 0 && isWriter() ? grabbed(event) : null;
  if (!camera.eye) return;
  const mover = held ? objectMover(held, camera) : null;
  let moved = false;
  const move = e => {
    const dx = e.clientX - start[0], dy = e.clientY - start[1];
    if (!moved && Math.hypot(dx, dy) < 4) return;
    moved = true;
    stage.classList.add('dragging');
    if (mover) return mover(e);
    if (isWriter()) look({...(event.button === 2 || event.button === 1 || e.shiftKey ? pan(camera, dx, dy) : orbit(camera, dx, dy))});
  };
  const end = e => {
    stage.removeEventListener('pointermove', move);
    stage.removeEventListener('pointerup', end);
    stage.removeEventListener('pointercancel', end);
    stage.classList.remove('dragging');
    if (!moved && event.button === 0 && e.type === 'pointerup') pick(event);
  };
  stage.addEventListener('pointermove', move);
  stage.addEventListener('pointerup', end);
  stage.addEventListener('pointercancel', end);
});
stage.addEventListener('wheel', event => {
  if (!view.camera || !isWriter()) return;
  event.preventDefault();
  const camera = view.camera, scale = Math.exp(Math.max(-0.5, Math.min(0.5, event.deltaY * 0.0012)));
  look({target: camera.target, eye: add(camera.target, sub(camera.eye, camera.target), scale)});
}, {passive: false});

/**
 * Moves the selected objects in the horizontal plane through one of them; with Alt, in the vertical plane that faces
 * the camera.
 */
function objectMover(path, camera) {
  const start = placeOf(path).at, group = newGroup();
  const moved = store.selection.map(p => ({path: p, place: placeOf(p)})).filter(m => m.place?.free);
  const facing = unit([camera.eye[0] - start[0], 0, camera.eye[2] - start[2]]);
  const level = Math.abs(dot(unit(sub(start, camera.eye)), [0, 1, 0])) > 0.08;
  return event => {
    const [x, y] = shareAt(event), normal = event.altKey || !level ? facing : [0, 1, 0];
    const at = onPlane(rayAt(x, y, camera), camera.eye, start, normal);
    if (!at || length(sub(at, start)) > 200) return;
    const by = sub(at, start), ops = moved.map(m => ({set: m.place.path, value: toText(tidy(add(m.place.at, by)))}));
    edit(ops, 'position', ops.map(op => op.set), group);
  };
}

/** Selects the object under the pointer; if there is no solid object, the emitter with the nearest mark. */
async function pick(event) {
  const [x, y] = shareAt(event);
  if (x < 0 || x > 1 || y < 0 || y > 1) return;
  const {status, body} = await send('pick', {frame: Math.max(1, view.shownFrame), x, y});
  if (status !== 200) return;
  const paths = objectPaths(), named = name => paths.find(p => nameOf(p) === name);
  const name = body.name, stem = name.split('/')[0];
  const found = name && (named(name) ?? named(stem) ?? paths.find(p => new RegExp(`^${escapeRegex(nameOf(p))}_[0-9_]+$`).test(stem)));
  const path = found && !isGround(found) ? found : nearestMark(x, y) ?? found;
  if (path) select(event.ctrlKey || event.metaKey ? [...store.selection.filter(p => p !== path), path] : [path]);
}
const escapeRegex = s => s.replace(/[.*+?^${}()|[\]\\]/g, '\\$&');
const isGround = path => valueOf(find(store.root, path))?.shape?.type === 'plane';
function nearestMark(x, y) {
  const box = pictureBox();
  const near = objectPaths().filter(p => /^\/(emitters|effects)\//.test(p)).map(p => {
    const place = worldPlace(p), at = place && project(place, view.camera);
    return {p, d: at ? Math.hypot((at[0] - x) * box.width, (at[1] - y) * box.height) : Infinity};
  }).sort((a, b) => a.d - b.d)[0];
  return near?.d < 28 ? near.p : null;
}

on('painted selection', drawMarks);

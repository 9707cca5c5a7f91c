// Helper functions for DOM elements.

export const byId = id => document.getElementById(id);

/** Creates an element with attributes, listeners (on...) and children; children that are null or false are omitted. */
export function el(tag, attributes = {}, ...children) {
  const node = tag === 'svg' || svgTags.has(tag) ? document.createElementNS('http://www.w3.org/2000/svg', tag) : document.createElement(tag);
  for (const [key, value] of Object.entries(attributes)) {
    if (value === null || value === undefined || value === false) continue;
    if (key.startsWith('on')) node.addEventListener(key.slice(2), value);
    else if (key === 'class') node.setAttribute('class', value);
    else if (key in node && key !== 'list' && !svgTags.has(tag) && tag !== 'svg' && key !== 'style') node[key] = value;
    else node.setAttribute(key, value === true ? '' : value);
  }
  node.append(...children.flat().filter(c => c !== null && c !== undefined && c !== false));
  return node;
}
const svgTags = new Set(['path', 'circle', 'line', 'rect', 'g', 'polyline', 'text_', 'polygon']);

export const clamp = (x, low, high) => Math.min(high, Math.max(low, x));

export function toast(text, action = null) {
  const box = el('div', {class: 'toast'}, el('span', {}, text));
  if (action) box.append(el('button', {class: 'quiet', onclick: () => { action.run(); box.remove(); }}, action.label));
  byId('toasts').append(box);
  setTimeout(() => box.remove(), action ? 9000 : 5000);
}

/** Opens a panel below a button. A click elsewhere or Escape closes it. Returns the function that closes it. */
export function popover(anchor, title, content, wide = false) {
  const box = byId('popover');
  box.replaceChildren(el('div', {class: 'popover-head'}, el('strong', {}, title),
    el('button', {class: 'icon quiet', title: 'Close (Esc)', 'aria-label': 'Close', onclick: () => close()}, '×')), content);
  box.classList.toggle('wide', wide);
  box.hidden = false;
  const place = anchor.getBoundingClientRect(), size = box.getBoundingClientRect();
  box.style.left = clamp(place.left, 8, Math.max(8, innerWidth - size.width - 8)) + 'px';
  box.style.top = Math.max(8, Math.min(place.bottom + 6, innerHeight - size.height - 8)) + 'px';
  const onDown = event => { if (!box.contains(event.target) && !anchor.contains(event.target)) close(); };
  const onKey = event => { if (event.key === 'Escape') { close(); anchor.focus(); } };
  function close() {
    box.hidden = true;
    removeEventListener('pointerdown', onDown, true);
    removeEventListener('keydown', onKey, true);
    box.dispatchEvent(new Event('closed'));
  }
  if (box.closeOpen) box.closeOpen();
  box.closeOpen = () => { box.closeOpen = null; removeEventListener('pointerdown', onDown, true); removeEventListener('keydown', onKey, true); box.dispatchEvent(new Event('closed')); };
  addEventListener('pointerdown', onDown, true);
  addEventListener('keydown', onKey, true);
  const first = box.querySelector('input, select, textarea, .card') ?? box.querySelector('button');
  first?.focus();
  return close;
}

/** Returns a function that calls f at most once per screen frame, with the latest arguments. */
export function oncePerFrame(f) {
  let waiting = false, latest;
  return (...all) => {
    latest = all;
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(() => { waiting = false; f(...latest); });
  };
}

/** Calls f at once, but then only once in `ms`; the last call is never lost. For what follows the arriving frames. */
export function atMostEvery(ms, f) {
  let last = -ms, waiting = 0;
  const run = () => { clearTimeout(waiting); waiting = 0; last = performance.now(); f(); };
  return () => {
    if (waiting) return;
    const rest = last + ms - performance.now();
    rest <= 0 ? run() : waiting = setTimeout(run, rest);
  };
}

/** Sets the size of a canvas to that of its box, in pixels of the screen. A canvas of this size already is only cleared. */
export function fitCanvas(canvas, box) {
  const ratio = devicePixelRatio || 1, width = Math.floor(box.width * ratio), height = Math.floor(box.height * ratio);
  if (canvas.width !== width || canvas.height !== height) { canvas.width = width; canvas.height = height; }
  else canvas.getContext('2d').clearRect(0, 0, width, height);
}

/** Follows a drag that began with a pointerdown event: calls move(event, dx, dy) and finally end(). */
export function drag(event, move, end = () => {}) {
  const target = event.currentTarget, x = event.clientX, y = event.clientY;
  target.setPointerCapture(event.pointerId);
  const onMove = e => move(e, e.clientX - x, e.clientY - y);
  const onEnd = e => {
    target.removeEventListener('pointermove', onMove);
    target.removeEventListener('pointerup', onEnd);
    target.removeEventListener('pointercancel', onEnd);
    end(e);
  };
  target.addEventListener('pointermove', onMove);
  target.addEventListener('pointerup', onEnd);
  target.addEventListener('pointercancel', onEnd);
}

let groups = 0;
/** Returns a new group name; changes of the same group are one undo step. */
export const newGroup = () => 'g' + Date.now().toString(36) + (++groups);

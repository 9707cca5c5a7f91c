// A number with a slider. Shift makes drags ten times finer, arrow keys move by one step, and the value can be typed.

import {el, clamp, drag, newGroup} from './dom.js';
import {numberText} from './jsonc.js';

const kDecades = 50;   // without limits, a slider covers value / 50 to value * 50
const kLogFrom = 100;  // a slider is logarithmic if the ratio of its limits is at least this

/** Returns the slider's scale for a value within limits. */
export function scaleFor(value, limits, whole) {
  const {min, max} = limits;
  const size = Math.abs(value) || 1;
  if (Number.isFinite(min) && Number.isFinite(max)) {
    if (min > 0 && max / min >= kLogFrom) return logarithmic(min, max, whole);
    if (max - min <= 1000) return linear(min, max, whole);
  }
  if (value > 0 && min >= 0) {
    const low = min > 0 ? Math.max(min, value / kDecades) : value / kDecades;
    return logarithmic(low, Number.isFinite(max) ? Math.min(max, value * kDecades) : value * kDecades, whole);
  }
  if (min >= 0) return linear(min, Number.isFinite(max) ? Math.min(max, 1) : 1, whole);
  const reach = niceAbove(size * 2);
  return linear(Math.max(min, -reach), Math.min(max, reach), whole);
}

function niceAbove(x) {
  const power = 10 ** Math.floor(Math.log10(x));
  return [1, 2, 5, 10].map(f => f * power).find(v => v >= x * 0.999);
}

function linear(low, high, whole) {
  const span = high - low || 1;
  const step = whole ? 1 : 10 ** Math.floor(Math.log10(span / 100));
  const digits = Math.max(0, -Math.floor(Math.log10(step)));
  const rounded = (x, fine = 1) => whole ? Math.round(x) : Number((Math.round(x / (step * fine)) * step * fine).toFixed(digits + (fine < 1 ? 1 : 0)));
  return {
    low, high, to: x => (x - low) / span, from: (s, fine) => rounded(low + s * span, fine),
    stepped: (x, steps) => rounded(x + steps * step, Math.abs(steps) < 1 ? 0.1 : 1), logarithmic: false,
  };
}

function logarithmic(low, high, whole) {
  const a = Math.log(low), span = Math.log(high) - a || 1;
  const rounded = (x, fine = 1) => whole ? Math.round(x) : Number(x.toPrecision(fine < 1 ? 4 : 3));
  return {
    low, high, to: x => (Math.log(Math.max(x, low)) - a) / span, from: (s, fine) => rounded(Math.exp(a + s * span), fine),
    stepped: (x, steps) => { const next = rounded(x * 1.05 ** steps, Math.abs(steps) < 1 ? 0.1 : 1); return whole && next === x ? x + Math.sign(steps) : next; },
    logarithmic: true,
  };
}

function withinLimits(x, limits, scale) {
  let value = clamp(x, limits.min ?? -Infinity, limits.max ?? Infinity);
  if (limits.openMin && value <= limits.min) value = scale.low > limits.min ? scale.low : limits.min + 1e-6;
  if (limits.openMax && value >= limits.max) value = limits.max - 1e-6;
  return value;
}

/** {element, set(value)}. `change(value, group)` is called during a drag; all calls of one drag have the same group. */
export function numberField({value, limits = {min: -Infinity, max: Infinity}, whole = false, unit = '', name, change, small = false}) {
  let now = value, scale = scaleFor(value, limits, whole), group = null, groupTime = 0;
  const input = el('input', {type: 'text', inputMode: 'decimal', spellcheck: false, 'aria-label': name, autocomplete: 'off'});
  const fill = el('div', {class: 'fill'});
  const track = el('div', {class: 'track', role: 'slider', tabIndex: 0, 'aria-label': name}, fill);
  const element = el('div', {class: 'number' + (small ? ' small' : '')}, small ? null : track, input, unit ? el('span', {class: 'unit'}, unit) : null);

  function show() {
    input.value = numberText(now);
    fill.style.width = clamp(scale.to(now), 0, 1) * 100 + '%';
    track.setAttribute('aria-valuenow', now);
    track.setAttribute('aria-valuemin', scale.low);
    track.setAttribute('aria-valuemax', scale.high);
  }
  function take(next, g) {
    const value_ = withinLimits(next, limits, scale);
    if (!Number.isFinite(value_) || value_ === now) return show();
    now = value_;
    show();
    change(now, g);
  }
  track.addEventListener('pointerdown', event => {
    if (event.button !== 0) return;
    track.focus();
    group = newGroup();
    let last = event.clientX;
    const width = track.getBoundingClientRect().width;
    let share = clamp(scale.to(now), 0, 1);
    drag(event, e => {
      const fine = e.shiftKey ? 0.1 : 1;
      share = clamp(share + (e.clientX - last) / width * fine, 0, 1);
      last = e.clientX;
      take(scale.from(share, fine), group);
    }, () => { if (scale.to(now) < 0.02 || scale.to(now) > 0.98) { scale = scaleFor(now, limits, whole); show(); } });
  });
  const onArrow = event => {
    const direction = {ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1}[event.key];
    if (!direction || (event.target === input && !['ArrowUp', 'ArrowDown'].includes(event.key))) return;
    event.preventDefault();
    event.stopPropagation();
    if (performance.now() - groupTime > 800) group = newGroup();
    groupTime = performance.now();
    take(scale.stepped(now, direction * (event.shiftKey ? 0.1 : 1)), group);
  };
  track.addEventListener('keydown', onArrow);
  input.addEventListener('keydown', event => {
    onArrow(event);
    if (event.key === 'Enter') { commit(); input.select(); }
    if (event.key === 'Escape') { show(); input.blur(); }
  });
  if (small) scrubbed(input, () => now, () => scale, take);
  function commit() {
    const typed = Number(input.value.trim().replace(',', '.'));
    if (input.value.trim() === '' || !Number.isFinite(typed)) return show();
    if (typed === now) return show();
    now = withinLimits(whole ? Math.round(typed) : typed, limits, scale);
    scale = scaleFor(now, limits, whole);
    show();
    change(now, newGroup());
  }
  input.addEventListener('change', commit);
  input.addEventListener('focus', () => input.select());
  show();
  return {
    element,
    set(next) {
      if (next === now && document.activeElement === input) return;
      const outside = scale.to(next) < 0 || scale.to(next) > 1;
      now = next;
      if (outside) scale = scaleFor(next, limits, whole);
      if (document.activeElement !== input) show(); else fill.style.width = clamp(scale.to(now), 0, 1) * 100 + '%';
    },
  };
}

/** Makes a small field change when it is dragged sideways. A click without a drag starts typing. */
function scrubbed(input, now, scale, take) {
  input.addEventListener('pointerdown', event => {
    if (document.activeElement === input) return;
    event.preventDefault();
    const group = newGroup(), start = now();
    let moved = false;
    drag(event, (e, dx) => {
      if (Math.abs(dx) > 3) moved = true;
      if (moved) take(scale().stepped(start, Math.trunc(dx / 3) * (e.shiftKey ? 0.1 : 1)), group);
    }, () => { if (!moved) input.focus(); });
  });
}

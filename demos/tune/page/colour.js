// Colours: "#rrggbb[aa]" in sRGB, or linear [r, g, b(, a)], where values above 1 emit light.

import {el, newGroup} from './dom.js';
import {numberField} from './number.js';

const toSrgb = x => x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055;
const toLinear = x => x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4;
const hex2 = x => Math.round(Math.min(1, Math.max(0, x)) * 255).toString(16).padStart(2, '0');
const tidy = x => Number(x.toPrecision(3));

/** Converts any colour to linear [r, g, b, a]. */
export function toRgba(colour) {
  if (Array.isArray(colour)) return [colour[0] ?? 0, colour[1] ?? 0, colour[2] ?? 0, colour[3] ?? 1];
  let digits = String(colour).slice(1);
  if (digits.length < 6) digits = [...digits].map(d => d + d).join('');
  const part = i => parseInt(digits.slice(i, i + 2) || 'ff', 16) / 255;
  return [toLinear(part(0)), toLinear(part(2)), toLinear(part(4)), digits.length > 6 ? part(6) : 1];
}

/** Writes a colour in the form of another one: hexadecimal unless it emits light. */
export function fromRgba(rgba, like) {
  const glows = rgba.slice(0, 3).some(x => x > 1.0001);
  if (!Array.isArray(like) && !glows)
    return '#' + rgba.slice(0, 3).map(x => hex2(toSrgb(x))).join('') + (rgba[3] < 1 || String(like).length === 9 ? hex2(rgba[3]) : '');
  const list = rgba.map(tidy);
  return rgba[3] < 1 || like?.length === 4 ? list : list.slice(0, 3);
}

export function css(colour) {
  const [r, g, b, a] = toRgba(colour), top = Math.max(1, r, g, b);
  return `rgba(${[r, g, b].map(x => Math.round(toSrgb(Math.max(0, x / top)) * 255)).join(',')},${a})`;
}

/** {element, set}: hue by the browser's colour picker, strength for light above 1, opacity. */
export function colourField({value, name, change}) {
  let now = value;
  const pick = el('input', {type: 'color', 'aria-label': name, class: 'swatch'});
  const parts = () => {
    const rgba = toRgba(now), strength = Math.max(1, ...rgba.slice(0, 3));
    return {rgba, strength, hex: '#' + rgba.slice(0, 3).map(x => hex2(toSrgb(x / strength))).join('')};
  };
  let group = newGroup(), quiet = 0;
  const send = (rgba, g) => { now = fromRgba(rgba, now); show(); change(now, g); };
  pick.addEventListener('input', () => {
    clearTimeout(quiet);
    quiet = setTimeout(() => { group = newGroup(); }, 1500);
    const {rgba, strength} = parts(), next = toRgba(pick.value);
    send([...next.slice(0, 3).map(x => x * strength), rgba[3]], group);
  });
  const alpha = numberField({value: toRgba(value)[3], limits: {min: 0, max: 1}, small: true, unit: 'opacity', name: name + ' opacity', change: (a, g) => send([...toRgba(now).slice(0, 3), a], g)});
  const strong = numberField({value: parts().strength, limits: {min: 0, max: 1e6}, small: true, unit: 'strength', name: name + ' strength', change: (s, g) => {
    const {rgba, strength} = parts();
    send([...rgba.slice(0, 3).map(x => x / strength * s), rgba[3]], g);
  }});
  const element = el('div', {class: 'colour'}, pick, alpha.element, strong.element);
  function show() {
    const {rgba, strength, hex} = parts();
    if (pick.value !== hex) pick.value = hex;
    alpha.set(tidy(rgba[3]));
    strong.set(tidy(strength));
    strong.element.hidden = strength <= 1.0001 && !Array.isArray(now);
  }
  show();
  return {element, set(next) { if (JSON.stringify(next) !== JSON.stringify(now)) { now = next; show(); } }};
}

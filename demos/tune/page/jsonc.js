// Parses JSON with comments to a tree with text positions, and writes values as JSON.

const kSpace = /(?:[ \t\r\n]|\/\/[^\n]*|\/\*[^]*?\*\/)*/y;
const kNumber = /-?\d+(?:\.\d+)?(?:[eE][+-]?\d+)?/y;
const kString = /"(?:[^"\\\n]|\\.)*"/y;

class Parser {
  constructor(text) { this.text = text; this.i = text.charCodeAt(0) === 0xfeff ? 1 : 0; }
  skip() { kSpace.lastIndex = this.i; kSpace.test(this.text); this.i = kSpace.lastIndex; }
  match(pattern) {
    pattern.lastIndex = this.i;
    const found = pattern.exec(this.text);
    if (!found) throw new SyntaxError('at ' + this.i);
    this.i = pattern.lastIndex;
    return found[0];
  }
  expect(c) { if (this.text[this.i] !== c) throw new SyntaxError('at ' + this.i); this.i++; }
  value() {
    this.skip();
    const start = this.i, c = this.text[start];
    if (c === '{') return this.object(start);
    if (c === '[') return this.array(start);
    if (c === '"') return {type: 'string', value: JSON.parse(this.match(kString)), start, end: this.i};
    for (const [word, value] of [['true', true], ['false', false], ['null', null]])
      if (this.text.startsWith(word, start)) {
        this.i += word.length;
        return {type: value === null ? 'null' : 'boolean', value, start, end: this.i};
      }
    return {type: 'number', value: Number(this.match(kNumber)), start, end: this.i};
  }
  object(start) {
    const node = {type: 'object', members: [], start, end: 0};
    this.i++;
    for (this.skip(); this.text[this.i] !== '}'; this.skip()) {
      if (node.members.length) { this.expect(','); this.skip(); }
      const keyStart = this.i, key = JSON.parse(this.match(kString));
      this.skip();
      this.expect(':');
      node.members.push({key, keyStart, node: this.value()});
    }
    node.end = ++this.i;
    return node;
  }
  array(start) {
    const node = {type: 'array', items: [], start, end: 0};
    this.i++;
    for (this.skip(); this.text[this.i] !== ']'; this.skip()) {
      if (node.items.length) { this.expect(','); }
      node.items.push(this.value());
    }
    node.end = ++this.i;
    return node;
  }
}

/** Returns the tree of a text, or null if the text is not JSON. */
export function parse(text) {
  try {
    const parser = new Parser(text);
    const root = parser.value();
    parser.skip();
    return parser.i === text.length ? root : null;
  } catch (error) {
    if (error instanceof SyntaxError) return null;
    throw error;
  }
}

export function valueOf(node) {
  if (!node) return undefined;
  if (node.type === 'object') return Object.fromEntries(node.members.map(m => [m.key, valueOf(m.node)]));
  if (node.type === 'array') return node.items.map(valueOf);
  return node.value;
}

export const stepsOf = path => path === '' ? [] : path.slice(1).split('/').map(s => s.replace(/~1/g, '/').replace(/~0/g, '~'));
export const pathOf = steps => steps.map(s => '/' + String(s).replace(/~/g, '~0').replace(/\//g, '~1')).join('');
export const joined = (path, step) => path + pathOf([step]);

export function child(node, step) {
  if (!node) return undefined;
  if (node.type === 'object') return node.members.find(m => m.key === String(step))?.node;
  if (node.type === 'array') return node.items[Number(step)];
  return undefined;
}

export function find(root, path) {
  return stepsOf(path).reduce(child, root);
}

/** Returns the path of the innermost value at a position in the text. */
export function pathAt(root, offset) {
  const steps = [];
  for (let node = root; node;) {
    let next;
    if (node.type === 'object') {
      const member = node.members.find(m => m.keyStart <= offset && offset <= m.node.end);
      if (member) { steps.push(member.key); next = member.node; }
    } else if (node.type === 'array') {
      const i = node.items.findIndex(item => item.start <= offset && offset <= item.end);
      if (i >= 0) { steps.push(i); next = node.items[i]; }
    }
    node = next;
  }
  return pathOf(steps);
}

/** Writes a number as the shortest decimal that is read back exactly. */
export function numberText(x) {
  if (Object.is(x, -0)) return '0';
  return String(x).replace('e+', 'e');
}

/** Writes JSON in the layout of the scene files: on one line if it fits, otherwise with a line for each member. */
export function toText(value, indent = 0, width = 110) {
  const flat = flatText(value);
  if (typeof value !== 'object' || value === null || flat.length + indent <= width) return flat;
  const pad = ' '.repeat(indent + 2), list = Array.isArray(value);
  const parts = list ? value.map(v => toText(v, indent + 2, width))
    : Object.entries(value).map(([k, v]) => JSON.stringify(k) + ': ' + toText(v, indent + 2 + k.length + 4, width));
  return (list ? '[' : '{') + '\n' + parts.map(p => pad + p).join(',\n') + '\n' + ' '.repeat(indent) + (list ? ']' : '}');
}

function flatText(value) {
  if (typeof value === 'number') return numberText(value);
  if (Array.isArray(value)) return '[' + value.map(flatText).join(', ') + ']';
  if (value && typeof value === 'object')
    return '{' + Object.entries(value).map(([k, v]) => JSON.stringify(k) + ': ' + flatText(v)).join(', ') + '}';
  return JSON.stringify(value);
}

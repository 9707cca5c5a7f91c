// Reads from the schema of the scene format, for each value of a scene, the kind of its control, its range, unit,
// default and help.

let schema = null;

export function setSchema(s) { schema = s; }

function resolved(s) {
  let name = null;
  for (let i = 0; s && s.$ref && i < 8; i++) {
    name = s.$ref.split('/').pop();
    s = {...schema.definitions[name], ...Object.fromEntries(Object.entries(s).filter(([k]) => k !== '$ref'))};
  }
  return {schema: s, name};
}

const isObject = s => s && (s.type === 'object' || s.properties);

/** The alternatives of an object that is one of several, distinguished by "type"; null for other schemas. */
function alternatives(s) {
  if (!s.oneOf) return null;
  const all = s.oneOf.map(a => resolved(a));
  return all.every(a => isObject(a.schema) && a.schema.properties?.type?.const) ? all : null;
}

function helpAndUnit(description = '') {
  const found = /^([^]*?)(?: \[([^\]]*)\])?$/.exec(description);
  return {help: found[1], unit: found[2] || ''};
}

function limitsOf(s) {
  return {
    min: s.minimum ?? s.exclusiveMinimum ?? -Infinity, max: s.maximum ?? s.exclusiveMaximum ?? Infinity,
    openMin: s.exclusiveMinimum !== undefined, openMax: s.exclusiveMaximum !== undefined,
  };
}

/** The lists of objects that a string may refer to, judged by its key and help; empty if any text is allowed. */
function targetsOf(key, help) {
  if (/^(name|description|text|file|texture|node|preset|fabric)$/.test(key)) return [];
  if (/^names? of .*\bmaterials?\b/.test(help)) return ['materials'];
  if (/^names? of .*\bbod(y|ies)\b/.test(help)) return ['bodies'];
  if (key === 'particles') return /emitter/.test(help) ? ['emitters', 'particles'] : ['particles'];
  if (key === 'cloths' || key === 'cloth') return ['cloths'];
  if (key === 'joint') return ['joints'];
  return [];
}

const kColourRef = 'colour', kOrientationRef = 'orientation';

/** Describes a value by its schema: its kind and the properties of its control. */
export function describe(s, key = '') {
  const {help, unit} = helpAndUnit(s.description);
  const base = {key, help, unit, fallback: s.default};
  const r = resolved(s);
  const is = r.schema;
  if (r.name?.startsWith('varying')) return {...base, kind: 'varying', limits: limitsOf(resolved(is.oneOf[0]).schema)};
  if (r.name === kColourRef) return {...base, kind: 'colour'};
  if (r.name === kOrientationRef) return {...base, kind: 'orientation'};
  const choices = alternatives(is);
  if (choices) return {...base, kind: 'object', choices};
  if (isObject(is)) return {...base, kind: 'object', object: is, free: !is.properties};
  if (is.enum) return {...base, kind: 'enum', values: is.enum};
  if (is.const !== undefined) return {...base, kind: 'const', value: is.const};
  if (is.type === 'boolean') return {...base, kind: 'boolean'};
  if (is.type === 'integer') return {...base, kind: 'number', whole: true, limits: limitsOf(is)};
  if (is.type === 'number') return {...base, kind: 'number', limits: limitsOf(is)};
  if (is.type === 'string') return {...base, kind: 'string', targets: targetsOf(key, help)};
  if (is.type === 'array') return {...base, ...describeArray(is, key, help)};
  if (is.oneOf?.some(o => o.type === 'number')) return {...base, kind: 'rate', limits: limitsOf(is.oneOf.find(o => o.type === 'number'))};
  return {...base, kind: 'json'};
}

function describeArray(s, key, help) {
  if (Array.isArray(s.items)) return {kind: 'pair', items: s.items};
  const item = resolved(s.items), is = item.schema;
  if (is.type === 'number' || is.type === 'integer')
    return s.minItems && s.minItems === s.maxItems ? {kind: 'vector', size: s.minItems, limits: limitsOf(is), whole: is.type === 'integer', nonzero: !!s.not} : {kind: 'numbers', limits: limitsOf(is)};
  if (is.type === 'array' && Array.isArray(is.items) && is.items.length === 2) {
    const value = describe(is.items[1]);
    return value.kind === 'colour' ? {kind: 'colour_ramp'} : {kind: 'curve', limits: value.limits ?? {}, overAge: true};
  }
  if (is.type === 'string') return {kind: 'names', targets: targetsOf(key, help)};
  if (isObject(is) || alternatives(is)) return {kind: 'list', item: s.items};
  return {kind: 'json'};
}

/** Returns the object schema for a value; among several alternatives, the one of its "type". */
export function objectFor(description, value) {
  if (description.object) return description.object;
  const type = value && typeof value === 'object' ? value.type : undefined;
  const found = description.choices.find(c => c.schema.properties.type.const === type);
  return (found || description.choices[0]).schema;
}

export const typesOf = description => description.choices?.map(c => c.schema.properties.type.const) ?? null;

export function keysOf(object) {
  return Object.entries(object.properties ?? {}).filter(([key]) => key !== 'type').map(([key, s]) => describe(s, key));
}
export const requiredOf = object => object.required ?? [];

export function root() { return describe({...schema, $ref: undefined}, ''); }
export const rootKey = key => describe(schema.properties[key], key);
export const itemOf = list => describe(list.item ?? {}, '');

/** Returns the description of the value at a path, following schema and value together; null where the schema ends. */
export function at(steps, rootValue) {
  let description = {kind: 'object', object: schema}, value = rootValue;
  for (const step of steps) {
    if (description.kind === 'object' && !description.free) {
      const s = objectFor(description, value).properties?.[step];
      if (!s) return null;
      description = describe(s, step);
    } else if (description.kind === 'list') {
      description = describe(description.item, '');
    } else {
      return null;
    }
    value = value?.[step];
  }
  return description;
}

export const kLists = ['emitters', 'effects', 'forces', 'bodies', 'materials', 'particles', 'cloths', 'springs', 'joints', 'articulations', 'contacts', 'lights', 'overlays'];
export const kSettings = ['world', 'camera', 'environment', 'render', 'output'];

/** The label of a key: "spread_deg" becomes "Spread". */
export function label(key) {
  const text = String(key).replace(/_(deg|mm|px|m|s)$/, '').replace(/_/g, ' ');
  return text.charAt(0).toUpperCase() + text.slice(1);
}

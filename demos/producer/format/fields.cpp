#include "producer/format/fields.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "producer/base/suggest.h"

namespace offstage::producer {
namespace {

Object reference_to(const std::string& name) {
  return {{"$ref", "#/definitions/" + name}};
}

/// Returns names as a list for messages, such as "a", "b" or "c".
std::string quoted(std::span<const std::string> names) {
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i)
    text += (i == 0 ? "\"" : i + 1 < names.size() ? ", \"" : " or \"") + names[i] + "\"";
  return text;
}

/// Returns a default as the reference shows it: each object is reduced to its type, and {} stands for an
/// object with all of its own defaults.
Node abridged(const Node& node) {
  if (const List* list = node.as<List>()) {
    List items;
    for (const Node& item : *list) items.push_back(abridged(item));
    return items;
  }
  if (!node.as<Object>()) return node;
  const Node* type = node.find("type");
  return type ? Object{{"type", *type}} : Object{};
}

/// Adds a key to the entry of its object, with the description of its value and its help text.
void describe_key(const Spec& spec, Description value, const std::optional<Node>& initial,
                  ObjectEntry& entry) {
  Row row{spec.key, value.type, spec.unit, spec.limits.range(), "none", spec.help};
  value.schema.push_back({"description", spec.help + (spec.unit.empty() ? "" : " [" + spec.unit + "]")});
  if (spec.required) {
    row.initial = "required";
    entry.required.push_back(spec.key);
  } else if (initial) {
    const Node shown = abridged(*initial);
    row.initial = "`" + to_text(shown) + "`";
    value.schema.push_back({"default", shown});
  }
  entry.rows.push_back(std::move(row));
  entry.properties.push_back({spec.key, std::move(value.schema)});
}

/// Adds the key "type" of an object that is one of several alternatives.
void describe_tag(const std::string& tag, bool required, ObjectEntry& entry) {
  const std::string value = "`\"" + tag + "\"`";
  entry.rows.push_back({"type", value, "", "", required ? "required" : value, "the kind of this object"});
  entry.properties.push_back({"type", Object{{"const", tag}}});
  if (required) entry.required.push_back("type");
}

}  // namespace

Limits within_unit(Limits limits, std::string_view unit) {
  if (limits.low != 0) return limits;
  const auto narrow = [&](Real low, Real high) {
    // An excluded bound stays excluded, so that a varying number still needs a "min".
    if (limits.open_low) limits.low = low;
    limits.high = std::min(limits.high, high);
  };
  if (unit == "m")
    narrow(1e-9, 1e9);
  else if (unit == "kg/m^3")
    narrow(1e-12, 1e12);
  else if (unit.starts_with("kg") || unit.starts_with("N"))
    narrow(0, 1e30);
  return limits;
}

std::string Limits::range() const {
  if (low == high) return to_text(low);
  if (low > -kInfinity && high < kInfinity && !open_low && !open_high)
    return to_text(low) + " .. " + to_text(high);
  std::string text = nonzero ? "not zero" : "";
  if (low > -kInfinity) text = (open_low ? "> " : ">= ") + to_text(low);
  if (high < kInfinity)
    text += (text.empty() ? "" : ", ") + std::string(open_high ? "< " : "<= ") + to_text(high);
  return text;
}

std::string Limits::rule(std::string_view unit) const {
  const std::string of = unit.empty() ? "" : " " + std::string(unit);
  if (low == high) return to_text(low) + of;
  if (low > -kInfinity && high < kInfinity && !open_low && !open_high)
    return "between " + to_text(low) + " and " + to_text(high) + of;
  std::string text;
  if (low > -kInfinity) text = (open_low ? "greater than " : "at least ") + to_text(low);
  if (high < kInfinity)
    text +=
        (text.empty() ? "" : " and ") + std::string(open_high ? "less than " : "at most ") + to_text(high);
  return text + of;
}

void Limits::add_to(Object& schema) const {
  if (low > -kInfinity) schema.push_back({open_low ? "exclusiveMinimum" : "minimum", low});
  if (high < kInfinity) schema.push_back({open_high ? "exclusiveMaximum" : "maximum", high});
}

Where Reader::where(Position at) const {
  const std::string file = at.file < 0 ? "" : files_[static_cast<std::size_t>(at.file)];
  return {file, at.line, at.column, path_};
}

void Reader::refuse(const Node& node, std::string_view allowed) {
  fail(node.at, "must be " + std::string(allowed) + ", got " + describe(node));
}

std::optional<Real> Reader::number(const Node& node, const Spec& spec) {
  const int64_t* whole = node.as<int64_t>();
  const double* v = node.as<double>();
  if (!whole && !v) {
    refuse(node, "a number");
    return {};
  }
  const Real value = v ? *v : static_cast<Real>(*whole);
  if (spec.limits.allows(value)) return value;
  refuse(node, spec.limits.rule(spec.unit));
  return {};
}

std::optional<int64_t> Reader::integer(const Node& node, const Spec& spec) {
  const double* v = node.as<double>();
  if (!node.as<int64_t>() && !(v && std::trunc(*v) == *v)) {
    refuse(node, "a whole number");
    return {};
  }
  constexpr Real kTooLarge = 9223372036854775808.0;  // 2^63
  if (v && std::abs(*v) >= kTooLarge) {
    fail(node.at, "the integer does not fit in 64 bits");
    return {};
  }
  const int64_t value = v ? static_cast<int64_t>(*v) : *node.as<int64_t>();
  if (!number(node, spec)) return {};
  return value;
}

const List* Reader::list(const Node& node, std::string_view allowed, std::size_t least, std::size_t most) {
  const List* list = node.as<List>();
  if (!list) {
    refuse(node, allowed);
    return nullptr;
  }
  if (list->size() >= least && list->size() <= most) return list;
  fail(node.at, "must be " + std::string(allowed) + ", got " + std::to_string(list->size()) + " items");
  return nullptr;
}

std::optional<std::size_t> Reader::choice(const Node& node, std::span<const std::string> names) {
  const std::string allowed = (names.size() == 1 ? "" : "one of ") + quoted(names);
  const std::string* name = node.as<std::string>();
  if (!name) {
    refuse(node, allowed);
    return {};
  }
  const auto it = std::find(names.begin(), names.end(), *name);
  if (it != names.end()) return static_cast<std::size_t>(it - names.begin());
  const std::string near = is_full() ? "" : nearest(*name, names);
  fail(node.at, "must be " + allowed + ", got " + describe(node) +
                    (near.empty() ? "" : "; did you mean '" + near + "'?"));
  return {};
}

std::optional<std::size_t> Reader::type(const Node& node, std::span<const std::string> names, bool required) {
  std::optional<std::size_t> which;
  if (!node.as<Object>()) {
    refuse(node, "an object");
  } else if (const Node* type = node.find("type")) {
    within("type", [&] { which = choice(*type, names); });
  } else if (required) {
    within("type", [&] { fail(node.at, "is required; it must be one of " + quoted(names)); });
  } else {
    which = 0;
  }
  return which;
}

void Reader::keys(const Node& node, std::string_view name, std::span<const Spec* const> specs, bool tagged,
                  const std::function<void(std::size_t, const Node&)>& read) {
  const Object* object = node.as<Object>();
  if (!object) return refuse(node, "an object");
  for (const Member& member : *object) {
    if (tagged && member.key == "type") continue;
    const auto it =
        std::find_if(specs.begin(), specs.end(), [&](const Spec* spec) { return spec->key == member.key; });
    within(member.key, [&] {
      if (it != specs.end()) return read(static_cast<std::size_t>(it - specs.begin()), member.value);
      if (is_full()) return fail(member.at, {});
      std::vector<std::string> known;
      if (tagged) known.push_back("type");
      for (const Spec* spec : specs) known.push_back(spec->key);
      fail(member.at, "unknown key in " + std::string(name) + known_keys(member.key, known));
    });
  }
  for (const Spec* spec : specs) {
    if (spec->required && !node.find(spec->key))
      within(spec->key, [&] { fail(node.at, "is required: " + spec->help); });
  }
}

/// Returns the end of a message about an unknown key: the known key that is meant, or other objects that have
/// such a key, or all known keys.
std::string Reader::known_keys(const std::string& unknown, std::span<const std::string> known) const {
  constexpr std::size_t kMost = 8;
  if (nearest(unknown, known).empty()) {
    std::vector<std::string> owners = owners_(unknown);
    if (owners.size() > kMost) {
      owners.resize(kMost);
      owners.emplace_back("...");
    }
    if (!owners.empty()) return fmt::format("; '{}' is a key of: {}", unknown, fmt::join(owners, ", "));
  }
  return suggestion(unknown, known);
}

Description Catalogue::refer(const std::string& name, std::string_view help,
                             const std::function<void(ObjectEntry&)>& describe) {
  const bool known =
      std::any_of(objects_.begin(), objects_.end(), [&](const auto& o) { return o.name == name; });
  if (!known) describe(objects_.emplace_back(ObjectEntry{name, std::string(help), {}, {}, {}, {}}));
  return {reference_to(name), "[" + name + "](#" + name + ")"};
}

Object Catalogue::share(const std::string& name, const Node& schema) {
  if (std::none_of(shared_.begin(), shared_.end(), [&](const Member& m) { return m.key == name; }))
    shared_.push_back({name, schema});
  return reference_to(name);
}

Node ObjectEntry::definition() const {
  Object schema = {{"description", help}};
  if (!alternatives.empty()) {
    List choices;
    for (const std::string& alternative : alternatives) choices.push_back(reference_to(alternative));
    schema.push_back({"oneOf", std::move(choices)});
    return schema;
  }
  schema.push_back({"type", "object"});
  if (!required.empty()) schema.push_back({"required", required});
  schema.push_back({"properties", properties});
  schema.push_back({"additionalProperties", false});
  return schema;
}

Key::Key(const char* key, const char* help, const char* unit, Limits limits, bool required,
         const ValueKind& value_kind, std::ptrdiff_t value_offset)
    : spec{key, help, unit, within_unit(limits, unit), required}, kind(&value_kind), offset(value_offset) {}

void append(std::vector<Key>& keys, std::span<const Key> part, std::ptrdiff_t offset) {
  for (const Key& key : part) keys.emplace_back(key).offset += offset;
}

void read_object(Reader& in, const Node& node, std::string_view name, std::span<const Key> keys, bool tagged,
                 void* object) {
  std::vector<const Spec*> specs;
  for (const Key& key : keys) specs.push_back(&key.spec);
  in.keys(node, name, specs, tagged,
          [&](std::size_t i, const Node& value) { keys[i].read(in, value, object); });
}

Node write_object(std::span<const Key> keys, const std::string& tag, const void* object) {
  Object written;
  if (!tag.empty()) written.push_back({"type", tag});
  for (const Key& key : keys)
    if (std::optional<Node> value = key.write(object)) written.push_back({key.spec.key, std::move(*value)});
  return written;
}

void describe_object(Catalogue& all, std::span<const Key> keys, const std::string& tag, bool tag_required,
                     const void* initial, ObjectEntry& entry) {
  if (!tag.empty()) describe_tag(tag, tag_required, entry);
  for (const Key& key : keys)
    describe_key(key.spec, key.kind->describe(all, key.spec), key.write(initial), entry);
}

std::vector<std::string> strings(std::span<const char* const> names) {
  return {names.begin(), names.end()};
}

Description describe_names(std::span<const char* const> names) {
  List values;
  std::string type;
  for (const char* name : names) {
    values.push_back(name);
    type += (type.empty() ? "`\"" : ", `\"") + std::string(name) + "\"`";
  }
  return {{{"enum", std::move(values)}}, std::move(type)};
}

Description describe_list(const Description& item) {
  return {{{"type", "array"}, {"items", item.schema}}, "list of " + item.type};
}

}  // namespace offstage::producer

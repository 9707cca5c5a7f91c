#pragma once
/// One description of each key of the scene format, from which reading, writing, the schema and the reference
/// all follow.
///
/// Table<T> lists the keys of a struct T as Fields<T>; Codec<V> knows how a value of type V stands in JSON. A
/// new key is one line in scene_table.cpp; a new kind of value is one Codec. Those of plain values are in
/// values.h.

#include <cstdint>
#include <deque>
#include <functional>
#include <initializer_list>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "producer/error.h"
#include "producer/json.h"
#include "sim/types.h"

namespace offstage::producer {

using sim::Real;

inline constexpr Real kInfinity = std::numeric_limits<Real>::infinity();

/// What a number may be: also each component of a vector, and every value that a varying number can take.
struct Limits {
  Real low = -kInfinity, high = kInfinity;
  bool open_low = false, open_high = false;  ///< the bound itself is excluded
  bool nonzero = false;                      ///< of a vector: it needs a direction

  bool bounded() const { return low > -kInfinity || high < kInfinity; }
  bool allows(Real v) const { return (open_low ? v > low : v >= low) && (open_high ? v < high : v <= high); }
  std::string range() const;                      ///< for a table: "> 0", "0 .. 1"
  std::string rule(std::string_view unit) const;  ///< for a sentence: "greater than 0 m"
  void add_to(Object& schema) const;              ///< as minimum, exclusiveMaximum ...
};
inline constexpr Limits kPositive{.low = 0, .open_low = true};
inline constexpr Limits kNotNegative{.low = 0};
inline constexpr Limits kShare{.low = 0, .high = 1};
inline constexpr Limits kDirection{.nonzero = true};
constexpr Limits between(Real low, Real high) {
  return {.low = low, .high = high};
}
constexpr Limits inside(Real low, Real high) {
  return {.low = low, .high = high, .open_low = true, .open_high = true};
}
/// Greater than `low` and at most `high`.
constexpr Limits over(Real low, Real high) {
  return {.low = low, .high = high, .open_low = true};
}

struct Required {};
inline constexpr Required kRequired;

/// What is said of one key.
struct Spec {
  std::string key, help, unit;
  Limits limits;
  bool required = false;
};

/// Reads on past every problem and keeps them all.
class Reader {
 public:
  /// `files` are the names that positions refer to.
  explicit Reader(std::span<const std::string> files) : files_(files) {}

  /// Runs f one step further down the path that messages name.
  template <class F>
  void within(std::string_view step, F&& f) {
    const std::size_t length = path_.size();
    path_ += pointer_step(step);
    f();
    path_.resize(length);
  }
  Where where(Position at) const;
  void fail(Position at, std::string what) { problems_.push_back({where(at), std::move(what)}); }
  /// "must be a number, got true"
  void refuse(const Node& node, std::string_view allowed);

  /// The number in `node` if it is one, within the limits.
  std::optional<Real> number(const Node& node, const Spec& spec);
  /// The same for a whole number; 1e6 and 3.0 are whole.
  std::optional<int64_t> integer(const Node& node, const Spec& spec);
  /// The list in `node` if it is one and has from `least` to `most` items.
  const List* list(const Node& node, std::string_view allowed, std::size_t least = 0,
                   std::size_t most = SIZE_MAX);
  /// Which of `names` the string in `node` is.
  std::optional<std::size_t> choice(const Node& node, std::span<const std::string> names);
  /// Which of `names` the key "type" of an object is; without that key the first, unless it is required.
  std::optional<std::size_t> type(const Node& node, std::span<const std::string> names, bool required);
  /// Calls read(i, value) for each key of an object that is specs[i], at that key's path. Reports unknown
  /// keys (other than "type" if the object is `tagged`) and required ones that are missing. `name` is what
  /// messages call the object.
  void keys(const Node& node, std::string_view name, std::span<const Spec* const> specs, bool tagged,
            const std::function<void(std::size_t, const Node&)>& read);

  const std::vector<Problem>& problems() const { return problems_; }

 private:
  std::span<const std::string> files_;
  std::string path_;
  std::vector<Problem> problems_;
};

/// How a kind of value is described: as JSON Schema, and in a word for the reference.
struct Description {
  Object schema;
  std::string type;
};

/// One row of the reference.
struct Row {
  std::string key, type, unit, range, initial, help;
};
/// An object of the format with its keys, or a choice between several objects.
struct ObjectEntry {
  std::string name, help;
  std::vector<Row> rows;
  Object properties;                      ///< key to JSON Schema
  List required;                          ///< keys
  std::vector<std::string> alternatives;  ///< names of the objects to choose from

  Node definition() const;  ///< JSON Schema
};
/// Every object of the format, each after the first that refers to it.
class Catalogue {
 public:
  /// A reference to the named object; `describe` fills in its entry the first time.
  Description refer(const std::string& name, std::string_view help,
                    const std::function<void(ObjectEntry&)>& describe);
  /// A reference to a schema that many keys share.
  Object share(const std::string& name, const Node& schema);

  const std::deque<ObjectEntry>& objects() const { return objects_; }
  const Object& shared() const { return shared_; }

 private:
  std::deque<ObjectEntry> objects_;
  Object shared_;
};

/// How a value of type V is read, written and described, by three static functions:
/// - `void read(Reader&, const Node&, const Spec&, V& out)` leaves a usable `out` if the value is wrong;
/// - `Node write(const V&)`, or `std::optional<Node>` where a value can be absent;
/// - `Description describe(Catalogue&, const Spec&)`.
template <class V>
struct Codec;

/// The keys of T: `kName`, `kHelp` and `static Fields<T> fields()`.
template <class T>
struct Table;
template <class T>
concept Tabled = requires {
  Table<T>::kName;
};

/// A key of objects of type T.
template <class T>
struct Field {
  Spec spec;
  std::function<void(Reader&, const Node&, T&)> read;
  std::function<std::optional<Node>(const T&)> write;
  std::function<Description(Catalogue&)> describe;

  template <class M, class C>
  requires std::is_base_of_v<C, T> Field(const char* key, M C::*member, const char* help,
                                         const char* unit = "", Limits limits = {})
      : Field(
            Spec{key, help, unit, limits}, [member](auto& owner) -> auto& { return owner.*member; },
            Codec<M>()) {}
  template <class M, class C>
  Field(const char* key, M C::*member, const char* help, Required)
      : Field(
            Spec{key, help, "", {}, true}, [member](auto& owner) -> auto& { return owner.*member; },
            Codec<M>()) {}

  /// A key of a part of T that stands directly in T.
  template <class Part, class Project>
  Field(const Field<Part>& inner, Project part)
      : spec(inner.spec),
        read([=](Reader& in, const Node& node, T& owner) { inner.read(in, node, part(owner)); }),
        write([=](const T& owner) { return inner.write(part(owner)); }),
        describe(inner.describe) {}

 private:
  template <class Project, class ValueCodec>
  Field(Spec s, Project value, ValueCodec)
      : spec(s),
        read([=](Reader& in, const Node& node, T& owner) { ValueCodec::read(in, node, s, value(owner)); }),
        write([=](const T& owner) -> std::optional<Node> { return ValueCodec::write(value(owner)); }),
        describe([=](Catalogue& all) { return ValueCodec::describe(all, s); }) {}
};

/// The keys of T, in the order of the reference.
template <class T>
struct Fields : std::vector<Field<T>> {
  Fields(std::initializer_list<Field<T>> own) : std::vector<Field<T>>(own) {}

  /// Adds more keys of its own.
  Fields then(std::initializer_list<Field<T>> more) && {
    this->insert(this->end(), more);
    return std::move(*this);
  }
  /// Adds the keys of a member, or of a base, that stand directly in T.
  template <class Part>
  Fields with(Part T::*part) && {
    return std::move(*this).add(
        Table<Part>::fields(), [part](auto& owner) -> auto& { return owner.*part; });
  }
  template <class Base>
  Fields with_base() && {
    return std::move(*this).add(
        Table<Base>::fields(), [](auto& owner) -> auto& { return owner; });
  }

 private:
  template <class Part, class Project>
  Fields add(const Fields<Part>& part, Project project) && {
    for (const Field<Part>& field : part) this->emplace_back(field, project);
    return std::move(*this);
  }
};

/// Adds a key to its object's entry: the description of its value, and what is said of it.
void describe_key(const Spec& spec, Description value, const std::optional<Node>& initial,
                  ObjectEntry& entry);
/// Adds the key "type" of an object that is one of a choice.
void describe_tag(const std::string& tag, bool required, ObjectEntry& entry);

/// Objects.
template <Tabled T>
struct Codec<T> {
  static void read(Reader& in, const Node& node, const Spec&, T& out, bool tagged = false) {
    if constexpr (requires { out.where; }) out.where = in.where(node.at);
    in.keys(node, Table<T>::kName, specs(), tagged,
            [&](std::size_t i, const Node& value) { fields()[i].read(in, value, out); });
  }

  static Node write(const T& value, const std::string& tag = "") {
    Object object;
    if (!tag.empty()) object.push_back({"type", tag});
    for (const Field<T>& field : fields())
      if (std::optional<Node> written = field.write(value))
        object.push_back({field.spec.key, std::move(*written)});
    return object;
  }

  static Description describe(Catalogue& all, const Spec&, const std::string& tag = "",
                              bool tag_required = false) {
    return all.refer(Table<T>::kName, Table<T>::kHelp, [&](ObjectEntry& entry) {
      const T initial;
      if (!tag.empty()) describe_tag(tag, tag_required, entry);
      for (const Field<T>& field : fields())
        describe_key(field.spec, field.describe(all), field.write(initial), entry);
    });
  }

 private:
  static const Fields<T>& fields() {
    static const Fields<T> all = Table<T>::fields();
    return all;
  }
  static const std::vector<const Spec*>& specs() {
    static const std::vector<const Spec*> all = [] {
      std::vector<const Spec*> pointers;
      for (const Field<T>& field : fields()) pointers.push_back(&field.spec);
      return pointers;
    }();
    return all;
  }
};

/// Names of an enumeration's values, in their order: `static constexpr std::array kNames`.
template <class E>
struct Names;

std::vector<std::string> strings(std::span<const char* const> names);
Description describe_names(std::span<const char* const> names);

template <class E>
requires std::is_enum_v<E>
struct Codec<E> {
  static void read(Reader& in, const Node& node, const Spec&, E& out) {
    if (const auto i = in.choice(node, strings(Names<E>::kNames))) out = static_cast<E>(*i);
  }
  static Node write(E value) { return Names<E>::kNames.at(static_cast<std::size_t>(value)); }
  static Description describe(Catalogue&, const Spec&) { return describe_names(Names<E>::kNames); }
};

/// Objects told apart by "type": `kName`, `kHelp`, `kTags` for each alternative, `kRequired` or else the
/// first if absent.
template <class V>
struct Tags;

template <class... T>
struct Codec<std::variant<T...>> {
  using V = std::variant<T...>;

  static void read(Reader& in, const Node& node, const Spec& spec, V& out) {
    const auto which = in.type(node, strings(Tags<V>::kTags), Tags<V>::kRequired);
    if (!which) return;
    std::size_t i = 0;
    ((i++ == *which ? Codec<T>::read(in, node, spec, out.template emplace<T>(), true) : void()), ...);
  }
  static Node write(const V& value) {
    return std::visit(
        [&]<class A>(const A& alternative) {
          return Codec<A>::write(alternative, Tags<V>::kTags[value.index()]);
        },
        value);
  }
  static Description describe(Catalogue& all, const Spec& spec) {
    return all.refer(Tags<V>::kName, Tags<V>::kHelp, [&](ObjectEntry& entry) {
      entry.alternatives = {Table<T>::kName...};
      std::size_t i = 0;
      (..., (Codec<T>::describe(all, spec, Tags<V>::kTags[i], i > 0 || Tags<V>::kRequired), ++i));
    });
  }
};

template <class V>
struct Codec<std::optional<V>> {
  static void read(Reader& in, const Node& node, const Spec& spec, std::optional<V>& out) {
    Codec<V>::read(in, node, spec, out.emplace());
  }
  static std::optional<Node> write(const std::optional<V>& value) {
    return value ? std::optional<Node>(Codec<V>::write(*value)) : std::nullopt;
  }
  static Description describe(Catalogue& all, const Spec& spec) { return Codec<V>::describe(all, spec); }
};

Description describe_list(const Description& item);

template <class V>
struct Codec<std::vector<V>> {
  static void read(Reader& in, const Node& node, const Spec& spec, std::vector<V>& out) {
    const List* list = in.list(node, "a list");
    if (!list) return;
    out.assign(list->size(), V{});
    for (std::size_t i = 0; i < list->size(); ++i)
      in.within(std::to_string(i), [&] { Codec<V>::read(in, (*list)[i], spec, out[i]); });
  }
  static Node write(const std::vector<V>& values) {
    List list;
    for (const V& value : values) list.push_back(Codec<V>::write(value));
    return list;
  }
  static Description describe(Catalogue& all, const Spec& spec) {
    return describe_list(Codec<V>::describe(all, spec));
  }
};

}  // namespace offstage::producer

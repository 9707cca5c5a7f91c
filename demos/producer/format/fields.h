#pragma once
/// The parts of the table of keys. Each key of the scene format is described once. The reader, the writer,
/// the schema and the reference all use this description.
///
/// Table<T> lists the keys of a struct T as Fields<T>. Codec<V> defines the JSON form of a value of type V.
/// scene_table.h says to which file a new key is added.

#include <cstddef>
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

#include "producer/base/error.h"
#include "producer/base/json.h"
#include "sim/core/types.h"

namespace offstage::producer {

using sim::Real;

inline constexpr Real kInfinity = std::numeric_limits<Real>::infinity();

/// Allowed range of a number. It also applies to each component of a vector, and to every value of a varying
/// number.
struct Limits {
  Real low = -kInfinity, high = kInfinity;
  bool open_low = false, open_high = false;  ///< whether the bound itself is excluded
  bool nonzero = false;                      ///< whether a vector must not be zero

  bool bounded() const { return low > -kInfinity || high < kInfinity; }
  bool allows(Real v) const { return (open_low ? v > low : v >= low) && (open_high ? v < high : v <= high); }
  std::string range() const;                      ///< the range as in a table: "> 0", "0 .. 1"
  std::string rule(std::string_view unit) const;  ///< the range as in a sentence: "greater than 0 m"
  void add_to(Object& schema) const;              ///< adds "minimum", "exclusiveMaximum" and so on
};
inline constexpr Limits kPositive{.low = 0, .open_low = true};
inline constexpr Limits kNotNegative{.low = 0};
/// Brightness of lights. Sums of brighter ones would not be finite.
inline constexpr Limits kBrightness{.low = 0, .high = 1e6};
inline constexpr Limits kFraction{.low = 0, .high = 1};
inline constexpr Limits kDirection{.nonzero = true};
/// Returns the limits from `low` to `high`, both included.
constexpr Limits between(Real low, Real high) {
  return {.low = low, .high = high};
}
/// Returns the limits of values greater than `low` and less than `high`.
constexpr Limits inside(Real low, Real high) {
  return {.low = low, .high = high, .open_low = true, .open_high = true};
}
/// Returns the limits of values greater than `low` and at most `high`.
constexpr Limits over(Real low, Real high) {
  return {.low = low, .high = high, .open_low = true};
}

/// Range of scale factors. A length of at most 1e9 m times such a factor causes no overflow in quantities
/// computed from it.
inline constexpr Limits kScale{.low = 1e-9, .high = 1e9};

/// Narrows the limits of a size, mass or coefficient to the range of its unit: lengths to [1e-9, 1e9] m,
/// masses to at most 1e30 kg, densities to [1e-12, 1e12] kg/m^3, coefficients to at most 1e30. If the given
/// limits allow 0, the result allows 0, too. Limits whose lower end is not 0 are returned unchanged.
Limits within_unit(Limits limits, std::string_view unit);

struct Required {};
inline constexpr Required kRequired;

/// Name, help text, unit and limits of one key, and whether the key is required.
struct Spec {
  std::string key, help, unit;
  Limits limits;
  bool required = false;
};

/// Reads values from a JSON tree. After a problem it continues, so that all problems are collected.
class Reader {
 public:
  /// Returns the names of the objects of the format that have a key.
  using Owners = std::function<std::vector<std::string>(std::string_view key)>;

  /// `files`: names of the files to which Position::file refers. `owners` is used in messages about unknown
  /// keys.
  Reader(std::span<const std::string> files, Owners owners) : files_(files), owners_(std::move(owners)) {}

  /// Appends `step` to the path in messages, runs f, and removes the step again.
  template <class F>
  void within(std::string_view step, F&& f) {
    const std::size_t length = path_.size();
    path_ += pointer_step(step);
    f();
    path_.resize(length);
  }
  /// Returns the file, line, column and path that a message about `at` shows.
  Where where(Position at) const;
  /// Reports a problem. The first kMostProblems are stored; the others are only counted.
  void fail(Position at, std::string what) {
    if (is_full())
      ++more_;
    else
      problems_.push_back({where(at), std::move(what)});
  }
  bool is_full() const { return problems_.size() >= kMostProblems; }
  std::size_t more() const { return more_; }
  /// Reports the problem "must be ALLOWED, got VALUE", such as "must be a number, got true".
  void refuse(const Node& node, std::string_view allowed);

  /// Returns the number in `node`. If it is not a number, or not within the limits, reports a problem and
  /// returns nothing.
  std::optional<Real> number(const Node& node, const Spec& spec);
  /// Returns the integer in `node`, otherwise like number(). The numbers 1e6 and 3.0 are integers, too.
  std::optional<int64_t> integer(const Node& node, const Spec& spec);
  /// Returns the list in `node`. If it is not a list of `least` to `most` items, reports a problem and
  /// returns null. `allowed` names the expected value in the message.
  const List* list(const Node& node, std::string_view allowed, std::size_t least = 0,
                   std::size_t most = SIZE_MAX);
  /// Returns the index of the string in `node` within `names`. If it is not one of the names, reports a
  /// problem and returns nothing.
  std::optional<std::size_t> choice(const Node& node, std::span<const std::string> names);
  /// Returns the index of an object's "type" within `names`. An object without the key "type" has index 0,
  /// unless the key is `required`. In all other cases, reports a problem and returns nothing.
  std::optional<std::size_t> type(const Node& node, std::span<const std::string> names, bool required);
  /// Calls read(i, value) for each member of an object whose key is described by specs[i]. During the call,
  /// the path in messages includes the key. Reports unknown keys and missing required keys; if `tagged`, the
  /// key "type" is known. Messages call the object `name`.
  void keys(const Node& node, std::string_view name, std::span<const Spec* const> specs, bool tagged,
            const std::function<void(std::size_t, const Node&)>& read);

  const std::vector<Problem>& problems() const { return problems_; }

 private:
  std::string known_keys(const std::string& unknown, std::span<const std::string> known) const;

  std::span<const std::string> files_;
  Owners owners_;
  std::string path_;
  std::vector<Problem> problems_;
  std::size_t more_ = 0;
};

/// Description of a kind of value: as JSON Schema, and as a short text for the reference.
struct Description {
  Object schema;
  std::string type;
};

/// One row of a table in the reference.
struct Row {
  std::string key, type, unit, range, initial, help;
};
/// An object of the format with its keys, or a choice between several objects.
struct ObjectEntry {
  std::string name, help;
  std::vector<Row> rows;
  Object properties;                      ///< JSON Schema of each key
  List required;                          ///< keys that are required
  std::vector<std::string> alternatives;  ///< names of the objects to choose from

  Node definition() const;  ///< JSON Schema
};
/// All objects of the format. An object is listed after the first object that refers to it.
class Catalogue {
 public:
  /// Returns a reference to the object `name`. The first call for a name adds its entry, and calls `describe`
  /// to fill it in.
  Description refer(const std::string& name, std::string_view help,
                    const std::function<void(ObjectEntry&)>& describe);
  /// Stores a schema that many keys share under `name`, and returns a reference to it.
  Object share(const std::string& name, const Node& schema);

  const std::deque<ObjectEntry>& objects() const { return objects_; }
  const Object& shared() const { return shared_; }

 private:
  std::deque<ObjectEntry> objects_;
  Object shared_;
};

/// Reads, writes and describes a value of type V, by three static functions:
/// - `void read(Reader&, const Node&, const Spec&, V& out)`. For a wrong value it reports a problem and
///   leaves a usable value in `out`.
/// - `Node write(const V&)`, or `std::optional<Node> write(const V&)` if the value can be absent.
/// - `Description describe(Catalogue&, const Spec&)`.
template <class V>
struct Codec;

/// The keys of T. Each specialization has `static Fields<T> fields()`. An object of the format also has
/// `kName` and `kHelp`; without them, the keys are a part of other objects.
template <class T>
struct Table;
template <class T>
concept Tabled = requires {
  Table<T>::kName;
};

/// A codec with its type erased: it takes the addresses of values. The code of keys and objects therefore
/// does not depend on their types. Otherwise the compiler would generate this code for each of two hundred
/// keys.
struct ValueKind {
  void (*read)(Reader&, const Node&, const Spec&, void* out);
  std::optional<Node> (*write)(const void* value);
  Description (*describe)(Catalogue&, const Spec&);
};
template <class V>
inline constexpr ValueKind kValueKind = {
    [](Reader& in, const Node& node, const Spec& spec, void* out) {
      Codec<V>::read(in, node, spec, *static_cast<V*>(out));
    },
    [](const void* value) -> std::optional<Node> { return Codec<V>::write(*static_cast<const V*>(value)); },
    [](Catalogue& all, const Spec& spec) { return Codec<V>::describe(all, spec); }};

/// A key of an object: its Spec, its codec, and the position of its value in the object.
struct Key {
  Spec spec;
  const ValueKind* kind;
  std::ptrdiff_t offset;  ///< offset of the value in the object [bytes]

  Key(const char* key, const char* help, const char* unit, Limits limits, bool required,
      const ValueKind& value_kind, std::ptrdiff_t value_offset);

  void read(Reader& in, const Node& node, void* object) const {
    kind->read(in, node, spec, static_cast<std::byte*>(object) + offset);
  }
  std::optional<Node> write(const void* object) const {
    return kind->write(static_cast<const std::byte*>(object) + offset);
  }
};

/// Returns an object of type T in which all keys have their defaults.
template <class T>
const T& initial_object() {
  static const T object{};
  return object;
}
/// Returns the offset of a part in the initial object [bytes].
template <class T, class Part>
std::ptrdiff_t offset_in(const Part& part) {
  return reinterpret_cast<const std::byte*>(&part) - reinterpret_cast<const std::byte*>(&initial_object<T>());
}

/// A key of objects of type T, whose value is a member of T.
template <class T>
struct Field : Key {
  template <class M, class C>
  requires std::is_base_of_v<C, T> Field(const char* key, M C::*member, const char* help,
                                         const char* unit = "", Limits limits = {})
      : Field(key, member, help, unit, limits, false) {}
  template <class M, class C>
  Field(const char* key, M C::*member, const char* help, Required) : Field(key, member, help, "", {}, true) {}

 private:
  template <class M, class C>
  Field(const char* key, M C::*member, const char* help, const char* unit, Limits limits, bool required)
      : Key(key, help, unit, limits, required, kValueKind<M>, offset_in<T>(initial_object<T>().*member)) {}
};

/// Appends the keys of a part to the keys of an object. `offset`: position of the part in the object [bytes].
void append(std::vector<Key>& keys, std::span<const Key> part, std::ptrdiff_t offset);

/// The keys of T, in the order in which the reference lists them.
template <class T>
class Fields {
 public:
  Fields(std::initializer_list<Field<T>> own) {
    for (const Field<T>& field : own) keys_.push_back(field);
  }

  std::span<const Key> keys() const { return keys_; }

  /// Appends further keys of T.
  Fields then(const Fields& more) && { return std::move(*this).add(more, 0); }
  /// Appends the keys of a member of T (with), or of a base class of T (with_base), as keys of T itself.
  template <class Part>
  Fields with(Part T::*part) && {
    return std::move(*this).add(Table<Part>::fields(), offset_in<T>(initial_object<T>().*part));
  }
  template <class Base>
  Fields with_base() && {
    return std::move(*this).add(Table<Base>::fields(), offset_in<T, Base>(initial_object<T>()));
  }

 private:
  std::vector<Key> keys_;

  template <class Part>
  Fields add(const Fields<Part>& part, std::ptrdiff_t offset) && {
    append(keys_, part.keys(), offset);
    return std::move(*this);
  }
};

void read_object(Reader& in, const Node& node, std::string_view name, std::span<const Key> keys, bool tagged,
                 void* object);
Node write_object(std::span<const Key> keys, const std::string& tag, const void* object);
/// `initial` is an object with the defaults of all keys.
void describe_object(Catalogue& all, std::span<const Key> keys, const std::string& tag, bool tag_required,
                     const void* initial, ObjectEntry& entry);

/// The codec of an object that has a Table.
template <Tabled T>
struct Codec<T> {
  static void read(Reader& in, const Node& node, const Spec&, T& out, bool tagged = false) {
    if constexpr (requires { out.where; }) out.where = in.where(node.at);
    read_object(in, node, Table<T>::kName, keys(), tagged, &out);
  }

  static Node write(const T& value, const std::string& tag = "") { return write_object(keys(), tag, &value); }

  static Description describe(Catalogue& all, const Spec&, const std::string& tag = "",
                              bool tag_required = false) {
    return all.refer(Table<T>::kName, Table<T>::kHelp, [&](ObjectEntry& entry) {
      describe_object(all, keys(), tag, tag_required, &initial_object<T>(), entry);
    });
  }

 private:
  static std::span<const Key> keys() {
    static const Fields<T> all = Table<T>::fields();
    return all.keys();
  }
};

/// Names of the values of an enumeration, in the order of the values: `static constexpr std::array kNames`.
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

/// Names of the alternatives of a variant. The key "type" names the alternative. A specialization has
/// `kName`, `kHelp`, `kTags` with one name for each alternative, and `kRequired`. If `kRequired` is false, an
/// object without "type" is the first alternative.
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
    out = std::vector<V>(list->size());
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

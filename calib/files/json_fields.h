#pragma once
// A struct as a JSON object, both ways by one table: the writer and the reader of a key share one
// row. Rows are written and read in order.

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "calib/files/json.h"
#include "calib/model/enum_table.h"

namespace cellcal::calib::fields {

using Json = nlohmann::ordered_json;

/// JSON representation of a value type.
template <class V>
struct Value {
  std::function<Json(const V&)> to;
  std::function<V(const JsonReader&)> from;  ///< throws FileError
};

template <class T>
struct Field {
  const char* key;
  std::function<Json(const T&)> to;
  std::function<void(const JsonReader&, T&)> from;  ///< null: not read back; throws FileError
  std::function<bool(const T&)> written = {};       ///< null: always written
  /// True if the key is required; evaluated after the rows above were read. Null: required.
  std::function<bool(const JsonReader& object, const T&)> wanted = {};
};

template <class T>
using Table = std::vector<Field<T>>;

template <class T>
Json to_json(const Table<T>& table, const T& value) {
  Json out = Json::object();
  for (const Field<T>& row : table)
    if (!row.written || row.written(value)) out[row.key] = row.to(value);
  return out;
}

/// Throws FileError.
template <class T>
void from_json(const Table<T>& table, const JsonReader& object, T& value) {
  for (const Field<T>& row : table)
    if (row.from && (!row.wanted || row.wanted(object, value))) row.from(object.at(row.key), value);
}

// Rows.

template <class T, class V>
Field<T> field(const char* key, V T::*member, Value<V> as) {
  return {key, [=](const T& value) { return as.to(value.*member); },
          [=](const JsonReader& reader, T& value) { value.*member = as.from(reader); }};
}

/// For readers of the file; not read back.
template <class T>
Field<T> for_readers(const char* key, std::function<Json(const T&)> to) {
  return {key, std::move(to), {}};
}

/// Read only if the object has the other key.
template <class T>
Field<T> beside(const char* other, Field<T> row) {
  row.wanted = [other](const JsonReader& object, const T&) { return object.has(other); };
  return row;
}

/// Optional: absent in files of earlier versions.
template <class T>
Field<T> optional(Field<T> row) {
  return beside(row.key, std::move(row));
}

/// Omitted from the file if empty.
template <class T>
Field<T> where(std::function<bool(const T&)> written, Field<T> row) {
  row.written = std::move(written);
  return row.wanted ? row : optional(std::move(row));
}

/// Null in the file instead of absent.
template <class T>
Field<T> null_unless(std::function<bool(const T&)> known, Field<T> row) {
  return {row.key, [=](const T& value) { return known(value) ? row.to(value) : Json(); },
          [from = row.from](const JsonReader& reader, T& value) {
            if (!reader.value().is_null()) from(reader, value);
          }};
}

template <class T, class V>
Field<T> of_optional(const char* key, std::optional<V> T::*member, Value<V> as) {
  return {key, [=](const T& value) { return as.to(*(value.*member)); },
          [=](const JsonReader& reader, T& value) { value.*member = as.from(reader); }};
}

/// Omitted if there is no value.
template <class T, class V>
Field<T> maybe(const char* key, std::optional<V> T::*member, Value<V> as) {
  return where<T>([=](const T& value) { return (value.*member).has_value(); },
                  of_optional(key, member, as));
}

/// Null if there is no value.
template <class T, class V>
Field<T> nullable(const char* key, std::optional<V> T::*member, Value<V> as) {
  return null_unless<T>([=](const T& value) { return (value.*member).has_value(); },
                        of_optional(key, member, as));
}

/// Present for some values only, as determined by the rows above.
template <class T>
Field<T> only_of(std::function<bool(const T&)> those, Field<T> row) {
  row.written = those;
  row.wanted = [those](const JsonReader&, const T& value) { return those(value); };
  return row;
}

/// Several rows of the same value in a nested object.
template <class T>
Field<T> group(const char* key, Table<T> rows) {
  return {key, [rows](const T& value) { return to_json(rows, value); },
          [rows](const JsonReader& reader, T& value) { from_json(rows, reader, value); }};
}

/// Rows of a member, in the same object.
template <class T, class M>
Table<T> of_member(M T::*member, const Table<M>& rows) {
  Table<T> all;
  for (const Field<M>& row : rows) {
    Field<T> one{row.key, [=](const T& value) { return row.to(value.*member); }, {}};
    if (row.from)
      one.from = [=](const JsonReader& reader, T& value) { row.from(reader, value.*member); };
    if (row.written) one.written = [=](const T& value) { return row.written(value.*member); };
    if (row.wanted)
      one.wanted = [=](const JsonReader& object, const T& value) {
        return row.wanted(object, value.*member);
      };
    all.push_back(std::move(one));
  }
  return all;
}

template <class T>
Table<T> joined(Table<T> first, const Table<T>& second) {
  first.insert(first.end(), second.begin(), second.end());
  return first;
}

// Values.

/// Scaled by `per` in the file.
Value<double> number(double per = 1.0);
Value<double> not_negative(double per = 1.0);
Value<std::string> text();
Value<bool> flag();
/// Three numbers.
Value<Eigen::Vector3d> vector(double per = 1.0);

/// An index or a count.
template <class I>
Value<I> whole() {
  return {[](const I& v) { return v; },
          [](const JsonReader& r) { return static_cast<I>(r.whole()); }};
}

/// An enumerator by its name.
template <class E>
Value<E> word(std::vector<std::pair<E, const char*>> words) {
  const auto to = [words](const E& value) -> Json {
    for (const auto& [one, name] : words)
      if (one == value) return name;
    return "";
  };
  return {to, [words](const JsonReader& r) {
            const std::string text = r.text();
            std::string expected;
            for (std::size_t i = 0; i < words.size(); ++i) {
              if (text == words[i].second) return words[i].first;
              expected += (i == 0 ? "" : i + 1 == words.size() ? " or " : ", ");
              expected += '"' + std::string(words[i].second) + '"';
            }
            r.fail("must be " + expected);
          }};
}

/// By its own name.
template <class E, char kBetween = '_'>
Value<E> named() {
  std::vector<std::pair<E, const char*>> words;
  for (const E one : all_values<E>()) words.emplace_back(one, own_name<kBetween>(one));
  return word(std::move(words));
}
template <class E>
Value<E> named(const char* refusal) {
  return {[](const E& value) -> Json { return own_name(value); },
          [=](const JsonReader& r) {
            const auto found = by_own_name<E>(r.text());
            if (!found) r.fail(refusal);
            return *found;
          }};
}

template <class V>
Value<V> object(Table<V> table) {
  return {[table](const V& value) { return to_json(table, value); },
          [table](const JsonReader& reader) {
            V value;
            from_json(table, reader, value);
            return value;
          }};
}

template <class V>
Value<std::vector<V>> list(Value<V> one) {
  return {[one](const std::vector<V>& values) {
            Json out = Json::array();
            for (const V& value : values) out.push_back(one.to(value));
            return out;
          },
          [one](const JsonReader& reader) {
            std::vector<V> values;
            for (const JsonReader& item : reader.items()) values.push_back(one.from(item));
            return values;
          }};
}

}  // namespace cellcal::calib::fields

#pragma once
// Types and values of KRL: INT of 32 bits, REAL of 32 bits, BOOL, CHAR, ENUM, STRUC and arrays of them.

#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace cellcal::sim::krl {

/// A fault of a running program: a controller stops it with a message.
struct RunError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct Type {
  enum class Kind { kInt, kReal, kBool, kChar, kEnum, kStruct, kArray };
  Kind kind = Kind::kInt;
  std::string name;                ///< in upper case
  std::vector<std::string> names;  ///< constants of an ENUM, components of a STRUC
  std::vector<const Type*> parts;  ///< of the components; of an array its element
  std::vector<int> extents;        ///< of an array; 0: open, of a parameter
  bool predefined = false;         ///< declared without DECL

  bool number() const { return kind == Kind::kInt || kind == Kind::kReal; }
  bool text() const { return kind == Kind::kArray && parts[0]->kind == Kind::kChar; }
  /// Index of a constant or component; -1: none.
  int index_of(std::string_view word) const;
  double scalars() const;  ///< that a value consists of
};

/// Geometry: begins with X, Y, Z, A, B, C.
bool is_frame(const Type& type);
/// A value of `from` may be assigned to a variable of `to`.
bool assignable(const Type& to, const Type& from);

/// An INT, BOOL, CHAR or ENUM constant has `i`, a REAL `r`; STRUC and arrays have parts.
struct Value {
  Value() = default;
  explicit Value(const Type& of);

  const Type* type = nullptr;
  bool given = false;  ///< a scalar that was assigned
  union {
    std::int32_t i = 0;
    float r;
  };
  std::vector<Value> parts;

  Value& part(std::string_view name);
  const Value& part(std::string_view name) const;
  /// Any scalar has been assigned.
  bool any() const;
  double number() const;
  bool truth() const { return i != 0; }
  /// Content of a CHAR array, up to the first CHAR without a value.
  std::string text() const;

  void set(double number);               ///< INT (rounded), REAL
  void set_whole(std::int32_t whole);    ///< INT, BOOL, CHAR or ENUM
  void set_text(std::string_view text);  ///< throws RunError where the array is too short
  void clear();                          ///< without a value
};

/// With KRL's conversions. Throws RunError.
void assign(Value& to, const Value& from);
/// `a` : `b`, of type of `b`.
Value composed(const Value& a, const Value& b);
Value inverse_frame(const Value& frame);

}  // namespace cellcal::sim::krl

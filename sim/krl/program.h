#pragma once
// Compiled KRL modules with their variables, which the interpreters of robot and submit share. Modules that a controller
// does not select are refused with file and line.

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "calib/export/krl_text.h"

namespace cellcal::sim::krl {

// Types and values of KRL: INT of 32 bits, REAL of 32 bits, BOOL, CHAR, ENUM, STRUC and arrays of them.

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
  void set_all(double number);           ///< every INT and REAL in it
  void set_whole(std::int32_t whole);    ///< INT, BOOL, CHAR or ENUM
  void set_text(std::string_view text);  ///< throws RunError where the array is too short
  void clear();                          ///< without a value
};

/// With KRL's conversions. Throws RunError.
void assign(Value& to, const Value& from);
/// `a` : `b`, of type of `b`.
Value composed(const Value& a, const Value& b);
Value inverse_frame(const Value& frame);

/// A variable outside routines. Hooks get the index of the first subscript, from 0.
struct Variable {
  std::string name;
  Value value;
  bool global = false, constant = false;
  std::function<void(Value&, std::size_t)> read;       ///< before it is read
  std::function<void(const Value&, std::size_t)> set;  ///< after it was assigned
};

enum class Op : std::uint8_t {
  kConstant,  // a: constant
  kGlobal,    // variable; a reference
  kLocal,     // a: slot; a reference
  kField,     // a: component of the reference
  kIndex,     // a: subscripts; of the reference
  kLoad,      // the reference's value
  kStore,     // value to reference
  kNew,       // type: an aggregate without components
  kSetPart,   // a: component of the aggregate below the value
  kNegative,
  kNot,
  kBitNot,
  kMultiply,
  kDivide,
  kAdd,
  kSubtract,
  kAnd,
  kExclusive,
  kOr,
  kBitAnd,
  kBitExclusive,
  kBitOr,
  kEqual,
  kUnequal,
  kLess,
  kGreater,
  kLessEqual,
  kGreaterEqual,
  kCompose,
  kJump,       // a: to
  kJumpFalse,  // a: to
  kCall,       // routine
  kNative,     // routine, without body
  kDrop,       // an unused result
  kReturn,     // a: with a value
  kWaitFor,    // a: where the condition begins
  kWaitSec,
  kMove,        // a: Motion::Kind, b: approximate
  kStandstill,  // of the motion before
  kHalt,
  kBrake,  // a: F
  kResume,
  kInterrupt,  // a: Interrupt command, b: interrupt of the routine, or -1: all; value: priority
};

struct Routine;

struct Instruction {
  Op op;
  std::int32_t a = 0, b = 0, line = 0;
  Variable* variable = nullptr;
  const Type* type = nullptr;
  const Routine* routine = nullptr;
};

enum class InterruptCommand { kDeclare, kOn, kOff, kEnable, kDisable };

struct Parameter {
  std::string name;
  bool in = false;
  const Type* type = nullptr;
};

using Native = std::function<Value(std::span<Value* const> arguments)>;

/// DEF or DEFFCT.
struct Routine {
  std::string name, file;
  bool main = false, global = false;
  int line = 0;
  const Type* result = nullptr;  ///< null: DEF
  std::vector<Parameter> parameters;
  std::vector<const Type*> locals;  ///< parameters first
  std::vector<Value> constants;
  std::vector<Instruction> code;
  struct Interrupt {
    std::int32_t condition = 0, action = 0;  ///< where their code begins
  };
  std::vector<Interrupt> interrupts;
  Native native;      ///< of the controller's own
  bool data = false;  ///< values of a .dat: run once
};

class Program {
 public:
  /// Modules by file (.src, .sub, .dat). `system`: further predefined declarations, in the form of a .dat.
  /// Throws calib::FileError naming file and line.
  explicit Program(const std::map<std::string, std::string>& files, std::string_view system = {});
  ~Program();
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  /// The body of an EXT or EXTFCT of `system`. Throws std::logic_error for another name.
  void bind(std::string_view name, Native native);
  /// A global or system variable. Throws std::out_of_range.
  Variable& variable(std::string_view name);
  Value& operator[](std::string_view name) { return variable(name).value; }
  bool has(std::string_view name) const;
  /// The module's main routine, or a GLOBAL one. Throws std::out_of_range.
  const Routine& routine(std::string_view name) const;
  /// A predefined or GLOBAL type. Throws std::out_of_range.
  const Type& type(std::string_view name) const;

 private:
  friend class Loader;
  friend class Compiler;
  double scalars_ = 0.0;  ///< of all variables
  std::deque<Type> types_;
  std::deque<Variable> variables_;
  std::deque<Routine> routines_;
  // By name; what is local to a module by "MODULE:NAME".
  std::map<std::string, const Type*, std::less<>> type_names_;
  std::map<std::string, Variable*, std::less<>> variable_names_;
  std::map<std::string, Routine*, std::less<>> routine_names_;
};

// Declarations of every controller, in KRL: types, numeric and text functions.

extern const std::string_view kSystem;

/// SQRT, SIN, StrComp, INV_POS, ...
void bind_functions(Program& program);

}  // namespace cellcal::sim::krl

#pragma once
// Compiled KRL modules with their variables, which the interpreters of robot and submit share. Modules that a controller
// does not select are refused with file and line.

#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "calib/export/krl_text.h"
#include "sim/krl/value.h"

namespace cellcal::sim::krl {

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

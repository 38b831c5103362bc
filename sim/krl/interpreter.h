#pragma once
// Executes the code of a Program, resumable: run() returns where a statement waits. Robot and submit interpreter are two
// of these over one Program.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sim/krl/program.h"

namespace cellcal::sim::krl {

struct Motion {
  enum class Kind { kPtp, kLin, kPtpRel, kLinRel };
  Kind kind = Kind::kPtp;
  const Value&
      target;  ///< AXIS, E6AXIS, FRAME, POS or E6POS; components without a value keep theirs
  bool approximate = false, in_tool = false;
};

/// The arm.
class Mover {
 public:
  virtual ~Mover() = default;
  /// Begins it. Throws RunError.
  virtual void move(const Motion& motion) = 0;
  virtual bool moving() const = 0;
  virtual void brake(bool fast) = 0;
  /// RESUME: the rest of the motion is discarded.
  virtual void drop_motion() = 0;
  /// End of an interrupt's sub-program without RESUME: the motion continues.
  virtual void go_on() = 0;
};

class Interpreter {
 public:
  enum class State { kFree, kRunning, kHalted, kEnded, kFailed };

  /// Without a Mover a motion is a fault, as of a submit interpreter.
  explicit Interpreter(Program& program, Mover* mover = nullptr);

  /// From its beginning. Throws std::out_of_range.
  void select(std::string_view routine);
  /// As `select`, of a routine that is not found by name.
  void select(const Routine& routine);
  void cancel();
  /// Until a statement waits, the program ends, or `budget` instructions were executed.
  void run(double now_s, int budget = 100'000);
  /// Start key after HALT.
  void go_on();
  /// Conditions of the interrupts that are on: an edge starts its sub-program.
  void poll_interrupts();

  State state() const { return state_; }
  bool running() const { return state_ == State::kRunning; }
  /// "file:line: ...", of kFailed and kHalted.
  const std::string& message() const { return message_; }
  /// The routine is active: executed, or a caller.
  bool is_in(std::string_view routine) const;
  /// An interrupt's sub-program is executed.
  bool in_interrupt() const;
  /// Statements executed since construction.
  struct Executed {
    std::int64_t statements =
        0;  ///< lines begun; a line that calls a DEFFCT begins again behind it
    std::int64_t operations = 0;  ///< of numbers and truths
    std::int64_t frames = 0;      ///< geometric operators
    std::int64_t calls = 0;       ///< of the controller's own functions
  };
  const Executed& executed() const { return executed_; }
  /// Result of a selected DEFFCT that has ended.
  const Value* result() const {
    return state_ == State::kEnded && !values_.empty() ? &values_.back() : nullptr;
  }

 private:
  struct Reference {
    Value* at = nullptr;
    Variable* variable = nullptr;
    std::size_t index = 0;
  };
  struct Frame {
    const Routine* routine = nullptr;
    std::size_t at = 0;
    std::vector<Value> locals;
    std::vector<Reference> given;  ///< parameters that are not :IN
    std::size_t values = 0, references = 0;
    std::optional<double> until;  ///< WAIT SEC
    int priority = kNone;         ///< of the interrupt whose sub-program this begins
    bool in_expression = false;
  };
  struct Interrupt {
    int priority = 0;
    std::size_t frame = 0;  ///< that declared it
    const Routine* routine = nullptr;
    Routine::Interrupt code;
    bool on = false, enabled = true, last = false, pending = false;
  };
  static constexpr int kNone = 1'000;

  bool step(double now_s);
  void count(const Instruction& one, const Routine* routine);
  bool control(const Instruction& one, Frame& frame, double now_s);
  void access(const Instruction& one, Frame& frame);
  void operate(const Instruction& one);
  void compare(Op op);
  void whole_numbers(Op op, Value& a, const Value& b);
  void call(const Routine& routine);
  /// Without parameters and local variables: a condition or action of an interrupt.
  void enter(const Routine& routine, std::int32_t at, int priority);
  void native(const Routine& routine);
  bool give_back(const Instruction& one);
  void index(int subscripts);
  void load();
  void store();
  void resume();
  void command(const Instruction& one, Frame& frame);
  bool holds(const Interrupt& interrupt);
  void start(Interrupt& interrupt);
  int priority() const;
  void drop(std::size_t frames);
  Value pop();
  Reference pop_reference();
  void fail(const std::string& words);

  Program& program_;
  Mover* mover_;
  const Type &real_, &truth_;
  std::vector<Frame> frames_;
  std::vector<Value> values_;
  std::vector<Reference> references_;
  std::vector<Interrupt> interrupts_;
  State state_ = State::kFree;
  Executed executed_;
  const Routine* last_routine_ = nullptr;
  std::int32_t last_line_ = 0;
  std::string message_;
};

}  // namespace cellcal::sim::krl

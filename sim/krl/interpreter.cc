#include "sim/krl/interpreter.h"

#include <algorithm>

namespace cellcal::sim::krl {

namespace {

using Kind = Type::Kind;
constexpr std::size_t kMostFrames = 200;

}  // namespace

// ---- stacks

Interpreter::Interpreter(Program& program, Mover* mover)
    : program_(program), mover_(mover), real_(program.type("REAL")), truth_(program.type("BOOL")) {}

Value Interpreter::pop() {
  Value top = std::move(values_.back());
  values_.pop_back();
  return top;
}

Interpreter::Reference Interpreter::pop_reference() {
  const Reference top = references_.back();
  references_.pop_back();
  return top;
}

// ---- the program

void Interpreter::select(std::string_view routine) { select(program_.routine(routine)); }

void Interpreter::select(const Routine& chosen) {
  if (!chosen.parameters.empty()) throw std::out_of_range(chosen.name + " has parameters");
  cancel();
  state_ = State::kRunning;
  call(chosen);
}

void Interpreter::cancel() {
  frames_.clear();
  values_.clear();
  references_.clear();
  interrupts_.clear();
  message_.clear();
  state_ = State::kFree;
}

void Interpreter::go_on() {
  if (state_ != State::kHalted) return;
  state_ = State::kRunning;
  message_.clear();
}

bool Interpreter::is_in(std::string_view routine) const {
  return std::any_of(frames_.begin(), frames_.end(),
                     [&](const Frame& frame) { return frame.routine->name == routine; });
}

bool Interpreter::in_interrupt() const { return priority() != kNone; }

int Interpreter::priority() const {
  int least = kNone;
  for (const Frame& frame : frames_) least = std::min(least, frame.priority);
  return least;
}

void Interpreter::fail(const std::string& words) {
  const Frame& frame = frames_.back();
  const std::size_t at = std::min(frame.at > 0 ? frame.at - 1 : 0, frame.routine->code.size() - 1);
  message_ =
      frame.routine->file + ":" + std::to_string(frame.routine->code[at].line) + ": " + words;
  state_ = State::kFailed;
}

void Interpreter::run(double now_s, int budget) {
  if (state_ != State::kRunning) return;
  try {
    while (budget-- > 0 && step(now_s)) {
    }
  } catch (const RunError& error) {
    fail(error.what());
  }
}

void Interpreter::count(const Instruction& one, const Routine* routine) {
  if (one.line != last_line_ || routine != last_routine_) ++executed_.statements;
  last_line_ = one.line;
  last_routine_ = routine;
  if (one.op >= Op::kNegative && one.op < Op::kCompose) ++executed_.operations;
  if (one.op == Op::kCompose) ++executed_.frames;
  if (one.op == Op::kNative) ++executed_.calls;
}

/// False: it waits, or has ended.
bool Interpreter::step(double now_s) {
  Frame& frame = frames_.back();
  const Instruction& one = frame.routine->code[frame.at++];
  count(one, frame.routine);
  if (one.op >= Op::kJump) return control(one, frame, now_s);
  if (one.op >= Op::kNegative) {
    operate(one);
  } else {
    access(one, frame);
  }
  return true;
}

void Interpreter::access(const Instruction& one, Frame& frame) {
  const auto a = static_cast<std::size_t>(one.a);
  switch (one.op) {
    case Op::kConstant: values_.push_back(frame.routine->constants[a]); break;
    case Op::kGlobal: references_.push_back({&one.variable->value, one.variable, 0}); break;
    case Op::kLocal:
      if (a < frame.given.size() && frame.given[a].at != nullptr)
        references_.push_back(frame.given[a]);
      else
        references_.push_back({&frame.locals[a], nullptr, 0});
      break;
    case Op::kField: references_.back().at = &references_.back().at->parts[a]; break;
    case Op::kIndex: index(one.a); break;
    case Op::kLoad: load(); break;
    case Op::kStore: store(); break;
    case Op::kNew: values_.emplace_back(*one.type); break;
    default: {  // kSetPart
      const Value part = pop();
      assign(values_.back().parts[a], part);
    }
  }
}

void Interpreter::index(int subscripts) {
  Reference& reference = references_.back();
  const std::vector<int>& extents = reference.at->type->extents;
  std::size_t flat = 0;
  const std::size_t first = values_.size() - static_cast<std::size_t>(subscripts);
  for (std::size_t i = 0; i < extents.size(); ++i) {
    const std::int32_t subscript = values_[first + i].i;
    // An open array has the extent of what was given for it.
    const int extent = extents[i] > 0 ? extents[i] : static_cast<int>(reference.at->parts.size());
    if (subscript < 1 || subscript > extent)
      throw RunError("subscript " + std::to_string(subscript) + " is outside 1 to " +
                     std::to_string(extent));
    flat = flat * static_cast<std::size_t>(extent) + static_cast<std::size_t>(subscript - 1);
    if (i == 0) reference.index = flat;
  }
  values_.resize(first);
  reference.at = &reference.at->parts[flat];
}

void Interpreter::load() {
  const Reference from = pop_reference();
  if (from.variable != nullptr && from.variable->read)
    from.variable->read(from.variable->value, from.index);
  if (!from.at->given && !from.at->any())
    throw RunError((from.variable != nullptr ? from.variable->name : from.at->type->name) +
                   " is read and has no value");
  values_.push_back(*from.at);
}

void Interpreter::store() {
  const Value value = pop();
  const Reference to = pop_reference();
  assign(*to.at, value);
  if (to.variable != nullptr && to.variable->set) to.variable->set(to.variable->value, to.index);
}

// ---- operators

void Interpreter::operate(const Instruction& one) {
  if (one.op == Op::kNot || one.op == Op::kBitNot) {
    Value& top = values_.back();
    top.i = one.op == Op::kNot ? !top.i : ~top.i;
    return;
  }
  if (one.op == Op::kNegative) {
    Value& top = values_.back();
    top.set(-top.number());
    return;
  }
  if (one.op >= Op::kEqual && one.op <= Op::kGreaterEqual) return compare(one.op);
  const Value b = pop();
  Value& a = values_.back();
  if (one.op == Op::kCompose) {
    a = composed(a, b);
  } else if (a.type->kind != Kind::kReal && b.type->kind != Kind::kReal) {
    whole_numbers(one.op, a, b);
  } else {
    const auto x = static_cast<float>(a.number()), y = static_cast<float>(b.number());
    if (one.op == Op::kDivide && y == 0.0F) throw RunError("division by zero");
    const float result = one.op == Op::kMultiply ? x * y
                         : one.op == Op::kDivide ? x / y
                         : one.op == Op::kAdd    ? x + y
                                                 : x - y;
    a.type = &real_;
    a.set(result);
  }
}

void Interpreter::whole_numbers(Op op, Value& a, const Value& b) {
  const std::int64_t x = a.i, y = b.i;
  if (op == Op::kDivide && y == 0) throw RunError("division by zero");
  const std::int64_t result = op == Op::kMultiply                               ? x * y
                              : op == Op::kDivide                               ? x / y
                              : op == Op::kAdd                                  ? x + y
                              : op == Op::kSubtract                             ? x - y
                              : op == Op::kAnd || op == Op::kBitAnd             ? (x & y)
                              : op == Op::kExclusive || op == Op::kBitExclusive ? (x ^ y)
                                                                                : (x | y);
  if (result > INT32_MAX || result < INT32_MIN) throw RunError("an INT beyond its range");
  a.i = static_cast<std::int32_t>(result);
}

void Interpreter::compare(Op op) {
  const Value b = pop(), a = pop();
  const double x = a.number(), y = b.number();
  const bool result = op == Op::kEqual       ? x == y
                      : op == Op::kUnequal   ? x != y
                      : op == Op::kLess      ? x < y
                      : op == Op::kGreater   ? x > y
                      : op == Op::kLessEqual ? x <= y
                                             : x >= y;
  values_.emplace_back(truth_).set_whole(result ? 1 : 0);
}

// ---- calls

void Interpreter::call(const Routine& routine) {
  if (frames_.size() >= kMostFrames) throw RunError("sub-programs are nested too deeply");
  Frame frame;
  frame.routine = &routine;
  frame.in_expression = routine.result != nullptr;
  for (const Type* type : routine.locals) frame.locals.emplace_back(*type);
  frame.given.resize(routine.parameters.size());
  for (std::size_t i = routine.parameters.size(); i-- > 0;) {
    if (!routine.parameters[i].in) {
      frame.given[i] = pop_reference();
    } else if (routine.parameters[i].type->kind == Kind::kArray) {
      frame.locals[i] = pop();
    } else {
      assign(frame.locals[i], pop());
    }
  }
  frame.values = values_.size();
  frame.references = references_.size();
  frames_.push_back(std::move(frame));
}

void Interpreter::enter(const Routine& routine, std::int32_t at, int priority) {
  Frame& frame = frames_.emplace_back();
  frame.routine = &routine;
  frame.at = static_cast<std::size_t>(at);
  frame.values = values_.size();
  frame.references = references_.size();
  frame.priority = priority;
}

void Interpreter::native(const Routine& routine) {
  if (!routine.native) throw RunError(routine.name + "() does not exist on this controller");
  std::vector<Value> in(routine.parameters.size());
  std::vector<Value*> arguments(routine.parameters.size());
  for (std::size_t i = arguments.size(); i-- > 0;) {
    const Parameter& parameter = routine.parameters[i];
    if (!parameter.in) {
      arguments[i] = pop_reference().at;
    } else if (parameter.type->kind == Kind::kArray) {
      in[i] = pop();
      arguments[i] = &in[i];
    } else {
      assign(in[i] = Value(*parameter.type), pop());
      arguments[i] = &in[i];
    }
  }
  Value result = routine.native(arguments);
  if (routine.result != nullptr) assign(values_.emplace_back(*routine.result), result);
}

bool Interpreter::give_back(const Instruction& one) {
  const Routine& routine = *frames_.back().routine;
  std::optional<Value> result;
  if (one.a == 1)
    assign(result.emplace(*one.type), pop());
  else if (routine.result != nullptr && frames_.back().priority == kNone)
    throw RunError(routine.name + " ends without RETURN");
  if (frames_.back().priority != kNone && mover_ != nullptr) mover_->go_on();
  drop(frames_.size() - 1);
  if (result) values_.push_back(std::move(*result));
  if (!frames_.empty()) return true;
  state_ = State::kEnded;
  return false;
}

void Interpreter::drop(std::size_t frames) {
  while (frames_.size() > frames) {
    values_.resize(frames_.back().values);
    references_.resize(frames_.back().references);
    frames_.pop_back();
  }
  std::erase_if(interrupts_, [&](const Interrupt& one) { return one.frame >= frames; });
}

// ---- control

bool Interpreter::control(const Instruction& one, Frame& frame, double now_s) {
  switch (one.op) {
    case Op::kJump: frame.at = static_cast<std::size_t>(one.a); return true;
    case Op::kJumpFalse:
      if (!pop().truth()) frame.at = static_cast<std::size_t>(one.a);
      return true;
    case Op::kCall: call(*one.routine); return true;
    case Op::kNative: native(*one.routine); return state_ == State::kRunning;
    case Op::kDrop: values_.pop_back(); return true;
    case Op::kReturn: return give_back(one);
    case Op::kWaitFor:
      if (pop().truth()) return true;
      frame.at = static_cast<std::size_t>(one.a);
      return false;
    case Op::kWaitSec: {
      if (!frame.until) frame.until = now_s + values_.back().number();
      // Steps of the clock are no exact fractions.
      if (now_s < *frame.until - 1e-6) {
        --frame.at;
        return false;
      }
      frame.until.reset();
      values_.pop_back();
      return true;
    }
    case Op::kMove: {
      if (mover_ == nullptr) throw RunError("a submit program has no motions");
      const Value target = pop();
      mover_->move({static_cast<Motion::Kind>(one.a), target, (one.b & 1) != 0, (one.b & 2) != 0});
      return true;
    }
    case Op::kStandstill:
      if (mover_ == nullptr || !mover_->moving()) return true;
      --frame.at;
      return false;
    case Op::kHalt:
      fail("HALT");
      state_ = State::kHalted;
      return false;
    case Op::kBrake:
      if (!in_interrupt()) throw RunError("BRAKE outside an interrupt's sub-program");
      if (mover_ != nullptr) mover_->brake(one.a != 0);
      return true;
    case Op::kResume: resume(); return true;
    default: command(one, frame); return true;
  }
}

// ---- interrupts

void Interpreter::command(const Instruction& one, Frame& frame) {
  const auto what = static_cast<InterruptCommand>(one.a);
  const bool all = one.b < 0;
  const int chosen = all ? 0 : pop().i;
  if (what == InterruptCommand::kDeclare) {
    if (chosen < 1 || chosen > 128) throw RunError("an interrupt's priority is 1 to 128");
    std::erase_if(interrupts_, [&](const Interrupt& i) { return i.priority == chosen; });
    const auto& code = frame.routine->interrupts[static_cast<std::size_t>(one.b)];
    interrupts_.push_back({chosen, frames_.size() - 1, frame.routine, code});
    std::sort(interrupts_.begin(), interrupts_.end(),
              [](const Interrupt& a, const Interrupt& b) { return a.priority < b.priority; });
    return;
  }
  bool any = all;
  for (Interrupt& interrupt : interrupts_) {
    if (!all && interrupt.priority != chosen) continue;
    any = true;
    if (what == InterruptCommand::kOn || what == InterruptCommand::kOff) {
      interrupt.on = what == InterruptCommand::kOn;
      interrupt.pending = false;
      // Edge-triggered: a condition that already holds does not trigger.
      interrupt.last = interrupt.on && holds(interrupt);
    } else {
      interrupt.enabled = what == InterruptCommand::kEnable;
    }
  }
  if (!any) throw RunError("interrupt " + std::to_string(chosen) + " is not declared");
}

/// Executes its condition.
bool Interpreter::holds(const Interrupt& interrupt) {
  const std::size_t frames = frames_.size();
  enter(*interrupt.routine, interrupt.code.condition, kNone);
  constexpr int kMostSteps = 1'000;
  for (int i = 0; frames_.size() > frames; ++i)
    if (!step(0.0) || i > kMostSteps) throw RunError("an interrupt's condition waits");
  return pop().truth();
}

void Interpreter::poll_interrupts() {
  if (state_ != State::kRunning) return;
  try {
    for (Interrupt& interrupt : interrupts_) {
      if (!interrupt.on) continue;
      const bool now = holds(interrupt);
      interrupt.pending = interrupt.pending || (now && !interrupt.last);
      interrupt.last = now;
    }
    for (Interrupt& interrupt : interrupts_)
      if (interrupt.on && interrupt.enabled && interrupt.pending && interrupt.priority < priority())
        return start(interrupt);
  } catch (const RunError& error) {
    fail(error.what());
  }
}

void Interpreter::start(Interrupt& interrupt) {
  interrupt.pending = false;
  enter(*interrupt.routine, interrupt.code.action, interrupt.priority);
}

void Interpreter::resume() {
  const int current = priority();
  const auto declared = std::find_if(interrupts_.begin(), interrupts_.end(),
                                     [&](const Interrupt& i) { return i.priority == current; });
  if (declared == interrupts_.end()) throw RunError("RESUME outside an interrupt's sub-program");
  const std::size_t level = declared->frame;
  const auto interrupted = std::find_if(frames_.begin(), frames_.end(),
                                        [](const Frame& f) { return f.priority != kNone; });
  // At the level of the declaration there is no sub-program to be left.
  if (static_cast<std::size_t>(interrupted - frames_.begin()) <= level + 1 ||
      frames_[level + 1].in_expression)
    throw RunError("RESUME at the level where the interrupt was declared");
  if (mover_ != nullptr) mover_->drop_motion();
  drop(level + 1);
}

}  // namespace cellcal::sim::krl

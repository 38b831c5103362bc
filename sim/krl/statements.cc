// Statements.

#include <algorithm>
#include <utility>

#include "sim/krl/compiler.h"
#include "sim/krl/interpreter.h"

namespace cellcal::sim::krl {

namespace {

using Kind = Type::Kind;

/// Statements refused by name at load: motions and inputs that the shipped files do not use.
constexpr std::string_view kNotExecuted[] = {
    "ANIN",  "ANOUT",  "CIRC", "CIRC_REL", "ENDSPLINE", "IMPORT", "ON_ERROR_PROCEED", "PTP_SPLINE",
    "SCIRC", "SIGNAL", "SLIN", "SPL",      "SPLINE",    "SPTP",   "TRIGGER"};

}  // namespace

void Compiler::body(std::size_t at, std::size_t end) {
  at_ = at;
  end_ = end;
  block({});
  for (const auto& [jump, label] : gotos_) {
    const auto found = labels_.find(label);
    Instruction& instruction = routine_.code[static_cast<std::size_t>(jump)];
    if (found == labels_.end())
      fail_at(lines_.file, instruction.line, "GOTO " + label + ": no such label");
    instruction.a = found->second;
  }
  if (end < lines_.lines.size()) cursor_.begin(lines_.file, lines_.lines[end]);
  // A DEFFCT that ends here has no result.
  emit(Op::kReturn);
}

/// Up to a line that begins with one of `ends`, which is returned and left in the cursor.
std::string Compiler::block(Words ends) {
  const Deeper deeper(*this);
  const int opened = at_ > 0 ? lines_.lines[at_ - 1].number : 0;
  for (; at_ < end_;) {
    const source::Line& line = lines_.lines[at_++];
    if (is_declaration(line)) {
      cursor_.begin(lines_.file, line);
      cursor_.fail("a declaration follows a statement");
    }
    cursor_.begin(lines_.file, line);
    for (const std::string_view end : ends)
      if (cursor_.takes(end)) return std::string(end);
    statement();
    cursor_.end();
  }
  if (ends.size() == 0) return {};
  fail_at(lines_.file, opened, "the block has no " + std::string(*(ends.end() - 1)));
}

void Compiler::statement() {
  if (!cursor_.sees_word()) cursor_.fail("no statement begins so");
  const std::string word = cursor_.peek()->word;
  if (cursor_.sees(":", 1)) {
    if (!labels_.emplace(cursor_.name(), here()).second) cursor_.fail(word + " is a label already");
    return cursor_.expect(":");
  }
  if (simple(word)) return;
  if (std::find(std::begin(kNotExecuted), std::end(kNotExecuted), word) != std::end(kNotExecuted))
    cursor_.fail(word + " is not executed here");
  assignment_or_call();
}

bool Compiler::simple(const std::string& word) {
  static const std::map<std::string_view, void (Compiler::*)()> kStatements = {
      {"IF", &Compiler::if_statement},
      {"WHILE", &Compiler::while_statement},
      {"REPEAT", &Compiler::repeat_statement},
      {"LOOP", &Compiler::loop_statement},
      {"FOR", &Compiler::for_statement},
      {"SWITCH", &Compiler::switch_statement},
      {"WAIT", &Compiler::wait},
      {"EXIT", &Compiler::leave},
      {"RETURN", &Compiler::give_back},
      {"PTP", &Compiler::move},
      {"LIN", &Compiler::move},
      {"PTP_REL", &Compiler::move},
      {"LIN_REL", &Compiler::move},
      {"INTERRUPT", &Compiler::interrupt},
      {"GLOBAL", &Compiler::interrupt}};
  if (const auto found = kStatements.find(word); found != kStatements.end()) {
    cursor_.take();
    (this->*found->second)();
    return true;
  }
  if (cursor_.takes("CONTINUE")) return true;
  if (cursor_.takes("HALT")) {
    emit(Op::kHalt);
  } else if (cursor_.takes("RESUME")) {
    emit(Op::kResume);
  } else if (cursor_.takes("BRAKE")) {
    emit(Op::kBrake, cursor_.takes("F") ? 1 : 0);
    emit(Op::kStandstill);
  } else if (cursor_.takes("GOTO")) {
    const std::int32_t jump = emit(Op::kJump);
    gotos_.emplace_back(jump, cursor_.name());
  } else {
    return false;
  }
  return true;
}

void Compiler::assignment_or_call() {
  if (cursor_.sees("(", 1)) {
    call(true);
    return;
  }
  const Type* const type = reference(true);
  cursor_.expect("=");
  value(type);
  emit(Op::kStore);
}

void Compiler::if_statement() {
  value(&program_.type("BOOL"));
  cursor_.expect("THEN");
  cursor_.end();
  std::int32_t jump = emit(Op::kJumpFalse);
  if (block({"ELSE", "ENDIF"}) == "ELSE") {
    cursor_.end();
    const std::int32_t over = emit(Op::kJump);
    land(jump);
    jump = over;
    block({"ENDIF"});
  }
  land(jump);
}

/// A block that EXIT leaves; its jumps are left in exits_.
void Compiler::loop_block(Words ends) {
  const bool outer = std::exchange(in_loop_, true);
  block(ends);
  in_loop_ = outer;
}

void Compiler::land_exits(std::size_t from) {
  for (; exits_.size() > from; exits_.pop_back()) land(exits_.back());
}

void Compiler::while_statement() {
  const std::size_t exits = exits_.size();
  const std::int32_t begin = here();
  value(&program_.type("BOOL"));
  cursor_.end();
  exits_.push_back(emit(Op::kJumpFalse));
  loop_block({"ENDWHILE"});
  jump_to(Op::kJump, begin);
  land_exits(exits);
}

void Compiler::repeat_statement() {
  cursor_.end();
  const std::size_t exits = exits_.size();
  const std::int32_t begin = here();
  loop_block({"UNTIL"});
  value(&program_.type("BOOL"));
  jump_to(Op::kJumpFalse, begin);
  land_exits(exits);
}

void Compiler::loop_statement() {
  cursor_.end();
  const std::size_t exits = exits_.size();
  const std::int32_t begin = here();
  loop_block({"ENDLOOP"});
  jump_to(Op::kJump, begin);
  land_exits(exits);
}

void Compiler::for_statement() {
  const Type* const whole = &program_.type("INT");
  const std::size_t exits = exits_.size();
  const std::int32_t counter_at = here();
  if (reference(true) != whole) cursor_.fail("the counter of FOR is an INT");
  const std::vector<Instruction> counter(routine_.code.begin() + counter_at, routine_.code.end());
  const auto again = [&] {
    routine_.code.insert(routine_.code.end(), counter.begin(), counter.end());
  };
  cursor_.expect("=");
  value(whole);
  emit(Op::kStore);
  cursor_.expect("TO");
  const std::int32_t last = hidden(whole);
  emit(Op::kLocal, last);
  value(whole);
  emit(Op::kStore);
  std::int32_t step = 1;
  if (cursor_.takes("STEP")) {
    const bool minus = cursor_.takes("-");
    const source::Token& size = cursor_.take();
    if (size.kind != source::Token::Kind::kNumber || !(size.value >= 1.0 && size.value < 1e9))
      cursor_.fail("the step of FOR is a whole number");
    step = static_cast<std::int32_t>(minus ? -size.value : size.value);
  }
  cursor_.end();
  const std::int32_t begin = here();
  again();
  emit(Op::kLoad);
  emit(Op::kLocal, last);
  emit(Op::kLoad);
  emit(step > 0 ? Op::kLessEqual : Op::kGreaterEqual);
  exits_.push_back(emit(Op::kJumpFalse));
  loop_block({"ENDFOR"});
  again();
  again();
  emit(Op::kLoad);
  Value by(*whole);
  by.set_whole(step);
  constant(std::move(by));
  emit(Op::kAdd);
  emit(Op::kStore);
  jump_to(Op::kJump, begin);
  land_exits(exits);
}

void Compiler::switch_statement() {
  const std::int32_t slot = hidden(nullptr);
  emit(Op::kLocal, slot);
  const Type* const type = expression();
  if (type->kind == Kind::kReal || !type->parts.empty()) cursor_.fail("SWITCH of " + type->name);
  routine_.locals[static_cast<std::size_t>(slot)] = type;
  emit(Op::kStore);
  cursor_.end();
  std::vector<std::int32_t> done;
  if (at_ >= end_) cursor_.fail("SWITCH without CASE");
  cursor_.begin(lines_.file, lines_.lines[at_++]);
  std::string next = cursor_.takes("CASE") ? "CASE" : "";
  if (next.empty()) cursor_.fail("SWITCH without CASE");
  while (next == "CASE") {
    std::vector<std::int32_t> matched;
    do {
      emit(Op::kLocal, slot);
      emit(Op::kLoad);
      combine(Op::kUnequal, type, expression(type));
      matched.push_back(emit(Op::kJumpFalse));
    } while (cursor_.takes(","));
    cursor_.end();
    const std::int32_t other = emit(Op::kJump);
    for (const std::int32_t jump : matched) land(jump);
    next = block({"CASE", "DEFAULT", "ENDSWITCH"});
    done.push_back(emit(Op::kJump));
    land(other);
  }
  if (next == "DEFAULT") {
    cursor_.end();
    block({"ENDSWITCH"});
  }
  for (const std::int32_t jump : done) land(jump);
}

void Compiler::wait() {
  if (cursor_.takes("SEC")) {
    value(&program_.type("REAL"));
    emit(Op::kWaitSec);
    return;
  }
  cursor_.expect("FOR");
  const std::int32_t condition = here();
  value(&program_.type("BOOL"));
  emit(Op::kWaitFor, condition);
}

void Compiler::leave() {
  if (!in_loop_) cursor_.fail("EXIT outside a loop");
  exits_.push_back(emit(Op::kJump));
}

void Compiler::give_back() {
  if (routine_.result == nullptr) {
    if (!cursor_.ended()) cursor_.fail("a DEF has no result");
    emit(Op::kReturn);
    return;
  }
  value(routine_.result);
  emit(Op::kReturn, 1);
  routine_.code.back().type = routine_.result;
}

void Compiler::move() {
  const std::string& word = lines_.lines[at_ - 1].tokens[0].word;
  const bool axes = cursor_.sees("{") && cursor_.sees_word(1) && !cursor_.sees(":", 2) &&
                    program_.type("E6AXIS").index_of(lines_.lines[at_ - 1].tokens[2].word) >= 0 &&
                    program_.type("E6POS").index_of(lines_.lines[at_ - 1].tokens[2].word) < 0;
  const Type* const type = expression(&program_.type(axes ? "E6AXIS" : "E6POS"));
  const bool axial = type->kind == Kind::kStruct && type->index_of("A1") >= 0;
  if (!is_frame(*type) && !(axial && word.starts_with("PTP")))
    cursor_.fail(word + " to " + type->name);
  const auto kind = word == "PTP"       ? Motion::Kind::kPtp
                    : word == "LIN"     ? Motion::Kind::kLin
                    : word == "PTP_REL" ? Motion::Kind::kPtpRel
                                        : Motion::Kind::kLinRel;
  bool approximate = false, in_tool = false;
  while (!cursor_.ended()) {
    const std::string how = cursor_.take().word;
    approximate = approximate || how.starts_with("C_");
    in_tool = in_tool || how == "#TOOL";
    if (!how.starts_with("C_") && how != "#TOOL" && how != "#BASE")
      cursor_.fail(how + " is nothing of a motion");
  }
  emit(Op::kMove, static_cast<std::int32_t>(kind), (approximate ? 1 : 0) + (in_tool ? 2 : 0));
  emit(Op::kStandstill);
}

void Compiler::interrupt() {
  const bool global = lines_.lines[at_ - 1].tokens[0].word == "GLOBAL";
  if (global) cursor_.expect("INTERRUPT");
  if (cursor_.takes("DECL")) return declare_interrupt();
  static constexpr std::string_view kCommands[] = {"ON", "OFF", "ENABLE", "DISABLE"};
  const auto command = std::ranges::find_if(
      kCommands, [this](std::string_view word) { return cursor_.takes(word); });
  if (command == std::end(kCommands))
    cursor_.fail("INTERRUPT needs DECL, ON, OFF, ENABLE or DISABLE");
  const bool all = cursor_.ended();
  if (!all) value(&program_.type("INT"));
  emit(Op::kInterrupt,
       static_cast<std::int32_t>(InterruptCommand::kOn) +
           static_cast<std::int32_t>(command - std::begin(kCommands)),
       all ? -1 : 0);
}

void Compiler::declare_interrupt() {
  value(&program_.type("INT"));
  emit(Op::kInterrupt, static_cast<std::int32_t>(InterruptCommand::kDeclare),
       static_cast<std::int32_t>(routine_.interrupts.size()));
  const std::int32_t over = emit(Op::kJump);
  Routine::Interrupt made;
  made.condition = here();
  cursor_.expect("WHEN");
  no_locals_ = true;
  value(&program_.type("BOOL"));
  emit(Op::kReturn, 1);
  routine_.code.back().type = &program_.type("BOOL");
  cursor_.expect("DO");
  made.action = here();
  call(true);
  emit(Op::kReturn);
  no_locals_ = false;
  routine_.interrupts.push_back(made);
  land(over);
}

}  // namespace cellcal::sim::krl

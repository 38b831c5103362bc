// Declarations and expressions.

#include "sim/krl/compiler.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "calib/model/error.h"

namespace cellcal::sim::krl {

namespace {

using Kind = Type::Kind;
using source::Token;

constexpr std::size_t kLongestName = 24;

constexpr std::string_view kKeywords[] = {
    "AND",    "BRAKE",   "B_AND",     "B_EXOR", "B_NOT",   "B_OR",      "CASE",     "CONST",
    "DECL",   "DEF",     "DEFAULT",   "DEFDAT", "DEFFCT",  "DO",        "ELSE",     "END",
    "ENDDAT", "ENDFCT",  "ENDFOR",    "ENDIF",  "ENDLOOP", "ENDSWITCH", "ENDWHILE", "ENUM",
    "EXIT",   "EXOR",    "EXT",       "EXTFCT", "FALSE",   "FOR",       "GLOBAL",   "GOTO",
    "HALT",   "IF",      "INTERRUPT", "LIN",    "LIN_REL", "LOOP",      "NOT",      "OR",
    "PTP",    "PTP_REL", "REPEAT",    "RESUME", "RETURN",  "STRUC",     "SWITCH",   "THEN",
    "TO",     "TRUE",    "UNTIL",     "WAIT",   "WHEN",    "WHILE"};

struct Binary {
  std::string_view word;
  Op op;
};
/// From the weakest: comparisons bind less than AND and OR.
const std::array<std::vector<Binary>, 6> kLevels = {{
    {{"==", Op::kEqual},
     {"<>", Op::kUnequal},
     {"<=", Op::kLessEqual},
     {">=", Op::kGreaterEqual},
     {"<", Op::kLess},
     {">", Op::kGreater}},
    {{"OR", Op::kOr}, {"B_OR", Op::kBitOr}},
    {{"EXOR", Op::kExclusive}, {"B_EXOR", Op::kBitExclusive}},
    {{"AND", Op::kAnd}, {"B_AND", Op::kBitAnd}},
    {{"+", Op::kAdd}, {"-", Op::kSubtract}},
    {{"*", Op::kMultiply}, {"/", Op::kDivide}},
}};

bool is_constant(const Token* token) {
  return token != nullptr && token->kind == Token::Kind::kWord && token->word.size() > 1 &&
         token->word[0] == '#';
}

}  // namespace

void fail_at(const std::string& file, int line, const std::string& words) {
  throw calib::FileError(file, ":" + std::to_string(line) + ": " + words);
}

void Cursor::fail(const std::string& words) const { fail_at(*file_, line_->number, words); }

/// Tokens of `what` at `at`: a word, or signs without a blank between them; 0: others.
std::size_t Cursor::length(std::string_view what, std::size_t at) const {
  const auto& tokens = line_->tokens;
  if (at >= tokens.size()) return 0;
  if (tokens[at].kind == Token::Kind::kWord) return tokens[at].word == what ? 1 : 0;
  for (std::size_t i = 0; i < what.size(); ++i) {
    if (at + i >= tokens.size() || tokens[at + i].kind != Token::Kind::kSign ||
        tokens[at + i].word[0] != what[i])
      return 0;
    if (i > 0 && tokens[at + i].begin != tokens[at + i - 1].end) return 0;
  }
  return what.size();
}
bool Cursor::sees(std::string_view what, std::size_t ahead) const {
  return length(what, at_ + ahead) > 0;
}
bool Cursor::takes(std::string_view what) {
  const std::size_t size = length(what, at_);
  at_ += size;
  return size > 0;
}
void Cursor::expect(std::string_view what) {
  if (!takes(what))
    fail("expected \"" + std::string(what) + "\"" +
         (ended() ? "" : " before \"" + line_->tokens[at_].word + "\""));
}
void Cursor::end() const {
  if (!ended()) fail("\"" + line_->tokens[at_].word + "\" follows the end of the statement");
}
bool Cursor::sees_word(std::size_t ahead) const {
  const auto& tokens = line_->tokens;
  return at_ + ahead < tokens.size() && tokens[at_ + ahead].kind == Token::Kind::kWord &&
         tokens[at_ + ahead].word[0] != '#';
}
const Token& Cursor::take() {
  if (ended()) fail("the line ends too early");
  return line_->tokens[at_++];
}
std::string Cursor::name() {
  if (!sees_word()) fail("expected a name");
  const std::string& word = take().word;
  if (word.size() > kLongestName) fail(word + ": names have 24 characters at most");
  if (std::find(std::begin(kKeywords), std::end(kKeywords), word) != std::end(kKeywords))
    fail(word + " is a keyword");
  return word;
}

Compiler::Deeper::Deeper(Compiler& c) : compiler(c) {
  constexpr int kDeepest = 100;
  if (++compiler.depth_ > kDeepest) compiler.cursor_.fail("nested too deeply");
}

std::int32_t Compiler::emit(Op op, std::int32_t a, std::int32_t b) {
  routine_.code.push_back({op, a, b, cursor_.line(), nullptr, nullptr, nullptr});
  return here() - 1;
}

void Compiler::constant(Value value) {
  emit(Op::kConstant, static_cast<std::int32_t>(routine_.constants.size()));
  routine_.constants.push_back(std::move(value));
}

std::int32_t Compiler::hidden(const Type* type) {
  routine_.locals.push_back(type);
  return static_cast<std::int32_t>(routine_.locals.size()) - 1;
}

// ---- declarations

const Type* Compiler::type_named() {
  const std::string name = cursor_.take().word;
  const Type* const type = find_type(name);
  if (type == nullptr) cursor_.fail(name + ": no such type");
  return type;
}

const Type* Compiler::array_of(const Type* element, std::vector<int> extents) {
  for (const Type& type : program_.types_)
    if (type.kind == Kind::kArray && type.parts[0] == element && type.extents == extents)
      return &type;
  Type type;
  type.kind = Kind::kArray;
  type.name = element->name + "[]";
  type.parts = {element};
  type.extents = std::move(extents);
  return &program_.types_.emplace_back(std::move(type));
}

void Compiler::add_type(Type type, bool global) {
  type.predefined = lines_.file.empty();
  const std::string key = (global ? "" : lines_.module + ":") + type.name;
  if (find_type(type.name) != nullptr) cursor_.fail(type.name + " is declared twice");
  program_.type_names_[key] = &program_.types_.emplace_back(std::move(type));
}

bool Compiler::is_declaration(const source::Line& line) {
  cursor_.begin(lines_.file, line);
  if (cursor_.sees("GLOBAL")) return !cursor_.sees("INTERRUPT", 1);
  for (const char* word : {"DECL", "EXT", "EXTFCT", "STRUC", "ENUM", "SIGNAL", "CONST"})
    if (cursor_.sees(word)) return true;
  return cursor_.sees_word() && cursor_.sees_word(1) && find_type(cursor_.peek()->word) != nullptr;
}

void Compiler::declare(const source::Line& line, bool is_public) {
  cursor_.begin(lines_.file, line);
  bool global = lines_.file.empty(), constant = false, decl = false, any = true;
  while (any) {
    any = false;
    if (cursor_.takes("DECL")) decl = any = true;
    if (cursor_.takes("GLOBAL")) global = any = true;
    if (cursor_.takes("CONST")) constant = any = true;
  }
  if (global && !is_public) cursor_.fail("GLOBAL needs a DEFDAT that is PUBLIC");
  if (cursor_.takes("STRUC")) return declare_structure(global);
  if (cursor_.takes("ENUM")) return declare_enumeration(global);
  const Type* const type = type_named();
  if (!decl && !global && !type->predefined) cursor_.fail(type->name + " needs DECL before it");
  do declare_variable(type, global, constant);
  while (cursor_.takes(","));
  cursor_.end();
}

void Compiler::declare_structure(bool global) {
  Type type;
  type.kind = Kind::kStruct;
  type.name = cursor_.name();
  do {
    const Type* part = nullptr;
    if (type.parts.empty() || (cursor_.sees_word() && cursor_.sees_word(1))) {
      part = type_named();
    } else {
      part =
          type.parts.back()->kind == Kind::kArray ? type.parts.back()->parts[0] : type.parts.back();
    }
    type.names.push_back(cursor_.name());
    const std::vector<int> size = extents();
    type.parts.push_back(size.empty() ? part : array_of(part, size));
  } while (cursor_.takes(","));
  cursor_.end();
  add_type(std::move(type), global);
}

void Compiler::declare_enumeration(bool global) {
  Type type;
  type.kind = Kind::kEnum;
  type.name = cursor_.name();
  do type.names.push_back(cursor_.name());
  while (cursor_.takes(","));
  cursor_.end();
  add_type(std::move(type), global);
}

/// [3], [2,4] or []; empty: none.
std::vector<int> Compiler::extents() {
  std::vector<int> result;
  constexpr double kLargest = 100'000.0;
  if (!cursor_.takes("[")) return result;
  if (cursor_.takes("]")) return {0};
  do {
    const Token& size = cursor_.take();
    if (size.kind != Token::Kind::kNumber || !(size.value >= 1.0 && size.value <= kLargest) ||
        size.value != std::floor(size.value))
      cursor_.fail("an array's size is a whole number from 1");
    result.push_back(static_cast<int>(size.value));
  } while (cursor_.takes(","));
  if (result.size() > 3) cursor_.fail("an array has three dimensions at most");
  cursor_.expect("]");
  return result;
}

void Compiler::declare_variable(const Type* type, bool global, bool constant) {
  const std::string name = cursor_.name();
  const std::vector<int> size = extents();
  if (!size.empty()) type = array_of(type, size);
  // Locals are made with each call.
  constexpr double kMostLocal = 2'000.0, kMost = 1e6;
  double& taken = lines_.data ? program_.scalars_ : scalars_;
  taken += 1.0 + type->scalars();
  if (taken > (lines_.data ? kMost : kMostLocal)) cursor_.fail(name + ": no memory is left for it");
  if (lines_.data) {
    add_variable(name, type, global, constant);
  } else {
    add_local(name, type);
  }
  if (!cursor_.takes("=")) return;
  if (!lines_.data) cursor_.fail(name + ": only a .dat gives values with the declaration");
  emit(Op::kGlobal);
  routine_.code.back().variable = &program_.variables_.back();
  value(type);
  emit(Op::kStore);
}

void Compiler::add_variable(const std::string& name, const Type* type, bool global, bool constant) {
  const std::string key = (global ? "" : lines_.module + ":") + name;
  if (program_.variable_names_.contains(key)) cursor_.fail(name + " is declared twice");
  if (type->kind == Kind::kArray && type->extents[0] == 0) cursor_.fail(name + " has no size");
  Variable variable;
  variable.name = name;
  variable.value = Value(*type);
  variable.constant = constant;
  program_.variable_names_[key] = &program_.variables_.emplace_back(std::move(variable));
}

void Compiler::add_local(const std::string& name, const Type* type) {
  for (Parameter& parameter : routine_.parameters) {
    if (parameter.name != name) continue;
    if (parameter.type != nullptr) cursor_.fail(name + " is declared twice");
    parameter.type = type;
    const auto slot = static_cast<std::size_t>(&parameter - routine_.parameters.data());
    routine_.locals[slot] = type;
    locals_[name] = {static_cast<std::int32_t>(slot), type};
    return;
  }
  if (type->kind == Kind::kArray && type->extents[0] == 0) cursor_.fail(name + " has no size");
  if (locals_.contains(name)) cursor_.fail(name + " is declared twice");
  locals_[name] = {hidden(type), type};
}

std::size_t Compiler::declarations(std::size_t at, std::size_t end) {
  routine_.locals.resize(routine_.parameters.size());
  for (; at < end && is_declaration(lines_.lines[at]); ++at) {
    cursor_.begin(lines_.file, lines_.lines[at]);
    if (cursor_.sees("SIGNAL")) cursor_.fail("SIGNAL in a routine is not executed here");
    if (!cursor_.sees("EXT") && !cursor_.sees("EXTFCT")) declare(lines_.lines[at], false);
  }
  for (const Parameter& parameter : routine_.parameters)
    if (parameter.type == nullptr)
      fail_at(lines_.file, routine_.line, "parameter " + parameter.name + " is not declared");
  return at;
}

void Compiler::data_line(const source::Line& line) {
  cursor_.begin(lines_.file, line);
  const Type* const type = reference(false);
  cursor_.expect("=");
  value(type);
  cursor_.end();
  emit(Op::kStore);
}

// ---- expressions

void Compiler::value(const Type* want) {
  const Type* const type = expression(want);
  if (!assignable(*want, *type)) cursor_.fail(type->name + " cannot become " + want->name);
}

const Type* Compiler::expression(const Type* want) {
  const Deeper deeper(*this);
  return level(0, want);
}

const Type* Compiler::level(std::size_t depth, const Type* want) {
  if (depth == kLevels.size()) return unary(want);
  // A constant of an ENUM before its comparison.
  const Type* left = level(depth + 1, want);
  for (bool any = true; any;) {
    any = false;
    for (const Binary& binary : kLevels[depth]) {
      if (!cursor_.takes(binary.word)) continue;
      left = combine(binary.op, left, level(depth + 1, left));
      any = true;
      break;
    }
  }
  return left;
}

const Type* Compiler::combine(Op op, const Type* left, const Type* right) {
  const Type& truth = program_.type("BOOL");
  emit(op);
  const bool numbers = left->number() && right->number();
  if (op >= Op::kEqual && op <= Op::kGreaterEqual) {
    const bool order = op >= Op::kLess;
    if (!numbers && (order || left != right || !left->parts.empty()))
      cursor_.fail(left->name + " and " + right->name + " cannot be compared so");
    return &truth;
  }
  if (op == Op::kAnd || op == Op::kOr || op == Op::kExclusive) {
    if (left != &truth || right != &truth) cursor_.fail("both sides have to be BOOL");
    return &truth;
  }
  const Type& whole = program_.type("INT");
  const bool bits = op == Op::kBitAnd || op == Op::kBitOr || op == Op::kBitExclusive;
  if (!numbers || (bits && (left != &whole || right != &whole)))
    cursor_.fail(left->name + " and " + right->name + ": no such operation");
  return left == right ? left : &program_.type("REAL");
}

const Type* Compiler::unary(const Type* want) {
  for (const auto& [word, op] :
       {Binary{"NOT", Op::kNot}, Binary{"B_NOT", Op::kBitNot}, Binary{"-", Op::kNegative}}) {
    if (!cursor_.takes(word)) continue;
    const Deeper deeper(*this);
    const Type* const type = unary(want);
    const bool fits = op == Op::kNot      ? type->kind == Kind::kBool
                      : op == Op::kBitNot ? type->kind == Kind::kInt
                                          : type->number();
    if (!fits) cursor_.fail(std::string(word) + " of " + type->name);
    emit(op);
    return type;
  }
  cursor_.takes("+");
  return composition(want);
}

const Type* Compiler::composition(const Type* want) {
  const Type* left = primary(want);
  while (cursor_.takes(":")) {
    const Type* const right = primary(left);
    if (!is_frame(*left) || !is_frame(*right)) cursor_.fail("\":\" needs frames or positions");
    emit(Op::kCompose);
    left = right;
  }
  return left;
}

const Type* Compiler::number() {
  const Token& token = cursor_.take();
  const bool real =
      token.word.front() != '\'' && token.word.find_first_of(".eE") != std::string::npos;
  const Type& type = program_.type(real ? "REAL" : "INT");
  Value result(type);
  if (token.word.front() == '\'') {
    result.set_whole(static_cast<std::int32_t>(static_cast<std::uint32_t>(token.value)));
  } else {
    if (!(std::abs(token.value) <= (real ? 3e38 : 2147483647.0)))
      cursor_.fail(token.word + " is beyond the range of " + type.name);
    result.set(token.value);
  }
  constant(std::move(result));
  return &type;
}

const Type* Compiler::enumerated(const Type* want) {
  const std::string word = cursor_.take().word;
  const std::string_view name = std::string_view(word).substr(1);
  const Type* of = want != nullptr && want->kind == Kind::kEnum ? want : nullptr;
  for (const Type& type : program_.types_)
    if (of == nullptr && type.kind == Kind::kEnum && type.index_of(name) >= 0) of = &type;
  if (of == nullptr || of->index_of(name) < 0)
    cursor_.fail(word + " is no constant" + (of == nullptr ? "" : " of " + of->name));
  Value result(*of);
  result.set_whole(of->index_of(name) + 1);
  constant(std::move(result));
  return of;
}

const Type* Compiler::aggregate(const Type* want) {
  cursor_.expect("{");
  const Type* type = want;
  if (cursor_.sees_word() && cursor_.sees(":", 1)) {
    type = type_named();
    cursor_.expect(":");
  }
  if (type == nullptr || type->kind != Kind::kStruct) cursor_.fail("{...} has no structure here");
  emit(Op::kNew);
  routine_.code.back().type = type;
  do {
    const std::string name = cursor_.name();
    const int part = type->index_of(name);
    if (part < 0) cursor_.fail(type->name + " has no component " + name);
    if (cursor_.takes("[")) cursor_.expect("]");
    value(type->parts[static_cast<std::size_t>(part)]);
    emit(Op::kSetPart, part);
  } while (cursor_.takes(","));
  cursor_.expect("}");
  return type;
}

const Type* Compiler::primary(const Type* want) {
  const Token* const next = cursor_.peek();
  if (next == nullptr) cursor_.fail("a value is missing");
  if (next->kind == Token::Kind::kNumber) return number();
  if (next->kind == Token::Kind::kText) {
    if (next->word.size() < 2 || next->word.front() != '"' || next->word.back() != '"')
      cursor_.fail(next->word + " is no text");
    const std::string text = next->word.substr(1, next->word.size() - 2);
    const Type* const type =
        array_of(&program_.type("CHAR"), {std::max(1, static_cast<int>(text.size()))});
    Value result(*type);
    result.set_text(text);
    constant(std::move(result));
    cursor_.take();
    return type;
  }
  if (is_constant(next)) return enumerated(want);
  if (cursor_.sees("{")) return aggregate(want);
  if (cursor_.takes("(")) {
    const Type* const type = expression(want);
    cursor_.expect(")");
    return type;
  }
  if (cursor_.sees("TRUE") || cursor_.sees("FALSE")) {
    Value result(program_.type("BOOL"));
    result.set_whole(cursor_.takes("TRUE") ? 1 : 0);
    if (!result.truth()) cursor_.take();
    constant(std::move(result));
    return &program_.type("BOOL");
  }
  if (cursor_.sees_word() && cursor_.sees("(", 1)) return call(false);
  const Type* const type = reference(false);
  emit(Op::kLoad);
  return type;
}

const Type* Compiler::reference(bool written) {
  const std::string name = cursor_.name();
  if (const auto local = locals_.find(name); local != locals_.end()) {
    if (no_locals_)
      cursor_.fail(name + ": an interrupt's condition and call have no local variables");
    emit(Op::kLocal, local->second.slot);
    return part_of(local->second.type);
  }
  Variable* const variable = found(program_.variable_names_, name);
  if (variable == nullptr) cursor_.fail(name + " is not declared");
  if (written && variable->constant) cursor_.fail(name + " is CONST");
  emit(Op::kGlobal);
  routine_.code.back().variable = variable;
  return part_of(variable->value.type);
}

/// Subscripts and components: [n], [], .X.
const Type* Compiler::part_of(const Type* type) {
  const Type* const whole = &program_.type("INT");
  bool entire = false;
  for (;;) {
    if (cursor_.takes("[")) {
      if (type->kind != Kind::kArray) cursor_.fail(type->name + " has no subscript");
      if (cursor_.takes("]")) {
        entire = true;
        continue;
      }
      for (std::size_t i = 0; i < type->extents.size(); ++i) {
        if (i > 0) cursor_.expect(",");
        if (expression(whole)->kind != Kind::kInt) cursor_.fail("a subscript is an INT");
      }
      cursor_.expect("]");
      emit(Op::kIndex, static_cast<std::int32_t>(type->extents.size()));
      type = type->parts[0];
    } else if (type->kind == Kind::kStruct && cursor_.sees(".")) {
      cursor_.take();
      const std::string part = cursor_.name();
      const int at = type->index_of(part);
      if (at < 0) cursor_.fail(type->name + " has no component " + part);
      emit(Op::kField, at);
      type = type->parts[static_cast<std::size_t>(at)];
    } else {
      if (type->kind == Kind::kArray && !entire) cursor_.fail("an array is named with []");
      return type;
    }
  }
}

const Type* Compiler::call(bool statement) {
  const std::string name = cursor_.name();
  const Routine* const routine = found(program_.routine_names_, name);
  if (routine == nullptr) cursor_.fail(name + "(): no such sub-program");
  if (!statement && routine->result == nullptr) cursor_.fail(name + "() has no result: a DEF");
  const bool native = routine->file.empty();
  if (statement && routine->result != nullptr && !native)
    cursor_.fail(name + "(): the result of a DEFFCT is not used");
  arguments(*routine);
  emit(native ? Op::kNative : Op::kCall);
  routine_.code.back().routine = routine;
  if (statement && routine->result != nullptr) emit(Op::kDrop);
  return routine->result;
}

void Compiler::arguments(const Routine& routine) {
  cursor_.expect("(");
  for (std::size_t i = 0; i < routine.parameters.size(); ++i) {
    if (i > 0) cursor_.expect(",");
    argument(routine.parameters[i]);
  }
  if (!cursor_.takes(")"))
    cursor_.fail(routine.name + "() takes " + std::to_string(routine.parameters.size()) +
                 " parameters");
}

void Compiler::argument(const Parameter& parameter) {
  if (parameter.in) return value(parameter.type);
  const Type* const type = reference(true);
  if (!assignable(*parameter.type, *type) || type->kind != parameter.type->kind)
    cursor_.fail(parameter.name + " needs " + parameter.type->name + ", not " + type->name);
}

}  // namespace cellcal::sim::krl

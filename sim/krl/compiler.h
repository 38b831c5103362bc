#pragma once
// The body of one routine: statements to code. Internal to Program.

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "calib/export/krl_text.h"
#include "sim/krl/program.h"

namespace cellcal::sim::krl {

namespace source = calib::krl;

/// Lines of a file from one to another, with what they belong to.
struct Lines {
  std::string file, module;
  std::vector<source::Line> lines;
  bool data = false;  ///< .dat
};

/// "FILE:LINE: words" as calib::FileError.
[[noreturn]] void fail_at(const std::string& file, int line, const std::string& words);

/// The tokens of one line.
class Cursor {
 public:
  void begin(const std::string& file, const source::Line& line) {
    file_ = &file, line_ = &line, at_ = 0;
  }
  bool ended() const { return at_ >= line_->tokens.size(); }
  int line() const { return line_ == nullptr ? 0 : line_->number; }
  bool sees(std::string_view what, std::size_t ahead = 0) const;
  bool takes(std::string_view what);
  void expect(std::string_view what);
  void end() const;
  bool sees_word(std::size_t ahead = 0) const;
  const source::Token& take();
  const source::Token* peek() const { return ended() ? nullptr : &line_->tokens[at_]; }
  /// A name that may be declared. `limit` of characters is the controller's.
  std::string name();
  [[noreturn]] void fail(const std::string& words) const;

 private:
  std::size_t length(std::string_view what, std::size_t at) const;

  const std::string* file_ = nullptr;
  const source::Line* line_ = nullptr;
  std::size_t at_ = 0;
};

class Compiler {
 public:
  Compiler(Program& program, const Lines& lines, Routine& routine)
      : program_(program), lines_(lines), routine_(routine) {}

  /// Declarations from line `at` on; returns the first that is none.
  std::size_t declarations(std::size_t at, std::size_t end);
  /// Statements up to `end`.
  void body(std::size_t at, std::size_t end);
  /// `name[..]=value` of a .dat.
  void data_line(const source::Line& line);
  /// STRUC or ENUM, or the variables of DECL, of a .dat or a routine.
  void declare(const source::Line& line, bool is_public);
  bool is_declaration(const source::Line& line);

 private:
  using Words = std::initializer_list<std::string_view>;
  /// Bounds the recursion over hostile text.
  struct Deeper {
    explicit Deeper(Compiler& c);
    ~Deeper() { --compiler.depth_; }
    Compiler& compiler;
  };
  struct Local {
    std::int32_t slot = 0;
    const Type* type = nullptr;
  };

  std::int32_t emit(Op op, std::int32_t a = 0, std::int32_t b = 0);
  std::int32_t here() const { return static_cast<std::int32_t>(routine_.code.size()); }
  void land(std::int32_t jump) { routine_.code[static_cast<std::size_t>(jump)].a = here(); }
  void constant(Value value);
  std::int32_t hidden(const Type* type);

  /// The module's own of that name, else the one that all modules see; null: none.
  template <class One>
  One* found(const std::map<std::string, One*, std::less<>>& names, const std::string& name) const {
    for (const std::string& key : {lines_.module + ":" + name, name})
      if (const auto at = names.find(key); at != names.end()) return at->second;
    return nullptr;
  }
  const Type* find_type(const std::string& name) const { return found(program_.type_names_, name); }
  const Type* type_named();
  const Type* array_of(const Type* element, std::vector<int> extents);
  void add_type(Type type, bool global);
  void declare_structure(bool global);
  void declare_enumeration(bool global);
  void declare_variable(const Type* type, bool global, bool constant);
  std::vector<int> extents();
  void add_variable(const std::string& name, const Type* type, bool global, bool constant);
  void add_local(const std::string& name, const Type* type);

  // expressions: emit code, return the type
  const Type* expression(const Type* want = nullptr);
  const Type* level(std::size_t depth, const Type* want);
  const Type* unary(const Type* want);
  const Type* composition(const Type* want);
  const Type* primary(const Type* want);
  const Type* number();
  const Type* enumerated(const Type* want);
  const Type* aggregate(const Type* want);
  const Type* call(bool statement);
  void arguments(const Routine& routine);
  void argument(const Parameter& parameter);
  const Type* reference(bool written);
  const Type* part_of(const Type* type);
  const Type* combine(Op op, const Type* left, const Type* right);
  void value(const Type* want);

  // statements
  std::string block(Words ends);
  void statement();
  bool simple(const std::string& word);
  void assignment_or_call();
  void if_statement();
  void while_statement();
  void repeat_statement();
  void loop_statement();
  void for_statement();
  void switch_statement();
  void wait();
  void leave();
  void give_back();
  void move();
  void interrupt();
  void declare_interrupt();
  void loop_block(Words ends);
  void land_exits(std::size_t from);
  void jump_to(Op op, std::int32_t to) { routine_.code[static_cast<std::size_t>(emit(op))].a = to; }

  Program& program_;
  const Lines& lines_;
  Routine& routine_;
  Cursor cursor_;
  std::size_t at_ = 0, end_ = 0;
  std::map<std::string, Local, std::less<>> locals_;
  std::map<std::string, std::int32_t> labels_;
  std::vector<std::pair<std::int32_t, std::string>> gotos_;
  std::vector<std::int32_t> exits_;
  bool in_loop_ = false, no_locals_ = false;
  int depth_ = 0;
  double scalars_ = 0.0;
};

}  // namespace cellcal::sim::krl

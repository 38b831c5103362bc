#include "sim/krl/program.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <memory>

#include "calib/model/error.h"
#include "calib/model/units.h"
#include "sim/krl/compiler.h"
#include "sim/krl/interpreter.h"

namespace cellcal::sim::krl {

namespace {

constexpr const char* kFrame[] = {"X", "Y", "Z", "A", "B", "C"};

Eigen::Isometry3d pose_of(const Value& value) {
  calib::FrameMmDeg frame;
  for (std::size_t i = 0; i < 6; ++i) {
    if (!value.parts[i].given)
      throw RunError(value.type->name + ": component " + kFrame[i] + " has no value");
    (i < 3 ? frame.xyz_mm[i] : frame.abc_deg[i - 3]) = value.parts[i].r;
  }
  return calib::to_isometry(frame);
}

void put(Value& value, const Eigen::Isometry3d& pose) {
  const calib::FrameMmDeg frame = calib::to_frame(pose);
  for (std::size_t i = 0; i < 6; ++i)
    value.parts[i].set(i < 3 ? frame.xyz_mm[i] : frame.abc_deg[i - 3]);
}

std::string module_of(const std::string& file) {
  const std::string stem = file.substr(file.find_last_of("/\\") + 1);
  return source::upper_case(stem.substr(0, stem.find_last_of('.')));
}

bool is_data(const std::string& file) {
  return file.size() > 4 && (file.ends_with(".dat") || file.ends_with(".DAT"));
}

}  // namespace

int Type::index_of(std::string_view word) const {
  const auto at = std::find(names.begin(), names.end(), word);
  return at == names.end() ? -1 : static_cast<int>(at - names.begin());
}

double Type::scalars() const {
  double count = kind == Kind::kStruct || kind == Kind::kArray ? 0.0 : 1.0;
  for (const Type* part : parts) count += part->scalars();
  for (const int extent : extents) count *= extent;
  return count;
}

bool is_frame(const Type& type) {
  return type.kind == Type::Kind::kStruct && type.names.size() >= 6 &&
         std::equal(std::begin(kFrame), std::end(kFrame), type.names.begin());
}

bool assignable(const Type& to, const Type& from) {
  if (&to == &from || (to.number() && from.number())) return true;
  if (to.kind != Type::Kind::kArray || from.kind != Type::Kind::kArray) return false;
  return to.parts[0] == from.parts[0] && to.extents.size() == from.extents.size();
}

Value::Value(const Type& of) : type(&of) {
  if (of.kind == Type::Kind::kStruct) {
    parts.reserve(of.parts.size());
    for (const Type* part : of.parts) parts.emplace_back(*part);
  } else if (of.kind == Type::Kind::kArray) {
    std::size_t count = 1;
    for (const int extent : of.extents) count *= static_cast<std::size_t>(extent);
    parts.assign(count, Value(*of.parts[0]));
  }
}

Value& Value::part(std::string_view name) {
  return const_cast<Value&>(static_cast<const Value*>(this)->part(name));
}
const Value& Value::part(std::string_view name) const {
  const int at = type->index_of(name);
  if (at < 0) throw std::logic_error(type->name + " has no component " + std::string(name));
  return parts[static_cast<std::size_t>(at)];
}

bool Value::any() const {
  return given || std::any_of(parts.begin(), parts.end(), [](const Value& v) { return v.any(); });
}

double Value::number() const {
  return type->kind == Type::Kind::kReal ? static_cast<double>(r) : static_cast<double>(i);
}

std::string Value::text() const {
  std::string result;
  for (const Value& one : parts) {
    if (!one.given) break;
    result += static_cast<char>(one.i);
  }
  return result;
}

void Value::set(double number) {
  if (type->kind == Type::Kind::kReal) {
    r = static_cast<float>(number);
    if (!std::isfinite(r)) throw RunError("a REAL beyond its range");
  } else {
    if (!(std::abs(number) < 2147483647.5)) throw RunError("an INT beyond its range");
    i = static_cast<std::int32_t>(std::lround(number));
  }
  given = true;
}

void Value::set_all(double number) {
  if (parts.empty()) set(number);
  for (Value& one : parts) one.set_all(number);
}

void Value::set_whole(std::int32_t whole) {
  i = whole;
  given = true;
}

void Value::set_text(std::string_view text) {
  if (text.size() > parts.size())
    throw RunError("\"" + std::string(text) + "\" is longer than " + std::to_string(parts.size()) +
                   " CHAR");
  for (std::size_t at = 0; at < parts.size(); ++at) {
    parts[at].given = at < text.size();
    parts[at].i = parts[at].given ? static_cast<unsigned char>(text[at]) : 0;
  }
}

void Value::clear() {
  given = false;
  for (Value& one : parts) one.clear();
}

void assign(Value& to, const Value& from) {
  if (to.type->number()) return to.set(from.number());
  if (to.type->text()) return to.set_text(from.text());
  if (to.parts.size() != from.parts.size()) throw RunError("arrays of different size");
  for (std::size_t at = 0; at < to.parts.size(); ++at) to.parts[at] = from.parts[at];
  to.i = from.i;
  to.given = from.given;
}

Value composed(const Value& a, const Value& b) {
  Value result = b;
  put(result, pose_of(a) * pose_of(b));
  return result;
}

Value inverse_frame(const Value& frame) {
  Value result = frame;
  put(result, pose_of(frame).inverse());
  return result;
}

/// All modules: declarations first, then what refers to them.
class Loader {
 public:
  explicit Loader(Program& program) : program_(program) {}

  void load(const std::map<std::string, std::string>& files, std::string_view system) {
    add_numbers();
    texts_.push_back({"", "$SYSTEM", read("", std::string(kSystem)), true});
    texts_.push_back({"", "$SYSTEM", read("", std::string(system)), true});
    for (const auto& [name, text] : files)
      texts_.push_back({name, module_of(name), read(name, text), is_data(name)});
    // Types may be of a file that comes later; so may what a .dat declares with them.
    std::stable_sort(texts_.begin(), texts_.end(),
                     [](const Lines& a, const Lines& b) { return a.data && !b.data; });
    for (const Lines& text : texts_)
      if (text.data) declare_data(text, true);
    for (const Lines& text : texts_)
      if (text.data) declare_data(text, false);
    for (const Lines& text : texts_)
      if (!text.data) find_routines(text);
    for (Body& body : bodies_) body.at = body.compiler->declarations(body.at, body.end);
    for (Body& body : bodies_) body.compiler->body(body.at, body.end);
  }

  const std::vector<Routine*>& data() const { return data_; }

 private:
  struct Body {
    std::unique_ptr<Compiler> compiler;
    std::size_t at = 0, end = 0;
  };

  static std::vector<source::Line> read(const std::string& name, const std::string& text) {
    return source::read_lines({name, text});
  }

  void add_numbers() {
    const std::pair<const char*, Type::Kind> kinds[] = {{"INT", Type::Kind::kInt},
                                                        {"REAL", Type::Kind::kReal},
                                                        {"BOOL", Type::Kind::kBool},
                                                        {"CHAR", Type::Kind::kChar}};
    for (const auto& [name, kind] : kinds) {
      Type& type = program_.types_.emplace_back();
      type.name = name;
      type.kind = kind;
      type.predefined = true;
      program_.type_names_[name] = &type;
    }
  }

  /// STRUC and ENUM alone, or the rest.
  void declare_data(const Lines& text, bool types) {
    const bool system = text.file.empty();
    if (!system && text.lines.empty()) fail_at(text.file, 1, "no DEFDAT");
    bool open = system, is_public = system, ended = false;
    std::unique_ptr<Compiler> compiler;
    if (!types) {
      Routine& values = program_.routines_.emplace_back();
      values.name = text.module;
      values.file = text.file;
      values.data = true;
      compiler = std::make_unique<Compiler>(program_, text, values);
      data_.push_back(&values);
    } else {
      compiler = std::make_unique<Compiler>(program_, text, scratch_);
    }
    for (const source::Line& line : text.lines) {
      cursor_.begin(text.file, line);
      if (!open || ended) {
        if (ended || !cursor_.takes("DEFDAT")) cursor_.fail("outside of DEFDAT and ENDDAT");
        open = true;
        cursor_.name();
        is_public = cursor_.takes("PUBLIC");
        cursor_.end();
      } else if (cursor_.sees("ENDDAT")) {
        ended = true;
      } else {
        data_line(text, line, *compiler, is_public, types);
      }
    }
    if (!system && !ended) fail_at(text.file, text.lines.back().number, "no ENDDAT");
    if (!types) compiler->body(0, 0);
  }

  void data_line(const Lines& text, const source::Line& line, Compiler& compiler, bool is_public,
                 bool types) {
    const bool type =
        std::any_of(line.tokens.begin(), line.tokens.end(),
                    [](const source::Token& t) { return t.is("STRUC") || t.is("ENUM"); });
    const bool external = cursor_.sees("EXT") || cursor_.sees("EXTFCT");
    if (types != type) return;
    if (external) return declare_external(text);
    if (compiler.is_declaration(line)) return compiler.declare(line, is_public);
    compiler.data_line(line);
  }

  /// Predefined routine without a body. In other files EXT refers to another module.
  void declare_external(const Lines& text) {
    if (!text.file.empty()) return;
    Routine& routine = program_.routines_.emplace_back();
    if (cursor_.takes("EXTFCT")) {
      routine.result = type();
    } else {
      cursor_.expect("EXT");
    }
    routine.name = cursor_.take().word;
    cursor_.expect("(");
    while (!cursor_.takes(")")) {
      Parameter& parameter = routine.parameters.emplace_back();
      parameter.type = type();
      parameter.name = parameter.type->name;
      cursor_.expect(":");
      parameter.in = cursor_.takes("IN");
      if (!parameter.in) cursor_.expect("OUT");
      cursor_.takes(",");
    }
    program_.routine_names_[routine.name] = &routine;
  }

  const Type* type() {
    const Type* result = &program_.type(cursor_.take().word);
    if (!cursor_.takes("[")) return result;
    cursor_.expect("]");
    Type& open = program_.types_.emplace_back();
    open.kind = Type::Kind::kArray;
    open.name = result->name + "[]";
    open.parts = {result};
    open.extents = {0};
    return &open;
  }

  void find_routines(const Lines& text) {
    bool first = true;
    for (std::size_t at = 0; at < text.lines.size(); first = false) {
      Routine& routine = program_.routines_.emplace_back();
      const std::string ends = header(text, text.lines[at], routine);
      routine.main = first && routine.name == text.module;
      add(text, routine);
      std::size_t end = at + 1;
      while (end < text.lines.size() && !text.lines[end].tokens[0].is(ends)) {
        cursor_.begin(text.file, text.lines[end]);
        for (const char* word : {"DEF", "DEFFCT", "END", "ENDFCT"})
          if (cursor_.sees(word))
            cursor_.fail(std::string(word) + " where " + ends + " is missing");
        ++end;
      }
      if (end == text.lines.size())
        fail_at(text.file, routine.line, routine.name + " has no " + ends);
      cursor_.begin(text.file, text.lines[end]);
      cursor_.take();
      cursor_.end();
      bodies_.push_back({std::make_unique<Compiler>(program_, text, routine), at + 1, end});
      at = end + 1;
    }
  }

  /// Returns the word that ends it.
  std::string header(const Lines& text, const source::Line& line, Routine& routine) {
    cursor_.begin(text.file, line);
    routine.file = text.file;
    routine.line = line.number;
    routine.global = cursor_.takes("GLOBAL");
    const bool function = cursor_.takes("DEFFCT");
    if (!function) cursor_.expect("DEF");
    if (function) {
      const std::string name = cursor_.take().word;
      const auto found = program_.type_names_.find(name);
      if (found == program_.type_names_.end()) cursor_.fail(name + ": no such type");
      routine.result = found->second;
    }
    routine.name = cursor_.name();
    cursor_.expect("(");
    while (!cursor_.takes(")")) {
      Parameter& parameter = routine.parameters.emplace_back();
      parameter.name = cursor_.name();
      if (cursor_.takes("[")) cursor_.expect("]");
      if (cursor_.takes(":")) {
        parameter.in = cursor_.takes("IN");
        if (!parameter.in) cursor_.expect("OUT");
      }
      if (!cursor_.sees(")")) cursor_.expect(",");
    }
    cursor_.end();
    return function ? "ENDFCT" : "END";
  }

  void add(const Lines& text, Routine& routine) {
    const bool visible = routine.main || routine.global;
    Routine*& local = program_.routine_names_[text.module + ":" + routine.name];
    if (local != nullptr) cursor_.fail(routine.name + "() exists twice");
    local = &routine;
    if (visible) program_.routine_names_[routine.name] = &routine;
  }

  Program& program_;
  std::vector<Lines> texts_;
  std::vector<Body> bodies_;
  std::vector<Routine*> data_;
  Routine scratch_;
  Cursor cursor_;
};

Program::Program(const std::map<std::string, std::string>& files, std::string_view system) {
  Loader loader(*this);
  loader.load(files, system);
  bind_functions(*this);
  for (const Routine* values : loader.data()) {
    Interpreter once(*this);
    once.select(*values);
    once.run(0.0);
    if (once.state() != Interpreter::State::kEnded)
      throw calib::FileError(values->file, once.message().substr(values->file.size()));
  }
}

Program::~Program() = default;

void Program::bind(std::string_view name, Native native) {
  const auto found = routine_names_.find(name);
  if (found == routine_names_.end() || !found->second->file.empty())
    throw std::logic_error(std::string(name) + " is no EXT of the controller's own");
  found->second->native = std::move(native);
}

Variable& Program::variable(std::string_view name) {
  const auto found = variable_names_.find(name);
  if (found == variable_names_.end()) throw std::out_of_range(std::string(name));
  return *found->second;
}

bool Program::has(std::string_view name) const {
  return variable_names_.find(name) != variable_names_.end();
}

const Routine& Program::routine(std::string_view name) const {
  const auto found = routine_names_.find(name);
  if (found == routine_names_.end() || found->second->native || found->second->file.empty())
    throw std::out_of_range(std::string(name));
  return *found->second;
}

const Type& Program::type(std::string_view name) const {
  const auto found = type_names_.find(name);
  if (found == type_names_.end()) throw std::out_of_range(std::string(name));
  return *found->second;
}

}  // namespace cellcal::sim::krl

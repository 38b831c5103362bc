#include "daemon/krl/krl_types.h"

#include <algorithm>

#include "calib/model/error.h"
#include "daemon/krl/krl_calls.h"

namespace cellcal::daemon::krl {

namespace {

/// The controller's own, as far as motions go to them.
const std::map<std::string, std::string>& system_names() {
  static const std::map<std::string, std::string> names = [] {
    std::map<std::string, std::string> all = {
        {"$NULLFRAME", "FRAME"}, {"$WORLD", "FRAME"},    {"$TOOL", "FRAME"},   {"$BASE", "FRAME"},
        {"TOOL_DATA", "FRAME"},  {"BASE_DATA", "FRAME"}, {"$H_POS", "E6AXIS"}, {"INV_POS", "FRAME"},
        {"FORWARD", "E6POS"},    {"INVERSE", "E6AXIS"}};
    for (const char* what : {"ACT", "ACT_MEAS", "INT", "FOR", "BACK", "RET"})
      all[std::string("$AXIS_") + what] = "E6AXIS";
    for (const char* what : {"ACT", "ACT_MES", "INT", "FOR", "BACK", "RET"})
      all[std::string("$POS_") + what] = "E6POS";
    return all;
  }();
  return names;
}

std::string found_in(const std::map<std::string, std::string>& names, const std::string& name) {
  const auto at = names.find(name);
  return at == names.end() ? std::string() : at->second;
}

}  // namespace

std::size_t next_comma(const std::vector<Token>& t, std::size_t at, std::size_t end) {
  for (int depth = 0; at < end; ++at) {
    if (sign_at(t, at, '{') || sign_at(t, at, '[') || sign_at(t, at, '(')) ++depth;
    if (sign_at(t, at, '}') || sign_at(t, at, ']') || sign_at(t, at, ')')) --depth;
    if (depth == 0 && sign_at(t, at, ',')) break;
  }
  return at;
}

std::size_t closed(const std::vector<Token>& t, std::size_t at) {
  int depth = 0;
  for (; at < t.size(); ++at) {
    if (t[at].kind != Token::Kind::kSign) continue;
    const char c = t[at].word[0];
    if (c == '{' || c == '[' || c == '(') ++depth;
    if ((c == '}' || c == ']' || c == ')') && --depth == 0) return at + 1;
  }
  return 0;
}

/// Declared without DECL, too.
bool is_plain_type(const std::string& word) {
  return is_point_type(word) || word == "INT" || word == "REAL" || word == "BOOL" || word == "CHAR";
}

/// A name with two types has none.
void Types::keep(const std::string& name, const std::string& type, Names& names) {
  const auto [at, fresh] = names.emplace(name, type);
  if (!fresh && at->second != type) at->second.clear();
}

/// [GLOBAL] STRUC NAME TYPE a,b,TYPE c
void Types::read_structure(const Line& line) {
  const auto& t = line.tokens;
  const std::size_t begin = t[0].is("GLOBAL") || t[0].is("DECL") ? 1 : 0;
  if (!word_at(t, begin + 1)) return;
  Names& parts = structures_[t[begin + 1].word];
  std::string type;
  for (std::size_t at = begin + 2; word_at(t, at); at = next_comma(t, at + 1, t.size()) + 1) {
    if (word_at(t, at + 1)) type = t[at++].word;
    keep(t[at].word, type, parts);
  }
}

bool Types::read_declaration(const Line& line, Names& names) {
  const auto& t = line.tokens;
  std::size_t at = 0;
  bool global = false;
  for (; at < t.size() && (t[at].is("DECL") || t[at].is("GLOBAL") || t[at].is("CONST")); ++at)
    global = global || t[at].is("GLOBAL");
  if (at < t.size() && t[at].is("STRUC")) return read_structure(line), true;
  if (!word_at(t, at) || !word_at(t, at + 1) || (at == 0 && !is_plain_type(t[0].word)))
    return at > 0;
  const std::string type = t[at].word;
  for (++at; word_at(t, at); at = next_comma(t, at + 1, t.size()) + 1) {
    keep(t[at].word, type, global ? globals_ : names);
  }
  return true;
}

void Types::read_source(const KrlFile& file, Module& module) {
  Names* local = &module.locals[0];
  for (const Line& line : read_lines(file)) {
    const auto& t = line.tokens;
    if (begins_routine(line)) {
      local = &module.locals[line.number];
      std::size_t at = t[0].is("GLOBAL") ? 1 : 0;
      if (!t[at].is("DEFFCT") || !word_at(t, at + 1)) continue;
      const std::string type = t[at + 1].word;
      at = sign_at(t, at + 2, '[') ? at + 4 : at + 2;
      if (!word_at(t, at)) continue;
      keep(t[at].word, type, module.functions);
      keep(t[at].word, type, functions_);
    } else if (t[0].is("EXTFCT") && word_at(t, 2)) {
      keep(t[2].word, t[1].word, functions_);
    } else if (t[0].is("DECL") || t[0].is("STRUC") || is_plain_type(t[0].word)) {
      read_declaration(line, *local);
    }
  }
}

void Types::read_data(const KrlFile& file, Names& names) {
  for (const Line& line : read_lines(file)) {
    if (line.tokens[0].is("EXTFCT") && word_at(line.tokens, 2))
      keep(line.tokens[2].word, line.tokens[1].word, functions_);
    else
      read_declaration(line, names);
  }
}

Types::Types(const BackupFiles& files) {
  for (const ProgramFiles& one : files.modules) {
    Module& module = modules_.emplace_back();
    read_source(one.src, module);
    if (one.dat) read_data(*one.dat, module.variables);
  }
  for (const ProgramFiles& one : files.modules)
    for (const KrlFile& other : one.modules) try {
        read_source(other, modules_.emplace_back());
      } catch (const calib::FileError&) {  // not a text: its functions are unknown
      }
  Names controller;
  for (const KrlFile& file : files.controller) read_data(file, controller);
  for (const auto& [name, type] : controller) keep(name, type, globals_);
  Names others;  // only GLOBAL declarations are visible
  for (const KrlFile& file : files.data) read_data(file, others);
}

std::string Types::of_variable(std::size_t module, int line, const std::string& name,
                               const std::vector<std::string>& components) const {
  const Module& own = modules_[module];
  const auto behind = own.locals.upper_bound(line);
  const Names& local = std::prev(behind)->second;
  std::string type;
  for (const Names* names : {&local, &own.variables, &globals_, &system_names()}) {
    const auto at = names->find(name);
    if (at == names->end()) continue;
    type = at->second;
    break;
  }
  for (const std::string& component : components) {
    const auto structure = structures_.find(type);
    type = structure == structures_.end() ? "" : found_in(structure->second, component);
  }
  return type;
}

std::string Types::of_function(std::size_t module, const std::string& name) const {
  const auto own = modules_[module].functions.find(name);
  if (own != modules_[module].functions.end()) return own->second;
  const std::string type = found_in(functions_, name);
  return type.empty() ? found_in(system_names(), name) : type;
}

std::string Types::key(std::size_t module, int line, const std::string& name) const {
  const Module& own = modules_[module];
  const auto& [begin, local] = *std::prev(own.locals.upper_bound(line));
  const std::string key = name + "@" + std::to_string(module);
  if (local.count(name) > 0) return key + ":" + std::to_string(begin);
  return own.variables.count(name) > 0 ? key : name;
}

}  // namespace cellcal::daemon::krl

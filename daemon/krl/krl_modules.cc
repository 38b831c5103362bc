#include "daemon/krl/krl_modules.h"

#include "calib/model/error.h"
#include "daemon/krl/krl_calls.h"

namespace cellcal::daemon::krl {

void add_missing(const Data& controller, Data& own) {
  own.frames.insert(controller.frames.begin(), controller.frames.end());
  own.named_frames.insert(controller.named_frames.begin(), controller.named_frames.end());
  own.named_loads.insert(controller.named_loads.begin(), controller.named_loads.end());
  static_cast<ControllerFrames&>(own) = controller;
  own.external = controller.external;
}

void add_globals(const Data& from, Data& into) {
  for (const auto& [name, point] : from.points)
    if (from.globals.count(variable_of(name)) > 0 && !into.points.emplace(name, point).second)
      into.refusals.push_back({Why::kTwice, point.file, point.line, name});
  for (const auto& [name, structure] : from.structures)
    if (from.globals.count(variable_of(name)) > 0) into.structures.emplace(name, structure);
  for (const auto& [name, line] : from.declared)
    if (from.globals.count(name) > 0) into.declared.emplace(name, line);
  for (const auto& [name, frame] : from.frames)
    if (from.globals.count(name) > 0) into.frames.emplace(name, frame);
  for (const auto& [name, frame] : from.named_frames)
    if (from.globals.count(name) > 0) into.named_frames.emplace(name, frame);
  for (const auto& [name, load] : from.named_loads)
    if (from.globals.count(name) > 0) into.named_loads.emplace(name, load);
}

void forget(const std::set<std::string>& touched, bool all, Data& data) {
  const auto is_touched = [&](const auto& named) {
    return touched.count(named.first) > 0 && (all || data.globals.count(named.first) > 0);
  };
  std::erase_if(data.named_frames, is_touched);
  std::erase_if(data.named_loads, is_touched);
}

Imports::Imports(const BackupFiles& files) {
  std::set<std::string> modules = {"$CONFIG"};
  for (const KrlFile& file : files.data) modules.insert(module_name(file.name));
  for (const ProgramFiles& one : files.modules) modules.insert(module_name(one.src.name));
  for (const KrlFile& file : files.data) read(file, modules);
  for (const ProgramFiles& one : files.modules) {
    read(one.src, modules);
    if (one.dat) read(*one.dat, modules);
  }
}

void Imports::share(const KrlFile& dat, Data& data) const {
  if (const auto names = shared_.find(module_name(dat.name)); names != shared_.end())
    data.globals.insert(names->second.begin(), names->second.end());
}

const std::map<std::string, Why>& Imports::not_followed(const std::string& file) const {
  static const std::map<std::string, Why> none;
  const auto at = not_followed_.find(module_name(file));
  return at == not_followed_.end() ? none : at->second;
}

void Imports::read(const KrlFile& file, const std::set<std::string>& modules) {
  for (const Import& one : imports_of(file)) {
    shared_[one.module].insert(one.original);
    const bool renamed = one.name != one.original;
    if (renamed)
      renamed_.emplace(one.original, Refusal{Why::kImported, one.file, one.line, one.original});
    if (renamed || modules.count(one.module) == 0)
      not_followed_[module_name(file.name)].emplace(one.name,
                                                    renamed ? Why::kImported : Why::kUnknownPoint);
  }
}

void apply_beside(const KrlFile& module, const std::string& program, Data& known, Data& own) try {
  for (const Import& one : imports_of(module))
    if (one.module == module_name(program)) own.globals.insert(one.original);
  const auto touched = touched_names(read_lines(module));
  forget(touched, true, known);
  forget(touched, false, own);
} catch (const calib::FileError&) {
}

}  // namespace cellcal::daemon::krl

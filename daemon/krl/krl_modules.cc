#include "daemon/krl/krl_modules.h"

#include "calib/model/error.h"
#include "daemon/krl/krl_calls.h"
#include "daemon/krl/krl_state.h"

namespace cellcal::daemon::krl {

void add_missing(const Data& controller, Data& own) {
  own.frames.insert(controller.frames.begin(), controller.frames.end());
  own.named_frames.insert(controller.named_frames.begin(), controller.named_frames.end());
  own.named_loads.insert(controller.named_loads.begin(), controller.named_loads.end());
  // An INT may be set by a program that is not given, or by hand.
  for (const auto& [name, number] : controller.named_numbers)
    if (number && number->constant) own.named_numbers.emplace(name, number);
  static_cast<ControllerFrames&>(own) = controller;
  own.external = controller.external;
}

void add_globals(const Data& from, Data& into) {
  for (const auto& [name, point] : from.points)
    if (from.globals.count(variable_of(name)) > 0 && !into.points.emplace(name, point).second)
      into.refusals.push_back({Why::kDeclaredTwice, point.file, point.line, name});
  const auto take = [&](auto member) {
    for (const auto& one : from.*member)
      if (from.globals.count(variable_of(one.first)) > 0) (into.*member).insert(one);
  };
  take(&Data::structures);
  take(&Data::declared);
  take(&Data::frames);
  take(&Data::named_frames);
  take(&Data::named_loads);
  take(&Data::named_numbers);
}

void forget(const std::set<std::string>& touched, bool all, Data& data) {
  const auto is_touched = [&](const auto& named) {
    return touched.count(named.first) > 0 && (all || data.globals.count(named.first) > 0);
  };
  std::erase_if(data.named_frames, is_touched);
  std::erase_if(data.named_loads, is_touched);
  for (auto& named : data.named_numbers)
    if (named.second && !named.second->constant && is_touched(named)) named.second.reset();
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

namespace {

/// Points that may have each other's value.
class Alike {
 public:
  explicit Alike(const Program& program) {
    for (const Copy& one : program.copies) merge(one.to, one.from);
  }
  /// Empty for a point that is not copied.
  const std::set<std::string>& of(const std::string& key) const {
    static const std::set<std::string> none;
    const auto at = group_.find(key);
    return at == group_.end() ? none : members_.at(at->second);
  }

 private:
  void merge(const std::string& a, const std::string& b) {
    for (const std::string& one : {a, b})
      if (group_.emplace(one, one).second) members_[one] = {one};
    std::string into = group_.at(a), from = group_.at(b);
    if (into == from) return;
    if (members_.at(into).size() < members_.at(from).size()) std::swap(into, from);
    for (const std::string& one : members_.at(from)) group_[one] = into;
    members_.at(into).merge(members_.at(from));
    members_.erase(from);
  }
  std::map<std::string, std::string> group_;
  std::map<std::string, std::set<std::string>> members_;
};

/// Beyond this a group of copied points is refused.
constexpr std::size_t kMostAlike = 64;

bool same_components(const Point& a, const Point& b) {
  const auto has = [](const Point& point, const char* name) {
    return point.value.numbers.count(name) > 0;
  };
  return a.kind == b.kind && has(a, "S") == has(b, "S") && has(a, "T") == has(b, "T");
}

/// A motion to a copied point may go to all values of its group: each is corrected for it.
void follow_copies(Program& program) {
  const Alike alike(program);
  for (const Copy& one : program.copies) program.copied_to.insert(one.to);
  for (const Copy& one : program.copies)
    if (!same_components(program.points.at(one.to), program.points.at(one.from)) ||
        alike.of(one.to).size() > kMostAlike)
      program.computed.emplace(one.to, one.refusal);
  std::map<std::string, Refusal> also;
  for (const Copy& one : program.copies)
    for (const std::string& key : alike.of(one.to))
      if (const auto why = program.computed.find(key); why != program.computed.end())
        also.emplace(one.to, why->second), also.emplace(one.from, why->second);
  program.computed.merge(also);
  const std::size_t own = program.motions.size();
  for (std::size_t i = 0; i < own; ++i) {
    if (program.computed.count(program.motions[i].point) > 0) continue;
    for (const std::string& key : alike.of(program.motions[i].point)) {
      if (key == program.motions[i].point) continue;
      Motion other = program.motions[i];
      other.point = key;
      program.flow.instead(i, program.motions.size());
      program.motions.push_back(std::move(other));
    }
  }
}

void add_changed_frames_of(const KrlFile& file, const Readers& readers,
                           ChangedFrames& changed) try {
  if (!is_kukas_program(file.name)) add_changed_frames(read_lines(file), readers, changed);
} catch (const calib::FileError&) {  // no text
}

}  // namespace

void settle(Program& program) {
  follow_copies(program);
  const auto found = [&](const std::string& key) {
    const auto at = key.find('@');
    const std::string name = variable_of(key.substr(0, at));
    return program.computed.find(at == std::string::npos ? name : name + key.substr(at));
  };
  std::erase_if(program.left_points,
                [&](const auto& one) { return found(one.first) != program.computed.end(); });
  std::map<std::string, Refusal> computed;
  for (const auto& [key, point] : program.points)
    if (const auto at = found(key); at != program.computed.end()) {
      Refusal refusal = at->second;
      refusal.what = name_of_key(key);
      computed.emplace(key, std::move(refusal));
    }
  program.computed = std::move(computed);
}

void take_assigned(const std::vector<const KrlFile*>& files, const Readers& readers,
                   Program& program) {
  if (program.assigned.empty()) return;
  ChangedFrames changed;
  for (const KrlFile* file : files) add_changed_frames_of(*file, readers, changed);
  for (const auto& [module, tool, number, value] : program.assigned) {
    const auto& frames = (tool ? changed.tools : changed.bases)[number];
    if (!std::ranges::all_of(frames,
                             [&](const auto& frame) { return frame && same_frame(*frame, value); }))
      continue;
    FrameChanges& changes = program.modules[module].changes;
    (tool ? changes.tools : changes.bases).numbers.erase(number);
    (tool ? program.data.tools : program.data.bases)[number] = value;
  }
}

void leave_unmoved(const Data& own, bool kukas, const std::string& where, const std::string& file,
                   Program& program) {
  std::set<std::string> refused;  // PTP XP[I] may go to any of them
  for (std::size_t i = 0; i < program.modules.size(); ++i)
    for (const Refusal& one : program.modules[i].refusals)
      for (const std::string& module : {std::string(), "@" + std::to_string(i)})
        refused.insert(variable_of(one.what) + module);
  for (const auto& [name, point] : own.points) {
    const std::string end = own.globals.count(variable_of(name)) > 0 ? "" : where;
    if (name.starts_with('$') || program.points.count(name + end) > 0 ||
        refused.count(variable_of(name) + end) > 0)
      continue;
    const std::string why = kukas ? "the controller's own program" : "no motion goes to it";
    program.left.emplace(name + end, file.empty() ? why : why + file + point.file);
  }
}

}  // namespace cellcal::daemon::krl

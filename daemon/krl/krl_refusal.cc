#include "daemon/krl/krl_refusal.h"

#include <algorithm>
#include <set>
#include <tuple>
#include <utility>

#include "calib/files/text.h"
#include "calib/model/enum_table.h"
#include "daemon/krl/krl_program.h"

namespace cellcal::daemon::krl {

const char* name_of(Why why) { return own_name(why); }

namespace {

/// " since CLAMP() in line 12", ", as lines 4 and 9 set different ones".
calib::Phrase since(const Lost& lost) {
  if (lost.what.empty()) return {};
  if (lost.other > 0) return {"say.krl.differ", {{"line", lost.line}, {"other", lost.other}}};
  return {"say.krl.since", {{"what", calib::shown(lost.what)}, {"line", lost.line}}};
}

calib::Phrase why_phrase(const Refusal& r, const calib::Robot& robot) {
  const bool frame = r.why == Why::kToolNotKnown || r.why == Why::kBaseNotKnown;
  const bool by_bas = r.lost.what.starts_with("BAS(") && r.lost.other == 0;
  static const std::set<std::string> frames = {"$BASE", "$TOOL", "BASE_DATA", "TOOL_DATA"};
  const char* const form = r.lost.any_time                                          ? ".any_time"
                           : frame && by_bas                                        ? ".bas"
                           : r.why == Why::kComputed && r.what.starts_with("line ") ? ".written"
                           : r.why == Why::kUnknownPoint && r.what.starts_with('$') ? ".system"
                           : r.why == Why::kOwnPosition && frames.contains(r.what)  ? ".frame"
                                                                                    : "";
  return {std::string("say.krl.why.") + name_of(r.why) + form,
          {{"n", r.number},
           {"reached", r.reached ? calib::phrase(*r.reached, robot) : calib::Phrase()},
           {"since", since(r.lost)},
           {"module", calib::shown(r.lost.what, 120)},
           {"there", r.lost.line}}};
}

}  // namespace

calib::Phrase phrase(const Refusal& r, const calib::Robot& robot) {
  return {"say.krl.refusal",
          {{"file", r.file},
           {"line", r.line},
           {"what", calib::shown(r.what)},
           {"why", why_phrase(r, robot)}}};
}

std::string words(const Refusal& r, const calib::Robot& robot) {
  return calib::words(phrase(r, robot));
}

void sort_by_place(std::vector<Refusal>& refusals) {
  std::stable_sort(refusals.begin(), refusals.end(), [](const Refusal& a, const Refusal& b) {
    return std::tie(a.file, a.line) < std::tie(b.file, b.line);
  });
}

std::vector<std::vector<Refusal>> refusals_of_modules(
    const Program& program, std::multimap<std::string, Refusal> of_points) {
  for (const auto& [key, refusal] : program.computed) of_points.emplace(key, refusal);
  for (const Refusal& refusal : program.twice)
    for (const auto& [key, point] : program.points)
      if (variable_of(name_of_key(key)) == variable_of(refusal.what) &&
          (point.file == refusal.file || key.find('@') == std::string::npos))
        of_points.emplace(key, refusal);
  std::vector<std::vector<Refusal>> all;
  for (const Module& module : program.modules) all.push_back(module.refusals);
  std::set<std::pair<std::size_t, std::string>> done;
  for (const Motion& motion : program.motions) {
    if (!done.emplace(motion.module, motion.point).second) continue;
    const auto [begin, end] = of_points.equal_range(motion.point);
    for (auto at = begin; at != end; ++at) all[motion.module].push_back(at->second);
  }
  return all;
}

void refuse_shared(const Program& program, std::vector<std::vector<Refusal>>& refusals) {
  std::multimap<std::string, const Motion*> by_point;
  std::multimap<std::size_t, const Motion*> by_module;
  for (const Motion& motion : program.motions) {
    if (motion.left) continue;
    by_point.emplace(motion.point, &motion);
    by_module.emplace(motion.module, &motion);
  }
  std::vector<std::size_t> open;
  std::set<std::string> seen;
  for (std::size_t i = 0; i < refusals.size(); ++i)
    if (!refusals[i].empty()) open.push_back(i);
  while (!open.empty()) {
    const std::size_t from = open.back();
    open.pop_back();
    const auto [begin, end] = by_module.equal_range(from);
    for (auto at = begin; at != end; ++at) {
      const std::string& key = at->second->point;
      if (!seen.insert(key).second) continue;
      const auto [first, last] = by_point.equal_range(key);
      for (auto one = first; one != last; ++one) {
        const Motion& motion = *one->second;
        if (!refusals[motion.module].empty()) continue;
        refusals[motion.module].push_back({Why::kShared,
                                           program.modules[motion.module].src,
                                           motion.line,
                                           name_of_key(key),
                                           -1,
                                           std::nullopt,
                                           {program.modules[from].src, 0}});
        open.push_back(motion.module);
      }
    }
  }
}

}  // namespace cellcal::daemon::krl

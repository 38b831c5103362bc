#include "calib/result/tcp_check.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "calib/model/units.h"
#include "calib/result/finding_phrase.h"

namespace cellcal::calib {

namespace {

constexpr double kCoverage = 2.0;  // U(k=2)
constexpr double kMradPerRad = 1e3;

Phrase xyz_mm(const Eigen::Vector3d& m) {
  return {"say.check.xyz_mm",
          {{"x", m.x() * kMmPerM}, {"y", m.y() * kMmPerM}, {"z", m.z() * kMmPerM}}};
}

/// The change where the touches name another than the tool's, for which alone a shift of the TCP holds.
const Explanation* not_the_tool(const TcpCheck& check) {
  const Explanation* change = check.holds ? nullptr : check.change();
  return change == nullptr || change->kind == ChangeKind::kTool ? nullptr : change;
}

Phrase verdict_phrase(const TcpCheck& check) {
  const std::string verdict = std::string("say.check.") + to_string(check.verdict());
  if (const Explanation* other = not_the_tool(check))
    return joined("say.join.colon", verdict, phrase(*other));
  const std::size_t without = check.not_found.size() + check.unsteady.size();
  const Phrase evidence =
      check.explanations.empty()
          ? Phrase("say.check.without_contact", {{"n", without}, {"all", check.touches + without}})
          : Phrase("say.check.shift", {{"mm", check.shift_m.norm() * kMmPerM},
                                       {"u", check.u_along_m() * kMmPerM},
                                       {"xyz", xyz_mm(check.shift_m)}});
  return joined("say.join.colon", verdict, evidence);
}

Phrase change_phrase(const TcpCheck& check) {
  const Explanation* change = check.change();
  if (check.holds || change == nullptr) return {};
  if (not_the_tool(check) != nullptr) return remedy_phrase(*change);
  return joined("say.join.sentences", phrase(*change), remedy_phrase(*change));
}

/// Minimum probability for display: most of some twenty explanations are negligible.
constexpr double kMinShownProbability = 0.01;

void add_explanations(const TcpCheck& check, std::vector<Phrase>& lines) {
  lines.push_back({"say.check.residual",
                   {{"rms", check.rms_m * kMmPerM},
                    {"n", check.touches},
                    {"odds", check.log_odds},
                    {"alarm", check.log_alarm},
                    {"percent", 100.0 * check.false_alarms}}});
  lines.push_back(
      {"say.check.finds", {{"mm", check.finds_m * kMmPerM}, {"n", 100.0 * check.found}}});
  std::size_t unlikely = 0;
  for (const Explanation& one : check.explanations) {
    if (one.probability < kMinShownProbability) {
      ++unlikely;
      continue;
    }
    lines.push_back({"say.check.explanation",
                     {{"percent", 100.0 * one.probability},
                      {"log", one.log_likelihood},
                      {"what", phrase(one)}}});
  }
  if (unlikely > 0)
    lines.push_back(
        {"say.check.unlikely", {{"n", unlikely}, {"percent", 100.0 * kMinShownProbability}}});
}

}  // namespace

CheckVerdict TcpCheck::verdict() const {
  if (holds) return CheckVerdict::kHolds;
  const bool alarm =
      !zeros_hold || !not_found.empty() || (!explanations.empty() && log_odds > log_alarm);
  return alarm ? CheckVerdict::kDoesNotHold : CheckVerdict::kUndecided;
}

const Explanation* TcpCheck::change() const {
  const auto first = std::find_if(explanations.begin(), explanations.end(),
                                  [](const auto& one) { return one.kind != ChangeKind::kNothing; });
  return first == explanations.end() ? nullptr : &*first;
}

double TcpCheck::u_m(int axis) const { return kCoverage * std::sqrt(covariance_m2(axis, axis)); }

double TcpCheck::u_along_m() const {
  const double length = shift_m.norm();
  const Eigen::Vector3d along =
      length > 0.0 ? Eigen::Vector3d(shift_m / length) : Eigen::Vector3d::UnitX();
  return kCoverage * std::sqrt(along.dot(covariance_m2 * along));
}

Phrase phrase(const Explanation& one) {
  const bool shrinks = one.kind == ChangeKind::kGrowth && one.amount < 0.0;
  const double unit = one.kind == ChangeKind::kJoint    ? kDegPerRad
                      : one.kind == ChangeKind::kGrowth ? kPerMillion
                                                        : kMmPerM;
  const double by = is_shift(one.kind) ? one.shift_m.norm() : shrinks ? -one.amount : one.amount;
  const bool partial =
      (one.kind == ChangeKind::kTool || one.kind == ChangeKind::kSphere) && one.amount > 0.0;
  const char* form = shrinks ? ".shorter" : partial ? ".at_least" : "";
  return {std::string("say.change.") + to_string(one.kind) + form,
          {{"name", one.name},
           {"touch", one.touch + 1},
           {"by", unit * by},
           {"u", kCoverage * unit * one.sigma},
           {"least", one.amount * kMmPerM},
           {"xyz", xyz_mm(one.shift_m)},
           {"turn", kMradPerRad * one.amount},
           {"u_turn", kCoverage * kMradPerRad * one.turn_sigma}}};
}

Phrase remedy_phrase(const Explanation& change) {
  if (change.kind == ChangeKind::kNothing) return {};
  return {std::string("say.change.do.") + to_string(change.kind), {{"name", change.name}}};
}

std::vector<Phrase> phrases(const TcpCheck& check) {
  std::vector<Phrase> lines{verdict_phrase(check)};
  for (const NotFound& one : check.not_found)
    lines.push_back(
        {"say.check.not_found",
         {{"touch", one.touch + 1}, {"target", one.target}, {"beyond", one.beyond_m * kMmPerM}}});
  for (const UnsteadyTouch& one : check.unsteady)
    lines.push_back({"say.check.unsteady", {{"touch", one.touch + 1}, {"target", one.target}}});
  if (Phrase change = change_phrase(check); !change.empty()) lines.push_back(std::move(change));
  if (!check.explanations.empty()) add_explanations(check, lines);
  return lines;
}

std::string verdict_words(const TcpCheck& check) { return words(verdict_phrase(check)); }
std::string change_words(const TcpCheck& check) { return words(change_phrase(check)); }
std::string words(const Explanation& explanation) { return words(phrase(explanation)); }

std::vector<std::string> words(const TcpCheck& check) {
  std::vector<std::string> lines;
  for (const Phrase& line : phrases(check)) lines.push_back(words(line));
  return lines;
}

}  // namespace cellcal::calib

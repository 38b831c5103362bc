#include "calib/result/tcp_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "calib/model/enum_table.h"
#include "calib/model/units.h"

namespace cellcal::calib {

namespace {

constexpr double kCoverage = 2.0;  // U(k=2)
constexpr std::array kChangeKinds{ChangeKind::kNothing, ChangeKind::kTool,   ChangeKind::kSphere,
                                  ChangeKind::kJoint,   ChangeKind::kGrowth, ChangeKind::kTouch};

constexpr EnumNames<CheckVerdict> kVerdicts{{{CheckVerdict::kHolds, "holds"},
                                             {CheckVerdict::kDoesNotHold, "does_not_hold"},
                                             {CheckVerdict::kUndecided, "undecided"}}};

}  // namespace

const char* to_string(CheckVerdict verdict) { return kVerdicts[verdict]; }
std::optional<CheckVerdict> check_verdict(const std::string& name) {
  return kVerdicts.key_of(name);
}

const char* to_string(ChangeKind kind) {
  switch (kind) {
    case ChangeKind::kNothing:
      return "nothing";
    case ChangeKind::kTool:
      return "tool";
    case ChangeKind::kSphere:
      return "sphere";
    case ChangeKind::kJoint:
      return "joint";
    case ChangeKind::kGrowth:
      return "growth";
    case ChangeKind::kTouch:
      return "touch";
  }
  return "";
}

std::optional<ChangeKind> change_kind(const std::string& name) {
  for (const ChangeKind kind : kChangeKinds)
    if (name == to_string(kind)) return kind;
  return std::nullopt;
}

CheckVerdict TcpCheck::verdict() const {
  if (holds) return CheckVerdict::kHolds;
  const bool alarm = !not_found.empty() || (!explanations.empty() && log_odds > log_alarm);
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

namespace {

std::string mm(double value_m, double sigma_m) {
  return fmt::format("{:.2f} +- {:.2f} mm (k=2)", value_m * kMmPerM, kCoverage * sigma_m * kMmPerM);
}

std::string vector_words(const Eigen::Vector3d& m) {
  return fmt::format("({:+.2f}, {:+.2f}, {:+.2f})", m.x() * kMmPerM, m.y() * kMmPerM,
                     m.z() * kMmPerM);
}

std::string not_found_words(const NotFound& one) {
  return fmt::format(
      "touch {}: no contact up to {:.0f} mm beyond the expected surface of {}. "
      "Check that {} was not moved and that the tool is not damaged",
      one.touch + 1, one.beyond_m * kMmPerM, one.target, one.target);
}

const char* opening(CheckVerdict verdict) {
  switch (verdict) {
    case CheckVerdict::kHolds:
      return "holds";
    case CheckVerdict::kDoesNotHold:
      return "does not hold";
    case CheckVerdict::kUndecided:
      break;
  }
  return "undecided";
}

std::string unsteady_words(const UnsteadyTouch& one) {
  return fmt::format(
      "touch {}: contacts with {} did not agree, twice. Clean tip and sphere, check that tip, sphere and "
      "stand are tight, and check again",
      one.touch + 1, one.target);
}

}  // namespace

std::string verdict_words(const TcpCheck& check) {
  if (check.explanations.empty())
    return fmt::format("{}: {} of {} touches without a contact point", opening(check.verdict()),
                       check.not_found.size() + check.unsteady.size(),
                       check.touches + check.not_found.size() + check.unsteady.size());
  return fmt::format("{}: TCP shift {:.2f} +- {:.2f} mm (k=2) {} in the flange's frame",
                     opening(check.verdict()), check.shift_m.norm() * kMmPerM,
                     check.u_along_m() * kMmPerM, vector_words(check.shift_m));
}

std::string words(const Explanation& one) {
  switch (one.kind) {
    case ChangeKind::kNothing:
      return "nothing changed";
    case ChangeKind::kTool:
      return fmt::format("{} shifted by {} {} on the flange", one.name,
                         mm(one.shift_m.norm(), one.sigma), vector_words(one.shift_m));
    case ChangeKind::kSphere:
      return fmt::format("{} moved by {} {}", one.name, mm(one.shift_m.norm(), one.sigma),
                         vector_words(one.shift_m));
    case ChangeKind::kJoint:
      return fmt::format("zero of {} off by {:+.3f} +- {:.3f} deg (k=2)", one.name,
                         one.amount * kDegPerRad, kCoverage * one.sigma * kDegPerRad);
    case ChangeKind::kGrowth:
      return fmt::format("whole arm {} by {:.0f} +- {:.0f} ppm (k=2)",
                         one.amount < 0.0 ? "shorter" : "longer",
                         std::abs(one.amount) * kPerMillion, kCoverage * one.sigma * kPerMillion);
    case ChangeKind::kTouch:
      return fmt::format("touch {} of {} alone {:+.2f} +- {:.2f} mm (k=2) off", one.touch + 1,
                         one.name, one.amount * kMmPerM, kCoverage * one.sigma * kMmPerM);
  }
  return "";
}

std::string remedy_words(const Explanation& change) {
  switch (change.kind) {
    case ChangeKind::kTool:
      return "Check the tool's fastening, its tip and, if it can slip, the zero of the last axis; then measure the "
             "TCP or calibrate again";
    case ChangeKind::kSphere:
      return fmt::format("Clamp the stand of {} and calibrate again; the robot itself is as it was",
                         change.name);
    case ChangeKind::kJoint:
      return fmt::format("Check the mastering, belt, coupling and brake of {}, and calibrate again",
                         change.name);
    case ChangeKind::kGrowth:
      return "Let the arm come to its usual temperature and check again; if that is the new one, "
             "calibrate again";
    case ChangeKind::kTouch:
      return fmt::format("Clean tip and {}, and check again", change.name);
    case ChangeKind::kNothing:
      break;
  }
  return "";
}

std::string change_words(const TcpCheck& check) {
  const Explanation* change = check.change();
  if (check.holds || change == nullptr || change->kind == ChangeKind::kNothing) return "";
  return fmt::format("{}. {}", words(*change), remedy_words(*change));
}

/// Minimum probability for display: most of some twenty explanations are negligible.
constexpr double kMinShownProbability = 0.01;

std::vector<std::string> words(const TcpCheck& check) {
  std::vector<std::string> lines{verdict_words(check)};
  for (const NotFound& one : check.not_found) lines.push_back(not_found_words(one));
  for (const UnsteadyTouch& one : check.unsteady) lines.push_back(unsteady_words(one));
  if (const std::string change = change_words(check); !change.empty()) lines.push_back(change);
  if (check.explanations.empty()) return lines;
  lines.push_back(fmt::format(
      "{:.2f} mm rms residual over {} touches; log odds of a change {:.1f}, alarm above {:.1f} "
      "({:g} % false alarms)",
      check.rms_m * kMmPerM, check.touches, check.log_odds, check.log_alarm,
      100.0 * check.false_alarms));
  lines.push_back(fmt::format("a tool shift of {:.2f} mm is found in {:.0f} of 100 such checks",
                              check.finds_m * kMmPerM, 100.0 * check.found));
  std::size_t unlikely = 0;
  for (const Explanation& one : check.explanations) {
    if (one.probability < kMinShownProbability) {
      ++unlikely;
      continue;
    }
    lines.push_back(fmt::format("{:5.1f} %  log likelihood {:+8.1f}  {}", 100.0 * one.probability,
                                one.log_likelihood, words(one)));
  }
  if (unlikely > 0)
    lines.push_back(
        fmt::format("{} more, each below {:g} %", unlikely, 100.0 * kMinShownProbability));
  return lines;
}

}  // namespace cellcal::calib

#include "calib/result/tcp_check.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "calib/result/names.h"

namespace cellcal::calib {

namespace {

constexpr double kCoverage = 2.0;  // U(k=2)
constexpr std::array kChangeKinds{ChangeKind::kNothing, ChangeKind::kTool,   ChangeKind::kSphere,
                                  ChangeKind::kJoint,   ChangeKind::kGrowth, ChangeKind::kTouch};

constexpr std::array kVerdicts{Named{CheckVerdict::kHolds, "holds"},
                               Named{CheckVerdict::kDoesNotHold, "does_not_hold"},
                               Named{CheckVerdict::kUndecided, "undecided"}};

}  // namespace

const char* to_string(CheckVerdict verdict) { return name_of(kVerdicts, verdict); }
std::optional<CheckVerdict> check_verdict(const std::string& name) {
  return named(kVerdicts, name);
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

}  // namespace cellcal::calib

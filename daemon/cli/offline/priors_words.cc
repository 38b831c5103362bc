#include <fmt/format.h>

#include "calib/files/priors_file.h"
#include "calib/files/text.h"
#include "daemon/cli/offline/priors.h"

namespace cellcal::daemon {

namespace {

/// "a joint's lengths" of a table.
std::string quantity(calib::SpreadKind kind) {
  const calib::SpreadUnit unit = calib::unit_of(kind);
  return fmt::format("{} {}", unit.name, unit.unit);
}

std::string figure(double value) { return fmt::format("{:.4g}", value); }

}  // namespace

std::string spreads_words(const calib::FleetPriors& priors) {
  std::string text = fmt::format(
      "priors of {}, version {}, made {}, {} arms\nnominal geometry {}\n"
      "{:<8} {:<22} {:>10} {:>10} {:>10} {:>10} {:>7}\n",
      calib::shown(priors.robot, 80), priors.version, calib::shown(priors.made), priors.arms,
      priors.nominal_geometry, "joint", "1 sigma of", "drawn", "found", "+-", "offered", "arms");
  for (const calib::JointPriors& joint : priors.joints)
    for (const calib::SpreadKind kind : calib::kSpreadKinds)
      if (const auto& s = joint.of(kind)) {
        const double per_si = calib::unit_of(kind).per_si;
        text += fmt::format("{:<8} {:<22} {:>10} {:>10} {:>10} {:>10} {:>7.1f}\n",
                            calib::shown(joint.joint), quantity(kind), figure(s->drawn * per_si),
                            figure(s->found * per_si), figure(s->found_sigma * per_si),
                            figure(calib::offered(*s) * per_si), s->arms);
      }
  return text +
         "arms: effective number of arms, 1: one arm measured without error.\noffered: found, "
         "widened by its uncertainty; below 4 arms at least the drawn value\n";
}

std::string changes_words(const std::vector<calib::PriorChange>& changes) {
  std::string text = fmt::format("{:<8} {:<22} {:>10} {:>10} {:>8}\n", "joint", "1 sigma of", "old",
                                 "new", "change");
  for (const calib::PriorChange& one : changes) {
    const double per_si = calib::unit_of(one.kind).per_si;
    text += fmt::format(
        "{:<8} {:<22} {:>10} {:>10} {:>8}\n", one.joint, quantity(one.kind),
        one.before > 0.0 ? figure(one.before * per_si) : "assumed", figure(one.after * per_si),
        one.before > 0.0 ? fmt::format("{:+.0f} %", 100.0 * (one.after / one.before - 1.0)) : "");
  }
  return text;
}

std::string set_aside_words(const calib::SetAside& one) {
  constexpr std::size_t kWhole = 400;  // a path, a reader's message
  const std::string name = calib::shown(one.name, kWhole), other = calib::shown(one.other, kWhole);
  using calib::SetAsideKind;
  switch (one.kind) {
    case SetAsideKind::kUnreadable:
      return fmt::format("{}: cannot be read. {}", name, other);
    case SetAsideKind::kWithheld:
      return name + ": withheld, not used. Priors are learned from published calibrations";
    case SetAsideKind::kOtherNominalGeometry:
      return name + ": nominal geometry of another robot model. Learn its priors separately";
    case SetAsideKind::kInconsistent:
      return name + ": parameters and covariance are inconsistent. Replay its session";
    case SetAsideKind::kTellsNothing:
      return name + ": determined by the prior alone. It needs more touches";
    case SetAsideKind::kSameArm:
      return fmt::format("{}: same arm as {}. Only that one is used", name, other);
    case SetAsideKind::kTooFar:
      return fmt::format(
          "{}: chi^2 {:.3g} for {} directions, farther from nominal than the other arms. Check "
          "robot file and mastering of this arm",
          name, one.chi2, one.directions);
    case SetAsideKind::kTooNear:
      return fmt::format(
          "{}: chi^2 {:.3g} for {} directions, too small to be measured errors. Check the source "
          "of this calibration",
          name, one.chi2, one.directions);
  }
  return name;
}

std::string no_priors_words(const calib::Learned& learned) {
  if (learned.none == calib::NoPriors::kTooFewArms)
    return fmt::format(
        "{} arms; priors need {}. Add published calibrations of other arms of the model",
        learned.priors.arms, calib::kFewestArms);
  return fmt::format(
      "{} arms fit, more than 20 % of all do not: not one population. Check the arms set aside; "
      "learn each kind of arm separately",
      learned.priors.arms);
}

}  // namespace cellcal::daemon

#include "daemon/cli/offline.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "calib/model/units.h"
#include "calib/result/finding.h"
#include "calib/result/unidentifiable.h"

namespace cellcal::daemon {

namespace {

using calib::kMmPerM;

std::string line(const char* name, const calib::ResidualSummary& summary) {
  if (summary.count == 0) return fmt::format("{:<14} {:>7}\n", name, "none");
  return fmt::format("{:<14} {:>7} {:>9.4f} {:>9.4f} {:>9.4f}\n", name, summary.count,
                     summary.mean_m * kMmPerM, summary.max_m * kMmPerM, summary.rms_m * kMmPerM);
}

std::string verdict_words(const calib::Calibration& calibration, Detail detail) {
  const calib::Verdict& verdict = calibration.verdict;
  std::string text;
  if (calibration.update && calibration.update->outcome == calib::UpdateOutcome::kNothingChanged) {
    text = "verdict: nothing changed, the calibration in use holds\n";
  } else if (verdict.too_few()) {
    text = "verdict: too few touches to calibrate; nothing else is wrong\n";
  } else {
    text = verdict.publish() ? "verdict: publishable" : "verdict: NOT publishable";
    text += verdict.workspace ? ", scope: workspace\n" : ", scope: near targets\n";
  }
  for (const calib::Finding& finding : verdict.findings) {
    // A change of the arm is of interest in every result.
    if (detail == Detail::kAll || finding.severity != calib::Severity::kInforms ||
        finding.kind == calib::FindingKind::kUnchanged ||
        finding.kind == calib::FindingKind::kUpdated)
      text += "  - " + calib::words(finding) + "\n";
  }
  return text;
}

std::string observability_words(const calib::Observability& o) {
  if (o.rows == 0) return {};
  return fmt::format(
      "observability: {} of {} directions of the geometry determined better than their "
      "tolerance, {} observable; O1 {:.3g}, O2 {:.3g}, O3 {:.3g}, O4 {:.3g}, O5 {:.3g}, "
      "condition {:.0f}\n",
      o.determined, o.directions, o.rank, o.o1, o.o2, o.o3, o.o4, o.o5, o.condition);
}

/// The most correlated pairs of parameters.
std::string correlation_words(const calib::Calibration& calibration) {
  constexpr std::size_t kShown = 3;
  const auto pairs = calib::strong_correlations(calibration).pairs;
  if (pairs.empty()) return {};
  const auto name = [&](std::size_t index) {
    return calib::parameter_name(calibration.cell, calibration.parameters[index].key);
  };
  std::string text = "strongly correlated parameters:";
  for (std::size_t i = 0; i < std::min(kShown, pairs.size()); ++i)
    text += fmt::format("{} {} and {} ({:+.2f})", i == 0 ? "" : ",", name(pairs[i].first),
                        name(pairs[i].second), pairs[i].correlation);
  if (pairs.size() > kShown)
    text += fmt::format("; {} more pair{} beyond {:.1f}", pairs.size() - kShown,
                        pairs.size() == kShown + 1 ? "" : "s", calib::kStrongCorrelation);
  return text + "\n";
}

/// Numbers and lines of the rejected touches, as one line of the summary.
std::string outlier_list(const calib::Calibration& calibration,
                         std::span<const calib::Touch> touches) {
  constexpr std::size_t kShown = 6;
  const std::size_t count = calibration.outliers.size();
  if (count == 0) return {};
  std::string text = fmt::format("{} outlier{} left out:", count, count == 1 ? "" : "s");
  const calib::Touch unknown;
  for (std::size_t i = 0; i < std::min(kShown, count); ++i) {
    const std::size_t k = calibration.outliers[i].touch;
    text +=
        (i == 0 ? " " : ", ") + calib::touch_words(k, k < touches.size() ? touches[k] : unknown);
  }
  return text + (count > kShown ? ", ...\n" : "\n");
}

std::string predicted_words(const calib::Calibration& c) {
  if (!(c.predicted_workspace_m > 0.0)) return {};
  std::string text = fmt::format(
      "predicted mean position error: {:.3f} mm near the targets, {:.3f} mm over the workspace\n",
      c.predicted_near_targets_m * kMmPerM, c.predicted_workspace_m * kMmPerM);
  if (c.nominal_workspace_u_m > 0.0)
    text += fmt::format(
        "with the nominal arm: {:.2f} ± {:.2f} mm near the targets, {:.2f} ± {:.2f} mm over the workspace (k = 2)\n",
        c.nominal_near_targets_m * kMmPerM, c.nominal_near_targets_u_m * kMmPerM,
        c.nominal_workspace_m * kMmPerM, c.nominal_workspace_u_m * kMmPerM);
  return text;
}

std::string fit_words(const calib::Calibration& c) {
  std::string text;
  if (c.degrees_of_freedom > 0.0)
    text +=
        fmt::format("chi^2 of the fit: {:.1f} at {:.1f} degrees of freedom, {:.2f} per degree\n",
                    c.chi2, c.degrees_of_freedom, c.chi2_per_dof);
  if (c.repeats.degrees_of_freedom > 0.0)
    text += fmt::format(
        "touch noise: {:.3f} mm stated, {:.3f} mm measured by {} repeated touches ({:.0f} degrees "
        "of freedom), {:.3f} mm used\n",
        c.cell.touch_sigma_m * kMmPerM, c.repeats.scatter_m * kMmPerM, c.repeats.touches,
        c.repeats.degrees_of_freedom, c.repeats.used_m * kMmPerM);
  return text;
}

/// Details of the summary.
std::string evidence_words(const calib::Calibration& c, std::span<const calib::Touch> touches,
                           const std::optional<ContactsDelay>& contacts) {
  std::string text = fit_words(c) + delay_words(&c, contacts) +
                     observability_words(c.observability) + correlation_words(c);
  for (const calib::UnidentifiableDirection& direction : c.unidentifiable)
    text += "not identifiable: " + calib::words(c.cell, direction) + "\n";
  const calib::Touch unknown;
  for (const calib::Outlier& one : c.outliers) {
    const calib::Touch& touch = one.touch < touches.size() ? touches[one.touch] : unknown;
    // The text includes the residual.
    text +=
        fmt::format("outlier: {}: {}\n", calib::touch_words(one.touch, touch), calib::words(one));
  }
  return text;
}

}  // namespace

std::string delay_words(const calib::Calibration* fit,
                        const std::optional<ContactsDelay>& contacts) {
  const calib::ParameterResult* found =
      fit == nullptr ? nullptr : calib::find(*fit, calib::latch_delay_parameter());
  // A value determined by the prior alone is not a finding of the fit.
  if (found != nullptr && found->decided_by != calib::DecidedBy::kData) found = nullptr;
  if (found == nullptr && !contacts) return {};
  const auto in_ms = [](double delay_s, double sigma_s) {
    return fmt::format("{:+.2f} ± {:.2f} ms", calib::kMsPerS * delay_s,
                       calib::kMsPerS * 2.0 * sigma_s);
  };
  const auto by_contacts = [&] {
    return fmt::format("{} by fast against slow contacts of {} touches",
                       in_ms(contacts->delay_s, contacts->sigma_s), contacts->touches);
  };
  std::string text = "latch delay (k = 2): ";
  if (found == nullptr) return text + by_contacts() + "\n";
  const double fit_s = found->nominal + found->correction;
  text += in_ms(fit_s, found->sigma) + " by the fit";
  if (contacts) {
    const bool one =
        std::abs(fit_s - contacts->delay_s) <= 2.0 * std::hypot(found->sigma, contacts->sigma_s);
    text += fmt::format(
        ", {}: {}", by_contacts(),
        one ? "they agree" : "not one delay. Measure the contact itself: 'cellcal qualify'");
  }
  return text + "\n";
}

std::string result_words(const calib::Calibration& calibration,
                         std::span<const calib::Touch> touches, Detail detail,
                         const std::optional<ContactsDelay>& contacts) {
  const bool too_few = calibration.verdict.too_few();
  const std::string verdict = verdict_words(calibration, detail);
  // With one or two touches per target the fit's residuals are negligible in any case.
  if (too_few && calibration.check.count == 0) return delay_words(nullptr, contacts) + verdict;
  std::string text = fmt::format("{:<14} {:>7} {:>9} {:>9} {:>9}\n", "residual", "touches",
                                 "mean mm", "max mm", "rms mm");
  text += line("fit before", calibration.before);
  text += line("fit after", calibration.after);
  text += line("check before", calibration.check_before);
  text += line("check after", calibration.check);
  if (too_few) return text + delay_words(nullptr, contacts) + verdict;
  text += predicted_words(calibration);
  text += detail == Detail::kAll ? evidence_words(calibration, touches, contacts)
                                 : outlier_list(calibration, touches);
  return text + verdict;
}

}  // namespace cellcal::daemon

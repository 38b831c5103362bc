#include "daemon/cli/tables.h"

#include <fmt/format.h>

#include <algorithm>

#include "calib/result/correlation.h"
#include "calib/result/finding_words.h"

namespace cellcal::daemon {

namespace {

constexpr double kMm = 1e3;

std::string line(const char* name, const calib::ResidualSummary& summary) {
  if (summary.count == 0) return fmt::format("{:<14} {:>7}\n", name, "none");
  return fmt::format("{:<14} {:>7} {:>9.4f} {:>9.4f} {:>9.4f}\n", name, summary.count,
                     summary.mean_m * kMm, summary.max_m * kMm, summary.rms_m * kMm);
}

std::string verdict_words(const calib::Verdict& verdict) {
  if (verdict.too_few) {
    std::string text = "verdict: too few touches to calibrate, and nothing else is wrong\n";
    for (const std::string& reason : calib::words(verdict.findings)) text += "  - " + reason + "\n";
    return text;
  }
  std::string text = verdict.publish ? "verdict: publishable" : "verdict: NOT publishable";
  text += verdict.workspace ? ", scope: workspace\n" : ", scope: near targets\n";
  for (const std::string& reason : calib::words(verdict.findings)) text += "  - " + reason + "\n";
  return text;
}

std::string observability_words(const calib::Observability& o) {
  if (o.rows == 0) return {};
  return fmt::format(
      "observability: {} of {} directions of the geometry told better than by tolerance, {} seen; "
      "O1 {:.3g}, O2 {:.3g}, O3 {:.3g}, O4 {:.3g}, O5 {:.3g}, condition {:.0f}\n",
      o.told, o.directions, o.rank, o.o1, o.o2, o.o3, o.o4, o.o5, o.condition);
}

/// The strongest few pairs of parameters that the touches do not tell apart well.
std::string correlation_words(const calib::Calibration& calibration) {
  constexpr std::size_t kShown = 3;
  const auto pairs = calib::strong_correlations(calibration).pairs;
  if (pairs.empty()) return {};
  std::string text = "told together better than apart:";
  for (std::size_t i = 0; i < std::min(kShown, pairs.size()); ++i)
    text += fmt::format("{} {} and {} ({:+.2f})", i == 0 ? "" : ",",
                        calibration.parameters[pairs[i].first].name,
                        calibration.parameters[pairs[i].second].name, pairs[i].correlation);
  if (pairs.size() > kShown)
    text += fmt::format("; {} more pair{} beyond {:.1f}", pairs.size() - kShown,
                        pairs.size() == kShown + 1 ? "" : "s", calib::kStrongCorrelation);
  return text + "\n";
}

}  // namespace

std::string result_words(const calib::Calibration& calibration,
                         std::span<const calib::Touch> touches) {
  const bool too_few = calibration.verdict.too_few;
  // The residuals of a fit to a touch or two of each target are next to nothing whatever is true.
  if (too_few && calibration.check.count == 0) return verdict_words(calibration.verdict);
  std::string text = fmt::format("{:<14} {:>7} {:>9} {:>9} {:>9}\n", "residual", "touches",
                                 "mean mm", "max mm", "rms mm");
  text += line("fit before", calibration.before);
  text += line("fit after", calibration.after);
  text += line("check before", calibration.check_before);
  text += line("check after", calibration.check);
  if (too_few) return text + verdict_words(calibration.verdict);
  if (calibration.predicted_m3_m > 0.0) {
    text += fmt::format(
        "predicted mean error of a position: {:.3f} mm near the targets, {:.3f} mm over the "
        "workspace\n",
        calibration.predicted_m2_m * kMm, calibration.predicted_m3_m * kMm);
    if (calibration.nominal_m3_m > 0.0)
      text += fmt::format(
          "the nominal arm's own:              {:.3f} mm near the targets, {:.3f} mm over the "
          "workspace\n",
          calibration.nominal_m2_m * kMm, calibration.nominal_m3_m * kMm);
  }
  if (calibration.degrees_of_freedom > 0.0)
    text += fmt::format("chi^2 of the fit: {:.1f} at {:.1f} degrees of freedom, {:.2f} for each\n",
                        calibration.chi2, calibration.degrees_of_freedom, calibration.chi2_per_dof);
  if (calibration.repeats.degrees_of_freedom > 0.0)
    text += fmt::format(
        "touch noise: {:.3f} mm stated, {:.3f} mm measured by {} repeated touches ({:.0f} degrees "
        "of freedom), {:.3f} mm used\n",
        calibration.cell.touch_sigma_m * kMm, calibration.repeats.scatter_m * kMm,
        calibration.repeats.touches, calibration.repeats.degrees_of_freedom,
        calibration.repeats.used_m * kMm);
  text += observability_words(calibration.observability);
  text += correlation_words(calibration);
  for (const calib::UnidentifiableDirection& direction : calibration.unidentifiable)
    text += "not told by the touches: " + direction.words + "\n";
  for (const calib::Outlier& outlier : calibration.outliers) {
    const calib::Touch unknown;
    text += fmt::format(
        "outlier: {}: {}\n",
        calib::touch_words(outlier.touch,
                           outlier.touch < touches.size() ? touches[outlier.touch] : unknown),
        outlier.reason);  // has the residual
  }
  return text + verdict_words(calibration.verdict);
}

}  // namespace cellcal::daemon

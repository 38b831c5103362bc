// The first thing on the page: may the result be used, where, and why.

#include <fmt/format.h>

#include <cmath>
#include <string_view>

#include "daemon/report/sections.h"
#include "daemon/report/text.h"

namespace cellcal::daemon::report {
namespace {

std::string_view scope_words(const View& view) {
  const calib::Verdict& verdict = view.result.verdict;
  if (!verdict.publish) {
    return "This result must not be put into service. It may be read for diagnosis; the figures "
           "below describe it as it is.";
  }
  if (verdict.workspace) {
    return "Scope: the whole workspace. A certified length was touched, so the scale of the arm is "
           "held by the artefact and not by assumption.";
  }
  if (view.result.cell.lengths.empty()) {
    return "Scope: near the targets only, within about 150&nbsp;mm of them. No certified length "
           "was touched, so only the size of the targets holds the scale of the arm, and weakly. "
           "Elsewhere the result may be used "
           "for prediction with its larger bound, but it claims nothing there.";
  }
  return "Scope: near the targets only, within about 150&nbsp;mm of them. Elsewhere the result may "
         "be used for prediction with its larger bound, but it claims nothing there.";
}

std::string_view headline(const calib::Verdict& verdict) {
  if (!verdict.publish) return "Not publishable";
  return verdict.workspace ? "Publishable for the workspace" : "Publishable near the targets";
}

std::string target_words(const View& view) {
  const std::size_t count = view.result.targets.size();
  bool all_spheres = count > 0;
  for (const calib::TargetResult& target : view.result.targets) {
    const calib::Target* in_cell = view.cell_target(target.id);
    all_spheres = all_spheres && in_cell && in_cell->kind == calib::TargetKind::kSphere;
  }
  return all_spheres ? counted(count, "sphere", "spheres") : counted(count, "target", "targets");
}

std::string data_sentence(const View& view) {
  std::string sentence = fmt::format("{} on {} determined this calibration",
                                     counted(view.fit, "touch", "touches"), target_words(view));
  if (view.check > 0) {
    sentence +=
        fmt::format(", {} held out to test it", counted(view.check, "more was", "more were"));
  } else {
    sentence += ", none was held out to test it";
  }
  if (view.outliers > 0) {
    sentence +=
        fmt::format(", and {} set aside as {}", counted(view.outliers, "touch was", "touches were"),
                    view.outliers == 1 ? "an outlier" : "outliers");
  }
  return sentence + ".";
}

std::string residual_sentence(const View& view) {
  const calib::Calibration& result = view.result;
  const bool tested = result.check.count > 0;
  const calib::ResidualSummary& after = tested ? result.check : result.after;
  const bool same_touches_before = tested && result.check_before.count > 0;
  const calib::ResidualSummary& before = same_touches_before ? result.check_before : result.before;
  if (after.count <= 0) return "There are no residuals to report.";
  return fmt::format(
      "The tip missed the targets by {} mm on average ({} mm at most) with the nominal robot and "
      "misses them by {} mm ({} mm at most) with this calibration, on the touches {}.",
      mm(before.mean_m), mm(before.max_m), mm(after.mean_m), mm(after.max_m),
      tested ? "that were held out" : "that it was fitted to, which flatters it");
}

bool is_known(double predicted_m) { return std::isfinite(predicted_m) && predicted_m > 0.0; }

std::string accuracy_sentence(const View& view) {
  const calib::Calibration& result = view.result;
  if (!is_known(result.predicted_m2_m) || !is_known(result.predicted_m3_m)) {
    return "The 3-D position error to expect was not predicted.";
  }
  const std::string near =
      fmt::format("The 3-D position error to expect is {} mm on average near the targets",
                  mm(result.predicted_m2_m));
  const std::string far = mm(result.predicted_m3_m);
  if (result.verdict.workspace || !result.verdict.publish) {
    return fmt::format("{} and {} mm over the workspace, predicted from the covariance.", near,
                       far);
  }
  return fmt::format(
      "{} and {} mm over the workspace, which lies outside the scope; both are predicted from the "
      "covariance.",
      near, far);
}

}  // namespace

std::string verdict_banner(const View& view) {
  const calib::Verdict& verdict = view.result.verdict;
  std::string reasons;
  for (const std::string& reason : verdict.reasons) {
    reasons += fmt::format("<li>{}</li>\n", escape(reason));
  }
  if (!reasons.empty()) {
    reasons = fmt::format("<p class=\"because\">{}</p>\n<ul>\n{}</ul>\n",
                          verdict.publish ? "To know before using it" : "Why not", reasons);
  } else if (!verdict.publish) {
    reasons = "<p class=\"because\">No reason was recorded.</p>\n";
  }
  return fmt::format(
      "<div id=\"verdict\" class=\"verdict {}\">\n<span class=\"glyph\" aria-hidden=\"true\">{}"
      "</span>\n<div>\n<p class=\"headline\">{}</p>\n<p class=\"scope\">{}</p>\n{}</div>\n</div>\n",
      verdict.publish ? "yes" : "no", verdict.publish ? "&#10003;" : "&#10005;", headline(verdict),
      scope_words(view), reasons);
}

std::string summary(const View& view) {
  return fmt::format("<p class=\"lead\">{} {} {}</p>\n", escape(data_sentence(view)),
                     escape(residual_sentence(view)), escape(accuracy_sentence(view)));
}

}  // namespace cellcal::daemon::report

// The first thing on the page: may the result be used, where, and why.

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

#include "calib/result/finding.h"
#include "daemon/report/drawing/text.h"
#include "daemon/report/sections.h"

namespace cellcal::daemon::report {
namespace {

struct Reasons {
  std::string scope;  // without its opening; the first of them
  std::vector<std::string> against, other;
};

bool is_scope(calib::FindingKind kind) {
  return kind == calib::FindingKind::kScaleByLengths ||
         kind == calib::FindingKind::kScaleByReadings ||
         kind == calib::FindingKind::kScaleByNothing;
}

Reasons sorted_reasons(const calib::Verdict& verdict) {
  Reasons reasons;
  for (const calib::Finding& one : verdict.findings) {
    if (reasons.scope.empty() && is_scope(one.kind)) {
      reasons.scope = calib::sentence(one);
    } else {
      const bool note = verdict.publish || !one.withholds();
      (note ? reasons.other : reasons.against).push_back(calib::words(one));
    }
  }
  return reasons;
}

std::string sentence(std::string text) {
  if (!text.empty() && text[0] >= 'a' && text[0] <= 'z') text[0] = static_cast<char>(text[0] - 32);
  return text.empty() ? text : escape(text) + ".";
}

std::string scope_words(const View& view, const Reasons& reasons) {
  const calib::Verdict& verdict = view.result.verdict;
  if (verdict.too_few) {
    return "This was a first session, and the cell works. The touches are too few for a "
           "calibration: do not put the figures below into service.";
  }
  if (!verdict.publish) {
    return "Do not put this result into service. The figures below are for diagnosis only.";
  }
  const std::string why = sentence(reasons.scope);
  if (verdict.workspace) {
    return fmt::format("Scope: the whole workspace. {}",
                       why.empty()
                           ? "A certified length was touched at both ends and determines the "
                             "scale of the arm."
                           : why);
  }
  const std::string_view elsewhere = "Elsewhere it only predicts, with a larger bound.";
  return fmt::format(
      "Scope: near the targets only, within about 150&nbsp;mm of them. {}",
      why.empty() ? fmt::format("{}{}",
                                view.touched_lengths() == 0
                                    ? "No certified length was touched: only the size of the "
                                      "targets determines the scale of the arm, and weakly. "
                                    : "",
                                elsewhere)
                  : why);
}

std::string_view headline(const calib::Verdict& verdict) {
  if (verdict.too_few) return "The cell works; too few touches to calibrate";
  if (!verdict.publish) return "Not publishable";
  return verdict.workspace ? "Publishable for the workspace" : "Publishable near the targets";
}

std::string data_sentence(const View& view) {
  std::string sentence = fmt::format("{} on {} determined this calibration",
                                     counted(view.fit, "touch", "touches"), target_words(view));
  if (view.check > 0) {
    sentence +=
        fmt::format(", {} held out to check it", counted(view.check, "more was", "more were"));
  } else {
    sentence += ", none was held out to check it";
  }
  if (view.outliers > 0) {
    sentence +=
        fmt::format(", and {} left out as {}", counted(view.outliers, "touch was", "touches were"),
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
      "Mean residual {} (max. {}) with the nominal robot, {} (max. {}) with this calibration, "
      "on the touches {}.",
      mm_words(before.mean_m), mm_words(before.max_m), mm_words(after.mean_m),
      mm_words(after.max_m),
      tested ? "that were held out" : "of the fit, where it is smaller than elsewhere");
}

std::string list(std::string_view heading, const std::vector<std::string>& reasons) {
  if (reasons.empty()) return {};
  std::string items;
  for (const std::string& reason : reasons) items += fmt::format("<li>{}</li>\n", escape(reason));
  return fmt::format("<p class=\"because\">{}</p>\n<ul>\n{}</ul>\n", heading, items);
}

std::string accuracy_sentence(const View& view) {
  const calib::Calibration& result = view.result;
  if (!is_known(result.predicted_near_targets_m) || !is_known(result.predicted_workspace_m)) {
    return "The 3-D position error was not predicted.";
  }
  const std::string near = fmt::format("Predicted mean 3-D position error: {} near the targets",
                                       mm_words(result.predicted_near_targets_m));
  const std::string far = mm_words(result.predicted_workspace_m);
  const std::string nominal =
      is_known(result.nominal_workspace_u_m)
          ? fmt::format(" With the nominal model of this arm: {} ± {} over the workspace (k = 2).",
                        mm_words(result.nominal_workspace_m),
                        mm_words(result.nominal_workspace_u_m))
          : std::string();
  if (result.verdict.workspace || !result.verdict.publish) {
    return fmt::format("{}, {} over the workspace (from the covariance).{}", near, far, nominal);
  }
  return fmt::format(
      "{}, {} over the workspace, which is outside of the scope (both from the covariance).{}",
      near, far, nominal);
}

}  // namespace

std::string verdict_banner(const View& view) {
  const calib::Verdict& verdict = view.result.verdict;
  const Reasons reasons = sorted_reasons(verdict);
  std::string words = list(verdict.too_few ? "What it has shown" : "Why not", reasons.against);
  if (!verdict.publish && reasons.against.empty()) {
    words = "<p class=\"because\">No reason was recorded.</p>\n";
  }
  words += list(verdict.publish ? "Before using it" : "Other findings", reasons.other);
  if (!verdict.publish && !reasons.scope.empty()) {
    words += fmt::format("<p class=\"besides\">Scale: {}.</p>\n", escape(reasons.scope));
  }
  return fmt::format(
      "<div id=\"verdict\" class=\"verdict {}\">\n<span class=\"glyph\" aria-hidden=\"true\">{}"
      "</span>\n<div>\n<p class=\"headline\">{}</p>\n<p class=\"scope\">{}</p>\n{}</div>\n</div>\n",
      verdict.publish   ? "yes"
      : verdict.too_few ? "few"
                        : "no",
      verdict.publish || verdict.too_few ? "&#10003;" : "&#10005;", headline(verdict),
      scope_words(view, reasons), words);
}

std::string summary(const View& view) {
  return fmt::format("<p class=\"lead\">{} {} {}</p>\n", escape(data_sentence(view)),
                     escape(residual_sentence(view)), escape(accuracy_sentence(view)));
}

}  // namespace cellcal::daemon::report

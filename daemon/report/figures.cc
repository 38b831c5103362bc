// Before, after, check; and what these numbers mean and do not mean.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "daemon/report/sections.h"
#include "daemon/report/text.h"

namespace cellcal::daemon::report {
namespace {

std::string row(std::string_view what, const calib::ResidualSummary& summary, bool strong) {
  const std::string open =
      fmt::format("<tr{}><th scope=\"row\">{}</th><td>{}</td>", strong ? " class=\"strong\"" : "",
                  what, std::max(summary.count, 0));
  if (summary.count <= 0) {
    return open + "<td>\xE2\x80\x93</td><td>\xE2\x80\x93</td><td>\xE2\x80\x93</td></tr>\n";
  }
  return fmt::format("{}<td>{}</td><td>{}</td><td>{}</td></tr>\n", open, mm(summary.mean_m),
                     mm(summary.max_m), mm(summary.rms_m));
}

std::string group(std::string_view heading) {
  return fmt::format("<tr class=\"group\"><th scope=\"colgroup\" colspan=\"5\">{}</th></tr>\n",
                     heading);
}

std::string noise_words(const View& view) {
  const calib::Calibration& result = view.result;
  if (!(result.touch_noise_m > 0.0) || !(result.chi2_per_dof > 0.0)) {
    return "The scatter of one touch was not determined.";
  }
  return fmt::format(
      "One touch scatters by {} mm (1&sigma;, from the fit); the cell file states {} mm. "
      "&chi;&sup2; per degree of freedom is {}; 1 is what the stated scatter predicts.",
      positive_mm(result.touch_noise_m), positive_mm(result.cell.touch_sigma_m),
      fixed(result.chi2_per_dof, 2));
}

std::string tile(std::string_view label, std::string_view value, std::string_view basis,
                 std::string_view css_class) {
  return fmt::format(
      "<div class=\"tile {}\"><p class=\"label\">{}</p><p class=\"value\">{} <span>mm</span></p>"
      "<p class=\"basis\">{}</p></div>\n",
      css_class, label, value, basis);
}

std::string predicted_tile(std::string_view label, double mean_m, bool outside_scope) {
  if (!std::isfinite(mean_m) || mean_m <= 0.0) {
    return tile(label, positive_mm(0.0), "not predicted", "missing");
  }
  return tile(label, mm(mean_m),
              outside_scope
                  ? "predicted from the covariance, mean; outside the scope of the verdict"
                  : "predicted from the covariance, mean",
              outside_scope ? "predicted outside" : "predicted");
}

std::string tiles(const View& view) {
  const calib::Calibration& result = view.result;
  std::string out = "<div class=\"tiles\">\n";
  if (result.check.count > 0) {
    out +=
        tile("Residual on held-out touches (M1)", mm(result.check.mean_m),
             fmt::format("measured, mean of {}",
                         counted(static_cast<std::size_t>(result.check.count), "touch", "touches")),
             "measured");
  } else {
    out += tile("Residual on held-out touches (M1)", "\xE2\x80\x93",
                "not measured: no touch was held out", "missing");
  }
  out += predicted_tile("3-D error within 150&nbsp;mm of the targets (M2)", result.predicted_m2_m,
                        false);
  out += predicted_tile("3-D error over the workspace (M3)", result.predicted_m3_m,
                        result.verdict.publish && !result.verdict.workspace);
  return out + "</div>\n";
}

std::string truth_block(const View& view) {
  if (view.input.truth.empty()) return {};
  std::string rows;
  for (const auto& [figure, value] : view.input.truth) {
    rows += fmt::format("<tr><th scope=\"row\">{}</th><td>{}</td></tr>\n", escape(figure),
                        escape(value));
  }
  return fmt::format(
      "<div class=\"truth\">\n<h3>Simulated cell: the truth is known</h3>\n<p>These figures "
      "compare "
      "the result with the errors that the simulation hides. A real cell has no such table.</p>\n"
      "<table class=\"pairs\">\n{}</table>\n</div>\n",
      rows);
}

}  // namespace

std::string figures_table(const View& view) {
  const calib::Calibration& result = view.result;
  std::string body =
      "<div class=\"scroll\"><table class=\"numbers figures\">\n<thead><tr><th scope=\"col\">"
      "Distance of the tip from the target, mm</th><th scope=\"col\">touches</th>"
      "<th scope=\"col\">mean</th><th scope=\"col\">max</th><th scope=\"col\">rms</th></tr></thead>"
      "\n<tbody>\n";
  body += group("Fitted touches");
  body += row("before: nominal robot, stiff tool, best sphere for it", result.before, false);
  body += row("after: calibrated", result.after, false);
  body += group("Held-out touches (check)");
  body += row("before: nominal robot", result.check_before, false);
  body += row("check: calibrated", result.check, true);
  body += "</tbody>\n</table></div>\n";
  body += fmt::format("<p class=\"note\">{}</p>\n", noise_words(view));
  if (result.check.count <= 0) {
    body +=
        "<p class=\"note\">No touch was held out: nothing here tests the result on touches that it "
        "has not seen. Mark some rows <code>check</code>, or let the next session hold some "
        "out.</p>\n";
  }
  return section("figures", "Before, after, check", body);
}

std::string meaning(const View& view) {
  const calib::Calibration& result = view.result;
  std::string body = tiles(view);
  body +=
      "<p><strong>The residual is not the accuracy of the robot.</strong> It is measured along one "
      "line, from the target&rsquo;s centre to the tip, and only where the targets stand. Errors "
      "that move the arm and the fitted targets together leave it as small as it is.</p>\n";
  if (result.cell.lengths.empty()) {
    body +=
        "<p>Above all it cannot see scale: if all lengths of the arm are wrong by the same part, "
        "the fitted targets move with them. Without a certified distance between two targets a "
        "workspace can be a millimetre wrong while held-out touches agree to a few hundredths. A "
        "certified distance in the cell settles this; more touches do not.</p>\n";
  } else {
    body += fmt::format(
        "<p>Scale, the error that touches alone see worst, is tied here to {} (see Targets).</p>\n",
        counted(result.cell.lengths.size(), "certified length", "certified lengths"));
  }
  body +=
      "<p>M2 and M3 are not measured. They follow from the covariance of the parameters and hold "
      "as "
      "far as the model does: what the model lacks, such as backlash, temperature or a tool that "
      "moved since, is not in them. M3 is taken after the best alignment of the base. To "
      "measure accuracy, use an instrument of its own, for example a laser tracker.</p>\n";
  body += truth_block(view);
  return section("meaning", "What the numbers mean, and what they do not", body);
}

}  // namespace cellcal::daemon::report

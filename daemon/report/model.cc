// Which model was fitted, by which method, and how well the touches tell it from the others.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <string_view>

#include "calib/result/level.h"
#include "daemon/report/drawing/text.h"
#include "daemon/report/sections.h"

namespace cellcal::daemon::report {
namespace {

constexpr int kEvidenceDecimals = 1;  // a tenth is odds of eleven to ten: nothing
constexpr std::size_t kMostLevels = 6;
constexpr double kLeastShareOfModel = 0.005;

std::string capitalised(std::string text) {
  if (!text.empty() && text[0] >= 'a' && text[0] <= 'z') text[0] = static_cast<char>(text[0] - 32);
  return text;
}

std::string_view method_sentence(std::string_view method) {
  if (method == "map") {
    return "Each parameter has its tolerance as prior; the touches correct it as far as their "
           "information exceeds the prior&rsquo;s.";
  }
  if (method == "paper") {
    return "The estimator of Wang et al. (2024): one sphere, geometry and tool bending, no "
           "tolerances, no choice of a model level.";
  }
  return {};
}

// The level itself stands above it.
std::string reason_of(const calib::Calibration& result) {
  const std::string reason = calib::reason_words(result);
  if (reason.empty()) return {};
  return fmt::format("<p>{}.</p>\n", capitalised(escape(reason)));
}

std::string_view parts() {
  return "<table class=\"pairs parts\">\n"
         "<tr><th scope=\"row\">geometry</th><td>zero, lengths and angles of each joint</td></tr>\n"
         "<tr><th scope=\"row\">tool bending</th><td>the tool yields to its weight</td></tr>\n"
         "<tr><th scope=\"row\">joint compliance</th><td>each joint yields in proportion to the "
         "torque of gravity on it</td></tr>\n"
         "<tr><th scope=\"row\">play</th><td>each joint lies to the side that gravity loads it to, the "
         "more the larger its torque, up to half of its play</td></tr>\n"
         "<tr><th scope=\"row\">transmission</th><td>error of the gears that is smooth in the "
         "joint&rsquo;s angle; the figure is the tolerance (1&sigma;) of each of its "
         "amplitudes</td></tr>\n"
         "<tr><th scope=\"row\">ripple</th><td>error of the gears too fast to be followed from "
         "touch to touch; counted as noise of each joint (1&sigma;)</td></tr>\n</table>\n";
}

// "53 %"; what is less than half a percent is still more than nothing.
std::string percent(double share) {
  if (!std::isfinite(share)) return fixed(share, 0);
  return share < kLeastShareOfModel ? "&lt;&nbsp;1&nbsp;%" : fixed(100.0 * share, 0) + "&nbsp;%";
}

std::string levels_table(const calib::Calibration& result) {
  if (result.levels.empty()) {
    return "<p class=\"note\">No other level of the model was compared.</p>\n";
  }
  const double best = result.levels.front().log_evidence;
  const auto odds = [best](const calib::LevelEvidence& entry) {
    return std::exp(entry.log_evidence - best);
  };
  double sum = 0.0;
  for (const calib::LevelEvidence& entry : result.levels) {
    if (const double share = odds(entry); std::isfinite(share)) sum += share;
  }
  std::string rows;
  double shown = 0.0;
  const std::size_t count = std::min(result.levels.size(), kMostLevels);
  for (std::size_t i = 0; i < count; ++i) {
    const calib::LevelEvidence& entry = result.levels[i];
    const double share = odds(entry) / sum;
    shown += share;
    rows += fmt::format("<tr><th scope=\"row\">{}</th><td>{}</td><td>{}</td></tr>\n",
                        escape(calib::words(result.cell, entry.level)), percent(share),
                        fixed(entry.log_evidence - best, kEvidenceDecimals));
  }
  if (result.levels.size() > count) {
    rows += fmt::format(
        "<tr><th scope=\"row\">{}</th><td>{}</td><td></td></tr>\n",
        counted(result.levels.size() - count, "more, less likely", "more, each less likely"),
        percent(std::max(0.0, 1.0 - shown)));
  }
  return fmt::format(
      "<div class=\"scroll\"><table class=\"numbers levels\">\n<thead><tr><th "
      "scope=\"col\">levels compared</th><th scope=\"col\">probability</th><th "
      "scope=\"col\">log evidence</th></tr></thead>\n<tbody>\n{}</tbody>\n</table></div>\n<p "
      "class=\"note\">Probability among these levels: how well each predicts the touches, "
      "averaged over the tolerances of all its parameters, and how common such arms are. A "
      "level that fits better only by fine tuning loses. Log evidence: natural logarithm of "
      "the same, relative to the best.</p>\n",
      rows);
}

}  // namespace

std::string method_words(std::string_view method) {
  if (method == "map") return "maximum a posteriori estimate";
  if (method == "paper") return "reference method, for comparison only";
  return escape(method);
}

std::string level_words(const View& view) {
  const calib::Calibration& result = view.result;
  // Methods that know no levels leave all three empty; the default level is not theirs.
  if (result.level_reason.choice == calib::LevelChoice::kNone && result.levels.empty()) return {};
  return escape(calib::words(result.cell, result.level));
}

std::string model(const View& view) {
  const calib::Calibration& result = view.result;
  const std::string level = level_words(view);
  std::string body;
  if (!level.empty()) {
    body += fmt::format("<p class=\"fitted\">{}</p>\n", capitalised(level));
    body += reason_of(result);
  }
  const std::string method = method_words(result.method);
  body += fmt::format("<p>Method: {}. {}</p>\n", method.empty() ? "<em>not stated</em>" : method,
                      method_sentence(result.method));
  if (!level.empty()) body += levels_table(result) + std::string(parts());
  return section("model", "Fitted model", body);
}

}  // namespace cellcal::daemon::report

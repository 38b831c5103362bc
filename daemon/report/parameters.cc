// Identified parameters, grouped by joint, with a bar of each correction relative to its sigma.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <compare>
#include <cstddef>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "calib/model/units.h"
#include "calib/result/calibration.h"
#include "calib/result/level.h"
#include "calib/svg/svg.h"
#include "daemon/report/plan_picture.h"
#include "daemon/report/report.h"

namespace cellcal::daemon::report {

namespace {

using calib::DecidedBy;
using calib::ParameterKind;
using calib::ParameterResult;
using svg::Svg;

constexpr double kBarWidth = 150.0;
constexpr double kBarHeight = 16.0;
constexpr double kBarMiddle = 0.5 * kBarHeight;
constexpr double kBarEnd = 4.0;
constexpr double kBarSigmas = 2.0;
constexpr int kDegreeDecimals = 4;  // 0.0001 deg is 2 um at a metre
constexpr int kArcsecDecimals = 2;
constexpr int kMsDecimals = 2;  // 0.01 ms is 0.1 um at 10 mm/s
constexpr int kOtherDigits = 4;
constexpr int kSigmaDigits = 2;

struct Group {
  std::string heading;
  bool joint = false;
  std::vector<const ParameterResult*> rows;
};

std::pair<std::string, bool> owner_of(const View& view, const calib::ParameterKey& key) {
  const calib::Cell& cell = view.result.cell;
  if (key.joint >= 0)
    return {"Joint " + cell.robot.joints.at(static_cast<std::size_t>(key.joint)).name, true};
  if (key.target >= 0)
    return {"Target " + cell.targets.at(static_cast<std::size_t>(key.target)).id, false};
  if (key.kind == ParameterKind::kLatchDelay) return {"Touch", false};
  if (!cell.tool.id.empty()) {
    const auto index = static_cast<std::size_t>(key.tool);
    return {"Tool " + (index == 0 ? cell.tool : cell.other_tools.at(index - 1)).id, false};
  }
  return {key.kind == ParameterKind::kEffectiveRadius ? "Touch" : "Tool", false};
}

std::vector<Group> group_by_owner(const View& view, bool waves) {
  std::vector<Group> groups;
  for (const ParameterResult& parameter : view.result.parameters) {
    // Amplitudes of transmission error: four or more per joint, most of them undetermined.
    if (is_function(parameter.key.kind) || is_transmission(parameter.key.kind) != waves) continue;
    const auto [heading, joint] = owner_of(view, parameter.key);
    auto found = std::find_if(groups.begin(), groups.end(), [&heading = heading](const Group& g) {
      return g.heading == heading;
    });
    if (found == groups.end()) {
      groups.push_back({heading, joint, {}});
      found = std::prev(groups.end());
    }
    found->rows.push_back(&parameter);
  }
  return groups;
}

std::string_view meaning_of(ParameterKind kind) {
  switch (kind) {
    case ParameterKind::kTheta:
      return "zero of the axis (mastering)";
    case ParameterKind::kD:
      return "offset along the axis";
    case ParameterKind::kA:
      return "length of the link";
    case ParameterKind::kAlpha:
      return "twist of the link";
    case ParameterKind::kBeta:
      return "tilt to the parallel axis";
    case ParameterKind::kGuide:
      return "motion of the carriage";
    case ParameterKind::kCompliance:
      return "compliance under torque";
    case ParameterKind::kBearing:
      return "compliance across the axis";
    case ParameterKind::kStiffening:
      return "deflection at small loads";
    case ParameterKind::kPlay:
      return "half of the play, closed by the load";
    case ParameterKind::kCosine:
      return "cosine wave";
    case ParameterKind::kSine:
      return "sine wave";
    case ParameterKind::kDeflection:
      return "bending";
    case ParameterKind::kTcp:
      return "tip from the flange";
    case ParameterKind::kPositioner:
      return "axis of the positioner";
    case ParameterKind::kEffectiveRadius:
      return "offset of the radius";
    case ParameterKind::kLatchDelay:
      return "angles latched after the contact";
    case ParameterKind::kRadius:
      return "correction of the radius";
    case ParameterKind::kCentre:
      return "position";
    case ParameterKind::kFunctionCosine:
    case ParameterKind::kFunctionSine:
    case ParameterKind::kLoad:
    case ParameterKind::kTilt:
    case ParameterKind::kShift:
    case ParameterKind::kTurn:
    case ParameterKind::kProbeTurn:
      break;
  }
  return {};
}

double nominal_of(const View& view, const ParameterResult& parameter) {
  return calib::stated_value(view.result.cell, parameter.key) + parameter.nominal;
}

std::string in_unit(double value, const ParameterResult& parameter, bool with_sign,
                    int digits = kOtherDigits) {
  const double shown = value * parameter.to_unit;
  int decimals = -1;
  if (parameter.unit == "mm") decimals = kMmDecimals;
  if (parameter.unit == "deg") decimals = kDegreeDecimals;
  if (parameter.unit == "arcsec") decimals = kArcsecDecimals;
  if (parameter.unit == "ms") decimals = kMsDecimals;
  if (decimals < 0) {
    const bool plus = with_sign && std::isfinite(shown) && shown > 0.0;
    return fmt::format("{}{}", plus ? "+" : "", significant(shown, digits));
  }
  return with_sign ? signed_fixed(shown, decimals) : fixed(shown, decimals);
}

// Bars share a scale within one unit over all joints, and within each other group.
struct RangeKey {
  std::string group;  ///< heading; empty: all joints
  std::string unit;
  auto operator<=>(const RangeKey&) const = default;
};
using Ranges = std::map<RangeKey, double>;

RangeKey range_key(const Group& group, const ParameterResult& parameter) {
  return {group.joint ? "" : group.heading, parameter.unit};
}

Ranges bar_ranges(const std::vector<Group>& groups) {
  Ranges ranges;
  for (const Group& group : groups) {
    for (const ParameterResult* row : group.rows) {
      const double reach =
          std::abs(row->to_unit) * (std::abs(row->correction) + kBarSigmas * std::abs(row->sigma));
      double& range = ranges[range_key(group, *row)];
      if (std::isfinite(reach)) range = std::max(range, reach);
    }
  }
  return ranges;
}

std::string bar(const ParameterResult& parameter, double range) {
  const double correction = parameter.correction * parameter.to_unit;
  const double reach = kBarSigmas * std::abs(parameter.sigma * parameter.to_unit);
  if (!(range > 0.0) || !std::isfinite(correction) || !std::isfinite(reach)) return {};
  const Scale across{-range, range, kBarEnd, kBarWidth - kBarEnd};
  Svg svg(kBarWidth, kBarHeight, "bar", "correction with two sigma");
  svg.line({across(0.0), 1.0}, {across(0.0), kBarHeight - 1.0}, "zero");
  svg.line({across.clamped(correction - reach), kBarMiddle},
           {across.clamped(correction + reach), kBarMiddle}, "reach");
  svg.circle({across.clamped(correction), kBarMiddle}, 3.2,
             parameter.decided_by == DecidedBy::kData ? "dot" : "dot hollow");
  return std::move(svg).finish();
}

// "1/(N m^2)" with a superscript; units are plain ASCII in files.
std::string unit_html(std::string_view unit) {
  std::string html = escape(unit);
  for (std::size_t at = html.find("^2"); at != std::string::npos; at = html.find("^2")) {
    html.replace(at, 2, "&sup2;");
  }
  return html;
}

std::string parameter_row(const View& view, const Group& group, const ParameterResult& parameter,
                          const Ranges& ranges) {
  const std::string_view decided = calib::to_string(parameter.decided_by);
  const auto range = ranges.find(range_key(group, parameter));
  return fmt::format(
      "<tr class=\"by-{}\"><th scope=\"row\"><code>{}</code> <small>{}</small></th><td>{}</td>"
      "<td>{}</td><td>{}</td><td class=\"word\">{}</td><td "
      "class=\"word\">{}</td><td>{}</td></tr>\n",
      decided, escape(name_of(view, parameter)), meaning_of(parameter.key.kind),
      in_unit(nominal_of(view, parameter), parameter, false),
      in_unit(parameter.correction, parameter, true),
      in_unit(parameter.sigma, parameter, false, kSigmaDigits), unit_html(parameter.unit), decided,
      bar(parameter, range == ranges.end() ? 0.0 : range->second));
}

std::string joint_range_words(const Ranges& ranges) {
  std::string words;
  for (const auto& [key, range] : ranges) {
    if (!key.group.empty() || !(range > 0.0)) continue;
    words += fmt::format("{}&plusmn;{}&nbsp;{}", words.empty() ? "" : ", ", significant(range, 2),
                         unit_html(key.unit));
  }
  return words.empty() ? words : fmt::format(" All joints share one scale per unit ({}).", words);
}

std::string_view unstated_words(const View& view) {
  for (const calib::TargetResult& target : view.result.targets) {
    const calib::Target* in_cell = view.cell_target(target.id);
    if (in_cell && !in_cell->has_centre) {
      return " For a target without a position in the cell file, nominal is where the nominal "
             "robot finds it.";
    }
  }
  return {};
}

std::string table(const View& view, const std::vector<Group>& groups, const Ranges& ranges) {
  std::string rows;
  for (const Group& group : groups) {
    rows += fmt::format(
        "<tbody>\n<tr class=\"group\"><th scope=\"colgroup\" colspan=\"7\">{}</th></tr>\n",
        escape(group.heading));
    for (const ParameterResult* row : group.rows) rows += parameter_row(view, group, *row, ranges);
    rows += "</tbody>\n";
  }
  return fmt::format(
      "<div class=\"scroll\"><table class=\"numbers parameters\">\n<thead><tr>"
      "<th scope=\"col\">parameter</th><th scope=\"col\">nominal</th>"
      "<th scope=\"col\">correction</th><th scope=\"col\">&sigma;</th>"
      "<th scope=\"col\" class=\"word\">unit</th><th scope=\"col\" class=\"word\">decided by</th>"
      "<th scope=\"col\">correction &plusmn; 2&sigma;</th></tr></thead>\n{}</table></div>\n",
      rows);
}

// Collapsed: mostly undetermined parameters would hide the determined ones.
std::string waves_table(const View& view, const std::vector<Group>& groups) {
  std::size_t count = 0;
  std::size_t decided = 0;
  for (const Group& group : groups) {
    for (const ParameterResult* row : group.rows) {
      ++count;
      decided += row->decided_by == DecidedBy::kData ? 1 : 0;
    }
  }
  if (count == 0) return {};
  const std::string words =
      fmt::format("Transmission error: {} of the gears, {} decided by the data",
                  counted(count, "wave", "waves"), decided == 0 ? "none" : std::to_string(decided));
  const Ranges ranges = bar_ranges(groups);
  return fmt::format(
      "<details>\n<summary>{0}</summary>\n<p class=\"note\">The number after cos and sin counts "
      "the waves per turn of the motor where the robot file states a gear ratio, otherwise of the "
      "joint.{1}</p>\n{2}"
      "</details>\n<p class=\"on-paper\">{0}; listed in the electronic file of this report.</p>\n",
      words, joint_range_words(ranges), table(view, groups, ranges));
}

// f_i of one joint with its 95 % band.
std::string function_chart(const calib::JointFunction& f, std::string_view joint) {
  constexpr double kWidth = 460.0, kHeight = 150.0, kLeft = 46.0, kTop = 26.0, kBottom = 126.0;
  constexpr double kArcsec = 1.0 / calib::kRadPerArcsec;
  double most = 1.0;
  for (std::size_t k = 0; k < f.error_rad.size(); ++k)
    most = std::max(most, kArcsec * (std::abs(f.error_rad[k]) + f.u95_rad[k]));
  const Scale across{calib::kDegPerRad * f.angle_rad.front(),
                     calib::kDegPerRad * f.angle_rad.back(), kLeft, kWidth - 8.0};
  const Scale up{-most, most, kBottom, kTop};
  std::vector<svg::Point> line, band;
  for (std::size_t k = 0; k < f.angle_rad.size(); ++k) {
    const double x = across(calib::kDegPerRad * f.angle_rad[k]);
    line.push_back({x, up(kArcsec * f.error_rad[k])});
    band.push_back({x, up(kArcsec * (f.error_rad[k] + f.u95_rad[k]))});
  }
  for (std::size_t k = f.angle_rad.size(); k-- > 0;)
    band.push_back({across(calib::kDegPerRad * f.angle_rad[k]),
                    up(kArcsec * (f.error_rad[k] - f.u95_rad[k]))});
  svg::Svg svg(kWidth, kHeight, "chart",
               fmt::format("Transmission error of {} over its angle, with its 95 % band", joint));
  svg.path(band, "band");
  const std::vector<double> heights = round_ticks(-most, most, 3);
  const std::vector<std::string> labels = tick_labels(heights);
  for (std::size_t i = 0; i < heights.size(); ++i) {
    const double y = up(heights[i]);
    svg.line({kLeft, y}, {kWidth - 8.0, y}, heights[i] == 0.0 ? "zero" : "grid");
    svg.text({kLeft - 6.0, y + 4.0}, svg::Anchor::kEnd, "tick", labels[i]);
  }
  for (const double angle : round_ticks(across.from, across.to, 6))
    svg.text({across(angle), kBottom + 16.0}, svg::Anchor::kMiddle, "tick",
             fmt::format("{:g}", angle));
  svg.path(line, "curve");
  svg.text({0.0, 14.0}, svg::Anchor::kStart, "panel", fmt::format("{}, arcsec over deg", joint));
  return std::move(svg).finish();
}

std::string function_charts(const View& view) {
  const std::vector<calib::JointFunction> functions = calib::joint_functions(view.result);
  if (functions.empty()) return {};
  std::string charts;
  for (const calib::JointFunction& f : functions)
    charts += function_chart(f, view.result.cell.robot.joints[f.joint].name);
  return fmt::format(
      "<details>\n<summary>Transmission error of {}, over the touched angles</summary>\n"
      "<p class=\"note\">Line: what the touches determined and the correction takes out. Shaded: "
      "its 95&nbsp;% band, wide where no touch had that angle.</p>\n<div class=\"pair\">{}</div>\n"
      "</details>\n",
      counted(functions.size(), "joint", "joints"), charts);
}

}  // namespace

std::string parameters_table(const View& view) {
  const std::vector<Group> groups = group_by_owner(view, false);
  const std::vector<Group> waves = group_by_owner(view, true);
  if (groups.empty() && waves.empty()) {
    return section("parameters", "Parameters", "<p>No parameter was identified.</p>\n");
  }
  const Ranges ranges = bar_ranges(groups);
  std::string body = fmt::format(
      "<p class=\"note\">Decided by <strong>data</strong>: the touches reduced the variance of "
      "the tolerance by at least half. <strong>Prior</strong>: they reduced it less, and the "
      "value stays near nominal. <strong>Frame</strong>: most of &sigma; is the choice of the "
      "frame (gauge), which no touch determines, and no error of the robot. The bar shows the "
      "correction (dot, hollow where not decided by data) with &plusmn;2&sigma; (line) around "
      "zero.{}{}</p>\n",
      joint_range_words(ranges), unstated_words(view));
  if (!groups.empty()) body += table(view, groups, ranges);
  return section("parameters", "Parameters",
                 body + waves_table(view, waves) + function_charts(view));
}

// Selected model, method, and how clearly the touches favour it over the others.

namespace {

constexpr int kEvidenceDecimals = 1;  // 0.1 is odds of eleven to ten: insignificant
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

// The level itself is displayed above.
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

// "53 %"; a non-zero share below 0.5 % is not shown as zero.
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
  // Methods without levels leave all three empty; the default level does not apply.
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

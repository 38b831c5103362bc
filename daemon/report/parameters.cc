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

#include "calib/export/svg.h"
#include "calib/model/enum_table.h"
#include "calib/model/units.h"
#include "calib/result/calibration.h"
#include "calib/result/finding_phrase.h"
#include "calib/result/level.h"
#include "daemon/report/axes.h"
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
  const auto named = [](const char* id, const std::string& name) {
    return say({id, {{"name", name}}});
  };
  if (key.joint >= 0)
    return {named("say.report.owner.joint",
                  cell.robot.joints.at(static_cast<std::size_t>(key.joint)).name),
            true};
  if (key.target >= 0)
    return {
        named("say.report.owner.target", cell.targets.at(static_cast<std::size_t>(key.target)).id),
        false};
  if (key.carrier >= 0)
    return {named("say.report.owner.joint",
                  cell.robot.positioner.at(static_cast<std::size_t>(key.carrier)).name),
            false};
  if (key.kind == ParameterKind::kLatchDelay) return {say("say.report.owner.touch"), false};
  if (!cell.tool.id.empty()) {
    const auto index = static_cast<std::size_t>(key.tool);
    return {named("say.report.owner.tool_named",
                  (index == 0 ? cell.tool : cell.other_tools.at(index - 1)).id),
            false};
  }
  return {say(key.kind == ParameterKind::kEffectiveRadius ? "say.report.owner.touch"
                                                          : "say.report.owner.tool"),
          false};
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
  Svg svg(kBarWidth, kBarHeight, "bar", say("say.report.parameters.bar"));
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

std::string description(const View& view, const calib::ParameterKey& key) {
  if (key.kind == calib::ParameterKind::kTheta && key.joint >= 0 &&
      view.result.cell.robot.joints[static_cast<std::size_t>(key.joint)].sign < 0)
    return say("say.report.parameter.theta.opposite");
  return say_if("say.report.parameter.", own_name(key.kind));
}

void add_row(const View& view, const Group& group, const ParameterResult& parameter,
             const Ranges& ranges, Table& table) {
  const std::string decided(calib::to_string(parameter.decided_by));
  const auto range = ranges.find(range_key(group, parameter));
  table.row({fmt::format("<code>{}</code> <small>{}</small>", escape(name_of(view, parameter)),
                         description(view, parameter.key)),
             in_unit(nominal_of(view, parameter), parameter, false),
             in_unit(parameter.correction, parameter, true),
             in_unit(parameter.sigma, parameter, false, kSigmaDigits),
             unit_html(unit_word(parameter.unit)), say("say.report.decided." + decided),
             bar(parameter, range == ranges.end() ? 0.0 : range->second)},
            "by-" + decided);
}

std::string joint_range_words(const Ranges& ranges) {
  std::string words;
  for (const auto& [key, range] : ranges) {
    if (!key.group.empty() || !(range > 0.0)) continue;
    words += fmt::format("{}&plusmn;{}&nbsp;{}", words.empty() ? "" : ", ", significant(range, 2),
                         unit_html(unit_word(key.unit)));
  }
  return words.empty() ? words : say({"say.report.parameters.scale", {{"ranges", words}}});
}

std::string unstated_words(const View& view) {
  for (const calib::TargetResult& target : view.result.targets) {
    const calib::Target* in_cell = view.cell_target(target.id);
    if (in_cell && !in_cell->has_centre) return say("say.report.parameters.unstated");
  }
  return {};
}

std::string table_of(const View& view, const std::vector<Group>& groups, const Ranges& ranges) {
  Table table({"say.report.col.parameter",
               "say.report.col.nominal",
               "say.report.col.correction",
               "&sigma;",
               {"say.report.col.unit", "word"},
               {"say.report.col.decided_by", "word"},
               "say.report.col.correction_bar"},
              "parameters");
  for (const Group& group : groups) {
    table.next_body();
    table.group(escape(group.heading));
    for (const ParameterResult* row : group.rows) add_row(view, group, *row, ranges, table);
  }
  return table.html();
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
      say({"say.report.waves",
           {{"waves", counted(count, "say.report.waves.")},
            {"decided", decided == 0 ? say("say.report.waves.none") : std::to_string(decided)}}});
  const Ranges ranges = bar_ranges(groups);
  return fmt::format("<details>\n<summary>{}</summary>\n{}{}</details>\n{}", words,
                     paragraph("note", say("say.report.waves.note") + joint_range_words(ranges)),
                     table_of(view, groups, ranges),
                     paragraph("on-paper", say({"say.report.waves.on_paper", {{"words", words}}})));
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
               say({"say.report.function.picture", {{"joint", std::string(joint)}}}));
  svg.path(band, "band");
  draw_value_axis(svg, across, up, 3, 6.0);
  for (const double angle : round_ticks(across.from, across.to, 6))
    svg.text({across(angle), kBottom + 16.0}, svg::Anchor::kMiddle, "tick",
             fmt::format("{:g}", angle));
  svg.path(line, "curve");
  svg.text({0.0, 14.0}, svg::Anchor::kStart, "panel",
           say({"say.report.function.axes", {{"joint", std::string(joint)}}}));
  return std::move(svg).finish();
}

std::string function_charts(const View& view) {
  const std::vector<calib::JointFunction> functions = calib::joint_functions(view.result);
  if (functions.empty()) return {};
  std::string charts;
  for (const calib::JointFunction& f : functions)
    charts += function_chart(f, view.result.cell.robot.joints[f.joint].name);
  return fmt::format(
      "<details>\n<summary>{}</summary>\n{}<div class=\"pair\">{}</div>\n</details>\n",
      counted(functions.size(), "say.report.functions."),
      paragraph("note", say("say.report.functions.note")), charts);
}

constexpr int kEvidenceDecimals = 1;  // 0.1 is odds of eleven to ten: insignificant
constexpr std::size_t kMostLevels = 6;
constexpr double kLeastShareOfModel = 0.005;

std::string parts() {
  std::string rows;
  for (const char* part : {"geometry", "bending", "compliance", "play", "transmission", "ripple"})
    rows += pair_row(say(std::string("say.report.part.") + part),
                     say(std::string("say.report.part_is.") + part));
  return "<table class=\"pairs parts\">\n" + rows + "</table>\n";
}

// "53 %"; a non-zero share below 0.5 % is not shown as zero.
std::string percent(double share) {
  if (!std::isfinite(share)) return fixed(share, 0);
  return share < kLeastShareOfModel ? "&lt;&nbsp;1&nbsp;%" : fixed(100.0 * share, 0) + "&nbsp;%";
}

std::string levels_table(const calib::Calibration& result) {
  if (result.levels.empty()) {
    return paragraph("note", say("say.report.levels.none"));
  }
  const double best = result.levels.front().log_evidence;
  const auto odds = [best](const calib::LevelEvidence& entry) {
    return std::exp(entry.log_evidence - best);
  };
  double sum = 0.0;
  for (const calib::LevelEvidence& entry : result.levels) {
    if (const double share = odds(entry); std::isfinite(share)) sum += share;
  }
  Table table(
      {"say.report.levels.compared", "say.report.levels.probability", "say.report.levels.evidence"},
      "levels");
  double shown = 0.0;
  const std::size_t count = std::min(result.levels.size(), kMostLevels);
  for (std::size_t i = 0; i < count; ++i) {
    const calib::LevelEvidence& entry = result.levels[i];
    const double share = odds(entry) / sum;
    shown += share;
    table.row({escape(say(calib::phrase(result.cell, entry.level))), percent(share),
               fixed(entry.log_evidence - best, kEvidenceDecimals)});
  }
  if (result.levels.size() > count)
    table.row({counted(result.levels.size() - count, "say.report.levels.more."),
               percent(std::max(0.0, 1.0 - shown)), ""});
  return table.html() + paragraph("note", say("say.report.levels.note"));
}

}  // namespace

std::string parameters_table(const View& view) {
  const std::vector<Group> groups = group_by_owner(view, false);
  const std::vector<Group> waves = group_by_owner(view, true);
  if (groups.empty() && waves.empty()) {
    return section("parameters", "say.report.parameters",
                   paragraph("", say("say.report.parameters.none")));
  }
  const Ranges ranges = bar_ranges(groups);
  std::string body = paragraph(
      "note", say("say.report.parameters.note") + joint_range_words(ranges) + unstated_words(view));
  if (!groups.empty()) body += table_of(view, groups, ranges);
  body += positioner_table(view) + linear_unit_table(view);
  return section("parameters", "say.report.parameters",
                 body + waves_table(view, waves) + function_charts(view));
}

// Selected model, method, and how clearly the touches favour it over the others.

std::string method_words(std::string_view method) {
  return say_if("say.report.method.", std::string(method), escape(method));
}

std::string level_words(const View& view) {
  const calib::Calibration& result = view.result;
  // Methods without levels leave all three empty; the default level does not apply.
  if (result.level_reason.choice == calib::LevelChoice::kNone && result.levels.empty()) return {};
  return escape(say({"say.report.level", {{"level", calib::phrase(result.cell, result.level)}}}));
}

std::string model(const View& view) {
  const calib::Calibration& result = view.result;
  const std::string level = level_words(view);
  std::string body;
  if (!level.empty()) {
    body += paragraph("fitted", level);
    const std::string reason = sentence(calib::reason_phrase(result));
    if (!reason.empty()) body += paragraph("", reason);
  }
  const std::string method = method_words(result.method);
  body += paragraph(
      "",
      say({"say.report.method",
           {{"method", method.empty() ? "<em>" + say("say.report.not_stated") + "</em>" : method},
            {"note", say_if("say.report.method.", result.method + ".note")}}}));
  if (!level.empty()) body += levels_table(result) + parts();
  return section("model", "say.report.model", body);
}

}  // namespace cellcal::daemon::report

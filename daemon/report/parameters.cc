// Every identified parameter, grouped by joint, with a bar of its correction against its sigma.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/report/scale.h"
#include "daemon/report/sections.h"
#include "daemon/report/svg.h"
#include "daemon/report/text.h"

namespace cellcal::daemon::report {
namespace {

using calib::DecidedBy;
using calib::ParameterResult;

constexpr double kBarWidth = 150.0;
constexpr double kBarHeight = 16.0;
constexpr double kBarMiddle = 0.5 * kBarHeight;
constexpr double kBarEnd = 4.0;
constexpr double kBarSigmas = 2.0;
constexpr int kDegreeDecimals = 4;  // 0.0001 deg is 2 um at a metre
constexpr int kArcsecDecimals = 2;
constexpr int kOtherDigits = 4;
constexpr int kSigmaDigits = 2;

struct Group {
  std::string heading;
  bool joint = false;
  std::vector<const ParameterResult*> rows;
};

// Joints and targets are looked up by name, for a name may itself hold a dot.
std::pair<std::string, bool> owner_of(const View& view, std::string_view name) {
  for (const calib::Joint& joint : view.result.cell.robot.joints) {
    if (belongs_to(name, joint.name)) return {"Joint " + joint.name, true};
  }
  if (belongs_to(name, "tool")) return {"Tool", false};
  if (belongs_to(name, "touch")) return {"Touch", false};
  for (const calib::Target& target : view.result.cell.targets) {
    if (belongs_to(name, target.id)) return {"Target " + target.id, false};
  }
  return {"Other", false};
}

std::vector<Group> group_by_owner(const View& view) {
  std::vector<Group> groups;
  for (const ParameterResult& parameter : view.result.parameters) {
    const auto [heading, joint] = owner_of(view, parameter.name);
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

std::string_view meaning_of(std::string_view name) {
  const std::string_view last = name.substr(name.rfind('.') + 1);
  if (last == "theta") return "zero of the axis (mastering)";
  if (last == "d") return "offset along the axis";
  if (last == "a") return "length of the link";
  if (last == "alpha") return "twist of the link";
  if (last == "beta") return "tilt to the parallel axis";
  if (last == "compliance") return "yielding under torque";
  if (last.starts_with("cos") || last.starts_with("sin")) return "wave of the gear";
  if (last == "radius") return "correction of the radius";
  if (last == "c_t") return "bending";
  if (last == "rho") return "offset of the radius";
  if (last == "x" || last == "y" || last == "z") return "position";
  return {};
}

std::string in_unit(double value, const ParameterResult& parameter, bool with_sign,
                    int digits = kOtherDigits) {
  const double shown = value * parameter.to_unit;
  int decimals = -1;
  if (parameter.unit == "mm") decimals = kMmDecimals;
  if (parameter.unit == "deg") decimals = kDegreeDecimals;
  if (parameter.unit == "arcsec") decimals = kArcsecDecimals;
  if (decimals < 0) {
    const bool plus = with_sign && std::isfinite(shown) && shown > 0.0;
    return fmt::format("{}{}", plus ? "+" : "", significant(shown, digits));
  }
  return with_sign ? signed_fixed(shown, decimals) : fixed(shown, decimals);
}

// Bars are comparable within one unit over all joints, and within each other group.
using Ranges = std::map<std::string, double>;

std::string range_key(const Group& group, const ParameterResult& parameter) {
  return (group.joint ? "joints" : group.heading) + "\n" + parameter.unit;
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

// "1/(N m^2)" with a real exponent; units are plain ASCII in files.
std::string unit_html(std::string_view unit) {
  std::string html = escape(unit);
  for (std::size_t at = html.find("^2"); at != std::string::npos; at = html.find("^2")) {
    html.replace(at, 2, "&sup2;");
  }
  return html;
}

std::string_view decided_word(DecidedBy decided_by) {
  switch (decided_by) {
    case DecidedBy::kData:
      return "data";
    case DecidedBy::kPrior:
      return "prior";
    case DecidedBy::kFrame:
      return "frame";
  }
  return "data";
}

std::string parameter_row(const Group& group, const ParameterResult& parameter,
                          const Ranges& ranges) {
  const std::string_view decided = decided_word(parameter.decided_by);
  const auto range = ranges.find(range_key(group, parameter));
  return fmt::format(
      "<tr class=\"by-{}\"><th scope=\"row\"><code>{}</code> <small>{}</small></th><td>{}</td>"
      "<td>{}</td><td>{}</td><td class=\"word\">{}</td><td "
      "class=\"word\">{}</td><td>{}</td></tr>\n",
      decided, escape(parameter.name), meaning_of(parameter.name),
      in_unit(parameter.nominal, parameter, false), in_unit(parameter.correction, parameter, true),
      in_unit(parameter.sigma, parameter, false, kSigmaDigits), unit_html(parameter.unit), decided,
      bar(parameter, range == ranges.end() ? 0.0 : range->second));
}

std::string joint_range_words(const Ranges& ranges) {
  std::string words;
  for (const auto& [key, range] : ranges) {
    const std::size_t cut = key.find('\n');
    if (key.substr(0, cut) != "joints" || !(range > 0.0)) continue;
    words += fmt::format("{}&plusmn;{} {}", words.empty() ? "" : ", ", significant(range, 2),
                         unit_html(key.substr(cut + 1)));
  }
  return words.empty() ? words : fmt::format(" All joints share one scale per unit ({}).", words);
}

}  // namespace

std::string parameters_table(const View& view) {
  const std::vector<Group> groups = group_by_owner(view);
  if (groups.empty()) {
    return section("parameters", "Parameters", "<p>No parameter was identified.</p>\n");
  }
  const Ranges ranges = bar_ranges(groups);
  std::string rows;
  for (const Group& group : groups) {
    rows += fmt::format(
        "<tbody>\n<tr class=\"group\"><th scope=\"colgroup\" colspan=\"7\">{}</th></tr>\n",
        escape(group.heading));
    for (const ParameterResult* row : group.rows) rows += parameter_row(group, *row, ranges);
    rows += "</tbody>\n";
  }
  const std::string body = fmt::format(
      "<p class=\"note\">Decided by <strong>data</strong>: the touches outweigh the tolerance. "
      "<strong>Prior</strong>: the touches say little, the value stays near nominal by its "
      "manufacturing tolerance. <strong>Frame</strong>: tied to something that the touches cannot "
      "tell (see there), so its &sigma; is that of a convention. The bar shows the correction "
      "(dot, hollow where not decided by "
      "data) with &plusmn;2&sigma; (line) around zero.{}</p>\n"
      "<div class=\"scroll\"><table class=\"numbers parameters\">\n<thead><tr>"
      "<th scope=\"col\">parameter</th><th scope=\"col\">nominal</th>"
      "<th scope=\"col\">correction</th><th scope=\"col\">&sigma;</th>"
      "<th scope=\"col\" class=\"word\">unit</th><th scope=\"col\" class=\"word\">decided by</th>"
      "<th scope=\"col\">correction &plusmn; 2&sigma;</th></tr></thead>\n{}</table></div>\n",
      joint_range_words(ranges), rows);
  return section("parameters", "Parameters", body);
}

}  // namespace cellcal::daemon::report

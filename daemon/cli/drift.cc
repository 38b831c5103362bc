#include "daemon/cli/actions.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <vector>

#include "calib/result/drift_chart.h"
#include "calib/result/update.h"
#include "daemon/api/http/http.h"
#include "daemon/cli/offline.h"

namespace cellcal::daemon {

namespace {

using nlohmann::json;

constexpr std::size_t kColumns = 64, kRows = 9, kNewest = 12;

bool counts(const json& point) {
  return point.is_object() && text_in(point, "left_out").empty() &&
         point.value("off_mm", json()).is_array();
}

std::string component(const json& point, const char* key, std::size_t axis) {
  const auto found = point.find(key);
  if (found == point.end() || !found->is_array() || found->size() <= axis ||
      !(*found)[axis].is_number())
    return "-";
  return fmt::format("{:+.3f}", (*found)[axis].get<double>());
}

/// Statistic relative to its alarm limit over time: each column covers an equal interval and marks the
/// highest check in it.
std::string plot(const std::vector<json>& points) {
  std::vector<double> highest(kColumns, -1.0);
  const double from = number_in(points.front(), "time_s"), to = number_in(points.back(), "time_s");
  double most = 1.25;
  for (const json& point : points) {
    if (!counts(point)) continue;
    const double share = to > from ? (number_in(point, "time_s") - from) / (to - from) : 0.0;
    const auto column =
        static_cast<std::size_t>(std::clamp(share, 0.0, 1.0) * static_cast<double>(kColumns - 1));
    highest[column] = std::max(highest[column], number_in(point, "share"));
    most = std::max(most, highest[column]);
  }
  const auto row_of = [&](double share) {
    return static_cast<std::size_t>(
        std::clamp(share / most, 0.0, 1.0) * static_cast<double>(kRows - 1) + 0.5);
  };
  std::vector<std::string> rows(kRows, std::string(kColumns, ' '));
  rows[row_of(1.0)].assign(kColumns, '-');
  for (std::size_t column = 0; column < kColumns; ++column)
    if (highest[column] >= 0.0) rows[row_of(highest[column])][column] = 'o';
  std::string text;
  for (std::size_t row = kRows; row-- > 0;) {
    const std::string label = row == row_of(1.0) ? "alarm" : row == 0 ? "0" : "";
    text +=
        fmt::format("{:>6} |{}\n", label, rows[row].substr(0, rows[row].find_last_not_of(' ') + 1));
  }
  return text + fmt::format("{:>6} +{}\n{:>6}  {:<{}}{}\n", "", std::string(kColumns, '-'), "",
                            calib::date_words(from), kColumns - 10, calib::date_words(to));
}

/// State of a point, for display.
std::string state_words(const std::string& state) {
  return state == "too_few"      ? "too few to judge"
         : state == "in_control" ? "in control"
         : state == "warns"      ? "warning"
         : state == "alarms"     ? "ALARM"
                                 : state;
}

/// Reason why a point is not counted.
std::string left_out_words(const std::string& why) {
  return why == "not_the_tool" ? "not the tool" : why == "other_touches" ? "other touches" : why;
}

std::string row(const json& point) {
  const auto temperature = point.find("temperature_c");
  const std::string warm = temperature != point.end() && temperature->is_number()
                               ? fmt::format("{:.1f}", temperature->get<double>())
                               : "-";
  const std::string left_out = text_in(point, "left_out");
  const bool measured = left_out.empty() && point.value("off_mm", json()).is_array();
  const std::string state = state_words(text_in(point, "state"));
  return fmt::format("{:>6} {:<10} {:>6} {:>8} {:>8} {:>8} {:>7}  {}\n",
                     static_cast<std::int64_t>(number_in(point, "session")),
                     calib::date_words(number_in(point, "time_s")), warm,
                     component(point, "off_mm", 0), component(point, "off_mm", 1),
                     component(point, "off_mm", 2),
                     measured ? fmt::format("{:.0f}", 100.0 * number_in(point, "share")) : "-",
                     left_out.empty() ? state : state + ", left out: " + left_out_words(left_out));
}

/// Changes of the cell that the checks are read with.
std::string events_text(const json& checks) {
  std::string text;
  for (const json& one : checks.value("events", json::array()))
    if (one.is_object()) {
      const double time_s = number_in(one, "time_s");
      text += fmt::format("{:<10}  {}\n", time_s > 0.0 ? calib::date_words(time_s) : "-",
                          text_in(one, "words"));
    }
  return text.empty() ? text : "\nchanges of the cell:\n" + text;
}

}  // namespace

std::string update_line(const json& update) {
  if (!update.is_object()) return {};
  const auto outcome = by_own_name<calib::UpdateOutcome>(text_in(update, "outcome"));
  std::string text = fmt::format(
      "{} {}, {} touches",
      outcome == calib::UpdateOutcome::kUpdated ? "an update of" : "no update of",
      text_in(update, "stands_on"), static_cast<std::int64_t>(number_in(update, "touches")));
  const json explanations = update.value("explanations", json::array());
  if (outcome == calib::UpdateOutcome::kUpdated && !explanations.empty())
    text += ": " + text_in(explanations.front(), "words");
  return text + "\n";
}

std::string drift_text(const json& checks) {
  if (!checks.is_object())
    return "no published calibration, so nothing to check. Calibrate first: 'cellcal run'\n";
  std::string text = fmt::format("checks of the calibration of session {} ({})\n",
                                 static_cast<std::int64_t>(number_in(checks, "calibration")),
                                 text_in(checks, "calibrated"));
  for (const json& line : checks.value("words", json::array()))
    if (line.is_string()) text += line.get<std::string>() + "\n";
  std::vector<json> points;
  for (const json& point : checks.value("points", json::array()))
    if (point.is_object()) points.push_back(point);
  if (points.empty()) return text + events_text(checks);
  if (std::ranges::count_if(points, counts) > 1) text += "\n" + plot(points);
  text += fmt::format("\n{:>6} {:<10} {:>6} {:>8} {:>8} {:>8} {:>7}  {}\n", "check", "ended",
                      "deg C", "x mm", "y mm", "z mm", "alarm %", "state");
  for (std::size_t k = points.size() - std::min(points.size(), kNewest); k < points.size(); ++k)
    text += row(points[k]);
  return text + events_text(checks);
}

std::string acknowledged_text(const json& controller) {
  if (!controller.is_object()) return {};
  std::string text;
  const auto value = controller.find("value");
  if (value != controller.end() && value->is_number_integer())
    text += fmt::format("CELLCAL_ADVICE on the controller: {} ({}), since {}\n",
                        value->get<std::int64_t>(), text_in(controller, "told"),
                        text_in(controller, "told_at"));
  if (const std::string trouble = text_in(controller, "trouble"); !trouble.empty())
    text += "CELLCAL_ADVICE not confirmed: " + trouble + "\n";
  return text;
}

int show_drift(const Connection& daemon) {
  const json answer = parse(ask(daemon, "GET", "/v1/drift"));
  const json checks = answer.value("checks", json());
  std::string update;
  if (!daemon.json && checks.is_object()) {
    const Response calibration =
        http_request(daemon.socket, "GET",
                     fmt::format("/v1/sessions/{}/calibration.json",
                                 static_cast<std::int64_t>(number_in(checks, "calibration"))));
    if (calibration.status == 200) update = update_line(parse(calibration).value("update", json()));
  }
  put(daemon.json ? checks.dump() + "\n"
                  : (update.empty() ? "" : "the calibration is " + update) + drift_text(checks) +
                        acknowledged_text(answer.value("controller", json())),
      {});
  return checks.is_object() && text_in(checks, "state") == "alarms" ? kNotPublishable : kSuccess;
}

}  // namespace cellcal::daemon

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <vector>

#include "calib/files/calibration_json.h"
#include "calib/result/drift_chart.h"
#include "calib/result/finding_phrase.h"
#include "calib/result/update.h"
#include "daemon/api/http/http.h"
#include "daemon/cli/actions.h"
#include "daemon/cli/commands.h"
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
    const std::string label = row == row_of(1.0) ? say("say.cli.drift.alarm") : row == 0 ? "0" : "";
    text +=
        fmt::format("{:>6} |{}\n", label, rows[row].substr(0, rows[row].find_last_not_of(' ') + 1));
  }
  return text + fmt::format("{:>6} +{}\n{:>6}  {:<{}}{}\n", "", std::string(kColumns, '-'), "",
                            calib::date_words(from), kColumns - 10, calib::date_words(to));
}

/// A name of the API in words; itself where this version does not know it.
std::string named(const char* prefix, const std::string& name) {
  const std::string id = prefix + name;
  return calib::sentence_of(id) ? say(id) : name;
}

/// State of a check, and why it is not counted.
std::string state_of(const json& point) {
  const std::string state = named("say.cli.drift.state.", text_in(point, "state"));
  const std::string why = text_in(point, "left_out");
  if (why.empty()) return state;
  return say({"say.cli.drift.left_out",
              {{"state", state}, {"why", named("say.cli.drift.left_out.", why)}}});
}

std::string row(const json& point) {
  const auto temperature = point.find("temperature_c");
  const std::string warm = temperature != point.end() && temperature->is_number()
                               ? fmt::format("{:.1f}", temperature->get<double>())
                               : "-";
  return fmt::format("{:>6} {:<10} {:>6} {:>8} {:>8} {:>8} {:>7}  {}\n",
                     static_cast<std::int64_t>(number_in(point, "session")),
                     calib::date_words(number_in(point, "time_s")), warm,
                     component(point, "off_mm", 0), component(point, "off_mm", 1),
                     component(point, "off_mm", 2),
                     counts(point) ? fmt::format("{:.0f}", 100.0 * number_in(point, "share")) : "-",
                     state_of(point));
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
  return text.empty() ? text : "\n" + said("say.cli.drift.events") + text;
}

}  // namespace

calib::Phrase update_phrase(const calib::UpdateOrigin& update) {
  const bool updated = update.outcome == calib::UpdateOutcome::kUpdated;
  const calib::Phrase made{
      updated ? "say.cli.update.made" : "say.cli.update.none",
      {{"last", calib::calibration_phrase(update.stands_on)}, {"n", update.touches}}};
  if (!updated || update.explanations.empty()) return made;
  return calib::joined("say.join.colon", made, calib::phrase(update.explanations.front()));
}

std::string drift_text(const json& checks) {
  if (!checks.is_object()) return said("say.cli.drift.none");
  std::string text =
      said({"say.cli.drift.head",
            {{"session", static_cast<std::int64_t>(number_in(checks, "calibration"))},
             {"date", text_in(checks, "calibrated")}}});
  for (const json& line : checks.value("words", json::array()))
    if (line.is_string()) text += line.get<std::string>() + "\n";
  std::vector<json> points;
  for (const json& point : checks.value("points", json::array()))
    if (point.is_object()) points.push_back(point);
  if (points.empty()) return text + events_text(checks);
  if (std::ranges::count_if(points, counts) > 1) text += "\n" + plot(points);
  text += "\n" + said("say.cli.drift.columns");
  for (std::size_t k = points.size() - std::min(points.size(), kNewest); k < points.size(); ++k)
    text += row(points[k]);
  return text + events_text(checks);
}

std::string acknowledged_text(const json& controller) {
  if (!controller.is_object()) return {};
  std::string text;
  const auto value = controller.find("value");
  if (value != controller.end() && value->is_number_integer())
    text += said({"say.cli.drift.advice",
                  {{"value", value->get<std::int64_t>()},
                   {"holding", text_in(controller, "told")},
                   {"since", text_in(controller, "told_at")}}});
  if (const std::string trouble = text_in(controller, "trouble"); !trouble.empty())
    text += said({"say.cli.drift.trouble", {{"words", trouble}}});
  return text;
}

std::optional<calib::UpdateOrigin> update_of(const Connection& daemon, std::int64_t session) {
  const Response calibration =
      http_request(daemon.socket, "GET", fmt::format("/v1/sessions/{}/calibration.json", session));
  if (calibration.status != 200) return std::nullopt;
  return calib::calibration_from_json(calibration.body, "the daemon's calibration").update;
}

int show_drift(const Connection& daemon) {
  const json answer = get(daemon, "/v1/drift");
  const json checks = answer.value("checks", json());
  std::string update;
  if (!daemon.json && checks.is_object())
    if (const auto of =
            update_of(daemon, static_cast<std::int64_t>(number_in(checks, "calibration"))))
      update = said({"say.cli.drift.update", {{"words", update_phrase(*of)}}});
  put(daemon.json
          ? checks.dump() + "\n"
          : update + drift_text(checks) + acknowledged_text(answer.value("controller", json())),
      {});
  return checks.is_object() && text_in(checks, "state") == "alarms" ? kNotPublishable : kSuccess;
}

}  // namespace cellcal::daemon

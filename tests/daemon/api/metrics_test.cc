// Metrics compared with Prometheus' text format and with the dashboard that displays them.

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <sstream>

#include "daemon/api/handlers.h"

namespace cellcal::daemon {
namespace {

struct Scraped {
  std::map<std::string, std::string> types;  // by family
  std::map<std::string, double> samples;     // by name and labels, as written
  std::string wrong;                         // empty: well formed
};

/// Strict: help, type and samples of a family together and once, valid names and labels, no duplicate samples.
Scraped scrape(const std::string& text) {
  static const std::regex comment("# (HELP|TYPE) ([a-zA-Z_:][a-zA-Z0-9_:]*) (.+)");
  static const std::regex sample(
      "([a-zA-Z_:][a-zA-Z0-9_:]*)(\\{([a-zA-Z_][a-zA-Z0-9_]*=\"([^\"\\\\\\n]|\\\\[\\\\\"n])*\",?)+\\})? "
      "([-+]?[0-9.]+(e[-+]?[0-9]+)?|NaN|[+-]Inf)");
  Scraped scraped;
  std::string family, type, line;
  std::set<std::string> helped;
  const auto fail = [&] { scraped.wrong += line + "\n"; };
  if (text.empty() || text.back() != '\n') scraped.wrong = "no line end at the end";
  for (std::istringstream lines(text); std::getline(lines, line);) {
    std::smatch match;
    if (std::regex_match(line, match, comment)) {
      if (match[1] == "HELP" && !helped.insert(match[2]).second) fail();
      if (match[1] == "HELP") family = match[2];
      if (match[1] == "TYPE" && (match[2] != family || scraped.types.contains(family))) fail();
      if (match[1] == "TYPE") scraped.types[family] = type = match[3];
    } else if (std::regex_match(line, match, sample)) {
      const std::string name = match[1];
      const bool adds_up = type == "summary" || type == "histogram";
      const bool counts = adds_up && (name == family + "_count" || name == family + "_sum");
      const bool bucket = type == "histogram" && name == family + "_bucket" &&
                          line.find("{le=\"") != std::string::npos;
      if ((type == "histogram" || name != family) && !counts && !bucket) fail();
      if (type == "counter" && !name.ends_with("_total")) fail();
      if (type == "summary" && !counts && line.find("quantile=\"") == std::string::npos) fail();
      if (!scraped.samples.emplace(name + match[2].str(), std::stod(match[5])).second) fail();
    } else {
      fail();
    }
  }
  return scraped;
}

Status busy() {
  Status status;
  status.session = 7;
  status.phase = Phase::kSlowSearch;
  status.done = 12;
  status.total = 40;
  status.residual_m = 3.4e-5;
  status.failure = Failure{FailureKind::kUnexpectedEvent, "x"};
  LinkReport links;
  links.open = true;
  links.robot.late = 3;
  links.robot.packets = 123456789;
  for (const double s : {4e-5, 1.25e-4, 1.25e-4, 3e-3, 0.2}) links.robot.quality.reply_times.add(s);
  links.contact.quality.late_times.add(2e-3);
  links.contact.quality.late_worst_s = std::nan("");
  status.links = std::make_shared<const LinkReport>(links);
  return status;
}

TEST(TheMetrics, AreWellFormedAlsoWhereNextToNothingIsKnown) {
  EXPECT_EQ(scrape(metrics_text({}, {}, nullptr)).wrong, "");
  EXPECT_EQ(scrape(metrics_text(busy(), {}, nullptr)).wrong, "");
}

TEST(TheMetrics, SayWhatStatusAndJournalSayInBaseUnits) {
  std::vector<SessionRecord> sessions(3);
  sessions[0].state = RecordState::kFailed;
  sessions[1].state = sessions[2].state = RecordState::kDone;
  sessions[1].touches = 40;
  sessions[2].touches = 2;
  auto samples = scrape(metrics_text(busy(), sessions, nullptr)).samples;
  EXPECT_EQ(samples["cellcal_session_running"], 1.0);
  EXPECT_EQ(samples["cellcal_session_touches"], 12.0);
  EXPECT_DOUBLE_EQ(samples["cellcal_session_residual_meters"], 3.4e-5);
  EXPECT_EQ(samples["cellcal_phase{phase=\"slow search\"}"], 1.0);
  EXPECT_EQ(samples.at("cellcal_phase{phase=\"idle\"}"), 0.0);
  EXPECT_EQ(samples["cellcal_robot_late_replies_total"], 3.0);
  EXPECT_EQ(samples["cellcal_robot_packets_total"], 123456789.0);
  EXPECT_EQ(samples.at("cellcal_robot_reply_seconds_bucket{le=\"5e-05\"}"), 1.0);
  EXPECT_EQ(samples.at("cellcal_robot_reply_seconds_bucket{le=\"0.0002\"}"), 3.0);
  EXPECT_EQ(samples.at("cellcal_robot_reply_seconds_bucket{le=\"0.004\"}"), 4.0);
  EXPECT_EQ(samples.at("cellcal_robot_reply_seconds_bucket{le=\"+Inf\"}"), 5.0);
  EXPECT_EQ(samples.at("cellcal_robot_reply_seconds_count"), 5.0);
  EXPECT_NEAR(samples.at("cellcal_robot_reply_seconds_sum"), 0.20329, 1e-9);
  EXPECT_EQ(samples.at("cellcal_contact_late_seconds_bucket{le=\"0.001\"}"), 0.0);
  EXPECT_EQ(samples.at("cellcal_contact_late_seconds_bucket{le=\"0.002\"}"), 1.0);
  EXPECT_EQ(samples["cellcal_sessions{state=\"done\"}"], 2.0);
  EXPECT_EQ(samples["cellcal_sessions{state=\"failed\"}"], 1.0);
  EXPECT_EQ(samples["cellcal_touches_total"], 42.0);
  EXPECT_TRUE(std::isnan(samples["cellcal_contact_late_worst_seconds"]));
  EXPECT_FALSE(samples.contains("cellcal_session_u95_meters")) << "not known";
}

TEST(TheMetrics, LeaveOutWhatASilentSensorHasNotSent) {
  for (const char* name :
       {"cellcal_contact_closed", "cellcal_contact_loop_ok", "cellcal_contact_round_trip_seconds",
        "cellcal_contact_clock_sigma_seconds"})
    EXPECT_FALSE(scrape(metrics_text(busy(), {}, nullptr)).types.contains(name)) << name;
  LinkReport links;
  links.contact.loop_ok = false;
  Status status = busy();
  status.links = std::make_shared<const LinkReport>(links);
  EXPECT_EQ(scrape(metrics_text(status, {}, nullptr)).samples.at("cellcal_contact_loop_ok"), 0.0);
}

TEST(TheMetrics, HaveZerosAndAccuracyOfTheCalibrationInUseWithNamesEscaped) {
  calib::Calibration used;
  used.cell.robot.joints.resize(1);
  used.cell.robot.joints[0].name = "A\"1\\\n";
  used.cell.robot.joints[0].sign = -1;
  used.predicted_workspace_m = 1e-4;
  calib::ParameterResult zero;
  zero.key.kind = calib::ParameterKind::kTheta;
  zero.key.joint = 0;
  zero.correction = 0.01;
  used.parameters.push_back(zero);
  calib::Calibration withheld = used;
  withheld.parameters[0].correction = 0.5;
  withheld.predicted_workspace_m = 9.0;
  const Scraped scraped = scrape(metrics_text({}, {}, &withheld, &used));
  EXPECT_EQ(scraped.wrong, "");
  EXPECT_NEAR(scraped.samples.at("cellcal_joint_zero_degrees{joint=\"A\\\"1\\\\\\n\"}"), -0.57296,
              1e-5);
  EXPECT_EQ(scraped.samples.at("cellcal_calibration_error_meters{over=\"workspace\"}"), 1e-4);
  const Scraped nothing_used = scrape(metrics_text({}, {}, &withheld));
  EXPECT_FALSE(nothing_used.types.contains("cellcal_calibration_error_meters"));
}

TEST(TheDashboard, AsksForMetricsThatThereAre) {
  calib::Calibration newest;
  newest.check.count = 1;
  Status status = busy();
  status.u95_m = status.goal_m = status.time_left_s = status.arm.packet_age_s = 1.0;
  LinkReport links = *status.links;
  links.contact.in_contact = links.contact.loop_ok = true;
  links.contact.quality.round_trip.emplace();
  links.contact.quality.clock_sigma_s = 2e-5;
  status.links = std::make_shared<const LinkReport>(links);
  calib::DriftChart chart;
  chart.points.resize(1);
  chart.counted = 1;
  const auto types = scrape(metrics_text(status, {}, &newest, &newest, &chart)).types;
  std::ifstream file(CELLCAL_DASHBOARD);
  const auto dashboard = nlohmann::json::parse(file);
  std::set<std::string> asked;
  for (const auto& panel : dashboard.at("panels")) {
    for (const auto& target : panel.value("targets", nlohmann::json::array())) {
      const std::string query = target.at("expr");
      const std::regex name("cellcal_[a-z0-9_]+");
      for (std::sregex_iterator one(query.begin(), query.end(), name), end; one != end; ++one) {
        const std::string family = std::regex_replace(one->str(), std::regex("_bucket$"), "");
        EXPECT_TRUE(types.contains(family)) << one->str();
        EXPECT_EQ(types.at(family) == "histogram", family != one->str()) << query;
        asked.insert(family);
      }
    }
  }
  EXPECT_GE(asked.size(), 10u);
  for (const char* shown :
       {"cellcal_session_outcome", "cellcal_session_interruptions", "cellcal_session_busy_repeats",
        "cellcal_arm_motion", "cellcal_robot_packet_age_seconds"})
    EXPECT_TRUE(asked.contains(shown)) << shown;
}

}  // namespace
}  // namespace cellcal::daemon

#include "daemon/doctor/link_words.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <cmath>
#include <ctime>
#include <nlohmann/json.hpp>

namespace cellcal::daemon {

namespace {

using nlohmann::json;

double link_figure(const json& value, const char* key) {
  const auto found = value.find(key);
  return found != value.end() && found->is_number() ? found->get<double>() : 0.0;
}

std::string robot_words(const json& robot) {
  std::string words = fmt::format(
      "robot link: cycle {:.2f} ms, jitter {:.2f} ms, longest {:.1f} ms; {:.0f} packets, "
      "{:.0f} missing, {:.0f} damaged",
      link_figure(robot, "cycle_ms"), link_figure(robot, "jitter_ms"),
      link_figure(robot, "longest_gap_ms"), link_figure(robot, "packets"),
      link_figure(robot, "gaps"), link_figure(robot, "bad_packets"));
  const json mode = robot.value("mode", json()), percent = robot.value("override_percent", json());
  if (mode.is_string() && mode != "unknown") words += "; mode " + mode.get<std::string>();
  if (percent.is_number()) words += fmt::format("; override {:.0f} %", percent.get<double>());
  const json reply = robot.value("reply_ms", json());
  if (link_figure(robot, "replies") > 0.0 && reply.is_object()) {
    words += fmt::format("; replies p50 {:.2f} ms, p99 {:.2f} ms, longest {:.2f} ms, {:.0f} late",
                         link_figure(reply, "p50"), link_figure(reply, "p99"),
                         link_figure(reply, "max"), link_figure(robot, "late"));
  }
  return words + "\n";
}

std::string contact_words(const json& contact) {
  const json trip = contact.value("round_trip_ms", json::object());
  const json late = contact.value("late_ms", json::object());
  const json firmware = contact.value("firmware", json());
  return fmt::format(
      "contact link: firmware {}, boot id {:.0f}; {:.0f} frames, {:.0f} damaged, {:.0f} "
      "missing; round trip {:.2f} ms, p99 {:.2f} ms; clock +- {:.1f} us, drift {:.1f} ppm; "
      "late on this computer {:.2f} ms (median), {:.1f} ms at worst (limit {:.0f} ms)\n",
      firmware.is_string() ? firmware.get<std::string>() : "unknown",
      link_figure(contact, "boot_id"), link_figure(contact, "frames"),
      link_figure(contact, "crc_errors"), link_figure(contact, "gaps"), link_figure(trip, "p50"),
      link_figure(trip, "p99"), link_figure(contact, "clock_sigma_us"),
      link_figure(contact, "clock_drift_ppm"), link_figure(late, "p50"), link_figure(late, "worst"),
      link_figure(late, "limit"));
}

std::string local_time(std::time_t when) {
  std::tm day{};
  return fmt::format("{:%H:%M:%S}", *::localtime_r(&when, &day));
}

}  // namespace

std::string arm_words(const json& arm) {
  if (!arm.is_object()) return "";
  const json motion = arm.value("motion", json()), packet_age_s = arm.value("packet_age_s", json());
  if (!packet_age_s.is_number()) return "arm: unknown, no packet from the controller\n";
  const double age_s = packet_age_s.get<double>();
  if (motion == "moving" || motion == "at rest")
    return fmt::format("arm: {} (packet {:.1f} s old)\n", motion.get<std::string>(), age_s);
  return fmt::format("arm: unknown since {}, newest packet {:.0f} s old. Look at the robot\n",
                     local_time(std::time(nullptr) - std::lround(age_s)), age_s);
}

std::string link_words(const json& links) {
  if (!links.is_object()) return "";
  std::string words;
  const json robot = links.value("robot", json()), contact = links.value("contact", json());
  if (robot.is_object() && link_figure(robot, "packets") > 0.0) words += robot_words(robot);
  if (contact.is_object() && link_figure(contact, "frames") > 0.0) words += contact_words(contact);
  return words;
}

}  // namespace cellcal::daemon

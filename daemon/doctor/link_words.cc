#include "daemon/doctor/link_words.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

namespace cellcal::daemon {

namespace {

using nlohmann::json;

double figure(const json& value, const char* key) {
  const auto found = value.find(key);
  return found != value.end() && found->is_number() ? found->get<double>() : 0.0;
}

std::string robot_words(const json& robot) {
  std::string words = fmt::format(
      "robot link: cycle {:.2f} ms, jitter {:.2f} ms, longest {:.1f} ms; {:.0f} packets, "
      "{:.0f} missing, {:.0f} damaged",
      figure(robot, "cycle_ms"), figure(robot, "jitter_ms"), figure(robot, "longest_gap_ms"),
      figure(robot, "packets"), figure(robot, "gaps"), figure(robot, "bad_packets"));
  const json reply = robot.value("reply_ms", json());
  if (figure(robot, "replies") > 0.0 && reply.is_object()) {
    words += fmt::format("; replies p50 {:.2f} ms, p99 {:.2f} ms, longest {:.2f} ms, {:.0f} late",
                         figure(reply, "p50"), figure(reply, "p99"), figure(reply, "max"),
                         figure(robot, "late"));
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
      firmware.is_string() ? firmware.get<std::string>() : "unknown", figure(contact, "boot_id"),
      figure(contact, "frames"), figure(contact, "crc_errors"), figure(contact, "gaps"),
      figure(trip, "p50"), figure(trip, "p99"), figure(contact, "clock_sigma_us"),
      figure(contact, "clock_drift_ppm"), figure(late, "p50"), figure(late, "worst"),
      figure(late, "limit"));
}

}  // namespace

std::string link_words(const json& links) {
  if (!links.is_object()) return "";
  std::string words;
  const json robot = links.value("robot", json()), contact = links.value("contact", json());
  if (robot.is_object() && figure(robot, "packets") > 0.0) words += robot_words(robot);
  if (contact.is_object() && figure(contact, "frames") > 0.0) words += contact_words(contact);
  return words;
}

}  // namespace cellcal::daemon

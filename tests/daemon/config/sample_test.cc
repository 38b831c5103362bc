// The shipped configuration has every key of the parser, each with its default.

#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>

#include "daemon/config/config.h"
#include "tests/daemon/config/reason.h"

namespace cellcal::daemon {
namespace {

using testing::reason;

using Keys = std::map<std::string, std::set<std::string>>;  // by table

std::string sample() {
  std::ifstream file(CELLCAL_SAMPLE);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

/// With every default uncommented: "#port = 1" becomes "port = 1".
std::string spelled_out() {
  return std::regex_replace(sample(), std::regex("(^|\n)#([a-z0-9_]+ = )"), "$1$2");
}

Keys keys_of(const std::string& text) {
  Keys keys;
  std::string table, line;
  std::smatch match;
  for (std::istringstream lines(text); std::getline(lines, line);) {
    if (std::regex_search(line, match, std::regex("^\\[{1,2}([a-z.]+)\\]")))
      table = match[1];
    else if (std::regex_search(line, match, std::regex("^([a-z0-9_]+) = ")))
      keys[table].insert(match[1]);
  }
  return keys;
}

constexpr const char* kScheduled = "schedule.session";

/// Keys known to the parser in a table, or the tables and keys at the top.
std::set<std::string> known(const std::string& table) {
  const std::string top = "format = \"cellcal.daemon/1\"\nbackend = \"rsi\"\n";
  const std::string contact = "[contact]\ndevice = \"/dev/x\"\n";
  const std::string wrong = "no_such_key = 1\n";
  const std::string text = table.empty()         ? top + wrong + contact
                           : table == "contact"  ? top + contact + wrong
                           : table == kScheduled ? top + contact + "[[" + table +
                                                       "]]\nname = \"n\"\ncell = \"/c\"\n" +
                                                       "from = \"22:00\"\nto = \"05:00\"\n" + wrong
                                                 : top + contact + "[" + table + "]\n" + wrong;
  const std::string message = reason(text);
  const std::string mark = "known here are: ";
  const std::size_t at = message.find(mark);
  EXPECT_NE(at, std::string::npos) << table << ": " << message;
  std::set<std::string> names;
  const std::string list = message.substr(at + mark.size());
  const std::regex word("[a-z0-9_]+");
  for (std::sregex_iterator one(list.begin(), list.end(), word), end; one != end; ++one)
    names.insert(one->str());
  return names;
}

TEST(TheShippedConfiguration, IsValidAsItIsAndWithEveryDefaultSpelledOut) {
  EXPECT_EQ(reason(sample()), "accepted");
  EXPECT_EQ(reason(spelled_out()), "accepted");
}

TEST(TheShippedConfiguration, HasEveryKeyThatTheParserKnowsAndNoOther) {
  Keys keys = keys_of(spelled_out());
  std::set<std::string> top = keys.at("");
  for (const auto& [table, names] : keys) {
    if (table.empty()) continue;
    if (table.find('.') == std::string::npos) top.insert(table);
    std::set<std::string> all = known(table);
    if (table == "schedule") all.erase("session");  // a table of its own
    EXPECT_EQ(names, all) << table;
  }
  EXPECT_EQ(top, known(""));
}

template <typename... T>
std::string line(const char* table, const T&... values) {
  std::ostringstream text;
  text.precision(17);
  text << table;
  ((text << ' ' << values), ...);
  return text.str() + "\n";
}

/// All values set by the file.
std::string figures(const DaemonConfig& c) {
  std::string text = line("top", static_cast<int>(c.backend), c.state_dir, c.socket, c.log_debug);
  if (const auto& http = c.http) {
    text += line("http", http->address, http->port, http->tls_certificate, http->tls_key);
    for (const std::string& name : http->host_names) text += line("host", name);
    for (const auto& folder : http->cell_folders) text += line("cells", folder);
  }
  text += line("motion", c.motion.speed_fraction, c.motion.acceleration_rad_s2,
               c.motion.hand_speed_m_s, c.motion.jerk_rad_s3, c.motion.travel_acceleration_m_s2,
               c.motion.travel_jerk_m_s3, c.motion.positioner_speed_rad_s,
               c.motion.positioner_acceleration_rad_s2, c.motion.positioner_jerk_rad_s3,
               c.touch.confirm_every, c.touch.fast_m_s, c.touch.slow_m_s);
  text += line("session", c.timeouts.connecting.count(), c.retries, c.repeats.of_touch,
               c.repeats.of_session, c.timeouts.busy.count());
  const ScheduleConfig& n = c.schedule;
  text += line("schedule", n.unattended, n.responsible, static_cast<int>(n.program_start),
               n.resumes, n.resume_wait_s);
  for (const ScheduledSession& one : n.sessions) {
    text += line("scheduled", one.name, one.kind, one.cell, one.window.from_min, one.window.to_min,
                 one.on_request, one.touches.value_or(0), one.check.value_or(0),
                 one.goal_mm.value_or(0.0), one.load, one.minutes.value_or(0.0));
    for (const bool day : one.window.days) text += line("day", day);
  }
  text += line("retention", c.retain_days.value_or(0), c.retain_megabytes.value_or(0.0));
  text += line("language", c.language.code(), c.notify.language.code());
  if (const auto& hook = c.notify.webhook) {
    text += line("webhook", hook->url.tls, hook->url.host, hook->url.port, hook->url.target,
                 hook->secret_file, hook->ca, hook->timeout_s, hook->retries);
  }
  if (const auto& mail = c.notify.mail) {
    text += line("mail", mail->from, mail->program);
    for (const std::string& one : mail->to) text += line("to", one);
    if (const auto& s = mail->server)
      text +=
          line("server", s->tls, s->starttls, s->host, s->port, s->user, s->password_file, s->ca);
  }
  if (const auto& p = c.plant) {
    text += line("plant", p->plant, p->cell, p->host, p->port, p->tls, p->ca, p->certificate,
                 p->key, p->user, p->password_file, p->former.empty() ? "" : p->former.front(),
                 p->accept.empty() ? "" : p->accept.front(), p->touches, p->health_minutes,
                 p->outbox_megabytes, p->sparkplug);
  }
  const drivers::RsiConfig& r = c.rsi;
  text += line("rsi", r.bind_address, r.port, r.sentype, r.axis_tag, r.external_axis_tag,
               r.stop_tag, r.mode_tag, r.override_tag, r.contact_tag, static_cast<int>(r.mode),
               r.hold_on, r.longest_lag_s, r.silence_cycles, r.late_replies_limit,
               r.correction_limit_deg.at(0), c.realtime);
  text += line("space", r.space.on, r.space.tag, static_cast<int>(r.space.frame), r.space.limit_mm,
               r.space.turn_limit_deg);
  const drivers::EkiConfig& e = c.eki;
  text += line("eki", e.address, e.port, static_cast<int>(e.stop), e.silence_s, e.latch_delay_s,
               e.latch_jitter_s, e.flag_sigma_s);
  const drivers::EkiFilesConfig& k = c.controller;
  text += line("controller", k.external_axes, k.input, k.contact_is_on, k.tool, k.base, k.load,
               k.acceleration_percent, k.alive_flag, k.stop_flag, k.first_timer, k.first_interrupt,
               k.state_ms, k.dead_man_ms, k.may_run, k.cell_wait_s, k.brake_test_output,
               k.mastering_test_output, k.collision_output, k.write_frames, k.write_advice,
               c.rsi_files.pc_address, c.rsi_files.rsi_version, c.rsi_files.timeout_cycles,
               c.rsi_files.flag);
  text += line("contact", c.contact.device, c.contact.baud, static_cast<int>(c.isolation));
  const MockConfig& m = c.mock;
  text +=
      line("mock", static_cast<int>(m.wire), m.seed, m.geometry_scale, m.deflection, m.gear_arcsec,
           m.wave_arcsec, m.compliance_rad_per_nm, m.play_arcsec, m.tip_offset_m, m.growth,
           m.warm_up_s, m.contact_noise_m, m.bad_contact_share, m.placement_m, m.joint_noise_deg,
           m.lag_s, m.cycle_ms, m.busy_every_s, m.wall_clock, m.absolute_accuracy, m.stated_robot);
  for (const double m_stated : m.stated_tool_m) text += line("stated tool", m_stated);
  for (const double rad : m.start_rad) text += line("start", rad);
  text += line("start", m.start_m.value_or(0.0));
  for (const double m_off : m.tool_shift_m) text += line("tool shift", m_off);
  return text;
}

/// The values with another value of this key; empty if none of those tried is accepted.
std::string with_another(const std::string& text, const std::string& table,
                         const std::string& key) {
  std::size_t from =
      table.empty() ? 0
                    : std::min(text.find("\n[" + table + "]"), text.find("\n[[" + table + "]]"));
  from = text.find("\n" + key + " = ", from) + key.size() + 4;
  const std::string rest = text.substr(text.find_first_of("\n#", from));
  for (const char* value : {"1.5",
                            "3",
                            "12",
                            "300",
                            "0.0001",
                            "250000",
                            "1100",
                            "true",
                            "false",
                            "\"flag\"",
                            "\"relay\"",
                            "\"eki\"",
                            "\"cell\"",
                            "\"debug\"",
                            "\"relative\"",
                            "\"space\"",
                            "\"tool\"",
                            "\"off\"",
                            "\"10.9.8.7\"",
                            "\"/x/y\"",
                            "\"Xy\"",
                            "[1, 2]",
                            "[\"check\"]",
                            "[\"graz/weld-2\"]",
                            "[1, 2, 3]",
                            "\"127.0.0.1:9\"",
                            "\"on request\"",
                            "\"de\"",
                            "\"https://a.b/c\"",
                            "\"smtp://a:9\"",
                            "\"a@b\"",
                            "[\"a@b\"]",
                            "\"23:45\"",
                            "[\"sun\"]",
                            "[\"x\"]",
                            "[\"/x\"]"}) {
    const std::string other = text.substr(0, from) + value + "  " + rest;
    if (reason(other) != "accepted") continue;
    std::string changed = figures(parse_config(other, "d.toml"));
    if (changed != figures(parse_config(text, "d.toml"))) return changed;
  }
  return {};
}

TEST(TheShippedConfiguration, StatesDefaultsAlone) {
  // Keys whose default is another key's value, or none, show an example.
  std::string text = std::regex_replace(spelled_out(), std::regex("\npc_address = [^\n]*"), "");
  for (const char* table : {"http", "notify", "plant", kScheduled}) {
    const std::set<std::string> examples = keys_of(text).at(table);
    const std::size_t from = text.find("[" + std::string(table) + "]");
    const std::size_t end = std::min(text.find("\n[", from), text.size());
    std::string part = text.substr(from, end - from);
    for (const std::string& key : examples)
      part = std::regex_replace(part, std::regex("\n" + key + " = [^\n]*"), "");
    text.replace(from, end - from, part);
  }
  EXPECT_EQ(figures(parse_config(text, "d.toml")), figures(parse_config(sample(), "d.toml")));
}

TEST(TheShippedConfiguration, IsComparedInEveryKey) {
  const std::string text = spelled_out();
  // Some are refused without each other, the unused wire has no effect, and allow_plain affects only the
  // acceptance of the file.
  const std::set<std::string> excused{"format",
                                      "rsi.contact_tag",
                                      "rsi.mode",
                                      "rsi.hold_on",
                                      "eki.realtime",
                                      "http.allow_plain",
                                      "notify.mail_starttls",
                                      "plant.allow_plain",
                                      "plant.tls",
                                      "schedule.unattended",
                                      "schedule.session.kind"};
  for (const auto& [table, names] : keys_of(text)) {
    for (const std::string& key : names) {
      const std::string name = table.empty() ? key : table + "." + key;
      if (excused.contains(name)) continue;
      EXPECT_FALSE(with_another(text, table, key).empty()) << name;
    }
  }
}

}  // namespace
}  // namespace cellcal::daemon

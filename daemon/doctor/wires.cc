// Sensor and controller on their wires, through the adapters used by sessions.

#include "daemon/doctor/wires.h"

#include <fmt/chrono.h>

#include <array>
#include <chrono>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <thread>

#include "daemon/api/http/http.h"
#include "daemon/config/config.h"
#include "daemon/doctor/doctor.h"
#include "daemon/doctor/robot_check.h"
#include "daemon/runner/stated_poses.h"
#include "daemon/session/driver_phrase.h"
#include "drivers/contact.h"
#include "drivers/contact/serial_contact.h"
#include "drivers/contact/wire/ctp.h"
#include "drivers/contact/wire/ctp_codec.h"
#include "drivers/error.h"
#include "drivers/io_thread.h"
#include "drivers/kuka/eki/eki_robot.h"
#include "drivers/kuka/rsi/rsi_robot.h"

namespace cellcal::daemon {

namespace {

using Steady = std::chrono::steady_clock;
using namespace std::chrono_literals;
using calib::Phrase;

constexpr std::chrono::milliseconds kPollInterval{5};
/// 2 s for the board's bootloader, and as long for the driver's clock map and self-test.
constexpr double kContactTimeoutS = 8.0;
/// A fault of this duration is permanent.
constexpr double kFaultTimeoutS = 2.0;
/// HELLO is sent five times in this time; a sensor at that rate answers the first.
constexpr double kBaudTimeoutS = 1.0;
/// Rates supported by the firmware (drivers/contact/firmware/README.md).
constexpr std::array kSensorRates{1'000'000, 250'000, 115'200};
/// Refusals and losses are known by then; no further findings follow.
constexpr double kEnoughS = 1.0;
/// Number of replies after which late ones are ours, not those before the first answer.
constexpr std::uint64_t kSettled = 10;
constexpr double kRsiCloseTimeoutS = 2.0, kEkiCloseTimeoutS = 3.5;

double since(Steady::time_point t) {
  return std::chrono::duration<double>(Steady::now() - t).count();
}

/// Six axes without limits, where no robot file is given: nothing moves, so no limit is needed.
calib::Cell any_arm(const DaemonConfig& config) {
  const int external = wire_of(config) == WireKind::kEki ? config.controller.external_axes : 0;
  calib::Cell cell;
  cell.robot.name = "any arm";
  for (int i = 0; i < 6 + external; ++i) {
    calib::Joint joint;
    joint.name = fmt::format("{}{}", i < 6 ? 'A' : 'E', i % 6 + 1);
    joint.min_rad = -7.0;
    joint.max_rad = 7.0;
    joint.max_speed_rad_s = 1.0;
    cell.robot.joints.push_back(joint);
  }
  return cell;
}

class Wires {
 public:
  Wires(const DoctorRequest& request, const DaemonConfig& config,
        const std::optional<calib::Cell>& cell, Findings& findings)
      : request_(request),
        config_(config),
        robot_(cell ? &cell->robot : nullptr),
        arm_(cell ? *cell : any_arm(config)),
        rest_(arm_.robot, stated_frames(config, arm_)),
        findings_(findings),
        io_(drivers::IoThreadOptions{.realtime = config.realtime, .quiet = true}),
        contact_(io_.context(), contact_options(config)) {
    io_.start();
    contact_seen_.datagrams = drivers::is_datagrams(config_.contact.device);
    contact_seen_.repeats = config_.repeats.of_session > 0 && config_.repeats.of_touch > 0;
    contact_seen_.wanted_config_crc = drivers::ctp::config_crc(drivers::ContactOptions().wire);
  }
  ~Wires() { contact_.close(); }
  Wires(const Wires&) = delete;
  Wires& operator=(const Wires&) = delete;

  const std::vector<std::string>& warnings() const { return io_.warnings(); }
  void contact(const std::optional<ProcessRights>& daemon);
  void rsi();
  void eki();

 private:
  static drivers::SerialContactOptions contact_options(const DaemonConfig& config) {
    drivers::SerialContactOptions options;
    options.port = config.contact;
    if (!config.realtime) options.port.priority = 0;
    return options;
  }
  void judge_access(const std::optional<ProcessRights>& daemon);
  bool open_contact();
  void probe_baud_rates();
  void examine_contact();
  bool open_rsi(drivers::RsiRobot& robot);
  RsiSeen watch(drivers::RsiRobot& robot);
  EkiSeen watch(drivers::EkiRobot& robot);
  void judge_line();
  void judge_model(bool sends);

  const DoctorRequest& request_;
  const DaemonConfig& config_;
  const calib::Robot* robot_;
  calib::Cell arm_;
  RestWatch rest_;
  Findings& findings_;
  // Declaration order: objects on the context are destroyed before it.
  drivers::IoThread io_;
  drivers::SerialContact contact_;
  ContactSeen contact_seen_;
  bool contact_open_ = false, contact_good_ = false;
  Steady::time_point contact_opened_{};
};

// ---- contact sensor ----------------------------------------------------------------------------

/// Membership in group root grants all rights and is never recommended.
Phrase access_advice(const std::string& group) {
  if (group == "root") return "say.doctor.access.do.rule";
  return {"say.doctor.access.do.group", {{"group", group}}};
}

/// The doctor may have rights that the daemon lacks.
void Wires::judge_access(const std::optional<ProcessRights>& daemon) {
  const std::optional<ProcessRights> rights = daemon ? daemon : rights_of_unit();
  if (drivers::is_datagrams(config_.contact.device)) return;
  if (!rights || may_use(*rights, config_.contact.device).value_or(true)) return;
  findings_.fail("contact access",
                 {"say.doctor.access", {{"who", rights->who}, {"device", config_.contact.device}}},
                 access_advice(group_of(config_.contact.device)));
}

bool Wires::open_contact() {
  try {
    contact_.open();
  } catch (const std::exception& error) {
    // The error of a device that is there has its own remedy.
    std::error_code unknown;
    const bool missing = !std::filesystem::exists(config_.contact.device, unknown);
    findings_.fail(
        "contact port", error.what(),
        missing && !contact_seen_.datagrams ? "say.doctor.port.do" : "say.doctor.port.refused.do");
    return false;
  }
  const std::string warning = contact_.status().warning;
  const Phrase found{drivers::is_datagrams(config_.contact.device) ? "say.doctor.port.network"
                                                                   : "say.doctor.port.serial",
                     {{"device", config_.contact.device}, {"baud", config_.contact.baud}}};
  if (warning.empty()) {
    findings_.ok("contact port", found);
  } else {
    findings_.warn("contact port", found, warning);
  }
  return true;
}

void Wires::examine_contact() {
  const bool was_closed = contact_seen_.newest.in_contact == true;
  contact_seen_.newest = contact_.status();
  const drivers::ContactStatus& s = contact_seen_.newest;
  if (was_closed && s.in_contact == false && s.loop_ok == true) contact_seen_.touched = true;
}

void Wires::contact(const std::optional<ProcessRights>& daemon) {
  judge_access(daemon);
  contact_open_ = open_contact();
  contact_opened_ = Steady::now();
  // After opening, which requests low latency: the value read back applies to sessions, too.
  if (drivers::is_datagrams(config_.contact.device)) {
    judge_interface(drivers::interface_to(config_.contact.device), findings_);
  } else {
    judge_adapter(config_.contact.device, drivers::adapter_of(config_.contact.device),
                  config_.contact.baud, findings_);
  }
  if (!contact_open_) {
    for (const char* check : {"contact sensor", "contact board", "contact configuration",
                              "contact circuit", "contact self-test", "contact clock"}) {
      findings_.skip(check, "say.doctor.port.closed");
    }
    return;
  }
  const Steady::time_point begun = Steady::now();
  std::optional<Steady::time_point> faulty;
  while (since(begun) < kContactTimeoutS && !request_.stop.stop_requested()) {
    examine_contact();
    const drivers::ContactStatus& s = contact_seen_.newest;
    if (s.link == drivers::ContactLink::kReady) break;
    const bool stuck = s.link == drivers::ContactLink::kFault || s.in_contact == true;
    if (!stuck) faulty.reset();
    if (stuck && !faulty) faulty = Steady::now();
    if (faulty && since(*faulty) > kFaultTimeoutS) break;
    std::this_thread::sleep_for(kPollInterval);
  }
  if (contact_seen_.newest.fault == drivers::ContactFault::kBaud) probe_baud_rates();
  contact_good_ = judge_contact(contact_seen_, findings_);
}

/// Bytes but no frames: probes the other rates of the firmware.
void Wires::probe_baud_rates() {
  contact_seen_.baud = config_.contact.baud;
  for (const int baud : kSensorRates) {
    if (baud == config_.contact.baud || contact_seen_.answers_at) continue;
    contact_.close();
    drivers::SerialContactOptions options = contact_options(config_);
    options.port.baud = baud;
    drivers::SerialContact other(io_.context(), options);
    try {
      other.open();
    } catch (const drivers::DriverError&) {
      continue;  // a rate not supported by this adapter cannot be the sensor's
    }
    const Steady::time_point begun = Steady::now();
    while (since(begun) < kBaudTimeoutS && !contact_seen_.answers_at &&
           !request_.stop.stop_requested()) {
      if (other.status().identity.protocol != 0) contact_seen_.answers_at = baud;
      std::this_thread::sleep_for(kPollInterval);
    }
  }
  contact_open_ = open_contact();
}

void Wires::judge_line() {
  if (!contact_open_) {
    findings_.skip("contact touch", "say.doctor.port.closed");
    findings_.skip("contact line", "say.doctor.port.closed");
    return findings_.skip("contact delivery", "say.doctor.port.closed");
  }
  examine_contact();
  contact_seen_.observed_s = since(contact_opened_);
  judge_contact_touch(contact_seen_, findings_);
  judge_contact_line(contact_seen_, findings_);
  judge_contact_delivery(contact_seen_, findings_);
  const drivers::ContactStatus& s = contact_seen_.newest;
  if (contact_good_ && s.link != drivers::ContactLink::kReady) {
    findings_.fail("contact link", phrase_of(s.words), "say.doctor.contact.lost.do");
  }
}

// ---- RSI ---------------------------------------------------------------------------------------

void Wires::judge_model(bool sends) {
  if (robot_ == nullptr) return findings_.skip("controller's model", "say.doctor.model.no_cell");
  if (robot_->first_turning() > 0)
    return findings_.skip("controller's model", "say.doctor.model.unit");
  daemon::judge_model(rest_.judge(), *robot_, sends, wire_of(config_), findings_);
}

bool Wires::open_rsi(drivers::RsiRobot& robot) {
  const std::string check = "rsi port";
  const std::string& address = config_.rsi_files.pc_address;
  Phrase list;
  for (const std::string& one : own_addresses()) list = joined("say.join.comma", list, one);
  if (list.empty()) list = "say.doctor.rsi.port.addresses";
  try {
    robot.open();
  } catch (const std::exception& error) {
    const auto holder = holder_of_udp_port(config_.rsi.port);
    findings_.fail(check, error.what(),
                   holder ? Phrase("say.doctor.rsi.port.taken.do", {{"holder", *holder}})
                          : Phrase("say.doctor.rsi.port.bind.do", {{"addresses", list}}));
    return false;
  }
  const std::string found = fmt::format("UDP {}:{}", config_.rsi.bind_address, config_.rsi.port);
  const bool stated = !address.empty() && address != "0.0.0.0";
  if (stated && !is_own_address(address)) {
    findings_.fail(check, {"say.doctor.rsi.port.other", {{"port", found}, {"address", address}}},
                   {"say.doctor.rsi.port.other.do", {{"addresses", list}}});
  } else {
    findings_.ok(check, found);
  }
  return true;
}

/// Compares the controller's input with the sensor.
class InputWatch {
 public:
  void update(bool input, bool closed, bool circuit_good) {
    if (!first_input_) first_input_ = input;
    if (!first_contact_) first_contact_ = closed;
    seen_.on = input;
    seen_.changed = seen_.changed || input != *first_input_;
    seen_.contact_changed = seen_.contact_changed || closed != *first_contact_;
    always_on_while_open_ = always_on_while_open_ && circuit_good && input && !closed;
  }
  InputSeen seen() const {
    InputSeen all = seen_;
    all.on_while_open = first_input_ && always_on_while_open_;
    return all;
  }

 private:
  InputSeen seen_;
  std::optional<bool> first_input_, first_contact_;
  bool always_on_while_open_ = true;
};

RsiSeen Wires::watch(drivers::RsiRobot& robot) {
  RsiSeen seen;
  InputWatch input;
  seen.listening = fmt::format("UDP {}:{}", config_.rsi.bind_address, config_.rsi.port);
  const Steady::time_point begun = Steady::now();
  std::optional<Steady::time_point> up, settled, over;
  while (true) {
    examine_contact();
    const drivers::CoreState core = robot.core_state();
    const drivers::RobotState state = robot.state();
    if (!state.words.empty()) seen.last_words = phrase_of(state.words);
    if (core.packets > 0 && !up) {
      up = Steady::now();
      seen.first_packet_s = since(begun);
    }
    if (up || core.bad_packets > 0) {
      seen.newest = core;
      seen.state = state;
    }
    seen.up = up.has_value();
    if (up) rest_.update(state);
    if (up && core.input_path != drivers::InputPath::kUntold)
      input.update(core.input_contact, contact_seen_.newest.in_contact == true, contact_good_);
    seen.answered = seen.answered || core.replies > 0;
    seen.refused = seen.refused || core.trouble == drivers::Trouble::kNotAccepted;
    seen.lost = seen.lost || core.link == drivers::RobotLink::kLost;
    if (core.replies >= kSettled && !settled) {
      settled = Steady::now();
      seen.late_at_start = core.late;
    }
    seen.waited_s = since(begun);
    if (!up && seen.waited_s >= request_.wait_s) break;
    if (up && since(*up) >= request_.observe_s) break;
    if (request_.stop.stop_requested()) break;
    if ((seen.refused || seen.lost) && !over) over = Steady::now();
    if (over && since(*over) >= kEnoughS) break;
    std::this_thread::sleep_for(kPollInterval);
  }
  seen.observed_s = up ? since(*up) : 0.0;
  seen.input = input.seen();
  seen.sender = robot.sender();
  for (const auto limit : {100us, 250us, 500us, 1000us, 2000us}) {
    seen.replies_within.emplace_back(limit.count() * 1e-3, robot.reply_times().within(limit));
  }
  seen.foreign = robot.foreign_packets();
  return seen;
}

void Wires::rsi() {
  drivers::RsiRobot robot(io_.context(), rsi_config_for(config_, arm_), &contact_.guard());
  if (!open_rsi(robot)) {
    findings_.skip("rsi packets", "say.doctor.port.closed");
    return judge_line();
  }
  request_.hint({"say.doctor.hint.rsi",
                 {{"what", start_instruction(WireKind::kRsi)}, {"s", request_.wait_s}}});
  const RsiSeen seen = watch(robot);
  judge_line();
  const drivers::RsiConfig& rsi = config_.rsi;
  judge_rsi(seen,
            {rsi.sentype, rsi.late_replies_limit, rsi.space.on, !rsi.mode_tag.empty(),
             !rsi.override_tag.empty(), rsi.contact_tag.empty() ? 0 : config_.controller.input},
            findings_);
  if (!seen.up) return robot.close();
  judge_angles("rsi joint angles", seen.state.actual_rad, robot_, findings_);
  judge_model(seen.newest.states_tcp);
  const Steady::time_point asked = Steady::now();
  robot.close();
  while (robot.port() != 0 && since(asked) < kRsiCloseTimeoutS + kEnoughS) {
    std::this_thread::sleep_for(kPollInterval);
  }
  const double after_s = since(asked);
  if (seen.lost || seen.refused || config_.rsi.stop_tag.empty()) {
    findings_.skip("rsi stop", "say.doctor.stop.skip");
  } else {
    judge_rsi_end(after_s < kRsiCloseTimeoutS ? std::optional(after_s) : std::nullopt, findings_);
  }
}

// ---- EKI ---------------------------------------------------------------------------------------

EkiSeen Wires::watch(drivers::EkiRobot& robot) {
  EkiSeen seen;
  seen.peer = fmt::format("{}:{}", config_.eki.address, config_.eki.port);
  const Steady::time_point begun = Steady::now();
  std::optional<Steady::time_point> up;
  InputWatch input;
  while (true) {
    examine_contact();
    const drivers::EkiCoreState core = robot.core_state();
    const drivers::RobotState state = robot.state();
    const bool linked = core.link == drivers::RobotLink::kNotReferenced;
    if (!state.words.empty()) seen.last_words = phrase_of(state.words);
    seen.connected = seen.connected || core.connected;
    if (linked && !up) up = Steady::now();
    if (linked || !up) {
      seen.newest = core;
      seen.state = state;
    }
    seen.up = up.has_value();
    seen.lost = seen.lost || (up && !linked);
    if (linked) rest_.update(state);
    if (linked) input.update(core.input, contact_seen_.newest.in_contact == true, contact_good_);
    seen.waited_s = since(begun);
    if (!up && seen.waited_s >= request_.wait_s) break;
    if (up && since(*up) >= request_.observe_s) break;
    if (request_.stop.stop_requested()) break;
    std::this_thread::sleep_for(kPollInterval);
  }
  seen.observed_s = up ? since(*up) : 0.0;
  seen.input = input.seen();
  return seen;
}

void Wires::eki() {
  drivers::EkiRobot robot(io_.context(), eki_config_for(config_, arm_), &contact_.guard());
  EkiSeen seen;
  try {
    robot.open();
    request_.hint(
        {"say.doctor.hint.eki",
         {{"address", config_.eki.address}, {"port", config_.eki.port}, {"s", request_.wait_s}}});
    seen = watch(robot);
  } catch (const drivers::DriverError& error) {
    seen.last_words = error.what();
  }
  judge_line();
  judge_eki(seen,
            {config_.eki.stop == drivers::EkiStop::kInput, config_.controller.input,
             config_.controller.contact_is_on},
            findings_);
  if (seen.up) {
    judge_angles("eki joint angles", seen.state.actual_rad, robot_, findings_);
    judge_model(seen.newest.sends_tcp);
  }
  const Steady::time_point asked = Steady::now();
  robot.close();
  while (robot.is_open() && since(asked) < kEkiCloseTimeoutS)
    std::this_thread::sleep_for(kPollInterval);
}

using nlohmann::json;

std::string local_time(std::time_t when) {
  std::tm day{};
  return fmt::format("{:%H:%M:%S}", *::localtime_r(&when, &day));
}

}  // namespace

void examine_wires(const DoctorRequest& request, const DaemonConfig& config,
                   const std::optional<calib::Cell>& cell,
                   const std::optional<ProcessRights>& daemon, Findings& findings) {
  try {
    Wires wires(request, config, cell, findings);
    judge_realtime(config, daemon, wires.warnings(), findings);
    wires.contact(daemon);
    if (wire_of(config) == WireKind::kRsi) {
      wires.rsi();
    } else {
      wires.eki();
    }
  } catch (const std::exception& error) {
    findings.fail("wires", error.what(), "say.doctor.wires.do");
  }
}

Phrase robot_link_phrase(const json& robot) {
  if (!robot.is_object() || !(number_in(robot, "packets") > 0.0)) return {};
  const auto and_also = [](const Phrase& a, const Phrase& b) {
    return joined("say.join.semicolon", a, b);
  };
  Phrase all{"say.link.robot",
             {{"cycle", number_in(robot, "cycle_ms")},
              {"jitter", number_in(robot, "jitter_ms")},
              {"longest", number_in(robot, "longest_gap_ms")},
              {"packets", number_in(robot, "packets")},
              {"missing", number_in(robot, "gaps")},
              {"damaged", number_in(robot, "bad_packets")}}};
  const std::string mode = text_in(robot, "mode");
  if (!mode.empty() && mode != to_string(drivers::OperatingMode::kUnknown))
    all = and_also(all, {"say.link.mode", {{"mode", mode}}});
  const json percent = robot.value("override_percent", json());
  if (percent.is_number())
    all = and_also(all, {"say.link.override", {{"percent", percent.get<double>()}}});
  const json reply = robot.value("reply_ms", json());
  if (number_in(robot, "replies") > 0.0 && reply.is_object())
    all = and_also(all, {"say.link.replies",
                         {{"p50", number_in(reply, "p50")},
                          {"p99", number_in(reply, "p99")},
                          {"max", number_in(reply, "max")},
                          {"late", number_in(robot, "late")}}});
  return all;
}

Phrase contact_link_phrase(const json& contact) {
  if (!contact.is_object() || !(number_in(contact, "frames") > 0.0)) return {};
  Phrase all{"say.link.contact",
             {{"firmware", or_else(text_in(contact, "firmware"), "say.link.unknown")},
              {"boot", number_in(contact, "boot_id")},
              {"frames", number_in(contact, "frames")},
              {"damaged", number_in(contact, "crc_errors")},
              {"missing", number_in(contact, "gaps")}}};
  const auto also = [&](Phrase part) { all = joined("say.join.semicolon", all, std::move(part)); };
  const json trip = contact.value("round_trip_ms", json()), late = contact.value("late_ms", json());
  if (trip.is_object())
    also({"say.link.round_trip",
          {{"p50", number_in(trip, "p50")}, {"p99", number_in(trip, "p99")}}});
  if (const double clock = number_in(contact, "clock_sigma_us"); clock > 0.0)
    also({"say.link.clock", {{"clock", clock}, {"drift", number_in(contact, "clock_drift_ppm")}}});
  if (const double worst = number_in(late, "worst"); worst > 0.0)
    also({"say.link.late",
          {{"late", number_in(late, "p50")},
           {"worst", worst},
           {"limit", number_in(late, "limit")}}});
  return all;
}

ArmMotion motion_of(const json& arm) {
  return arm.is_object()
             ? by_own_name<ArmMotion, ' '>(text_in(arm, "motion")).value_or(ArmMotion::kUnknown)
             : ArmMotion::kUnknown;
}

Phrase arm_phrase(const json& arm) {
  if (!arm.is_object()) return {};
  const json packet_age_s = arm.value("packet_age_s", json());
  if (!packet_age_s.is_number()) return "say.arm.no_packet";
  const double age_s = packet_age_s.get<double>();
  if (const ArmMotion motion = motion_of(arm); motion != ArmMotion::kUnknown)
    return {motion == ArmMotion::kMoving ? "say.arm.moving" : "say.arm.at_rest", {{"age", age_s}}};
  return {"say.arm.unknown",
          {{"since", local_time(std::time(nullptr) - std::lround(age_s))}, {"age", age_s}}};
}

}  // namespace cellcal::daemon

#include "daemon/config/config.h"

#include <sys/un.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>

#include "calib/files/input_file.h"
#include "calib/model/nominal_arm.h"
#include "calib/model/units.h"
#include "daemon/config/config_values.h"
#include "drivers/contact/port/port.h"
#include "drivers/error.h"

namespace cellcal::daemon {

namespace {

using calib::TomlTable;

constexpr double kMm = 1e-3;
constexpr const char* kFormat = "cellcal.daemon/1";
/// Degrees: usual AXISCORR limits of installations, and the maximum for the emulated controller.
constexpr double kUsualCorrection = 90.0, kAnyCorrection = 360.0;
constexpr double kMs = 1e-3;
/// Range of an arm of 1.4 m, with rotations well below half a turn. The emulated controller accepts the
/// maximum.
constexpr double kUsualMm = 500.0, kDefaultTurnDeg = 90.0, kAnyMm = 5000.0, kAnyTurnDeg = 180.0;
/// Without a contact input on the controller, 50 to 70 ms pass between contact and braking: 0.2 mm at 2.5
/// mm/s, as far as a search at 10 mm/s overtravels over RSI.
const SearchLimits kFlagLimits{2.5e-3, 1, "with eki stop = \"flag\" (the stop takes 50 to 70 ms)"};
constexpr double kFlagFastMmS = 2.5, kFlagSlowMmS = 1.0;
/// KUKA's constant inputs, without wiring.
constexpr int kAlwaysTrue = 1025, kAlwaysFalse = 1026;
/// Number of robot states within the silence that counts as a lost link.
constexpr int kStatesOfSilence = 4;
constexpr const char* kDefaultState = "/var/lib/cellcal";
constexpr const char* kDefaultSocket = "/run/cellcal/cellcald.sock";

void read_motion(const TomlTable& table, DaemonConfig& config) {
  // 3 to 100 %: below, waypoints take longer than the session's timeout.
  config.motion.speed_fraction = table.number_or("speed_percent", 20.0, {3.0, 100.0}) / 100.0;
  config.motion.acceleration_rad_s2 =
      table.number_or("acceleration_deg_s2", 120.0, {1.0, 2000.0}) * calib::kRadPerDeg;
  config.motion.jerk_rad_s3 =
      table.number_or("jerk_deg_s3", 600.0, {1.0, 50000.0}) * calib::kRadPerDeg;
  config.motion.travel_acceleration_m_s2 =
      table.number_or("travel_acceleration_mm_s2", 500.0, {1.0, 20000.0}) * kMm;
  config.motion.travel_jerk_m_s3 =
      table.number_or("travel_jerk_mm_s3", 5000.0, {1.0, 500000.0}) * kMm;
  config.motion.positioner_speed_rad_s =
      table.number_or("positioner_speed_deg_s", 10.0, {0.5, 360.0}) * calib::kRadPerDeg;
  config.motion.positioner_acceleration_rad_s2 =
      table.number_or("positioner_acceleration_deg_s2", 30.0, {1.0, 2000.0}) * calib::kRadPerDeg;
  config.motion.positioner_jerk_rad_s3 =
      table.number_or("positioner_jerk_deg_s3", 150.0, {1.0, 50000.0}) * calib::kRadPerDeg;
  config.motion.hand_speed_m_s =
      table.number_or("hand_speed_mm_s", config.motion.hand_speed_m_s / kMm, {0.0, 250.0}) * kMm;
  const TouchPolicy policy;
  const bool by_flag =
      wire_of(config) == WireKind::kEki && config.eki.stop == drivers::EkiStop::kFlag;
  if (by_flag) config.search_limits = kFlagLimits;
  const double fast =
      table.number_or("fast_search_mm_s", by_flag ? kFlagFastMmS : policy.fast_m_s / kMm,
                      {0.5, SearchLimits{}.fastest_m_s / kMm});
  const double slow =
      table.number_or("slow_search_mm_s",
                      by_flag ? kFlagSlowMmS : std::min(policy.slow_m_s / kMm, fast), {0.1, 10.0});
  if (fast * kMm > config.search_limits.fastest_m_s) {
    table.fail("fast_search_mm_s",
               "must be at most 2.5 with eki stop = \"flag\": the stop takes 50 to 70 ms");
  }
  // The flag stop takes the contact from a record of states, which is accurate at the slow speed only.
  config.touch.confirm_every =
      integer_or(table, "confirm_every", by_flag ? 1 : policy.confirm_every, 1,
                 SearchLimits{}.most_confirm_every);
  if (config.touch.confirm_every > config.search_limits.most_confirm_every)
    table.fail("confirm_every", "must be 1 with eki stop = \"flag\": only its slow searches count");
  config.touch.fast_m_s = fast * kMm;
  config.touch.slow_m_s = slow * kMm;
  if (config.touch.slow_m_s > config.touch.fast_m_s) {
    table.fail("slow_search_mm_s", "must not be above fast_search_mm_s");
  }
  table.refuse_unknown();
}

/// 0: off, so that the sample file can state the default.
void read_retention(const TomlTable& table, DaemonConfig& config) {
  if (const long days = table.integer_or("days", 0, 0, 36500); days > 0)
    config.retain_days = static_cast<int>(days);
  const double megabytes = table.number_or("megabytes", 0.0, {0.0, 1e9});
  if (megabytes > 0.0 && megabytes < 1.0) table.fail("megabytes", "must be 0 (off) or 1 and more");
  if (megabytes > 0.0) config.retain_megabytes = megabytes;
  table.refuse_unknown();
}

/// In seconds, from `least` to an hour.
void read_wait(const TomlTable& table, const char* key, double least,
               std::chrono::milliseconds& wait) {
  const double usual = std::chrono::duration<double>(wait).count();
  const double wait_s = table.number_or(key, usual, {least, 3600.0});
  wait = std::chrono::milliseconds(std::llround(wait_s * 1e3));
}

void read_session(const TomlTable& table, DaemonConfig& config) {
  read_wait(table, "connect_wait_s", 1.0, config.timeouts.connecting);
  config.retries = integer_or(table, "retries", 0, 0, 100);
  BusyRepeats& repeats = config.repeats;
  repeats.of_touch = integer_or(table, "busy_repeats_touch", repeats.of_touch, 0, 100);
  repeats.of_session = integer_or(table, "busy_repeats", repeats.of_session, 0, 10'000);
  read_wait(table, "busy_wait_s", 3.0, config.timeouts.busy);
  table.refuse_unknown();
}

void read_rsi(const TomlTable& table, DaemonConfig& config) {
  drivers::RsiConfig& rsi = config.rsi;
  rsi.bind_address = read_address(table, "bind", rsi.bind_address, Addresses::kOwn);
  rsi.port = static_cast<std::uint16_t>(table.integer_or("port", rsi.port, 1, 65535));
  rsi.sentype = read_name(table, "sentype", rsi.sentype);
  rsi.axis_tag = read_name(table, "axis_tag", rsi.axis_tag);
  rsi.external_axis_tag = read_name(table, "external_axis_tag", rsi.external_axis_tag);
  rsi.stop_tag = read_name(table, "stop_tag", rsi.stop_tag, Emptiness::kMeansNone);
  rsi.mode_tag = read_name(table, "mode_tag", rsi.mode_tag, Emptiness::kMeansNone);
  rsi.override_tag = read_name(table, "override_tag", rsi.override_tag, Emptiness::kMeansNone);
  rsi.contact_tag = read_name(table, "contact_tag", rsi.contact_tag, Emptiness::kMeansNone);
  if (!rsi.contact_tag.empty() && config.controller.contact_is_on) {
    table.fail("contact_tag",
               "needs [controller] contact_level = \"off\" and the input's number: the sensor's "
               "output is off during contact, so that a cut wire reads as contact");
  }
  if (table.has("mode") && table.word("mode", {"absolute", "relative"}) == "relative") {
    rsi.mode = drivers::CorrectionMode::kRelative;
  }
  const bool hold_on = rsi.mode == drivers::CorrectionMode::kAbsolute;
  rsi.hold_on = table.boolean_or("hold_on", hold_on);
  if (rsi.hold_on != hold_on) {
    table.fail("hold_on",
               hold_on
                   ? "must be true with mode = \"absolute\": otherwise one late reply moves the "
                     "arm back to where the session began"
                   : "must be false with mode = \"relative\": otherwise every late reply "
                     "repeats the last step");
  }
  read_space(table, config);
  refuse_equal_tags(table, rsi);
  rsi.longest_lag_s =
      table.number_or("longest_lag_ms", rsi.longest_lag_s / kMs, {10.0, 500.0}) * kMs;
  rsi.silence_cycles =
      integer_or(table, "silence_cycles", rsi.silence_cycles, 2, drivers::kMostSilenceCycles);
  rsi.late_replies_limit =
      integer_or(table, "late_replies_limit", rsi.late_replies_limit, 1, 10000);
  if (const int most = config.rsi_files.timeout_cycles; rsi.late_replies_limit >= most) {
    table.fail("late_replies_limit", "must be below timeout_cycles of [controller], " +
                                         std::to_string(most) +
                                         ": the controller would end RSI first");
  }
  // A common value for all axes; rsi_config_for() sets each axis.
  const double usual = config.backend == BackendKind::kMock ? kAnyCorrection : kUsualCorrection;
  rsi.correction_limit_deg = {table.number_or("correction_limit_deg", usual, {0.1, 360.0})};
  const bool realtime = table.boolean_or("realtime", true);
  if (wire_of(config) == WireKind::kRsi) config.realtime = realtime;
  table.refuse_unknown();
}

void read_eki(const TomlTable& table, DaemonConfig& config) {
  drivers::EkiConfig& eki = config.eki;
  eki.address = read_address(table, "address", eki.address, Addresses::kControllers);
  eki.port = static_cast<std::uint16_t>(table.integer_or("port", eki.port, 1, 65535));
  if (table.has("stop")) {
    eki.stop = table.word("stop", {"input", "flag"}) == "input" ? drivers::EkiStop::kInput
                                                                : drivers::EkiStop::kFlag;
  }
  eki.silence_s = table.number_or("silence_ms", eki.silence_s / kMs, {100.0, 2000.0}) * kMs;
  eki.latch_delay_s =
      table.number_or("latch_delay_ms", eki.latch_delay_s / kMs, {-200.0, 200.0}) * kMs;
  eki.latch_jitter_s =
      table.number_or("latch_jitter_ms", eki.latch_jitter_s / kMs, {0.0, 200.0}) * kMs;
  const bool realtime = table.boolean_or("realtime", true);
  if (wire_of(config) == WireKind::kEki) config.realtime = realtime;
  eki.flag_sigma_s = table.number_or("flag_sigma_ms", eki.flag_sigma_s / kMs, {0.0, 200.0}) * kMs;
  config.controller.write_frames = table.boolean_or("write_frames", false);
  config.controller.write_advice = table.boolean_or("write_advice", false);
  table.refuse_unknown();
}

/// Settings of the programs on the controller. Address and port come from [eki].
void read_controller(const TomlTable& table, DaemonConfig& config) {
  drivers::EkiFilesConfig& files = config.controller;
  files.address = config.eki.address;
  files.port = config.eki.port;
  files.external_axes = integer_or(table, "external_axes", files.external_axes, 0, 6);
  files.input = integer_or(table, "input", files.input, 1, 8192);
  if (files.input == kAlwaysTrue || files.input == kAlwaysFalse) {
    table.fail("input",
               "must be the input that the sensor is wired to, not 1025 or 1026: $IN[1025] is "
               "always TRUE, $IN[1026] always FALSE");
  }
  if (table.has("contact_level")) {
    files.contact_is_on = table.word("contact_level", {"on", "off"}) == "on";
  }
  files.tool = integer_or(table, "tool", files.tool, 0, 128);
  files.base = integer_or(table, "base", files.base, 0, 128);
  files.load = integer_or(table, "load", files.load, 0, 128);
  files.acceleration_percent =
      integer_or(table, "acceleration_percent", files.acceleration_percent, 1, 100);
  files.alive_flag = integer_or(table, "alive_flag", files.alive_flag, 1, 1024);
  files.stop_flag = integer_or(table, "stop_flag", files.stop_flag, 1, 1024);
  files.first_timer = integer_or(table, "first_timer", files.first_timer, 1, 62);
  files.first_interrupt = integer_or(table, "first_interrupt", files.first_interrupt, 4, 126);
  if (files.first_interrupt > 37 && files.first_interrupt < 81) {
    table.fail("first_interrupt",
               "must be 4 to 37 or 81 to 126: three priorities are used from it on, and 40 to "
               "80 are the controller's own");
  }
  files.state_ms = integer_or(table, "state_ms", files.state_ms, 12, 100);
  files.dead_man_ms = integer_or(table, "dead_man_ms", files.dead_man_ms, 100, 1000);
  files.may_run = table.boolean_or("run_programs", false);
  files.cell_wait_s = integer_or(table, "cell_wait_s", files.cell_wait_s, 10, 7200);
  files.brake_test_output = integer_or(table, "brake_test_output", 0, 0, 8192);
  files.mastering_test_output = integer_or(table, "mastering_test_output", 0, 0, 8192);
  files.collision_output = integer_or(table, "collision_output", 0, 0, 8192);
  if (config.eki.silence_s < kStatesOfSilence * files.state_ms * kMs) {
    table.fail("state_ms", "must be at most a quarter of silence_ms of [eki], " +
                               std::to_string(std::lround(config.eki.silence_s / kMs)) +
                               " ms: otherwise one or two late states count as a lost link");
  }
  if (files.alive_flag == files.stop_flag) {
    table.fail("stop_flag", "must be another flag than alive_flag");
  }
  drivers::RsiFilesConfig& rsi = config.rsi_files;
  if (table.has("pc_address")) {
    rsi.pc_address = read_address(table, "pc_address", "", Addresses::kThisComputers);
  }
  rsi.rsi_version = integer_or(table, "rsi_version", rsi.rsi_version, 0, 1000);
  if (!drivers::is_rsi_version(rsi.rsi_version)) {
    table.fail("rsi_version", std::string("must be ") + drivers::kRsiVersions +
                                  "; EthernetKRL 6 and iiQKA's ExternalAPI are not supported");
  }
  if (rsi.rsi_version == 6 && wire_of(config) == WireKind::kEki) {
    table.fail("rsi_version", "is 6 (iiQKA.OS2), whose EthernetKRL 6 is not supported: use RSI");
  }
  rsi.timeout_cycles = integer_or(table, "timeout_cycles", rsi.timeout_cycles, 1, 1000);
  rsi.tool = files.tool;
  rsi.base = files.base;
  rsi.load = files.load;
  rsi.flag = integer_or(table, "interrupted_flag", files.alive_flag, 1, 999);
  table.refuse_unknown();
}

/// Checks that the configured program start can work. The emulated controller always starts.
void check_program_start(const TomlTable& table, DaemonConfig& config) {
  ProgramStart& start = config.schedule.program_start;
  const bool rsi = wire_of(config) == WireKind::kRsi;
  if (rsi && (start == ProgramStart::kLeftRunning || start == ProgramStart::kRun)) {
    table.fail(
        "program_start",
        "must be \"cell\" over RSI: each session ends CELLCAL_RSI, and only CELL.SRC calls it "
        "again (drivers/kuka/krl/README.md, 'Unattended at night')");
  }
  if (start == ProgramStart::kRun && !config.controller.may_run) {
    table.fail(
        "program_start",
        "is \"run\", and [controller] run_programs is not true: the controller would refuse. "
        "Set it, make the controller's files again and install them");
  }
  if (config.backend == BackendKind::kMock && start == ProgramStart::kNone)
    start = ProgramStart::kCell;
  config.eki.run_program = start == ProgramStart::kRun;
}

/// Settings that both ends of RSI share.
void share_with_rsi_files(DaemonConfig& config) {
  drivers::RsiFilesConfig& files = config.rsi_files;
  files.port = config.rsi.port;
  files.sentype = config.rsi.sentype;
  files.axis_tag = config.rsi.axis_tag;
  files.external_axis_tag = config.rsi.external_axis_tag;
  files.external_axes = config.controller.external_axes;
  files.stop_tag = config.rsi.stop_tag;
  files.mode_tag = config.rsi.mode_tag;
  files.override_tag = config.rsi.override_tag;
  files.contact_tag = config.rsi.contact_tag;
  files.input = config.controller.input;
  files.mode = config.rsi.mode;
  files.space = config.rsi.space;
  files.correction_limit_deg = config.rsi.correction_limit_deg.at(0);
  if (files.pc_address.empty()) files.pc_address = config.rsi.bind_address;
}

/// A path, or a board on Ethernet.
std::string read_device(const TomlTable& table) {
  const std::string text = table.string("device");
  if (!drivers::is_datagrams(text)) return read_path(table, "device");
  if (drivers::udp_device_of(text)) return text;
  table.fail("device",
             in_quotes(text) +
                 " is not the address of a board: write \"udp:ADDRESS:PORT\" with an IPv4 "
                 "address (example: \"udp:169.254.67.84:4300\")");
}

void read_contact(const TomlTable& table, DaemonConfig& config) {
  const bool needed = config.backend != BackendKind::kMock;
  if (needed || table.has("device")) config.contact.device = read_device(table);
  if (table.has("isolation")) {
    const std::string word = table.word("isolation", {"none", "plug", "relay"});
    config.isolation = word == "plug"    ? Isolation::kPlug
                       : word == "relay" ? Isolation::kRelay
                                         : Isolation::kNone;
  }
  if (config.isolation == Isolation::kPlug && config.schedule.unattended) {
    table.fail(
        "isolation",
        "must not be \"plug\" with [schedule] unattended = true: plug X1 is put in by hand "
        "before a session and pulled before welding. A relay does both (isolation = \"relay\")");
  }
  config.contact.baud = integer_or(table, "baud", 1'000'000, 9600, 4'000'000);
  constexpr std::array kRates{1'000'000, 250'000, 115'200};
  if (std::ranges::find(kRates, config.contact.baud) == kRates.end())
    table.fail("baud", "must be 1000000, 250000 or 115200: the firmware has no other rate");
  table.refuse_unknown();
}

void read_mock(const TomlTable& table, MockConfig& mock) {
  if (table.has("wire")) {
    mock.wire = table.word("wire", {"rsi", "eki"}) == "eki" ? WireKind::kEki : WireKind::kRsi;
  }
  mock.seed = static_cast<std::uint64_t>(table.integer_or("seed", 1, 0, 1'000'000'000));
  mock.geometry_scale = table.number_or("geometry_scale", mock.geometry_scale, {0.0, 100.0});
  mock.deflection = table.number_or("deflection", mock.deflection, {-1.0, 1.0});
  mock.gear_arcsec = table.number_or("gear_arcsec", mock.gear_arcsec, {0.0, 1000.0});
  mock.wave_arcsec = table.number_or("wave_arcsec", mock.wave_arcsec, {0.0, 1000.0});
  mock.compliance_rad_per_nm = table.number_or("compliance_sigma_rad_per_nm", 0.0, {0.0, 1e-3});
  mock.play_arcsec = table.number_or("play_arcsec", 0.0, {0.0, 1000.0});
  mock.tip_offset_m = table.number_or("tip_offset_mm", 0.0, {0.0, 10.0}) * 1e-3;
  if (table.has("tool_shift_mm")) {
    mock.tool_shift_m = table.numbers("tool_shift_mm", 3, {-50.0, 50.0});
    for (double& component : mock.tool_shift_m) component *= 1e-3;
  }
  mock.growth = table.number_or("growth_ppm", 0.0, {0.0, 1000.0}) * 1e-6;
  mock.warm_up_s = table.number_or("warm_up_s", mock.warm_up_s, {1.0, 1e5});
  mock.contact_noise_m = table.number_or("contact_noise_mm", 0.0, {0.0, 0.1}) * 1e-3;
  mock.bad_contact_share = table.number_or("bad_contact_percent", 0.0, {0.0, 100.0}) * 1e-2;
  mock.placement_m = table.number_or("placement_mm", mock.placement_m * 1e3, {0.0, 100.0}) * 1e-3;
  mock.joint_noise_deg = table.number_or("joint_noise_deg", mock.joint_noise_deg, {0.0, 1.0});
  mock.lag_s = table.number_or("lag_ms", mock.lag_s * 1e3, {0.0, 500.0}) * 1e-3;
  mock.absolute_accuracy = table.boolean_or("absolute_accuracy", false);
  if (table.has("stated_robot")) mock.stated_robot = table.string("stated_robot");
  if (table.has("stated_tool_mm"))
    for (const double mm : table.numbers("stated_tool_mm", 0, {-2000.0, 2000.0}))
      mock.stated_tool_m.push_back(mm * 1e-3);
  if (!mock.stated_tool_m.empty() && mock.stated_tool_m.size() != 3)
    table.fail("stated_tool_mm", "must be [X, Y, Z], or [] for the configured tool");
  mock.cycle_ms = integer_or(table, "cycle_ms", mock.cycle_ms, 4, 12);
  mock.busy_every_s = table.number_or("busy_every_s", 0.0, {0.0, 3600.0});
  mock.wall_clock = table.boolean_or("wall_clock", false);
  if (mock.cycle_ms != 4 && mock.cycle_ms != 12) table.fail("cycle_ms", "must be 4 or 12");
  const std::vector<double> home{0, -90, 90, 0, 90, 0};
  for (double deg :
       table.has("start_deg") ? table.numbers("start_deg", 0, {-360.0, 360.0}) : home) {
    mock.start_rad.push_back(deg * calib::kRadPerDeg);
  }
  if (table.has("start_mm")) mock.start_m = table.number("start_mm", {-100'000.0, 100'000.0}) * kMm;
  table.refuse_unknown();
}

DaemonConfig read(const TomlTable& table) {
  DaemonConfig config;
  table.word("format", {kFormat});
  config.backend = by_own_name<BackendKind>(table.word("backend", {"rsi", "eki", "mock"})).value();
  config.state_dir = table.has("state_dir") ? read_path(table, "state_dir") : kDefaultState;
  config.socket = table.has("socket") ? read_path(table, "socket") : kDefaultSocket;
  if (config.socket.string().size() >= sizeof(sockaddr_un::sun_path)) {
    table.fail("socket", "must have at most " + std::to_string(sizeof(sockaddr_un::sun_path) - 1) +
                             " characters, not " + std::to_string(config.socket.string().size()) +
                             ": the limit of a Unix socket");
  }
  config.http = read_http(table.table_or_empty("http"));
  config.log_debug =
      table.has("log_level") && table.word("log_level", {"info", "debug"}) == "debug";
  read_mock(table.table_or_empty("mock"), config.mock);
  read_eki(table.table_or_empty("eki"), config);
  read_controller(table.table_or_empty("controller"), config);
  read_session(table.table_or_empty("session"), config);
  read_retention(table.table_or_empty("retention"), config);
  config.language = read_language(table, {});
  config.notify = read_notify(table.table_or_empty("notify"), config.language);
  config.plant = read_plant(table.table_or_empty("plant"));
  config.schedule = read_schedule(table.table_or_empty("schedule"));
  check_program_start(table.table_or_empty("schedule"), config);
  read_motion(table.table_or_empty("motion"), config);
  read_rsi(table.table_or_empty("rsi"), config);
  share_with_rsi_files(config);
  read_contact(config.backend == BackendKind::kMock ? table.table_or_empty("contact")
                                                    : table.table("contact"),
               config);
  table.refuse_unknown();
  refuse_unusable_by_session(table, config);
  return config;
}

using drivers::CorrectionFrame;

class NominalGeometry final : public drivers::ArmGeometry {
 public:
  NominalGeometry(const calib::Robot& robot, const Eigen::Isometry3d& tcp) : arm_(robot, tcp) {}
  Eigen::Isometry3d tcp(std::span<const double> axis_rad) const noexcept override {
    return arm_.tcp(axis_rad);
  }

 private:
  calib::NominalArm arm_;
};

}  // namespace

DaemonConfig parse_config(std::string_view text, const std::string& name) {
  return read(TomlTable::parse(text, name));
}

DaemonConfig load_config(const std::filesystem::path& path) {
  DaemonConfig config = read(TomlTable::load(path));
  config.text_sha256 = calib::sha256(calib::read_file(path, calib::kMostTomlBytes));
  return config;
}

std::string unattended_obstacle(const DaemonConfig& config) {
  const ScheduleConfig& schedule = config.schedule;
  if (!schedule.unattended || schedule.sessions.empty()) return {};
  if (schedule.program_start != ProgramStart::kNone) return {};
  return "[schedule] program_start is \"none\": nothing starts the controller's program without a person, "
         "and no session begins. Set it up (drivers/kuka/krl/README.md, 'Unattended at night')";
}

double correction_limit_rad(const DaemonConfig& config) {
  return config.rsi.correction_limit_deg.at(0) * calib::kRadPerDeg;
}

WireKind wire_of(const DaemonConfig& config) {
  if (config.backend == BackendKind::kMock) return config.mock.wire;
  return config.backend == BackendKind::kRsi ? WireKind::kRsi : WireKind::kEki;
}

const char* start_instruction(WireKind wire) {
  return wire == WireKind::kRsi ? "say.start.rsi" : "say.start.eki";
}

void read_space(const calib::TomlTable& rsi, DaemonConfig& config) {
  drivers::SpaceCorrection& space = config.rsi.space;
  space.on = rsi.has("correction") && rsi.word("correction", {"axes", "space"}) == "space";
  if (space.on && config.rsi.mode == drivers::CorrectionMode::kRelative) {
    rsi.fail("correction",
             "must be \"axes\" with mode = \"relative\": a sum of rotations depends on their "
             "order, and the controller does not report it");
  }
  space.tag = read_name(rsi, "cart_tag", space.tag);
  if (rsi.has("correction_frame")) {
    const std::string frame = rsi.word("correction_frame", {"base", "robroot", "tool"});
    space.frame = frame == "base"      ? CorrectionFrame::kBase
                  : frame == "robroot" ? CorrectionFrame::kRobRoot
                                       : CorrectionFrame::kTool;
  }
  const bool mock = config.backend == BackendKind::kMock;
  space.limit_mm = rsi.number_or("correction_limit_mm", mock ? kAnyMm : kUsualMm, {1.0, kAnyMm});
  space.turn_limit_deg = rsi.number_or("correction_turn_limit_deg",
                                       mock ? kAnyTurnDeg : kDefaultTurnDeg, {0.1, kAnyTurnDeg});
  space.compare_tcp = config.controller.base == 0;
  if (space.on && space.frame == CorrectionFrame::kBase && config.controller.base != 0) {
    rsi.fail("correction_frame",
             "must be \"robroot\" or \"tool\" (RefCorrSys alike) if [controller] base is not "
             "0: the rotation of BASE_DATA is not known here");
  }
}

Eigen::Isometry3d controller_tcp(const DaemonConfig& config, const calib::Cell& cell) {
  return config.controller.tool == 0 ? Eigen::Isometry3d::Identity() : cell.tool.tcp;
}

calib::StatedFrames stated_frames(const DaemonConfig& config, const calib::Cell& cell) {
  calib::StatedFrames frames;
  const bool in_space = wire_of(config) == WireKind::kRsi && config.rsi.space.on;
  if (config.controller.tool == 0 || in_space) frames.tool = controller_tcp(config, cell);
  if (config.controller.base == 0) frames.base = Eigen::Isometry3d::Identity();
  return frames;
}

std::shared_ptr<const drivers::ArmGeometry> controller_arm(const DaemonConfig& config,
                                                           const calib::Cell& cell) {
  constexpr std::size_t kAxes = 6;
  if (cell.robot.joints.size() != kAxes) {
    throw drivers::ConfigError("robot file of " + cell.robot.name + ": " +
                               std::to_string(cell.robot.joints.size()) +
                               " joints, but [rsi] correction = \"space\" drives exactly six: "
                               "use correction = \"axes\"");
  }
  return std::make_shared<NominalGeometry>(cell.robot, controller_tcp(config, cell));
}

calib::Passable passable_in_space(const drivers::SpaceCorrection& space) {
  if (!space.on) return {};
  return [arm = space.geometry](const calib::JointVector& from, const calib::JointVector& to) {
    return drivers::clear_of_singularities(*arm, {from.begin(), from.end()},
                                           {to.begin(), to.end()});
  };
}

}  // namespace cellcal::daemon

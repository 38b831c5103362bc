#include "daemon/main/config.h"

#include <numbers>

#include "calib/files/toml_table.h"
#include "drivers/error.h"

namespace cellcal::daemon {

namespace {

using calib::TomlTable;

constexpr double kRad = std::numbers::pi / 180.0;
constexpr double kMm = 1e-3;
constexpr const char* kFormat = "cellcal.daemon/1";
/// Degrees. What installations give AXISCORR; the emulated controller is given what is asked for.
constexpr double kUsualCorrection = 90.0, kAnyCorrection = 360.0;
constexpr const char* kDefaultState = "/var/lib/cellcal";
constexpr const char* kDefaultSocket = "/run/cellcal/cellcald.sock";

void read_motion(const TomlTable& table, DaemonConfig& config) {
  // 3 to 100 %: below, waypoints take longer than the session's patience.
  config.motion.speed_fraction = table.number_or("speed_percent", 20.0, {3.0, 100.0}) / 100.0;
  config.motion.acceleration_rad_s2 =
      table.number_or("acceleration_deg_s2", 120.0, {1.0, 2000.0}) * kRad;
  config.motion.jerk_rad_s3 = table.number_or("jerk_deg_s3", 600.0, {1.0, 50000.0}) * kRad;
  const TouchPolicy policy;
  config.touch.fast_m_s =
      table.number_or("fast_search_mm_s", policy.fast_m_s / kMm, {0.5, 50.0}) * kMm;
  config.touch.slow_m_s =
      table.number_or("slow_search_mm_s", policy.slow_m_s / kMm, {0.1, 10.0}) * kMm;
  if (config.touch.slow_m_s > config.touch.fast_m_s) {
    table.fail("slow_search_mm_s", "must not be above fast_search_mm_s");
  }
  table.refuse_unknown();
}

void read_rsi(const TomlTable& table, DaemonConfig& config) {
  drivers::RsiConfig& rsi = config.rsi;
  rsi.bind_address = table.string_or("bind", rsi.bind_address);
  rsi.port = static_cast<std::uint16_t>(table.integer_or("port", rsi.port, 1, 65535));
  rsi.sentype = table.string_or("sentype", rsi.sentype);
  rsi.axis_tag = table.string_or("axis_tag", rsi.axis_tag);
  rsi.external_axis_tag = table.string_or("external_axis_tag", rsi.external_axis_tag);
  rsi.stop_tag = table.string_or("stop_tag", rsi.stop_tag);
  rsi.silence_cycles =
      static_cast<int>(table.integer_or("silence_cycles", rsi.silence_cycles, 2, 1000));
  rsi.late_replies_limit =
      static_cast<int>(table.integer_or("late_replies_limit", rsi.late_replies_limit, 1, 10000));
  // One figure for all axes here; rsi_config_for() gives each its own.
  const double usual = config.backend == BackendKind::kRsi ? kUsualCorrection : kAnyCorrection;
  rsi.correction_limit_deg = {table.number_or("correction_limit_deg", usual, {0.1, 360.0})};
  config.realtime = table.boolean_or("realtime", true);
  table.refuse_unknown();
}

void read_contact(const TomlTable& table, DaemonConfig& config) {
  config.contact.device =
      config.backend == BackendKind::kRsi ? table.string("device") : table.string_or("device", "");
  config.contact.baud = static_cast<int>(table.integer_or("baud", 1'000'000, 9600, 4'000'000));
  for (int allowed : {1'000'000, 250'000, 115'200}) {
    if (config.contact.baud == allowed) {
      table.refuse_unknown();
      return;
    }
  }
  table.fail("baud", "must be 1000000, 250000 or 115200: the firmware knows no other");
}

void read_mock(const TomlTable& table, MockConfig& mock) {
  mock.seed = static_cast<std::uint64_t>(table.integer_or("seed", 1, 0, 1'000'000'000));
  mock.geometry_scale = table.number_or("geometry_scale", mock.geometry_scale, {0.0, 100.0});
  mock.deflection = table.number_or("deflection", mock.deflection, {-1.0, 1.0});
  mock.gear_arcsec = table.number_or("gear_arcsec", mock.gear_arcsec, {0.0, 1000.0});
  mock.placement_m = table.number_or("placement_mm", mock.placement_m * 1e3, {0.0, 100.0}) * 1e-3;
  mock.joint_noise_deg = table.number_or("joint_noise_deg", mock.joint_noise_deg, {0.0, 1.0});
  mock.lag_s = table.number_or("lag_ms", mock.lag_s * 1e3, {0.0, 500.0}) * 1e-3;
  mock.cycle_ms = static_cast<int>(table.integer_or("cycle_ms", mock.cycle_ms, 4, 12));
  if (mock.cycle_ms != 4 && mock.cycle_ms != 12) table.fail("cycle_ms", "must be 4 or 12");
  const std::vector<double> home{0, -90, 90, 0, 90, 0};
  for (double deg :
       table.has("start_deg") ? table.numbers("start_deg", 0, {-360.0, 360.0}) : home) {
    mock.start_rad.push_back(deg * kRad);
  }
  table.refuse_unknown();
}

std::filesystem::path absolute(const TomlTable& table, const char* key, const char* fallback) {
  std::filesystem::path path = table.string_or(key, fallback);
  if (!path.is_absolute()) table.fail(key, "must be an absolute path");
  return path;
}

DaemonConfig read(const TomlTable& table) {
  DaemonConfig config;
  table.word("format", {kFormat});
  config.backend =
      table.word("backend", {"rsi", "mock"}) == "rsi" ? BackendKind::kRsi : BackendKind::kMock;
  config.state_dir = absolute(table, "state_dir", kDefaultState);
  config.socket = absolute(table, "socket", kDefaultSocket);
  read_motion(table.table_or_empty("motion"), config);
  read_rsi(table.table_or_empty("rsi"), config);
  read_contact(config.backend == BackendKind::kRsi ? table.table("contact")
                                                   : table.table_or_empty("contact"),
               config);
  read_mock(table.table_or_empty("mock"), config.mock);
  table.refuse_unknown();
  return config;
}

}  // namespace

DaemonConfig parse_config(std::string_view text, const std::string& name) {
  return read(TomlTable::parse(text, name));
}

DaemonConfig load_config(const std::filesystem::path& path) { return read(TomlTable::load(path)); }

drivers::RsiConfig rsi_config_for(const DaemonConfig& config, const calib::Cell& cell) {
  drivers::RsiConfig rsi = config.rsi;
  for (const calib::Joint& joint : cell.robot.joints) {
    if (!(joint.max_speed_rad_s > 0.0)) {
      throw drivers::ConfigError("robot file of " + cell.robot.name + ": joint " + joint.name +
                                 " has no max_speed_deg_s; without it the arm cannot be moved");
    }
    drivers::AxisLimit limit;
    limit.min_rad = joint.min_rad;
    limit.max_rad = joint.max_rad;
    limit.max_speed_rad_s = joint.max_speed_rad_s * config.motion.speed_fraction;
    limit.max_acceleration_rad_s2 = config.motion.acceleration_rad_s2;
    limit.max_jerk_rad_s3 = config.motion.jerk_rad_s3;
    rsi.limits.push_back(limit);
  }
  rsi.correction_limit_deg.assign(cell.robot.joints.size(), config.rsi.correction_limit_deg.at(0));
  rsi.validate();
  return rsi;
}

}  // namespace cellcal::daemon

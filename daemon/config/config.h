#pragma once
// The daemon's configuration file, format "cellcal.daemon/1". SI units and radians inside.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "calib/model/robot.h"
#include "daemon/config/http_config.h"
#include "daemon/config/notify_config.h"
#include "daemon/config/plant_config.h"
#include "daemon/config/schedule_config.h"
#include "daemon/session/touch_policy.h"
#include "drivers/contact/port/port.h"
#include "drivers/kuka/eki/eki_config.h"
#include "drivers/kuka/krl/krl_files.h"
#include "drivers/kuka/rsi/rsi_config.h"

namespace cellcal::daemon {

enum class BackendKind { kRsi, kEki, kMock };
/// How the controller is spoken to.
enum class WireKind { kRsi, kEki };

struct MotionConfig {
  double speed_fraction = 0.2;  ///< of the robot file's axis speeds
  double acceleration_rad_s2 = 0.0;
  double jerk_rad_s3 = 0.0;
  /// Speed limit of TCP, flange and elbow in T1, and with an unknown mode until a first calibration has ended; 0: none.
  double hand_speed_m_s = 0.225;
};

/// The emulated cell: what it is really like, and how its controller behaves.
struct MockConfig {
  WireKind wire = WireKind::kRsi;
  std::uint64_t seed = 1;
  double geometry_scale = 1.0;
  double deflection = -1.0;
  double gear_arcsec = 0.0;
  double compliance_rad_per_nm = 0.0;
  double play_arcsec = 0.0;
  double tip_offset_m = 0.0;
  /// Of the tip on the flange since everything was set up: a knock; x, y, z.
  std::vector<double> tool_shift_m{0.0, 0.0, 0.0};
  double growth = 0.0, warm_up_s = 60.0;
  double contact_noise_m = 0.0, bad_contact_share = 0.0;
  double placement_m = 0.001;
  double joint_noise_deg = 0.0005;
  double lag_s = 0.02;
  int cycle_ms = 4;
  double busy_every_s = 0.0;  ///< a busy computer: so often the sensor's bytes come late; 0: never
  bool wall_clock = false;    ///< what is recorded bears this computer's date, not one day of 2000
  std::vector<double> start_rad;
};

/// What is between the touch circuit's wires and a welding gun while it welds.
enum class Isolation { kNone, kPlug, kRelay };

struct DaemonConfig {
  BackendKind backend = BackendKind::kRsi;
  std::string text_sha256;  ///< of the file that it was read from; empty: of none
  std::filesystem::path state_dir, socket;
  std::optional<HttpConfig> http;  ///< none: the Unix socket alone
  bool log_debug = false;          ///< every step of a session
  MotionConfig motion;
  TouchPolicy touch;
  SearchLimits search_limits;  ///< that `touch` keeps, and a resumed session has to
  Timeouts timeouts;
  int retries = 0;      ///< harmless interruptions after which a session goes on by itself
  BusyRepeats repeats;  ///< likewise where this computer was late
  ScheduleConfig schedule;
  NotifyConfig notify;
  std::optional<PlantConfig> plant;
  std::optional<int> retain_days;  ///< raw rows of older sessions are dropped; none: kept
  std::optional<double>
      retain_megabytes;    ///< likewise of the oldest, until the journal uses no more
  drivers::RsiConfig rsi;  ///< without what depends on the robot file: see rsi_config_for()
  drivers::EkiConfig eki;  ///< likewise: see eki_config_for()
  drivers::EkiFilesConfig controller;  ///< what is installed on it, for EKI
  drivers::RsiFilesConfig rsi_files;   ///< likewise for RSI; its address may be empty
  bool realtime = true;
  drivers::PortOptions contact;
  Isolation isolation = Isolation::kNone;
  MockConfig mock;
};

/// The backend's wire, or the one that is emulated.
WireKind wire_of(const DaemonConfig& config);

/// Throws calib::FileError naming file, line and key; drivers::ConfigError.
DaemonConfig load_config(const std::filesystem::path& path);
DaemonConfig parse_config(std::string_view text, const std::string& name);

/// Why no session of [schedule] would begin without a person, with what to do; empty: nothing against it.
std::string unattended_obstacle(const DaemonConfig& config);

/// How far any axis may go from where it stands at RSI_ON.
double correction_limit_rad(const DaemonConfig& config);

/// The link's configuration with the axis limits of this cell's robot at the configured speed.
/// Throws drivers::ConfigError where the robot file lacks a limit.
drivers::RsiConfig rsi_config_for(const DaemonConfig& config, const calib::Cell& cell);
drivers::EkiConfig eki_config_for(const DaemonConfig& config, const calib::Cell& cell);
/// RSI's controller files with the ranges of this cell's first six axes. Throws
/// drivers::ConfigError where it has fewer.
drivers::RsiFilesConfig rsi_files_for(const DaemonConfig& config, const calib::Cell& cell);

}  // namespace cellcal::daemon

#pragma once
// The daemon's configuration file, format "cellcal.daemon/1". SI units and radians inside.

#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "calib/check/controller_model.h"
#include "calib/files/toml.h"
#include "calib/model/enum_table.h"
#include "calib/model/robot.h"
#include "daemon/config/network_config.h"
#include "daemon/config/unattended_config.h"
#include "daemon/session/touch_policy.h"
#include "drivers/contact/port/port.h"
#include "drivers/kuka/eki/eki_config.h"
#include "drivers/kuka/krl/krl_files.h"
#include "drivers/kuka/rsi/rsi_config.h"
#include "drivers/kuka/rsi/rsi_space.h"

namespace cellcal::daemon {

enum class BackendKind { kRsi, kEki, kMock };
constexpr const char* to_string(BackendKind kind) { return own_name(kind); }
/// Protocol of the controller.
enum class WireKind { kRsi, kEki };

struct MotionConfig {
  double speed_fraction = 0.2;  ///< of the robot file's axis speeds
  double acceleration_rad_s2 = 0.0;
  double jerk_rad_s3 = 0.0;
  double travel_acceleration_m_s2 = 0.5;  ///< of a linear unit, over RSI
  double travel_jerk_m_s3 = 5.0;
  /// Of a positioner's axes over RSI, and over EKI where the robot file states their own.
  double positioner_speed_rad_s = 0.0;
  double positioner_acceleration_rad_s2 = 0.0;
  double positioner_jerk_rad_s3 = 0.0;
  /// Speed limit of TCP, flange and elbow in T1, and with an unknown mode until the first calibration has
  /// completed; 0: none.
  double hand_speed_m_s = 0.225;
};

/// Emulated cell: its true geometry, and the behaviour of its controller.
struct MockConfig {
  WireKind wire = WireKind::kRsi;
  std::uint64_t seed = 1;
  double geometry_scale = 1.0;
  double deflection = -1.0;
  double gear_arcsec = 0.0;
  double wave_arcsec = 0.0;
  double compliance_rad_per_nm = 0.0;
  double play_arcsec = 0.0;
  double tip_offset_m = 0.0;
  /// Displacement of the tip on the flange since setup, by a collision; x, y, z.
  std::vector<double> tool_shift_m{0.0, 0.0, 0.0};
  double growth = 0.0, warm_up_s = 60.0;
  double contact_noise_m = 0.0, bad_contact_share = 0.0;
  double placement_m = 0.001;
  double joint_noise_deg = 0.0005;
  double lag_s = 0.02;
  int cycle_ms = 4;
  // The controller's own model of the arm, in what it sends alone.
  bool absolute_accuracy = false;     ///< that of the true arm
  std::string stated_robot;           ///< another robot file; empty: the cell's
  std::vector<double> stated_tool_m;  ///< x, y, z of another tool; empty: as configured
  double busy_every_s = 0.0;          ///< busy computer: period of delayed sensor bytes; 0: never
  bool wall_clock = false;        ///< records carry the real date instead of a fixed day in 2000
  std::vector<double> start_rad;  ///< of the arm
  std::optional<double> start_m;  ///< of its linear unit; none: the middle of the range
};

/// Isolation of the touch circuit's wires from the welding gun while it welds.
enum class Isolation { kNone, kPlug, kRelay };

struct DaemonConfig {
  BackendKind backend = BackendKind::kRsi;
  std::string text_sha256;  ///< of the parsed file; empty: not from a file
  std::filesystem::path state_dir, socket;
  std::optional<HttpConfig> http;  ///< none: Unix socket only
  bool log_debug = false;          ///< logs every step of a session
  calib::Language language;        ///< of documents and of the commands that print sentences
  MotionConfig motion;
  TouchPolicy touch;
  SearchLimits search_limits;  ///< limits of `touch`, also enforced on a resumed session
  Timeouts timeouts;
  int retries = 0;      ///< automatic continuations after harmless interruptions
  BusyRepeats repeats;  ///< likewise after lateness of this computer
  ScheduleConfig schedule;
  NotifyConfig notify;
  std::optional<PlantConfig> plant;
  std::optional<int> retain_days;  ///< raw rows of older sessions are deleted; none: kept
  /// Deletes the oldest until the journal is not larger; none: kept.
  std::optional<double> retain_megabytes;
  drivers::RsiConfig rsi;  ///< without the values from the robot file: see rsi_config_for()
  drivers::EkiConfig eki;  ///< likewise: see eki_config_for()
  drivers::EkiFilesConfig controller;  ///< programs installed for EKI
  drivers::RsiFilesConfig rsi_files;   ///< for RSI; the address may be empty
  bool realtime = true;
  drivers::PortOptions contact;
  Isolation isolation = Isolation::kNone;
  MockConfig mock;
};

/// Wire of the backend, or the emulated one.
WireKind wire_of(const DaemonConfig& config);

/// Throw calib::FileError naming file, line and key; drivers::ConfigError.
DaemonConfig load_config(const std::filesystem::path& path);
DaemonConfig parse_config(std::string_view text, const std::string& name);

/// Reason, with remedy, why no session of [schedule] can begin unattended; empty: none.
std::string unattended_obstacle(const DaemonConfig& config);

/// Limit of each axis relative to its position at RSI_ON.
double correction_limit_rad(const DaemonConfig& config);

/// At most this share of the arm's axis speeds, and a positioner's reduced by as much, except that its whole range
/// takes no longer than a session waits.
MotionConfig slowed(MotionConfig motion, const calib::Robot& robot, double most_speed);

/// Link configuration with the axis limits of this cell's robot at the configured speed. Throws
/// drivers::ConfigError where the robot file lacks a limit.
drivers::RsiConfig rsi_config_for(const DaemonConfig& config, const calib::Cell& cell);
drivers::EkiConfig eki_config_for(const DaemonConfig& config, const calib::Cell& cell);
/// RSI files for the controller, with the ranges of this cell's arm, and E1 where a linear unit carries it.
/// Throws drivers::ConfigError where it has fewer than six axes.
drivers::RsiFilesConfig rsi_files_for(const DaemonConfig& config, const calib::Cell& cell);

// Operator actions at the pendant; the single source of this wording.

/// Id of the phrase "start CELLCAL_RSI on the pendant ...", without a full stop.
const char* start_instruction(WireKind wire);

// Cartesian corrections of [rsi], and the arm model they are computed with.

/// correction, cart_tag, correction_frame, correction_limit_mm, correction_turn_limit_deg; to be called after
/// mode and [controller] are read. Throws calib::FileError.
void read_space(const calib::TomlTable& rsi, DaemonConfig& config);

/// Flange to the active TCP of the controller: that of the cell file where [controller] tool names a
/// TOOL_DATA, the flange for 0.
Eigen::Isometry3d controller_tcp(const DaemonConfig& config, const calib::Cell& cell);

/// $TOOL and $BASE of the controller's program where they are known: the flange and the world for 0,
/// the cell file's tool with corrections in space.
calib::StatedFrames stated_frames(const DaemonConfig& config, const calib::Cell& cell);

/// Nominal arm of the robot file with that TCP. Throws drivers::ConfigError unless it has six joints.
std::shared_ptr<const drivers::ArmGeometry> controller_arm(const DaemonConfig& config,
                                                           const calib::Cell& cell);

/// Postures that Cartesian corrections can pass; null for corrections of axes.
calib::Passable passable_in_space(const drivers::SpaceCorrection& space);

}  // namespace cellcal::daemon

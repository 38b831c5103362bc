#pragma once
// What can be said of the robot's link from what was seen of it. Pure: no socket, no time.

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "calib/model/robot.h"
#include "daemon/doctor/finding.h"
#include "drivers/kuka/eki/eki_report.h"
#include "drivers/kuka/rsi/rsi_report.h"
#include "drivers/robot.h"

namespace cellcal::daemon {

/// The controller's contact input beside the sensor, while both were looked at.
struct InputSeen {
  bool changed = false, contact_changed = false;
  /// While the contact circuit was open and nothing changed: the input as it should not be.
  bool on_while_open = false;
  bool on = false;  ///< newest: at its contact level
};
void judge_input(const std::string& check, const InputSeen& seen, int input, bool contact_is_on,
                 Findings& findings);

/// Of a link over RSI that was only listened to and held still.
struct RsiSeen {
  drivers::CoreState newest;        ///< of the link while it was up, if it ever was
  drivers::RobotState state;        ///< likewise: quality and words
  bool up = false;                  ///< packets came
  bool lost = false;                ///< and stopped
  bool refused = false;             ///< replies were not accepted at some time
  bool answered = false;            ///< the adapter knew the correction and replied
  std::uint64_t late_at_start = 0;  ///< late replies counted before ours can have arrived
  double first_packet_s = 0.0, observed_s = 0.0, waited_s = 0.0;
  std::string sender;
  std::uint64_t foreign = 0;
  /// How many replies took at most so many milliseconds: the histogram, coarsely.
  std::vector<std::pair<double, std::uint64_t>> replies_within;
  InputSeen input;
  std::string last_words;  ///< newest words of the adapter
  std::string listening;   ///< "UDP 10.0.0.5:49152"
};

struct RsiExpected {
  std::string sentype;
  int late_limit = 3;
  bool in_space = false;                      ///< [rsi] correction = "space"
  bool mode = true, override_percent = true;  ///< [rsi] mode_tag, override_tag: read
  int input = 0;  ///< $IN of [rsi] contact_tag; 0: there is no second stop path
};

void judge_rsi(const RsiSeen& seen, const RsiExpected& expected, Findings& findings);
/// Whether the controller ended RSI_MOVECORR at Stop; nothing: no Stop was sent.
void judge_rsi_end(std::optional<double> ended_after_s, Findings& findings);

/// Of a link over EKI that asked for no motion.
struct EkiSeen {
  drivers::EkiCoreState newest;  ///< of the link while it was up, if it ever was
  drivers::RobotState state;
  bool connected = false, up = false, lost = false;
  double observed_s = 0.0, waited_s = 0.0;
  std::string last_words;
  std::string peer;  ///< "172.31.1.147:54600"
  InputSeen input;
};

struct EkiExpected {
  bool by_input = true;  ///< [eki] stop = "input"
  int input = 1;
  bool contact_is_on = true;  ///< [controller] contact_level
};

void judge_eki(const EkiSeen& seen, const EkiExpected& expected, Findings& findings);

/// Joint angles [rad] against the robot file's limits; nothing known of the robot: skipped.
void judge_angles(const std::string& check, const drivers::AxisAngles& actual_rad,
                  const calib::Robot* robot, Findings& findings);

}  // namespace cellcal::daemon

#pragma once
// Findings about the robot's link from observed values. Pure: no socket, no time.

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "calib/check/controller_model.h"
#include "calib/model/robot.h"
#include "daemon/config/config.h"
#include "daemon/doctor/examiner.h"
#include "drivers/kuka/eki/eki_report.h"
#include "drivers/kuka/rsi/rsi_report.h"
#include "drivers/robot.h"

namespace cellcal::daemon {

/// The controller's contact input compared with the sensor during the observation.
struct InputSeen {
  bool changed = false, contact_changed = false;
  /// Active while the contact circuit was open and nothing changed: wrong level.
  bool on_while_open = false;
  bool on = false;  ///< newest: at its contact level
};
void judge_input(const std::string& check, const InputSeen& seen, int input, bool contact_is_on,
                 Findings& findings);

/// An RSI link that was only observed and held still.
struct RsiSeen {
  drivers::CoreState newest;        ///< newest state of the link while it was up, if ever
  drivers::RobotState state;        ///< likewise: quality and messages
  bool up = false;                  ///< packets arrived
  bool lost = false;                ///< and stopped
  bool refused = false;             ///< replies were rejected at some time
  bool answered = false;            ///< the adapter knew the correction and replied
  std::uint64_t late_at_start = 0;  ///< late replies before ours can have arrived
  double first_packet_s = 0.0, observed_s = 0.0, waited_s = 0.0;
  std::string sender;
  std::uint64_t foreign = 0;
  /// Number of replies within each limit [ms]: the coarse histogram.
  std::vector<std::pair<double, std::uint64_t>> replies_within;
  InputSeen input;
  calib::Phrase last_words;  ///< newest message of the adapter
  std::string listening;     ///< "UDP 10.0.0.5:49152"
};

struct RsiExpected {
  std::string sentype;
  int late_limit = 3;
  bool in_space = false;                      ///< [rsi] correction = "space"
  bool mode = true, override_percent = true;  ///< [rsi] mode_tag, override_tag are configured
  int input = 0;                              ///< $IN of [rsi] contact_tag; 0: no second stop path
};

void judge_rsi(const RsiSeen& seen, const RsiExpected& expected, Findings& findings);
/// Time from Stop to the end of RSI_MOVECORR; none: no Stop was sent.
void judge_rsi_end(std::optional<double> ended_after_s, Findings& findings);

/// An EKI link without motion requests.
struct EkiSeen {
  drivers::EkiCoreState newest;  ///< newest state of the link while it was up, if ever
  drivers::RobotState state;
  bool connected = false, up = false, lost = false;
  double observed_s = 0.0, waited_s = 0.0;
  calib::Phrase last_words;
  std::string peer;  ///< "172.31.1.147:54600"
  InputSeen input;
};

struct EkiExpected {
  bool by_input = true;  ///< [eki] stop = "input"
  int input = 1;
  bool contact_is_on = true;  ///< [controller] contact_level
};

void judge_eki(const EkiSeen& seen, const EkiExpected& expected, Findings& findings);

/// The controller's model of the arm. `sends`: its files send a TCP; `wire`: for the remedy.
void judge_model(const calib::ControllerModel& model, const calib::Robot& robot, bool sends,
                 WireKind wire, Findings& findings);

/// Joint angles [rad] compared with the robot file's limits; skipped without a robot file.
void judge_angles(const std::string& check, const drivers::AxisAngles& actual_rad,
                  const calib::Robot* robot, Findings& findings);

}  // namespace cellcal::daemon

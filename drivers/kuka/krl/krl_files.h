#pragma once
// The files that an integrator copies onto a KUKA controller, made from one configuration. krl/ has
// their templates and says where each of them goes.

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "drivers/kuka/rsi/rsi_config.h"

namespace cellcal::drivers {

/// What EKI's files need to know. Numbers are those of the controller.
struct EkiFilesConfig {
  std::string address = "172.31.1.147";  ///< the controller's, in its KLI network
  std::uint16_t port = 54600;            ///< 54600..54615 pass the controller's firewall
  int external_axes = 0;                 ///< 0..6, driven beside A1..A6
  int input = 1;                         ///< $IN that the contact sensor's output is wired to
  bool contact_is_on = true;      ///< $IN while the tool touches; off: a cut wire is contact, too
  int tool = 0, base = 0;         ///< TOOL_DATA, BASE_DATA; 0: $NULLFRAME
  int load = 0;                   ///< LOAD_DATA; 0: as the machine data have it
  int acceleration_percent = 50;  ///< $ACC_AXIS of all motions
  int alive_flag = 901, stop_flag = 902;  ///< $FLAG, used by nobody else
  int first_timer = 10;                   ///< $TIMER: this and the two behind it
  int first_interrupt = 20;  ///< priority of the input; flag and timer have the next two
  int state_ms = 20;         ///< between two states; the submit loop may be slower
  int dead_man_ms = 250;     ///< silence of the computer that stops the arm
  bool write_frames =
      false;  ///< with what reads and sets TOOL_DATA and BASE_DATA; else nothing of it
  bool write_advice = false;  ///< with CELLCAL_ADVICE, what the checks say; else nothing of it
  bool may_run = false;       ///< CC_MAY_RUN: this computer may start CELLCAL_EKI in EXT
  int cell_wait_s = 900;      ///< called by CELL, without a session: then it returns
  /// $OUT of $BRAKETEST_REQ_INT, $MASTERINGTEST_REQ_INT, and of a collision; 0: on none.
  int brake_test_output = 0, mastering_test_output = 0, collision_output = 0;

  /// Throws ConfigError naming the key, the value and what to do.
  void validate() const;
};

/// Of one axis, by the robot file.
struct AxisRange {
  double low_deg = -360.0, high_deg = 360.0;
};

/// For people: the releases of RSI, by their first number.
inline constexpr const char* kRsiVersions =
    "3 (KSS 8.2 to 8.4), 4 (KSS 8.5 and 8.6), 5 (KSS 8.7) or 6 (iiQKA.OS2)";
constexpr bool is_rsi_version(int version) { return version >= 3 && version <= 6; }
/// 5 has 4's files; the others have their own.
constexpr int rsi_format(int version) { return version == 5 ? 4 : version; }

/// What RSI's files need to know. Tags and limits have to be those of RsiConfig.
struct RsiFilesConfig {
  std::string pc_address;  ///< this computer's, in the controller's RSI subnet (not 192.168.0.x)
  std::uint16_t port = 49152;
  int rsi_version = 4;  ///< one of kRsiVersions
  std::string sentype = "ImFree", axis_tag = "AK", stop_tag = "Stop";
  std::string mode_tag = "Mode.R", override_tag = "OvPro.R";  ///< empty: not sent
  std::string contact_tag;  ///< likewise $IN[input], to which the contact sensor's output is wired
  int input = 1;
  CorrectionMode mode = CorrectionMode::kAbsolute;  ///< of RSI_ON; HOLDON of the axes follows it
  double correction_limit_deg = 90.0;  ///< of AXISCORR, which clamps in silence, and its monitor
  /// Of A1 to A6, beyond which the controller corrects no axis; empty: its software limit switches
  /// alone. Corrections in space have no such limits.
  std::vector<AxisRange> ranges_deg;
  SpaceCorrection space;             ///< on: POSCORR instead, with its tag, frame and limits
  int timeout_cycles = 100;          ///< late replies until KSS29002
  int flag = 901;                    ///< $FLAG, TRUE while the connection is interrupted
  int tool = 0, base = 0, load = 0;  ///< as EkiFilesConfig

  /// Throws ConfigError naming the key, the value and what to do.
  void validate() const;
};

/// File name to text: CRLF, Latin-1, KRL names of at most 24 characters.
using ControllerFiles = std::map<std::string, std::string>;

/// CellcalEki.xml, cellcal_eki.src, cellcal_eki.dat, cellcal_sub.sub. Throws ConfigError.
ControllerFiles eki_files(const EkiFilesConfig& config);

/// cellcal_rsi.src, cellcal_rsi_ethernet.xml, and the context: cellcal_rsi.rsi.xml, .rsi and
/// .rsi.diagram for RSI 3, cellcal_rsi.rsix from RSI 4 on. Six axes. Throws ConfigError.
ControllerFiles rsi_files(const RsiFilesConfig& config);

}  // namespace cellcal::drivers

#pragma once
// The files to be copied onto a KUKA controller, generated from one configuration. krl/ contains
// their templates and documents their destinations.

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/kuka/rsi/rsi_config.h"

namespace cellcal::drivers {

/// Configuration of the EKI files. Numbers are the controller's.
struct EkiFilesConfig {
  std::string address = "172.31.1.147";  ///< controller's address in the KLI network
  std::uint16_t port = 54600;            ///< 54600..54615 pass the controller's firewall
  int external_axes = 0;          ///< 0..6, in every command: driven with A1..A6, or held still
  int input = 1;                  ///< $IN that the contact sensor's output is wired to
  bool contact_is_on = true;      ///< $IN during contact; off: a broken wire reads as contact, too
  int tool = 0, base = 0;         ///< TOOL_DATA, BASE_DATA; 0: $NULLFRAME
  int load = 0;                   ///< LOAD_DATA; 0: from the machine data
  int acceleration_percent = 50;  ///< $ACC_AXIS of all motions
  int alive_flag = 901, stop_flag = 902;  ///< $FLAG, used by no other program
  int first_timer = 10;                   ///< $TIMER: this and the next two
  int first_interrupt = 20;   ///< priority of the input; flag and timer have the next two
  int state_ms = 20;          ///< between two states; the submit loop may be slower
  int dead_man_ms = 250;      ///< silence of the computer after which the arm is stopped
  bool write_frames = false;  ///< includes reading and setting of TOOL_DATA and BASE_DATA
  bool write_advice = false;  ///< includes CELLCAL_ADVICE, the advice of the checks
  bool may_run = false;       ///< CC_MAY_RUN: this computer may start CELLCAL_EKI in EXT
  int cell_wait_s = 900;      ///< maximum wait for a session when called by CELL
  /// $OUT of $BRAKETEST_REQ_INT, $MASTERINGTEST_REQ_INT, and of a collision; 0: none.
  int brake_test_output = 0, mastering_test_output = 0, collision_output = 0;

  /// Throws ConfigError naming key, value and remedy.
  void validate() const;
};

/// Range of one axis, from the robot file; of a linear unit [mm].
struct AxisRange {
  double low_deg = -360.0, high_deg = 360.0;
  bool linear = false;
};

/// Greatest correction of an external axis [deg], of a linear unit [mm]: its whole range, either way, and
/// what is measured beyond it.
constexpr double travel_limit(const AxisRange& range) {
  return range.high_deg - range.low_deg + 1.0;
}

/// Display text: the releases of RSI, by major version.
inline constexpr const char* kRsiVersions =
    "3 (KSS 8.2 to 8.4), 4 (KSS 8.5 and 8.6), 5 (KSS 8.7) or 6 (iiQKA.OS2)";
constexpr bool is_rsi_version(int version) { return version >= 3 && version <= 6; }
/// 5 uses the files of 4; the others have their own.
constexpr int rsi_format(int version) { return version == 5 ? 4 : version; }

/// Configuration of the RSI files. Tags and limits have to match RsiConfig.
struct RsiFilesConfig {
  std::string pc_address;  ///< this computer's, in the controller's RSI subnet (not 192.168.0.x)
  std::uint16_t port = 49152;
  int rsi_version = 4;  ///< one of kRsiVersions
  std::string sentype = "ImFree", axis_tag = "AK", external_axis_tag = "EK", stop_tag = "Stop";
  std::string mode_tag = "Mode.R", override_tag = "OvPro.R";  ///< empty: not sent
  std::string contact_tag;  ///< likewise $IN[input], the contact sensor's output
  int input = 1;
  CorrectionMode mode = CorrectionMode::kAbsolute;  ///< of RSI_ON; determines HOLDON of the axes
  double correction_limit_deg = 90.0;  ///< of AXISCORR (clamps silently) and its monitor
  int external_axes = 0;               ///< of the controller: in the packets, and watched there
  /// Ranges of E1 on that are corrected: of a linear unit, which is E1, and of a positioner's axes. Empty: no
  /// external axis is.
  std::vector<AxisRange> external;
  /// Ranges of A1 to A6 beyond which the controller does not correct; empty: only the software
  /// limit switches. Corrections in space have no such limits.
  std::vector<AxisRange> ranges_deg;
  SpaceCorrection space;             ///< if on, POSCORR instead, with its tag, frame and limits
  int timeout_cycles = 100;          ///< late replies before KSS29002
  int flag = 901;                    ///< $FLAG, TRUE during an interruption of the connection
  int tool = 0, base = 0, load = 0;  ///< as in EkiFilesConfig

  /// Throws ConfigError naming key, value and remedy.
  void validate() const;
};

/// File name to text: CRLF, Latin-1, KRL names of at most 24 characters.
using ControllerFiles = std::map<std::string, std::string>;

/// CellcalEki.xml, cellcal_eki.src, cellcal_eki.dat, cellcal_sub.sub. Throws ConfigError.
ControllerFiles eki_files(const EkiFilesConfig& config);

/// cellcal_rsi.src, cellcal_rsi_ethernet.xml, and the context: cellcal_rsi.rsi.xml, .rsi and
/// .rsi.diagram for RSI 3, cellcal_rsi.rsix from RSI 4 on. Six axes, and the corrected external
/// ones. Throws ConfigError.
ControllerFiles rsi_files(const RsiFilesConfig& config);

}  // namespace cellcal::drivers

namespace cellcal::drivers::krl {

// Text templates with placeholders "@NAME@": upper-case letters, digits and underscores.

using Places = std::map<std::string, std::string, std::less<>>;

/// The template of that name, as in krl/. Throws std::logic_error if there is none.
std::string_view template_text(std::string_view name);

/// Filled in, with CRLF line endings. A line that consists of one placeholder with an empty value
/// is removed. Throws std::logic_error for an unfilled placeholder: a defect, not a configuration
/// error.
std::string fill(std::string_view text, const Places& places);

/// A REAL with a decimal point, unrounded: a limit rounded down would clamp before the adapter does.
std::string decimal(double value);

/// Version number of this release.
std::string release();

}  // namespace cellcal::drivers::krl

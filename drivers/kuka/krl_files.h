#pragma once
// The files that an integrator copies onto a KUKA controller, made from one configuration. krl/ has
// their templates and says where each of them goes.

#include <cstdint>
#include <map>
#include <string>

namespace cellcal::drivers {

/// What EKI's files need to know. Numbers are those of the controller.
struct EkiFilesConfig {
  std::string address = "172.31.1.147";   ///< the controller's, in its KLI network
  std::uint16_t port = 54600;             ///< 54600..54615 pass the controller's firewall
  int external_axes = 0;                  ///< 0..6, driven beside A1..A6
  int input = 1;                          ///< $IN that the contact sensor's output is wired to
  int tool = 0, base = 0;                 ///< TOOL_DATA, BASE_DATA; 0: $NULLFRAME
  int load = 0;                           ///< LOAD_DATA; 0: as the machine data have it
  int acceleration_percent = 50;          ///< $ACC_AXIS of all motions
  int alive_flag = 901, stop_flag = 902;  ///< $FLAG, used by nobody else
  int first_timer = 10;                   ///< $TIMER: this and the two behind it
  int first_interrupt = 20;               ///< priority of the input; the flag's is the next
  int state_ms = 20;                      ///< between two states; the submit loop may be slower
  int dead_man_ms = 250;                  ///< silence of the computer that stops the arm

  /// Throws ConfigError naming the key, the value and what to do.
  void validate() const;
};

/// File name to text: CRLF, Latin-1, KRL names of at most 24 characters.
using ControllerFiles = std::map<std::string, std::string>;

/// CellcalEki.xml, cellcal_eki.src, cellcal_eki.dat, cellcal_sub.sub. Throws ConfigError.
ControllerFiles eki_files(const EkiFilesConfig& config);

}  // namespace cellcal::drivers

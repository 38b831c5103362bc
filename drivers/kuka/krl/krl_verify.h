#pragma once
// What can be said against a set of controller files before anything moves by them: as 'cellcal
// kuka-files' wrote it, as an integrator edited it, or as it was copied back from the controller.
//
// Looked at: that the files belong together (context, channel numbers, programs), that they say
// what the daemon's configuration says (addresses, SENTYPE, tags, limits), and that they avoid the
// traps that controllers fall into without a word: HOLDON against the mode, Precision below 4,
// limits that clamp, STOP with Channel on RSI 3.

#include <string>
#include <vector>

#include "drivers/kuka/krl/krl_files.h"
#include "drivers/kuka/rsi/rsi_config.h"

namespace cellcal::drivers {

struct FileFinding {
  std::string file;
  int line = 0;         ///< 0: of the file as a whole
  std::string words;    ///< what is wrong, and what belongs there
  bool refused = true;  ///< false: worth a look, no reason to stop
};

/// "FILE:LINE: words".
std::string to_string(const FileFinding& objection);

/// Refused ones first. Throws nothing that the files could cause; ConfigError where the
/// configuration itself cannot make files. An empty or wildcard pc_address is not compared.
std::vector<FileFinding> verify_rsi_files(const ControllerFiles& files,
                                          const RsiFilesConfig& config, CorrectionMode mode);
std::vector<FileFinding> verify_eki_files(const ControllerFiles& files,
                                          const EkiFilesConfig& config);

}  // namespace cellcal::drivers

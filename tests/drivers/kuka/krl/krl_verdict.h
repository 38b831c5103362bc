#pragma once
// Sets of controller files, modified by text replacement, and the resulting findings.

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "drivers/kuka/krl/krl_verify.h"

namespace cellcal::drivers {

inline RsiFilesConfig rsi_config(int version = 4) {
  RsiFilesConfig config;
  config.pc_address = "10.0.0.5";
  config.rsi_version = version;
  return config;
}

inline std::string all(const std::vector<FileFinding>& findings) {
  std::string text;
  for (const FileFinding& one : findings) {
    text += (one.refused ? "refused " : "warned ") + to_string(one) + "\n";
  }
  return text;
}

inline void replace(ControllerFiles& files, const std::string& name, const std::string& from,
                    const std::string& to) {
  std::string& text = files.at(name);
  const std::size_t at = text.find(from);
  ASSERT_NE(at, std::string::npos) << name << " does not hold " << from;
  text.replace(at, from.size(), to);
}

inline std::string verdict(const ControllerFiles& files, const RsiFilesConfig& config,
                           CorrectionMode mode = CorrectionMode::kAbsolute) {
  return all(verify_rsi_files(files, config, mode));
}

struct Spoiled {
  const char *file, *from, *to, *words;
  int version = 4;
};

}  // namespace cellcal::drivers

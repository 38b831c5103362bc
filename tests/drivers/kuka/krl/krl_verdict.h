#pragma once
// Sets of controller files, modified by text replacement, and the resulting findings.

#include <gtest/gtest.h>

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "drivers/kuka/krl/krl_read.h"
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

/// Each of them alone, in the files of `config_of(version)`, is refused with its words.
inline void expect_refused(std::span<const Spoiled> cases,
                           const std::function<RsiFilesConfig(int)>& config_of) {
  for (const Spoiled& one : cases) {
    const RsiFilesConfig config = config_of(one.version);
    ControllerFiles files = rsi_files(config);
    replace(files, one.file, one.from, one.to);
    const std::string said = verdict(files, config);
    EXPECT_NE(said.find(one.words), std::string::npos) << one.words << "\nsaid: " << said;
    EXPECT_EQ(said.rfind("refused", 0), 0u) << one.words << "\nsaid: " << said;
  }
}

/// Of RSI 3: the objects of the context, each with its parameters and inputs, are those of the model.
inline void expect_alike(const RsiContextFile& context, const RsiContextFile& model) {
  ASSERT_EQ(context.objects.size(), model.objects.size());
  for (const RsiObject& one : context.objects) {
    const RsiObject* drawn = model.only(one.type);
    ASSERT_NE(drawn, nullptr) << one.type;
    EXPECT_EQ(drawn->id, one.id);
    EXPECT_EQ(drawn->parameters.size(), one.parameters.size()) << one.type;
    ASSERT_EQ(drawn->inputs.size(), one.inputs.size()) << one.type;
    for (const RsiInput& input : one.inputs) {
      ASSERT_NE(drawn->input(input.index), nullptr);
      EXPECT_EQ(drawn->input(input.index)->from_index, input.from_index) << one.type;
    }
  }
}

}  // namespace cellcal::drivers

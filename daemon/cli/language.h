#pragma once
// Language of a command's sentences.

#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>

#include "calib/words/phrase.h"

namespace cellcal::daemon {

/// Adds --language.
void add_language(CLI::App& command, std::string& given);
/// As given, otherwise of the configuration; English where that cannot be read.
calib::Language language_of(const std::string& given, const std::filesystem::path& config);

}  // namespace cellcal::daemon

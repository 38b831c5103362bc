#pragma once
// Language of a command's sentences.

#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>

#include "calib/words/phrase.h"

namespace cellcal::daemon {

/// Adds --language.
void add_language(CLI::App& command, std::string& given);
/// Likewise, for say() alone.
void add_language(CLI::App& command);
/// In the language of this command's --language, otherwise of the environment.
std::string say(const calib::Phrase& phrase);
/// As given, otherwise of the first of LC_ALL, LC_MESSAGES and LANG that is set; English without a catalogue of it.
calib::Language language_of(const std::string& given);
/// As given, otherwise of the configuration where that is another than English, otherwise as above.
calib::Language language_of(const std::string& given, const std::filesystem::path& config);

}  // namespace cellcal::daemon

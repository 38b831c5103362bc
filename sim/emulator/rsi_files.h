#pragma once
// The controller's own files, loaded by the emulated controller as the real one does at RSI_CREATE.

#include <filesystem>

#include "sim/emulator/options.h"

namespace cellcal::sim {

/// Takes from RSI's ethernet XML where packets go, SENTYPE, tags, HOLDON and what is sent, and,
/// where a context is named (.rsi.xml or .rsix), Precision, Timeout, limits and monitor.
///
/// Throws std::invalid_argument with the controller's words where it would refuse, and
/// drivers::ConfigError where a file cannot be read. What a real controller would do and this one
/// does not emulate (channels that are crossed, packets without AIPos) is refused as well.
void load_rsi_files(const std::filesystem::path& channel, const std::filesystem::path& context,
                    EmulatorOptions& options);

}  // namespace cellcal::sim

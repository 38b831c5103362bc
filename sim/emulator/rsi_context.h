#pragma once
// RSI's signal flow context, loaded by the emulated controller as by the real one at RSI_CREATE.

#include "drivers/kuka/krl/krl_read.h"
#include "sim/emulator/options.h"

namespace cellcal::sim {

/// Reads Precision, Timeout, limits and monitor from `options.rsi_context` (.rsi.xml or .rsix), and
/// the packets' destination from `options.rsi_xml`, unless specified by other options.
///
/// Throws std::invalid_argument with the controller's message if the controller would refuse it,
/// and drivers::ConfigError if a file is not readable. Features of a real controller that are not
/// emulated (crossed channels) are refused as well.
void load_rsi_context(EmulatorOptions& options);

/// As above if there is a context, with the restrictions of the release: RSI 6 has no cycle of 12
/// ms.
void load_rsi(EmulatorOptions& options);

/// From parsed files. Throws as load_rsi_context().
void apply_context(const drivers::RsiContextFile& context, const drivers::RsiChannelFile& channel,
                   ControllerConfig& controller);

}  // namespace cellcal::sim

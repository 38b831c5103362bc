#pragma once
// The context of RSI's signal flow, loaded by the emulated controller as the real one does at
// RSI_CREATE.

#include "drivers/kuka/krl/krl_read.h"
#include "sim/emulator/options.h"

namespace cellcal::sim {

/// Takes Precision, Timeout, limits and monitor from `options.rsi_context` (.rsi.xml or .rsix), and
/// from `options.rsi_xml` beside it where packets go, unless that was said otherwise.
///
/// Throws std::invalid_argument with the controller's words where it would refuse, and
/// drivers::ConfigError where a file cannot be read. What a real controller would do and this one
/// does not emulate (channels that are crossed) is refused as well.
void load_rsi_context(EmulatorOptions& options);

/// Likewise where there is a context, and what the release allows: RSI 6 has no cycle of 12 ms.
void load_rsi(EmulatorOptions& options);

/// Of files that have been read. Throws as load_rsi_context().
void take_context(const drivers::RsiContextFile& context, const drivers::RsiChannelFile& channel,
                  ControllerConfig& controller);

}  // namespace cellcal::sim

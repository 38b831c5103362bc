#pragma once
// A set of RSI files being verified: for krl_verify_rsi.cc, krl_verify_space.cc and krl_rsi_fence.cc.

#include <string>

#include "drivers/kuka/krl/krl_findings.h"
#include "drivers/kuka/wire/xml_values.h"

namespace cellcal::drivers::krl {

/// Calls that exist in one release and not in the other.
struct RsiCalls {
  const char *load, *on, *set;
};
inline constexpr RsiCalls kCallsToRsi5{"RSI_CREATE", "RSI_ON", "RSI_SETPUBLICPAR"};
inline constexpr RsiCalls kCallsOfRsi6{"RSI_LOAD", "RSI_PROCESS_ON", "RSI_SETPARAMETER"};
constexpr const RsiCalls& calls_of(const RsiFilesConfig& config) {
  return config.rsi_version == 6 ? kCallsOfRsi6 : kCallsToRsi5;
}

/// Position of the call in a statement; npos: none.
inline std::size_t find_call(const std::string& line, const char* call) {
  return line.find(std::string(call) + '(');
}

struct RsiSet {
  const RsiFilesConfig& config;
  CorrectionMode mode;
  Findings& findings;
  const RsiChannelFile& channel;

  const RsiElement* received(const std::string& tag) const;
  const RsiElement* sent(const std::string& tag) const;  ///< case-insensitive
  /// Refuses a SEND element that RSI fills itself and is missing, or on a channel.
  void check_internal(const char* tag) const;
  /// RECEIVE tag of the correction's value `i`, from 1: "AK.A1", or "RKorr.X" in space.
  std::string tag(int i) const {
    if (!config.space.on) return fmt::format("{}.A{}", config.axis_tag, i);
    return fmt::format("{}.{}", config.space.tag,
                       wire::kFrameNames[static_cast<std::size_t>(i) - 1]);
  }
};

/// A number of the context and its location.
struct ParameterValue {
  double value = 0.0;
  int line = 0;  ///< the object's line if the parameter is absent
};
/// `usual`: the object's default for an absent parameter.
ParameterValue value_of(const RsiSet& set, const RsiContextFile& file, const RsiObject& object,
                        const std::string& name, double usual);
/// The object's input has to be connected to the channel that the ethernet XML assigns to the
/// element.
void check_wire(const RsiSet& set, const RsiContextFile& file, const RsiObject& object, int input,
                const std::string& ethernet, const std::string& tag);

/// Least bound of an object's number, in the direction of `sign`, by a key of [rsi].
struct Bound {
  std::string parameter;
  const char *key, *unit;
  double limit, usual, sign;
  const char* then;  ///< below it
};
inline constexpr const char* kClamped = "moves would be silently clamped";
inline constexpr const char* kStopped = "RSI would stop with KSS29000";
void check_bound(const RsiSet& set, const RsiContextFile& file, const RsiObject& object,
                 const Bound& bound);

/// HOLDON of a correction has to match the mode.
void check_hold(const RsiSet& set, const RsiElement& one);

/// POSCORR's limits, frame and monitor.
void check_space(const RsiSet& set, const RsiContextFile& file, const RsiObject& corrector);
/// Checks $TOOL and $BASE in the program, which corrections in space depend on.
void check_frames(const std::string& name, const std::string& text, const RsiFilesConfig& config,
                  Findings& findings);

/// Checks the context's objects, their wiring against the channel's numbers, and their limits.
void check_context(const RsiSet& set, const RsiContextFile& file);

}  // namespace cellcal::drivers::krl

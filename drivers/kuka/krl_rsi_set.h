#pragma once
// For krl_verify_rsi.cc and krl_verify_context.cc: one set of RSI's files under judgement.

#include <string>

#include "drivers/kuka/krl_objections.h"

namespace cellcal::drivers::krl {

struct RsiSet {
  const RsiFilesConfig& config;
  CorrectionMode mode;
  Objections& objections;
  const RsiChannelFile& channel;

  const RsiElement* received(const std::string& tag) const {
    for (const RsiElement& one : channel.receive) {
      if (one.tag == tag) return &one;
    }
    return nullptr;
  }
};

/// The context's objects, their wiring against the channel's numbers, and their limits.
void check_context(const RsiSet& set, const RsiContextFile& file);

}  // namespace cellcal::drivers::krl

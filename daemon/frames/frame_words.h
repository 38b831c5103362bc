#pragma once
// The words of what came of a frame; the only place that makes them.

#include <string>

#include "daemon/frames/frame_record.h"

namespace cellcal::daemon {

std::string not_configured_words();
/// Nothing was sent, or it was refused.
std::string not_sent_words(const FrameName& name, const drivers::EkiFrameResult& result);
std::string unknown_words(const FrameRecord& record, const std::string& why);
std::string outcome_words(const FrameRecord& record, const drivers::EkiFrameResult& result);

}  // namespace cellcal::daemon

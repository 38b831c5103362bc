#pragma once
// The words of what came of a frame; the only place that makes them.

#include <string>

#include "daemon/controller/frame_record.h"
#include "drivers/kuka/eki/eki_position.h"

namespace cellcal::daemon {

std::string not_configured_words();
/// Why a frame was not read or set, or nobody knows whether it was; and what to do.
std::string why_words(const drivers::EkiFrameResult& result);
/// Nothing was sent, or it was refused.
std::string not_sent_words(const FrameName& name, const drivers::EkiFrameResult& result);
std::string unknown_words(const FrameRecord& record, const std::string& why);
/// Why where the arm stands was not read, and what to do; and where it cannot be.
std::string position_words(const drivers::EkiPosition& position);
std::string no_position_words();
std::string outcome_words(const FrameRecord& record, const drivers::EkiFrameResult& result);

}  // namespace cellcal::daemon

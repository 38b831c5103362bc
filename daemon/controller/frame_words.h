#pragma once
// Text of the results of frame transfers; the single source of this wording.

#include <string>

#include "daemon/controller/frame_record.h"
#include "drivers/kuka/eki/eki_position.h"

namespace cellcal::daemon {

std::string not_configured_words();
/// Reason why a frame was not read or set, or why its state is unknown; with the remedy.
std::string why_words(const drivers::EkiFrameResult& result);
/// Nothing was sent, or the controller refused.
std::string not_sent_words(const FrameName& name, const drivers::EkiFrameResult& result);
std::string unknown_words(const FrameRecord& record, const std::string& why);
/// Reason why the arm's position was not read, with the remedy; and the text where it is not supported.
std::string position_words(const drivers::EkiPosition& position);
std::string no_position_words();
std::string outcome_words(const FrameRecord& record, const drivers::EkiFrameResult& result);

}  // namespace cellcal::daemon

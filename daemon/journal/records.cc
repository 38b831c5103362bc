#include "daemon/journal/records.h"

#include <algorithm>

namespace cellcal::daemon {

const char* to_string(RecordState state) {
  switch (state) {
    case RecordState::kRunning:
      return "running";
    case RecordState::kInterrupted:
      return "interrupted";
    case RecordState::kAborted:
      return "aborted";
    case RecordState::kFailed:
      return "failed";
    case RecordState::kDone:
      return "done";
    case RecordState::kDamaged:
      break;
  }
  return "damaged";
}

RecordState record_state_of(std::string_view text) {
  const auto state = std::find_if(kRecordStates.begin(), kRecordStates.end(),
                                  [&](RecordState one) { return text == to_string(one); });
  return state == kRecordStates.end() ? RecordState::kDamaged : *state;
}

}  // namespace cellcal::daemon

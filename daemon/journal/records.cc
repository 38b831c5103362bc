#include "daemon/journal/records.h"

namespace cellcal::daemon {

constexpr EnumNames<RecordState> kStateNames{{{RecordState::kRunning, "running"},
                                              {RecordState::kInterrupted, "interrupted"},
                                              {RecordState::kAborted, "aborted"},
                                              {RecordState::kFailed, "failed"},
                                              {RecordState::kDone, "done"},
                                              {RecordState::kDamaged, "damaged"}}};

const char* to_string(RecordState state) { return kStateNames[state]; }

RecordState record_state_of(std::string_view text) {
  return kStateNames.key_of(text).value_or(RecordState::kDamaged);
}

}  // namespace cellcal::daemon

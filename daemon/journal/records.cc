#include "daemon/journal/records.h"

namespace cellcal::daemon {

constexpr EnumNames<RecordState> kStateNames{{{RecordState::kRunning, "running"},
                                              {RecordState::kInterrupted, "interrupted"},
                                              {RecordState::kAborted, "aborted"},
                                              {RecordState::kFailed, "failed"},
                                              {RecordState::kDone, "done"},
                                              {RecordState::kDamaged, "damaged"}}};

const char* to_string(RecordState state) { return kStateNames[state]; }

std::string SessionRecord::failure_words(const calib::Language& language) const {
  return failure_said.empty() ? failure : calib::words(failure_said, language);
}

RecordState record_state_of(std::string_view text) {
  return kStateNames.key_of(text).value_or(RecordState::kDamaged);
}

}  // namespace cellcal::daemon

#include "calib/result/update.h"

#include "calib/model/enum_table.h"

namespace cellcal::calib {

namespace {

constexpr EnumNames<UpdateOutcome> kOutcomes{{{UpdateOutcome::kUpdated, "updated"},
                                              {UpdateOutcome::kNothingChanged, "nothing_changed"},
                                              {UpdateOutcome::kContradicted, "contradicted"},
                                              {UpdateOutcome::kNotResolved, "not_resolved"},
                                              {UpdateOutcome::kNotFound, "not_found"},
                                              {UpdateOutcome::kTooFewTouches, "too_few_touches"}}};

}  // namespace

const char* to_string(UpdateOutcome outcome) { return kOutcomes[outcome]; }
std::optional<UpdateOutcome> update_outcome(const std::string& name) {
  return kOutcomes.key_of(name);
}

}  // namespace cellcal::calib

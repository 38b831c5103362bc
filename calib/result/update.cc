#include "calib/result/update.h"

#include <array>

#include "calib/result/names.h"

namespace cellcal::calib {

namespace {

constexpr std::array kOutcomes = {Named{UpdateOutcome::kUpdated, "updated"},
                                  Named{UpdateOutcome::kNothingChanged, "nothing_changed"},
                                  Named{UpdateOutcome::kContradicted, "contradicted"},
                                  Named{UpdateOutcome::kNotResolved, "not_resolved"},
                                  Named{UpdateOutcome::kNotFound, "not_found"},
                                  Named{UpdateOutcome::kTooFewTouches, "too_few_touches"}};

}  // namespace

const char* to_string(UpdateOutcome outcome) { return name_of(kOutcomes, outcome); }
std::optional<UpdateOutcome> update_outcome(const std::string& name) {
  return named(kOutcomes, name);
}

}  // namespace cellcal::calib

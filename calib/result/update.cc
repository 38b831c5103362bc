#include "calib/result/update.h"

#include <regex>

#include "calib/model/enum_table.h"
#include "calib/result/finding_phrase.h"

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

Phrase calibration_phrase(const std::string& in_file) {
  static const std::regex kSession(R"(session (\d+) of (\d{4}-\d\d-\d\d))");
  std::smatch found;
  if (!std::regex_match(in_file, found, kSession)) return in_file;
  return {"say.session_of", {{"n", found[1].str()}, {"date", found[2].str()}}};
}

}  // namespace cellcal::calib

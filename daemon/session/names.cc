// Names of phases, events, actions and failures.

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

#include "calib/model/enum_table.h"
#include "calib/words/phrase_json.h"
#include "daemon/files/atomic_file.h"
#include "daemon/session/action.h"
#include "daemon/session/session.h"

namespace cellcal::daemon {

EventKind event_of(drivers::MoveOutcome outcome) {
  using drivers::MoveOutcome;
  using enum MoveOutcome;
  static constexpr EnumTable<MoveOutcome, EventKind> kTable{
      {{kArrived, EventKind::kArrived},
       {kContact, EventKind::kContact},
       {kRevoked, EventKind::kRevoked},
       {kStopped, EventKind::kStopped},
       {kUnexpectedContact, EventKind::kUnexpectedContact},
       {kStillInContact, EventKind::kStillInContact},
       {kContactSilent, EventKind::kContactSilent},
       {kRobotSilent, EventKind::kRobotSilent},
       {kRefused, EventKind::kRefused},
       {kNotFollowing, EventKind::kNotFollowing}}};
  return kTable[outcome];
}

const char* name_of(const Action& action) {
  // In the order of the alternatives.
  static constexpr std::array kNames{
      "make plan",     "find route",     "choose touch", "take answer",   "assess",
      "identify",      "write report",   "open devices", "rereference",   "arm sensor",
      "disarm",        "self-test",      "begin move",   "stop arm",      "close devices",
      "record plan",   "record reading", "record touch", "check journal", "record interruption",
      "record search", "record end"};
  static_assert(kNames.size() == std::variant_size_v<Action>);
  return kNames[action.index()];
}

/// Separates a failure's kind from its detail.
constexpr std::string_view kKindSeparator = ": ";
constexpr const char* kFailureFormat = "cellcal.failure/1";

calib::Phrase phrase(const Failure& failure) {
  return {"say.failure", {{"kind", to_string(failure.kind)}, {"detail", failure.detail}}};
}

std::string describe(const Failure& failure, const calib::Language& language) {
  return printable(calib::words(phrase(failure), language));
}

std::string to_journal(const Failure& failure) { return describe(failure); }

std::string failure_to_json(const Failure& failure) {
  const nlohmann::json value{{"format", kFailureFormat}, {"said", calib::to_json(phrase(failure))}};
  return value.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

calib::Phrase failure_said_in(std::string_view json) try {
  const nlohmann::json value = nlohmann::json::parse(json);
  return value.at("format") == kFailureFormat ? calib::phrase_of(value.at("said"))
                                              : calib::Phrase();
} catch (const std::exception&) {  // of another version, or damaged: the English text stays
  return {};
}

Failure failure_from_journal(std::string_view text) {
  const std::size_t end = std::min(text.find(kKindSeparator.front()), text.size());
  Failure failure;
  failure.detail = std::string(text.substr(std::min(text.size(), end + kKindSeparator.size())));
  failure.kind = by_own_name<FailureKind, '-'>(text.substr(0, end)).value_or(failure.kind);
  return failure;
}

}  // namespace cellcal::daemon

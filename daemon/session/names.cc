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

const char* to_string(drivers::ContactEventKind kind) {
  using enum drivers::ContactEventKind;
  static constexpr EnumNames<drivers::ContactEventKind> kTable{
      {{kTrip, "trip"}, {kContact, "contact"}, {kRevoked, "revoked"}, {kRelease, "release"}}};
  return kTable[kind];
}

constexpr EnumNames<Phase> kPhaseNames{{{Phase::kIdle, "idle"},
                                        {Phase::kPlanning, "planning"},
                                        {Phase::kConnecting, "connecting"},
                                        {Phase::kReferencing, "referencing"},
                                        {Phase::kRouting, "routing"},
                                        {Phase::kFreeing, "freeing"},
                                        {Phase::kProving, "proving"},
                                        {Phase::kTransit, "transit"},
                                        {Phase::kArmingFast, "arming fast"},
                                        {Phase::kFastSearch, "fast search"},
                                        {Phase::kBackingOff, "backing off"},
                                        {Phase::kArmingSlow, "arming slow"},
                                        {Phase::kSlowSearch, "slow search"},
                                        {Phase::kRecording, "recording"},
                                        {Phase::kRetreat, "retreat"},
                                        {Phase::kChoosing, "choosing"},
                                        {Phase::kReturning, "returning"},
                                        {Phase::kIdentifying, "identifying"},
                                        {Phase::kReporting, "reporting"},
                                        {Phase::kRecovering, "recovering"},
                                        {Phase::kWatching, "watching the links"},
                                        {Phase::kStopping, "stopping"},
                                        {Phase::kDone, "done"},
                                        {Phase::kAborted, "aborted"},
                                        {Phase::kFailed, "failed"}}};

const char* to_string(Phase phase) { return kPhaseNames[phase]; }

std::optional<Phase> phase_of(std::string_view name) { return kPhaseNames.key_of(name); }

const char* to_string(EventKind kind) {
  using enum EventKind;
  static constexpr EnumNames<EventKind> kTable{{{kRun, "run"},
                                                {kAbort, "abort"},
                                                {kPlanned, "planned"},
                                                {kRouted, "routed"},
                                                {kAssessed, "assessed"},
                                                {kIdentified, "identified"},
                                                {kReported, "reported"},
                                                {kWorkFailed, "work failed"},
                                                {kLinks, "links"},
                                                {kDeviceFailed, "device failed"},
                                                {kArmed, "armed"},
                                                {kArmRefused, "arm refused"},
                                                {kArrived, "arrived"},
                                                {kContact, "contact"},
                                                {kRevoked, "revoked"},
                                                {kStopped, "stopped"},
                                                {kUnexpectedContact, "unexpected contact"},
                                                {kStillInContact, "still in contact"},
                                                {kContactSilent, "contact silent"},
                                                {kRobotSilent, "robot silent"},
                                                {kRefused, "refused"},
                                                {kNotFollowing, "not following"},
                                                {kRecorded, "recorded"},
                                                {kJournalSound, "journal sound"},
                                                {kJournalFailed, "journal failed"},
                                                {kDeadline, "deadline"}}};
  return kTable[kind];
}

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

constexpr EnumNames<FailureKind> kFailureNames{
    {{FailureKind::kPlan, "plan"},
     {FailureKind::kNotFound, "not-found"},
     {FailureKind::kPlanChanged, "plan-changed"},
     {FailureKind::kDevice, "device"},
     {FailureKind::kLinkNotReady, "link-not-ready"},
     {FailureKind::kContactFault, "contact-fault"},
     {FailureKind::kContactClosed, "contact-closed"},
     {FailureKind::kArmRefused, "arm-refused"},
     {FailureKind::kNoContact, "no-contact"},
     {FailureKind::kContactTooEarly, "contact-too-early"},
     {FailureKind::kUnexpectedContact, "unexpected-contact"},
     {FailureKind::kStillInContact, "still-in-contact"},
     {FailureKind::kReadingsDisagree, "readings-disagree"},
     {FailureKind::kTooManyRevoked, "too-many-revoked"},
     {FailureKind::kContactSilent, "contact-silent"},
     {FailureKind::kComputerBusy, "computer-busy"},
     {FailureKind::kRobotSilent, "robot-silent"},
     {FailureKind::kMoveRefused, "move-refused"},
     {FailureKind::kNotFollowing, "not-following"},
     {FailureKind::kStoppedElsewhere, "stopped-elsewhere"},
     {FailureKind::kTimeout, "timeout"},
     {FailureKind::kStopUnconfirmed, "stop-unconfirmed"},
     {FailureKind::kJournal, "journal"},
     {FailureKind::kIdentify, "identify"},
     {FailureKind::kReport, "report"},
     {FailureKind::kAttended, "attended"},
     {FailureKind::kControllerTest, "controller-test"},
     {FailureKind::kWindowOver, "window-over"},
     {FailureKind::kDaemonStopped, "daemon-stopped"},
     {FailureKind::kUnexpectedEvent, "unexpected-event"}}};

const char* to_string(FailureKind kind) { return kFailureNames[kind]; }

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
  failure.kind = kFailureNames.key_of(text.substr(0, end)).value_or(failure.kind);
  return failure;
}

}  // namespace cellcal::daemon

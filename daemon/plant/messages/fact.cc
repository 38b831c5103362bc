#include "daemon/plant/messages/fact.h"

namespace cellcal::daemon::plant {

namespace {

const char* name_of(const SessionFact&) { return "session"; }
const char* name_of(const CalibrationFact&) { return "calibration"; }
const char* name_of(const CheckFact&) { return "check"; }
const char* name_of(const ActivationFact&) { return "activation"; }
const char* name_of(const CertificateFact&) { return "certificate"; }
const char* name_of(const AlarmFact&) { return "alarm"; }
const char* name_of(const AnswerFact&) { return "answer"; }
const char* name_of(const PhaseFact&) { return "phase"; }
const char* name_of(const TouchFact&) { return "touch"; }
const char* name_of(const HealthFact&) { return "health"; }
const char* name_of(const DroppedFact&) { return "dropped"; }

}  // namespace

const char* kind_of(const FactBody& body) {
  return std::visit([](const auto& one) { return name_of(one); }, body);
}

Worth worth_of(const FactBody& body) {
  const bool telemetry = std::holds_alternative<PhaseFact>(body) ||
                         std::holds_alternative<TouchFact>(body) ||
                         std::holds_alternative<HealthFact>(body);
  return telemetry ? Worth::kTelemetry : Worth::kResult;
}

}  // namespace cellcal::daemon::plant

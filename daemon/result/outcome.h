#pragma once
// The outcome of a session that came to its end: what status, journal, page, commands, metrics, plant, webhook and
// readiness show. Sentences: outcome_words.h; as a document: outcome_json.h.

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "calib/result/drift_chart.h"
#include "calib/result/finding.h"
#include "calib/result/tcp_check.h"
#include "calib/result/update.h"
#include "daemon/result/session_result.h"

namespace cellcal::daemon {

enum class OutcomeKind {
  kPublished,
  kWithheld,
  // Of a check.
  kHolds,
  kDoesNotHold,
  kUndecided,
  // Of a qualification.
  kQualified,
  kNotQualified,
  kFound,       ///< the spheres
  kNothingMet,  ///< a dry run
  // Of an update.
  kUpdated,
  kNothingChanged,
  kUpdateWithheld,
};
inline constexpr std::array kOutcomeKinds{
    OutcomeKind::kPublished,    OutcomeKind::kWithheld,       OutcomeKind::kHolds,
    OutcomeKind::kDoesNotHold,  OutcomeKind::kUndecided,      OutcomeKind::kQualified,
    OutcomeKind::kNotQualified, OutcomeKind::kFound,          OutcomeKind::kNothingMet,
    OutcomeKind::kUpdated,      OutcomeKind::kNothingChanged, OutcomeKind::kUpdateWithheld};

/// "does_not_hold". Of a name that is none, nothing.
const char* to_string(OutcomeKind kind);
std::optional<OutcomeKind> outcome_kind(const std::string& name);
/// The session brought what it was made for. An update that finds nothing changed did.
bool is_good(OutcomeKind kind);

/// Of a check: the tool's tip against the flange, were that what changed.
struct TcpShift {
  Eigen::Vector3d shift_m = Eigen::Vector3d::Zero();  ///< flange frame
  double u_m = 0.0;                                   ///< U(k=2) of its length
};

struct SessionOutcome {
  OutcomeKind kind = OutcomeKind::kPublished;
  std::size_t touches = 0;  ///< that it rests on; of a dry run the stand-offs reached
  // Of a check.
  std::optional<TcpShift> tcp_shift = {};  ///< none: too few touches met anything
  /// What changed, likeliest; of a check that does not hold, or an update.
  std::optional<calib::Explanation> change = {};
  std::vector<std::string> not_found = {};  ///< targets of which a touch met nothing, each once
  std::vector<std::string> unsteady =
      {};  ///< targets of which a touch gave no contact point, each once
  calib::DriftAdvice remedy = calib::DriftAdvice::kNone;
  // Of a find.
  std::vector<FoundSphere> spheres = {};
  // Of a qualification.
  std::vector<QualificationFinding> not_as_stated = {};
  // Of a calibration or an update.
  std::vector<calib::FindingKind> withheld_by = {};  ///< each once
  std::optional<calib::UpdateOutcome> update = {};
};

SessionOutcome outcome_of(const SessionResult& result);
/// Name of the cause: of the likeliest change, the first finding that withholds, or what is not as stated first. Empty: none.
std::string cause_of(const SessionOutcome& outcome);
/// Of a calibration or an update: whether it was published; none of all else.
std::optional<bool> published(const SessionOutcome& outcome);

// The sentences of an outcome, made here and nowhere else: number first, then what to do.

/// The first line is the outcome, those after it its evidence and what to do.
std::vector<std::string> words(const SessionOutcome& outcome);
/// "S1: centre_mm = [1200.00, 0.00, 300.00]  # +- 5 mm (k=2), 9 touches", as the cell file has it.
std::string words(const FoundSphere& sphere);

}  // namespace cellcal::daemon

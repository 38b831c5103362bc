#pragma once
// Outcome of a completed session, as shown by status, journal, page, commands, metrics, plant, webhook and
// readiness. Sentences and JSON: outcome_json.h.

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "calib/check/mastered.h"
#include "calib/model/enum_table.h"
#include "calib/result/calibration.h"
#include "calib/result/drift_chart.h"
#include "calib/result/finding.h"
#include "calib/result/tcp_check.h"
#include "calib/result/update.h"
#include "daemon/result/qualification.h"

namespace cellcal::daemon {

// Result of a session: one value per kind. The session passes it through unread; tasks create it and write
// its files, the journal stores its outcome (outcome.h).

struct FoundSphere {
  std::string target;
  /// Base frame of the nominal arm; of one on a positioner the frame of the axis that carries it.
  Eigen::Vector3d centre_m = Eigen::Vector3d::Zero();
  double u_m = 0.0;  ///< U(k=2) of each component
  int touches = 0;
  /// From the centre in the cell file; none where the file has none.
  std::optional<double> moved_m;
  std::string on = {};                  ///< that axis; empty: the floor
  std::vector<double> taught_rad = {};  ///< angles of its carriers while it was touched
};
struct FoundSpheres {
  std::vector<FoundSphere> spheres;
};

/// Completed from stand-off to stand-off without contact.
struct DryRun {
  std::size_t standoffs = 0;
};

/// A struct, so that a session's state can hold it as an incomplete type. An update is a calibration with
/// `calibration.update`.
struct SessionResult {
  std::variant<calib::Calibration, calib::TcpCheck, Qualification, FoundSpheres, DryRun> of;
  std::vector<calib::MasteredZero> mastered = {};  ///< of a check after mastering

  /// Null: another kind.
  const calib::Calibration* calibration() const { return std::get_if<calib::Calibration>(&of); }
};

enum class OutcomeKind {
  kPublished,
  kWithheld,
  // Check.
  kHolds,
  kDoesNotHold,
  kUndecided,
  // Qualification.
  kQualified,
  kNotQualified,
  kFound,       ///< spheres located
  kNothingMet,  ///< a dry run without contact
  // Update.
  kUpdated,
  kNothingChanged,
  kUpdateWithheld,
};
inline constexpr auto kOutcomeKinds = all_values<OutcomeKind>();

/// "does_not_hold"
constexpr const char* to_string(OutcomeKind kind) { return own_name(kind); }
/// True if the session achieved its purpose, including an update that finds nothing changed.
bool is_good(OutcomeKind kind);

/// Displacement of the TCP in the flange frame found by a check, under the assumption that only the tool changed.
struct TcpShift {
  Eigen::Vector3d shift_m = Eigen::Vector3d::Zero();  ///< flange frame
  double u_m = 0.0;                                   ///< U(k=2) of its length
};

struct SessionOutcome {
  OutcomeKind kind = OutcomeKind::kPublished;
  std::size_t touches = 0;  ///< evidence of the outcome; of a dry run the stand-offs reached
  // Check.
  std::optional<TcpShift> tcp_shift = {};  ///< none: too few touches with contact
  /// Most likely change; of a check that does not hold, or an update.
  std::optional<calib::Explanation> change = {};
  std::vector<std::string> not_found = {};  ///< targets with a touch without contact, each once
  /// Targets with a touch without a valid contact point, each once.
  std::vector<std::string> unsteady = {};
  std::vector<calib::MasteredZero> zeros = {};  ///< after mastering: those that do not hold
  calib::DriftAdvice remedy = calib::DriftAdvice::kNone;
  // Search for spheres.
  std::vector<FoundSphere> spheres = {};
  // Qualification.
  std::vector<QualificationFinding> not_as_stated = {};
  std::vector<calib::Phrase> contacts = {};  ///< its figures and deviations, with their remedies
  // Calibration or update.
  std::vector<calib::FindingKind> withheld_by = {};  ///< each once
  std::optional<calib::UpdateOutcome> update = {};
};

SessionOutcome outcome_of(const SessionResult& result);
/// Name of the cause: most likely change, first withholding finding, or first deviation from the stated
/// values. Empty: none.
std::string cause_of(const SessionOutcome& outcome);
/// True if a calibration or update was published; none for other sessions.
std::optional<bool> published(const SessionOutcome& outcome);

// Sentences of an outcome; the single source of this wording: number first, then the remedy.

/// The first line is the outcome, followed by its evidence and the remedy.
std::vector<calib::Phrase> phrases(const SessionOutcome& outcome);
/// "S1: centre_mm = [1200.00, 0.00, 300.00]  # ± 5 mm (k=2), 9 touches", in the cell file's syntax; of
/// one on a positioner with `on` and `taught_deg`.
calib::Phrase phrase(const FoundSphere& sphere);

}  // namespace cellcal::daemon

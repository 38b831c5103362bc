#pragma once
// Rows of a session that a certificate is made of, and entries made of them.

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "calib/model/touch.h"
#include "calib/result/calibration.h"
#include "daemon/archive/archive.h"
#include "daemon/certificate/certificate.h"
#include "daemon/journal/journal.h"
#include "daemon/session/phase.h"

namespace cellcal::daemon::certificate {

inline constexpr int kMmDecimals = 3;

/// Fixed number of decimals, with a typographic minus sign.
Entry figure(double value, const std::string& unit, int decimals, const std::string& from);
/// With an ASCII minus, for values copied into files.
Entry raw_figure(double value, const std::string& unit, int decimals, const std::string& from);
/// A time of the journal in this computer's local time, with its zone.
Entry local(const Entry& utc);
/// "2026-11-22 19:05:00 CET (UTC+0100)"; empty for an invalid time. Not escaped.
std::string local_words(const std::string& iso);

/// A change of phase, from which interruptions are listed.
struct Change {
  std::int64_t row = 0;
  std::string time, from_phase, event;
  std::optional<Phase> from, to;  ///< none: a phase of another version
};

struct Sources {
  SessionRecord record;
  std::vector<calib::Touch> touches;
  std::optional<Compared> compared;
  std::vector<Change> changes;
  std::string rows_sha256;
  calib::Calibration calibration;
  std::optional<calib::Calibration> earlier;  ///< from `compared`, if readable
  nlohmann::json calibration_json, cell_json, robot_json;

  // Origins are "calibration#/POINTER", "cell#..." or "robot#..."; not stated where it is missing.

  /// String or integer.
  Entry text(const std::string& from) const;
  Entry number(const std::string& from, const std::string& unit, int decimals) const;
  /// Twice that value: expanded uncertainty of a sigma.
  Entry expanded(const std::string& from, const std::string& unit, int decimals) const;
  /// Length of an array; otherwise 0.
  std::size_t size(const std::string& from) const;

 private:
  const nlohmann::json* at(const std::string& from) const;
};

/// Throws ArchiveError, JournalError, calib::FileError where the export or its session cannot be read;
/// Refused where it has no calibration or was not completed.
Sources read_sources(const Archive& archive, const std::string& from);

/// Touches rejected by the fit or among the check touches.
std::vector<bool> outliers_of(const Sources& sources);

// Figures of accuracy, as parts of the content (figures.cc).

/// "scope" to "figures", and "poses".
void add_figures(const Sources& sources, CertificateData& data);
/// Rule under which the verdict published the calibration, from its findings; null: its values were not recorded.
nlohmann::ordered_json decision(const Sources& sources);
nlohmann::ordered_json length_checks(const Sources& sources);
/// "uncertainty_budget".
void add_budget(const Sources& sources, CertificateData& data);
/// Pose accuracy of held-out touches and repeatability, in the terms of ISO 9283; null without touches for it.
nlohmann::ordered_json pose_sheet(const Sources& sources);

}  // namespace cellcal::daemon::certificate

#pragma once
// Rows of one session and the entries derived from them, each with its origin.

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "calib/model/touch.h"
#include "calib/result/calibration.h"
#include "daemon/archive/archive.h"
#include "daemon/journal/journal.h"
#include "daemon/session/phase.h"

namespace cellcal::daemon::certificate {

// Entry of a certificate with its origin (README, Origins).

struct Entry {
  std::string text;               ///< as printed, not escaped; empty: not stated
  std::string from;               ///< origin
  std::optional<double> value{};  ///< of a number, in `unit`, with full precision
  std::string unit{};

  bool stated() const { return !text.empty(); }
};

/// As in the documents: text, value, unit, origin.
nlohmann::ordered_json to_value(const Entry& entry);

/// Fixed number of decimals, with a typographic minus sign.
Entry figure(double value, const std::string& unit, int decimals, const std::string& from);
/// With an ASCII minus, for values copied into files.
Entry raw_figure(double value, const std::string& unit, int decimals, const std::string& from);
/// A time of the journal in this computer's local time, with its zone.
Entry local(const Entry& utc);
/// "2026-11-22 19:05:00 CET (UTC+0100)"; empty for an invalid time. Not escaped.
std::string local_words(const std::string& iso);

/// The coverage factor.
inline constexpr double kCoverage = 2.0;

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

  /// String or integer at the pointer into "calibration", "cell" or "robot"; not stated where it is missing.
  Entry text(const std::string& source, const std::string& pointer) const;
  Entry number(const std::string& source, const std::string& pointer, const std::string& unit,
               int decimals) const;
  /// Twice that value: expanded uncertainty of a sigma.
  Entry expanded(const std::string& source, const std::string& pointer, const std::string& unit,
                 int decimals) const;
  /// Column of the session's row.
  Entry session(const char* column, const std::string& text) const;
  std::size_t size(const std::string& source, const std::string& pointer) const;

 private:
  const nlohmann::json* at(const std::string& source, const std::string& pointer) const;
};

/// Throws ArchiveError, JournalError, calib::FileError where the export or its session cannot be read;
/// Refused where it has no calibration or was not completed.
Sources read_sources(const Archive& archive, const std::string& from);

}  // namespace cellcal::daemon::certificate

#pragma once
// The rows of one session, and what is taken out of them: each entry with its origin.

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

// What stands on a certificate beside the form's own words, and where it was taken from (README, Origins).

struct Entry {
  std::string text;               ///< as printed, not escaped; empty: not stated
  std::string from;               ///< origin
  std::optional<double> value{};  ///< of a number, in `unit`, all its digits
  std::string unit{};

  bool stated() const { return !text.empty(); }
};

/// Fixed decimals, a real minus sign.
Entry figure(double value, const std::string& unit, int decimals, const std::string& from);
/// The same with the ASCII minus, for what people copy into files.
Entry raw_figure(double value, const std::string& unit, int decimals, const std::string& from);
/// A time as the journal has it, by the clock on the wall of this computer, with its zone.
Entry local(const Entry& utc);
/// "2026-11-22 19:05:00 CET (UTC+0100)"; empty where it is no time. Not escaped.
std::string local_words(const std::string& iso);

/// The coverage factor.
inline constexpr double kCoverage = 2.0;

/// A change of phase, of which a certificate names the breaks.
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
  std::optional<calib::Calibration> earlier;  ///< of `compared`, where it can be read
  nlohmann::json calibration_json, cell_json, robot_json;

  /// A string, or a whole number, as it stands at the pointer into "calibration", "cell" or "robot"; not
  /// stated where there is none.
  Entry text(const std::string& source, const std::string& pointer) const;
  Entry number(const std::string& source, const std::string& pointer, const std::string& unit,
               int decimals) const;
  /// Twice that: expanded uncertainty of a sigma.
  Entry expanded(const std::string& source, const std::string& pointer, const std::string& unit,
                 int decimals) const;
  /// Column of the session's row.
  Entry session(const char* column, const std::string& text) const;
  std::size_t size(const std::string& source, const std::string& pointer) const;

 private:
  const nlohmann::json* at(const std::string& source, const std::string& pointer) const;
};

/// Throws ArchiveError, JournalError, calib::FileError where the export or its session cannot be read;
/// Refused where it has no calibration, or was not done.
Sources read_sources(const Archive& archive, const std::string& from);

}  // namespace cellcal::daemon::certificate

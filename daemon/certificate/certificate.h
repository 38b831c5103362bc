#pragma once
// Certificate of a published calibration: the printed values, each with its origin (README.md), and the files
// made from it.

#include <array>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "calib/model/parameter_key.h"
#include "calib/model/touch.h"
#include "calib/result/calibration.h"
#include "calib/words/phrase.h"
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
void to_json(nlohmann::ordered_json& value, const Entry& entry);

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

// Entries and the pose sheet in the certificate's HTML.

/// The entry with its origin, numbers with the document's decimal mark; `otherwise`, an id of the catalogue or a sign,
/// where it is not stated.
std::string shown(const Entry& entry, const char* otherwise = "say.report.not_stated");
/// The number followed by its unit.
std::string with_unit(const Entry& entry, const char* otherwise = "\xE2\x80\x93");
/// The unit only, as "unit(origin)".
std::string unit(const Entry& entry);
/// A constant of the method (README, Origins).
std::string constant(const char* name);
/// Printed value of the constant.
std::string_view value_of_constant(std::string_view name);

/// The style sheet, without the <style> tags.
const char* style_sheet();

// Pose accuracy and repeatability in the terms of ISO 9283, where the session has touches for it.

/// Held-out touches of one artefact.
struct PoseAccuracyRow {
  Entry target, poses, mean, largest, predicted;
};
/// Touches repeated at one place; `first` is the number of the first of them.
struct PoseRepeatabilityRow {
  Entry target, first, repeats, mean, sigma, rp, predicted;
};
struct PoseSheetData {
  std::vector<PoseAccuracyRow> accuracy;
  std::vector<PoseRepeatabilityRow> repeatability;
  bool empty() const { return accuracy.empty() && repeatability.empty(); }
};

PoseSheetData pose_sheet_of(const Sources& sources, const std::vector<bool>& outlier);
/// A section; empty without touches for it.
std::string pose_sheet_html(const PoseSheetData& sheet);
/// null without.
nlohmann::ordered_json pose_sheet_json(const PoseSheetData& sheet);

/// A certificate is refused; the reason.
struct Refused : std::runtime_error {
  enum class Why {
    kNoCalibration,
    kNotDone,
    kWithheld,
    kUpdate,
    kNotReproduced,  ///< the recomputed result differs
    kNotProven,      ///< no known key vouches for the rows
  };
  Refused(Why reason, const std::string& words) : std::runtime_error(words), why(reason) {}
  Why why;
};

/// Issuer, time and software.
struct Issue {
  std::string utc;  ///< ISO 8601
  std::string by;   ///< empty: not stated
  std::string software;
};

struct Artefact {
  Entry id, kind, diameter, expanded, serial, certificate, date;
};
struct Length {
  Entry from, to, length, expanded, certificate, date;
  bool is_check = false;  ///< not fitted
};
/// A certified length that was not fitted, and what the calibrated arm measures.
struct LengthCheck {
  Entry from, to, certified, certified_expanded, measured, expanded, deviation, deviation_expanded;
};
/// A sentence of the calibration's file, and as a phrase for other languages; empty: not known.
struct Said {
  Entry entry;
  calib::Phrase phrase;
};
/// A line of the uncertainty budget of a TCP position; contributions are standard uncertainties.
struct BudgetLine {
  std::string source;  ///< id of its wording
  Entry sigma, sensitivity, contribution;
};
/// One row of 'as found, as left'; inapplicable values are not stated.
struct Figure {
  std::string what;  ///< id of the form's wording
  Entry found, left;
};
struct Break {
  bool resumed = false;  ///< otherwise interrupted
  Entry utc, local, phase, event;
};
struct Parameter {
  Entry name, nominal, correction, expanded, decided_by;
};
/// Axis of a positioner as found: a point of it and its direction in the base frame, all axes at 0; bounds
/// of 95 % across it and of the direction.
struct PositionerAxis {
  Entry name;
  std::array<Entry, 3> xyz, along;
  Entry place, direction;
};
/// Linear unit as found: direction of travel in the base frame, scale, and the motions of its carriage over its
/// position (shifts in both other directions, then roll, pitch and yaw), with bounds of 95 %.
struct LinearUnit {
  struct Row {
    Entry position;
    std::array<Entry, calib::kGuideMotions> motion, u95;
  };
  Entry name;
  std::array<Entry, 3> along;
  Entry direction, scale, scale_u95;
  std::vector<Row> rows;
};
struct File {
  Entry role, name, sha256;
};
struct TouchRow {
  Entry number, target, set, readings, speed, temperature, time;
  std::vector<Entry> joints;
};

/// Decision rule of the verdict, and its values.
struct Decision {
  bool stated = false;        ///< its values were recorded
  bool by_cell_file = false;  ///< required_mm comes from the cell file
  Entry predicted, required, nominal, of_nominal, most_of_nominal;
};

/// Prefix of a certificate's number where no real arm was touched: visible even to a reader of the number
/// alone, or to a verifier of the signature.
inline constexpr std::string_view kEmulatedNumber = "emulated-";

struct CertificateData {
  Entry emulated;  ///< stated where the session ran on the daemon's emulated cell
  Entry number, session, cell, site, operator_name, issued, issued_local, issued_by,
      issuing_software;
  Entry robot, robot_serial, controller_serial, sensor, sensor_serial, tool, tip_radius;
  Entry began, began_local, ended, ended_local, software, method;
  calib::Phrase method_said;
  Entry touches, lowest_c, highest_c;
  bool workspace = false;         ///< scope; otherwise near the targets
  std::optional<Entry> found_by;  ///< the earlier calibration; none: the nominal arm
  /// An earlier one exists, with another nominal arm, tool or version.
  bool earlier_not_comparable = false;
  std::vector<Figure> figures;
  Entry poses;  ///< poses of the scope's figures
  Decision decision;
  std::vector<Artefact> artefacts;
  std::vector<Length> lengths;  ///< with both ends touched
  calib::ScaleBy scale = calib::ScaleBy::kNotJudged;
  std::vector<LengthCheck> length_checks;
  PoseSheetData pose_sheet;        ///< in the terms of ISO 9283
  std::vector<BudgetLine> budget;  ///< empty: not recorded
  Entry standard, expanded;        ///< combined standard uncertainty of a TCP position, and U
  std::vector<Said> directions;    ///< not identifiable
  std::vector<Said> remarks;       ///< reasons of the verdict
  std::vector<Break> breaks;
  /// Phase changes were recorded; otherwise interruptions are unknown.
  bool changes_recorded = false;
  Entry dropped;  ///< time of deletion of raw rows: interruptions are unknown then
  std::vector<Parameter> parameters;
  std::vector<PositionerAxis> positioner;
  std::optional<LinearUnit> linear_unit;
  std::vector<File> files;
  Entry rows_sha256, calibration_sha256;
  std::vector<Entry> joint_names;
  std::vector<TouchRow> rows;
};

/// Throws Refused, ArchiveError, JournalError, calib::FileError.
CertificateData make_certificate(const Archive& archive, const std::string& from,
                                 const Issue& issue);

/// Recomputes the result from the rows: a certificate is issued only for a result identical to the bit.
/// Throws Refused where it differs, and as replay() does.
void refuse_unless_reproduced(const Archive& archive, const std::string& from);

/// Complete document without scripts and external content; A4 in print.
std::string to_html(const CertificateData& data, const calib::Language& language = {});
/// "certificate.html"; "certificate.de.html" in another language than English.
std::string document_name(const calib::Language& language, const std::string& extension);
/// "cellcal.certificate/1": every entry with its text, value, unit and origin.
std::string to_json(const CertificateData& data);
/// Digital Calibration Certificate (XML, PTB's schema 3.1.2), its sentences in every language; what the schema
/// requires and no row has reads "not stated".
std::string to_dcc(const CertificateData& data);
inline constexpr std::chrono::seconds kPdfLimit{120};
/// PDF of that HTML by WeasyPrint, terminated after the limit. Throws std::runtime_error, which names the
/// package where it is missing.
void write_pdf(const std::filesystem::path& html, const std::filesystem::path& pdf,
               std::chrono::milliseconds limit = kPdfLimit);

// Decision rule under which the verdict published the calibration, from its findings.

Decision decision_of(const Sources& sources);

}  // namespace cellcal::daemon::certificate

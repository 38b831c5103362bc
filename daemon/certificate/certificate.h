#pragma once
// A published calibration as a certificate: what is printed, each number with its origin (README.md), and the
// files that are made of it.

#include <chrono>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/archive/archive.h"
#include "daemon/certificate/sources.h"

namespace cellcal::daemon::certificate {

/// There is no certificate of it, and why.
struct Refused : std::runtime_error {
  enum class Why {
    kNoCalibration,
    kNotDone,
    kWithheld,
    kUpdate,
    kNotReproduced,  ///< computed again it is another
    kNotProven,      ///< nobody who is known here vouches for the rows
  };
  Refused(Why reason, const std::string& words) : std::runtime_error(words), why(reason) {}
  Why why;
};

/// Who issues it, when, with what.
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
};
/// One line of 'as found, as left'; what does not apply is not stated.
struct Figure {
  std::string what;  ///< the form's words
  Entry found, left;
};
struct Break {
  bool resumed = false;  ///< else interrupted
  Entry utc, local, phase, event;
};
struct Parameter {
  Entry name, nominal, correction, expanded, decided_by;
};
struct File {
  Entry role, name, sha256;
};
struct TouchRow {
  Entry number, target, set, readings, speed, temperature, time;
  std::vector<Entry> joints;
};

/// The verdict's rule, and the numbers that it decided by.
struct Decision {
  bool stated = false;        ///< its numbers were recorded
  bool by_cell_file = false;  ///< required_mm is the cell file's
  Entry predicted, required, nominal, of_nominal, most_of_nominal;
};

/// What a certificate's number begins with where no real arm was touched: who has the number alone sees it, as those do who
/// verify a signature.
inline constexpr std::string_view kEmulatedNumber = "emulated-";

struct CertificateData {
  Entry emulated;  ///< stated where the session was of the daemon's own emulated cell
  Entry number, session, cell, site, operator_name, issued, issued_local, issued_by,
      issuing_software;
  Entry robot, robot_serial, controller_serial, sensor, sensor_serial, tool, tip_radius;
  Entry began, began_local, ended, ended_local, software, method;
  Entry touches, lowest_c, highest_c;
  bool workspace = false;               ///< scope; else near the targets
  std::optional<Entry> found_by;        ///< earlier calibration in words; none: the nominal arm
  bool earlier_not_comparable = false;  ///< there was one, of another nominal arm, tool or version
  std::vector<Figure> figures;
  Entry poses;  ///< over which the scope's figures are
  Decision decision;
  std::vector<Artefact> artefacts;
  std::vector<Length> lengths;    ///< of which both ends were touched
  std::vector<Entry> directions;  ///< that are not identifiable
  std::vector<Entry> remarks;     ///< the verdict's reasons
  std::vector<Break> breaks;
  bool changes_recorded = false;  ///< of phase; else breaks are not known
  Entry dropped;                  ///< when raw rows were dropped: then breaks are not known
  std::vector<Parameter> parameters;
  std::vector<File> files;
  Entry rows_sha256, calibration_sha256;
  std::vector<Entry> joint_names;
  std::vector<TouchRow> rows;
};

/// Throws Refused, ArchiveError, JournalError, calib::FileError.
CertificateData make_certificate(const Archive& archive, const std::string& from,
                                 const Issue& issue);

/// Computes the result again out of the rows: a certificate is made of what comes out the same to the bit, and of nothing
/// else. Throws Refused where it does not; as replay().
void refuse_unless_reproduced(const Archive& archive, const std::string& from);

/// The whole document. No script, nothing from elsewhere; A4 where it is printed.
std::string to_html(const CertificateData& data);
/// "cellcal.certificate/1": every entry with its text, value, unit and origin.
std::string to_json(const CertificateData& data);
inline constexpr std::chrono::seconds kPdfLimit{120};
/// PDF of that HTML, by WeasyPrint, which is ended after the limit. Throws std::runtime_error, which names the package
/// where it is missing.
void write_pdf(const std::filesystem::path& html, const std::filesystem::path& pdf,
               std::chrono::milliseconds limit = kPdfLimit);

// The rule by which the verdict let the calibration through, as it stands among its findings.

Decision decision_of(const Sources& sources);

}  // namespace cellcal::daemon::certificate

#pragma once
// Certificate of a published calibration: the printed values, each with its origin (README.md), and the files
// made from it.

#include <chrono>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

#include "calib/result/calibration.h"
#include "calib/words/phrase.h"
#include "daemon/archive/archive.h"

namespace cellcal::daemon::certificate {

// Entry of a certificate with its origin (README, Origins).

struct Entry {
  std::string text;               ///< as printed, not escaped; empty: not stated
  std::string from;               ///< origin
  std::optional<double> value{};  ///< of a number, in `unit`, with full precision
  std::string unit{};

  bool stated() const { return !text.empty(); }
};

/// "text" and "from"; "value" and "unit" where it has them.
void to_json(nlohmann::ordered_json& json, const Entry& entry);
void from_json(const nlohmann::ordered_json& json, Entry& entry);

/// The coverage factor.
inline constexpr double kCoverage = 2.0;

/// Printed value of a constant of the method (README, Origins).
std::string_view value_of_constant(std::string_view name);

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

/// Prefix of a certificate's number where no real arm was touched: visible even to a reader of the number
/// alone, or to a verifier of the signature.
inline constexpr std::string_view kEmulatedNumber = "emulated-";

/// The entry at "key" or "key/index/key" of a part of a certificate's content.
Entry entry_at(const nlohmann::ordered_json& content, const std::string& path);

struct CertificateData {
  nlohmann::ordered_json content;  ///< of certificate.json: "cellcal.certificate/1"
  /// Sentences of the content for other languages, by their words in it.
  std::map<std::string, calib::Phrase> phrases;
  calib::ScaleBy scale = calib::ScaleBy::kNotJudged;
  std::map<std::string, Entry> scale_certificates;  ///< of the fitted lengths, by their text

  Entry entry(const std::string& path) const { return entry_at(content, path); }
  /// The words themselves where no phrase is known.
  calib::Phrase phrase(const std::string& words) const;
  /// Adds a phrase; its words.
  std::string said(const calib::Phrase& phrase);
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
std::string to_json(const CertificateData& data);
/// Digital Calibration Certificate (XML, PTB's schema 3.1.2), its sentences in every language; what the schema
/// requires and no row has reads "not stated".
std::string to_dcc(const CertificateData& data);
inline constexpr std::chrono::seconds kPdfLimit{120};
/// PDF of that HTML by WeasyPrint, terminated after the limit. Throws std::runtime_error, which names the
/// package where it is missing.
void write_pdf(const std::filesystem::path& html, const std::filesystem::path& pdf,
               std::chrono::milliseconds limit = kPdfLimit);

}  // namespace cellcal::daemon::certificate

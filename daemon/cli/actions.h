#pragma once
// Actions of commands. Each returns its exit status and throws on failure.

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "calib/priors/learn.h"
#include "calib/result/update.h"
#include "calib/words/phrase.h"
#include "daemon/archive/archive.h"
#include "daemon/certificate/signed_files.h"
#include "daemon/cli/client.h"

namespace cellcal::daemon {

// Sessions as files, and backups of the journal.

struct NamedArchive {
  std::string from;  ///< "session 7", or the directory
  Archive archive;
  std::optional<std::int64_t> session;  ///< none: from a directory
};
/// Validated. `which`: a session number, or the directory of an export, which needs no daemon.
NamedArchive archive_of(const Connection& daemon, const std::string& which);

struct ExportCommand {
  std::int64_t session = 0;
  std::filesystem::path directory;
  std::filesystem::path key;  ///< empty: default_key(), if it exists
  bool sign = true;
};
int export_session(const Connection& daemon, const ExportCommand& command);
/// Refuses files changed after signing, and reports the signer. `key`: public part of the signing key; empty:
/// that of default_key().
int import_session(const Connection& daemon, const std::filesystem::path& directory,
                   const std::filesystem::path& key);
/// `which`: as for archive_of().
int replay_session(const Connection& daemon, const std::string& which);
int back_up(const Connection& daemon, const std::filesystem::path& file);

// Certificate of a published calibration: issue, signature and verification.

struct CertificateCommand {
  std::string session;           ///< number, or the directory of an export
  std::filesystem::path output;  ///< directory, new or empty; empty: "certificate-NUMBER"
  std::string issued_by;
  bool pdf = true, sign = true;
  std::filesystem::path key;  ///< empty: default_key(), if it exists
  /// Public part of the key that signed the export, where the session is a directory; empty: that of `key`.
  std::filesystem::path export_key;
};
/// $CELLCAL_KEY, otherwise in /etc/cellcal.
std::filesystem::path default_key();

struct SigningKey {
  signing::PrivateKey key;
  std::filesystem::path file;
};
/// The named key, or default_key() if it exists; none where nothing is to be signed. Throws
/// signing::KeyError.
std::optional<SigningKey> signing_key(const std::filesystem::path& named, bool sign);

int certify(const Connection& daemon, const CertificateCommand& command);
int make_certificate_key(const std::filesystem::path& key, bool json);

struct VerifyCommand {
  std::filesystem::path file;  ///< or the directory of a certificate
  std::filesystem::path key;   ///< public part; empty: that of default_key()
  bool json = false;
};
int verify(const VerifyCommand& command);

// Control chart of the checks of the newest calibration, for terminals.

/// "an update of session 12 of 2026-11-20, 9 touches: S2 moved by ...", or "no update of ...".
calib::Phrase update_phrase(const calib::UpdateOrigin& update);
/// Origin of the session's update; none of another calibration. Throws SocketError, calib::FileError.
std::optional<calib::UpdateOrigin> update_of(const Connection& daemon, std::int64_t session);

/// From "checks" of GET /v1/drift: sentences, a plot over time, the newest checks. Ends with a line break.
std::string drift_text(const nlohmann::json& checks);

/// From its "controller": value of CELLCAL_ADVICE, or why it was not acknowledged; empty where nothing is
/// published.
std::string acknowledged_text(const nlohmann::json& controller);

/// 3 where the chart alarms.
int show_drift(const Connection& daemon);

// Data of the plant's collector (cellcal-fleet) on its cells.

int fleet_status(const Connection& fleet);
/// kNotPublishable where a calibration or check is overdue.
int fleet_overdue(const Connection& fleet);
int fleet_compare(const Connection& fleet, const std::string& robot, const std::string& joint);

enum class Exported { kCalibration, kCheck, kCertificate };
struct FleetExport {
  std::string cell;                     ///< PLANT/CELL
  std::optional<std::int64_t> session;  ///< none: the newest
  std::string journal;                  ///< empty: the newest that contains it
  Exported what = Exported::kCalibration;
  /// A file, or a directory for a certificate; empty: standard output.
  std::filesystem::path output;
};
int fleet_export(const Connection& fleet, const FleetExport& command);

// Published calibrations, from the daemon's answers.

std::string versions_text(const nlohmann::json& list);
std::string comparison_text(const nlohmann::json& all);

// Reason why a cell needs attention.

/// From one entry of `needs` (daemon/fleet/judge), one line: the need, its begin, the action.
std::string need_words(const nlohmann::json& need);

// Command cellcal priors: parameter spreads of a fleet's calibrations, and the robot file with them.

/// From files and directories of calibrations, without a daemon.
struct LearnPriorsCommand {
  std::vector<std::filesystem::path> from;
  std::string robot;             ///< file or shipped robot; empty: that of most calibrations
  std::filesystem::path after;   ///< earlier priors, whose version is incremented; empty: none
  std::filesystem::path output;  ///< empty: standard output
  bool json = false;
};
int learn_priors(const LearnPriorsCommand& command);

struct ShowPriorsCommand {
  std::filesystem::path file;
  bool json = false;
};
int show_priors(const ShowPriorsCommand& command);

struct AcceptPriorsCommand {
  std::filesystem::path file, output;
  std::string robot;
  bool json = false;
};
int accept_priors(const AcceptPriorsCommand& command);

// For display.
std::string spreads_words(const calib::FleetPriors& priors);
std::string changes_words(const std::vector<calib::PriorChange>& changes);
std::string set_aside_words(const calib::SetAside& one);
std::string no_priors_words(const calib::Learned& learned);

}  // namespace cellcal::daemon

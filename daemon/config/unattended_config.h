#pragma once
// Section [notify]: notification of the end of a session.

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calib/files/toml.h"
#include "calib/words/phrase.h"

namespace cellcal::daemon {

/// Components of a webhook address.
struct WebhookUrl {
  bool tls = false;
  std::string host;  ///< IPv6 without brackets
  std::string port;
  std::string target;  ///< path and query

  bool operator==(const WebhookUrl&) const = default;
};

struct WebhookConfig {
  WebhookUrl url;
  std::filesystem::path secret_file;  ///< its first line is sent as X-Cellcal-Secret; empty: none
  std::filesystem::path ca;           ///< PEM; empty: system store
  double timeout_s = 10.0;            ///< of one attempt
  int retries = 5;

  bool operator==(const WebhookConfig&) const = default;
};

/// SMTP server of the plant.
struct MailServer {
  bool tls = false;       ///< implicit TLS (smtps)
  bool starttls = false;  ///< STARTTLS required before any other command
  std::string host;       ///< IPv6 without brackets
  std::string port;
  std::string user;                     ///< empty: no login; otherwise over TLS only
  std::filesystem::path password_file;  ///< first line is the password
  std::filesystem::path ca;             ///< PEM; empty: system store
  double timeout_s = 30.0;              ///< of one attempt

  bool operator==(const MailServer&) const = default;
};

struct MailConfig {
  std::vector<std::string> to;
  std::string from;
  std::filesystem::path program = "/usr/sbin/sendmail";  ///< used without a server
  std::optional<MailServer> server = {};

  bool operator==(const MailConfig&) const = default;
};

struct NotifyConfig {
  calib::Language language;  ///< the top-level one unless stated
  std::optional<WebhookConfig> webhook;
  std::optional<MailConfig> mail;

  bool operator==(const NotifyConfig&) const = default;
};

/// Key "language", a language that has a catalogue. Throws calib::FileError.
calib::Language read_language(const calib::TomlTable& table, const calib::Language& usual);

/// Throws calib::FileError.
NotifyConfig read_notify(const calib::TomlTable& table, const calib::Language& usual);

// Section [schedule]: unattended sessions and their times.

/// Interval of local time of day on the weekdays on which it begins. An end before the begin lies on the
/// following day.
struct WeeklyWindow {
  std::array<bool, 7> days{true, true, true, true, true, true, true};  ///< Sunday first
  int from_min = 0, to_min = 0;  ///< minutes since midnight, local wall clock

  bool operator==(const WeeklyWindow&) const = default;
};

/// Session begun within such a window.
struct ScheduledSession {
  std::string name;  ///< identifier in the log and in requests
  /// Session kind, as in POST /v1/run.
  std::string kind = "calibrate";
  std::filesystem::path cell;
  WeeklyWindow window;
  bool on_request = false;  ///< begins on request within the window; otherwise once per window
  std::optional<int> touches;
  std::optional<int> check;
  std::optional<double> goal_mm;
  std::string load;  ///< held in all touches: id of a [[load]] of the cell file; empty: none
  std::optional<double> minutes;  ///< duration; none: estimated from earlier sessions

  bool operator==(const ScheduledSession&) const = default;
};

/// Start of the controller's program without an operator.
enum class ProgramStart {
  kNone,         ///< not possible: no session begins unattended
  kLeftRunning,  ///< EKI: CELLCAL_EKI is left running in AUT or EXT
  kCell,         ///< CELL.SRC calls it in EXT, as commanded by the PLC
  kRun           ///< EKI: the submit program starts it in EXT, where its files permit
};

struct ScheduleConfig {
  bool unattended = false;  ///< responsibility for a clear cell within the windows is declared
  std::string responsible;  ///< responsible person; not empty where unattended
  ProgramStart program_start = ProgramStart::kNone;
  int resumes = 0;  ///< per session, after harmless failures
  double resume_wait_s = 120.0;
  std::vector<ScheduledSession> sessions;

  bool operator==(const ScheduleConfig&) const = default;
};

/// Throws calib::FileError.
ScheduleConfig read_schedule(const calib::TomlTable& table);

}  // namespace cellcal::daemon

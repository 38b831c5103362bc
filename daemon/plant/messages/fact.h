#pragma once
// Facts sent from a cell to its plant, typed. SI units and radians.

#include <array>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "daemon/plant/messages/text_fields.h"

namespace cellcal::daemon::plant {

/// Priority when space is limited.
enum class Worth { kResult, kTelemetry };

enum class SessionState { kRunning, kInterrupted, kAborted, kFailed, kDone };
struct SessionFact {
  SessionState state = SessionState::kRunning;
  std::string purpose;     ///< to_string(SessionKind); "update"
  std::string cell_file;   ///< path as given
  std::string robot_file;  ///< likewise
  std::string started;     ///< ISO 8601 UTC
  std::size_t touches = 0, planned = 0;
  std::string failure_kind, failure;  ///< hyphenated name, and text; empty: none
  std::string software;
  /// to_string(OutcomeKind) of a completed session; none: not completed, or from an earlier version.
  std::optional<std::string> outcome = {};

  bool operator==(const SessionFact&) const = default;
};

struct CalibrationFact {
  std::string robot;         ///< model of the robot file
  std::string robot_serial;  ///< of the cell file; empty: not stated
  bool published = false, update = false;
  std::vector<std::string> findings;  ///< names of those that withhold: "check_touches"
  std::optional<double> near_m,
      over_m;  ///< predicted mean error: near the targets, over the workspace
  std::optional<double> u95_near_m, u95_over_m;  ///< mean
  std::string document;                          ///< cellcal.calibration/1

  bool operator==(const CalibrationFact&) const = default;
};

enum class Held { kYes, kNo, kUndecided };
struct CheckFact {
  std::int64_t against = 0;  ///< session of the checked calibration
  Held held = Held::kUndecided;
  std::optional<double> shift_m, u_m;  ///< of the TCP, U (k=2)
  std::string cause;                   ///< hyphenated name of the most likely one; empty: none
  std::optional<double> temperature_c;
  std::string document;  ///< cellcal.check/1

  bool operator==(const CheckFact&) const = default;
};

/// The calibration of the header's session is in use from now on.
struct ActivationFact {
  std::string by, reason;

  bool operator==(const ActivationFact&) const = default;
};

struct CertificateFile {
  std::string name;  ///< without a directory
  std::string bytes;

  bool operator==(const CertificateFile&) const = default;
};
struct CertificateFact {
  std::string certificate;  ///< its number
  std::vector<CertificateFile> files;

  bool operator==(const CertificateFact&) const = default;
};

struct AlarmFact {
  std::string news;           ///< to_string(News)
  std::string subject, text;  ///< as in the notification

  bool operator==(const AlarmFact&) const = default;
};

struct AnswerFact {
  std::string proposal;  ///< its id
  bool accepted = false;
  std::string by, reason;

  bool operator==(const AnswerFact&) const = default;
};

struct PhaseFact {
  std::string from, to, on;  ///< to_string(Phase), name of the event
  double clock_s = 0.0;      ///< session clock

  bool operator==(const PhaseFact&) const = default;
};

struct TouchFact {
  std::size_t index = 0;  ///< from 0
  std::string target;
  bool check = false;  ///< excluded from the fit
  std::vector<double> joint_rad;
  std::optional<std::array<double, 3>> tip_m;  ///< nominal model, base frame
  std::optional<double> residual_m;

  bool operator==(const TouchFact&) const = default;
};

struct HealthFact {
  std::uint64_t packets = 0, gaps = 0, late = 0,
                replies = 0;  ///< since the robot's link was opened
  double reply_p99_s = 0.0, reply_max_s = 0.0;
  std::uint64_t frames = 0, crc_errors = 0;  ///< since the sensor's port was opened
  double sensor_late_s = 0.0;                ///< worst delivery delay of the sensor's bytes
  std::int64_t waiting = 0;                  ///< unacknowledged facts
  std::int64_t journal_bytes = 0;

  bool operator==(const HealthFact&) const = default;
};

enum class DropReason {
  kNoRoom,    ///< telemetry, in the cell's outbox
  kTooLarge,  ///< one fact exceeds kLargestMessage; reported under its own number
  kDamaged    ///< one fact of a damaged session; likewise
};
/// Facts that the plant will not receive.
struct DroppedFact {
  std::int64_t first = 0, last = 0;  ///< range of numbers, both dropped
  std::int64_t count = 0;            ///< results between them are kept
  DropReason reason = DropReason::kNoRoom;
  // Single dropped fact; its former content, where known:
  std::optional<std::string> kind{};
  std::optional<std::int64_t> bytes{};

  bool operator==(const DroppedFact&) const = default;
};

using FactBody =
    std::variant<SessionFact, CalibrationFact, CheckFact, ActivationFact, CertificateFact,
                 AlarmFact, AnswerFact, PhaseFact, TouchFact, HealthFact, DroppedFact>;

struct Fact {
  CellName of;
  std::string journal;       ///< id of the journal
  std::int64_t number = 0;   ///< 1, 2, 3, ... within the journal
  std::string time;          ///< ISO 8601 UTC, clock of the cell
  std::int64_t session = 0;  ///< 0: none
  FactBody body;

  bool operator==(const Fact&) const = default;
};

/// Hyphenated; part of the topic.
const char* kind_of(const FactBody& body);
Worth worth_of(const FactBody& body);

// JSON representation of facts, "cellcal.plant/1", both directions from one table.

/// Larger messages are rejected unread; a certificate with its raw rows has about 2 MB.
inline constexpr std::size_t kLargestMessage = std::size_t{8} << 20;

/// The body only, as stored in an outbox until the header is known.
calib::fields::Json json_of(const FactBody& body);
std::string body_to_json(const FactBody& body);
/// `kind`: as returned by kind_of(). Throws calib::FileError.
FactBody body_from_json(std::string_view kind, std::string_view json);

/// One line. Invalid UTF-8 is replaced, except in certificate files.
std::string to_json(const Fact& fact);
/// Throws calib::FileError, which names the key; also where topic and message disagree.
Fact fact_from_json(std::string_view json, const Topic& topic);

// A certificate for the plant: complete, or not at all.

/// As base64 in JSON it stays below kLargestMessage and the limit of the shipped broker.
inline constexpr std::size_t kMostCertificateBytes = 5'500'000;

/// The plant is not notified. The certificate itself is valid.
struct CertificateTooLarge : std::runtime_error {
  explicit CertificateTooLarge(std::size_t all);
  std::size_t bytes;
};

/// Throws CertificateTooLarge.
CertificateFact certificate_fact(std::string number, std::vector<CertificateFile> files);

/// Numbering of daemon/certificate: "emulated-" where no real arm was touched, the session, and the first 12
/// digits of its calibration's SHA-256.
std::string certificate_number(std::int64_t session, const std::string& calibration, bool emulated);

// Pending facts for the plant: the journal's outbox, or the daemon that owns it.

/// Temporarily unreadable or unwritable. Nothing is lost.
struct OutboxError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct WaitingFact {
  std::int64_t row = 0;
  std::string source;  ///< journal that the numbers belong to
  std::int64_t number = 0, session = 0;
  std::string kind;  ///< of its body
  Worth worth = Worth::kResult;
  std::string text;  ///< one line of JSON, at most kLargestMessage
};

struct WaitingCount {
  std::string source;       ///< of the next fact
  std::int64_t newest = 0;  ///< number under that source
  std::int64_t rows = 0;
  /// The part recorded under another name, currently not published.
  std::int64_t elsewhere = 0;
  std::string elsewhere_address;  ///< oldest of these: "plant/cell"

  bool operator==(const WaitingCount&) const = default;
};

/// All functions throw OutboxError.
class Outbox {
 public:
  virtual ~Outbox() = default;
  virtual WaitingCount count() = 0;
  /// The oldest facts after this row: at most this many, fewer where they are large.
  virtual std::vector<WaitingFact> facts(std::int64_t after, std::size_t most) = 0;
  /// The facts are stored elsewhere and no longer pending.
  virtual void acknowledge(const std::vector<std::int64_t>& rows) = 0;
};

}  // namespace cellcal::daemon::plant

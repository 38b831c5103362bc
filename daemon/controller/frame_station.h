#pragma once
// Reads, sets and restores frames of the controller, with the old values on disk before anything is sent.
// Causes no motion. The caller ensures that no session runs (SessionService::alone).

#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "calib/model/enum_table.h"
#include "drivers/kuka/eki/eki_aside.h"

namespace cellcal::daemon {

// Record of a frame sent to the controller: old value, sent value and result.

enum class FrameOutcome {
  kSet,
  kDiffers,  ///< set, but read back differently
  kRefused,  ///< by the controller: unchanged
  kNotSent,  ///< unchanged
  kUnknown,
};
/// "not sent"
constexpr const char* to_string(FrameOutcome outcome) { return own_name<' '>(outcome); }

struct FrameName {
  drivers::EkiFrameKind kind = drivers::EkiFrameKind::kTool;
  int number = 0;  ///< 1..128
  bool operator==(const FrameName&) const = default;
};
/// "TOOL_DATA[3]"
std::string to_string(const FrameName& name);
std::optional<FrameName> frame_name(std::string_view text);

struct FrameRecord {
  int id = 0;  ///< from 1, never reused
  std::string time, by, reason;
  FrameName name;
  drivers::EkiFrameValues before{}, sent{};  ///< mm, deg
  std::optional<drivers::EkiFrameValues> read_back;
  FrameOutcome outcome = FrameOutcome::kUnknown;
  std::string words;            ///< result and remedy
  std::optional<int> restores;  ///< id of the record whose old values were restored
};

/// "{X 60.1234,Y ...}" as in $config.dat.
std::string krl_text(const drivers::EkiFrameValues& values);

std::string frames_to_json(const std::vector<FrameRecord>& records);
/// Throws std::runtime_error naming `file`, the record and the fault.
std::vector<FrameRecord> frames_from_json(const std::string& text, const std::string& file);

// Text of the results of frame transfers; the single source of this wording.

std::string not_configured_words();
/// Reason why a frame was not read or set, or why its state is unknown; with the remedy.
std::string why_words(const drivers::EkiFrameResult& result);
/// Nothing was sent, or the controller refused.
std::string not_sent_words(const FrameName& name, const drivers::EkiFrameResult& result);
std::string unknown_words(const FrameRecord& record, const std::string& why);
/// Reason why the arm's position was not read, with the remedy; and the text where it is not supported.
std::string position_words(const drivers::EkiPosition& position);
std::string no_position_words();
std::string outcome_words(const FrameRecord& record, const drivers::EkiFrameResult& result);

/// Nothing was sent; the reason.
struct FrameNotSent : std::runtime_error {
  enum class Why {
    kNotConfigured,
    kNoSuchRecord,
    kUnusable,    ///< the requested value must not be set
    kChanged,     ///< the controller's value differs from the confirmed one
    kController,  ///< unreachable, or it refuses
    kStorage,
  };
  FrameNotSent(Why reason, const std::string& words) : std::runtime_error(words), why(reason) {}
  Why why;
};

struct FrameOrder {
  FrameName name;
  drivers::EkiFrameValues values{};  ///< mm, deg
  drivers::EkiFrameValues was{};     ///< value read before the confirmation
  std::string by, reason;
};

inline constexpr std::size_t kMostFrameRecords = 1000;

class FrameStation {
 public:
  /// drivers::exchange_frame to a controller: reads, and sets the chosen value on the same connection.
  using Exchange = std::function<drivers::EkiFrameResult(const drivers::EkiFrameRequest&,
                                                         const drivers::EkiFrameChoice&)>;
  struct Parts {
    std::filesystem::path file;
    /// To the controller, by the current configuration; null: not permitted.
    std::function<Exchange()> exchange;
    std::function<std::string()> utc_now;
    /// Limits of the change beyond which the tool is taken for another one.
    double another_tool_mm = 10.0, another_tool_deg = 1.0;
  };
  explicit FrameStation(Parts parts);

  bool configured() const { return static_cast<bool>(parts_.exchange()); }
  /// Unusable file and remedy; empty: none.
  const std::string& problem() const { return problem_; }
  /// Oldest first.
  std::vector<FrameRecord> records() const;

  /// These throw FrameNotSent. Each takes at most about twenty seconds.
  drivers::EkiFrameValues read(const FrameName& name);
  /// Result kSet, kDiffers or kUnknown; a refusal is thrown.
  FrameRecord set(const FrameOrder& order);
  FrameRecord restore(int id, const std::string& by);

 private:
  drivers::EkiFrameResult ask(const FrameName& name, const drivers::EkiFrameChoice& choice) const;
  /// `order` derives the record from the controller's current value, or throws FrameNotSent.
  FrameRecord replace(const FrameName& name,
                      const std::function<FrameRecord(const drivers::EkiFrameValues& now)>& order);
  void require_same_tool(const FrameOrder& order, const drivers::EkiFrameValues& now) const;
  void note_before(FrameRecord& record);
  void note_after(FrameRecord& record);
  std::optional<FrameRecord> find(int id) const;
  void store(const std::vector<FrameRecord>& records) const;

  Parts parts_;
  std::string problem_;
  std::mutex one_at_a_time_;  ///< serialises replacements
  mutable std::mutex mutex_;  ///< guards the records
  std::vector<FrameRecord> records_;
};

}  // namespace cellcal::daemon

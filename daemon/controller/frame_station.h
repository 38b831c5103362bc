#pragma once
// Frames of the controller, read, set and set back, with the old values on disk before anything is sent. Nothing
// here moves an arm. The caller sees to it that no session runs (SessionService::alone).

#include <filesystem>
#include <functional>
#include <mutex>
#include <stdexcept>
#include <vector>

#include "daemon/controller/frame_record.h"

namespace cellcal::daemon {

/// Nothing was sent, and why.
struct FrameNotSent : std::runtime_error {
  enum class Why {
    kNotConfigured,
    kNoSuchRecord,
    kUnusable,    ///< what is asked for must not be set
    kChanged,     ///< the controller has another value than was confirmed
    kController,  ///< it cannot be reached, or refuses
    kStorage,
  };
  FrameNotSent(Why reason, const std::string& words) : std::runtime_error(words), why(reason) {}
  Why why;
};

struct FrameOrder {
  FrameName name;
  drivers::EkiFrameValues values{};  ///< mm, deg
  drivers::EkiFrameValues was{};     ///< what was read before it was confirmed
  std::string by, reason;
};

inline constexpr std::size_t kMostFrameRecords = 1000;

class FrameStation {
 public:
  /// drivers::exchange_frame to a controller: reads, and sets what the choice gives on the same connection.
  using Exchange = std::function<drivers::EkiFrameResult(const drivers::EkiFrameRequest&,
                                                         const drivers::EkiFrameChoice&)>;
  struct Parts {
    std::filesystem::path file;
    /// To the controller, as the configuration says now; null: it does not allow it.
    std::function<Exchange()> exchange;
    std::function<std::string()> utc_now;
    /// A tool further away from what is to be set, or turned more, is another one.
    double another_tool_mm = 10.0, another_tool_deg = 1.0;
  };
  explicit FrameStation(Parts parts);

  bool configured() const { return static_cast<bool>(parts_.exchange()); }
  /// Empty, or which file cannot be used and what to do.
  const std::string& problem() const { return problem_; }
  /// Oldest first.
  std::vector<FrameRecord> records() const;

  /// These throw FrameNotSent. Each takes some twenty seconds at most.
  drivers::EkiFrameValues read(const FrameName& name);
  /// What came of it: kSet, kDiffers or kUnknown; a refusal is thrown.
  FrameRecord set(const FrameOrder& order);
  FrameRecord restore(int id, const std::string& by);

 private:
  drivers::EkiFrameResult ask(const FrameName& name, const drivers::EkiFrameChoice& choice) const;
  /// `order` makes the record of what is to be set from what the controller has now, or throws FrameNotSent.
  FrameRecord replace(const FrameName& name,
                      const std::function<FrameRecord(const drivers::EkiFrameValues& now)>& order);
  void require_same_tool(const FrameOrder& order, const drivers::EkiFrameValues& now) const;
  void note_before(FrameRecord& record);
  void note_after(FrameRecord& record);
  std::optional<FrameRecord> find(int id) const;
  void store(const std::vector<FrameRecord>& records) const;

  Parts parts_;
  std::string problem_;
  std::mutex one_at_a_time_;  ///< who replaces a frame
  mutable std::mutex mutex_;  ///< of the records
  std::vector<FrameRecord> records_;
};

}  // namespace cellcal::daemon

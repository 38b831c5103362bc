#pragma once
// Frames of the controller, read, set and set back, with the old values on disk before anything is sent. Nothing
// here moves an arm. The caller sees to it that no session runs (SessionService::alone).

#include <filesystem>
#include <functional>
#include <mutex>
#include <stdexcept>
#include <vector>

#include "daemon/frames/frame_record.h"

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
  using Exchange = std::function<drivers::EkiFrameResult(const drivers::EkiFrameRequest&)>;
  struct Parts {
    std::filesystem::path file;
    /// To the controller, as the configuration says now; null: it does not allow it.
    std::function<Exchange()> exchange;
    std::function<std::string()> utc_now;
    double another_tool_mm =
        10.0;  ///< a tool further than this from what is to be set is another one
  };
  explicit FrameStation(Parts parts);

  bool configured() const { return static_cast<bool>(parts_.exchange()); }
  /// Empty, or which file cannot be used and what to do.
  const std::string& problem() const { return problem_; }
  /// Oldest first.
  std::vector<FrameRecord> records() const;

  /// These throw FrameNotSent. Each takes up to ten seconds per telegram.
  drivers::EkiFrameValues read(const FrameName& name);
  /// What came of it: kSet, kDiffers or kUnknown; a refusal is thrown.
  FrameRecord set(const FrameOrder& order);
  FrameRecord restore(int id, const std::string& by);

 private:
  drivers::EkiFrameResult ask(const FrameName& name,
                              const std::optional<drivers::EkiFrameValues>& values);
  FrameRecord send(FrameRecord record);
  void store(const std::vector<FrameRecord>& records) const;

  Parts parts_;
  std::string problem_;
  mutable std::mutex mutex_;
  std::vector<FrameRecord> records_;
};

}  // namespace cellcal::daemon

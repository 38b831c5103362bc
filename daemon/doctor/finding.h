#pragma once
// What a check found, and what to do about it.

#include <array>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace cellcal::daemon {

enum class Outcome {
  kOk,
  kWarning,  ///< works, and could be better or safer
  kFailed,   ///< must be mended before the arm moves
  kSkipped,  ///< could not be looked at, because something else failed or was not given
};

inline constexpr std::array kDoctorOutcomes{Outcome::kOk, Outcome::kWarning, Outcome::kFailed,
                                            Outcome::kSkipped};
/// "ok", "warning", "FAILED", "skipped".
const char* to_string(Outcome outcome);

struct Finding {
  std::string check;  ///< what was looked at: "rsi packets"
  Outcome outcome = Outcome::kOk;
  std::string found;
  std::string advice;  ///< what to do; empty where all is well
};
/// With "check", "outcome" (lower case), "found", "advice", as `cellcal doctor --json` and the API have it.
nlohmann::json to_json(const Finding& finding);
/// Throws nlohmann::json::exception; std::invalid_argument of an outcome that is none.
Finding finding_of(const nlohmann::json& value);

/// All findings of one examination, told to a listener as they come.
class Findings {
 public:
  using Listener = std::function<void(const Finding&)>;

  explicit Findings(Listener listener = {}) : listener_(std::move(listener)) {}

  void ok(const std::string& check, const std::string& found);
  void warn(const std::string& check, const std::string& found, const std::string& advice);
  void fail(const std::string& check, const std::string& found, const std::string& advice);
  void skip(const std::string& check, const std::string& why);

  const std::vector<Finding>& all() const { return all_; }
  std::size_t count(Outcome outcome) const;
  /// Nothing failed. Warnings are allowed.
  bool green() const { return count(Outcome::kFailed) == 0; }

 private:
  void add(Finding finding);

  Listener listener_;
  std::vector<Finding> all_;
};

}  // namespace cellcal::daemon

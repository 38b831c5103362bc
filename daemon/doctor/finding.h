#pragma once
// Result of a check, with its remedy.

#include <array>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace cellcal::daemon {

enum class Outcome {
  kOk,
  kWarning,  ///< works, but could be better or safer
  kFailed,   ///< must be resolved before the arm moves
  kSkipped,  ///< not checked, because of another failure or missing input
};

inline constexpr std::array kDoctorOutcomes{Outcome::kOk, Outcome::kWarning, Outcome::kFailed,
                                            Outcome::kSkipped};
/// "ok", "warning", "FAILED", "skipped".
const char* to_string(Outcome outcome);

struct Finding {
  std::string check;  ///< name of the check: "rsi packets"
  Outcome outcome = Outcome::kOk;
  std::string found;
  std::string advice;  ///< remedy; empty for kOk
};
/// With "check", "outcome" (lower case), "found", "advice", as in `cellcal doctor --json` and the API.
nlohmann::json to_json(const Finding& finding);
/// Throws nlohmann::json::exception; std::invalid_argument for an unknown outcome.
Finding finding_of(const nlohmann::json& value);

/// Findings of one examination, passed to a listener as they arise.
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
  /// No failure. Warnings are allowed.
  bool green() const { return count(Outcome::kFailed) == 0; }

 private:
  void add(Finding finding);

  Listener listener_;
  std::vector<Finding> all_;
};

}  // namespace cellcal::daemon

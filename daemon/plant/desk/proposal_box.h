#pragma once
// Proposals of the plant, from their arrival to what was said to them. Nothing here moves an arm.

#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/plant/messages/fact.h"
#include "daemon/plant/messages/proposal.h"

namespace cellcal::daemon::plant {

enum class Stand { kOpen, kAccepted, kRefused, kWithdrawn };
const char* to_string(Stand stand);

struct KeptProposal {
  Proposal proposal;
  std::string received;  ///< ISO 8601 UTC, this computer's clock
  Stand stand = Stand::kOpen;
  std::string decided, by, reason;  ///< when, who, why; empty while it is open
  bool reported = false;            ///< to the plant

  bool operator==(const KeptProposal&) const = default;
};

/// Who says so, why, and when.
struct Say {
  std::string by, reason, utc;
};

/// It is not decided now, and why.
struct NotDecided : std::runtime_error {
  enum class Why { kUnknown, kDecided, kUnusable, kStorage };
  NotDecided(Why reason, const std::string& words) : std::runtime_error(words), why(reason) {}
  Why why;
};

inline constexpr std::size_t kMostOpen = 20, kMostKept = 100;
/// Beyond kMostKept: ids of proposals that changed the cell, or that a person refused to let change it. They are remembered, because
/// the same proposal may come again at any time; where so many are, no policy accepts another one of these kinds.
inline constexpr std::size_t kMostLasting = 1000;
/// Of all texts that are kept.
inline constexpr std::size_t kMostKeptBytes = std::size_t{4} << 20;
/// Of the reason for an answer that no person gave.
inline constexpr std::size_t kLongestOwnReason = 500;

/// What is on disk.
struct KeptProposals {
  std::vector<KeptProposal> all{};  ///< oldest first
  std::int64_t dropped = 0;         ///< decided ones that are no longer listed

  bool operator==(const KeptProposals&) const = default;
};

class ProposalBox {
 public:
  struct Parts {
    std::filesystem::path state_dir;
    /// Puts that session's calibration into use, if it is not; throws where that cannot be, and the proposal stays open.
    std::function<void(const Proposal&, const Say&)> activate;
    /// What is said, for the plant; on disk when it returns. Where it throws it is asked again when the proposal comes again. What a
    /// plant can cause as often as it likes, without a person and without an effect here, is worth no more than telemetry.
    std::function<void(const AnswerFact&, Worth)> answer;
    /// Whether the configuration accepts proposals of that kind by itself; asked for kinds that it may (may_be_policy()).
    std::function<bool(ProposalKind)> policy;
  };
  explicit ProposalBox(Parts parts);

  /// Empty, or which file cannot be used and what to do.
  const std::string& problem() const { return problem_; }

  /// From the plant, any text in it, as often as it comes. What it stands at now; none: there is no room for more. Throws
  /// NotDecided (kStorage).
  std::optional<Stand> take(const Proposal& proposal, const std::string& utc);

  /// Newest first.
  std::vector<KeptProposal> all() const;
  /// Number of decided proposals that are no longer listed.
  std::int64_t dropped() const;
  /// kMostLasting are stored: proposals with an effect require an operator's decision, whatever the policy.
  bool full() const;
  /// What it came to. Throw NotDecided, and accept() what activating throws.
  KeptProposal accept(const std::string& id, const Say& say);
  KeptProposal refuse(const std::string& id, const Say& say);

  /// Where an accepted schedule or priors stand.
  std::filesystem::path file_of(const Proposal& proposal) const;

 private:
  KeptProposal* known(const std::string& id);
  KeptProposal& open(const std::string& id);
  KeptProposal decide(KeptProposal& kept, Stand stand, const Say& say);
  void report(KeptProposal& kept);
  void by_policy(KeptProposal& kept, const std::string& utc);
  void act(const Proposal& proposal, const Say& say);
  void store() const;
  void make_room();

  Parts parts_;
  std::string problem_;
  mutable std::mutex mutex_;
  KeptProposals kept_;
};

/// Why it can never be used, by the readers that the cell has; none: it may be.
std::optional<std::string> unusable(const Proposal& proposal);
/// A schedule and priors are accepted by people alone.
bool may_be_policy(ProposalKind kind);

// What was proposed and said, as the file `proposals.json` ("cellcal.proposals/1").

std::string proposals_to_json(const KeptProposals& kept);
/// Throws calib::FileError.
KeptProposals proposals_from_json(std::string_view json, const std::string& name);

}  // namespace cellcal::daemon::plant

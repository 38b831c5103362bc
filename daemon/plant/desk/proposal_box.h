#pragma once
// Proposals of the plant, from reception to answer. Causes no motion.

#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "calib/model/enum_table.h"
#include "daemon/plant/messages/fact.h"
#include "daemon/plant/messages/presence.h"

namespace cellcal::daemon::plant {

enum class Stand { kOpen, kAccepted, kRefused, kWithdrawn };
constexpr const char* to_string(Stand stand) { return own_name(stand); }

struct StoredProposal {
  Proposal proposal;
  std::string received;  ///< ISO 8601 UTC, clock of this computer
  Stand stand = Stand::kOpen;
  std::string decided, by, reason;  ///< time, author, reason; empty while open
  bool reported = false;            ///< to the plant

  bool operator==(const StoredProposal&) const = default;
};

/// Author, reason and time of a decision.
struct Say {
  std::string by, reason, utc;
};

/// Robot file of the cell, as the newest session read it. Empty: unknown.
struct CellRobot {
  std::string file, name, nominal_geometry;  ///< path, the robot's name, SHA-256
};

/// Not decided; the reason.
struct NotDecided : std::runtime_error {
  enum class Why { kUnknown, kDecided, kUnusable, kStorage };
  NotDecided(Why reason, const std::string& words) : std::runtime_error(words), why(reason) {}
  Why why;
};

inline constexpr std::size_t kMostOpen = 20, kMostKept = 100;
/// In addition to kMostKept: ids of proposals that changed the cell, or whose change an operator rejected.
/// They are kept because the same proposal may be received again at any time; at the limit no policy accepts
/// further ones of these kinds.
inline constexpr std::size_t kMostLasting = 1000;
/// All stored texts.
inline constexpr std::size_t kMostKeptBytes = std::size_t{4} << 20;
/// Reason of an automatic answer.
inline constexpr std::size_t kLongestOwnReason = 500;

/// Content of the file.
struct StoredProposals {
  std::vector<StoredProposal> all{};  ///< oldest first
  std::int64_t dropped = 0;           ///< decided ones no longer listed

  bool operator==(const StoredProposals&) const = default;
};

class ProposalBox {
 public:
  struct Parts {
    std::filesystem::path state_dir;
    /// Activates that session's calibration, unless active; throws where it cannot, and the proposal stays
    /// open.
    std::function<void(const Proposal&, const Say&)> activate;
    /// Records the answer for the plant on disk. After an exception it is called again when the proposal is
    /// received again. Answers that a plant can cause without limit, without an operator and without effect
    /// here, have the priority of telemetry.
    std::function<void(const AnswerFact&, Worth)> answer;
    /// True if the configuration accepts proposals of that kind automatically; called only for kinds
    /// permitted by may_be_policy().
    std::function<bool(ProposalKind)> policy;
    std::function<CellRobot()> robot = [] { return CellRobot(); };
  };
  explicit ProposalBox(Parts parts);

  /// Unusable file and remedy; empty: none.
  const std::string& problem() const { return problem_; }

  /// Handles a received proposal with arbitrary texts, also repeatedly. Returns its state; none: the box is
  /// full. Throws NotDecided (kStorage).
  std::optional<Stand> take(const Proposal& proposal, const std::string& utc);

  /// Newest first.
  std::vector<StoredProposal> all() const;
  /// Number of decided proposals that are no longer listed.
  std::int64_t dropped() const;
  /// kMostLasting are stored: proposals with an effect require an operator's decision, whatever the policy.
  bool full() const;
  /// Return the decided proposal. Throw NotDecided; accept() also the exceptions of activation.
  StoredProposal accept(const std::string& id, const Say& say);
  StoredProposal refuse(const std::string& id, const Say& say);

  /// File of an accepted schedule or priors.
  std::filesystem::path file_of(const Proposal& proposal) const;
  /// Command that puts accepted priors into a robot file; empty for other proposals.
  std::string command_of(const Proposal& proposal) const;

 private:
  /// unusable(), and priors of another model than the cell's robot.
  std::optional<std::string> refusal(const Proposal& proposal) const;
  StoredProposal* known(const std::string& id);
  StoredProposal& open(const std::string& id);
  StoredProposal decide(StoredProposal& kept, Stand stand, const Say& say);
  void report(StoredProposal& kept);
  void by_policy(StoredProposal& kept, const std::string& utc);
  void act(const Proposal& proposal, const Say& say);
  void store() const;
  void make_room();

  Parts parts_;
  std::string problem_;
  mutable std::mutex mutex_;
  StoredProposals kept_;
};

/// Reason why it can never be used, by the cell's own parsers; none: usable.
std::optional<std::string> unusable(const Proposal& proposal);
/// Schedules and priors require an operator.
bool may_be_policy(ProposalKind kind);

// File `proposals.json` ("cellcal.proposals/1").

std::string proposals_to_json(const StoredProposals& kept);
/// Throws calib::FileError.
StoredProposals proposals_from_json(std::string_view json, const std::string& name);

}  // namespace cellcal::daemon::plant

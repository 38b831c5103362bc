#include "daemon/plant/desk/proposal_box.h"

#include <fmt/format.h>

#include <algorithm>

#include "calib/files/input_file.h"
#include "calib/files/json.h"
#include "calib/files/priors_file.h"
#include "daemon/config/unattended_config.h"
#include "daemon/files/atomic_file.h"
#include "daemon/plant/messages/text_fields.h"

namespace cellcal::daemon::plant {

namespace {

constexpr const char* kCell = "cellcald";
constexpr const char* kPolicy = "[plant] accept";

std::filesystem::path file_in(const std::filesystem::path& state_dir) {
  return state_dir / "proposals.json";
}

bool has_a_file(ProposalKind kind) {
  return kind == ProposalKind::kSchedule || kind == ProposalKind::kPriors;
}

bool has_effect(ProposalKind kind) { return kind == ProposalKind::kActivate || has_a_file(kind); }

/// Retention class, the shortest first.
enum class Hold { kNobodys, kDecided, kLasting, kOpen };
Hold hold_of(const StoredProposal& one) {
  if (one.stand == Stand::kOpen) return Hold::kOpen;
  if (one.stand == Stand::kWithdrawn || one.by == kCell) return Hold::kNobodys;
  return has_effect(one.proposal.kind) ? Hold::kLasting : Hold::kDecided;
}

std::size_t count_of(const std::vector<StoredProposal>& all, Hold hold) {
  return static_cast<std::size_t>(std::ranges::count(all, hold, hold_of));
}

/// Foreign texts may have any length.
std::size_t bytes_of(const StoredProposal& one) {
  return one.proposal.text.size() + one.proposal.reason.size() + one.reason.size();
}

/// One line, truncated at a character boundary.
std::string own_reason(const std::string& words) {
  std::string line = printable(words);
  if (line.size() <= kLongestOwnReason) return line;
  constexpr unsigned kWithin = 0xC0, kContinued = 0x80;
  std::size_t end = kLongestOwnReason;
  while (end > 0 && (static_cast<unsigned char>(line[end]) & kWithin) == kContinued) --end;
  line.resize(end);
  return line;
}

namespace fields = calib::fields;
using fields::field;

constexpr const char* kFormat = "cellcal.proposals/1";
constexpr std::size_t kLargestFile = kMostKept * (std::size_t{1} << 18);

/// The message as an object of its own.
fields::Value<Proposal> proposal() {
  return {message_of, [](const calib::JsonReader& reader) {
            const CellName of{reader.at("plant").text(), reader.at("cell").text()};
            return proposal_in(reader.object(), {of, Subject::kProposal, reader.at("id").text()});
          }};
}

const fields::Table<StoredProposal> kKeptFields{
    field("proposal", &StoredProposal::proposal, proposal()),
    field("received", &StoredProposal::received, line()),
    field("stand", &StoredProposal::stand, fields::named<Stand>()),
    field("decided", &StoredProposal::decided, line()),
    field("by", &StoredProposal::by, line()),
    field("reason", &StoredProposal::reason, bounded(kLongestText)),
    fields::optional(field("told", &StoredProposal::reported, fields::flag()))};

}  // namespace

std::optional<std::string> unusable(const Proposal& proposal) {
  if (proposal.kind == ProposalKind::kActivate && proposal.session < 1) return "names no session";
  if (proposal.kind == ProposalKind::kPriors && proposal.text.empty()) return "has no priors";
  if (proposal.kind != ProposalKind::kSchedule) return std::nullopt;
  try {
    const calib::TomlTable table = calib::TomlTable::parse(proposal.text, "proposal");
    // The plant cannot declare that a cell is clear within a window.
    for (const char* key : {"unattended", "responsible"})
      if (table.has(key))
        table.fail(key, "can be declared only by the cell's operators, in cellcald.toml");
    (void)read_schedule(table);
  } catch (const calib::FileError& wrong) {
    return wrong.what();
  }
  return std::nullopt;
}

bool may_be_policy(ProposalKind kind) { return !has_a_file(kind); }

ProposalBox::ProposalBox(Parts parts) : parts_(std::move(parts)) {
  const std::filesystem::path file = file_in(parts_.state_dir);
  if (!std::filesystem::exists(file)) return;
  try {
    kept_ = proposals_from_json(calib::read_file(file), file.string());
  } catch (const std::exception& damaged) {
    problem_ =
        std::string(damaged.what()) +
        ". No proposal is accepted. Move the file aside and restart cellcald; the plant proposes "
        "again";
  }
}

std::filesystem::path ProposalBox::file_of(const Proposal& proposal) const {
  return parts_.state_dir / "proposals" / (proposal.id + ".toml");
}

std::string ProposalBox::command_of(const Proposal& proposal) const {
  if (proposal.kind != ProposalKind::kPriors) return {};
  const std::string robot = parts_.robot().file;
  return fmt::format("cellcal priors accept {} --robot {} -o NEW.toml",
                     shell_word(file_of(proposal).string()),
                     robot.empty() ? "ROBOT.toml" : shell_word(robot));
}

std::optional<std::string> ProposalBox::refusal(const Proposal& proposal) const {
  if (auto why = unusable(proposal)) return why;
  if (proposal.kind != ProposalKind::kPriors) return std::nullopt;
  const CellRobot robot = parts_.robot();
  if (robot.nominal_geometry.empty()) return std::nullopt;
  try {
    const calib::FleetPriors priors = calib::parse_priors(proposal.text, "proposal");
    if (priors.nominal_geometry == robot.nominal_geometry) return std::nullopt;
    return fmt::format(
        "priors of {}, nominal geometry {:.12}; this cell's {} has {:.12}. Use priors learned from "
        "this model",
        priors.robot, priors.nominal_geometry, robot.name, robot.nominal_geometry);
  } catch (const calib::FileError& wrong) {
    return wrong.what();
  }
}

void ProposalBox::store() const {
  if (!problem_.empty()) throw NotDecided(NotDecided::Why::kStorage, problem_);
  try {
    write_atomically(file_in(parts_.state_dir), proposals_to_json(kept_));
  } catch (const std::exception& error) {
    throw NotDecided(NotDecided::Why::kStorage, error.what());
  }
}

StoredProposal* ProposalBox::known(const std::string& id) {
  const auto found =
      std::ranges::find(kept_.all, id, [](const StoredProposal& one) { return one.proposal.id; });
  return found == kept_.all.end() ? nullptr : &*found;
}

StoredProposal& ProposalBox::open(const std::string& id) {
  StoredProposal* found = known(id);
  if (found == nullptr)
    throw NotDecided(NotDecided::Why::kUnknown, "unknown proposal \"" + id + "\"");
  if (found->stand != Stand::kOpen)
    throw NotDecided(NotDecided::Why::kDecided, "proposal \"" + id + "\" was " +
                                                    to_string(found->stand) + " by " + found->by +
                                                    " on " + found->decided);
  return *found;
}

/// Stored on disk, or not decided. A failed report to the plant does not revert it.
StoredProposal ProposalBox::decide(StoredProposal& kept, Stand stand, const Say& say) {
  const StoredProposal before = kept;
  kept.stand = stand;
  kept.decided = say.utc;
  kept.by = say.by;
  kept.reason = say.reason;
  try {
    store();
  } catch (...) {
    kept = before;
    throw;
  }
  report(kept);
  return kept;
}

void ProposalBox::report(StoredProposal& kept) {
  if (kept.reported || kept.stand == Stand::kOpen) return;
  try {
    const bool person = kept.stand != Stand::kWithdrawn && kept.by != kCell && kept.by != kPolicy;
    const bool effect = kept.stand == Stand::kAccepted && has_effect(kept.proposal.kind);
    parts_.answer({kept.proposal.id, kept.stand == Stand::kAccepted, kept.by, kept.reason},
                  person || effect ? Worth::kResult : Worth::kTelemetry);
    kept.reported = true;
    store();
  } catch (const std::exception&) {
    // Repeated when the proposal is received again: the plant gets the answer twice at worst.
  }
}

void ProposalBox::act(const Proposal& proposal, const Say& say) {
  if (proposal.kind == ProposalKind::kActivate) parts_.activate(proposal, say);
  if (!has_a_file(proposal.kind)) return;
  try {
    std::filesystem::create_directories(file_of(proposal).parent_path());
    write_atomically(file_of(proposal), proposal.text);
  } catch (const std::exception& error) {
    throw NotDecided(NotDecided::Why::kStorage, error.what());
  }
}

/// Drops the oldest proposals: undecided by an operator first, then those without an effect. Ids of proposals with an effect are
/// kept longest, since a forgotten one could be carried out again.
void ProposalBox::make_room() {
  std::vector<StoredProposal>& all = kept_.all;
  const auto bytes = [&] {
    std::size_t sum = 0;
    for (const StoredProposal& one : all) sum += bytes_of(one);
    return sum;
  };
  const auto too_many = [&] {
    return all.size() - count_of(all, Hold::kLasting) > kMostKept || bytes() > kMostKeptBytes;
  };
  const auto drop_oldest = [&](Hold hold) {
    const auto oldest = std::ranges::find(all, hold, hold_of);
    if (oldest == all.end()) return false;
    all.erase(oldest);
    ++kept_.dropped;
    return true;
  };
  for (const Hold hold : {Hold::kNobodys, Hold::kDecided})
    while (too_many() && drop_oldest(hold)) {
    }
  for (auto one = all.begin(); one != all.end() && bytes() > kMostKeptBytes; ++one)
    if (hold_of(*one) == Hold::kLasting) one->proposal.text = one->proposal.reason = "";
  while (count_of(all, Hold::kLasting) > kMostLasting) drop_oldest(Hold::kLasting);
}

std::optional<Stand> ProposalBox::take(const Proposal& proposal, const std::string& utc) {
  const std::lock_guard lock(mutex_);
  StoredProposal* kept = known(proposal.id);
  const bool withdrawn = proposal.kind == ProposalKind::kWithdraw;
  const Say withdrawal{proposal.by, own_reason("withdrawn: " + proposal.reason), utc};
  if (kept != nullptr && withdrawn && kept->stand == Stand::kOpen)
    return decide(*kept, Stand::kWithdrawn, withdrawal).stand;
  if (kept == nullptr) {
    if (!withdrawn && count_of(kept_.all, Hold::kOpen) >= kMostOpen) return std::nullopt;
    const StoredProposals before = kept_;
    kept_.all.push_back({proposal, utc, Stand::kOpen, "", "", ""});
    make_room();
    kept = &kept_.all.back();
    try {
      if (withdrawn)  // withdrawn before it was received
        return decide(*kept, Stand::kWithdrawn, withdrawal).stand;
      if (const auto why = refusal(proposal))
        return decide(*kept, Stand::kRefused, {kCell, own_reason(*why), utc}).stand;
      store();
    } catch (...) {
      kept_ = before;
      throw;
    }
  }
  report(*kept);
  if (kept->stand == Stand::kOpen) by_policy(*kept, utc);
  return kept->stand;
}

/// On failure the decision is left to an operator, or to the next reception.
void ProposalBox::by_policy(StoredProposal& kept, const std::string& utc) {
  if (!may_be_policy(kept.proposal.kind) || !parts_.policy(kept.proposal.kind)) return;
  if (has_effect(kept.proposal.kind) && count_of(kept_.all, Hold::kLasting) >= kMostLasting) return;
  const Say say{kPolicy, "", utc};
  try {
    act(kept.proposal, say);
  } catch (const std::exception&) {
    return;
  }
  decide(kept, Stand::kAccepted, say);
}

std::vector<StoredProposal> ProposalBox::all() const {
  const std::lock_guard lock(mutex_);
  return {kept_.all.rbegin(), kept_.all.rend()};
}

std::int64_t ProposalBox::dropped() const {
  const std::lock_guard lock(mutex_);
  return kept_.dropped;
}

bool ProposalBox::full() const {
  const std::lock_guard lock(mutex_);
  return count_of(kept_.all, Hold::kLasting) >= kMostLasting;
}

StoredProposal ProposalBox::accept(const std::string& id, const Say& say) {
  const std::lock_guard lock(mutex_);
  StoredProposal& kept = open(id);
  if (const auto why = refusal(kept.proposal))
    throw NotDecided(NotDecided::Why::kUnusable, "proposal \"" + id + "\" cannot be used: " + *why);
  act(kept.proposal, say);
  return decide(kept, Stand::kAccepted, say);
}

StoredProposal ProposalBox::refuse(const std::string& id, const Say& say) {
  const std::lock_guard lock(mutex_);
  return decide(open(id), Stand::kRefused, say);
}

std::string proposals_to_json(const StoredProposals& kept) {
  return calib::write_lines(
      {{"format", kFormat},
       {"dropped", kept.dropped},
       {"proposals", fields::list(fields::object(kKeptFields)).to(kept.all)}});
}

StoredProposals proposals_from_json(std::string_view json, const std::string& name) {
  const nlohmann::json parsed = json_of(json, kLargestFile, name);
  const calib::JsonReader reader(parsed, name);
  if (reader.at("format").text() != kFormat)
    reader.at("format").fail(std::string("must be \"") + kFormat + '"');
  return {fields::list(fields::object(kKeptFields)).from(reader.at("proposals")),
          reader.has("dropped") ? count<std::int64_t>().from(reader.at("dropped")) : 0};
}

}  // namespace cellcal::daemon::plant

// What the plant proposed to this cell, and what is said to it. Nothing here begins a session.

#include <spdlog/spdlog.h>

#include <nlohmann/json.hpp>

#include "daemon/api/handlers.h"
#include "daemon/api/http/json_text.h"
#include "daemon/api/routes.h"
#include "daemon/api/who_and_why.h"
#include "daemon/archive/versions.h"
#include "daemon/plant/proposals/proposal_box.h"
#include "daemon/runner/backend.h"

namespace cellcal::daemon {

namespace {

using nlohmann::json;
using plant::KeptProposal, plant::NotDecided, plant::ProposalKind, plant::Stand;

json text_or_null(const std::string& text) { return text.empty() ? json(nullptr) : json(text); }

json to_json(const KeptProposal& one, const plant::ProposalBox& box) {
  const plant::Proposal& proposal = one.proposal;
  const bool has_file = one.stand == Stand::kAccepted && !may_be_policy(proposal.kind);
  return {{"id", proposal.id},
          {"kind", to_string(proposal.kind)},
          {"session", proposal.session > 0 ? json(proposal.session) : json(nullptr)},
          {"text", proposal.text},
          {"by", proposal.by},
          {"reason", proposal.reason},
          {"received", one.received},
          {"stand", to_string(one.stand)},
          {"decided", text_or_null(one.decided)},
          {"decided_by", text_or_null(one.by)},
          {"decided_reason", text_or_null(one.reason)},
          {"file", has_file ? json(box.file_of(proposal).string()) : json(nullptr)}};
}

/// {"reason": "why", "by": "a name"}, both of which may be missing where it is accepted.
plant::Say say_in(const Request& request, bool needs_reason) {
  const json body =
      request.body.empty() ? json::object() : json::parse(request.body, nullptr, false);
  if (!body.is_object()) throw BadRequest(R"(the body must be {"reason": "why", "by": "a name"})");
  for (const auto& [key, value] : body.items())
    if (key != "reason" && key != "by") throw BadRequest("\"reason\" and \"by\" are known here");
  plant::Say say{who_asks(request, body), "", wall_clock_utc()};
  if (needs_reason || body.contains("reason")) say.reason = line_in(body, "reason", kLongestReason);
  return say;
}

/// What is the matter with it passes, or never does.
template <class Act>
auto decided(Act act) {
  try {
    return act();
  } catch (const NotDecided& refused) {
    if (refused.why == NotDecided::Why::kUnknown) throw NotFound(refused.what());
    if (refused.why == NotDecided::Why::kUnusable) throw RequestError(refused.what());
    throw BusyError(refused.what());
  } catch (const NotActivated& refused) {
    throw RequestError(std::string("not accepted: ") + refused.what());
  }
}

}  // namespace

plant::ProposalBox& Api::proposals() {
  if (proposals_ == nullptr || (plant_line_ && !plant_line_()))
    throw NotFound(
        "this cell belongs to no plant. Set [plant] in cellcald.toml and restart cellcald");
  return *proposals_;
}

/// Of a cell that belongs to no plant: none.
std::optional<Response> Api::show_proposals(const Call&) {
  json list = json::array();
  if (proposals_ == nullptr || (plant_line_ && !plant_line_()))
    return Response{
        .body = dump({{"problem", nullptr}, {"dropped", 0}, {"proposals", std::move(list)}})};
  for (const KeptProposal& one : proposals().all()) list.push_back(to_json(one, proposals()));
  return Response{.body = dump({{"problem", text_or_null(proposals().problem())},
                                {"dropped", proposals().dropped()},
                                {"proposals", std::move(list)}})};
}

std::optional<Response> Api::accept_proposal(const Call& call) {
  const plant::Say say = say_in(call.request, false);
  const KeptProposal kept =
      decided([&] { return proposals().accept(std::string(call.variable), say); });
  spdlog::info("proposal {} of {} accepted by {}", kept.proposal.id, kept.proposal.by, say.by);
  return Response{.body = dump(to_json(kept, proposals()))};
}

std::optional<Response> Api::refuse_proposal(const Call& call) {
  const plant::Say say = say_in(call.request, true);
  const KeptProposal kept =
      decided([&] { return proposals().refuse(std::string(call.variable), say); });
  spdlog::info("proposal {} of {} refused by {}: {}", kept.proposal.id, kept.proposal.by, say.by,
               say.reason);
  return Response{.body = dump(to_json(kept, proposals()))};
}

}  // namespace cellcal::daemon

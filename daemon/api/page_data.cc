// Data of the page's drawings: the cell, the planned touches and their results.

#include <spdlog/spdlog.h>

#include "calib/files/calibration_json.h"
#include "calib/files/files.h"
#include "calib/model/error.h"
#include "daemon/api/handlers.h"
#include "daemon/api/page_drift.h"
#include "daemon/api/page_figures.h"
#include "daemon/api/page_scene.h"
#include "daemon/api/routes.h"
#include "daemon/tasks/options.h"

namespace cellcal::daemon {

namespace {

/// Session of the drawing: `?session=N`, otherwise the newest. 0: none.
std::int64_t session_asked_for(const Request& request, const Status& status, Journal& journal) {
  if (const auto asked = whole_number_in(request, "session")) return *asked;
  if (status.session > 0) return status.session;
  const auto all = journal.sessions();
  return all.empty() ? 0 : all.front().id;
}

/// Includes meshes whose files still exist at their place in the cell file.
calib::Cell drawn_cell(const SessionInputs& inputs) {
  calib::Cell cell = cell_of(inputs);
  try {
    calib::load_meshes(cell, std::filesystem::path(inputs.cell_name).parent_path());
  } catch (const calib::FileError& missing) {
    spdlog::warn("drawn without meshes: {}", missing.what());
  }
  return cell;
}

std::optional<calib::Calibration> calibration_of(const SessionRecord& record) {
  if (record.calibration.empty()) return std::nullopt;
  try {
    return calib::calibration_from_json(record.calibration, "session " + std::to_string(record.id));
  } catch (const std::runtime_error& other_version) {
    spdlog::warn("not shown: {}", other_version.what());
    return std::nullopt;
  }
}

}  // namespace

std::optional<Response> Api::scene(const Call& call) {
  const std::int64_t id = session_asked_for(call.request, service_.status(), journal_);
  const auto record = id > 0 ? journal_.session(id) : std::nullopt;
  if (!record) throw NotFound("no such session, so no cell to draw. Start one: cellcal run");
  return Response{.body = web::scene_to_json(id, drawn_cell(record->inputs))};
}

/// For the cell of `?session=N`, otherwise of the newest session with a result.
std::optional<Response> Api::drift(const Call& call) {
  const auto id = whole_number_in(call.request, "session");
  const auto asked = id ? journal_.session(*id) : std::nullopt;
  const auto calibration = [this](std::int64_t session) {
    const auto record = journal_.session(session);
    return record ? calibration_of(*record) : std::nullopt;
  };
  std::vector<SessionRecord> sessions = journal_.sessions();
  // An imported session may name the same path for another cell.
  std::erase_if(sessions, [](const SessionRecord& record) {
    return record.origin.has_value() || !record.has_calibration;
  });
  const std::string cell = asked ? asked->inputs.cell_name : "";
  const auto checks = drift_watch_.look(cell);
  return Response{.body = web::drift_to_json(sessions, cell, calibration, checks.get(),
                                             advice_ ? advice_() : AdviceStatus())};
}

std::optional<Response> Api::plan(const Call& call) {
  const SessionRecord record = find(call);
  const PlanInHand in_hand = service_.plan();
  if (in_hand.session != record.id || in_hand.plan == nullptr) {
    throw NotFound("the plan of session " + std::to_string(record.id) +
                   " is not in memory: it is kept while the session is the newest of this daemon");
  }
  return Response{
      .body = web::plan_to_json(record.id, in_hand.first, *in_hand.plan, cell_of(record.inputs))};
}

std::optional<Response> Api::figures(const Call& call) {
  const SessionRecord record = find(call);
  const auto calibration = calibration_of(record);
  std::map<std::size_t, web::FigureOfTouch> made;
  for (const auto& touch : service_.made(record.id))
    made[touch->index] = {touch->residual_m, touch->u95_m};
  return Response{.body = web::figures_to_json(record, cell_of(record.inputs),
                                               journal_.touches(record.id),
                                               calibration ? &*calibration : nullptr, made)};
}

}  // namespace cellcal::daemon

#include "daemon/service/kind.h"

#include <fmt/format.h>

#include <limits>
#include <stdexcept>

#include "daemon/tasks/planned_round.h"

namespace cellcal::daemon {

std::string Kind::not_resumed(const SessionRecord&) const { return ""; }

void Kind::begin(Journal&, const RunRequest& request, Job& job) const {
  job.inputs = read_inputs(request.cell);
}

std::optional<Compared> Kind::compared(Journal&, const Job&) const { return std::nullopt; }

bool Kind::chooses(const Job&) const { return true; }

void Kind::examine(const Job&) const {}

void Kind::adapt(State&, const Job&) const {}

void Kind::add_inputs(TaskInputs&, Journal&, const Job&) const {}

const Kind& kind_of(SessionKind kind, bool update) {
  switch (kind) {  // no default: a value without a class does not compile
    case SessionKind::kCalibrate:
      return update ? update_kind() : calibration_kind();
    case SessionKind::kQualify:
      return qualification_kind();
    case SessionKind::kCheck:
      return check_kind();
    case SessionKind::kFind:
      return find_kind();
    case SessionKind::kDryRun:
      return dry_run_kind();
  }
  throw std::logic_error("no class for this kind of session");
}

/// Session record of a calibration. Throws RequestError where its cell file has changed since.
SessionRecord unchanged(SessionRecord record) {
  const SessionInputs now = read_inputs(record.inputs.cell_name);
  if (now.cell_text != record.inputs.cell_text || now.robot_text != record.inputs.robot_text)
    throw RequestError(fmt::format(
        "{} or its robot file has changed since session {} calibrated it. Put it back, or "
        "calibrate again",
        record.inputs.cell_name, record.id));
  return record;
}

void expect_contacts(State& first, const calib::Cell& cell) {
  first.policy.confirm_every = std::numeric_limits<int>::max();
  for (const calib::Target& target : cell.targets) first.met.push_back(target.id);
}

}  // namespace cellcal::daemon

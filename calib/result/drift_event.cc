#include "calib/result/drift_event.h"

#include "calib/model/units.h"

namespace cellcal::calib {

const char* to_string(DriftEventKind kind) {
  using enum DriftEventKind;
  static constexpr EnumNames<DriftEventKind> kTable{
      {{kCalibrated, "calibrated"}, {kUpdated, "updated"}, {kActivated, "activated"}}};
  return kTable[kind];
}

namespace {

Phrase opening_of(const DriftEvent& event) {
  switch (event.kind) {
    case DriftEventKind::kUpdated:
      return {"say.event.updated", {{"session", event.session}}};
    case DriftEventKind::kActivated:
      return {"say.event.activated",
              {{"session", event.session}, {"by", event.by}, {"reason", event.reason}}};
    case DriftEventKind::kCalibrated:
      break;
  }
  return {"say.event.calibrated", {{"session", event.session}}};
}

}  // namespace

Phrase phrase(const DriftEvent& event) {
  constexpr const char* kJoin = "say.join.comma";
  Phrase changes;
  if (event.tcp_moved_m)
    changes = {"say.event.tool", {{"moved", *event.tcp_moved_m * kMmPerM}}};
  else if (event.cell_changed)
    changes = "say.event.cell";
  if (event.robot_changed) changes = joined(kJoin, changes, "say.event.robot");
  if (event.accepted) changes = joined(kJoin, changes, "say.event.accepted");
  return joined("say.join.colon", opening_of(event), changes);
}

}  // namespace cellcal::calib

#include "calib/model/robot.h"

#include <stdexcept>

namespace cellcal::calib {

std::size_t Cell::target_index(const std::string& id) const {
  for (std::size_t i = 0; i < targets.size(); ++i)
    if (targets[i].id == id) return i;
  throw std::out_of_range("no target \"" + id + "\" in the cell");
}

namespace {

struct KindName {
  const char* name;
  TargetKind kind;
};
constexpr KindName kKinds[] = {{"sphere", TargetKind::kSphere},
                               {"wire", TargetKind::kWire},
                               {"plane", TargetKind::kPlane},
                               {"point", TargetKind::kPoint},
                               {"tracker", TargetKind::kTracker}};

}  // namespace

const char* to_string(TargetKind kind) {
  for (const KindName& one : kKinds)
    if (one.kind == kind) return one.name;
  return "";
}

std::optional<TargetKind> target_kind(std::string_view name) {
  for (const KindName& one : kKinds)
    if (one.name == name) return one.kind;
  return std::nullopt;
}

}  // namespace cellcal::calib

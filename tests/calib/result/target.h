#pragma once

#include <string>

#include "calib/model/robot.h"

namespace cellcal::calib::testing {

/// A target for sentences.
inline Target target(const std::string& id, TargetKind kind = TargetKind::kSphere) {
  Target one;
  one.id = id;
  one.kind = kind;
  return one;
}

}  // namespace cellcal::calib::testing

#pragma once
// Kinds of targets, as files name them.

#include <optional>
#include <string_view>

#include "calib/model/robot.h"

namespace cellcal::calib {

const char* to_string(TargetKind kind);
/// Of a name that is none, nothing.
std::optional<TargetKind> target_kind(std::string_view name);

}  // namespace cellcal::calib

#pragma once
// The cell file that new-cell writes: every key of cellcal.cell/1, set or as a comment.
//
// `#key = value` shows a default: without the '#' it says the same. Keys that go with another kind of
// target or obstacle stand in whole commented tables, and those that exclude a set one in the words.

#include <string>

#include "daemon/cell_form/cell_form.h"

namespace cellcal::daemon {

std::string cell_text(const CellForm& form);

}  // namespace cellcal::daemon

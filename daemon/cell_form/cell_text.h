#pragma once
// The cell file that new-cell writes: every key of cellcal.cell/1, set or as a comment.
//
// `#key = value` shows a default: without the '#' it says the same. Keys that go with another kind of
// target or obstacle stand in whole commented tables, and those that exclude a set one in the words.

#include <filesystem>
#include <string>
#include <vector>

#include "daemon/cell_form/cell_form.h"

namespace cellcal::daemon {

std::string cell_text(const CellForm& form);

// What a cell file has that a form does not: it is named, and stays in the file that the form writes.

/// Names of it, as "tool.com_mm", "obstacle table"; empty: the form has all. `text`: a cell file that form_in() reads as `form`.
std::vector<std::string> beyond(const CellForm& form, const std::string& text);

/// The form's file with what `before` has beyond the form that was read of it; commented where there is nothing beyond.
/// `folder`: of the file `before`; meshes named relative to it are named absolutely. Throws calib::FileError.
std::string cell_text_with(const CellForm& form, const std::string& before,
                           const std::filesystem::path& folder);

}  // namespace cellcal::daemon

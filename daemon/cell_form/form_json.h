#pragma once
// A form as JSON: what a page sends and shows. Millimetres and degrees, as typed.

#include <nlohmann/json.hpp>

#include "daemon/cell_form/cell_form.h"

namespace cellcal::daemon {

nlohmann::json to_json(const CellForm& form);
nlohmann::json to_json(const std::vector<SphereForm>& spheres);
nlohmann::json to_json(const std::vector<LengthForm>& lengths);

/// The robot by the name of a shipped one. A sphere may have "joints_deg", the axis angles with the tip on its top, in the place of
/// "centre_mm": the nominal arm says where its centre is then. `cell_file`: where the form will be written. Throws
/// calib::FileError with the key. `before`: the form that it changes, whose robot may be no shipped one; null: none.
CellForm form_from_json(const nlohmann::json& json, const std::filesystem::path& cell_file,
                        const CellForm* before = nullptr);

/// Robot, tool, spheres and lengths of any cell file; what else it has is beyond() the form (kept.h). Nothing: several tools, or what
/// else no form can show as it is. Throws calib::FileError where it is no TOML.
std::optional<CellForm> form_in(const std::string& cell_text,
                                const std::filesystem::path& cell_file);

}  // namespace cellcal::daemon

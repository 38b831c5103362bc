#pragma once
// A controller's arm, tools, loads and bases for robot and cell files.

#include <optional>
#include <string>
#include <vector>

#include "calib/export/machine_data.h"
#include "daemon/cell_form/cell_form.h"

namespace cellcal::daemon {

/// True if the files state any of the arm's lengths.
bool has_an_arm(const calib::MachineData& data);

/// The arm on the linear unit that carries it and with the positioner, if the files describe them, with a line that
/// states each; where they do in part, or describe another kinematic, without it and a warning that names the variable.
/// A linear unit and a positioner that the arm has already stay.
calib::Robot with_external_axes(calib::Robot arm, const calib::MachineData& data);

/// Warns where the controller has the arm of `file` mounted otherwise. `taken`: what is written has it so; else the
/// warning says how to take it.
void compare_mounting(const calib::MachineData& data, const calib::Robot& robot,
                      const std::string& file, bool taken);
/// States a mounting other than on the floor.
void print_mounting(const calib::Robot& robot);

/// TOOL_DATA[number] with mass and centre of its LOAD_DATA, if stated. Throws calib::FileError naming number and
/// file: not stated, empty, or a tool that stands in the cell.
ToolForm tool_of(const calib::MachineData& data, int number);
/// Numbers that tool_of() takes.
std::vector<int> measured_tools(const calib::MachineData& data);
/// 1 "torch", 3 "probe".
std::string tool_list(const calib::MachineData& data);

/// Measured tools with their loads, as keys of [tool], and bases in the robot's base frame; one line each, those
/// that belong together indented.
std::vector<std::string> frame_lines(const calib::MachineData& data);

}  // namespace cellcal::daemon

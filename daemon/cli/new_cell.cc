#include "daemon/cli/new_cell.h"

#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "calib/files/files.h"
#include "calib/plan/cell_check.h"
#include "calib/plan/plan.h"
#include "daemon/cell_form/cell_text.h"
#include "daemon/cli/dialogue.h"
#include "daemon/files/atomic_file.h"
#include "daemon/files/correction_limit.h"

namespace cellcal::daemon {

namespace {

using nlohmann::json;

/// Fills the form from the options and returns the parts given. Throws with the option's name as a prefix.
Given apply_request_options(const NewCellCommand& command, CellForm& form) {
  Given given;
  const auto take = [](const char* option, auto what) {
    try {
      what();
    } catch (const std::runtime_error& wrong) {
      throw std::runtime_error(fmt::format("{}: {}", option, wrong.what()));
    }
  };
  if ((given.robot = !command.robot.empty()))
    take("--robot", [&] { form.robot = find_robot(command.robot, command.output); });
  if ((given.tool = !command.tool.empty())) {
    take("--tool", [&] {
      const std::vector<double> six = numbers(command.tool, {3, 6});
      std::copy_n(six.begin(), 3, form.tool.xyz_mm.begin());
      if (six.size() == 6) std::copy_n(six.begin() + 3, 3, form.tool.abc_deg.begin());
    });
  }
  form.tool.xyz_sigma_mm.fill(command.tool_sigma_mm.value_or(kUsualTcpSigmaMm));
  given.tool_sigma = command.tool_sigma_mm.has_value();
  if ((given.mass = command.mass_kg.has_value())) form.tool.mass_kg = command.mass_kg;
  if ((given.tip_radius = command.tip_radius_mm.has_value()))
    form.tool.tip_radius_mm = *command.tip_radius_mm;
  if ((given.spheres = !command.spheres.empty()))
    take("--spheres", [&] { form.spheres = load_spheres(command.spheres); });
  if ((given.certificate = !command.certificate.empty()))
    take("--certificate", [&] { form.lengths = load_certificate(command.certificate); });
  return given;
}

/// Result of planning a session with the default number of touches.
struct Planned {
  std::optional<std::string> why_not;
  std::size_t touches = 0;
  double mean_mm = 0.0, u95_mm = 0.0;
  LimitNeeded limit;
};

Planned plan_it(const calib::Cell& cell) {
  Planned planned;
  for (const calib::Target& target : cell.targets) {
    if (target.has_centre) continue;
    planned.why_not = fmt::format(
        "{} has no centre_mm: give search_low_mm and search_high_mm, and 'cellcal run --find' finds it",
        target.id);
    return planned;
  }
  try {
    const calib::Plan plan = calib::make_plan(cell, {});
    planned.touches = plan.touches.size();
    planned.mean_mm = plan.predicted_mean_m * calib::kMmPerM;
    planned.u95_mm = plan.predicted_u95_m * calib::kMmPerM;
    planned.limit = limit_needed(plan, cell.robot, plan.start);
  } catch (const calib::PlanError& error) {
    planned.why_not = error.what();
  }
  return planned;
}

/// Lines for cellcald.toml that this cell needs.
std::string daemon_lines(const LimitNeeded& limit) {
  return fmt::format(
      "into cellcald.toml, over RSI:\n  [rsi]\n  correction_limit_deg = {:<12.0f} # for {}, wherever on its way a "
      "session is resumed\n",
      advised_limit_deg(limit), limit.widest_axis);
}

std::string words(const NewCellCommand& command, const CellForm& form, const calib::Cell& cell,
                  const std::vector<std::string>& warnings, const Planned& planned) {
  const std::string file = command.output.string();
  std::string text = fmt::format("{}: {}, {} spheres, {} certified lengths\n", file,
                                 cell.robot.name, form.spheres.size(), form.lengths.size());
  for (const std::string& warning : warnings) text += "warning: " + warning + "\n";
  if (form.lengths.empty())
    text += "warning: no certified length: the result will count near the spheres only\n";
  if (planned.why_not) {
    text += "not planned yet: " + *planned.why_not + "\n";
  } else {
    text += fmt::format("plan of {} touches: predicted mean error {:.3f} mm, u95 {:.3f} mm\n",
                        planned.touches, planned.mean_mm, planned.u95_mm);
    text += daemon_lines(planned.limit);
  }
  return text + fmt::format("next: cellcal doctor --cell {}\n", file);
}

std::string as_json(const NewCellCommand& command, const std::vector<std::string>& warnings,
                    const Planned& planned) {
  json value{{"file", command.output.string()},
             {"warnings", warnings},
             {"why_not_planned", nullptr},
             {"plan", nullptr}};
  if (planned.why_not) {
    value["why_not_planned"] = *planned.why_not;
  } else {
    value["plan"] = {{"touches", planned.touches},
                     {"predicted_mean_mm", planned.mean_mm},
                     {"predicted_u95_mm", planned.u95_mm},
                     {"correction_limit_deg", advised_limit_deg(planned.limit)},
                     {"correction_limit_from_start_deg", planned.limit.limit_deg}};
  }
  return value.dump(1) + "\n";
}

/// Checked before the first question, so that no answers are lost.
void require_output_folder(const NewCellCommand& command) {
  const std::filesystem::path folder = std::filesystem::absolute(command.output).parent_path();
  if (!std::filesystem::is_directory(folder))
    throw std::runtime_error(fmt::format(
        "folder {} does not exist. Create it, or choose another with -o", folder.string()));
  if (std::filesystem::is_directory(command.output))
    throw std::runtime_error(command.output.string() + " is a folder. Give a file in it with -o");
  if (::access(folder.c_str(), W_OK) != 0)
    throw std::runtime_error(
        fmt::format("no permission to write into {}. Use sudo, or choose another folder with -o",
                    folder.string()));
}

void refuse_to_replace(const NewCellCommand& command) {
  if (std::filesystem::exists(command.output) && !command.force)
    throw std::runtime_error(command.output.string() +
                             " exists. Choose another file with -o, or replace it with --force");
}

}  // namespace

int new_cell(const NewCellCommand& command, std::istream& in, std::ostream& asked) {
  require_output_folder(command);
  refuse_to_replace(command);
  CellForm form;
  ask_for_rest(form, apply_request_options(command, form), command.output, in, asked);
  if (const std::string wrong = objection(form); !wrong.empty())
    throw std::runtime_error(wrong + " (nothing was written)");
  const calib::Cell cell = cell_of(form);
  const std::vector<std::string> warnings =
      calib::refuse_faulty(cell);  // before an existing file is replaced
  write_atomically(command.output, cell_text(form));
  const Planned planned = plan_it(cell);
  fmt::print("{}", command.json ? as_json(command, warnings, planned)
                                : words(command, form, cell, warnings, planned));
  return planned.why_not ? 1 : 0;
}

void add_new_cell_command(CLI::App& app, int& status) {
  auto given = std::make_shared<NewCellCommand>();
  CLI::App* command = app.add_subcommand("new-cell", "Write a commented cell file with every key");
  command->footer(
      "Asks for what the options leave out; with --robot, --tool and --spheres it asks nothing. "
      "Ctrl-D or\nCtrl-C ends it and nothing is written. Spheres can be taught: jog the tip onto the "
      "top of each and\nenter the axis angles that the pendant shows.\nExit status 1: nothing "
      "written, or no plan can be made of the file yet; the reason is printed.\nExample: cellcal new-cell -o "
      "cell.toml\n         cellcal new-cell -o cell.toml --robot kr6_r900_2 --tool 0,0,250,0,0,0 "
      "--spheres spheres.csv --certificate certificate.csv");
  command->add_option("-o,--output,--out", given->output, "The file to write")
      ->capture_default_str();
  command->add_option("--robot", given->robot, "Shipped robot by name, or path of a robot file");
  command->add_option("--tool", given->tool,
                      "X,Y,Z or X,Y,Z,A,B,C from flange to TCP, as TOOL_DATA (mm, deg)");
  command
      ->add_option(
          "--tool-sigma", given->tool_sigma_mm,
          "1 sigma of X, Y and Z of it, in mm (0.5: measured with four points; 0: exact, the "
          "TCP is not estimated)")
      ->check(CLI::Range(0.0, 1e3));
  command->add_option("--mass", given->mass_kg, "Of all that is on the flange, in kg")
      ->check(CLI::Range(0.0, 1e4));
  command->add_option("--tip-radius", given->tip_radius_mm, "Of the tip, in mm; 0: a point")
      ->check(CLI::Range(0.0, 1e3));
  command->add_option("--spheres", given->spheres,
                      "CSV: id,diameter_mm and, where known, diameter_sigma_mm,x_mm,y_mm,z_mm, "
                      "centre_sigma_mm");
  command->add_option("--certificate", given->certificate,
                      "CSV of certified lengths: from,to,mm,sigma_mm");
  command->add_flag("--force", given->force, "Replace an existing file");
  command->add_flag("--json", given->json, "Print the result as JSON");
  command->callback([given, &status] { status = new_cell(*given, std::cin, std::cerr); });
}

}  // namespace cellcal::daemon

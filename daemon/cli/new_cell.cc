#include "daemon/cli/new_cell.h"

#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <functional>
#include <iostream>
#include <istream>
#include <memory>
#include <nlohmann/json.hpp>
#include <ostream>
#include <utility>

#include "calib/files/cell_file.h"
#include "calib/files/files.h"
#include "calib/files/input_file.h"
#include "calib/files/robot_file.h"
#include "calib/files/text.h"
#include "calib/files/toml.h"
#include "calib/plan/cell_check.h"
#include "calib/plan/lowest.h"
#include "calib/plan/plan.h"
#include "calib/words/phrase_json.h"
#include "daemon/cell_form/cell_text.h"
#include "daemon/cli/backup.h"
#include "daemon/cli/commands.h"
#include "daemon/cli/controller_data.h"
#include "daemon/cli/offline.h"
#include "daemon/files/atomic_file.h"
#include "daemon/files/correction_limit.h"

namespace cellcal::daemon {

namespace {

using nlohmann::json;

/// Tool by TOOL_DATA and LOAD_DATA; other properties stay.
void apply_tool(const ToolForm& of_controller, CellForm& form) {
  form.tool.xyz_mm = of_controller.xyz_mm;
  form.tool.abc_deg = of_controller.abc_deg;
  if (of_controller.mass_kg) form.tool.mass_kg = of_controller.mass_kg;
  form.tool.com_mm = of_controller.com_mm;
}

/// kr210_r2700_extra.toml beside the cell file, of the controller's own arm.
NamedRobotFile robot_file_of(const calib::MachineData& data, const NewCellCommand& command) {
  const calib::Robot robot = with_external_axes(calib::arm_of_controller(data), data);
  print_mounting(robot);
  NamedRobotFile file;
  file.reference = calib::krl::lower_case(robot.name) + ".toml";
  std::ranges::replace_if(
      file.reference.begin(), file.reference.end() - 5,
      [](unsigned char c) { return std::isalnum(c) == 0; }, '_');
  file.name = (command.output.parent_path() / file.reference).string();
  file.text = calib::robot_to_toml(robot);
  read_back(file.text, file.name, as_robot);
  if (!command.force && std::filesystem::exists(file.name) &&
      calib::read_file(file.name, calib::kMostTomlBytes) != file.text)
    throw std::runtime_error(file.name +
                             " exists and is another robot. Name it with --robot, or replace it "
                             "with --force");
  return file;
}

/// Arm, tool, load and bases of the controller, as far as no option states them.
void apply_controller(const NewCellCommand& command, CellForm& form, Given& given) {
  if (command.machine_data.empty()) return;
  const calib::MachineData data = read_machine_files(command.machine_data);
  if (given.robot)
    compare_mounting(data,
                     calib::read_robot(calib::TomlTable::parse(form.robot.text, form.robot.name)),
                     command.robot, false);
  else if ((given.robot = has_an_arm(data)))
    form.robot = robot_file_of(data, command);
  form.notes = frame_lines(data);
  for (const int number : measured_tools(data)) given.tools[number] = tool_of(data, number);
  given.tool_list = tool_list(data);
  const bool by_number = command.tool.find_first_not_of("0123456789") == std::string::npos;
  const bool only_one = command.tool.empty() && given.tools.size() == 1;
  if (!by_number || (command.tool.empty() && !only_one)) return;
  apply_tool(only_one ? given.tools.begin()->second : tool_of(data, std::stoi(command.tool)), form);
  given.tool = true;
}

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
  apply_controller(command, form, given);
  if (!given.tool && (given.tool = !command.tool.empty())) {
    take("--tool", [&] {
      const std::vector<double> six = numbers(command.tool, {3, 6});
      std::copy_n(six.begin(), 3, form.tool.xyz_mm.begin());
      if (six.size() == 6) std::copy_n(six.begin() + 3, 3, form.tool.abc_deg.begin());
    });
  }
  form.tool.xyz_sigma_mm.fill(command.tool_sigma_mm.value_or(kUsualTcpSigmaMm));
  given.tool_sigma = command.tool_sigma_mm.has_value();
  if (command.mass_kg.has_value()) form.tool.mass_kg = command.mass_kg;
  given.mass = form.tool.mass_kg.has_value();
  if ((given.tip_radius = command.tip_radius_mm.has_value()))
    form.tool.tip_radius_mm = *command.tip_radius_mm;
  form.floor_mm = command.floor_mm;
  if ((given.spheres = !command.spheres.empty()))
    take("--spheres", [&] { form.spheres = load_spheres(command.spheres); });
  if ((given.certificate = !command.certificate.empty()))
    take("--certificate", [&] { form.lengths = load_certificate(command.certificate); });
  return given;
}

/// Result of planning a session with the default number of touches.
struct PlannedCell {
  std::optional<std::string> why_not;
  std::size_t touches = 0;
  double mean_mm = 0.0, u95_mm = 0.0;
  LimitNeeded limit;
};

/// Appends to `warnings`.
PlannedCell plan_it(const calib::Cell& cell, std::vector<calib::Phrase>& warnings) {
  PlannedCell planned;
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
    if (const auto lowest = calib::below_feet(cell, plan)) warnings.push_back(phrase(*lowest));
  } catch (const calib::PlanError& error) {
    planned.why_not = error.what();
  }
  return planned;
}

/// "1 sphere", "4 spheres".
std::string counted(std::size_t count, const char* one) {
  return fmt::format("{} {}{}", count, one, count == 1 ? "" : "s");
}

std::string words(const NewCellCommand& command, const CellForm& form, const calib::Cell& cell,
                  const std::vector<calib::Phrase>& warnings, const PlannedCell& planned) {
  const std::string file = command.output.string();
  std::string text =
      fmt::format("{}: {}, {}, {}\n", file, cell.robot.name, counted(form.spheres.size(), "sphere"),
                  counted(form.lengths.size(), "certified length"));
  for (const calib::Phrase& one : warnings) text += "warning: " + calib::words(one) + "\n";
  if (form.lengths.empty())
    text += "warning: no certified length: the result will count near the spheres only\n";
  if (planned.why_not) {
    text += "not planned yet: " + *planned.why_not + "\n";
  } else {
    text += fmt::format("plan of {} touches: predicted mean error {:.3f} mm, u95 {:.3f} mm\n",
                        planned.touches, planned.mean_mm, planned.u95_mm);
    text += fmt::format(
        "into cellcald.toml, over RSI:\n  [rsi]\n  correction_limit_deg = {:<12.0f} # for {}, wherever on its way a "
        "session is resumed\n",
        advised_limit_deg(planned.limit), planned.limit.widest_axis);
  }
  return text + fmt::format("next: cellcal doctor --cell {}\n", shell_word(file));
}

std::string as_json(const NewCellCommand& command, const std::vector<calib::Phrase>& warnings,
                    const PlannedCell& planned) {
  json value{{"file", command.output.string()},
             {"warnings", calib::all_words(warnings)},
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

void refuse_to_replace(const NewCellCommand& command) {
  if (std::filesystem::exists(command.output) && !command.force)
    throw std::runtime_error(command.output.string() +
                             " exists. Choose another file with -o, or replace it with --force");
}

constexpr std::size_t kMostSpheres = 100;
bool is_file_of_values(const std::string& answer) {
  return answer.ends_with(".csv") || answer.ends_with(".xml");
}

constexpr const char* kListsThem = "; ? lists those that come with cellcal";

std::vector<calib::NamedRobot> robots_by_name() {
  std::vector<calib::NamedRobot> robots = calib::shipped_robots();
  std::ranges::sort(robots, {}, &calib::NamedRobot::file);
  return robots;
}

/// "; there are kr5_arc, kr5_r1400" for "kr5"; empty without a name of that prefix.
std::string like(const std::string& given) {
  std::string names;
  for (const calib::NamedRobot& one : robots_by_name())
    if (one.file.starts_with(given)) names += (names.empty() ? "; there are " : ", ") + one.file;
  return names;
}

class Dialogue {
 public:
  Dialogue(CellForm& form, const Given& given, const std::filesystem::path& cell_file,
           std::istream& in, std::ostream& out)
      : form_(form), given_(given), cell_file_(cell_file), in_(in), out_(out) {}

  void robot();
  void tool();
  void tool_sigma();
  /// Asks for a number that may be left out.
  void number(const std::string& question, const std::function<void(double)>& keep);
  void spheres();
  void certificate();

 private:
  using Take = std::function<void(const std::string&)>;
  /// `take` rejects an answer by throwing the reason; the form is then unchanged.
  void ask(const std::string& question, const Take& take);
  /// Throws BadAnswer with the current faults of the form.
  void validate() const;
  bool sphere();
  void place(SphereForm& sphere);
  bool length(const std::string& from, const std::string& to);

  CellForm& form_;
  const Given& given_;
  const std::filesystem::path& cell_file_;
  std::istream& in_;
  std::ostream& out_;
};

void Dialogue::ask(const std::string& question, const Take& take) {
  const CellForm before = form_;
  while (true) {
    out_ << question << ": " << std::flush;
    std::string answer;
    if (!std::getline(in_, answer)) {
      out_ << "\n";
      throw EndOfInput(fmt::format("the input ended at \"{}\"; nothing was written", question));
    }
    try {
      return take(std::string(calib::trimmed(answer)));
    } catch (const std::runtime_error& reason) {
      form_ = before;
      out_ << "  " << reason.what() << "\n";
    }
  }
}

void Dialogue::validate() const {
  if (const std::string words = objection(form_); !words.empty()) throw BadAnswer(words);
}

void Dialogue::robot() {
  ask("Robot: name, path of a robot file, or ? for the list", [this](const std::string& answer) {
    if (answer == "?") {
      for (const calib::NamedRobot& one : robots_by_name())
        out_ << fmt::format("  {:<18}{}\n", one.file, one.robot.name);
      throw BadAnswer("give one of the names in the first column");
    }
    if (answer.empty()) throw BadAnswer("a name is needed; ? lists them");
    try {
      form_.robot = find_robot(answer, cell_file_);
    } catch (const calib::UnknownRobot& unknown) {
      throw BadAnswer(unknown.nowhere() + like(answer) + kListsThem);
    } catch (const calib::FileError& error) {
      throw BadAnswer(error.what() + like(answer) + kListsThem);
    }
  });
}

void Dialogue::tool() {
  const bool listed = !given_.tools.empty();
  const std::string which = listed ? "number of TOOL_DATA (" + given_.tool_list + "), or " : "";
  ask("Tool: " + which + "X Y Z A B C from flange to TCP, as in TOOL_DATA (mm, deg)",
      [&](const std::string& answer) {
        const std::vector<double> six = numbers(
            answer, listed ? std::vector<std::size_t>{1, 3, 6} : std::vector<std::size_t>{3, 6});
        if (six.size() == 1) {
          const auto one = std::ranges::find_if(
              given_.tools, [&](const auto& tool) { return tool.first == six[0]; });
          if (one == given_.tools.end()) throw BadAnswer("measured are " + given_.tool_list);
          apply_tool(one->second, form_);
          return validate();
        }
        std::copy_n(six.begin(), 3, form_.tool.xyz_mm.begin());
        form_.tool.abc_deg = {};
        if (six.size() == 6) std::copy_n(six.begin() + 3, 3, form_.tool.abc_deg.begin());
        validate();
      });
}

void Dialogue::tool_sigma() {
  ask(fmt::format("1 sigma of X Y Z, mm (empty: {}, as measured with four points; 0: exact, the "
                  "TCP is not estimated and 'cellcal frames' has no tool)",
                  kUsualTcpSigmaMm),
      [this](const std::string& answer) {
        form_.tool.xyz_sigma_mm.fill(kUsualTcpSigmaMm);
        if (answer.empty()) return;
        const std::vector<double> given = numbers(answer, {1, 3});
        for (std::size_t i = 0; i < 3; ++i)
          form_.tool.xyz_sigma_mm[i] = given[given.size() == 3 ? i : 0];
        validate();
      });
}

void Dialogue::number(const std::string& question, const std::function<void(double)>& keep) {
  ask(question, [&](const std::string& answer) {
    if (answer.empty()) return;
    keep(numbers(answer, {1})[0]);
    validate();
  });
}

void Dialogue::place(SphereForm& sphere) {
  const auto robot = calib::read_robot(calib::TomlTable::parse(form_.robot.text, form_.robot.name));
  std::vector<std::string> joints;
  for (const calib::Joint& joint : robot.joints) joints.push_back(joint.name);
  std::ranges::rotate(joints, joints.begin() + static_cast<std::ptrdiff_t>(robot.first_turning()));
  ask(fmt::format("{}: X Y Z of its centre in the base frame; or {} ... {} with the tip on its top "
                  "(empty: not known)",
                  sphere.id, joints.front(), joints.back()),
      [&](const std::string& answer) {
        sphere.centre_mm.reset();
        if (!answer.empty()) {
          // An arm of three axes: three numbers may be angles or a position.
          std::vector<std::size_t> counts{3};
          if (joints.size() != 3) counts.push_back(joints.size());
          const std::vector<double> given = numbers(answer, counts);
          if (given.size() == 3) {
            sphere.centre_mm = Triple{given[0], given[1], given[2]};
          } else {
            sphere.centre_mm = centre_below(form_, given, sphere.diameter_mm);
            out_ << fmt::format("  centre X {:.1f} Y {:.1f} Z {:.1f} mm\n", (*sphere.centre_mm)[0],
                                (*sphere.centre_mm)[1], (*sphere.centre_mm)[2]);
          }
        }
        form_.spheres.push_back(sphere);
        validate();
      });
}

bool Dialogue::sphere() {
  SphereForm sphere;
  const bool first = form_.spheres.empty();
  sphere.id = fmt::format("S{}", form_.spheres.size() + 1);
  bool more = true;
  ask(fmt::format(
          "{}: diameter and 1 sigma of it, mm ({})", sphere.id,
          first ? "or a CSV file with all spheres" : "= as the one before; empty: no more spheres"),
      [&](const std::string& answer) {
        if (first && is_file_of_values(answer)) {
          form_.spheres = load_spheres(answer);
          validate();
          more = false;
        } else if (!first && answer.empty()) {
          more = false;
        } else if (!first && answer == "=") {
          sphere.diameter_mm = form_.spheres.back().diameter_mm;
          sphere.diameter_sigma_mm = form_.spheres.back().diameter_sigma_mm;
        } else {
          const std::vector<double> two = numbers(answer, {1, 2});
          sphere.diameter_mm = two[0];
          if (two.size() == 2) sphere.diameter_sigma_mm = two[1];
          const CellForm before = form_;
          form_.spheres.push_back(sphere);
          validate();
          form_ = before;
        }
      });
  if (more) place(sphere);
  return more;
}

void Dialogue::spheres() {
  while (form_.spheres.size() < kMostSpheres && sphere()) {
  }
}

bool Dialogue::length(const std::string& from, const std::string& to) {
  bool all = false;
  ask(fmt::format("Certified length {}-{} and 1 sigma of it, mm (empty: none{})", from, to,
                  form_.lengths.empty() ? "; or a CSV file with all" : ""),
      [&](const std::string& answer) {
        if (answer.empty()) return;
        if (is_file_of_values(answer)) {
          form_.lengths = load_certificate(answer);
          all = true;
        } else {
          const std::vector<double> two = numbers(answer, {2});
          form_.lengths.push_back({from, to, two[0], two[1]});
        }
        validate();
      });
  return all;
}

void Dialogue::certificate() {
  for (std::size_t i = 0; i < form_.spheres.size(); ++i)
    for (std::size_t k = i + 1; k < form_.spheres.size(); ++k)
      if (length(form_.spheres[i].id, form_.spheres[k].id)) return;
}

std::vector<std::string> split(std::string_view text, std::string_view between) {
  std::vector<std::string> words;
  for (std::size_t at = text.find_first_not_of(between); at != std::string_view::npos;
       at = text.find_first_not_of(between, at)) {
    const std::size_t end = std::min(text.size(), text.find_first_of(between, at));
    words.emplace_back(text.substr(at, end - at));
    at = end;
  }
  return words;
}

/// Words that blanks separate, with the comma within one as its decimal mark; none where no comma can be one.
std::vector<std::string> with_decimal_commas(std::string_view text) {
  std::vector<std::string> words = split(text, " \t");
  bool any = false;
  for (std::string& word : words) {
    if (word.ends_with(',')) word.pop_back();
    const std::size_t comma = word.find(',');
    if (comma == std::string::npos) continue;
    if (comma == 0 || word.find(',', comma + 1) != std::string::npos) return {};
    word[comma] = '.';
    any = true;
  }
  return any ? words : std::vector<std::string>();
}

double read_number(std::string_view word) {
  const char* const end = word.data() + word.size();
  double value = 0.0;
  const auto [at, code] =
      std::from_chars(word.data() + (word.starts_with('+') ? 1 : 0), end, value);
  if (code != std::errc() || at != end || !std::isfinite(value))
    throw BadAnswer(
        fmt::format("\"{}\" is not a number (use a decimal point)", calib::shown(word)));
  return value;
}

std::string words_of(const std::vector<std::size_t>& counts) {
  std::string words;
  for (std::size_t i = 0; i < counts.size(); ++i)
    words += fmt::format("{}{}", i == 0 ? "" : i + 1 == counts.size() ? " or " : ", ", counts[i]);
  return words + (counts == std::vector<std::size_t>{1} ? " number" : " numbers");
}

}  // namespace

int new_cell(const NewCellCommand& command, std::istream& in, std::ostream& asked) {
  require_output_folder(command.output);  // before the first question, so that no answers are lost
  refuse_to_replace(command);
  CellForm form;
  ask_for_rest(form, apply_request_options(command, form), command.output, in, asked);
  if (const std::string wrong = objection(form); !wrong.empty())
    throw std::runtime_error(wrong + " (nothing was written)");
  const calib::Cell cell = cell_of(form);
  std::vector<calib::Phrase> warnings =
      calib::refuse_faulty(cell);  // before an existing file is replaced
  const std::string text = cell_text(form);
  read_back(text, command.output, [&](const auto& written, const auto& name) {
    calib::parse_cell({name, written, form.robot.name, form.robot.text});
  });
  if (!std::filesystem::exists(form.robot.name) ||
      calib::read_file(form.robot.name, calib::kMostTomlBytes) != form.robot.text)
    write_atomically(form.robot.name, form.robot.text);  // of machine data
  calib::UsedFiles::note(form.robot.name, calib::UsedFiles::As::kWritten);
  put(text, command.output);
  const PlannedCell planned = plan_it(cell, warnings);
  put(command.json ? as_json(command, warnings, planned)
                   : words(command, form, cell, warnings, planned),
      {});
  return planned.why_not ? 1 : 0;
}

void add_new_cell_command(CLI::App& app, int& status) {
  const auto [command, given] = add_command<NewCellCommand>(
      app, status, "new-cell",
      [](const NewCellCommand& wanted) { return new_cell(wanted, std::cin, std::cerr); });
  add_output(*command, given->output)->capture_default_str();
  command->add_option("--robot", given->robot);
  command->add_option("--tool", given->tool);
  command->add_option("--machine-data", given->machine_data);
  command->add_option("--tool-sigma", given->tool_sigma_mm)->check(between(0.0, 1e3));
  command->add_option("--mass", given->mass_kg)->check(between(0.0, 1e4));
  command->add_option("--tip-radius", given->tip_radius_mm)->check(between(0.0, 1e3));
  command->add_option("--floor", given->floor_mm);
  command->add_option("--spheres", given->spheres);
  command->add_option("--certificate", given->certificate);
  command->add_flag("--force", given->force);
  add_json(*command, given->json);
}

void ask_for_rest(CellForm& form, const Given& given, const std::filesystem::path& cell_file,
                  std::istream& in, std::ostream& out) {
  if (given.enough()) return;
  // Lengths of a certificate given as an option refer to spheres that are entered later.
  const std::vector<LengthForm> certified = std::exchange(form.lengths, {});
  Dialogue dialogue(form, given, cell_file, in, out);
  if (!given.robot) dialogue.robot();
  if (!given.tool) dialogue.tool();
  if (!given.tool_sigma) dialogue.tool_sigma();
  if (!given.mass && !form.tool.mass_kg)
    dialogue.number("Mass of all that is on the flange, kg (empty: not known)",
                    [&](double kg) { form.tool.mass_kg = kg; });
  if (!given.tip_radius)
    dialogue.number("Radius of the tip, mm (empty: 0, a point)",
                    [&](double mm) { form.tool.tip_radius_mm = mm; });
  if (!form.floor_mm)
    dialogue.number(
        "Height of floor or table top against gravity, from the robot's foot, mm (of a hung arm "
        "negative): nothing goes below (empty: not known)",
        [&](double mm) { form.floor_mm = mm; });
  if (!given.spheres) dialogue.spheres();
  form.lengths = certified;
  if (!given.certificate) dialogue.certificate();
}

std::vector<double> numbers(std::string_view text, const std::vector<std::size_t>& counts) {
  const auto is_count = [&](std::size_t n) { return std::ranges::find(counts, n) != counts.end(); };
  text = calib::trimmed(text);
  std::vector<std::string> words = split(text, " \t,"), decimal = with_decimal_commas(text);
  if (!decimal.empty() && is_count(decimal.size())) {
    if (is_count(words.size()))
      throw BadAnswer(fmt::format(
          "\"{}\" may be {} or {} numbers: use a decimal point, and blanks between numbers",
          calib::shown(text), decimal.size(), words.size()));
    words = std::move(decimal);
  }
  std::vector<double> values;
  for (const std::string& word : words) values.push_back(read_number(word));
  if (!is_count(values.size()))
    throw BadAnswer(fmt::format("{} {} given, {} expected (use a decimal point)", values.size(),
                                values.size() == 1 ? "number" : "numbers", words_of(counts)));
  return values;
}

}  // namespace cellcal::daemon

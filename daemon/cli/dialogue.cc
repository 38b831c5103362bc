#include "daemon/cli/dialogue.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <functional>
#include <istream>
#include <ostream>
#include <utility>

#include "calib/files/cell_file.h"
#include "calib/files/robot_file.h"
#include "calib/files/text.h"
#include "calib/files/toml.h"
#include "daemon/cell_form/cell_text.h"

namespace cellcal::daemon {

namespace {

constexpr std::size_t kMostSpheres = 100;
constexpr const char* kListsThem = "; ? lists those that come with cellcal";

std::vector<calib::NamedRobot> robots_by_name() {
  std::vector<calib::NamedRobot> robots = calib::shipped_robots();
  std::sort(robots.begin(), robots.end(),
            [](const auto& a, const auto& b) { return a.file < b.file; });
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
  Dialogue(CellForm& form, const std::filesystem::path& cell_file, std::istream& in,
           std::ostream& out)
      : form_(form), cell_file_(cell_file), in_(in), out_(out) {}

  void robot();
  void tool();
  void tool_sigma();
  void mass();
  void tip_radius();
  void spheres();
  void certificate();

 private:
  using Take = std::function<void(const std::string&)>;
  /// `take` rejects an answer by throwing the reason; the form is then unchanged.
  void ask(const std::string& question, const Take& take);
  /// Throws BadAnswer with the current faults of the form.
  void look() const;
  void list_robots();
  bool sphere();
  void place(SphereForm& sphere);
  bool length(const std::string& from, const std::string& to);
  std::vector<std::string> joint_names() const;

  CellForm& form_;
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

void Dialogue::look() const {
  if (const std::string words = objection(form_); !words.empty()) throw BadAnswer(words);
}

void Dialogue::list_robots() {
  for (const calib::NamedRobot& one : robots_by_name())
    out_ << fmt::format("  {:<18}{}\n", one.file, one.robot.name);
}

void Dialogue::robot() {
  ask("Robot: name, path of a robot file, or ? for the list", [this](const std::string& answer) {
    if (answer == "?") {
      list_robots();
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
  ask("Tool: X Y Z A B C from flange to TCP, as in TOOL_DATA (mm, deg)",
      [this](const std::string& answer) {
        const std::vector<double> six = numbers(answer, {3, 6});
        std::copy_n(six.begin(), 3, form_.tool.xyz_mm.begin());
        form_.tool.abc_deg = {};
        if (six.size() == 6) std::copy_n(six.begin() + 3, 3, form_.tool.abc_deg.begin());
        look();
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
        look();
      });
}

void Dialogue::mass() {
  ask("Mass of all that is on the flange, kg (empty: not known)",
      [this](const std::string& answer) {
        if (answer.empty()) return;
        form_.tool.mass_kg = numbers(answer, {1})[0];
        look();
      });
}

void Dialogue::tip_radius() {
  ask("Radius of the tip, mm (empty: 0, a point)", [this](const std::string& answer) {
    if (answer.empty()) return;
    form_.tool.tip_radius_mm = numbers(answer, {1})[0];
    look();
  });
}

std::vector<std::string> Dialogue::joint_names() const {
  std::vector<std::string> names;
  const auto robot = calib::read_robot(calib::TomlTable::parse(form_.robot.text, form_.robot.name));
  for (const calib::Joint& joint : robot.joints) names.push_back(joint.name);
  return names;
}

void Dialogue::place(SphereForm& sphere) {
  const std::vector<std::string> joints = joint_names();
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
        look();
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
        if (first && answer.ends_with(".csv")) {
          form_.spheres = load_spheres(answer);
          look();
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
          look();
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
        if (answer.ends_with(".csv")) {
          form_.lengths = load_certificate(answer);
          all = true;
        } else {
          const std::vector<double> two = numbers(answer, {2});
          form_.lengths.push_back({from, to, two[0], two[1]});
        }
        look();
      });
  return all;
}

void Dialogue::certificate() {
  for (std::size_t i = 0; i < form_.spheres.size(); ++i)
    for (std::size_t k = i + 1; k < form_.spheres.size(); ++k)
      if (length(form_.spheres[i].id, form_.spheres[k].id)) return;
}

}  // namespace

void ask_for_rest(CellForm& form, const Given& given, const std::filesystem::path& cell_file,
                  std::istream& in, std::ostream& out) {
  if (given.enough()) return;
  // Lengths of a certificate given as an option refer to spheres that are entered later.
  const std::vector<LengthForm> certified = std::exchange(form.lengths, {});
  Dialogue dialogue(form, cell_file, in, out);
  if (!given.robot) dialogue.robot();
  if (!given.tool) dialogue.tool();
  if (!given.tool_sigma) dialogue.tool_sigma();
  if (!given.mass) dialogue.mass();
  if (!given.tip_radius) dialogue.tip_radius();
  if (!given.spheres) dialogue.spheres();
  form.lengths = certified;
  if (!given.certificate) dialogue.certificate();
}

namespace {

constexpr std::string_view kBetween = " \t,";

double number(std::string_view word) {
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

std::vector<double> numbers(std::string_view text, const std::vector<std::size_t>& counts) {
  std::vector<double> values;
  text = calib::trimmed(text);
  for (std::size_t at = text.find_first_not_of(kBetween); at != std::string_view::npos;
       at = text.find_first_not_of(kBetween, at)) {
    const std::size_t end = std::min(text.size(), text.find_first_of(kBetween, at));
    values.push_back(number(text.substr(at, end - at)));
    at = end;
  }
  if (std::find(counts.begin(), counts.end(), values.size()) == counts.end())
    throw BadAnswer(fmt::format("{} {} given, {} expected (use a decimal point)", values.size(),
                                values.size() == 1 ? "number" : "numbers", words_of(counts)));
  return values;
}

}  // namespace cellcal::daemon

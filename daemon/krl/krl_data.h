#pragma once
// What KRL files declare: points, the frames that inline forms name (FDAT), and of $config.dat and
// $machine.dat the tools, bases, loads and where the arm stands.

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "calib/model/units.h"
#include "daemon/krl/krl_refusal.h"
#include "daemon/krl/krl_text.h"

namespace cellcal::daemon::krl {

/// A component's number and where it stands, its sign included.
struct Number {
  double value = 0.0;
  std::size_t begin = 0, end = 0;
};

/// {X 1.0,Y 2.0,...}: the components that are plain numbers, and what else there is.
struct Aggregate {
  std::map<std::string, Number> numbers;
  std::map<std::string, std::string> words;  ///< IPO_FRAME #BASE
  std::size_t after = 0;                     ///< index of the token behind it
};
/// Begins at tokens[at], which is '{'. Empty where it is none.
std::optional<Aggregate> read_aggregate(const std::vector<Token>& tokens, std::size_t at);

enum class PointKind { kCartesian, kAxes };

struct Point {
  std::string name;  ///< upper case; empty: it stands in the motion itself
  PointKind kind = PointKind::kCartesian;
  std::string file;
  int line = 0;
  Aggregate value;
};

/// FDAT: of an inline form.
struct FrameData {
  int tool = -1, base = -1;
  bool external = false;  ///< IPO_FRAME #TCP
};

/// LOAD_DATA[n]; mass below 0: not stated.
struct LoadData {
  double mass_kg = -1.0;
  std::array<double, 3> com_mm{};
};

struct Data {
  std::map<std::string, Point> points;
  std::map<std::string, int> declared;  ///< names of points without a value, and their line
  std::set<std::string> globals;        ///< names of points that other modules see
  std::map<std::string, FrameData> frames;
  std::map<int, calib::FrameMmDeg> tools, bases;
  std::map<int, LoadData> loads;
  std::optional<calib::FrameMmDeg> robroot;
  std::vector<Refusal> refusals;
};

std::optional<calib::FrameMmDeg> frame_of(const Aggregate& value);
FrameData frame_data_of(const Aggregate& value);
bool is_point_type(const std::string& word);

/// A line that declares or gives a value; false: it is something else. Used of .src files, too.
/// Throws FileError for a $ROBROOT that cannot be read.
bool read_declaration(const Line& line, const std::string& file, Data& data);
/// All of a .dat file.
void read_data(const KrlFile& file, Data& data);

}  // namespace cellcal::daemon::krl

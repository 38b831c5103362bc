#pragma once
// What KRL files declare: points, the frames that inline forms name (FDAT), and of $config.dat and
// $machine.dat the tools, bases, loads and where the arm stands.

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "calib/export/krl_values.h"
#include "calib/model/units.h"
#include "daemon/krl/krl_refusal.h"

namespace cellcal::daemon::krl {

using namespace calib::krl;

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

struct Data {
  std::map<std::string, Point> points;
  std::map<std::string, int> declared;  ///< names of points without a value, and their line
  std::map<std::string, PointKind> arrays;
  std::map<std::string, Point> structures;  ///< of other types, with all that is in them
  std::set<std::string> globals;  ///< names of points, structures and FDATs that other modules see
  std::map<std::string, calib::FrameMmDeg> named_frames;  ///< of type FRAME
  std::map<std::string, FrameData> frames;
  std::map<int, calib::FrameMmDeg> tools, bases;
  std::map<int, LoadData> loads;
  std::optional<calib::FrameMmDeg> robroot;
  std::vector<Refusal> refusals;
};

/// By its name, its element's (XP[2]) or its place in a structure (XS.P, XS[2].P).
std::optional<Point> find_point(const Data& data, const std::string& name);
/// Of XP[2] and XS.P the variable.
std::string variable_of(const std::string& name);

FrameData frame_data_of(const Aggregate& value);
bool is_point_type(const std::string& word);

/// A line that declares or gives a value; false: it is something else. Used of .src files, too.
/// Throws FileError for a $ROBROOT that cannot be read.
bool read_declaration(const Line& line, const std::string& file, Data& data);
/// All of a .dat file.
void read_data(const KrlFile& file, Data& data);

}  // namespace cellcal::daemon::krl

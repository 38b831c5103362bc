#pragma once
// Declarations of KRL files: points, frames of inline forms (FDAT); tools, bases, loads and the
// robot's position of $config.dat and $machine.dat.

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "calib/export/krl_values.h"
#include "calib/export/machine_external.h"
#include "calib/model/units.h"
#include "daemon/krl/krl_refusal.h"

namespace cellcal::daemon::krl {

using namespace calib::krl;

enum class PointKind { kCartesian, kAxes };

struct Point {
  std::string name;  ///< upper case; empty: written in the motion itself
  PointKind kind = PointKind::kCartesian;
  std::string file;
  int line = 0;
  Aggregate value;
};

/// FDAT of an inline form.
struct FrameData {
  int tool = -1, base = -1;
  bool external = false;  ///< IPO_FRAME #TCP
  bool operator==(const FrameData&) const = default;
};

/// INT with its value.
struct NamedNumber {
  int value = 0;
  bool constant = false;  ///< CONST: no statement can change it
};

struct Data : ControllerFrames {
  std::map<std::string, Point> points;
  std::map<std::string, int> declared;  ///< names of points without a value, and their line
  std::map<std::string, PointKind> arrays;
  std::set<std::string> scalars;            ///< points without a value that are no arrays
  std::map<std::string, Point> structures;  ///< of other types, with all components
  std::set<std::string> globals;  ///< points, structures and FDATs visible to other modules
  std::map<std::string, calib::FrameMmDeg> named_frames;  ///< type FRAME
  std::map<std::string, LoadData> named_loads;            ///< type LOAD
  /// Variables of other types; empty: no INT, without a value, or declared twice.
  std::map<std::string, std::optional<NamedNumber>> named_numbers;
  std::map<std::string, FrameData> frames;
  calib::ExternalAxes external;
  std::vector<Refusal> refusals;
};

/// By name, element (XP[2]) or place in a structure (XS.P, XS[2].P).
std::optional<Point> find_point(const Data& data, const std::string& name);
/// Variable of XP[2] or XS.P.
std::string variable_of(const std::string& name);

/// Axes where one of A1 to A6 is stated.
PointKind kind_of(const Aggregate& value);
FrameData frame_data_of(const Aggregate& value);
bool is_point_type(const std::string& word);

/// A line with a declaration or value; false: another statement. Also for .src files. Throws
/// FileError for an unreadable $ROBROOT, and for a frame or load that an earlier line states otherwise.
bool read_declaration(const Line& line, const std::string& file, Data& data);
/// Reads a whole .dat file.
void read_data(const KrlFile& file, Data& data);

/// IMPORT E6POS XP1 IS /R1/POINTS..XP1: XP1 of POINTS, but no FDAT.
struct Import {
  std::string name, module, original;  ///< upper case
  std::string file;
  int line = 0;
};
std::vector<Import> imports_of(const KrlFile& file);
/// POINTS of "R1/Program/points.dat".
std::string module_name(const std::string& file);

}  // namespace cellcal::daemon::krl

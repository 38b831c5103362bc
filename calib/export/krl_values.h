#pragma once
// Values of KRL files: NAME[n]={X 1.0,...}, case-insensitive.

#include <array>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "calib/export/krl_text.h"
#include "calib/model/units.h"

namespace cellcal::calib::krl {

/// A component's number and its position, including the sign.
struct Number {
  double value = 0.0;
  std::size_t begin = 0, end = 0;
  bool operator==(const Number&) const = default;
};

/// {X 1.0,Y 2.0,...}: the components that are plain numbers, and all others.
struct Aggregate {
  std::map<std::string, Number> numbers;
  std::map<std::string, std::string> words;  ///< IPO_FRAME #BASE
  std::size_t after = 0;                     ///< index of the next token
  bool operator==(const Aggregate&) const = default;
};
/// Begins at tokens[at], which is '{'. Empty where it is none.
std::optional<Aggregate> read_aggregate(const std::vector<Token>& tokens, std::size_t at);

/// X, Y, Z, A, B, C, all of them.
std::optional<FrameMmDeg> frame_of(const Aggregate& value);

bool is_sign_of(const Token& token, char what);
/// False beyond the last token.
bool sign_at(const std::vector<Token>& tokens, std::size_t at, char what);
bool word_at(const std::vector<Token>& tokens, std::size_t at);
/// Number of a tool, base, element: whole, 0 to 1000.
std::optional<int> slot_number(double value);
std::optional<int> slot_number(const Token& token);
/// [n] with a plain number, from tokens[at]; the index of the next token, or 0.
std::size_t read_index(const std::vector<Token>& tokens, std::size_t at, int& index);
/// [n], [n,m] or [n,m,k] likewise, as text without blanks.
std::size_t read_indices(const std::vector<Token>& tokens, std::size_t at, std::string& indices);
/// With its sign, the last of the line; empty where it is none.
std::optional<double> read_number(const std::vector<Token>& tokens, std::size_t at);

/// [DECL] [GLOBAL] [CONST] [type] NAME[n]=value; NAME[n,] of a text in an array of them.
struct Given {
  std::string name;
  int index = -1;         ///< -1: none, [], or several
  std::string indices;    ///< [n,m] of several
  std::size_t value = 0;  ///< index of its first token

  std::string element() const;  ///< "NAME[n]", "NAME[n,m]"
};
/// `several`: NAME[n,m]=value, too.
std::optional<Given> read_given(const Line& line, bool several = false);

/// LOAD_DATA[n]; mass below 0: not stated. The centre is in the flange's frame.
struct LoadData {
  double mass_kg = -1.0;
  std::array<double, 3> com_mm{};
  bool operator==(const LoadData&) const = default;
};
/// {M 1.5,CM {X ...},...} with M and the place of CM.
std::optional<LoadData> load_stated(const Aggregate& value);

/// Tools, bases and loads of $config.dat by their number, and $ROBROOT, each as stated first.
struct ControllerFrames {
  std::map<int, FrameMmDeg> tools, bases;  ///< all zero: not measured
  std::map<int, LoadData> loads;
  std::map<int, std::string> tool_names, base_names;  ///< other than blank
  std::set<int> fixed_tools;                          ///< TOOL_TYPE[n]=#TCP: stands in the cell
  std::optional<FrameMmDeg> robroot;
};

/// kOther: a frame or load that an earlier line states otherwise.
enum class Stated { kNothing, kValue, kUnreadable, kOther };
/// For messages: TOOL_DATA[1] is not ... .
inline constexpr const char* kStatedBefore = "as stated before. Give the files of one robot";
/// Takes a value of the above. An unreadable one invalidates the earlier one, too.
Stated read_controller_frames(const Line& line, ControllerFrames& frames);

}  // namespace cellcal::calib::krl

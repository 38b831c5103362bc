#include "daemon/krl/krl_changes.h"

#include <algorithm>
#include <cmath>

#include "daemon/krl/krl_calls.h"
#include "daemon/krl/krl_types.h"

namespace cellcal::daemon::krl {

namespace {

void change(const std::vector<Token>& t, std::size_t at, const ChangePlace& place,
            ChangedNumbers& changed) {
  // In a declaration this is the array's length.
  const bool declares = t[0].is("DECL") || t[0].is("GLOBAL") || t[0].is("FRAME") || t[0].is("LOAD");
  int number = 0;
  if (!declares && read_index(t, at + 1, number) > 0)
    changed.numbers.emplace(number, place);
  else
    changed.computed.emplace(place.file, place.line);
}

/// KUKA's own that only read a frame, load or number. Not SREAD, CREAD, EKI_GETFRAME, STRTOFRAME and the like.
const Readers kReaders = {"ABS",       "SQRT",    "SIN",     "COS",     "TAN",   "ACOS",  "ATAN2",
                          "ROUND",     "INVERSE", "FORWARD", "INV_POS", "EK",    "LK",    "EB",
                          "EB_ABS",    "CAST_TO", "CWRITE",  "SWRITE",  "STOOL", "SBASE", "SLOAD",
                          "SIPO_MODE", "K_ROOT",  "K_TYPE",  "K_OFFS"};

/// Index of the bracket that encloses tokens[at]; 0: none.
std::size_t opening(const std::vector<Token>& t, std::size_t at) {
  for (int depth = 0; at > 0;) {
    --at;
    if (sign_at(t, at, ')') || sign_at(t, at, ']') || sign_at(t, at, '}')) ++depth;
    if ((sign_at(t, at, '(') || sign_at(t, at, '[') || sign_at(t, at, '{')) && --depth < 0)
      return at;
  }
  return 0;
}

/// NAME(..,TOOL_DATA[1],..) of a routine that may change it.
bool hands_over(const std::vector<Token>& t, std::size_t at, const Readers& readers) {
  while (sign_at(t, at - 1, '(') || sign_at(t, at - 1, ',')) {
    const std::size_t bracket = opening(t, at);
    if (bracket == 0 || !sign_at(t, bracket, '(')) return false;
    if (calls_at(t, bracket - 1)) {
      const std::string& name = t[bracket - 1].word;
      return readers.count(name) + kReaders.count(name) == 0 && !name.starts_with("EKI_SET");
    }
    at = bracket;  // brackets of an expression
  }
  return false;
}

/// TOOL_DATA[1].X=..., also after DO.
bool assigned(const std::vector<Token>& t, std::size_t at) {
  for (++at; sign_at(t, at, '[') || sign_at(t, at, '.');) {
    const std::size_t next = sign_at(t, at, '.') ? at + 2 : closed(t, at);
    if (next == 0) return true;
    at = next;
  }
  return sign_at(t, at, '=') && !sign_at(t, at + 1, '=');
}

bool same(const std::map<int, calib::FrameMmDeg>& ones,
          const std::map<int, calib::FrameMmDeg>& stated) {
  return std::ranges::all_of(ones, [&](const auto& one) {
    const auto at = stated.find(one.first);
    return at != stated.end() && same_frame(one.second, at->second);
  });
}

/// TOOL_DATA[1]={X ...} with the value that it has in any case, as of a program of 'cellcal frames' that has run.
bool restates(const Line& line, const ControllerFrames& stated) {
  ControllerFrames one;
  return read_controller_frames(line, one) == Stated::kValue &&
         one.tools.size() + one.bases.size() > 0 && same(one.tools, stated.tools) &&
         same(one.bases, stated.bases);
}

void merge_numbers(const ChangedNumbers& from, ChangedNumbers& into) {
  into.numbers.insert(from.numbers.begin(), from.numbers.end());
  into.computed.insert(from.computed.begin(), from.computed.end());
}

std::optional<calib::FrameMmDeg> value_in(const std::map<int, calib::FrameMmDeg>& frames,
                                          int number) {
  const auto at = frames.find(number);
  return at == frames.end() ? std::nullopt : std::optional(at->second);
}

}  // namespace

bool same_frame(const calib::FrameMmDeg& a, const calib::FrameMmDeg& b) {
  constexpr double kRounding = 5e-4;  // mm, deg: the controller's REAL has 24 bits
  const auto near = [](double x, double y) { return std::abs(x - y) < kRounding; };
  return std::ranges::equal(a.xyz_mm, b.xyz_mm, near) &&
         std::ranges::equal(a.abc_deg, b.abc_deg, near);
}

std::optional<ChangePlace> ChangedNumbers::of(int number) const {
  if (number <= 0) return std::nullopt;
  if (const auto at = numbers.find(number); at != numbers.end()) return at->second;
  if (computed.empty()) return std::nullopt;
  return ChangePlace{computed.begin()->first, computed.begin()->second};
}

std::optional<ChangePlace> ChangedNumbers::any() const {
  return numbers.empty() ? of(1) : std::optional(numbers.begin()->second);
}

bool changes_at(const Line& line, std::size_t at, const Readers& readers) {
  const auto& t = line.tokens;
  return at == 0 || assigned(t, at) || declares(line) || is_point_type(t[0].word) ||
         t[0].is("GLOBAL") || t[0].is("LOAD") || hands_over(t, at, readers);
}

bool sets_kinematic_base(const std::vector<Token>& t) {
  return t.size() > 3 && t[0].is("$BASE") && sign_at(t, 1, '=') && t[2].is("EK");
}

void add_changes(const Line& line, const std::string& file, const Readers& readers,
                 const ControllerFrames& stated, FrameChanges& changes) {
  if (restates(line, stated)) return;
  const auto& t = line.tokens;
  const ChangePlace place{file, line.number};
  if (t[0].is("MACHINE_DEF")) change(t, 0, place, changes.machines);
  if (t[0].is("MACHINE_FRAME_DAT")) change(t, 0, place, changes.bases);
  bool robroot = false;
  for (std::size_t i = 0; i < t.size(); ++i) {
    if (t[i].kind != Token::Kind::kWord || !changes_at(line, i, readers)) continue;
    if (t[i].word == "TOOL_DATA") change(t, i, place, changes.tools);
    if (t[i].word == "BASE_DATA") change(t, i, place, changes.bases);
    if (t[i].word == "LOAD_DATA") change(t, i, place, changes.loads);
    // The controller protects $WORLD and $NULLFRAME: handed over they are read.
    robroot = robroot || t[i].word == "$ROBROOT" ||
              (i == 0 && (t[i].word == "$WORLD" || t[i].word == "$NULLFRAME"));
  }
  if (robroot && !changes.robroot) changes.robroot = place;
}

void merge(const FrameChanges& from, FrameChanges& into) {
  merge_numbers(from.tools, into.tools);
  merge_numbers(from.bases, into.bases);
  merge_numbers(from.loads, into.loads);
  merge_numbers(from.machines, into.machines);
  if (!into.robroot) into.robroot = from.robroot;
}

FrameChanges of_stated_numbers(FrameChanges changes) {
  for (ChangedNumbers* one : {&changes.tools, &changes.loads, &changes.bases, &changes.machines})
    one->computed.clear();
  return changes;
}

void add_changed_frames(const std::vector<Line>& lines, const Readers& readers,
                        ChangedFrames& changed) {
  for (const Line& line : lines) {
    FrameChanges changes;
    add_changes(line, {}, readers, {}, changes);
    if (changes.tools.numbers.empty() && changes.bases.numbers.empty()) continue;
    ControllerFrames written;
    if (read_controller_frames(line, written) != Stated::kValue) written = {};
    for (const auto& [number, place] : changes.tools.numbers)
      changed.tools[number].push_back(value_in(written.tools, number));
    for (const auto& [number, place] : changes.bases.numbers)
      changed.bases[number].push_back(value_in(written.bases, number));
  }
}

FrameChanges frame_changes(const std::vector<Line>& lines, const std::string& file,
                           const Readers& readers, const ControllerFrames& stated) {
  FrameChanges changes;
  for (const Line& line : lines) add_changes(line, file, readers, stated, changes);
  return changes;
}

}  // namespace cellcal::daemon::krl

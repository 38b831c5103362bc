#include "daemon/krl/krl_program.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <set>

#include "calib/files/text.h"
#include "calib/model/error.h"
#include "daemon/krl/krl_calls.h"
#include "daemon/krl/krl_state.h"

namespace cellcal::daemon::krl {

namespace {

using Kind = Token::Kind;

const std::set<std::string> kAxisMotions = {"PTP", "SPTP"};
const std::set<std::string> kArcs = {"CIRC", "SCIRC"};
/// Where the arm stands: motions to these go nowhere.
const std::set<std::string> kHere = {"$AXIS_ACT",    "$AXIS_ACT_MEAS", "$POS_ACT",
                                     "$POS_ACT_MES", "$AXIS_INT",      "$POS_INT"};

bool is_sign(const std::vector<Token>& t, std::size_t at, char what) {
  return at < t.size() && t[at].kind == Kind::kSign && t[at].word[0] == what;
}

class Reader {
 public:
  Reader(const KrlFile& src, const std::vector<std::string>& leave, const Data& controller,
         const Calls& calls, Program& program)
      : src_(src),
        leave_(leave.begin(), leave.end()),
        controller_(controller),
        calls_(calls),
        program_(program) {}

  void read(const std::vector<Line>& lines) {
    for (const Line& line : lines)
      if (declares_data(line)) read_declaration(line, src_.name, program_.data);
    FrameState state(lines, program_.data, calls_);
    for (const Line& line : lines) read(line, state);
    for (const auto& [name, at] : state.frame_data_used())
      if (const auto found = mentioned_.find(name); found != mentioned_.end())
        refuse(Why::kNoSuchFrameData, found->second, name);
    for (const auto& [name, point] : program_.points)
      if (const auto found = mentioned_.find(name); found != mentioned_.end())
        refuse(Why::kComputed, found->second, name);
    keep_left_points();
    for (const std::string& name : leave_) there_is(name);
  }

 private:
  /// Their postures are those that LIN begins in. What the program changes is not known.
  void keep_left_points() {
    for (const Motion& motion : program_.motions) {
      if (!motion.left || mentioned_.count(motion.point) > 0) continue;
      for (const Data* data : std::array<const Data*, 2>{&program_.data, &controller_})
        if (const auto at = data->points.find(motion.point); at != data->points.end()) {
          if (!given_twice(*data, motion.point)) program_.left_points.emplace(*at);
          break;
        }
    }
  }

  static bool given_twice(const Data& data, const std::string& name) {
    return std::ranges::any_of(data.refusals, [&](const Refusal& r) { return r.what == name; });
  }

  bool is_point(const std::string& name) const {
    return targets_.count(name) > 0 || program_.data.points.count(name) > 0 ||
           program_.data.declared.count(name) > 0 || controller_.points.count(name) > 0;
  }
  void there_is(const std::string& name) const {
    if (is_point(name)) return;
    throw calib::FileError(src_.name,
                           ": no point is named " + calib::shown(name) +
                               (is_point("X" + name) ? "; the inline form's " + calib::shown(name) +
                                                           " is X" + calib::shown(name)
                                                     : "") +
                               ". Name points as the .dat has them (--leave)");
  }

  void refuse(Why why, int line, const std::string& what) {
    program_.refusals.push_back({why, src_.name, line, what});
  }

  /// With or without DECL; what begins with DEF is none.
  static bool declares_data(const Line& line) {
    const Token& first = line.tokens[0];
    return first.is("DECL") || is_point_type(first.word) ||
           (first.is("GLOBAL") && line.tokens.size() > 1 && !line.tokens[1].is("DEF") &&
            !line.tokens[1].is("DEFFCT"));
  }

  void read(const Line& line, FrameState& state) {
    const auto& t = line.tokens;
    depth_ = std::max(0, depth_ + FrameState::blocks(line));
    if (state.breaks_order(line)) lose(line);
    const bool frames = state.read(line);
    if (declares_data(line) || t[0].is("EXT")) return;
    const MotionKind kind = motion_kind(line);
    if (kind != MotionKind::kNone) ++program_.motion_lines;
    if (kind == MotionKind::kRelative) {
      lose(line);
      return refuse(Why::kRelative, line.number, t[0].word);
    }
    if (kind == MotionKind::kExternal) return refuse(Why::kExternalAxes, line.number, t[0].word);
    if (kind == MotionKind::kPoint && t.size() > 1) return motion(line, state);
    if (frames) {
      const bool names_data = t[0].is("FDAT_ACT") && t.size() == 3;
      return names_data ? void() : mention(line, 1);
    }
    if (assigns(line)) return;
    mention(line, 0);
  }

  /// Where the arm is behind this line is not known.
  void lose(const Line& line) {
    last_ = -1;
    const Effects effects = calls_.of(line);
    lost_ = {effects.call.empty() ? line.tokens[0].word : effects.call, line.number};
  }

  /// XP1={X ...}: the point's value where it has none yet, and nobody can go there before.
  bool assigns(const Line& line) {
    const auto& t = line.tokens;
    if (t.size() < 3 || t[0].kind != Kind::kWord || !is_sign(t, 1, '=') || !is_sign(t, 2, '{') ||
        (program_.data.declared.count(t[0].word) == 0 &&
         program_.data.points.count(t[0].word) == 0) ||
        depth_ > 0 || targets_.count(t[0].word) > 0)
      return false;
    auto value = read_aggregate(t, 2);
    if (!value || value->after != t.size()) return false;
    const PointKind kind =
        value->numbers.count("A1") > 0 ? PointKind::kAxes : PointKind::kCartesian;
    const auto [at, fresh] = program_.data.points.emplace(
        t[0].word, Point{t[0].word, kind, src_.name, line.number, std::move(*value)});
    if (!fresh) refuse(Why::kTwice, line.number, t[0].word);
    return true;
  }

  void motion(const Line& line, const FrameState& state) {
    const auto& t = line.tokens;
    std::size_t at = 1;
    const bool arc = kArcs.count(t[0].word) > 0;
    if (!target(line, state, at)) return;
    if (arc && is_sign(t, at, ',')) {
      ++at;
      if (!target(line, state, at)) return;
    }
    mention(line, at);
  }

  /// The point at tokens[at]; moves `at` behind it. False: nothing more of this line is understood.
  bool target(const Line& line, const FrameState& state, std::size_t& at) {
    const auto& t = line.tokens;
    Motion motion;
    motion.line = line.number;
    motion.cp = kAxisMotions.count(t[0].word) == 0;
    motion.previous = last_;
    if (last_ < 0) motion.lost = lost_;
    last_ = -1;
    lost_ = {};
    motion.frames = state.at_motion(line, motion.wrong_frame_data);
    if (motion.wrong_frame_data) motion.wrong_frame_data->file = src_.name;
    if (is_sign(t, at, '{')) {
      auto value = read_aggregate(t, at);
      motion.point = "line " + std::to_string(line.number);
      if (!value) return refuse(Why::kPartial, line.number, motion.point), false;
      if (is_sign(t, value->after, ':'))
        return refuse(Why::kOperator, line.number, motion.point), false;
      at = value->after;
      const PointKind kind =
          value->numbers.count("A1") > 0 ? PointKind::kAxes : PointKind::kCartesian;
      if (program_.points.count(motion.point) > 0) motion.point += " (second point)";
      program_.points[motion.point] = {{}, kind, src_.name, line.number, std::move(*value)};
    } else {
      if (at >= t.size() || t[at].kind != Kind::kWord)
        return refuse(Why::kComputed, line.number, "line " + std::to_string(line.number)), false;
      const std::string name = t[at].word;
      if (kHere.count(name) > 0) return ++at, !is_sign(t, at, ':');
      if (is_sign(t, at + 1, ':')) return refuse(Why::kOperator, line.number, name), false;
      if (is_sign(t, at + 1, '[')) return refuse(Why::kArray, line.number, name), false;
      if (is_sign(t, at + 1, '(') || is_sign(t, at + 1, '.'))
        return refuse(Why::kComputed, line.number, name), false;
      ++at;
      motion.point = name;
      targets_.insert(name);
      if (!known(name, line.number)) {
        motion.left = program_.left.count(name) > 0;
        if (!motion.left) return true;
      }
    }
    last_ = static_cast<int>(program_.motions.size());
    program_.motions.push_back(std::move(motion));
    return true;
  }

  /// Whether the point is one to correct. A value given further down is not known yet, so the last
  /// word on that is spoken at the end.
  bool known(const std::string& name, int line) {
    if (leave_.count(name) > 0) {
      program_.left[name] = "--leave";
      return false;
    }
    if (program_.points.count(name) > 0) return true;
    const auto own = program_.data.points.find(name);
    if (own != program_.data.points.end()) {
      if (program_.data.globals.count(name) > 0)
        program_.refusals.push_back({Why::kGlobal, own->second.file, own->second.line, name});
      program_.points.emplace(name, own->second);
      return true;
    }
    const auto other = controller_.points.find(name);
    if (other != controller_.points.end()) {
      program_.left[name] = other->second.file;
      return false;
    }
    refuse(Why::kUnknownPoint, line, name);
    return false;
  }

  void mention(const Line& line, std::size_t from) {
    const auto& t = line.tokens;
    for (std::size_t i = from; i < t.size(); ++i) {
      if (t[i].kind != Kind::kWord) continue;
      // STOOL2(FP1) and its like read a FDAT and change nothing.
      const bool read_only = i >= 2 && is_sign(t, i - 1, '(') &&
                             (t[i - 2].is("STOOL2") || t[i - 2].is("SBASE") ||
                              t[i - 2].is("SIPO_MODE") || t[i - 2].is("SLOAD"));
      if (!read_only) mentioned_.emplace(t[i].word, line.number);
    }
  }

  const KrlFile& src_;
  std::set<std::string> leave_;
  const Data& controller_;
  const Calls& calls_;
  Program& program_;
  Lost lost_;
  std::map<std::string, int> mentioned_;
  std::set<std::string> targets_;  ///< names that motions go to, so far
  int depth_ = 0;                  ///< blocks of IF, LOOP and the like around the line
  int last_ = -1;
};

/// What the program's own files do not say.
void add(const Data& controller, Data& own) {
  own.frames.insert(controller.frames.begin(), controller.frames.end());
  own.tools = controller.tools;
  own.bases = controller.bases;
  own.loads = controller.loads;
  own.robroot = controller.robroot;
}

}  // namespace

bool FrameRef::operator==(const FrameRef& other) const {
  return number == other.number && literal.has_value() == other.literal.has_value() &&
         (!literal ||
          (literal->xyz_mm == other.literal->xyz_mm && literal->abc_deg == other.literal->abc_deg));
}

Program read_program(const ProgramFiles& files, const std::vector<std::string>& leave,
                     const std::vector<std::string>& still) {
  Program program;
  Data known;
  for (const KrlFile& file : files.controller) read_data(file, known);
  if (files.dat) read_data(*files.dat, program.data);
  add(known, program.data);
  const auto lines = read_lines(files.src);
  auto all = lines;
  if (files.dat) std::ranges::copy(read_lines(*files.dat), std::back_inserter(all));
  program.changes = frame_changes(all);
  const Calls calls(files.src, files.modules, {still.begin(), still.end()});
  merge(calls.changes(), program.changes);
  Reader(files.src, leave, known, calls, program).read(lines);
  for (const auto& [name, point] : program.data.points)
    if (program.points.count(name) == 0 && program.left.count(name) == 0)
      program.left[name] = "no motion goes to it";
  for (const Refusal& one : program.data.refusals) program.refusals.push_back(one);
  return program;
}

}  // namespace cellcal::daemon::krl

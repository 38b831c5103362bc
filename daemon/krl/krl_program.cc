#include "daemon/krl/krl_program.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <set>
#include <string_view>

#include "calib/files/text.h"
#include "calib/model/error.h"
#include "daemon/krl/krl_calls.h"
#include "daemon/krl/krl_modules.h"
#include "daemon/krl/krl_state.h"
#include "daemon/krl/krl_types.h"
#include "daemon/krl/own_position.h"
#include "daemon/krl/point_value.h"

namespace cellcal::daemon::krl {

namespace {

using Kind = Token::Kind;

const std::set<std::string> kAxisMotions = {"PTP", "SPTP"};
const std::set<std::string> kArcs = {"CIRC", "SCIRC"};
/// Current positions: motions to these do not move.
const std::set<std::string> kHere = {"$AXIS_ACT",    "$AXIS_ACT_MEAS", "$POS_ACT",
                                     "$POS_ACT_MES", "$AXIS_INT",      "$POS_INT"};
constexpr const char* kHome = "$H_POS";
/// Components of a FDAT.
const std::set<std::string> kFrameData = {"TOOL_NO", "BASE_NO", "IPO_FRAME"};

class Reader {
 public:
  /// `together`: all modules are read, so that points shared between modules are corrected, too. `imported`: names of
  /// other modules' points that are not followed.
  Reader(const KrlFile& src, const std::vector<std::string>& leave, const Data& controller,
         Calls calls, const OwnPosition& positions, bool together,
         std::map<std::string, Why> imported, Data& data, Program& program)
      : src_(src),
        leave_(leave.begin(), leave.end()),
        controller_(controller),
        calls_(calls),
        positions_(positions),
        together_(together),
        imported_(std::move(imported)),
        module_(program.modules.size() - 1),
        where_(together ? "@" + std::to_string(module_) : ""),
        data_(data),
        program_(program),
        flow_(program.flow, module_, module_name(src.name)) {}

  /// Only motions of the controller's own programs are counted.
  void read(const std::vector<Line>& lines) {
    if ((own().kukas = is_kukas_program(src_.name))) {
      own().motion_lines = static_cast<int>(std::ranges::count_if(
          lines, [](const Line& line) { return motion_kind(line) != MotionKind::kNone; }));
      return;
    }
    for (const Line& line : lines)
      if (declares_data(line)) read_declaration(line, src_.name, data_);
    const FrameState state(lines, module_name(src_.name), data_, controller_, calls_);
    for (const Line& line : lines) read(line, state);
    if (shared_)  // another module may call it without the first one
      std::erase_if(program_.assigned, [&](const auto& one) { return one.module == module_; });
    flow_.finish();
    for (const auto& [name, at] : state.frame_data_used())
      if (const auto found = mentioned_.find(name); found != mentioned_.end())
        refuse(Why::kNoSuchFrameData, found->second, name);
    for (auto& [name, refusal] : handed_)
      if (targets_.count(name) == 0) own().refusals.push_back(std::move(refusal));
    for (const auto& [name, line] : mentioned_)
      program_.computed.emplace(
          key_of(name), Refusal{of_place(Why::kComputed, line, name), src_.name, line, name});
  }

  bool is_point(const std::string& name) const {
    return targets_.count(name) > 0 || find_point(data_, name) || data_.declared.count(name) > 0 ||
           find_point(controller_, name);
  }

  calib::FileError no_point(const std::string& name) const {
    return {src_.name, ": no point is named " + calib::shown(name) +
                           (is_point("X" + name) ? "; the inline form's " + calib::shown(name) +
                                                       " is X" + calib::shown(name)
                                                 : "") +
                           ". Name points as the .dat has them (--leave)"};
  }

 private:
  Module& own() { return program_.modules[module_]; }
  void refuse(Why why, int line, const std::string& what) {
    own().refusals.push_back({of_place(why, line, what), src_.name, line, what});
  }

  /// The reason for a point that may come from where the arm is.
  Why of_place(Why why, int line, const std::string& what) const {
    const bool computed =
        why == Why::kComputed || why == Why::kGeometricOperator || why == Why::kArray;
    const std::string name = variable_of(what);
    return computed && (name == "FORWARD" || positions_.reaches(module_, line, name))
               ? Why::kOwnPosition
               : why;
  }

  static bool given_twice(const Data& data, const std::string& name) {
    return std::ranges::any_of(data.refusals, [&](const Refusal& r) { return r.what == name; });
  }

  /// Key of a name in this module.
  std::string key_of(const std::string& name) const {
    const std::string variable = variable_of(name);
    const bool others =
        together_ &&
        (data_.globals.count(variable) > 0 ||
         !(find_point(data_, name) || data_.points.count(variable) > 0 ||
           data_.declared.count(variable) > 0 || data_.structures.count(variable) > 0));
    return others ? name : name + where_;
  }

  /// With or without DECL; statements that begin with DEF are excluded.
  static bool declares_data(const Line& line) {
    const Token& first = line.tokens[0];
    return first.is("DECL") || is_point_type(first.word) ||
           (first.is("GLOBAL") && line.tokens.size() > 1 && !line.tokens[1].is("DEF") &&
            !line.tokens[1].is("DEFFCT"));
  }

  void read(const Line& line, const FrameState& state) {
    const auto& t = line.tokens;
    depth_ = std::max(0, depth_ + FrameState::blocks(line));
    const Frames* const now = state.before(line);
    follow(line);
    if (now == nullptr) flow_.never();
    flow_.control(line);
    note_assigned(line, now);
    if (declares_data(line) || t[0].is("EXT") || t[0].is("IMPORT")) return;
    const MotionKind kind = motion_kind(line);
    if (kind != MotionKind::kNone) ++own().motion_lines;
    if (kind != MotionKind::kNone && now == nullptr) return never(line);
    if (const auto value = kind != MotionKind::kNone ? read_aggregate(t, 1) : std::nullopt)
      if (leaves_the_arm(*value, data_.external)) return mention(line, value->after);
    if (kind == MotionKind::kRelative) {
      lose(line);
      if (together_) mention(line, 1);
      return refuse(Why::kRelativeMotion, line.number, t[0].word);
    }
    if (kind == MotionKind::kExternal) return refuse(Why::kExternalAxes, line.number, t[0].word);
    if (kind == MotionKind::kPoint && t.size() > 1) return motion(line, state);
    if (begins_routine(line) || only_sets_frames(line))
      return t[0].is("FDAT_ACT") && t.size() == 3 ? void() : mention(line, 1);
    if (assigns(line) || copies(line)) return;
    mention(line, 0);
  }

  /// `now`: the frames before it; null: no path leads there.
  void note_assigned(const Line& line, const Frames* now) {
    const auto& t = line.tokens;
    if (begins_routine(line) && ++routines_ > 1) shared_ = shared_ || t[0].is("GLOBAL");
    const bool tool = t[0].is("TOOL_DATA");
    AssignedFrame one{module_, tool, 0, {}};
    const std::size_t at = tool || t[0].is("BASE_DATA") ? read_index(t, 1, one.number) : 0;
    if (at > 0 && now && routines_ == 1 && !started_ && depth_ == 0 && sign_at(t, at, '=')) {
      const auto value = read_aggregate(t, at + 1);
      const auto frame = value && value->after == t.size() ? frame_of(*value) : std::nullopt;
      const auto& in_force = tool ? now->tool : now->base;
      if (frame && !(in_force && in_force->number == one.number)) {
        one.value = *frame;
        program_.assigned.push_back(one);
      }
    }
    const bool to_here = t.size() > 1 && kHere.count(t[1].word) > 0 && !sign_at(t, 2, ':');
    started_ = started_ || (motion_kind(line) != MotionKind::kNone && !to_here) ||
               calls_.of(line).moves || t[0].is("GOTO");
  }

  /// The arm's position after this line is unknown.
  void lose(const Line& line) {
    const Effects effects = calls_.of(line);
    flow_.lose({effects.call.empty() ? line.tokens[0].word : effects.call, line.number});
  }

  /// Possible postures after a statement that is no motion.
  void follow(const Line& line) {
    const Effects effects = calls_.of(line);
    const auto routine = calls_.routines.called(module_, line);
    if (effects.moves && routine && effects.call == routine->second)
      flow_.call(*routine, {effects.call, line.number});
    else if (effects.moves)
      lose(line);
  }

  /// A motion that no path leads to.
  void never(const Line& line) {
    const std::string name = "line " + std::to_string(line.number);
    targets_.insert(upper_case(name));
    program_.left[name + where_] = "no path leads to it" + (together_ ? ", " + src_.name : "");
  }

  /// XP2=XP1: both are corrected for all motions to either.
  bool copies(const Line& line) {
    const auto& t = line.tokens;
    if (t.size() != 3 || t[0].kind != Kind::kWord || !sign_at(t, 1, '=') ||
        t[2].kind != Kind::kWord)
      return false;
    for (const std::size_t i : {0U, 2U})
      if (!corrected_by_name(t[i].word)) return false;
    for (const std::size_t i : {0U, 2U}) {
      const auto own_point = find_point(data_, t[i].word);
      program_.points.emplace(key_of(t[i].word),
                              own_point ? *own_point : *find_point(controller_, t[i].word));
    }
    program_.copies.push_back({key_of(t[0].word),
                               key_of(t[2].word),
                               {Why::kComputed, src_.name, line.number, t[0].word}});
    return true;
  }

  /// A point with a value, which neither stays nor belongs to a file that is not corrected.
  bool corrected_by_name(const std::string& name) const {
    if (leave_.count(name) > 0 || imported_.count(name) > 0) return false;
    const bool own_point = data_.points.count(name) > 0;
    const bool global = data_.globals.count(name) > 0;
    if (!together_) return own_point && !global;
    const bool others = controller_.points.count(name) > 0;
    return (own_point || others) && !stays(name, own_point, global);
  }

  /// XP1={X ...}: sets the point's value if it has none yet, and no motion used it before.
  bool assigns(const Line& line) {
    const auto& t = line.tokens;
    if (t.size() < 3 || t[0].kind != Kind::kWord || !sign_at(t, 1, '=') || !sign_at(t, 2, '{') ||
        (data_.declared.count(t[0].word) == 0 && data_.points.count(t[0].word) == 0) ||
        depth_ > 0 || targets_.count(t[0].word) > 0 ||
        (together_ && data_.globals.count(t[0].word) > 0))
      return false;
    auto value = read_aggregate(t, 2);
    if (!value || value->after != t.size()) return false;
    const PointKind kind = kind_of(*value);
    const auto [at, fresh] = data_.points.emplace(
        t[0].word, Point{t[0].word, kind, src_.name, line.number, std::move(*value)});
    if (!fresh) refuse(Why::kDeclaredTwice, line.number, t[0].word);
    return true;
  }

  void motion(const Line& line, const FrameState& state) {
    const auto& t = line.tokens;
    std::size_t at = 1;
    const bool arc = kArcs.count(t[0].word) > 0;
    bool understood = target(line, state, at);
    if (understood && arc && sign_at(t, at, ',')) understood = target(line, state, ++at);
    if (understood) return mention(line, at);
    if (together_) mention(line, 1);  // other modules must not correct these
  }

  /// Point at tokens[at]; advances `at`. False: the rest of the line is not understood.
  bool target(const Line& line, const FrameState& state, std::size_t& at) {
    const auto& t = line.tokens;
    if (at < t.size() && kHere.count(t[at].word) > 0) {
      if (!sign_at(t, ++at, ':')) return true;
      lose(line);
      if (!leave_line(t[at - 1].word, t[at - 1].word))
        refuse(Why::kGeometricOperator, line.number, t[at - 1].word);
      return false;
    }
    Motion motion;
    motion.line = line.number;
    motion.module = module_;
    motion.cp = kAxisMotions.count(t[0].word) == 0;
    motion.start = flow_.now();
    flow_.lose({t[0].word, line.number});  // unless the target is known
    motion.frames = state.at_motion(line, motion.wrong_frame_data);
    if (motion.wrong_frame_data) motion.wrong_frame_data->file = src_.name;
    const auto refuse_line = [&](Why why) {
      if (!leave_line(motion.point, motion.point + where_)) refuse(why, line.number, motion.point);
      return false;
    };
    if (sign_at(t, at, '{')) {
      auto value = read_aggregate(t, at);
      motion.point = "line " + std::to_string(line.number);
      if (!value) return refuse_line(is_computed(t, at) ? Why::kComputed : Why::kPartial);
      if (sign_at(t, value->after, ':')) return refuse_line(Why::kGeometricOperator);
      at = value->after;
      const PointKind kind = kind_of(*value);
      if (program_.points.count(motion.point + where_) +
              program_.left.count(motion.point + where_) >
          0)
        motion.point += " (second point)";
      const std::string key = motion.point + where_;
      motion.left = leave_line(motion.point, key);
      (motion.left ? program_.left_points : program_.points)[key] = {
          {}, kind, src_.name, line.number, std::move(*value)};
      motion.point = key;
    } else {
      if (at >= t.size() || t[at].kind != Kind::kWord) {
        motion.point = "line " + std::to_string(line.number);
        return refuse_line(Why::kComputed);
      }
      std::string name = t[at].word;
      const bool element = rest_of_name(t, ++at, name);
      motion.point = name;
      if (!element) return refuse_line(Why::kArray);
      if (sign_at(t, at, ':')) return refuse_line(Why::kGeometricOperator);
      if (sign_at(t, at, '(')) return refuse_line(Why::kComputed);
      motion.point = key_of(name);
      targets_.insert(variable_of(name));
      targets_.insert(name);
      if (!known(name, motion.point, line.number)) {
        motion.left = program_.left.count(motion.point) > 0;
        if (!motion.left) return true;
      }
    }
    flow_.moved(program_.motions.size());
    program_.motions.push_back(std::move(motion));
    return true;
  }

  /// {X 200.0+17.5,Y V[1],Z LIFT(2),...} from tokens[at]: more than numbers, their signs and names.
  static bool is_computed(const std::vector<Token>& t, std::size_t at) {
    for (++at; at < t.size() && !sign_at(t, at, '}'); ++at) {
      const bool of_a_number =
          t[at - 1].kind == Kind::kWord && (sign_at(t, at, '-') || sign_at(t, at, '+')) &&
          (sign_at(t, at - 2, '{') || sign_at(t, at - 2, ',') || sign_at(t, at - 2, ':'));
      if (t[at].kind == Kind::kSign && !of_a_number &&
          std::string_view("{:,").find(t[at].word) == std::string_view::npos)
        return true;
    }
    return false;
  }

  /// [2], [1,2] and .P after the name; false: a computed index.
  static bool rest_of_name(const std::vector<Token>& t, std::size_t& at, std::string& name) {
    while (sign_at(t, at, '[') || (sign_at(t, at, '.') && at + 1 < t.size())) {
      if (sign_at(t, at, '.')) {
        name += "." + t[at + 1].word;
        at += 2;
        continue;
      }
      std::string indices;
      at = read_indices(t, at, indices);
      if (at == 0) return false;
      name += indices;
    }
    return true;
  }

  /// An unchanged point; its posture counts if its value is known.
  bool leave(const std::string& name, const std::string& key, const std::string& why) {
    program_.left[key] = why;
    for (const Data* data : std::array<const Data*, 2>{&data_, &controller_})
      if (const auto point = find_point(*data, name)) {
        if (!given_twice(*data, name)) program_.left_points.emplace(key, *point);
        break;
      }
    return false;
  }

  /// By the name of its refusal ("line 12", XP of XP[I]); false: it does not stay.
  bool leave_line(const std::string& name, const std::string& key) {
    if (leave_.count(upper_case(name)) == 0) return false;
    targets_.insert(upper_case(name));
    program_.left[key] = together_ ? "--leave, " + src_.name : "--leave";
    return true;
  }

  /// True if the point is to be corrected. A later value is unknown yet, so the final decision
  /// follows at the end.
  bool known(const std::string& name, const std::string& key, int line) {
    if (leave_.count(name) > 0 || leave_.count(variable_of(name)) > 0)
      return leave(name, key, "--leave");
    if (name == kHome) return leave(name, key, "home of $machine.dat");
    if (const auto why = imported_.find(variable_of(name)); why != imported_.end())
      return refuse(why->second, line, name), false;
    if (program_.points.count(key) > 0) return true;
    const auto own_point = find_point(data_, name);
    const bool global = data_.globals.count(variable_of(name)) > 0;
    const auto other = own_point ? std::nullopt : find_point(controller_, name);
    if (together_ && (own_point || other) && stays(name, own_point.has_value(), global))
      return leave(name, key, "home or mastering reference");
    if (own_point) {
      if (global && !together_)
        own().refusals.push_back({Why::kGlobal, own_point->file, own_point->line, name});
      program_.points.emplace(key, *own_point);
      return true;
    }
    if (other && together_) {
      program_.points.emplace(key, *other);
      return true;
    }
    if (other) {
      leave(name, key, other->file);
      if (other->kind == PointKind::kCartesian && !stays(name, false, global))
        refuse(Why::kElsewhere, line, name);
      return false;
    }
    const bool computed =
        name.find('.') != std::string::npos ||
        data_.declared.count(variable_of(name)) + controller_.declared.count(variable_of(name)) > 0;
    refuse(name.find('[') != std::string::npos ? Why::kArray
           : computed                          ? Why::kComputed
                                               : Why::kUnknownPoint,
           line, name);
    return false;
  }

  /// GO(XP2): a routine that may move gets a point that no motion of the program goes to.
  void note_handed(const Line& line, const std::string& name) {
    const bool has_point = find_point(data_, name) || find_point(controller_, name) ||
                           data_.declared.count(name) > 0 ||
                           data_.arrays.count(name) + controller_.arrays.count(name) > 0;
    if (!has_point || leave_.count(name) > 0 || data_.named_frames.count(name) > 0 ||
        stays(name, data_.points.count(name) > 0, data_.globals.count(name) > 0))
      return;
    Refusal refusal{Why::kHandedOver, src_.name, line.number, name};
    refusal.lost = {calls_.of(line).call, line.number};
    handed_.emplace(name, std::move(refusal));
  }

  void mention(const Line& line, std::size_t from) {
    const auto& t = line.tokens;
    const bool to_a_mover = calls_.of(line).moves;
    for (std::size_t i = from; i < t.size(); ++i) {
      if (t[i].kind != Kind::kWord) continue;
      // STOOL2(FP1), FP1.TOOL_NO: of a FDAT, which is not changed.
      const bool part =
          sign_at(t, i + 1, '.') && i + 2 < t.size() && kFrameData.count(t[i + 2].word) > 0;
      const bool read_only = part ? !changes_at(line, i, calls_.routines.readers())
                                  : i >= 2 && sign_at(t, i - 1, '(') && t[i - 2].is("STOOL2");
      const bool home =
          i == 2 && t[0].is(kHome) && sign_at(t, 1, '=') && stays(t[i].word, false, false);
      if (read_only || home) continue;
      mentioned_.emplace(t[i].word, line.number);
      if (to_a_mover) note_handed(line, t[i].word);
    }
  }

  const KrlFile& src_;
  std::set<std::string> leave_;
  const Data& controller_;
  Calls calls_;
  const OwnPosition& positions_;
  bool together_;
  std::map<std::string, Why> imported_;
  std::size_t module_;
  std::string where_;  ///< follows the name in its keys
  Data& data_;
  Program& program_;
  FlowReader flow_;
  std::map<std::string, int> mentioned_;
  std::map<std::string, Refusal> handed_;  ///< by the name of the point
  std::set<std::string> targets_;          ///< names of motion targets so far
  int depth_ = 0;                          ///< blocks of IF, LOOP and the like around the line
  int routines_ = 0;                       ///< begun so far
  bool started_ = false;                   ///< the first one may have moved, or jumps
  bool shared_ = false;                    ///< a further one is GLOBAL
};

/// The program and its neighbouring modules.
std::vector<const KrlFile*> sources_of(const ProgramFiles& files) {
  std::vector<const KrlFile*> sources = {&files.src};
  for (const KrlFile& one : files.modules) sources.push_back(&one);
  return sources;
}

/// `known`: of the controller's files.
std::vector<calib::Phrase> callees_of(const std::vector<const KrlFile*>& sources,
                                      const Routines& routines, const Data& known) {
  std::vector<calib::Phrase> all;
  for (const auto& [module, name] : routines.moving_callees(0, known))
    if (!is_kukas_program(sources[module]->name))
      all.push_back(
          {"say.krl.warning.callee",
           {{"name", calib::shown(name)}, {"file", calib::shown(sources[module]->name, 120)}}});
  return all;
}

/// By all modules but the controller's own.
FrameChanges changes_by_all(const std::vector<const KrlFile*>& sources, const Routines& routines) {
  FrameChanges all;
  for (std::size_t i = 0; i < sources.size(); ++i)
    if (!is_kukas_program(sources[i]->name)) merge(routines.changes(i), all);
  return all;
}

/// `others`: of all modules.
FrameChanges changes_for(const ProgramFiles& files, const Routines& routines, std::size_t module,
                         const ControllerFrames& stated, const FrameChanges& others) {
  const Readers& readers = routines.readers();
  FrameChanges all = frame_changes(read_lines(files.src), files.src.name, readers, stated);
  if (files.dat)
    merge(frame_changes(read_lines(*files.dat), files.dat->name, readers, stated), all);
  merge(routines.changes(module), all);
  merge(of_stated_numbers(others), all);
  return all;
}

}  // namespace

std::string name_of_key(const std::string& key) { return key.substr(0, key.find('@')); }

bool is_kukas_program(const std::string& src) {
  const std::string name = upper_case(lower_name(src));
  return name.starts_with("$") || name.starts_with("BRAKETEST") || name == "BAS.SRC" ||
         name == "IR_STOPM.SRC" || name == "MASREF_USER.SRC" || name == "MASREF_MAIN.SRC";
}

bool stays(const std::string& name, bool own, bool global) {
  const bool reference = name.starts_with("XHOME") || name.starts_with("XBRAKE") ||
                         name.starts_with("XMMD_") || name.find("MASREF") != std::string::npos;
  return name == kHome || (reference && (global || !own));
}

Program read_program(const ProgramFiles& files, const std::vector<std::string>& leave,
                     const std::vector<std::string>& still) {
  require_routine(files.src);
  Program program;
  Data known;
  for (const KrlFile& file : files.controller) read_data(file, known);
  if (files.dat) read_data(*files.dat, program.data);
  for (const KrlFile& one : files.modules) apply_beside(one, files.src.name, known, program.data);
  add_missing(known, program.data);
  const std::vector<const KrlFile*> sources = sources_of(files);
  const Routines routines(sources, {still.begin(), still.end()}, known);
  program.callees = callees_of(sources, routines, known);
  program.changes = changes_by_all(sources, routines);
  program.modules.push_back(
      {files.src.name, changes_for(files, routines, 0, known, program.changes), 0, {}, false});
  std::map<std::string, Why> imported;
  for (const Import& one : imports_of(files.src)) imported.emplace(one.name, Why::kElsewhere);
  const BackupFiles alone = {{files}, {}, {}};
  const Types types(alone);
  const OwnPosition positions(alone, types);
  Reader reader(files.src, leave, known, {routines, 0}, positions, false, imported, program.data,
                program);
  reader.read(read_lines(files.src));
  for (const std::string& name : leave)
    if (!reader.is_point(name)) program.no_points.emplace(name, reader.no_point(name));
  std::vector<const KrlFile*> texts = sources;
  if (files.dat) texts.push_back(&*files.dat);
  take_assigned(texts, routines.readers(), program);
  settle(program);
  leave_unmoved(program.data, program.modules[0].kukas, "", "", program);
  program.twice = program.data.refusals;
  return program;
}

std::vector<calib::Phrase> uncorrected_callees(const BackupFiles& files,
                                               const std::vector<std::string>& still) {
  Data known;
  for (const KrlFile& file : files.controller) read_data(file, known);
  const std::vector<const KrlFile*> sources = sources_of(files.modules.front());
  const Routines routines(sources, {still.begin(), still.end()}, known);
  std::vector<calib::Phrase> all = callees_of(sources, routines, known);
  std::string names;
  for (const std::string& name : routines.ungiven_callees(0))
    names += (names.empty() ? "" : ", ") + name;
  if (!names.empty())
    all.push_back({"say.krl.warning.not_given", {{"names", calib::shown(names, 200)}}});
  return all;
}

Program read_programs(const BackupFiles& files, const std::vector<std::string>& leave,
                      const std::vector<std::string>& still) {
  Program program;
  Data seen;  // visible to all modules
  const Imports imports(files);
  for (const KrlFile& file : files.controller) read_data(file, seen);
  std::vector<Data> own(files.modules.size());
  for (const KrlFile& file : files.data) {
    Data data;
    read_data(file, data);
    imports.share(file, data);
    add_globals(data, seen);
  }
  for (std::size_t i = 0; i < files.modules.size(); ++i) {
    if (const auto& dat = files.modules[i].dat) {
      read_data(*dat, own[i]);
      imports.share(*dat, own[i]);
    }
    add_globals(own[i], seen);
  }
  std::vector<const KrlFile*> sources;
  std::set<std::string> touched;
  for (const ProgramFiles& one : files.modules) {
    sources.push_back(&one.src);
    touched.merge(touched_names(read_lines(one.src)));
  }
  forget(touched, true, seen);
  add_missing(seen, program.data);
  const Routines routines(sources, {still.begin(), still.end()}, seen);
  program.changes = changes_by_all(sources, routines);
  const Types types(files);
  const OwnPosition positions(files, types);
  std::set<std::string> missing(leave.begin(), leave.end());
  for (std::size_t i = 0; i < files.modules.size(); ++i) {
    const ProgramFiles& one = files.modules[i];
    forget(touched, false, own[i]);
    add_missing(seen, own[i]);
    program.modules.push_back(
        {one.src.name, changes_for(one, routines, i, seen, program.changes), 0, {}, false});
    Reader reader(one.src, leave, seen, {routines, i}, positions, true,
                  imports.not_followed(one.src.name), own[i], program);
    reader.read(read_lines(one.src));
    std::erase_if(missing, [&](const std::string& name) { return reader.is_point(name); });
    for (const Refusal& refusal : own[i].refusals) program.twice.push_back(refusal);
  }
  for (const Refusal& refusal : seen.refusals) program.twice.push_back(refusal);
  program.computed.insert(imports.renamed().begin(), imports.renamed().end());
  for (const ProgramFiles& one : files.modules)
    if (one.dat) sources.push_back(&*one.dat);
  take_assigned(sources, routines.readers(), program);
  if (!missing.empty())
    throw calib::FileError("--leave: no point is named " + calib::shown(*missing.begin()));
  settle(program);
  for (std::size_t i = 0; i < own.size(); ++i)
    leave_unmoved(own[i], program.modules[i].kukas, "@" + std::to_string(i), ", ", program);
  leave_unmoved(seen, false, "", ", ", program);
  return program;
}

}  // namespace cellcal::daemon::krl

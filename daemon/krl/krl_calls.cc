#include "daemon/krl/krl_calls.h"

#include <algorithm>
#include <deque>
#include <filesystem>

#include "calib/export/krl_values.h"
#include "calib/model/error.h"
#include "daemon/krl/krl_inline.h"
#include "daemon/krl/krl_program.h"
#include "daemon/krl/own_position.h"

namespace cellcal::daemon::krl {

namespace {

using Kind = Token::Kind;
using Words = std::set<std::string>;

const Words kPointMotions = {"PTP", "LIN", "CIRC", "SPTP", "SLIN", "SCIRC", "SPL"};
const Words kRelativeMotions = {"PTP_REL",  "LIN_REL",   "CIRC_REL", "SPTP_REL",
                                "SLIN_REL", "SCIRC_REL", "SPL_REL"};
const Words kExternalMotions = {"ASYPTP", "ASYCONT"};
const Words kBegins = {"DEF", "DEFFCT"};
/// BAS commands that do not set frames. Others (#INITMOV, #ACT_TOOL, #EX_BASE) may.
const Words kNoFrames = {"#VEL_PTP", "#VEL_CP",   "#ACC_PTP",   "#ACC_CP",   "#PTP_DAT",
                         "#CP_DAT",  "#OUT_SYNC", "#OUT_ASYNC", "#ACC_GLUE", "#GROUP"};

/// Keywords followed by '(' that are not calls.
const Words kNoCalls = {"IF",     "WHILE", "UNTIL", "SWITCH", "CASE", "WAIT",   "FOR",   "AND",
                        "OR",     "NOT",   "EXOR",  "B_AND",  "B_OR", "B_EXOR", "B_NOT", "BAS",
                        "RETURN", "THEN",  "TO",    "STEP",   "DO",   "TRIGGER"};

/// KUKA's routines that neither move nor set frames: system, inline forms of KSS 8.2 to 8.7
/// (collision detection, logic, messages, submit, gripper, spot, arc, glue), EthernetKRL and RSI.
/// A further one is added here, in capitals, or by prefix in kStillFamilies, and as a call in the
/// test ACallOfKukasInlineForms (tests/daemon/krl/calls_test.cc). An integrator's own routine
/// is not: --does-not-move names it.
const Words kStill = {
    // functions of language and system
    "ABS", "SQRT", "SIN", "COS", "TAN", "ACOS", "ATAN2", "ROUND", "VARSTATE", "VARTYPE", "PULSE",
    "INVERSE", "FORWARD", "INV_POS", "EK", "CAST_TO", "CAST_FROM", "GET_DECL_PLACE", "GETCYCDEF",
    "SETCYCDEF", "DELETE_BACKWARD_BUFFER", "CWRITE", "CREAD", "COPEN", "CCLOSE", "CIOCTL", "SREAD",
    "SWRITE", "STRADD", "STRCLEAR", "STRCOMP", "STRCOPY", "STRDECLLEN", "STRDELETE", "STRFIND",
    "STRLEN", "STRTOBOOL", "STRTOFRAME", "STRTOINT", "STRTOPOS", "STRTOREAL", "STRTOSTRING",
    "STRTOE6AXIS", "STRTOE6POS", "KRL_FOPEN", "KRL_FCLOSE", "KRL_FPRINTF", "KRL_FSCANF",
    "KRL_FGETS", "KRL_FGETC", "KRL_FPUTS", "KRL_FREMOVE", "KRL_FEXISTS", "KRL_FCLOSEALL",
    "KRL_FRENAME", "ERR_CLEAR", "ERR_RAISE",
    // statements of a motion with a FDAT, PDAT or LDAT
    "STOOL2", "STOOL", "SBASE", "SLOAD", "SIPO_MODE", "K_ROOT", "K_TYPE", "K_OFFS", "SVEL_JOINT",
    "SVEL_CP", "SACC_JOINT", "SACC_CP", "SGEAR_JERK", "SJERK", "SVEL_ORI", "SACC_ORI", "SORI_TYP",
    "SCIRC_TYPE", "SAPO", "SAPO_PTP", "SREF",
    // collision detection and monitored torques
    "SET_CD_PARAMS", "RESET_CD_PARAMS", "USE_CM_PRO_VALUES", "USE_CM_PRO_SETTING",
    "SET_CM_PRO_INACTIVE", "SET_CM_PRO_ACTIVE", "GET_COLLMON_SET", "SET_TQM_ACT",
    "SET_TORQUE_LIMITS", "RESET_TORQUE_LIMITS",
    // messages
    "MSGNOTIFY", "MSGQUIT", "MSGDIALOG", "MSGLOOP", "MSGSTATE", "SET_KRLMSG", "SET_KRLDLG",
    "CLEAR_KRLMSG", "EXISTS_KRLMSG", "EXISTS_KRLDLG", "GET_KRLMSG", "SET_OPT_FILTER",
    // Automatic External
    "P00", "P00_MSG",
    // GripperTech, SpotTech, ArcTech
    "USER_GRP", "CHK_GRP", "GRPG_CHECK", "GRPG_SYNCHECK", "H50", "USERSPOT", "A10", "A10_INI",
    "A20", "ARCMAINNG"};
/// Families of such routines.
constexpr const char* kStillFamilies[] = {"EKI_", "EKX_", "RSI_", "ARCGET"};
/// Exceptions: routines that move but do not set frames.
const Words kMoveOnly = {"RSI_MOVECORR", "ST_MOVESENS", "ST_SKIPSENS"};

/// Lines of a routine that are kept, to be followed.
constexpr std::size_t kMostFollowed = 200;

/// Instead of a module.
constexpr std::size_t kEverywhere = static_cast<std::size_t>(-1);

bool one_of(const Words& words, const Token& token) {
  return token.kind == Kind::kWord && words.count(token.word) > 0;
}

bool is_kukas(const std::string& name) {
  return kStill.count(name) > 0 ||
         std::any_of(std::begin(kStillFamilies), std::end(kStillFamilies),
                     [&](const char* family) { return name.starts_with(family); });
}

/// A motion to another place than where the arm is.
bool moves_elsewhere(const Line& line) {
  const auto& t = line.tokens;
  return motion_kind(line) != MotionKind::kNone && t.size() > 1 &&
         !(states_own_position(t[1].word) && !sign_at(t, 2, ':'));
}

std::string upper_stem(const std::string& file) {
  return upper_case(std::filesystem::path(file).stem().string());
}

}  // namespace

std::string routine_name(const Line& line) {
  const auto& t = line.tokens;
  for (std::size_t i = 1; i < t.size(); ++i)
    if (t[i].kind == Kind::kWord && (sign_at(t, i + 1, '(') || i + 1 == t.size())) return t[i].word;
  return {};
}

MotionKind motion_kind(const Line& line) {
  const Token& token = line.tokens[0];
  if (one_of(kPointMotions, token)) return MotionKind::kPoint;
  if (one_of(kRelativeMotions, token)) return MotionKind::kRelative;
  return one_of(kExternalMotions, token) ? MotionKind::kExternal : MotionKind::kNone;
}

bool approximates(const Token& token) {
  static const Words words = {"C_SPL", "C_DIS", "C_VEL", "C_ORI", "C_PTP"};
  return one_of(words, token);
}

const Token& first_word(const Line& line) {
  return line.tokens[line.tokens[0].is("GLOBAL") && line.tokens.size() > 1 ? 1 : 0];
}

bool begins_routine(const Line& line) { return one_of(kBegins, first_word(line)); }

void require_routine(const KrlFile& src) {
  if (std::ranges::none_of(read_lines(src), begins_routine))
    throw calib::FileError(
        src.name, ": no DEF, so no KRL program. Name a .src file as the controller has it");
}

bool declares(const Line& line) {
  static const Words words = {"DEF", "DEFFCT", "DECL", "EXT", "EXTFCT", "INTERRUPT", "SIGNAL"};
  return one_of(words, first_word(line));
}

bool calls_at(const std::vector<Token>& t, std::size_t at) {
  return t[at].kind == Kind::kWord && sign_at(t, at + 1, '(') && !one_of(kNoCalls, t[at]) &&
         t[at].word[0] != '$' && t[at].word[0] != '#';
}

bool calls_a_routine(const Line& line) {
  for (std::size_t i = 0; i < line.tokens.size(); ++i)
    if (calls_at(line.tokens, i)) return true;
  return false;
}

bool frames_by_bas(const std::vector<Token>& t, std::size_t at) {
  return t[at].kind == Kind::kWord && t[at].word == "BAS" &&
         !(at + 2 < t.size() && one_of(kNoFrames, t[at + 2]));
}

bool sets_frames(const Line& line) {
  static const Words frames = {"$TOOL", "$BASE", "$LOAD", "FDAT_ACT", "$IPO_MODE"};
  for (std::size_t i = 0; i < line.tokens.size(); ++i)
    if (one_of(frames, line.tokens[i]) || frames_by_bas(line.tokens, i)) return true;
  return false;
}

Routines::Routines(const std::vector<const KrlFile*>& modules, const std::set<std::string>& still,
                   const ControllerFrames& stated)
    : still_(still), stated_(stated) {
  find_readers(modules);
  for (std::size_t i = 0; i < modules.size(); ++i) try {
      read(*modules[i], i);
    } catch (const calib::FileError&) {  // not a text: its routines are unknown
    }
  settle();
}

void Routines::find_readers(const std::vector<const KrlFile*>& modules) {
  Readers others;
  for (const KrlFile* module : modules) try {
      for (const Line& line : read_lines(*module)) {
        const auto& t = line.tokens;
        if (!begins_routine(line)) continue;
        std::size_t by_value = 0;
        for (std::size_t i = 1; i < t.size(); ++i)
          by_value += t[i].is("IN") && sign_at(t, i - 1, ':') ? 1 : 0;
        (by_value == parameters_of(line).size() ? readers_ : others).insert(routine_name(line));
      }
    } catch (const calib::FileError&) {  // not a text
    }
  for (const std::string& name : others) readers_.erase(name);
}

/// A routine is visible in its module; everywhere if it is GLOBAL or has the module's name.
void Routines::keep(const std::string& name, Body body, bool global) {
  if (name.empty()) return;
  if (still_.count(name) > 0) body.changes = {};
  body.name = name;
  places_[{body.module, name}].push_back(bodies_.size());
  if (global) places_[{kEverywhere, name}].push_back(bodies_.size());
  bodies_.push_back(std::move(body));
}

void Routines::read(const KrlFile& file, std::size_t module) {
  std::string name;
  Body body;
  bool global = false;
  for (const Line& line : read_lines(file)) {
    if (begins_routine(line)) {
      keep(name, std::move(body), global);
      body = {};
      body.module = module;
      body.parameters = parameters_of(line);
      name = routine_name(line);
      global = name == upper_stem(file.name) || line.tokens[0].is("GLOBAL");
      continue;
    }
    if (declares(line) || line.tokens[0].is("END")) continue;
    resumes_ = resumes_ || line.tokens[0].is("RESUME");
    if (body.lines.size() <= kMostFollowed) body.lines.push_back(line);
    body.moves = body.moves || motion_kind(line) != MotionKind::kNone;
    if (moves_elsewhere(line)) body.targets.insert(line.tokens[1].word);
    body.frames = body.frames || sets_frames(line);
    for (std::size_t i = 0; i < line.tokens.size(); ++i)
      if (calls_at(line.tokens, i)) body.calls.insert(line.tokens[i].word);
    add_changes(line, file.name, readers_, stated_, body.changes);
  }
  keep(name, std::move(body), global);
}

bool Routines::update_effects(Body& body) const {
  bool moves = body.moves, sets = body.frames;
  for (const std::string& call : body.calls) {
    const Effects effects = of_name(body.module, call);
    moves = moves || effects.moves;
    sets = sets || effects.frames;
  }
  const bool news = moves != body.may_move || sets != body.may_set;
  body.may_move = moves;
  body.may_set = sets;
  return news;
}

/// Propagates effects through calls; then the lines of those without are not needed.
void Routines::settle() {
  std::vector<std::vector<std::size_t>> callers(bodies_.size());
  std::deque<std::size_t> open;
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    open.push_back(i);
    for (const std::string& call : bodies_[i].calls)
      if (const auto* places = bodies_of(bodies_[i].module, call))
        for (const std::size_t one : *places) callers[one].push_back(i);
  }
  for (; !open.empty(); open.pop_front())
    if (update_effects(bodies_[open.front()]))
      open.insert(open.end(), callers[open.front()].begin(), callers[open.front()].end());
  for (Body& body : bodies_)
    if (!body.may_set || body.lines.size() > kMostFollowed) std::vector<Line>().swap(body.lines);
}

std::vector<std::size_t> Routines::reached(std::size_t module) const {
  std::vector<std::size_t> all;
  for (std::size_t i = 0; i < bodies_.size(); ++i)
    if (bodies_[i].module == module) all.push_back(i);
  std::set<std::size_t> seen(all.begin(), all.end());
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Body& body = bodies_[all[i]];
    for (const std::string& call : body.calls) {
      if (still_.count(call) > 0 || is_kukas(call)) continue;  // STOOL2 reads TOOL_DATA[n]
      if (const auto* places = bodies_of(body.module, call))
        for (const std::size_t one : *places)
          if (seen.insert(one).second) all.push_back(one);
    }
  }
  return all;
}

FrameChanges Routines::changes(std::size_t module) const {
  FrameChanges all;
  for (const std::size_t one : reached(module)) merge(bodies_[one].changes, all);
  return all;
}

std::vector<std::pair<std::size_t, std::string>> Routines::moving_callees(std::size_t module,
                                                                          const Data& known) const {
  const auto moves_to = [&](const std::string& name) {
    const bool own = known.points.count(name) + known.declared.count(name) == 0;
    return !stays(name, own, false);
  };
  std::vector<std::pair<std::size_t, std::string>> all;
  for (const std::size_t one : reached(module))
    if (bodies_[one].module != module && std::ranges::any_of(bodies_[one].targets, moves_to))
      all.emplace_back(bodies_[one].module, bodies_[one].name);
  return all;
}

std::set<std::string> Routines::ungiven_callees(std::size_t module) const {
  std::set<std::string> all;
  for (const std::size_t one : reached(module))
    for (const std::string& call : bodies_[one].calls)
      if (bodies_of(bodies_[one].module, call) == nullptr &&
          of_name(bodies_[one].module, call).moves)
        all.insert(call);
  return all;
}

const std::vector<std::size_t>* Routines::bodies_of(std::size_t module,
                                                    const std::string& name) const {
  for (const std::size_t place : {module, kEverywhere})
    if (const auto at = places_.find({place, name}); at != places_.end()) return &at->second;
  return nullptr;
}

Effects Routines::of_name(std::size_t module, const std::string& name) const {
  if (still_.count(name) > 0) return {};
  if (kMoveOnly.count(name) > 0) return {true, false, name};
  Effects effects;
  const bool kukas = is_kukas(name);
  const auto* places = bodies_of(module, name);
  if (places == nullptr) return kukas ? effects : Effects{true, true, name};
  for (const std::size_t one : *places) {
    const Body& body = bodies_[one];
    // For KUKA's routines only the body itself counts: their callees are often missing.
    effects.moves = effects.moves || (kukas ? body.moves : body.may_move);
    effects.frames = effects.frames || (kukas ? body.frames : body.may_set);
  }
  if (effects.moves || effects.frames) effects.call = name;
  return effects;
}

std::optional<std::pair<std::size_t, std::string>> Routines::called(std::size_t module,
                                                                    const Line& line) const {
  const auto& t = line.tokens;
  if (!calls_at(t, 0) || !t.back().is(")")) return std::nullopt;
  for (std::size_t i = 1; i < t.size(); ++i)
    if (calls_at(t, i)) return std::nullopt;
  const auto* places = bodies_of(module, t[0].word);
  if (places == nullptr || places->size() != 1) return std::nullopt;
  return std::pair{bodies_[places->front()].module, t[0].word};
}

std::optional<std::pair<std::size_t, std::vector<Line>>> Routines::body_of(std::size_t module,
                                                                           const Line& line) const {
  const auto routine = called(module, line);
  if (!routine) return std::nullopt;
  const Body& body = bodies_[bodies_of(module, routine->second)->front()];
  if (body.lines.empty()) return std::nullopt;
  auto lines = inlined(body.parameters, body.lines, line);
  if (!lines) return std::nullopt;
  return std::pair{body.module, *std::move(lines)};
}

Effects Routines::of(std::size_t module, const Line& line) const {
  Effects all;
  if (declares(line)) return all;
  for (std::size_t i = 0; i < line.tokens.size(); ++i) {
    if (!calls_at(line.tokens, i)) continue;
    const Effects one = of_name(module, line.tokens[i].word);
    if (!one.call.empty() && (all.call.empty() || (one.frames && !all.frames))) all.call = one.call;
    all.moves = all.moves || one.moves;
    all.frames = all.frames || one.frames;
  }
  return all;
}

std::string Routines::frames_aside(std::size_t module, const Line& line) const {
  const auto& t = line.tokens;
  if (!first_word(line).is("INTERRUPT") && !t[0].is("TRIGGER")) return {};
  for (std::size_t i = 1; i + 1 < t.size(); ++i) {
    if (!t[i].is("DO") || t[i + 1].kind != Kind::kWord) continue;
    std::set<std::string> seen;
    return sets_by_given(module, t[i + 1].word, seen) ? t[i + 1].word : "";
  }
  return {};
}

bool Routines::sets_by_given(std::size_t module, const std::string& name,
                             std::set<std::string>& seen) const {
  const auto* bodies = bodies_of(module, name);
  if (bodies == nullptr || !seen.insert(name).second) return false;
  return std::ranges::any_of(*bodies, [&](std::size_t at) {
    return bodies_[at].frames ||
           std::ranges::any_of(bodies_[at].calls, [&](const std::string& call) {
             return sets_by_given(bodies_[at].module, call, seen);
           });
  });
}

}  // namespace cellcal::daemon::krl

#include "daemon/krl/krl_state.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <set>

#include "daemon/krl/krl_inline.h"

namespace cellcal::daemon::krl {

namespace {

using Kind = Token::Kind;

const std::set<std::string> kOpens = {"IF", "LOOP", "FOR", "WHILE", "REPEAT", "SWITCH"};
const std::set<std::string> kCloses = {"ENDIF",    "ENDLOOP", "ENDFOR",
                                       "ENDWHILE", "UNTIL",   "ENDSWITCH"};
const std::set<std::string> kBetween = {"ELSE", "CASE", "DEFAULT", "EXIT", "GOTO"};
/// BAS commands that take the frames from FDAT_ACT.
const std::set<std::string> kFromFrameData = {"#PTP_PARAMS", "#CP_PARAMS", "#FRAMES"};
bool is_word(const std::vector<Token>& t, std::size_t at, const char* what) {
  return at < t.size() && t[at].kind == Kind::kWord && t[at].word == what;
}
bool in(const std::set<std::string>& words, const Token& token) {
  return token.kind == Kind::kWord && words.count(token.word) > 0;
}

bool is_label(const Line& line) {
  return line.tokens.size() == 2 && line.tokens[0].kind == Kind::kWord &&
         sign_at(line.tokens, 1, ':');
}

/// TRIGGER .. DO $BASE=..: an assignment or OUT parameter inside another statement.
bool sets_frames_inside(const Line& line) {
  const auto& t = line.tokens;
  for (std::size_t i = 1; i < t.size() && !t[i].is("WITH"); ++i)
    if (((t[i].is("$TOOL") || t[i].is("$BASE") || t[i].is("$IPO_MODE") || t[i].is("$LOAD")) &&
         !sign_at(t, i - 1, '=')) ||
        frames_by_bas(t, i))
      return true;
  return false;
}

/// A tool or base as a statement sets it; `why`: the statement, where that is not known.
void set(Frames& frames, bool tool, std::optional<FrameRef> value, Lost why) {
  (tool ? frames.tool_lost : frames.base_lost) = value ? Lost{} : std::move(why);
  (tool ? frames.tool : frames.base) = std::move(value);
}

Frames without_reasons(Frames frames) {
  frames.tool_lost = frames.base_lost = {};
  return frames;
}

/// Frames after a call: what its body makes unknown is so since the call.
Frames with_reasons(Frames after, const Frames& before, const Lost& call) {
  if (!after.tool) after.tool_lost = after.tool_lost.what.empty() ? before.tool_lost : call;
  if (!after.base) after.base_lost = after.base_lost.what.empty() ? before.base_lost : call;
  return after;
}

std::optional<FrameRef> numbered(std::optional<int> number) {
  return number ? std::optional(FrameRef{*number, {}}) : std::nullopt;
}

/// M=5.0 or CM={X 0.0,...} from tokens[at].
void read_load_part(const std::vector<Token>& t, std::size_t at, Aggregate& parts) {
  const std::string name = at < t.size() ? t[at].word : "";
  std::erase_if(parts.numbers, [&](const auto& one) {
    return one.first == name || one.first.starts_with(name + ".");
  });
  if (!sign_at(t, at + 1, '=')) return;
  if (const auto number = read_number(t, at + 2)) parts.numbers[name] = {*number, 0, 0};
  const auto value = read_aggregate(t, at + 2);
  if (value && value->after == t.size())
    for (const auto& [part, number] : value->numbers) parts.numbers[name + "." + part] = number;
}

std::optional<LoadRef> written_load(const Aggregate& parts) {
  const auto load = load_stated(parts);
  if (!load) return std::nullopt;
  const auto& [x, y, z] = load->com_mm;
  return LoadRef{-1, fmt::format("$LOAD {:g} kg at {:g} {:g} {:g} mm", load->mass_kg, x, y, z),
                 *load};
}

}  // namespace

std::set<std::string> touched_names(const std::vector<Line>& lines) {
  std::set<std::string> touched;
  for (const Line& line : lines) {
    const auto& t = line.tokens;
    if (declares(line) || is_point_type(t[0].word) || sets_kinematic_base(t)) continue;
    for (std::size_t i = 0; i < t.size(); ++i) {
      const bool set_to = i >= 2 && sign_at(t, i - 1, '=') &&
                          (t[i - 2].is("$TOOL") || t[i - 2].is("$BASE") || t[i - 2].is("$LOAD"));
      if (t[i].kind == Kind::kWord && !set_to) touched.insert(t[i].word);
    }
  }
  return touched;
}

std::set<std::string> hidden_names(const std::vector<Line>& lines) {
  std::set<std::string> hidden;
  for (const Line& line : lines) {
    const auto& t = line.tokens;
    if (begins_routine(line)) {
      std::ranges::copy(parameters_of(line), std::inserter(hidden, hidden.end()));
    } else if ((t[0].is("DECL") || t[0].is("LOAD") || is_point_type(t[0].word)) &&
               std::ranges::none_of(t, [](const Token& one) { return one.is("="); })) {
      for (const Token& one : t) hidden.insert(one.word);
    }
  }
  return hidden;
}

bool sets_load(const std::vector<Line>& lines) {
  return std::ranges::any_of(lines, [](const Line& line) {
    const auto& t = line.tokens;
    for (std::size_t i = 0; i + 1 < t.size(); ++i)
      if (t[i].is("$LOAD") && !sign_at(t, i - 1, '=') && !is_word(t, i + 2, "SLOAD")) return true;
    return false;
  });
}

void FrameState::apply_load(const std::vector<Token>& t, std::size_t at, Frames& frames,
                            int line) const {
  const bool part = sign_at(t, at + 1, '.');
  if (part && is_word(t, at + 2, "J")) return;  // bends no arm at rest
  if (part)
    read_load_part(t, at + 2, frames.load_parts);
  else
    frames.load_parts = {};
  frames.load = part ? written_load(frames.load_parts) : load_at(t, at + 2, frames.load_parts);
  frames.load_lost = frames.load ? Lost{} : Lost{"$LOAD", line};
}

/// The value of $LOAD; `parts`: its components where it is written out.
std::optional<LoadRef> FrameState::load_at(const std::vector<Token>& t, std::size_t at,
                                           Aggregate& parts) const {
  const auto ends = [&](std::size_t behind) {
    return behind == t.size() || sign_at(t, behind, ',');
  };
  if (int number = 0; is_word(t, at, "LOAD_DATA")) {
    const std::size_t behind = read_index(t, at + 1, number);
    return behind > 0 && ends(behind) ? std::optional(LoadRef{number, {}, {}}) : std::nullopt;
  }
  if (is_word(t, at, "SLOAD") && at + 2 < t.size()) {
    const auto data = data_.frames.find(t[at + 2].word);
    return data != data_.frames.end() && data->second.tool >= 0
               ? std::optional(LoadRef{data->second.tool, {}, {}})
               : std::nullopt;
  }
  if (const auto value = read_aggregate(t, at); value && ends(value->after)) {
    parts = *value;
    return written_load(parts);
  }
  // A variable of type LOAD that no statement changes.
  const auto named = at < t.size() ? data_.named_loads.find(t[at].word) : data_.named_loads.end();
  if (foreign_ || named == data_.named_loads.end() || touched_.count(named->first) > 0 ||
      !ends(at + 1))
    return std::nullopt;
  return LoadRef{-1, named->first, named->second};
}

/// A frame from tokens[at]; the index of the next token, 0: none.
std::size_t FrameState::read_frame(const std::vector<Token>& t, std::size_t at, const char* data,
                                   FrameRef& frame) const {
  if (at >= t.size()) return 0;
  if (is_word(t, at, "$NULLFRAME") || is_word(t, at, "$WORLD")) {
    frame.number = 0;
    return at + 1;
  }
  if (is_word(t, at, data)) return read_index(t, at + 1, frame.number);
  if (const auto named = data_.named_frames.find(t[at].word);
      !foreign_ && named != data_.named_frames.end() && touched_.count(named->first) == 0) {
    frame.number = -1;
    frame.literal = named->second;
    return at + 1;
  }
  const auto value = read_aggregate(t, at);
  frame.literal = value ? frame_of(*value) : std::nullopt;
  if (!frame.literal) return 0;
  frame.number = -1;
  return value->after;
}

/// EK(MACHINE_DEF[n].ROOT,MACHINE_DEF[n].MECH_TYPE,frame) from tokens[at]; empty: otherwise.
std::optional<FrameRef> FrameState::on_kinematic(const std::vector<Token>& t,
                                                 std::size_t at) const {
  FrameRef frame;
  std::size_t next = at + 1;
  if (!sign_at(t, next++, '(')) return std::nullopt;
  for (const char* member : {"ROOT", "MECH_TYPE"}) {
    int machine = 0;
    if (!is_word(t, next, "MACHINE_DEF")) return std::nullopt;
    next = read_index(t, next + 1, machine);
    if (next == 0 || machine < 1 || (frame.machine > 0 && machine != frame.machine) ||
        !sign_at(t, next, '.') || !is_word(t, next + 1, member) || !sign_at(t, next + 2, ','))
      return std::nullopt;
    frame.machine = machine;
    next += 3;
  }
  next = read_frame(t, next, "BASE_DATA", frame);
  if (next == 0 || !sign_at(t, next, ')')) return std::nullopt;
  if (next + 1 < t.size() && !sign_at(t, next + 1, ',')) return std::nullopt;
  return frame;
}

/// Frame assigned by a statement, from the token after '='; empty: unknown.
std::optional<FrameRef> FrameState::assigned(const std::vector<Token>& t, std::size_t at,
                                             const char* data) const {
  if (is_word(t, at, "EK")) return on_kinematic(t, at);
  FrameRef frame;
  frame.machine = -1;
  const std::size_t behind = read_frame(t, at, data, frame);
  // In WITH another assignment may follow; anything else is a calculation.
  if (behind == 0 || (behind < t.size() && !sign_at(t, behind, ','))) return std::nullopt;
  return frame;
}

bool is_control(const Line& line) {
  const Token& token = line.tokens[0];
  return in(kOpens, token) || in(kCloses, token) || in(kBetween, token) || is_label(line);
}

int FrameState::blocks(const Line& line) {
  if (in(kOpens, line.tokens[0])) return 1;
  return in(kCloses, line.tokens[0]) ? -1 : 0;
}

void FrameState::find_strict(const std::vector<Line>& lines) {
  int begin = 0, depth = 0;
  bool strict = false, jumps = false;
  const auto close = [&] { strict_[begin] = strict; };
  for (const Line& line : lines) {
    const Token& token = line.tokens[0];
    if (begins_routine(line)) {
      close();
      begin = line.number;
      depth = 0;
      strict = jumps = false;
    }
    const bool inside_before = depth != 0;  // UNTIL f()
    depth += blocks(line);
    const bool changes = sets_frames(line) || calls_.of(line).frames;
    jumps = jumps || token.is("GOTO") || is_label(line);  // no jump leads to a line before
    strict = strict || (changes && (depth != 0 || inside_before || jumps));
  }
  close();
  strict_now_ = strict_[0];
}

void FrameState::take(const std::string& name, int line, Frames& frames,
                      std::optional<Refusal>& wrong) const {
  const auto data = data_.frames.find(name);
  frames = {};
  wrong.reset();
  if (data == data_.frames.end()) {
    wrong = Refusal{Why::kNoSuchFrameData, {}, line, name};
    return;
  }
  used_.emplace(name, line);
  if (data->second.tool >= 0) frames.tool = FrameRef{data->second.tool, {}};
  if (data->second.base >= 0) frames.base = FrameRef{data->second.base, {}};
  frames.external = data->second.external;
}

/// Applies an assignment of $TOOL, $BASE, $LOAD or $IPO_MODE that begins at tokens[at].
bool FrameState::apply(const std::vector<Token>& t, std::size_t at, Frames& frames,
                       std::optional<Refusal>& wrong, int line) const {
  if (is_word(t, at, "$LOAD")) return apply_load(t, at, frames, line), true;
  const bool tool = is_word(t, at, "$TOOL"), base = is_word(t, at, "$BASE");
  const bool mode = is_word(t, at, "$IPO_MODE");
  if (!tool && !base && !mode) return false;
  if (!sign_at(t, at + 1, '=')) {  // $TOOL.X=...
    if (!mode) set(frames, tool, {}, {t[at].word, line});
    return true;
  }
  const std::size_t value = at + 2;
  const bool by_data = (is_word(t, value, "STOOL2") || is_word(t, value, "SBASE") ||
                        is_word(t, value, "SIPO_MODE")) &&
                       sign_at(t, value + 1, '(') && value + 2 < t.size();
  if (by_data) {
    Frames named;
    take(t[value + 2].word, line, named, wrong);
    if (!mode) set(frames, tool, tool ? named.tool : named.base, {t[value].word, line});
    frames.external = named.external;
    return true;
  }
  if (mode) {
    frames.external = !is_word(t, value, "#BASE");
    return true;
  }
  set(frames, tool, assigned(t, value, tool ? "TOOL_DATA" : "BASE_DATA"), {t[at].word, line});
  return true;
}

Frames FrameState::at_motion(const Line& line, std::optional<Refusal>& wrong) const {
  Frames frames = now_;
  wrong = wrong_;
  const auto& t = line.tokens;
  std::size_t with = 0;
  while (with < t.size() && !t[with].is("WITH")) ++with;
  for (std::size_t i = with + 1; i < t.size(); ++i)
    if (sign_at(t, i - 1, ',') || i == with + 1) apply(t, i, frames, wrong, line.number);
  return frames;
}

void FrameState::forget(const std::string& why, int line) {
  now_ = pending_ = outside_spline_ = {};
  now_.lost = pending_.lost = outside_spline_.lost = {why, line};
  if (sets_load_) now_.load_lost = outside_spline_.load_lost = {why.empty() ? "$LOAD" : why, line};
  wrong_.reset();
  pending_wrong_.reset();
}

bool FrameState::read(const Line& line) {
  const bool frames = read_frames(line);
  const Effects effects = calls_.of(line);
  if (effects.frames && follow(line))
    return frames;
  else if (effects.frames)
    forget(effects.call, line.number);
  else if (sets_frames_inside(line) && !declares(line))
    forget(line.tokens[0].word, line.number);
  return frames;
}

bool FrameState::follow(const Line& call) {
  constexpr int kDeepest = 8;
  const auto body = calls_.routines.body_of(calls_.module, call);
  if (!body || depth_ == kDeepest) return false;
  const auto& [module, lines] = *body;
  const bool foreign = module != calls_.module;
  FrameState inside(lines, foreign ? shared_ : data_, shared_, {calls_.routines, module});
  inside.foreign_ = foreign;
  inside.depth_ = depth_ + 1;
  inside.touched_.insert(touched_.begin(), touched_.end());
  inside.now_ = without_reasons(now_);
  inside.pending_ = without_reasons(pending_);
  for (const Line& line : lines) inside.read(line);
  if (inside.wrong_ || inside.pending_wrong_ || !inside.now_.lost.what.empty()) return false;
  // Its own .dat may have another FDAT of this name.
  if (foreign &&
      std::ranges::any_of(inside.used_, [](const auto& one) { return one.first != "FDEFAULT"; }))
    return false;
  const Lost here{call.tokens[0].word, call.number};
  now_ = with_reasons(inside.now_, now_, here);
  pending_ = with_reasons(inside.pending_, pending_, here);
  wrong_.reset();
  pending_wrong_.reset();
  used_.merge(inside.used_);
  return true;
}

/// FDAT_ACT=FP1, FDAT_ACT={TOOL_NO 1,...}, FDAT_ACT.TOOL_NO=1
bool FrameState::read_frame_data(const Line& line) {
  const auto& t = line.tokens;
  if (t.size() == 3 && sign_at(t, 1, '=') && t[2].kind == Kind::kWord) {
    take(t[2].word, line.number, pending_, pending_wrong_);
    return true;
  }
  if (t.size() == 5 && sign_at(t, 1, '.') && sign_at(t, 3, '=') &&
      (t[2].is("TOOL_NO") || t[2].is("BASE_NO"))) {
    set(pending_, t[2].is("TOOL_NO"), numbered(slot_number(t[4])), {"FDAT_ACT", line.number});
    return true;
  }
  pending_ = {};
  pending_wrong_.reset();
  if (const auto value = sign_at(t, 1, '=') ? read_aggregate(t, 2) : std::nullopt) {
    const FrameData data = frame_data_of(*value);
    if (data.tool >= 0) pending_.tool = FrameRef{data.tool, {}};
    if (data.base >= 0) pending_.base = FrameRef{data.base, {}};
    pending_.external = data.external;
  }
  return true;
}

bool FrameState::read_bas(const Line& line) {
  const auto& t = line.tokens;
  const std::string& command = t[2].word;
  const auto number = t.size() == 6 && sign_at(t, 3, ',') ? slot_number(t[4]) : std::nullopt;
  if (kFromFrameData.count(command) > 0) {
    now_ = pending_;
    wrong_ = pending_wrong_;
  } else if (command == "#TOOL" || command == "#BASE") {
    set(now_, command == "#TOOL", numbered(number), {"BAS(" + command + ")", line.number});
    if (command == "#TOOL") {
      now_.load.reset();
      now_.load_parts = {};
      now_.load_lost = {};
    }
    wrong_.reset();
  } else if (frames_by_bas(t, 0)) {
    forget("BAS(" + command + ")", line.number);
  }
  return true;
}

bool FrameState::read_frames(const Line& line) {
  const auto& t = line.tokens;
  if (begins_routine(line)) {
    forget();
    strict_now_ = strict_[line.number];
    return true;
  }
  if (is_control(line)) {
    if (strict_now_) forget(line.tokens[0].word, line.number);
    return false;
  }
  if (t[0].is("SPLINE") || t[0].is("PTP_SPLINE")) {
    outside_spline_ = now_;
    now_ = at_motion(line, wrong_);
    return true;
  }
  if (t[0].is("ENDSPLINE")) {
    now_ = outside_spline_;
    return true;
  }
  if (t[0].is("FDAT_ACT")) return read_frame_data(line);
  if (t[0].is("BAS") && sign_at(t, 1, '(') && t.size() > 2) return read_bas(line);
  return apply(t, 0, now_, wrong_, line.number);
}

}  // namespace cellcal::daemon::krl

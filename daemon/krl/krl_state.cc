#include "daemon/krl/krl_state.h"

#include <cmath>
#include <set>

namespace cellcal::daemon::krl {

namespace {

using Kind = Token::Kind;

const std::set<std::string> kOpens = {"IF", "LOOP", "FOR", "WHILE", "REPEAT", "SWITCH"};
const std::set<std::string> kCloses = {"ENDIF",    "ENDLOOP", "ENDFOR",
                                       "ENDWHILE", "UNTIL",   "ENDSWITCH"};
const std::set<std::string> kBetween = {"ELSE", "CASE", "DEFAULT", "EXIT", "GOTO"};
/// BAS commands that take the frames from FDAT_ACT.
const std::set<std::string> kFromFrameData = {"#PTP_PARAMS", "#CP_PARAMS", "#FRAMES"};
bool is_state_sign(const std::vector<Token>& t, std::size_t at, char what) {
  return at < t.size() && t[at].kind == Kind::kSign && t[at].word[0] == what;
}
bool is_word(const std::vector<Token>& t, std::size_t at, const char* what) {
  return at < t.size() && t[at].kind == Kind::kWord && t[at].word == what;
}
bool in(const std::set<std::string>& words, const Token& token) {
  return token.kind == Kind::kWord && words.count(token.word) > 0;
}

bool is_label(const Line& line) {
  return line.tokens.size() == 2 && line.tokens[0].kind == Kind::kWord &&
         is_state_sign(line.tokens, 1, ':');
}

std::optional<int> whole(const Token& token) {
  if (token.kind != Kind::kNumber || !(token.value >= 0.0 && token.value <= 1000.0) ||
      token.value != std::floor(token.value))
    return std::nullopt;
  return static_cast<int>(token.value);
}

/// TRIGGER .. DO $BASE=..: an assignment or OUT parameter inside another statement.
bool sets_frames_inside(const Line& line) {
  const auto& t = line.tokens;
  for (std::size_t i = 1; i < t.size() && !t[i].is("WITH"); ++i)
    if (((t[i].is("$TOOL") || t[i].is("$BASE") || t[i].is("$IPO_MODE")) &&
         !is_state_sign(t, i - 1, '=')) ||
        frames_by_bas(t, i))
      return true;
  return false;
}

}  // namespace

std::set<std::string> touched_names(const std::vector<Line>& lines) {
  std::set<std::string> touched;
  for (const Line& line : lines) {
    const auto& t = line.tokens;
    if (declares(line) || is_point_type(t[0].word)) continue;
    for (std::size_t i = 0; i < t.size(); ++i) {
      const bool set_to = i >= 2 && is_state_sign(t, i - 1, '=') &&
                          (t[i - 2].is("$TOOL") || t[i - 2].is("$BASE") || t[i - 2].is("$LOAD"));
      if (t[i].kind == Kind::kWord && !set_to) touched.insert(t[i].word);
    }
  }
  return touched;
}

/// Frame assigned by a statement, from the token after '='; empty: unknown.
std::optional<FrameRef> FrameState::assigned(const std::vector<Token>& t, std::size_t at,
                                             const char* data) const {
  if (at >= t.size()) return std::nullopt;
  FrameRef frame;
  std::size_t behind = at + 1;
  if (is_word(t, at, "$NULLFRAME") || is_word(t, at, "$WORLD")) {
    frame.number = 0;
  } else if (is_word(t, at, data) && is_state_sign(t, at + 1, '[') && at + 3 < t.size() &&
             is_state_sign(t, at + 3, ']')) {
    const auto number = whole(t[at + 2]);
    if (!number) return std::nullopt;
    frame.number = *number;
    behind = at + 4;
  } else if (const auto named = data_.named_frames.find(t[at].word);
             named != data_.named_frames.end() && touched_.count(named->first) == 0) {
    frame.number = -1;
    frame.literal = named->second;
  } else if (const auto value = read_aggregate(t, at)) {
    const auto literal = frame_of(*value);
    if (!literal) return std::nullopt;
    frame.number = -1;
    frame.literal = literal;
    behind = value->after;
  } else {
    return std::nullopt;
  }
  // In WITH another assignment may follow; anything else is a calculation.
  if (behind < t.size() && !is_state_sign(t, behind, ',')) return std::nullopt;
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

/// Applies an assignment of $TOOL, $BASE or $IPO_MODE that begins at tokens[at].
bool FrameState::apply(const std::vector<Token>& t, std::size_t at, Frames& frames,
                       std::optional<Refusal>& wrong, int line) const {
  const bool tool = is_word(t, at, "$TOOL"), base = is_word(t, at, "$BASE");
  const bool mode = is_word(t, at, "$IPO_MODE");
  if (!tool && !base && !mode) return false;
  std::optional<FrameRef>& place = tool ? frames.tool : frames.base;
  if (!is_state_sign(t, at + 1, '=')) {  // $TOOL.X=...
    if (!mode) place.reset();
    return true;
  }
  const std::size_t value = at + 2;
  const bool by_data = (is_word(t, value, "STOOL2") || is_word(t, value, "SBASE") ||
                        is_word(t, value, "SIPO_MODE")) &&
                       is_state_sign(t, value + 1, '(') && value + 2 < t.size();
  if (by_data) {
    Frames named;
    take(t[value + 2].word, line, named, wrong);
    if (tool) frames.tool = named.tool;
    if (base) frames.base = named.base;
    frames.external = named.external;
    return true;
  }
  if (mode) {
    frames.external = !is_word(t, value, "#BASE");
    return true;
  }
  place = assigned(t, value, tool ? "TOOL_DATA" : "BASE_DATA");
  return true;
}

Frames FrameState::at_motion(const Line& line, std::optional<Refusal>& wrong) const {
  Frames frames = now_;
  wrong = wrong_;
  const auto& t = line.tokens;
  std::size_t with = 0;
  while (with < t.size() && !t[with].is("WITH")) ++with;
  for (std::size_t i = with + 1; i < t.size(); ++i)
    if (is_state_sign(t, i - 1, ',') || i == with + 1) apply(t, i, frames, wrong, line.number);
  return frames;
}

void FrameState::forget(const std::string& why, int line) {
  now_ = pending_ = outside_spline_ = {};
  now_.lost = pending_.lost = outside_spline_.lost = {why, line};
  wrong_.reset();
  pending_wrong_.reset();
}

bool FrameState::read(const Line& line) {
  const bool frames = read_frames(line);
  const Effects effects = calls_.of(line);
  if (effects.frames)
    forget(effects.call, line.number);
  else if (sets_frames_inside(line) && !declares(line))
    forget(line.tokens[0].word, line.number);
  return frames;
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
  if (t[0].is("FDAT_ACT")) {
    if (t.size() == 3 && is_state_sign(t, 1, '=') && t[2].kind == Kind::kWord) {
      take(t[2].word, line.number, pending_, pending_wrong_);
    } else {
      pending_ = {};
      pending_wrong_.reset();
      const auto value = is_state_sign(t, 1, '=') ? read_aggregate(t, 2) : std::nullopt;
      if (value) {
        const FrameData data = frame_data_of(*value);
        if (data.tool >= 0) pending_.tool = FrameRef{data.tool, {}};
        if (data.base >= 0) pending_.base = FrameRef{data.base, {}};
        pending_.external = data.external;
      }
    }
    return true;
  }
  if (t[0].is("BAS") && is_state_sign(t, 1, '(') && t.size() > 2) {
    const std::string& command = t[2].word;
    const auto number = t.size() == 6 && is_state_sign(t, 3, ',') ? whole(t[4]) : std::nullopt;
    if (kFromFrameData.count(command) > 0) {
      now_ = pending_;
      wrong_ = pending_wrong_;
    } else if (command == "#TOOL" || command == "#BASE") {
      auto& place = command == "#TOOL" ? now_.tool : now_.base;
      place.reset();
      if (number) place = FrameRef{*number, {}};
      wrong_.reset();
    } else if (frames_by_bas(t, 0)) {
      forget("BAS(" + command + ")", line.number);
    }
    return true;
  }
  return apply(t, 0, now_, wrong_, line.number);
}

}  // namespace cellcal::daemon::krl

#include "daemon/krl/krl_state.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <set>
#include <utility>

#include "daemon/krl/krl_inline.h"
#include "daemon/krl/krl_types.h"

namespace cellcal::daemon::krl {

namespace {

using Kind = Token::Kind;

const std::set<std::string> kOpens = {"IF", "LOOP", "FOR", "WHILE", "REPEAT", "SWITCH"};
const std::set<std::string> kCloses = {"ENDIF",    "ENDLOOP", "ENDFOR",
                                       "ENDWHILE", "UNTIL",   "ENDSWITCH"};
/// BAS commands that take the frames from FDAT_ACT.
const std::set<std::string> kFromFrameData = {"#PTP_PARAMS", "#CP_PARAMS", "#FRAMES"};
const std::set<std::string> kNumberTypes = {"INT", "REAL", "BOOL", "CHAR"};

bool is_word(const std::vector<Token>& t, std::size_t at, const char* what) {
  return at < t.size() && t[at].kind == Kind::kWord && t[at].word == what;
}
bool in(const std::set<std::string>& words, const Token& token) {
  return token.kind == Kind::kWord && words.count(token.word) > 0;
}

std::string words_of(const std::vector<Token>& t, std::size_t begin, std::size_t end) {
  std::string all;
  for (; begin < end; ++begin) all += t[begin].word;
  return all;
}

/// Index of the argument of STOOL(n), SBASE(F.BASE_NO), EK(K_ROOT(n),K_TYPE(n),K_OFFS(n)) and the like from tokens[at];
/// 0: none, or a calculation with them.
std::size_t argument_at(const std::vector<Token>& t, std::size_t at) {
  static const std::set<std::string> by_data = {"STOOL2", "STOOL", "SBASE", "SIPO_MODE", "SLOAD"};
  const std::size_t behind = sign_at(t, at + 1, '(') ? closed(t, at + 1) : 0;
  if (behind < at + 4 || (behind < t.size() && !sign_at(t, behind, ','))) return 0;
  if (in(by_data, t[at])) return at + 2;
  const std::size_t group = sign_at(t, at + 3, '(') ? closed(t, at + 3) : 0;
  if (group < at + 6) return 0;
  const std::string number = words_of(t, at + 3, group);
  const bool by_kinematic = words_of(t, at, behind) ==
                            "EK(K_ROOT" + number + ",K_TYPE" + number + ",K_OFFS" + number + ")";
  return by_kinematic ? at + 4 : 0;
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

/// A tool or base as a statement sets it; empty: not known.
void set(Frames& frames, bool tool, std::optional<FrameRef> value, Lost at) {
  (tool ? frames.tool_at : frames.base_at) = std::move(at);
  (tool ? frames.tool : frames.base) = std::move(value);
}

/// The statements after which a value is unknown where two ways meet; `known`: on the other one.
Lost differ(const Lost& one, const Lost& other, bool known) {
  if (!known) return other;
  return {one.what, std::min(one.line, other.line),
          one.line == other.line ? 0 : std::max(one.line, other.line)};
}

/// Unknown where the other way has another; true if that is news.
bool meet(std::optional<FrameRef>& frame, Lost& at, const std::optional<FrameRef>& other,
          const Lost& other_at) {
  if (!frame) return false;
  const int machine = frame->machine;
  if (frame == other) {
    frame->machine = std::min(machine, other->machine);
    return frame->machine != machine;
  }
  at = differ(at, other_at, other.has_value());
  frame.reset();
  return true;
}

bool meet_load(Frames& into, const Frames& other) {
  const bool same_parts = into.load_parts == other.load_parts;
  bool news = !same_parts && !(into.load_parts == Aggregate{});
  if (!same_parts) into.load_parts = {};
  if (!into.load_known) return news;
  const bool same = into.load == other.load ||
                    (into.tool == other.tool && into.other_load() == other.other_load());
  if (same && other.load_known) {
    if (into.load || !other.load) return news;
    into.load = other.load;  // as $LOAD states it, for another tool from there on
    return true;
  }
  into.load_at = differ(into.load_at, other.load_at, other.load_known);
  into.load_known = false;
  into.load.reset();
  return true;
}

bool meet(Frames& into, const Frames& other) {
  bool news = meet_load(into, other) || (other.external && !into.external);
  into.external = into.external || other.external;
  news = meet(into.tool, into.tool_at, other.tool, other.tool_at) || news;
  return meet(into.base, into.base_at, other.base, other.base_at) || news;
}

bool meet(std::optional<Refusal>& into, const std::optional<Refusal>& other) {
  if (into || !other) return false;
  into = other;
  return true;
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

bool FrameRef::operator==(const FrameRef& other) const {
  return number == other.number && std::max(machine, 0) == std::max(other.machine, 0) &&
         literal.has_value() == other.literal.has_value() &&
         (!literal ||
          (literal->xyz_mm == other.literal->xyz_mm && literal->abc_deg == other.literal->abc_deg));
}

std::set<std::string> touched_names(const std::vector<Line>& lines) {
  std::set<std::string> touched;
  for (const Line& line : lines) {
    const auto& t = line.tokens;
    const bool interrupt = first_word(line).is("INTERRUPT");  // its call's arguments
    if ((declares(line) && !interrupt) || is_point_type(t[0].word) || sets_kinematic_base(t))
      continue;
    for (std::size_t i = 0; i < t.size(); ++i) {
      const bool set_to = i >= 2 && sign_at(t, i - 1, '=') &&
                          (t[i - 2].is("$TOOL") || t[i - 2].is("$BASE") || t[i - 2].is("$LOAD"));
      const bool read = set_to || sign_at(t, i - 1, '[') || t[0].is("BAS") || t[0].is("FDAT_ACT");
      if (t[i].kind == Kind::kWord && !read) touched.insert(t[i].word);
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
    } else if (in(kNumberTypes, t[0]) ||
               ((t[0].is("DECL") || t[0].is("LOAD") || is_point_type(t[0].word)) &&
                std::ranges::none_of(t, [](const Token& one) { return one.is("="); }))) {
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
  frames.load_known = frames.load.has_value();
  frames.load_at = this->at("$LOAD", line);
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
  if (is_word(t, at, "SLOAD")) {
    const std::size_t argument = argument_at(t, at);
    if (argument == 0) return std::nullopt;
    const auto data = data_.frames.find(t[argument].word);
    const int number =
        data != data_.frames.end() ? data->second.tool : slot_number(t[argument]).value_or(-1);
    return number >= 0 ? std::optional(LoadRef{number, {}, {}}) : std::nullopt;
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

bool only_sets_frames(const Line& line) {
  static const std::set<std::string> words = {"$TOOL",  "$BASE",      "$LOAD",     "$IPO_MODE",
                                              "SPLINE", "PTP_SPLINE", "ENDSPLINE", "FDAT_ACT"};
  const auto& t = line.tokens;
  return in(words, t[0]) || (t[0].is("BAS") && sign_at(t, 1, '(') && t.size() > 2);
}

int FrameState::blocks(const Line& line) {
  if (in(kOpens, line.tokens[0])) return 1;
  return in(kCloses, line.tokens[0]) ? -1 : 0;
}

void FrameState::take(const std::string& name, int line, Frames& frames,
                      std::optional<Refusal>& wrong) const {
  const auto data = data_.frames.find(name);
  frames = {};
  frames.tool_at = frames.base_at = frames.load_at = at("FDAT_ACT", line);
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
    if (!mode) set(frames, tool, {}, this->at(t[at].word, line));
    return true;
  }
  const std::size_t value = at + 2;
  const std::size_t argument = argument_at(t, value);
  const char* const part = mode ? "IPO_FRAME" : tool ? "TOOL_NO" : "BASE_NO";
  if (argument > 0 && (is_word(t, value, "STOOL2") || is_word(t, argument + 2, part))) {
    Frames named;
    take(t[argument].word, line, named, wrong);
    if (!mode) set(frames, tool, tool ? named.tool : named.base, this->at(t[value].word, line));
    frames.external = named.external;
    return true;
  }
  if (mode) {
    frames.external = !is_word(t, argument > 0 ? argument : value, "#BASE");
    return true;
  }
  if (argument > 0) {
    set(frames, tool, numbered(slot_number(t[argument])), this->at(t[at].word, line));
    return true;
  }
  set(frames, tool, assigned(t, value, tool ? "TOOL_DATA" : "BASE_DATA"),
      this->at(t[at].word, line));
  return true;
}

Frames FrameState::with_own(const Line& line, const State& state,
                            std::optional<Refusal>& wrong) const {
  Frames frames = state.now;
  wrong = state.wrong;
  auto t = line.tokens;
  while (!t.empty() && approximates(t.back())) t.pop_back();
  std::size_t with = 0;
  while (with < t.size() && !t[with].is("WITH")) ++with;
  for (std::size_t i = with + 1; i < t.size(); ++i)
    if (sign_at(t, i - 1, ',') || i == with + 1) apply(t, i, frames, wrong, line.number);
  return frames;
}

Frames FrameState::at_motion(const Line& line, std::optional<Refusal>& wrong) const {
  return with_own(with_numbers(line), *state(line), wrong);
}

const Frames* FrameState::before(const Line& line) const {
  return state(line) ? &state(line)->now : nullptr;
}

FrameState::FrameState(const std::vector<Line>& lines, const std::string& own, const Data& data,
                       const Data& shared, Calls calls)
    : FrameState(lines, data, shared, calls) {
  run(lines, own, nullptr);
  for (const auto& [place, line] : statements_)
    if (auto& state = states_[static_cast<std::size_t>(place)]) step(line, *state);
  for (const Line& line : lines)
    if (const std::string by = calls_.routines.frames_aside(calls_.module, line); !by.empty())
      for (auto& state : states_)  // at any time
        if (state) lose({.what = by, .line = line.number, .any_time = true}, *state);
}

bool FrameState::meet(State& into, const State& other) {
  using krl::meet;
  bool news = meet(into.now, other.now);
  news = meet(into.pending, other.pending) || news;
  news = meet(into.outside_spline, other.outside_spline) || news;
  news = meet(into.wrong, other.wrong) || news;
  return meet(into.pending_wrong, other.pending_wrong) || news;
}

const std::optional<FrameState::State>& FrameState::run(const std::vector<Line>& lines,
                                                        const std::string& own,
                                                        const State* entry) {
  Flow flow;
  FlowReader reader(flow, calls_.module, own);
  for (const Line& line : lines) {
    const int place = before_[line.number] = reader.now();
    if (const auto routine = calls_.routines.called(calls_.module, line))
      reader.call(*routine, {});
    else if (steps(line))
      reader.moved(0);
    if (reader.now() != place) statements_.emplace(reader.now(), with_numbers(line));
    reader.control(line);
  }
  reader.finish();
  const auto next = flow.next();
  states_.resize(next.size());
  std::set<int> open;
  const auto arrive = [&](int place, const State& state) {
    auto& there = states_[static_cast<std::size_t>(place)];
    const bool news = !there || meet(*there, state);
    if (!there) there = state;
    if (news) open.insert(place);
  };
  for (const auto& [place, why] : flow.beginnings())
    arrive(place, entry != nullptr && place == 0 ? *entry : unknown(why));
  while (!open.empty()) {
    const int place = open.extract(open.begin()).value();
    State state = *states_[static_cast<std::size_t>(place)];
    if (const auto line = statements_.find(place); line != statements_.end())
      step(line->second, state);
    for (const int one : next[static_cast<std::size_t>(place)]) arrive(one, state);
  }
  return states_[static_cast<std::size_t>(reader.exit())];
}

Line FrameState::with_numbers(Line line) const {
  auto& t = line.tokens;
  const auto one_of = [&](std::size_t at, const std::string& signs) {
    return at < t.size() && t[at].kind == Kind::kSign &&
           signs.find(t[at].word) != std::string::npos;
  };
  for (std::size_t i = 1; i < t.size() && !foreign_; ++i) {
    if (t[i].kind != Kind::kWord || !one_of(i - 1, "=,([")) continue;
    if (i + 1 < t.size() && !one_of(i + 1, ",)]")) continue;
    const auto named = data_.named_numbers.find(t[i].word);
    if (named == data_.named_numbers.end() || !named->second) continue;
    if ((named->second->constant ? hidden_ : touched_).count(t[i].word) > 0) continue;
    t[i].kind = Kind::kNumber;
    t[i].value = named->second->value;
  }
  for (std::size_t i = 1; i + 3 < t.size() && !foreign_; ++i) {  // [F.TOOL_NO]
    const bool tool = t[i + 2].is("TOOL_NO");
    if (!sign_at(t, i - 1, '[') || !sign_at(t, i + 1, '.') || !(tool || t[i + 2].is("BASE_NO")) ||
        !sign_at(t, i + 3, ']') || hidden_.count(t[i].word) > 0)
      continue;
    const auto data = data_.frames.find(t[i].word);
    if (data == data_.frames.end()) continue;
    used_.emplace(data->first, line.number);
    t[i].kind = Kind::kNumber;
    t[i].value = tool ? data->second.tool : data->second.base;
    t.erase(t.begin() + static_cast<std::ptrdiff_t>(i) + 1,
            t.begin() + static_cast<std::ptrdiff_t>(i) + 3);
  }
  return line;
}

FrameState::State FrameState::unknown(const Lost& why) const {
  State state;
  for (Frames* one : {&state.now, &state.pending, &state.outside_spline})
    one->tool_at = one->base_at = one->load_at = why;
  state.now.load_known = state.outside_spline.load_known = !sets_load_;
  return state;
}

void FrameState::lose(const Lost& why, State& state) const {
  const bool now = state.now.external, outside = state.outside_spline.external;
  state = unknown(why);
  state.now.external = now;
  state.outside_spline.external = outside;
}

bool FrameState::steps(const Line& line) const {
  return only_sets_frames(line) || calls_.of(line).frames ||
         (sets_frames_inside(line) && !declares(line));
}

void FrameState::step(const Line& line, State& state) const {
  const auto& t = line.tokens;
  if (t[0].is("SPLINE") || t[0].is("PTP_SPLINE")) {
    state.outside_spline = state.now;
    state.now = with_own(line, state, state.wrong);
  } else if (t[0].is("ENDSPLINE")) {
    state.now = state.outside_spline;
  } else if (t[0].is("FDAT_ACT")) {
    read_frame_data(line, state);
  } else if (only_sets_frames(line) && t[0].is("BAS")) {
    read_bas(line, state);
  } else {
    apply(t, 0, state.now, state.wrong, line.number);
  }
  const Effects effects = calls_.of(line);
  if (effects.frames && follow(line, state)) return;
  if (effects.frames)
    lose(at(effects.call, line.number), state);
  else if (sets_frames_inside(line) && !declares(line))
    lose(at(t[0].word, line.number), state);
}

bool FrameState::follow(const Line& call, State& state) const {
  constexpr int kDeepest = 8, kMostFollowed = 1000;  // of each call of the module
  const auto body = calls_.routines.body_of(calls_.module, call);
  if (depth_ == 0) *followed_ = 0;
  if (!body || calls_.routines.resumes() || depth_ == kDeepest || ++*followed_ > kMostFollowed)
    return false;
  const auto& [module, lines] = *body;
  const bool foreign = foreign_ || module != calls_.module;
  FrameState inside(lines, foreign ? shared_ : data_, shared_, {calls_.routines, module});
  inside.foreign_ = foreign;
  inside.depth_ = depth_ + 1;
  inside.followed_ = followed_;
  inside.call_ = at(call.tokens[0].word, call.number);
  inside.touched_.insert(touched_.begin(), touched_.end());
  inside.hidden_.insert(hidden_.begin(), hidden_.end());
  inside.sets_load_ = inside.sets_load_ || sets_load_;
  State entry = state;
  entry.wrong.reset();
  entry.pending_wrong.reset();
  const auto& behind = inside.run(lines, call.tokens[0].word, &entry);
  if (!behind || behind->wrong || behind->pending_wrong) return false;
  // Its own .dat may have another FDAT of this name.
  if (foreign &&
      std::ranges::any_of(inside.used_, [](const auto& one) { return one.first != "FDEFAULT"; }))
    return false;
  state = *behind;
  used_.merge(inside.used_);
  return true;
}

/// FDAT_ACT=FP1, FDAT_ACT={TOOL_NO 1,...}, FDAT_ACT.TOOL_NO=1
void FrameState::read_frame_data(const Line& line, State& state) const {
  const auto& t = line.tokens;
  Frames& pending = state.pending;
  if (t.size() == 3 && sign_at(t, 1, '=') && t[2].kind == Kind::kWord)
    return take(t[2].word, line.number, pending, state.pending_wrong);
  const Lost here = at("FDAT_ACT", line.number);
  if (t.size() == 5 && sign_at(t, 1, '.') && sign_at(t, 3, '=') &&
      (t[2].is("TOOL_NO") || t[2].is("BASE_NO")))
    return set(pending, t[2].is("TOOL_NO"), numbered(slot_number(t[4])), here);
  pending = {};
  pending.tool_at = pending.base_at = pending.load_at = here;
  state.pending_wrong.reset();
  if (const auto value = sign_at(t, 1, '=') ? read_aggregate(t, 2) : std::nullopt) {
    const FrameData data = frame_data_of(*value);
    if (data.tool >= 0) pending.tool = FrameRef{data.tool, {}};
    if (data.base >= 0) pending.base = FrameRef{data.base, {}};
    pending.external = data.external;
  }
}

void FrameState::read_bas(const Line& line, State& state) const {
  const auto& t = line.tokens;
  const std::string& command = t[2].word;
  const auto number = t.size() == 6 && sign_at(t, 3, ',') ? slot_number(t[4]) : std::nullopt;
  if (kFromFrameData.count(command) > 0) {
    const Frames before = std::exchange(state.now, state.pending);
    const Lost here = at("BAS(" + command + ")", line.number);
    if (before.tool && !state.now.tool) state.now.tool_at = here;
    if (before.base && !state.now.base) state.now.base_at = here;
    state.wrong = state.pending_wrong;
  } else if (command == "#TOOL" || command == "#BASE") {
    const Lost here = at("BAS(" + command + ")", line.number);
    set(state.now, command == "#TOOL", numbered(number), here);
    if (command == "#TOOL") {
      state.now.load.reset();
      state.now.load_parts = {};
      state.now.load_known = true;
      state.now.load_at = here;
    }
    state.wrong.reset();
  } else if (frames_by_bas(t, 0)) {
    state = unknown(at("BAS(" + command + ")", line.number));
  }
}

}  // namespace cellcal::daemon::krl

#include "daemon/krl/run_time_program.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <optional>
#include <set>
#include <tuple>

#include "calib/files/text.h"
#include "calib/model/error.h"
#include "daemon/krl/krl_calls.h"
#include "daemon/krl/krl_numbers.h"
#include "daemon/krl/krl_types.h"
#include "daemon/krl/own_position.h"
#include "daemon/krl/point_value.h"

namespace cellcal::daemon::krl {

namespace {

using Kind = Token::Kind;
using Tokens = std::vector<Token>;

/// The functions of CELLCAL_FIX for a point of a type.
struct Functions {
  std::string type, path, ptp, path_in, ptp_in, stay;  ///< empty: there is none
};
const std::array<Functions, 5> kFunctions = {
    {{"E6POS", "CC_FIX", "CC_FIX_PTP", "CC_FIX_IN", "CC_FIX_PTP_IN", "CC_STAY_POS"},
     {"POS", "CC_FIX_POS", "CC_FIX_PTP_POS", "", "", ""},
     {"FRAME", "CC_FIX_FRAME", "CC_FIX_FRAME", "CC_FIX_FRAME_IN", "CC_FIX_FRAME_IN", ""},
     {"E6AXIS", "", "CC_FIX_E6AXIS", "", "CC_FIX_E6AXIS_IN", "CC_STAY"},
     {"AXIS", "", "CC_FIX_AXIS", "", "", "CC_STAY_AXIS"}}};
constexpr const char* kByBase = "CC_BY";
constexpr const char* kByTool = "CC_BY_TOOL";
constexpr const char* kByAxes = "CC_BY_AXES";
/// Of external axes: in place of SBASE(n), and what carries that base. kActive: the active one does not change.
constexpr const char* kBase = "CC_BASE";
constexpr const char* kCarrier = "CC_CARRIER";
constexpr const char *kActive = "-1", *kNotCarried = "0";
/// Components missing in a relative motion are appended to its {..}. The double blank marks them for
/// restored(): no editor writes it there.
constexpr const char* kAdded = ",  ";
constexpr const char* kNothing = " +0.0";
/// Follows the type added to a {..} without one, which a parameter of a function requires; the double
/// blank marks it for restored().
constexpr const char* kTyped = ":  ";
/// Separates a motion from its call where the file has no blank: LIN_REL{Z 100}.
constexpr const char* kParted = " \t";

const std::set<std::string> kPtp = {"PTP", "SPTP"};
const std::set<std::string> kArc = {"CIRC", "SCIRC"};
const std::set<std::string> kRelativeWays = {"PTP_REL", "SPTP_REL", "LIN_REL", "SLIN_REL"};
/// Frames that points are in.
const std::set<std::string> kFrames = {"$BASE", "$TOOL", "BASE_DATA", "TOOL_DATA"};

bool is_ours(const Token& token) {
  static const std::set<std::string> all = [] {
    std::set<std::string> names = {kByBase, kByTool, kByAxes};
    for (const Functions& f : kFunctions)
      for (const auto* name : {&f.path, &f.ptp, &f.path_in, &f.ptp_in, &f.stay})
        names.insert(*name);
    names.erase("");
    return names;
  }();
  return token.kind == Kind::kWord && all.count(token.word) > 0;
}

/// True if the character before `at` belongs to a word.
bool in_a_word(const std::string& text, std::size_t at) {
  if (at == 0) return false;
  const auto last = static_cast<unsigned char>(text[at - 1]);
  return std::isalnum(last) != 0 || last == '_' || last == '$';
}

/// True if the {..} at tokens[at] has a type added with kTyped.
bool typed_by_us(const std::string& text, const Tokens& t, std::size_t at) {
  return sign_at(t, at, '{') && at + 2 < t.size() && t[at + 1].begin == t[at].end &&
         t[at + 2].begin == t[at + 1].end &&
         text.compare(t[at + 2].begin, std::string_view(kTyped).size(), kTyped) == 0;
}

/// {E6POS: X 1.0,...}
struct Literal {
  std::string type;  ///< written before the components; empty: none
  std::map<std::string, std::optional<double>> parts;  ///< empty value: computed
};

std::optional<Literal> literal_at(const Tokens& t, std::size_t at) {
  const std::size_t end = closed(t, at);
  if (end == 0) return std::nullopt;
  Literal literal;
  ++at;
  if (sign_at(t, at + 1, ':') && t[at].kind == Kind::kWord) {
    literal.type = t[at].word;
    at += 2;
  }
  while (at + 1 < end) {
    if (t[at].kind != Kind::kWord) return std::nullopt;
    const std::string name = t[at].word;
    const std::size_t next = next_comma(t, ++at, end - 1);
    const Tokens value(t.begin() + static_cast<std::ptrdiff_t>(at),
                       t.begin() + static_cast<std::ptrdiff_t>(next));
    if (value.empty() || !literal.parts.emplace(name, read_number(value, 0)).second)
      return std::nullopt;
    at = next + 1;
  }
  if (literal.parts.empty()) return std::nullopt;
  return literal;
}

bool has_all(const Literal& literal, const std::array<const char*, 6>& names) {
  return std::ranges::all_of(names, [&](const char* n) { return literal.parts.count(n) > 0; });
}
constexpr std::array<const char*, 6> kPlace = {"X", "Y", "Z", "A", "B", "C"};
constexpr std::array<const char*, 6> kAxes = {"A1", "A2", "A3", "A4", "A5", "A6"};

/// The target of a motion: tokens [begin, end).
struct Target {
  std::size_t begin = 0, end = 0;
  std::string type;  ///< empty: unknown
  std::string name;  ///< of a single variable, with its components and constant subscripts
  std::optional<Literal> literal;  ///< of a single {..}
};

/// Tool, base, mode and load of a motion's or spline's own WITH, as text.
struct With {
  std::string tool, base, mode, load;
  std::string carrier = kActive;
  bool any() const { return !(tool + base + mode + load).empty(); }
};

class Rewriter {
 public:
  Rewriter(const KrlFile& src, std::size_t module, const Types& types,
           const std::set<std::string>& leave, const std::vector<std::string>& external,
           const calib::ExternalAxes& apart, const std::map<std::string, FrameData>& frames,
           const OwnPosition& own, std::set<std::string>& seen)
      : src_(src),
        module_(module),
        types_(types),
        leave_(leave),
        external_(external),
        apart_(apart),
        frames_(frames),
        own_(own),
        seen_(seen) {
    result_.src = src.name;
  }

  void read() {
    const std::vector<Line> lines = read_lines(src_);
    for (std::size_t i = 0; i < lines.size() && result_.other_load.empty(); ++i) {
      result_.other_load = other_load(lines, i);
      result_.other_load_line = lines[i].number;
    }
    for (const Line& line : lines) {
      for (const Token& token : line.tokens)
        if (is_ours(token))
          throw calib::FileError(src_.name,
                                 ":" + std::to_string(line.number) +
                                     ": is corrected at run time already. --restore takes it back");
      read(line);
    }
  }
  /// The controller's own program.
  void leave() {
    result_.kukas = true;
    for (const Line& line : read_lines(src_))
      if (motion_kind(line) != MotionKind::kNone) ++result_.motions;
  }
  const RewrittenModule& result() const { return result_; }
  std::string text() const { return edited(src_.text, edits_); }

 private:
  /// CELLCAL_FIX knows a tool's own load alone: what $LOAD is set to, where that is another's than the
  /// tool's within two lines. Empty: none.
  static std::string other_load(const std::vector<Line>& lines, std::size_t at) {
    constexpr std::size_t kNear = 2;
    const Tokens& t = lines[at].tokens;
    if (!t[0].is("$LOAD")) return {};
    int load = 0;
    const bool numbered =
        t.size() > 2 && sign_at(t, 1, '=') && t[2].is("LOAD_DATA") && read_index(t, 3, load) > 0;
    const std::size_t first = at < kNear ? 0 : at - kNear;
    const std::size_t behind = std::min(lines.size(), at + kNear + 1);
    for (std::size_t i = first; numbered && i < behind; ++i) {
      const Tokens& near = lines[i].tokens;
      int tool = 0;
      if (near[0].is("$TOOL") && near.size() > 2 && near[2].is("TOOL_DATA") &&
          read_index(near, 3, tool) > 0 && tool == load)
        return {};
    }
    return numbered ? "LOAD_DATA[" + std::to_string(load) + "]" : "$LOAD";
  }

  void refuse(Why why, const Line& line, const std::string& what) {
    result_.refusals.push_back({why, src_.name, line.number, what});
  }

  void read(const Line& line) {
    const Tokens& t = line.tokens;
    if (t[0].is("SPLINE") || t[0].is("PTP_SPLINE")) spline_ = with_of(t, {});
    if (t[0].is("ENDSPLINE") || begins_routine(line)) spline_ = {};
    read_mode(line);
    if (kFrames.count(t[0].word) > 0) refuse_own(line, 1, t.size(), t[0].word);
    const MotionKind kind = motion_kind(line);
    if (t.size() < 2 || (kind != MotionKind::kPoint && kind != MotionKind::kRelative)) return;
    ++result_.motions;
    if (const auto value = read_aggregate(t, 1); value && leaves_the_arm(*value, apart_)) return;
    if (kind == MotionKind::kRelative) return relative(line);
    std::size_t at = to(line, 1);
    if (at > 0 && kArc.count(t[0].word) > 0 && sign_at(t, at, ',')) at = to(line, at + 1);
    if (at > 0 && spoken_) ++result_.corrected;
    spoken_ = false;
  }

  /// FDAT_ACT=FP1, $IPO_MODE=#TCP; in force in the lines below, until the next of either or the routine's end.
  void read_mode(const Line& line) {
    const Tokens& t = line.tokens;
    if (begins_routine(line)) in_tcp_ = false;
    if (t.size() != 3 || !sign_at(t, 1, '=')) return;
    const auto frame = frames_.find(t[2].word);
    if (t[0].is("FDAT_ACT") && frame != frames_.end()) in_tcp_ = frame->second.external;
    if (t[0].is("$IPO_MODE")) in_tcp_ = t[2].is("#TCP");
  }

  With with_of(const Tokens& t, With with) const {
    std::size_t at = 0;
    while (at < t.size() && !t[at].is("WITH")) ++at;
    while (++at < t.size()) {
      const auto begin = t.begin() + static_cast<std::ptrdiff_t>(at);
      const auto approximation = std::find_if(begin, t.end(), approximates);
      const std::size_t end =
          next_comma(t, at, static_cast<std::size_t>(approximation - t.begin()));
      std::string* const place = t[at].is("$TOOL")       ? &with.tool
                                 : t[at].is("$BASE")     ? &with.base
                                 : t[at].is("$IPO_MODE") ? &with.mode
                                 : t[at].is("$LOAD")     ? &with.load
                                                         : nullptr;
      if (place != nullptr && sign_at(t, at + 1, '=') && at + 2 < end)
        *place = src_.text.substr(t[at + 2].begin, t[end - 1].end - t[at + 2].begin);
      if (place == &with.base) with.carrier = kNotCarried;
      // SBASE(n), EK(K_ROOT(n),...); after it an offset of that base.
      const bool coupled = sign_at(t, at + 3, '(') && word_at(t, at + 4) && t[at + 4].is("K_ROOT");
      const std::size_t open = coupled ? at + 5 : at + 3;
      const std::size_t number = sign_at(t, open, '(') ? closed(t, open) : 0;
      const std::size_t whole = number > 0 ? closed(t, at + 3) : 0;
      if (place == &with.base && !external_.empty() && whole >= number && whole > 0 &&
          whole <= end && (coupled || t[at + 2].is("SBASE"))) {
        const std::size_t first = t[open].begin, behind = t[whole - 1].end;
        const std::string bracket = src_.text.substr(first, t[number - 1].end - first);
        with.carrier = kCarrier + bracket;
        *place = kBase + bracket + src_.text.substr(behind, t[end - 1].end - behind);
      }
      at = end;
    }
    return with;
  }

  /// One operand; 0: not understood.
  std::size_t operand(const Line& line, std::size_t at, Target& target) const {
    const Tokens& t = line.tokens;
    target.type.clear();
    target.name.clear();
    target.literal.reset();
    if (sign_at(t, at, '{')) {
      target.literal = literal_at(t, at);
      if (!target.literal) return 0;
      target.type = type_of(*target.literal);
      return closed(t, at);
    }
    if (sign_at(t, at, '(')) {
      const std::size_t end = closed(t, at);
      Target inner;
      if (end == 0 || expression(line, at + 1, inner) + 1 != end) return 0;
      target.type = inner.type;
      return end;
    }
    if (at >= t.size() || t[at].kind != Kind::kWord) return 0;
    const std::string& word = t[at].word;
    if (sign_at(t, at + 1, '(')) {
      target.type = types_.of_function(module_, word);
      return closed(t, at + 1);
    }
    return variable(line, at, target);
  }

  std::size_t variable(const Line& line, std::size_t at, Target& target) const {
    const Tokens& t = line.tokens;
    const std::string& word = t[at].word;
    target.name = word;
    std::vector<std::string> components;
    for (++at; sign_at(t, at, '[') || (sign_at(t, at, '.') && at + 1 < t.size());) {
      if (sign_at(t, at, '.')) {
        components.push_back(t[at + 1].word);
        target.name += "." + t[at + 1].word;
        at += 2;
        continue;
      }
      const std::size_t end = closed(t, at);
      if (end == 0) return 0;
      for (; at < end; ++at) target.name += t[at].word;
    }
    target.type = types_.of_variable(module_, line.number, word, components);
    if (target.type.empty() && components.empty() && stays(word, false, false))
      target.type = "E6AXIS";
    return at;
  }

  /// Operands with ':' between them: of the type of the last.
  std::size_t expression(const Line& line, std::size_t at, Target& target) const {
    target.begin = at;
    std::size_t end = operand(line, at, target);
    while (end > 0 && sign_at(line.tokens, end, ':')) {
      end = operand(line, end + 1, target);
      target.name.clear();
      target.literal.reset();
    }
    target.end = end;
    return end;
  }

  static std::string type_of(const Literal& literal) {
    if (!literal.type.empty()) return literal.type;
    if (std::ranges::any_of(kAxes, [&](const char* n) { return literal.parts.count(n) > 0; }))
      return "E6AXIS";
    return literal.parts.count("S") + literal.parts.count("T") + literal.parts.count("E1") > 0
               ? "E6POS"
               : "FRAME";
  }

  static bool whole(const Literal& literal, bool ptp) {
    const std::string type = type_of(literal);
    if (type == "E6AXIS" || type == "AXIS") return has_all(literal, kAxes);
    const bool posture = literal.parts.count("S") > 0 && literal.parts.count("T") > 0;
    return has_all(literal, kPlace) && (type == "FRAME" || !ptp || posture);
  }

  void wrap(const Line& line, const Target& target, const std::string& function,
            const std::string& more = {}) {
    const std::size_t begin = line.tokens[target.begin].begin;
    const std::size_t end = line.tokens[target.end - 1].end;
    edits_.push_back({begin, begin, (in_a_word(src_.text, begin) ? kParted : "") + function + "("});
    if (target.literal && target.literal->type.empty())
      edits_.push_back({begin + 1, begin + 1, target.type + kTyped});
    edits_.push_back({end, end, more + ")"});
  }

  /// The reason for a point that stays; empty: it is corrected.
  const char* left(const Line& line, const std::string& name) const {
    const std::string variable = variable_of(name);
    if (leave_.count(name) + leave_.count(variable) > 0) return "--leave";
    return stays(name, types_.own(module_, line.number, variable), false)
               ? "home or mastering reference"
               : "";
  }

  /// Rewrites the point at tokens[at]. Returns the index after it; 0 after a refusal.
  std::size_t to(const Line& line, std::size_t at) {
    Target target;
    if (expression(line, at, target) == 0)
      return refuse(Why::kPartial, line, "line " + std::to_string(line.number)), 0;
    const std::string what =
        target.name.empty() ? "line " + std::to_string(line.number) : target.name;
    const std::string name = target.name.empty() ? upper_case(what) : target.name;
    seen_.insert({name, variable_of(name)});
    const bool ptp = kPtp.count(line.tokens[0].word) > 0;
    const bool odd = typed_by_us(src_.text, line.tokens, target.begin);
    if (odd || (target.literal && !whole(*target.literal, ptp)))
      return refuse(Why::kPartial, line, what), 0;
    const auto functions =
        std::ranges::find(kFunctions, target.type, [](const Functions& f) { return f.type; });
    if (functions == kFunctions.end()) return refuse(Why::kUnknownPoint, line, what), 0;
    // Of a POS or FRAME that stays CELLCAL_FIX would not know, and a motion after it would begin elsewhere.
    const bool own = !functions->stay.empty() && own_.whole(module_, line.number, target.name);
    const std::string why = left(line, name);
    if (!why.empty()) result_.left.emplace(target.name.empty() ? what : name, why);
    if (!why.empty() || states_own_position(target.name) || own) {
      if (!functions->stay.empty()) wrap(line, target, functions->stay);
      return target.end;
    }
    if (refuse_own(line, target.begin, target.end, target.name)) return 0;
    if (refuse_fixed_tool(line, what)) return 0;
    return fix(line, target, *functions, ptp) ? target.end
                                              : (refuse(Why::kUnknownPoint, line, what), 0);
  }

  /// True if tokens [begin, end) take the arm's own position.
  bool refuse_own(const Line& line, std::size_t begin, std::size_t end, const std::string& name) {
    const std::string source = own_.source(module_, line, begin, end);
    if (!source.empty()) refuse(Why::kOwnPosition, line, name.empty() ? source : name);
    return !source.empty();
  }

  bool refuse_fixed_tool(const Line& line, const std::string& what) {
    const std::string mode = upper_case(with_of(line.tokens, spline_).mode);
    // SIPO_MODE(FP1.IPO_FRAME)
    const std::size_t name = mode.find('(') + 1;
    const auto frame = frames_.find(mode.substr(name, mode.find('.') - name));
    const bool fixed = mode.empty()             ? in_tcp_
                       : frame != frames_.end() ? frame->second.external
                                                : mode == "#TCP";
    if (fixed) refuse(Why::kExternalTool, line, what);
    return fixed;
  }

  /// False: no function for this type here.
  bool fix(const Line& line, const Target& target, const Functions& functions, bool ptp) {
    const With with = with_of(line.tokens, spline_);
    const bool axes = target.type == "E6AXIS" || target.type == "AXIS";
    const bool in = axes ? !(with.tool + with.load).empty() : with.any();
    const std::string& function = in    ? (ptp ? functions.ptp_in : functions.path_in)
                                  : ptp ? functions.ptp
                                        : functions.path;
    if (function.empty()) return false;
    const auto given = [](const std::string& text, const char* active) {
      return "," + (text.empty() ? std::string(active) : text);
    };
    std::string more;
    if (in) more = given(with.tool, "$TOOL");
    if (in && !axes) more += given(with.base, "$BASE") + given(with.mode, "$IPO_MODE");
    if (in) more += given(with.load, "$LOAD");
    if (in && !axes && !external_.empty()) more += "," + with.carrier;
    wrap(line, target, function, more);
    spoken_ = true;
    return true;
  }

  void relative(const Line& line) {
    const Tokens& t = line.tokens;
    const std::string what = "line " + std::to_string(line.number), key = upper_case(what);
    seen_.insert(key);
    if (leave_.count(key) > 0) {
      result_.left.emplace(what, "--leave");
      return;
    }
    Target target;
    const std::size_t end = expression(line, 1, target);
    const bool in_tool = std::ranges::any_of(t, [](const Token& one) { return one.is("#TOOL"); });
    const bool axes = target.type == "E6AXIS";
    const bool understood =
        end > 0 && kRelativeWays.count(t[0].word) > 0 && !with_of(t, spline_).any() &&
        (axes || target.type == "FRAME") &&
        (!axes || t[0].word.starts_with("PTP") || t[0].word.starts_with("SPTP"));
    const auto turns = [&] {
      return std::ranges::any_of(std::array{"A", "B", "C"}, [&](const char* name) {
        const auto part = target.literal->parts.find(name);
        return part != target.literal->parts.end() && part->second != 0.0;
      });
    };
    if (!understood || typed_by_us(src_.text, t, 1) ||
        (target.literal && !axes && !in_tool && turns()))
      return refuse(Why::kRelativeMotion, line, t[0].word);
    if (refuse_own(line, target.begin, target.end, target.name) || refuse_fixed_tool(line, what))
      return;
    std::string missing;
    std::vector<std::string> names(axes ? kAxes.begin() : kPlace.begin(),
                                   axes ? kAxes.end() : kPlace.end());
    if (axes) names.insert(names.end(), external_.begin(), external_.end());
    for (const std::string& name : names)
      if (target.literal && target.literal->parts.count(name) == 0)
        missing += (missing.empty() ? kAdded : ",") + name + kNothing;
    if (!missing.empty()) {
      const std::size_t brace = t[target.end - 1].begin;
      edits_.push_back({brace, brace, missing});
    }
    wrap(line, target, axes ? kByAxes : in_tool ? kByTool : kByBase);
    ++result_.corrected;
  }

  const KrlFile& src_;
  std::size_t module_;
  const Types& types_;
  const std::set<std::string>& leave_;
  const std::vector<std::string>& external_;
  const calib::ExternalAxes& apart_;
  const std::map<std::string, FrameData>& frames_;  ///< of inline forms
  const OwnPosition& own_;
  std::set<std::string>& seen_;
  bool in_tcp_ = false;  ///< a line above has the tool fixed in the cell
  With spline_;
  bool spoken_ = false;  ///< a point of this line is corrected
  std::vector<Edit> edits_;
  RewrittenModule result_;
};

/// True if restored() gives the original, byte for byte.
bool comes_back(const KrlFile& fresh, const std::string& before) {
  try {
    return restored(fresh) == before;
  } catch (const calib::FileError&) {
    return false;
  }
}

/// With slashes, in lower case.
std::string path_of(const KrlFile& file) {
  std::string path = "/" + lower_case(file.name);
  std::ranges::replace(path, '\\', '/');
  return path;
}

/// CELLCAL_FIX itself, and the controller's and its options' own modules.
bool stays_as_it_is(const std::string& path) {
  return path.ends_with("/cellcal_fix.src") || path.find("/r1/system/") != std::string::npos ||
         path.find("/r1/tp/") != std::string::npos;
}

void leave_what_exists(const std::vector<std::string>& leave, const std::set<std::string>& seen) {
  for (const std::string& name : leave)
    if (seen.count(name) == 0)
      throw calib::FileError("--leave: no motion goes to a point " + calib::shown(name));
}

/// Cuts one call at tokens[at] down to its first argument.
void restore_call(const KrlFile& src, const Line& line, std::size_t at, std::vector<Edit>& edits) {
  const Tokens& t = line.tokens;
  const std::size_t end = sign_at(t, at + 1, '(') ? closed(t, at + 1) : 0;
  const bool again =
      std::any_of(t.begin() + static_cast<std::ptrdiff_t>(at) + 1,
                  t.begin() + static_cast<std::ptrdiff_t>(std::max(end, at + 1)), is_ours);
  if (end < at + 4 || again)
    throw calib::FileError(src.name, ":" + std::to_string(line.number) + ": " + t[at].word +
                                         " is not as cellcal writes it. Edit the line by hand");
  const std::size_t first = next_comma(t, at + 2, end - 1);
  std::size_t begin = t[at].begin;
  const std::string_view before = std::string_view(src.text).substr(0, begin);
  if (before.ends_with(kParted) && in_a_word(src.text, begin - std::string_view(kParted).size()))
    begin -= std::string_view(kParted).size();
  edits.push_back({begin, t[at + 1].end, ""});
  if (typed_by_us(src.text, t, at + 2))
    edits.push_back({t[at + 3].begin, t[at + 4].begin + std::string_view(kTyped).size(), ""});
  const std::size_t cut = t[first - 1].end;
  if (t[at].word.starts_with(kByBase) && sign_at(t, first - 1, '}')) {
    const std::size_t brace = t[first - 1].begin;
    const std::size_t added = src.text.rfind(kAdded, brace);
    if (added != std::string::npos && added >= t[at + 2].end &&
        std::string_view(src.text).substr(added, brace - added).ends_with(kNothing))
      edits.push_back({added, brace, ""});
  }
  edits.push_back({cut, t[end - 1].end, ""});
}

}  // namespace

RewrittenPrograms rewrite_motions(const BackupFiles& files, const std::vector<std::string>& leave,
                                  const std::vector<std::string>& external) {
  const Types types(files);
  const OwnPosition own(files, types);
  const std::set<std::string> left(leave.begin(), leave.end());
  std::set<std::string> seen;
  Data data;
  for (const KrlFile& file : files.controller) read_data(file, data);
  // A base that they carry, or an axis of the calibration: CELLCAL_FIX has to know where they are.
  if (!external.empty() || !data.external.carried_bases.empty()) data.external = {};
  RewrittenPrograms result;
  const bool of_r1 = std::ranges::find(files.controller, "/system/$config.dat", path_of) !=
                     files.controller.end();  // a backup of the folder R1 alone
  for (std::size_t i = 0; i < files.modules.size(); ++i) {
    const KrlFile& src = files.modules[i].src;
    if (stays_as_it_is((of_r1 ? "/r1" : "") + path_of(src))) continue;
    Data declared;
    declared.frames = data.frames;
    if (files.modules[i].dat) read_data(*files.modules[i].dat, declared);
    Rewriter rewriter(src, i, types, left, external, data.external, declared.frames, own, seen);
    if (is_kukas_program(src.name))
      rewriter.leave();
    else
      rewriter.read();
    result.modules.push_back(rewriter.result());
    KrlFile fresh{src.name, rewriter.text()};
    if (!rewriter.result().refusals.empty() || fresh.text == src.text) continue;
    if (comes_back(fresh, src.text)) {
      result.files.push_back(std::move(fresh));
      continue;
    }
    result.modules.back().corrected = 0;
    result.modules.back().refusals.push_back({Why::kNotRestored, src.name, 1, src.name});
  }
  leave_what_exists(leave, seen);
  return result;
}

std::string restored(const KrlFile& src) {
  std::vector<Edit> edits;
  for (const Line& line : read_lines(src))
    for (std::size_t at = 0; at < line.tokens.size(); ++at)
      if (is_ours(line.tokens[at])) {
        if (motion_kind(line) == MotionKind::kNone)
          throw calib::FileError(src.name, ":" + std::to_string(line.number) + ": " +
                                               line.tokens[at].word +
                                               " outside of a motion: not written by cellcal");
        restore_call(src, line, at, edits);
      }
  if (edits.empty()) throw calib::FileError(src.name, ": no motion is corrected at run time");
  return edited(src.text, edits);
}

}  // namespace cellcal::daemon::krl

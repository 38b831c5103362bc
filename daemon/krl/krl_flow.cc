#include "daemon/krl/krl_flow.h"

#include "daemon/krl/krl_calls.h"
#include "daemon/krl/krl_state.h"

namespace cellcal::daemon::krl {

namespace {

/// Beyond these a program's ways are not followed: its postures are unknown.
constexpr std::size_t kMostWays = 4000, kMostCalls = 16;

}  // namespace

void Flow::follow(const Way& way, Before& before, std::vector<Way>& open) const {
  const auto& [at, calls] = way;
  const Place& place = places_[static_cast<std::size_t>(at)];
  if (place.kind == Kind::kMotion) {
    before.motions.insert(place.motion);
    const auto [first, last] = others_.equal_range(place.motion);
    for (auto one = first; one != last; ++one) before.motions.insert(one->second);
  } else if (place.kind == Kind::kJoin) {
    for (const int from : place.from) open.emplace_back(from, calls);
  } else if (place.kind == Kind::kCall) {
    const auto routine = routines_.find(place.routine);
    if (routine == routines_.end() || calls.size() >= kMostCalls) {
      before.lost = place.why;
      return;
    }
    std::vector<int> inside = calls;
    inside.push_back(at);
    open.emplace_back(routine->second.second, std::move(inside));
  } else if (!calls.empty()) {
    const Place& call = places_[static_cast<std::size_t>(calls.back())];
    if (routines_.at(call.routine).first == at)  // the caller's place
      open.emplace_back(call.from.front(), std::vector<int>(calls.begin(), calls.end() - 1));
    else
      before.lost = call.why;
  } else if (const auto callers = callers_.find(at); callers != callers_.end()) {
    for (const int from : callers->second) open.emplace_back(from, calls);
  } else {
    before.lost = place.why;
  }
}

void Flow::only_called(const RoutineKey& routine, std::size_t statements) {
  const auto calls = calls_.find(routine);
  const auto places = routines_.find(routine);
  if (calls != calls_.end() && places != routines_.end() && calls->second.size() == statements)
    callers_[places->second.first] = calls->second;
}

Before Flow::before(int place) const {
  Before before;
  std::set<Way> seen;
  std::vector<Way> open = {{place, {}}};
  while (!open.empty() && !before.lost) {
    Way way = std::move(open.back());
    open.pop_back();
    if (seen.size() > kMostWays) before.lost = Lost{};
    const auto [at, fresh] = seen.insert(std::move(way));
    if (fresh) follow(*at, before, open);
  }
  return before;
}

std::vector<std::vector<int>> Flow::next() const {
  std::vector<std::vector<int>> next(places_.size());
  for (std::size_t i = 0; i < places_.size(); ++i) {
    const auto callers = callers_.find(static_cast<int>(i));
    for (const int from : callers != callers_.end() ? callers->second : places_[i].from)
      next[static_cast<std::size_t>(from)].push_back(static_cast<int>(i));
  }
  return next;
}

std::vector<std::pair<int, Lost>> Flow::beginnings() const {
  std::vector<std::pair<int, Lost>> all;
  for (std::size_t i = 0; i < places_.size(); ++i)
    if (places_[i].kind == Kind::kLost && callers_.count(static_cast<int>(i)) == 0)
      all.emplace_back(static_cast<int>(i), places_[i].why);
  return all;
}

FlowReader::FlowReader(Flow& flow, std::size_t module, std::string own)
    : flow_(flow), module_(module), own_(std::move(own)), routine_(own_) {
  now_ = entry_ = flow_.lost({});
  exit_ = flow_.join();
}

void FlowReader::end() {
  if (routine_.empty()) return;
  flow_.lead(now_, exit_);
  flow_.keep({module_, routine_}, entry_, exit_);
  routine_.clear();
}

void FlowReader::finish() {
  end();
  for (const std::string& name : locals_) flow_.only_called({module_, name}, words_[name] - 1);
}

void FlowReader::begin(const Line& line) {
  end();
  routine_ = routine_name(line);
  if (std::exchange(begun_, true) && !line.tokens[0].is("GLOBAL") && routine_ != own_)
    locals_.push_back(routine_);
  blocks_.clear();
  labels_.clear();
  now_ = entry_ = flow_.lost({line.tokens[0].word, line.number});
  exit_ = flow_.join();
}

int FlowReader::label(const std::string& name) {
  const auto at = labels_.find(name);
  return at != labels_.end() ? at->second : labels_.emplace(name, flow_.join()).first->second;
}

void FlowReader::open(const std::string& word) {
  Block block;
  block.loop = word != "IF" && word != "SWITCH";
  block.entry = block.loop ? flow_.join({now_}) : now_;
  const bool skipped = word == "FOR" || word == "WHILE";
  block.exit = skipped ? flow_.join({block.entry}) : flow_.join();
  now_ = word == "SWITCH" ? flow_.join() : block.entry;
  blocks_.push_back(block);
}

/// False: the end of a block that was not opened.
bool FlowReader::close(const std::string& word) {
  if (blocks_.empty()) return false;
  const Block block = blocks_.back();
  blocks_.pop_back();
  if (block.loop) flow_.lead(now_, block.entry);
  if (!block.loop || word == "UNTIL") flow_.lead(now_, block.exit);
  if (!block.loop && !block.all_cases) flow_.lead(block.entry, block.exit);
  now_ = block.exit;
  return block.loop == (word != "ENDIF" && word != "ENDSWITCH");
}

void FlowReader::next_case(bool last) {
  if (blocks_.empty() || blocks_.back().loop) return;
  flow_.lead(now_, blocks_.back().exit);
  now_ = blocks_.back().entry;
  blocks_.back().all_cases = blocks_.back().all_cases || last;
}

void FlowReader::leave_loop() {
  const int from = stop();
  for (auto block = blocks_.rbegin(); block != blocks_.rend(); ++block)
    if (block->loop) return flow_.lead(from, block->exit);
}

void FlowReader::control(const Line& line) {
  const auto& t = line.tokens;
  const std::string& word = t[0].word;
  for (const Token& one : t) words_[one.word] += one.kind == Token::Kind::kWord ? 1 : 0;
  if (begins_routine(line)) return begin(line);
  if (t[0].kind != Token::Kind::kWord) return;
  if (FrameState::blocks(line) > 0) return open(word);
  if (FrameState::blocks(line) < 0) {
    if (!close(word)) lose({word, line.number});
  } else if (word == "ELSE" || word == "CASE" || word == "DEFAULT") {
    next_case(word != "CASE");
  } else if (word == "EXIT") {
    leave_loop();
  } else if (word == "GOTO" && t.size() > 1) {
    flow_.lead(stop(), label(t[1].word));
  } else if (word == "RETURN") {
    flow_.lead(stop(), exit_);
  } else if (t.size() == 2 && is_sign_of(t[1], ':')) {
    flow_.lead(now_, label(word));
    now_ = label(word);
  } else if (word == "END" || word == "ENDFCT") {
    end();
    lose({});
  }
}

}  // namespace cellcal::daemon::krl

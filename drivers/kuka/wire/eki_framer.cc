#include "drivers/kuka/wire/eki_framer.h"

namespace cellcal::drivers {
namespace {

bool is_space(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }

bool starts_name(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }

}  // namespace

void EkiFramer::reset() {
  state_ = State::kOutside;
  size_ = name_size_ = matched_ = skipped_ = 0;
  quote_ = last_ = '\0';
}

EkiFramer::Event EkiFramer::keep(char c) {
  if (size_ == bytes_.size()) return Event::kOversized;
  bytes_[size_++] = c;
  return Event::kNone;
}

EkiFramer::Event EkiFramer::push(char c) {
  if (state_ == State::kOutside) {
    size_ = name_size_ = 0;
    if (c == '<') {
      skipped_ = 0;
      state_ = State::kOpened;
      return keep(c);
    }
    // Some peers pad their messages with NUL to a fixed size.
    if (!is_space(c) && c != '\0') ++garbage_;
    return ++skipped_ > kMaxEkiDocument ? Event::kOversized : Event::kNone;
  }
  if (state_ == State::kProlog) {
    if (c == '>') state_ = State::kOutside;
    return ++skipped_ > kMaxEkiDocument ? Event::kOversized : Event::kNone;
  }
  if (state_ == State::kOpened && !starts_name(c)) {
    const bool prolog = c == '?' || c == '!';
    garbage_ += prolog ? 0 : 2;
    state_ = prolog ? State::kProlog : State::kOutside;
    return Event::kNone;
  }
  if (const Event full = keep(c); full != Event::kNone) return full;
  switch (state_) {
    case State::kOpened:
      state_ = State::kName;
      name_size_ = 1;
      return Event::kNone;
    case State::kName:
      if (!is_space(c) && c != '/' && c != '>') {
        ++name_size_;
        return Event::kNone;
      }
      state_ = State::kRootTag;
      quote_ = last_ = '\0';
      return on_root_tag(c);
    case State::kRootTag:
      return on_root_tag(c);
    case State::kBody:
      if (c == '<') state_ = State::kBodyTag;
      return Event::kNone;
    case State::kBodyTag:
      matched_ = 0;
      state_ = c == '/' ? State::kClosing : State::kBody;
      return Event::kNone;
    case State::kClosing:
      return on_closing(c);
    case State::kOutside:
    case State::kProlog:
      break;
  }
  return Event::kNone;
}

EkiFramer::Event EkiFramer::on_root_tag(char c) {
  if (quote_ != '\0') {
    if (c == quote_) quote_ = '\0';
    return Event::kNone;
  }
  if (c == '"' || c == '\'') {
    quote_ = c;
  } else if (c == '>') {
    const bool empty = last_ == '/';
    state_ = empty ? State::kOutside : State::kBody;
    return empty ? Event::kDocument : Event::kNone;
  }
  last_ = c;
  return Event::kNone;
}

EkiFramer::Event EkiFramer::on_closing(char c) {
  if (matched_ < name_size_) {
    if (c == name()[matched_]) {
      ++matched_;
    } else {
      state_ = c == '<' ? State::kBodyTag : State::kBody;
    }
    return Event::kNone;
  }
  if (is_space(c)) return Event::kNone;
  if (c == '>') {
    state_ = State::kOutside;
    return Event::kDocument;
  }
  state_ = c == '<' ? State::kBodyTag : State::kBody;
  return Event::kNone;
}

}  // namespace cellcal::drivers

#include "daemon/readiness/examiner.h"

#include <algorithm>

#include "daemon/readiness/evidence.h"

namespace cellcal::daemon {

std::size_t Examination::count(Outcome outcome) const {
  return static_cast<std::size_t>(std::count_if(
      checks.begin(), checks.end(), [&](const Finding& one) { return one.outcome == outcome; }));
}

Examiner::~Examiner() { stop(); }

void Examiner::stop() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  thread_.request_stop();
  if (thread_.joinable()) thread_.join();
}

void Examiner::begin(const std::filesystem::path& cell) {
  Examination begun;
  begun.cell = cell;
  begun.running = true;
  begun.cell_text = text_of_cell(cell);
  parts_.hold();  // at most one holds, and the thread before it is at its end
  const std::lock_guard lock(mutex_);
  if (ending_) return parts_.release();
  newest_ = std::move(begun);
  thread_ = std::jthread([this, cell](const std::stop_token& stop) { examine(cell, stop); });
}

void Examiner::examine(const std::filesystem::path& cell, const std::stop_token& stop) {
  Findings findings([this](const Finding& one) {
    const std::lock_guard lock(mutex_);
    newest_.checks.push_back(one);
  });
  const auto hint = [this](const std::string& words) {
    const std::lock_guard lock(mutex_);
    newest_.hint = words;
  };
  try {
    parts_.look(cell, findings, hint, stop);
  } catch (const std::exception& error) {
    findings.fail("doctor", error.what(), "run 'cellcal doctor' on the cell's computer");
  }
  {
    const std::lock_guard lock(mutex_);
    newest_.running = false;
    newest_.whole = !stop.stop_requested();
    newest_.hint.clear();
    newest_.ended = parts_.utc_now();
  }
  parts_.release();
}

Examination Examiner::newest() const {
  const std::lock_guard lock(mutex_);
  return newest_;
}

}  // namespace cellcal::daemon

#include "daemon/plant/desk/journal_outbox.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "daemon/files/atomic_file.h"
#include "daemon/plant/messages/fact.h"

namespace cellcal::daemon::plant {

namespace {

constexpr double kBytesPerMegabyte = 1e6;
/// Limit of facts returned at once, beyond the first.
constexpr std::size_t kMostBytes = std::size_t{4} << 20;

CellName name_of(const PlantConfig& config) { return {config.plant, config.cell}; }

/// Maps the journal's failures to OutboxError.
template <class F>
auto asked(F of_the_journal) try {
  return of_the_journal();
} catch (const JournalError& failed) {
  throw OutboxError(failed.what());
}

}  // namespace

JournalOutbox::JournalOutbox(Parts parts)
    : parts_(std::move(parts)),
      reporter_(std::make_shared<const PlantReporter>(PlantReporter::Parts{
          parts_.config.touches,
          static_cast<std::int64_t>(parts_.config.outbox_megabytes * kBytesPerMegabyte),
          name_of(parts_.config), parts_.config.former, parts_.waits})) {
  parts_.journal.report_to(reporter_);
}

JournalOutbox::~JournalOutbox() { parts_.journal.report_no_more_to(*reporter_); }

WaitingCount JournalOutbox::count() {
  return asked([&] {
    const OutboxCount all = parts_.journal.outbox();
    return WaitingCount{all.source, all.newest, all.rows, all.elsewhere, all.elsewhere_address};
  });
}

void JournalOutbox::acknowledge(const std::vector<std::int64_t>& rows) {
  asked([&] { parts_.journal.acknowledge(rows); });
}

std::vector<WaitingFact> JournalOutbox::facts(std::int64_t after, std::size_t most) {
  std::vector<WaitingFact> all;
  std::size_t bytes = 0;
  try {
    for (const WaitingReport& row : parts_.journal.waiting(after, most)) {
      WaitingFact next = composed(row);
      bytes += next.text.size();
      if (!all.empty() && bytes > kMostBytes) break;
      all.push_back(std::move(next));
    }
  } catch (const JournalError& failed) {
    if (all.empty()) throw OutboxError(failed.what());
  }
  return all;
}

/// Throws JournalError where composing may succeed later.
WaitingFact JournalOutbox::composed(const WaitingReport& row) {
  const auto as_message = [&](const FactBody& body) {
    return WaitingFact{
        row.row,
        row.source,
        row.number,
        row.session,
        kind_of(body),
        worth_of(body),
        to_json(Fact{name_of(parts_.config), row.source, row.number, row.time, row.session, body})};
  };
  std::size_t bytes = row.report.body.size();
  if (bytes <= kLargestMessage) {
    WaitingFact fact = as_message(body_of(row));
    bytes = fact.text.size();
    if (bytes <= kLargestMessage) return fact;
  }
  // No plant accepts it, and later facts must not wait for it.
  const DroppedFact dropped{row.number,
                            row.number,
                            1,
                            DropReason::kTooLarge,
                            row.report.kind,
                            static_cast<std::int64_t>(bytes)};
  spdlog::error(
      "[plant]: fact {}: {} bytes ({} of session {}), limit {}. Not sent; a notice is sent "
      "instead. Transfer it by hand",
      row.number, bytes, row.report.kind, row.session, kLargestMessage);
  parts_.journal.replace(row.row, report_of(dropped));
  return as_message(dropped);
}

/// A fact that cannot be composed is reported as dropped: its number is used. Throws JournalError where
/// composing may succeed later.
FactBody JournalOutbox::body_of(const WaitingReport& row) try {
  std::string body = row.report.body;
  if (body.empty()) {
    const auto session = parts_.journal.session(row.session);
    if (!session) throw std::runtime_error(fmt::format("session {} is not there", row.session));
    body = reporter_->calibration(*session, parts_.journal.touches(row.session)).body;
  }
  return body_from_json(row.report.kind, body);
} catch (const DamagedError& damaged) {
  const std::lock_guard lock(mutex_);
  if (logged_damaged_.insert(row.row).second)
    spdlog::error(
        "[plant]: fact {} ({} of session {}): damaged, not sent; a notice is sent instead. {}",
        row.number, row.report.kind, row.session, printable(damaged.what()));
  return DroppedFact{row.number,           row.number,      1,
                     DropReason::kDamaged, row.report.kind, std::nullopt};
} catch (const JournalError&) {
  throw;  // possibly a temporary disk error: the result is not dropped
} catch (const std::exception& failed) {
  return AlarmFact{
      "failed",
      fmt::format("{} of session {} could not be published", row.report.kind, row.session),
      failed.what()};
}

}  // namespace cellcal::daemon::plant

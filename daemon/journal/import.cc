// Rows of another journal's session, taken into this one.

#include <fmt/format.h>

#include <algorithm>

#include "calib/files/files.h"
#include "calib/files/input_file.h"
#include "daemon/journal/journal_impl.h"
#include "daemon/journal/known_rows.h"
#include "daemon/journal/rows.h"

namespace cellcal::daemon {

namespace {

std::vector<std::string> columns_of(Database& database, const std::string& table) {
  return Statement(database, ("SELECT * FROM " + table).c_str()).column_names();
}

/// One session's rows, row by row, under a new number.
class Import {
 public:
  Import(Database& database, Chain& chain, const SessionRows& rows, const std::string& origin,
         const std::string& from)
      : database_(database), chain_(chain), rows_(rows), origin_(origin), from_(from) {}

  std::int64_t run() {
    const auto session = std::find_if(
        rows_.entries.begin(), rows_.entries.end(),
        [](const RowEntry& entry) { return entry.table == "session" && !entry.names.empty(); });
    if (session == rows_.entries.end()) refuse("the session's own row is missing");
    insert(*session);
    id_ = database_.last_row_id();
    chain_.add(id_, "session", id_);
    for (const RowEntry& entry : rows_.entries) {
      if (entry.names.empty() || &entry == &*session) continue;
      if (entry.table == "session") refuse("it holds more than one session");
      insert(entry);
      chain_.add(id_, entry.table.c_str(), database_.last_row_id());
    }
    return id_;
  }

 private:
  [[noreturn]] void refuse(const std::string& why) const {
    throw JournalError(from_ + ": " + why + ": damaged or altered. Export the session again");
  }

  void insert(const RowEntry& entry) {
    if (std::find(std::begin(kChainedTables), std::end(kChainedTables), entry.table) ==
        std::end(kChainedTables))
      refuse("there is no table '" + entry.table + "'");
    const std::vector<std::string> known = columns_of(database_, entry.table);
    std::string names, places;
    for (const std::string& name : entry.names)
      if (std::find(known.begin(), known.end(), name) == known.end())
        refuse("table '" + entry.table + "' has no column '" + name + "'");
    // The digest is of the values in their order; versions only append columns.
    if (entry.names.size() > known.size() ||
        !std::equal(entry.names.begin(), entry.names.end(), known.begin()))
      refuse("the columns of table '" + entry.table + "' are not those of any version");
    for (const std::string& name : entry.names) {
      names += (names.empty() ? "" : ", ") + name;
      places += places.empty() ? "?" : ",?";
    }
    Statement insert(
        database_,
        fmt::format("INSERT INTO {} ({}) VALUES ({})", entry.table, names, places).c_str());
    for (std::size_t i = 0; i < entry.names.size(); ++i)
      insert.bind(static_cast<int>(i) + 1, value(entry, i));
    insert.step();
    if (entry.table == "session") mark();
  }

  /// As it was written, but for the session's number.
  Value value(const RowEntry& entry, std::size_t column) const {
    const std::string& name = entry.names[column];
    if (entry.table != "session") return name == "session" ? Value(id_) : entry.columns[column];
    return name == "id" ? Value() : entry.columns[column];
  }

  /// Nobody runs it here.
  void mark() {
    const std::int64_t id = database_.last_row_id();
    Statement select(database_, "SELECT state FROM session WHERE id=?");
    select.bind(1, id).step();
    const std::string text = select.text(0);
    RecordState state = record_state_of(text);
    if (state == RecordState::kDamaged) refuse("there is no state '" + text + "'");
    if (state == RecordState::kRunning) state = RecordState::kInterrupted;
    Statement update(database_, "UPDATE session SET state=?, origin=? WHERE id=?");
    update.bind(1, std::string_view(to_string(state)))
        .bind(2, std::string_view(origin_))
        .bind(3, id)
        .step();
  }

  Database& database_;
  Chain& chain_;
  const SessionRows& rows_;
  const std::string& origin_;
  const std::string& from_;
  std::int64_t id_ = 0;
};

}  // namespace

std::string Journal::name() {
  const std::lock_guard lock(impl_->mutex);
  return impl_->chain.name();
}

std::string Journal::rows(std::int64_t session) {
  if (!impl_->pending.all().empty()) impl_->write([] {});
  const std::lock_guard lock(impl_->mutex);
  impl_->chain.verify(session);
  return to_lines(read_rows(impl_->database, impl_->chain.name(), session));
}

std::pair<std::int64_t, bool> Journal::import(const std::string& lines, const std::string& from,
                                              std::optional<std::size_t> stated_touches) {
  const SessionRows rows = parse_lines(lines, from);
  if (stated_touches && *stated_touches != touches_in(rows))
    throw JournalError(fmt::format(
        "{}: it holds {} of {} touches that the export states: damaged or altered. Export "
        "the session again",
        from, touches_in(rows), *stated_touches));
  refuse_impossible(rows, from);
  const std::string sum = calib::sha256(lines), earlier = calib::sha256(to_lines_without_sum(rows));
  const std::vector<SessionRecord> all = sessions();
  for (const SessionRecord& there : all)
    if (there.origin && (there.origin->sum == sum || there.origin->sum == earlier))
      return {there.id, false};
  // Its own, and nothing has happened to it since.
  if (rows.journal == name() && session(rows.session) && this->rows(rows.session) == to_lines(rows))
    return {rows.session, false};
  const std::string origin = to_text({rows.journal, rows.session, sum, rows.entries.size(),
                                      sum_of_entries(rows, rows.entries.size())});
  std::int64_t id = 0;
  impl_->write([&] {
    hold_against_known(impl_->database, impl_->chain.name(), rows, from);
    id = Import(impl_->database, impl_->chain, rows, origin, from).run();
  });
  return {id, true};
}

}  // namespace cellcal::daemon

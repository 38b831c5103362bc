// Searches for spheres, as they were before the arm went there: for a session that begins where one was left.

#include <cstring>

#include "daemon/journal/journal_impl.h"

namespace cellcal::daemon {

namespace {

std::string blob_of(const std::vector<calib::JointVector>& postures) {
  std::string bytes;
  for (const calib::JointVector& posture : postures)
    bytes.append(reinterpret_cast<const char*>(posture.data()), posture.size() * sizeof(double));
  return bytes;
}

std::vector<calib::JointVector> postures(const std::string& bytes, std::int64_t axes) {
  const auto size = static_cast<std::size_t>(axes) * sizeof(double);
  if (axes < 0 || (size == 0 ? !bytes.empty() : bytes.size() % size != 0))
    throw DamagedError(std::to_string(bytes.size()) +
                       " bytes where the journal has postures: not as it was written");
  std::vector<calib::JointVector> all(size == 0 ? 0 : bytes.size() / size,
                                      calib::JointVector(static_cast<std::size_t>(axes)));
  for (std::size_t k = 0; k < all.size(); ++k)
    std::memcpy(all[k].data(), bytes.data() + k * size, size);
  return all;
}

}  // namespace

void Journal::record(std::int64_t session, const RecordSearch& record, const std::string& utc) {
  const calib::SearchUnderWay& search = *record.search;
  impl_->write([&] {
    Statement insert(impl_->database,
                     "INSERT INTO search (session, time, target, axes, way_rad, end_rad, out_rad) "
                     "VALUES (?,?,?,?,?,?,?)");
    insert.bind(1, session).bind(2, std::string_view(utc));
    insert.bind(3, std::string_view(search.target));
    insert.bind(4, static_cast<std::int64_t>(search.way.empty() ? 0 : search.way.front().size()));
    insert.bind_blob(5, blob_of(search.way)).bind_blob(6, blob_of({search.end}));
    insert.bind_blob(7, blob_of(search.out)).step();
    impl_->added(session, "search");
  });
}

std::optional<LeftSearch> Journal::search_left() {
  const std::lock_guard lock(impl_->mutex);
  Statement select(
      impl_->database,
      "SELECT search.session, target, axes, way_rad, end_rad, out_rad FROM search "
      "JOIN session ON session.id=search.session WHERE origin IS NULL "
      "AND NOT EXISTS (SELECT 1 FROM touch JOIN session AS later ON later.id=touch.session "
      "WHERE later.id > search.session AND later.origin IS NULL) "
      "ORDER BY search.rowid DESC LIMIT 1");
  if (!select.step()) return std::nullopt;
  LeftSearch left{select.integer(0), {}};
  impl_->chain.verify(left.session);
  left.search.target = select.text(1);
  left.search.way = postures(select.text(3), select.integer(2));
  const auto end = postures(select.text(4), select.integer(2));
  if (!end.empty()) left.search.end = end.front();
  left.search.out = postures(select.text(5), select.integer(2));
  return left;
}

}  // namespace cellcal::daemon
